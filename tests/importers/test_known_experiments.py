"""Rows of experiments that the site file lacks are refused with their own file and row, and nothing is written."""

from pathlib import Path
from typing import Any

import pytest
from field_folders import CHANNEL, field_folder, folder_of

import vegglue
from vegglue.errors import InputError

OF_SITE = "is not in site.json: add it under `{}`, or take its rows out"
CONVERTED = "experiment;section;x;y;u [cm/s]\nlow;A;12;0,5;45\n{};B;14;0,5;46\n"
PLAIN = "experiment,section,x,y,u,u_se\nlow,A,12,0.5,0.45,0.01\nflood,A,14,0.5,0.46,0.01\n"
FLOW = {"discharge_m3_s": 1.2, "downstream_level_m": 0.72}
HELD = "experiment,section,x,y,u\nhigh,A,12,0.5,0.6\nflood,A,14,0.5,0.6\n"


@pytest.mark.parametrize(
    ("name", "table", "said"),
    [
        ("survey.txt", CONVERTED.format("flood"), "row 3: experiment `flood` " + OF_SITE.format("experiments")),
        ("velocities.csv", PLAIN, "row 3: experiment `flood` " + OF_SITE.format("experiments")),
        ("holdout.csv", HELD, "row 3: experiment `flood` " + OF_SITE.format("holdout")),
        ("holdout.csv", HELD.replace(",", ";"), "row 3: experiment `flood` " + OF_SITE.format("holdout")),
        ("survey.txt", CONVERTED.format("high"), "row 3: experiment `high` is under `holdout` in site.json: put its "),
        ("survey.txt", CONVERTED.format(""), "row 3: expected an experiment, one of low, got nothing; fill it in"),
        ("levels.csv", "experiment,x,y,level\nlow,2,0,\n", "row 2: expected a number in column level, got ''"),
    ],
)
def test_rows_that_the_site_file_does_not_know_are_refused(tmp_path: Path, name: str, table: str, said: str) -> None:
    """The message named a generated file and no remedy, and the config stayed behind."""
    folder = field_folder(tmp_path / "brook")
    (folder / name).write_text(table, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        vegglue.import_folder(folder, tmp_path / "made" / "brook.yaml")
    assert f"brook/{name}, {said}" in str(refused.value)
    assert not (tmp_path / "made").exists()


def test_an_entry_of_files_names_a_known_experiment(tmp_path: Path) -> None:
    entry: dict[str, Any] = {"files": {"velocities.csv": {"experiment": "lo"}}}
    folder = field_folder(tmp_path / "brook", **entry)
    said = r"velocities\.csv: experiment `lo` is not in site\.json: .*; or correct `experiment` of this file"
    with pytest.raises(InputError, match=said):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


def test_rows_without_a_value_may_name_any_experiment(tmp_path: Path) -> None:
    folder = field_folder(tmp_path / "brook")
    (folder / "velocities.csv").unlink()  # which holds the same station
    (folder / "survey.txt").write_text(CONVERTED.format("flood").replace("46", "-999"), encoding="utf-8")
    assert vegglue.import_folder(folder, tmp_path / "brook.yaml").imported is not None


@pytest.mark.parametrize("name", ["Low", "03.06.2026"])
def test_a_column_with_other_names_of_the_experiments_is_shown(tmp_path: Path, name: str) -> None:
    """The column stood there, with dates or another spelling, and the message said that there is none."""
    folder = field_folder(tmp_path / "brook", experiments=dict.fromkeys(("low", "mid"), FLOW))
    rows = "".join(f"{name if y < 0 else 'flood'};12;{y};45\n" for y in (-1.5, -0.5, 0.5, 1.5))
    (folder / "survey.txt").write_text("Messtermin;x;y;u [cm/s]\n" + rows, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        vegglue.import_folder(folder, tmp_path / "brook.yaml")
    assert f"got none, but 'Messtermin' with {name}, flood (write the names of the site file there); " in str(
        refused.value
    )


@pytest.mark.parametrize("heading", ["low;mid", "level low;level mid (m)"])
def test_experiments_side_by_side_are_told_as_such(tmp_path: Path, heading: str) -> None:
    """Of a column of levels for each experiment the advice was to name one experiment of all rows."""
    folder = field_folder(tmp_path / "brook", experiments=dict.fromkeys(("low", "mid"), FLOW))
    (folder / "gauges.txt").write_text(f"Gauge;x;{heading}\nA;2;0.93;1.04\nB;12;0.92;1.03\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"got a column of values for each, .*; write them one below the other"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


def test_a_column_of_remarks_here_and_there_is_not_shown(tmp_path: Path) -> None:
    """It was `'Remarks' with , in reeds (write the names of the site file there)`."""
    folder = field_folder(tmp_path / "brook", experiments=dict.fromkeys(("low", "mid"), FLOW))
    rows = "x;y;u;Remarks\n12;0;0.4;\n12;1;0.3;in reeds\n12;2;0.4;\n"
    (folder / "survey.txt").write_text(rows, encoding="utf-8")
    with pytest.raises(InputError, match=r"got none; add one"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (
            "meting;debiet [l/s];opmerking\n12 mei;620;meetschot\n3 juni;1400;ADCP, 4 raaien\n",
            r"into the site file, `experiments: \{12 mei: \{discharge: 620 l/s, level: \.\.\.\}\}`, and move",
        ),
        (
            "Peilschaal;X;Y;12 mei [m+NAP];3 juni [m+NAP]\nPS1;2;0;0,76;1,04\nPS2;15;0;0,73;1,01\n",
            r"got a column of values for each, 12 mei \[m\+NAP\] and 3 juni .*gauge, x, y, experiment and level",
        ),
        (
            "Peilschaal;afstand;12 mei;3 juni\nPS1;2;0,76;1,04\nPS2;15;0,73;1,01\n",
            r"got a column of values for each, 12 mei and 3 juni; .*gauge, x, y, experiment and level",
        ),
    ],
)
def test_tables_by_experiment_are_told_what_to_write(tmp_path: Path, table: str, words: str) -> None:
    """`expected a column of x` said of discharges of the experiments, and of gauges side by side, what they lack."""
    flows = "experiments: {12 mei: {discharge: 620 l/s, level: 70 cm}, 3 juni: {discharge: 1400 l/s, level: 98 cm}}\n"
    folder = folder_of(tmp_path / "beek", CHANNEL + flows, a__csv=table)
    with pytest.raises(InputError, match=words):
        vegglue.import_folder(folder, tmp_path / "beek.yaml")
