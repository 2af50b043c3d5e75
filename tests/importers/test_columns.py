"""Columns are what their headings mean, in the unit that these or the site file state, each reading once."""

import json
import re
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from field_folders import CHANNEL, JUNE, import_of, refusal_of

from vegglue.errors import InputError
from vegglue.importers.column_names import in_si, role_of, unit_named, unit_stated
from vegglue.importers.file_options import FileOptions
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.measured_rows import MeasuredRows, read_rows


def rows_of(tmp_path: Path, table: str, **options: object) -> MeasuredRows:
    (tmp_path / "a.csv").write_text(table, encoding="utf-8")
    return read_rows(tmp_path / "a.csv", FileOptions(**options))  # type: ignore[arg-type]


def test_words_for_units_and_columns() -> None:
    for word, quantity, unit in (
        ("cm s^-1", "velocity", "cm/s"), ("m³/s", "discharge", "m3/s"), ("cfs", "discharge", "ft3/s"),
        ("feet", "length", "ft"), ("m", "velocity", None), ("m a.s.l.", "length", "m"), ("m+NAP", "length", "m"),
        ("m ü. NN", "length", "m"), ("ft NAVD88", "length", "ft"), ("min", "length", None), ("cm+NAP", "length", "cm"),
        ("cm + NAP", "length", "cm"), ("cm ü. NN", "length", "cm"),
    ):  # fmt: skip
        assert unit_named(word, quantity) == unit, word
    assert in_si("42 l/s", "discharge", "Q") == pytest.approx(0.042)


@pytest.mark.parametrize(
    ("heading", "known"),
    [
        ("'u'", ("u", None)), ("<u>", ("u", None)), ("ū", ("u", None)), ("Höhe", ("z", None)), ("U_Mean", ("u", None)),
        ("Débit", ("discharge", None)), ("Vel.", ("u", None)), ("Fließgeschwindigkeit", ("u", None)),
        ("v_x", ("u", None)),
        ("Strömungsgeschwindigkeit", ("u", None)), ("Wasserspiegellage", ("level", None)), ("Snelheid", ("u", None)),
        ("Vitesse moyenne", ("u", None)), ("Velocità media", ("u", None)), ("Velocidad", ("u", None)),
        ("Hauteur d’eau", ("depth", None)), ("Niveau d'eau", ("level", None)), ("Waterstand", ("level", None)),
        ("Debiet", ("discharge", None)), ("Peilschaal", ("section", None)), ("Profundidad", ("depth", None)),
        ("Caudal", ("discharge", None)), ("Sección", ("section", None)), ("U_depthavg_ms", ("u", "m/s")),
        ("Water level [cm]", ("level", "cm")), ("Mean Vel. (ft/s)", ("u", "ft/s")), ("remark", None),
        ("Water Surface Type", None), ("Velocity in cm/s", ("u", "cm/s")), ("u in cm/s", ("u", "cm/s")),
        ("Depth-averaged velocity [cm/s]", ("u", "cm/s")),
    ],
)  # fmt: skip
def test_a_heading_has_a_role_and_a_unit(heading: str, known: tuple[str, str | None] | None) -> None:
    assert role_of(heading) == known


@pytest.mark.parametrize("heading", ["x_m (cm)", "h_m [mm]", "depth m, ft", "u_cm_s [m/s]"])
def test_a_heading_with_two_units_has_no_role(heading: str) -> None:
    """h_m [mm] was read in metres: a mean depth a thousand times too large."""
    assert role_of(heading) is None


@pytest.mark.parametrize(
    "heading", ["u uncertainty (95 %)", "u error (k=2)", "u error (2 sigma)", "level error [m, 2σ]", "u_se (95% CI)"]
)
def test_half_an_interval_is_no_standard_error(heading: str) -> None:
    """It was read as a standard error, twice too large."""
    assert role_of(heading) is None


@pytest.mark.parametrize("heading", ["u*", "u*_ms", "σ_u", "σu (m/s)", "u'", "u′ [cm/s]", "Δx", "y+", "∂u", "±u", "∆x"])
def test_a_sign_makes_another_quantity_of_a_letter(tmp_path: Path, heading: str) -> None:
    taken = rows_of(tmp_path, f"{heading},x,y,u\n0.05,8,0,0.4\n0.06,20,0,0.5\n")
    assert dict(taken.columns) == {"x": "x", "y": "y", "u": "u"}
    assert list(taken.others) == [heading]


@pytest.mark.parametrize(
    ("heading", "unit"),
    [("Flow (m/s)", "m/s"), ("Q (Mgal/d)", "Mgal/d"), ("u (%)", "%"), ("level (m/s)", "m/s"), ("x, ft/s", "ft/s"),
     ("u [m3]", "m3"), ("u [10^-2 m/s]", "10^-2 m/s"), ("u (×10⁻² m/s)", "×10⁻² m/s"), ("u (1e-3 m/s)", "1e-3 m/s"),
     ("u [m/s x 100]", "m/s x 100"), ("x (100 m)", "100 m"), ("Q (MGD)", "MGD")],
)  # fmt: skip
def test_a_unit_of_something_else_is_refused(tmp_path: Path, heading: str, unit: str) -> None:
    with pytest.raises(InputError, match=re.escape(f"a.csv: column {heading!r} is headed {unit!r}")):
        rows_of(tmp_path, f"a;b;{heading}\n1;2;3\n2;2;3\n")


@pytest.mark.parametrize("heading", ["u (mean)", "u (60 s)", "u (A/B)", "u (m/s, mean of 60 s)", "u (-)"])
def test_words_in_round_brackets_are_no_units(tmp_path: Path, heading: str) -> None:
    assert rows_of(tmp_path, f"x;y;{heading}\n1;2;3\n2;2;3\n").units["u"] == "m/s"


@pytest.mark.parametrize(
    ("heading", "quantity", "unit"),
    [
        ("x (US survey feet)", "length", "us-ft"), ("level (ft, NAVD88)", "length", "ft"),
        ("Easting (ftUS)", "length", "us-ft"), ("N (US ft, NAD83)", "length", "us-ft"), ("x (sft)", "length", "us-ft"),
        ("x_ft", "length", "ft"), ("x (ift)", "length", "ft"),
        ("Q (gpm)", "discharge", "gal/min"),
        ("WL (above datum, in cm)", "length", "cm"), ("direction (gon)", "angle", "gon"),
        ("x (in the channel)", "length", None), ("Q (cusecs)", "discharge", "ft3/s"), ("V (mph)", "velocity", "mph"),
        ("V, kt", "velocity", "kn"), ("Velocity (feet per second)", "velocity", "ft/s"),
        ("V (centimetres per second)", "velocity", "cm/s"), ("Flow (cubic feet per second)", "discharge", "ft3/s"),
        ("Stems (per square metre)", "density", "1/m2"), ("Q (litres/second)", "discharge", "l/s"),
    ],
)  # fmt: skip
def test_a_unit_is_known_among_other_words(heading: str, quantity: str, unit: str | None) -> None:
    assert unit_stated(heading, quantity) == unit


def test_a_foot_of_the_survey_is_longer(tmp_path: Path) -> None:
    """`ftUS` was no unit, and a map in State Plane feet was read as one in metres."""
    taken = rows_of(tmp_path, "Easting (ftUS),Northing (ft),V\n2000000,500000,0.4\n2000030,500010,0.5\n")
    assert taken.numbers["x"].tolist() == pytest.approx([609601.2192, 609610.3632], abs=1e-4)
    assert taken.numbers["y"].tolist() == pytest.approx([152400.0, 152403.048], abs=1e-4)


@pytest.mark.parametrize(
    ("table", "row", "roles"),
    [
        ("# velocities in cm/s\nx,y,u\n8,0,40\n9,0,41\n", 1, ["u"]),
        ("Survey of June\nUnit: ft\n\nx,y,level\n8,0,3.1\n9,0,3.2\n", 2, ["x", "y", "level"]),
        ("Place;;Velocity (cm/s)\nx [m];y [m];u\n8;0;40\n9;0;41\n", 1, ["u"]),
        ("m;m;mm/s\nx;y;u\n8;0;400\n9;0;410\n", 1, ["u"]),
        ("x [m],y [m],level,unit\n8,0,3.1,ft\n9,0,3.2,ft\n", 2, ["level"]),
    ],
)
def test_a_unit_beside_the_headings_is_refused_until_it_is_stated(
    tmp_path: Path, table: str, row: int, roles: list[str]
) -> None:
    with pytest.raises(InputError) as refused:
        rows_of(tmp_path, table)
    assert (refused.value.kind, refused.value.values["row"], refused.value.values["roles"]) == (
        "unit_elsewhere", row, roles,
    )  # fmt: skip
    units = {role: "cm/s" if role == "u" else "ft" for role in roles}
    assert rows_of(tmp_path, table, units=units).units == {"x": "m", "y": "m"} | units


@pytest.mark.parametrize("line", ["# propeller of 5 cm, 40 s each", "Rhine at km 12.3", "# u in m/s", "in June"])
def test_a_value_in_a_title_is_no_unit(tmp_path: Path, line: str) -> None:
    assert rows_of(tmp_path, f"{line}\nx,y,u\n8,0,0.40\n9,0,0.41\n").units["u"] == "m/s"


@pytest.mark.parametrize(
    ("heading", "level"),
    [("WL (cm ü. Sohle)", 0.95), ("WL [cm above datum]", 0.95), ("WL (in cm)", 0.95), ("WL (m a.s.l.)", 95.0)],
)
def test_a_unit_may_have_words_behind_it(tmp_path: Path, heading: str, level: float) -> None:
    numbers = rows_of(tmp_path, f"x;y;{heading}\n1;2;95\n2;2;95\n").numbers
    assert numbers["level"].tolist() == pytest.approx([level, level])


@pytest.mark.parametrize("heading", ["Geschw. (cm/s)", "Geschw. [cm/s]", "Geschw., cm/s", "Geschw_cm_s", "Geschw cm/s"])
def test_the_unit_of_a_heading_counts_whatever_its_name_is(tmp_path: Path, heading: str) -> None:
    entry = f"files: {{a.csv: {{columns: {{u: '{heading}', x: 'Ort (flach)'}}}}}}\n"
    found = import_of(tmp_path, CHANNEL + JUNE + entry, a__csv=f"Ort (flach);y;{heading}\n4;0;10\n8;0;20\n")
    (record,) = found.case.imported or ()
    assert (record.units["u"], record.units["x"]) == ("cm/s", "m")
    assert found.values() == [0.1, 0.2]


@pytest.mark.parametrize(
    "heading", ["snelheid [cm/s]", "snelheid (cm/s)", "snelheid, cm/s", "snelheid_cm_s", "snelheid"]
)
def test_a_column_is_named_without_its_unit(tmp_path: Path, heading: str) -> None:
    table = f"x;y;{heading}\n8;0;40\n20;0;50\n"
    taken = rows_of(tmp_path, table, columns={"speed": "snelheid"}, units={"speed": "cm/s"})
    assert taken.numbers["speed"].tolist() == [0.4, 0.5]


@pytest.mark.parametrize(
    ("table", "options", "place"),
    [
        ("x;y;snel [cm/s];snel [m/s]\n8;0;40;0,4\n20;0;50;0,5\n", {"columns": {"speed": "snel"}}, "'snel' for speed"),
        ("x,Ve,Vn\n8,40,3\n9,41,3\n", {"units": {"u": "cm/s"}}, "`u`"),
        ("x,Ve,Vn\n8,40,3\n9,41,3\n", {"columns": {"x": "x", "y": "x"}}, "for y, got 'x'"),
        ("x,u (y=-1),u (y=0),u (y=1)\n8,0.4,0.5,0.4\n9,0.4,0.5,0.4\n", {}, "'u (y=-1)', 'u (y=0)' and 'u (y=1)'"),
        ("x,u,x,u\n8,0.4,0.5,0.4\n9,0.4,0.5,0.4\n", {}, "'u' and 'u'"),
    ],
)
def test_columns_that_are_not_sure_are_refused(
    tmp_path: Path, table: str, options: dict[str, object], place: str
) -> None:
    with pytest.raises(InputError, match=re.escape(place)):
        rows_of(tmp_path, table, **options)


def test_one_reading_in_two_units_is_one(tmp_path: Path) -> None:
    assert rows_of(tmp_path, "x [m],x [ft],u\n8,26.2,0.5\n9,29.5,0.5\n").numbers["x"].tolist() == [8.0, 9.0]


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
    table = f"x;y;{headings}\n8;0;40;30\n20;0;50;31\n"
    taken = rows_of(tmp_path, table)
    assert set(taken.numbers) == {"x", "y"} | roles
    assert "u" in roles or taken.numbers["speed"].tolist() == [0.4, 0.5]
    assert rows_of(tmp_path, table, columns={"u": headings.split(";")[0]}).numbers["u"][0] == 0.4
    assert "u" in rows_of(tmp_path, "x;y;snelheid;richting\n8;0;0,4;\n20;0;0,5;\n").numbers, "an empty direction"


@pytest.mark.parametrize(
    ("heading", "kinds"),
    [
        ("V,SE", {"velocity"}), ("v [m/s],SE", {"velocity"}), ("u,v", {"velocity", "velocity_across"}),
        ("transverse velocity,SE", {"velocity_across"}),
    ],
)  # fmt: skip
def test_a_column_v_is_the_velocity_if_it_is_alone(tmp_path: Path, heading: str, kinds: set[str]) -> None:
    rows = "".join(f"A,10,{y},0.4,0.01\n" for y in (-1, 0, 1))
    assert set(import_of(tmp_path, adv__csv=f"section,x,y,{heading}\n{rows}").table["kind"]) == kinds


@pytest.mark.parametrize("heading", ["x;y;Ve;Vn;Speed;Direction", "x;y;u;v;Speed;Direction"])
def test_a_speed_beside_its_components_is_no_further_observation(tmp_path: Path, heading: str) -> None:
    """One reading was three observations; a row that has a speed alone keeps it."""
    found = import_of(tmp_path, a__csv=f"{heading}\n8;0;0.4;0.03;0.401;86\n8;1;0.4;0.03;0.401;86\n20;1;;;0.43;\n")
    assert found.table["kind"].value_counts().to_dict() == {"velocity": 2, "velocity_across": 2, "speed": 1}


@pytest.mark.parametrize(
    ("headings", "wanted"),
    [
        ("x,N,y,u", {"x": 0, "y": 2, "u": 3}), ("x,N,u", {"x": 0, "u": 2}), ("E,N,u", {"x": 0, "y": 1, "u": 2}),
        ("E (m),N (m),x,y,u", {"x": 0, "y": 1, "u": 4}), ("N,Easting,u", {"x": 1, "y": 0, "u": 2}),
        ("N,Easting,Northing,u", {"x": 1, "y": 2, "u": 3}), ("x,y,Vel (cm/s)", {"x": 0, "y": 1, "u": 2}),
        ("x,y,bed elevation,z,u", {"x": 0, "y": 1, "z_bed": 2, "z": 3, "u": 4}),
        ("x,y,bed_elevation_m", {"x": 0, "y": 1, "z_bed": 2}), ("x,y,Vel,Vx,Vy", {"x": 0, "y": 1, "u": 3, "v": 4}),
    ],
)  # fmt: skip
def test_a_vague_name_yields(tmp_path: Path, headings: str, wanted: dict[str, int]) -> None:
    """The number of samples was y, and the magnitude the velocity along."""
    numbers = ",".join(str(1 + place) for place in range(headings.count(",") + 1))
    taken = rows_of(tmp_path, f"{headings}\n{numbers}\n{numbers}.5\n")
    assert taken.columns == {role: headings.split(",")[place] for role, place in wanted.items()}


def test_north_is_known_beside_a_column_named_as_x(tmp_path: Path) -> None:
    assert set(rows_of(tmp_path, "Ost,N,u\n1,2,3\n4,5,6\n", columns={"x": "Ost"}).numbers) == {"x", "y", "u"}


@pytest.mark.parametrize(
    ("table", "role", "error"),
    [
        ("x,y,U [cm/s],u_se\n1,2,40,0.3\n", "u_se", 0.003), ("x,y,U [cm/s],u_se [m/s]\n1,2,40,0.003\n", "u_se", 0.003),
        ("x,y,Ve (cm/s),Vn (cm/s),SE\n1,2,40,3,0.3\n", "v_se", 0.003), ("x,y,u,u_se\n1,2,0.4,0.003\n", "u_se", 0.003),
        ("x,y,level [mm],SE\n1,2,950,2\n", "level_se", 0.002),
    ],
)  # fmt: skip
def test_an_error_without_a_unit_has_that_of_its_values(tmp_path: Path, table: str, role: str, error: float) -> None:
    assert rows_of(tmp_path, table).numbers[role].tolist() == pytest.approx([error])


def test_a_column_over_a_length_or_a_speed_has_that_as_its_unit(tmp_path: Path) -> None:
    columns = {"x": "Downstream", "y": "y*", "u": "u*"}
    units = {"x": "0.7 m", "y": "70 cm", "u": "0.8 m/s"}
    taken = rows_of(tmp_path, "u*\ty*\tDownstream\n1.25\t-1.7\t10\n1\t0\t2\n", columns=columns, units=units)
    assert taken.numbers["x"].tolist() == pytest.approx([7.0, 1.4])
    assert taken.numbers["y"].tolist() == pytest.approx([-1.19, 0.0])
    assert taken.numbers["u"].tolist() == pytest.approx([1.0, 0.8])


def test_an_error_follows_the_unit_of_the_site_file(tmp_path: Path) -> None:
    taken = rows_of(tmp_path, "x,y,u,u_se\n1,2,40,0.3\n", units={"u": "cm/s"})
    assert (taken.numbers["u_se"].tolist(), taken.units["u_se"]) == (pytest.approx([0.003]), "cm/s")


@pytest.mark.parametrize(
    ("table", "errors"),
    [
        ("x;y;level;SE\n8;0;0.95;0.002\n", [0.002]), ("x;y;level;SE (mm)\n8;0;0.95;2\n", [0.002]),
        ("x;y;Speed;SE\n8;0;0.4;0.01\n", [0.01]), ("x;y;Speed;Direction;SE\n8;0;0.4;80;0.01\n", [0.01, 0.01]),
        ("x;Q;standard error\n8;2;0.1\n", [0.1]), ("x;y;Vx (cm/s);Vy (cm/s);SE (cm/s)\n8;0;21;1;0.8\n", [0.008, 0.008]),
        ("x;y;Vx (cm/s);Vy (cm/s);u_se (cm/s)\n8;0;21;1;0.8\n", [0.008, np.nan]),
    ],
)  # fmt: skip
def test_an_error_without_a_name_is_of_what_the_table_holds(tmp_path: Path, table: str, errors: list[float]) -> None:
    assert import_of(tmp_path, a__csv=table).table["standard_error"].tolist() == pytest.approx(errors, nan_ok=True)


@pytest.mark.parametrize(
    ("stated", "velocity", "level"), [("1.5 cm/s", 0.015, None), ("4 mm", None, 0.004), ("0.02", 0.02, 0.02)]
)
def test_a_standard_error_is_of_the_values_of_its_unit(
    tmp_path: Path, stated: str, velocity: float | None, level: float | None
) -> None:
    rows = ["experiment,section,x,y,u,level", *(f"June,A,8,{y},0.4,0.95" for y in (-1, 0, 1))]
    site = CHANNEL + JUNE + f"files: {{all.csv: {{standard_error: {stated}}}}}\n"
    table = import_of(tmp_path, site, all__csv="\n".join(rows)).table
    for kind, wanted in (("velocity", velocity), ("level", level)):
        found = table[table["kind"] == kind]["standard_error"].to_numpy(float)
        assert np.isnan(found).all() if wanted is None else set(found) == {wanted}, kind


@pytest.mark.parametrize(
    ("headings", "columns"),
    [
        ("Longitude (deg),Latitude (deg)", {"x": "Longitude (deg)", "y": "Latitude (deg)"}),
        ("lon,lat", {"x": "lon", "y": "lat"}),
        ("x [°],y [°]", {}), ("Longitude,Latitude", {}),
    ],
)  # fmt: skip
def test_places_in_degrees_are_refused(tmp_path: Path, headings: str, columns: dict[str, str]) -> None:
    """Degrees were read as metres: 63 stations of a transect became 2."""
    site = CHANNEL + JUNE + f"files: {{a.csv: {{columns: {json.dumps(columns)}}}}}\n"
    table = f"{headings},u\n8.5417,47.3769,0.4\n8.5418,47.3769,0.5\n"
    assert "got degrees" in refusal_of(tmp_path, site, a__csv=table).replace("places in degrees", "got degrees")


@pytest.mark.parametrize(
    ("headings", "number", "kept"),
    [
        ("x,y,u", "7777", False), ("x,y,u (mm/s)", "-8888", False), ("x,y,level", "7777", False),
        ("u,y,x", "7777", True),
        ("x,y,level (mm)", "7777", True), ("x,y,level (ft)", "7777", True), ("x,y,depth (cm)", "8888", False),
        ("x,y,discharge", "7777", True),
    ],
)  # fmt: skip
def test_sevens_and_eights_are_marks_if_nothing_measured_is_so_large(
    tmp_path: Path, headings: str, number: str, kept: bool
) -> None:
    taken = rows_of(tmp_path, f"{headings}\n1,2,0.4\n2,2,{number}\n")
    assert np.isfinite(taken.numbers[list(taken.numbers)[-1]]).tolist() == [True, kept]
    assert any(one == ImportNote(Noted.MARKS, 1, (headings.split(",")[-1],)) for one in taken.notes) == (not kept)


def test_nines_that_may_be_a_mark_are_kept_and_reported(tmp_path: Path) -> None:
    table = "x;y;u [cm/s];level [m]\n1;0;35,1;9,99\n1;1;99,99;9,99\n1;2;-999;9,99\n"
    taken = rows_of(tmp_path, table)
    assert ImportNote(Noted.KEPT_NINES, names=("99.99", "u [cm/s]")) in taken.notes
    assert taken.numbers["u"].tolist() == pytest.approx([0.351, 0.9999, np.nan], nan_ok=True)
    assert np.isnan(rows_of(tmp_path, table, missing=(99.99,)).numbers["u"][1])


def test_columns_that_are_not_read_are_listed(tmp_path: Path) -> None:
    found = import_of(tmp_path, adv__csv="no;exp;x;y;u;sd;Remark\n1;June;8;0;0.4;0.01;\n2;June;9;0;0.4;0.01;weed\n")
    assert found.taken["adv.csv"].endswith("not read: no, sd and Remark")
    named = refusal_of(tmp_path, a__csv="x,y,surface velocity (m/s)\n8,0,0.4\n9,0,0.4\n")
    assert "a.csv: " in named
    assert "surface velocity (m/s)" in named


@pytest.mark.parametrize(
    "table",
    [
        "x,y,surface velocity (m/s)\n8,0,0.4\n9,0,0.4\n", "x,y,level,surface velocity (m/s)\n8,0,0.4,1\n9,0,0.4,1\n",
        "x,y,z\n8,0,0.4\n9,0,0.4\n", "x,y,Avg-Vx\n8,0,0.4\n9,0,0.4\n",
    ],
)  # fmt: skip
def test_what_may_be_measured_is_refused_beside_other_files(tmp_path: Path, table: str) -> None:
    """It was listed as not read, or its file as without a measurement."""
    named = refusal_of(tmp_path, a__csv=table, levels_of_june__csv="x,y,level\n8,0,0.4\n9,0,0.4\n")
    assert "a.csv: " in named
    assert table.partition("\n")[0].rpartition(",")[2] in named


def test_levels_of_hec_ras_are_known_by_their_heading(tmp_path: Path) -> None:
    table = "River Sta\tx\tQ Total\tW.S. Elev\n\t(ft)\t(cfs)\t(ft)\n100\t0\t71\t3.12\n50\t50\t71\t3.08\n"
    assert rows_of(tmp_path, table).numbers["level"].tolist() == pytest.approx([0.950976, 0.938784])


@pytest.mark.parametrize(
    ("heading", "roles"),
    [
        ("RD X;RD Y;snelheid_x [cm/s];snelheid_y [cm/s]", ["x", "y", "u", "v"]),
        ("x [m];y [m];z über Sohle [mm];u [cm/s]", ["x", "y", "height", "u"]),
        ("Lauf;X_RD;Y_RD;vitesse x (m/s)", ["x", "y", "u"]),
    ],
)
def test_components_and_heights_are_found_in_other_languages(tmp_path: Path, heading: str, roles: list[str]) -> None:
    row = ";".join("1" for _ in heading.split(";"))
    taken = rows_of(tmp_path, f"{heading}\n{row}\n")
    assert sorted(taken.numbers) == sorted(roles)
    assert ("experiment" in taken.texts) == heading.startswith("Lauf")


def test_own_columns_and_units_are_kept_in_the_case(tmp_path: Path) -> None:
    entry = "files: {a.csv: {columns: {u: V1, x: P}, units: {u: ft/s}, flip: [x], missing: [-1], section: A}}\n"
    found = import_of(tmp_path, CHANNEL + JUNE + entry, a__csv="P,y,V1\n-4,0,-1.0\n-6,0,-2.0\n-8,0,-1\n")
    (record,) = found.case.imported or ()
    assert (record.columns, record.units["u"]) == ({"x": "P", "y": "y", "u": "V1"}, "ft/s")
    assert found.table[["x", "value", "section"]].to_numpy().tolist() == [[6.0, 0.6096, "A"]]


@pytest.mark.parametrize("heading", ["%Q", "% Q", "Depth %", "Velocity percent", "pct flow"])
def test_a_share_is_no_quantity(tmp_path: Path, heading: str) -> None:
    """`%Q` of a gauging was its discharge in m3/s."""
    assert rows_of(tmp_path, f"x;{heading};u\n1;40;0.4\n2;60;0.5\n").numbers.keys() == {"x", "u"}


@pytest.mark.parametrize(
    "mean", ["Mean Velocity (m/s)", "Average Velocity [m/s]", "Avg velocity", "Mittlere Geschwindigkeit"]
)
def test_the_mean_of_a_vertical_stands_beside_that_of_a_point(tmp_path: Path, mean: str) -> None:
    """A gauging has `Velocity` of its last point and `Mean Velocity`; the first of both counted."""
    taken = rows_of(tmp_path, f"x;Velocity (m/s);{mean}\n1;0.512;0.457\n2;0.351;0.351\n")
    assert taken.numbers["u"].tolist() == [0.457, 0.351]


@pytest.mark.parametrize(("unit", "mark"), [("m/s", "-32.768"), ("cm/s", "-3276.8"), ("mm/s", "-32768")])
def test_a_mark_of_a_boat_is_one_in_any_unit(tmp_path: Path, unit: str, mark: str) -> None:
    u = rows_of(tmp_path, f"x;u [{unit}]\n1;{mark}\n2;0.35\n").numbers["u"]
    assert np.isnan(u).tolist() == [True, False]


def test_a_workbook_whose_first_sheet_has_words_names_the_others(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    book.active.title, book.active["A1"] = "Notes", "Mill brook"
    june = book.create_sheet("June")
    for row in (("x", "u"), (1, 0.4), (2, 0.5)):
        june.append(row)
    book.save(tmp_path / "a.xlsx")
    with pytest.raises(InputError, match="'Notes', got none; name another by `sheet` of this file: June"):
        read_rows(tmp_path / "a.xlsx", FileOptions())
