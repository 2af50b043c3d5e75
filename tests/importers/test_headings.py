"""Headings of columns: what a name with a sign is, and a unit that is of something else."""

from pathlib import Path

import pytest

from vegglue.importers.column_names import role_of
from vegglue.importers.file_words import FileWords
from vegglue.importers.measured_rows import read_rows


@pytest.mark.parametrize("heading", ["u*", "u*_ms", "σ_u", "σu (m/s)", "u'", "u′ [cm/s]", "Δx", "y+", "∂u", "±u", "∆x"])
def test_a_sign_makes_another_quantity_of_a_letter(tmp_path: Path, heading: str) -> None:
    """The shear velocity u* and the scatter σ_u were the velocity, and the step Δx the place."""
    table = f"{heading},x,y,u\n0.05,8,0,0.4\n0.06,20,0,0.5\n"
    (tmp_path / "a.csv").write_text(table, encoding="utf-8")
    taken = read_rows(tmp_path / "a.csv", FileWords())
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
    ],
)
def test_accents_and_quotes_change_no_name(heading: str, role: str) -> None:
    assert role_of(heading) == (role, None)
