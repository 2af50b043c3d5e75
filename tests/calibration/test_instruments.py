"""Which instruments could be off: readings, probes at one place or one y, gauges, and what an offset changes."""

import numpy as np
import pandas as pd

from vegglue.calibration.candidates import Instrument, error_columns, instruments_of, offset_columns


def readings(*rows: tuple[str, str, float, float]) -> pd.DataFrame:
    """kind, experiment, x and y of each."""
    return pd.DataFrame(rows, columns=["kind", "experiment", "x", "y"])


# Two experiments; sections at x = 5 and 9 with probes at y = -1, 0 and (in the first alone) 1; a gauge, and a gauging.
USED = readings(
    ("velocity", "low", 5.0, -1.0), ("velocity", "low", 5.0, 0.0), ("velocity", "low", 5.0, 1.0),
    ("velocity", "low", 9.0, -1.0), ("level", "low", 2.0, 0.0),
    ("velocity", "high", 5.0, -1.0), ("velocity", "high", 9.0, 0.0), ("level", "high", 2.0, 0.0),
    ("discharge", "high", 2.0, 0.0),
)  # fmt: skip


def rows_of(some: tuple[Instrument, ...]) -> set[tuple[int, ...]]:
    return {one.readings for one in some}


def test_every_reading_may_be_off_alone() -> None:
    found = instruments_of(USED)["reading"]
    assert [one.readings for one in found] == [(row,) for row in range(len(USED))]
    assert (found[3].x, found[3].y) == (9.0, -1.0)


def test_a_probe_may_be_off_wherever_it_stood() -> None:
    """At one place in several experiments, and at one y in several sections; what stood once is a reading."""
    found = instruments_of(USED)
    assert rows_of(found["position"]) == {(0, 5)}
    assert rows_of(found["probe"]) == {(0, 3, 5), (1, 6)}
    assert all(np.isnan(one.x) for one in found["probe"])
    assert {one.y for one in found["probe"]} == {-1.0, 0.0}
    assert (found["position"][0].x, found["position"][0].y) == (5.0, -1.0)


def test_a_probe_on_the_axis_is_one_whatever_side_of_it_was_rounded() -> None:
    """Places turned from a map lie at 0 or at -0, which were two probes."""
    turned = USED.assign(y=[-1.0, 0.0, 1.0, -1.0, -0.0, -1.0, -1e-9, 0.0, 0.0])
    for kind in ("probe", "gauge"):
        assert rows_of(instruments_of(turned)[kind]) == rows_of(instruments_of(USED)[kind])


def test_a_gauge_may_be_off_in_all_experiments_and_is_no_probe() -> None:
    found = instruments_of(USED)
    assert rows_of(found["gauge"]) == {(4, 7)}
    assert not any({4, 7, 8} & set(one.readings) for one in (*found["position"], *found["probe"]))


def test_the_same_readings_are_no_two_instruments() -> None:
    """With one section alone a probe at one y is one at one place."""
    found = instruments_of(USED[USED["x"] < 9.0].reset_index(drop=True))
    assert rows_of(found["position"]) == {(0, 4)}
    assert rows_of(found["probe"]) == set()


def test_an_offset_is_the_same_in_all_readings_of_an_instrument() -> None:
    some = (Instrument("probe", (0, 3), np.nan, 1.0), Instrument("reading", (2,), 5.0, 1.0))
    assert offset_columns(some, 4).T.tolist() == [[1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]]
    assert offset_columns((), 4).shape == (4, 0)


def test_a_probe_may_be_off_by_a_factor_too_and_a_gauge_may_not() -> None:
    value = np.array([0.3, 0.5, 0.7, 0.4])
    probe, gauge = Instrument("probe", (0, 3), np.nan, 1.0), Instrument("gauge", (1, 2), 2.0, 0.0)
    assert error_columns(probe, value).T.tolist() == [[1.0, 0.0, 0.0, 1.0], [0.3, 0.0, 0.0, 0.4]]
    assert error_columns(gauge, value).T.tolist() == [[0.0, 1.0, 1.0, 0.0]]
    assert error_columns(probe, np.zeros(4)).shape == (4, 1), "of nothing a factor is nothing"
