"""The shipped synthetic record, and files with faults: what is read, flagged, refused."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from vegglue.case.config import load_case
from vegglue.errors import InputError
from vegglue.measurements import observations
from vegglue.measurements.kinds import Unused
from vegglue.measurements.observations import (
    POINT_TYPES,
    PROFILE_TYPES,
    STATION_COLUMNS,
    STATION_TYPES,
    fitted_curve,
    read_observations,
    section_places,
    station_table,
)

ROOT = Path(__file__).parents[2]
CASES = {name: load_case(ROOT / "configs" / f"{name}.yaml") for name in ("d0", "d3a", "d3b")}
READ = {name: read_observations(case) for name, case in CASES.items()}
KEY = {"d0": ("D0", "D0"), "d3a": ("D3a", "D3"), "d3b": ("D3b", "D3")}
SHIPPED = [row for row in (ROOT / "data/kict/adv_points.csv").read_text().splitlines() if row.startswith("D3a")]
POINTS = "case,device,x,y,z,u,u_std,duration_s\n"


def changed(base, **update):
    """The case with its first observation changed."""
    observation = base.observations[0].model_copy(update=update)
    return base.model_copy(update={"observations": (observation,)})


def with_file(tmp_path, text, kind=None):
    file = tmp_path / "measured.csv"
    file.write_text(text)
    if kind is None:
        return changed(CASES["d3a"], file=file)
    nothing = dict.fromkeys(("experiment", "section", "case", "average", "floor", "surface"))
    return changed(CASES["d3a"], file=file, kind=kind, **nothing)


@pytest.mark.parametrize(("name", "verticals", "used"), [("d0", 21, 21), ("d3a", 21, 20), ("d3b", 12, 12)])
def test_every_vertical_is_a_station_and_only_the_dead_probe_is_not_used(name, verticals, used):
    table = READ[name].table
    assert tuple(table.columns) == STATION_COLUMNS
    assert list(table.index) == list(range(verticals))
    assert table["used"].sum() == used
    assert (table["used"] == (table["reason"] == "")).all()
    assert table["standard_error"].between(0.01, 0.05).all()


def types_of(table):
    """Text, or the type of numpy, of each column."""
    return {name: str if pd.api.types.is_string_dtype(one) else one.type for name, one in table.dtypes.items()}


@pytest.mark.parametrize("case", [*CASES.values(), CASES["d0"].model_copy(update={"observations": ()})])
def test_tables_have_the_types_that_all_code_relies_on(case):
    """Nothing measured included: `~table["used"]` of a column of objects would be no mask."""
    read = read_observations(case)
    for table, wanted in ((read.table, STATION_TYPES), (read.points, POINT_TYPES), (read.profiles, PROFILE_TYPES)):
        found = types_of(table)
        assert {name: np.dtype(one).type if one is not str else str for name, one in wanted.items()}.items() <= (
            found.items()
        )
        assert not table[[name for name, one in wanted.items() if one is str]].isna().any(axis=None)


def test_a_table_of_stations_is_made_of_rows_of_any_type():
    rows = READ["d0"].table.astype(object).assign(more=1)
    assert station_table(rows, rows.iloc[:0]).equals(READ["d0"].table)
    with pytest.raises(KeyError, match="device"):
        station_table(rows.drop(columns="device"))


def test_dead_probe_is_flagged_and_kept_with_all_its_points():
    flagged = READ["d3a"].table[~READ["d3a"].table["used"]]
    assert list(flagged["y"]) == [6.4]
    assert "25" in flagged["reason"].item()
    assert abs(flagged["value"].item()) < 0.01
    points = READ["d3a"].points
    assert len(points) == len(SHIPPED)
    assert set(points.loc[~points["used"], "y"]) == {6.4}


def test_stations_are_in_the_coordinates_of_the_model():
    assert set(READ["d3a"].table["x"]) == {402.0}
    assert READ["d3a"].table["depth"].max() == pytest.approx(1.32)
    bank = READ["d0"].table.set_index("y").loc[2.5, "depth"]
    assert bank == pytest.approx(1.19 - 1.5 * 0.6667)


def test_verticals_on_the_edge_of_a_patch_are_not_inside_it():
    profiles = READ["d3a"].profiles
    assert list(profiles.loc[profiles["plants"], "y"]) == [4.3, 4.6, 4.9, 5.2]
    assert not READ["d0"].profiles["plants"].any()
    experiment = CASES["d3a"].experiments["D3a"].model_copy(update={"plants": False})
    bare = CASES["d3a"].model_copy(update={"experiments": {"D3a": experiment}})
    assert not read_observations(bare).profiles["plants"].any()


@pytest.mark.parametrize("rule", ["paper", "profile"])
@pytest.mark.parametrize("name", list(KEY))
def test_discharge_is_the_known_one_within_its_error(name, rule):
    discharge = READ[name].discharge[KEY[name]][rule]
    assert abs(discharge.value - 2.66) < 2.0 * discharge.standard_error
    assert discharge.standard_error < 0.1


def test_neighbours_tell_the_error_that_was_put_on_every_vertical():
    """0.8 of the paper's sigma, which the points of a single vertical do not show."""
    for name, sigma in {"d0": 0.039, "d3a": 0.024, "d3b": 0.030}.items():
        error = READ[name].neighbour_error[KEY[name]]
        assert error == pytest.approx(0.8 * sigma, rel=0.35)
        used = READ[name].table.query("used")
        assert np.sqrt((used["standard_error"] ** 2).mean()) == pytest.approx(error, rel=1e-6)
        assert (READ[name].profiles["fitted_error"].max()) < error


@pytest.mark.parametrize(("name", "height"), [("d3a", 0.8), ("d3b", 1.06)])
def test_canopy_height_is_found(name, height):
    canopy = READ[name].canopy_height[KEY[name]]
    assert abs(canopy.value - height) < 2.0 * canopy.standard_error
    assert canopy.standard_error < 0.05


def test_rule_of_the_case_gives_the_value_and_its_error():
    profiles = READ["d3a"].profiles
    by_profile = read_observations(changed(CASES["d3a"], average="profile")).table
    assert np.array_equal(by_profile["value"], profiles["fitted"])
    assert np.array_equal(READ["d3a"].table["value"], profiles["linear"])
    difference = profiles["linear"] - profiles["fitted"]
    own = {"fitted": profiles["fitted_error"], "linear": np.hypot(profiles["linear_error"], difference / np.sqrt(3.0))}
    for table, error in ((by_profile, own["fitted"]), (READ["d3a"].table, own["linear"])):
        assert np.ptp(table["standard_error"] ** 2 - error**2) == pytest.approx(0.0, abs=1e-12)
    given = read_observations(changed(CASES["d3a"], standard_error=0.024)).table
    assert set(given["standard_error"]) == {0.024}


def test_fitted_curve_passes_through_the_points():
    row = READ["d3a"].profiles.set_index("y").loc[4.6]
    points = READ["d3a"].points.query("y == 4.6")
    miss = fitted_curve(row).velocity(points["height"].to_numpy()) - points["u"]
    assert miss.std() < 0.04
    assert fitted_curve(READ["d3a"].profiles.set_index("y").loc[6.4]) is None


def test_points_outside_the_water_are_kept_with_the_reason():
    points = read_observations(changed(CASES["d3a"], surface=-3.0)).points
    outside = points[points["reason"] == Unused.ABOVE_SURFACE]
    assert (outside["z"] > -3.0).all()
    assert not outside["used"].any()
    assert len(points) == len(SHIPPED)


def test_wrong_datum_is_refused():
    with pytest.raises(InputError, match="`floor`, `surface` and `offset`"):
        read_observations(changed(CASES["d3a"], floor=0.0, surface=1.3))


def test_files_without_turbulence_and_duration_still_get_errors(tmp_path):
    rows = [f"D3a,p,102,{y},{z},{0.3 + 0.1 * np.log(z + 4.2):.4f}" for y in (4.6, 5.8) for z in (-4, -3.7, -3.3, -3)]
    table = read_observations(with_file(tmp_path, "case,device,x,y,z,u\n" + "\n".join(rows) + "\n")).table
    assert table["standard_error"].between(0.001, 0.2).all()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("D3a,p,102,4.0,-3.5,fast,0.1,100", "u, .*'fast'"),
        ("D3a,p,102,4.0,-3.5,,0.1,100", "u, .*nothing"),
        ("D3a,p,102,4.0,-3.5,NaN,0.1,100", "u, .*'NaN'"),
        ("D3a,p,102,4.0,-3.5,inf,0.1,100", "u, .*'inf'"),
        ("D3a,p,102,4.0,-3.6,0.4,0.1,100", "case, x, y, z .* row 2"),
        ("D3a,p,102,4.0,-3.5,0.4,-0.1,100", "u_std"),
        ("D3a,p,102,4.0,-3.5,0.4,0.1,0", "duration_s"),
        ("D3a,p,103,4.0,-3.5,0.4,0.1,100", " x = 102 .*D3a"),
        (",p,102,4.0,-3.5,0.4,0.1,100", "case"),
        ("", ""),
        ("D3a,p,102,4.0,-3.5,0.4,0.1,100,7", "8 .* 9"),
    ],
)
def test_a_wrong_row_is_refused_by_file_and_row(tmp_path, line, words):
    case = with_file(tmp_path, POINTS + f"D3a,p,102,4.0,-3.6,0.3,0.1,100\n{line}\nD3a,p,102,4.0,-3.4,0.5,0.1,100\n")
    with pytest.raises(InputError, match=rf"measured\.csv, row 3: .*{words}"):
        read_observations(case)


def test_wrong_files_are_refused(tmp_path):
    row = "D3a,p,102,4.0,-3.6,0.3,0.1,100\n"
    for text, words in (
        (POINTS.replace("z", "altitude") + row, r"row 1: .*z is missing"),
        (POINTS, r"measured\.csv"),
        ("", r"case, .*an empty file"),
        (POINTS + row.replace("D3a", "D9"), "'D3a', .* D9"),
    ):
        with pytest.raises(InputError, match=words):
            read_observations(with_file(tmp_path, text))
    with pytest.raises(InputError, match=r"nowhere\.csv"):
        read_observations(changed(CASES["d3a"], file=tmp_path / "nowhere.csv"))


def test_one_section_of_an_experiment_is_read_once():
    twice = CASES["d0"].model_copy(update={"observations": CASES["d0"].observations * 2})
    with pytest.raises(InputError, match="section D0"):
        read_observations(twice)


def test_a_station_stands_in_one_file(tmp_path):
    case = with_file(tmp_path, "experiment,section,x,y,u\nD3a,S1,1,2,0.3\n", "velocity")
    (tmp_path / "again.csv").write_text("experiment,x,y,u\nD3a,1,2,0.3\nD3a,1,3,0.3\n", encoding="utf-8")

    def both(section):
        again = case.observations[0].model_copy(update={"file": tmp_path / "again.csv", "section": section})
        return case.model_copy(update={"observations": (*case.observations, again)})

    with pytest.raises(InputError, match=r"x = 301, y = 2 m of section 'S1'"):
        read_observations(both("S1"))
    assert list(read_observations(both("S2")).table["section"]) == ["S1", "S2", "S2"]


def test_velocities_are_read_as_they_are(tmp_path):
    text = "experiment,section,x,y,u,u_se\nD3a,S1,36.0,-1.4,0.1732,0.012\nD3a,S1,36.0,-1.1,0.2591,0\n"
    observations = read_observations(with_file(tmp_path, text, "velocity"))
    first = observations.table.iloc[0]
    assert (first["x"], first["y"], first["value"], first["standard_error"]) == (336.0, -1.4, 0.1732, 0.012)
    assert first["kind"] == "velocity"
    assert np.isnan(observations.table.loc[1, "standard_error"])
    assert observations.table["used"].all()
    assert observations.discharge == {}
    assert observations.points.empty


def test_levels_are_read_as_they_are(tmp_path):
    table = read_observations(with_file(tmp_path, "experiment,x,y,level\nD3a,10,0,0.853\n", "level")).table
    assert list(table["value"]) == [0.853]
    assert list(table["section"]) == [""]
    assert table["standard_error"].isna().all()


def test_the_case_names_or_chooses_the_rows_of_a_file(tmp_path):
    case = with_file(tmp_path, "section,x,y,u\nS1,1,2,0.3\nS2,1,3,0.4\n", "velocity")
    chosen = read_observations(changed(case, experiment="D3a", section="S2", standard_error=0.02)).table
    assert list(chosen["value"]) == [0.4]
    assert list(chosen["experiment"]) == ["D3a"]
    assert list(chosen["standard_error"]) == [0.02]
    with pytest.raises(InputError, match=r"'S3', .* S1, S2"):
        read_observations(changed(case, experiment="D3a", section="S3"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("experiment,section,x,y,u\nD9,S1,1,2,0.3\n", "row 2: .*D3a"),
        ("experiment,section,x,y,u,u_se\nD3a,S1,1,2,0.3,-1\n", "row 2: .*u_se"),
        ("experiment,section,x,y,u\nD3a,S1,1,2,0.3\nD3a,S1,1,2,0.4\n", "row 3: .*experiment, section, x, y"),
        ("experiment,section,x,y,v\nD3a,S1,1,2,0.3\n", "row 1: .*u is missing"),
        ("experiment,section,x,y,u,u_se\nD3a,A,402,5,0.5,1e-300\n", r"row 2: .*u_se .*1e-09 to 1e\+09"),
        ("experiment,section,x,y,u,u_se\nD3a,A,402,5,0.5,1e300\n", r"row 2: .*u_se .*1e-09 to 1e\+09"),
        ("experiment,section,x,y,u,u_se\nD3a,A,402,5,1e160,0.1\n", r"row 2: .* u .*1e\+09"),
        ("experiment,section,x,y,u,u_se\nD3a,A,1e300,5,0.5,0.1\n", r"row 2: .* x .*1e\+09"),
    ],
)
def test_wrong_velocities_are_refused(tmp_path, text, words):
    """Numbers beyond all that is measured among them."""
    with pytest.raises(InputError, match=words):
        read_observations(with_file(tmp_path, text, "velocity"))


@pytest.mark.parametrize("name", list(KEY))
def test_points_that_scatter_more_than_sampling_explains_widen_both_averages(name):
    fitted = READ[name].profiles.query("slope.notna()")
    assert fitted["scatter"].max() > 1.05
    assert (fitted["linear_error"] / fitted["fitted_error"]).between(0.9, 1.3).all()


def test_more_stations_than_a_covariance_can_hold_are_refused(monkeypatch):
    monkeypatch.setattr(observations, "MOST_STATIONS", 20)
    with pytest.raises(InputError, match=r"d3a\.yaml: .* 20 stations, got 21"):
        read_observations(CASES["d3a"])


def stations(**columns):
    return pd.DataFrame({"experiment": "low", "section": "A"} | columns)


def test_a_section_of_a_boat_has_one_place():
    boat = stations(x=[10.2, 9.9, 10.0, 10.3, 9.8], y=[-2.0, -1.0, 0.0, 1.0, 2.0])
    assert section_places(boat).tolist() == [10.0] * 5


def test_stations_on_one_x_keep_its_very_bits():
    x = 0.1 + 0.2
    assert section_places(stations(x=[x] * 4, y=[0.0, 1.0, 2.0, 3.0])).tolist() == [x] * 4


def test_stations_along_the_channel_and_nameless_ones_have_places_of_their_own():
    along = stations(x=[1.0, 5.0, 9.0], y=[0.0, 0.1, 0.0])
    assert section_places(along).tolist() == [1.0, 5.0, 9.0]
    nameless = stations(x=[1.0, 1.2], y=[0.0, 3.0], section=["", ""])
    assert section_places(nameless).tolist() == [1.0, 1.2]


def test_a_name_means_another_section_in_another_experiment():
    both = stations(x=[1.0, 1.2, 7.0, 7.2], y=[0.0, 3.0, 0.0, 3.0], experiment=["low", "low", "high", "high"])
    assert section_places(both).tolist() == [1.1, 1.1, 7.1, 7.1]
