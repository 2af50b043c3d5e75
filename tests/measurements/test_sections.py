"""Which stations belong to one section across the channel."""

import pandas as pd

from vegglue.measurements.observations import section_places


def station(**columns: list[float] | list[str]) -> pd.DataFrame:
    return pd.DataFrame({"experiment": "low", "section": "A"} | columns)


def test_a_section_of_a_boat_has_one_place() -> None:
    boat = station(x=[10.2, 9.9, 10.0, 10.3, 9.8], y=[-2.0, -1.0, 0.0, 1.0, 2.0])
    assert section_places(boat).tolist() == [10.0] * 5


def test_stations_on_one_x_keep_its_very_bits() -> None:
    x = 0.1 + 0.2
    assert section_places(station(x=[x] * 4, y=[0.0, 1.0, 2.0, 3.0])).tolist() == [x] * 4


def test_stations_along_the_channel_and_nameless_ones_have_places_of_their_own() -> None:
    along = station(x=[1.0, 5.0, 9.0], y=[0.0, 0.1, 0.0])
    assert section_places(along).tolist() == [1.0, 5.0, 9.0]
    nameless = station(x=[1.0, 1.2], y=[0.0, 3.0], section=["", ""])
    assert section_places(nameless).tolist() == [1.0, 1.2]


def test_a_name_means_another_section_in_another_experiment() -> None:
    both = station(x=[1.0, 1.2, 7.0, 7.2], y=[0.0, 3.0, 0.0, 3.0], experiment=["low", "low", "high", "high"])
    assert section_places(both).tolist() == [1.1, 1.1, 7.1, 7.1]
