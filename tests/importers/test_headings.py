"""Headings of columns: what a name with a sign is, and a unit that is of something else."""

import re
from pathlib import Path

import pytest
from field_folders import CHANNEL, JUNE, folder_of

import vegglue
from vegglue.errors import InputError
from vegglue.importers.column_names import role_of, unit_stated
from vegglue.importers.file_options import FileOptions
from vegglue.importers.measured_rows import read_rows


@pytest.mark.parametrize("heading", ["u*", "u*_ms", "σ_u", "σu (m/s)", "u'", "u′ [cm/s]", "Δx", "y+", "∂u", "±u", "∆x"])
def test_a_sign_makes_another_quantity_of_a_letter(tmp_path: Path, heading: str) -> None:
    """The shear velocity u* and the scatter σ_u were the velocity, and the step Δx the place."""
    table = f"{heading},x,y,u\n0.05,8,0,0.4\n0.06,20,0,0.5\n"
    (tmp_path / "a.csv").write_text(table, encoding="utf-8")
    taken = read_rows(tmp_path / "a.csv", FileOptions())
    assert dict(taken.columns) == {"x": "x", "y": "y", "u": "u"}
    assert list(taken.others) == [heading]


@pytest.mark.parametrize(
    ("heading", "role"),
    [
        ("'u'", "u"),
        ("<u>", "u"),
        ("ū", "u"),
        ("Höhe", "z"),
        ("Débit", "discharge"),
        ("U_Mean", "u"),
        ("Vel.", "u"),
        ("Fließgeschwindigkeit", "u"),
        ("Strömungsgeschwindigkeit", "u"),
        ("v_x", "u"),
        ("Wasserspiegellage", "level"),
        ("Vitesse moyenne", "u"),
        ("Velocità media", "u"),
        ("Snelheid", "u"),
        ("Velocidad", "u"),
        ("Hauteur d’eau", "depth"),
        ("Niveau d'eau", "level"),
        ("Waterstand", "level"),
        ("Debiet", "discharge"),
        ("Peilschaal", "section"),
        ("Profundidad", "depth"),
        ("Caudal", "discharge"),
        ("Sección", "section"),
    ],
)
def test_accents_and_quotes_change_no_name(heading: str, role: str) -> None:
    assert role_of(heading) == (role, None)


@pytest.mark.parametrize(
    ("heading", "stated"),
    [
        ("Flow (m/s)", "'m/s', which is no unit of discharge"),
        ("Q (Mgal/d)", "'Mgal/d', which is no unit of discharge"),
        ("u (%)", "'%', which is no unit of velocity"),
        ("level (m/s)", "'m/s', which is no unit of length"),
        ("x, ft/s", "'ft/s', which is no unit of length"),
    ],
)
def test_a_unit_of_something_else_is_refused_in_round_brackets_too(tmp_path: Path, heading: str, stated: str) -> None:
    """It was left out of account, and the numbers taken for SI: a velocity was a discharge."""
    (tmp_path / "a.csv").write_text(f"a;b;{heading}\n1;2;3\n2;2;3\n", encoding="utf-8")
    with pytest.raises(InputError, match=stated):
        read_rows(tmp_path / "a.csv", FileOptions())


@pytest.mark.parametrize("heading", ["u (mean)", "u (60 s)", "u (A/B)", "u (m/s, mean of 60 s)", "u (-)"])
def test_words_in_round_brackets_are_no_units(tmp_path: Path, heading: str) -> None:
    (tmp_path / "a.csv").write_text(f"x;y;{heading}\n1;2;3\n2;2;3\n", encoding="utf-8")
    assert read_rows(tmp_path / "a.csv", FileOptions()).units["u"] == "m/s"


@pytest.mark.parametrize(
    ("heading", "quantity", "unit"),
    [
        ("x (US survey feet)", "length", "ft"),
        ("level (ft, NAVD88)", "length", "ft"),
        ("WL (above datum, in cm)", "length", "cm"),
        ("Q (gpm)", "discharge", "gal/min"),
        ("direction (gon)", "angle", "gon"),
        ("x (in the channel)", "length", None),
    ],
)
def test_a_unit_is_known_among_other_words(heading: str, quantity: str, unit: str | None) -> None:
    """Survey feet were metres, and gon degrees."""
    assert unit_stated(heading, quantity) == unit


def test_columns_that_may_be_the_measurements_are_named(tmp_path: Path) -> None:
    """A folder whose velocities have an unknown heading was told that it had no table."""
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv="x,y,surface velocity (m/s)\n8,0,0.4\n9,0,0.4\n")
    with pytest.raises(InputError, match=r"a\.csv: .*not read: surface velocity \(m/s\)\. Name the column by what"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


@pytest.mark.parametrize(
    ("heading", "named"),
    [("x,u (y=-1),u (y=0),u (y=1)", "'u (y=-1)', 'u (y=0)' and 'u (y=1)'"), ("x,u,x,u", "'u' and 'u'")],
)
def test_two_columns_of_one_name_are_no_repeats_to_choose_from(tmp_path: Path, heading: str, named: str) -> None:
    """The first of them was taken, at y = 0, and the others were named at the end of a line only."""
    (tmp_path / "a.csv").write_text(f"{heading}\n8,0.4,0.5,0.4\n9,0.4,0.5,0.4\n", encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(f"expected one column of u, got {named}; put their values below")):
        read_rows(tmp_path / "a.csv", FileOptions())


def test_one_reading_in_two_units_is_one(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x [m],x [ft],u\n8,26.2,0.5\n9,29.5,0.5\n", encoding="utf-8")
    assert read_rows(tmp_path / "a.csv", FileOptions()).numbers["x"].tolist() == [8.0, 9.0]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            FileOptions(units={"u": "cm/s"}),
            "`units` what its columns hold, x, east_velocity, north_velocity",
        ),
        (FileOptions(columns={"x": "x", "y": "x"}), "expected a column of its own for y, got 'x', which is that of x"),
    ],
)
def test_words_of_the_site_file_that_reach_no_column_are_refused(tmp_path: Path, words: FileOptions, said: str) -> None:
    """`units: {u: cm/s}` beside Ve and Vn did nothing, and these were m/s."""
    (tmp_path / "a.csv").write_text("x,Ve,Vn\n8,40,3\n9,41,3\n", encoding="utf-8")
    with pytest.raises(InputError, match=said):
        read_rows(tmp_path / "a.csv", words)


@pytest.mark.parametrize("heading", ["Velocity in cm/s", "u in cm/s", "Depth-averaged velocity [cm/s]"])
def test_a_unit_may_stand_behind_in(heading: str) -> None:
    assert role_of(heading) == ("u", "cm/s")


@pytest.mark.parametrize(
    ("headings", "roles"),
    [
        ("snelheid [cm/s];richting [graden]", {"speed", "direction"}),
        ("Geschwindigkeit [cm/s];Fließrichtung [Grad]", {"speed", "direction"}),
        ("vitesse [cm/s];direction [degrés]", {"speed", "direction"}),
        ("mean velocity [cm/s];direction [deg]", {"speed", "direction"}),
        ("V [cm/s];dir [°]", {"speed", "direction"}),
        ("velocity x [cm/s];direction [deg]", {"u", "direction"}),
        ("snelheid [cm/s];meting", {"u"}),
    ],
)
def test_a_velocity_with_a_direction_is_a_speed(tmp_path: Path, headings: str, roles: set[str]) -> None:
    """It was taken for the one along the channel, and its direction dropped."""
    (tmp_path / "a.csv").write_text(f"x;y;{headings}\n8;0;40;30\n20;0;50;31\n", encoding="utf-8")
    taken = read_rows(tmp_path / "a.csv", FileOptions())
    assert set(taken.numbers) == {"x", "y"} | roles
    assert "u" in roles or taken.numbers["speed"].tolist() == [0.4, 0.5]
    assert read_rows(tmp_path / "a.csv", FileOptions(columns={"u": headings.split(";")[0]})).numbers["u"][0] == 0.4


def test_an_empty_direction_leaves_the_velocity_along(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x;y;snelheid;richting\n8;0;0,4;\n20;0;0,5;\n", encoding="utf-8")
    assert "u" in read_rows(tmp_path / "a.csv", FileOptions()).numbers


@pytest.mark.parametrize(
    "heading", ["snelheid [cm/s]", "snelheid (cm/s)", "snelheid, cm/s", "snelheid_cm_s", "snelheid"]
)
def test_a_column_is_named_without_its_unit(tmp_path: Path, heading: str) -> None:
    """`columns: {speed: snelheid}` was refused, and wanted `snelheid [cm/s]`."""
    (tmp_path / "a.csv").write_text(f"x;y;{heading}\n8;0;40\n20;0;50\n", encoding="utf-8")
    words = FileOptions(columns={"speed": "snelheid"}, units={"speed": "cm/s"})
    assert read_rows(tmp_path / "a.csv", words).numbers["speed"].tolist() == [0.4, 0.5]


def test_a_name_of_two_columns_needs_its_unit(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x;y;snel [cm/s];snel [m/s]\n8;0;40;0,4\n20;0;50;0,5\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"expected the column 'snel' for speed, got x, y, snel \[cm/s\]"):
        read_rows(tmp_path / "a.csv", FileOptions(columns={"speed": "snel"}))
