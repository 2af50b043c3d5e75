"""Names and titles from a stranger's files: all commands end well, no page runs them, and no file lands elsewhere."""

from pathlib import Path

import pytest
from reach import COARSE, write_reach

import vegglue
from vegglue.case.config import load_case

EVIL = "<script>alert(1)</script>"
AWAY = "../../../away/$x^$ 10\\south %"
OWN_FILES = ["brook.yaml", "velocities.csv"]


def strange_reach(folder: Path, name: str) -> Path:
    """The brook with one name for everything that may have any."""
    quoted = "'" + name.replace("'", "''") + "'"
    changes = [
        ("title: A short reach with one patch of willows", f"title: {quoted}"),
        ("June", quoted),
        *[(f"{word}:", f"{quoted}:") for word in ("willow", "bank", "upstream")],
        *[
            (f"{key}: {word}", f"{key}: {quoted}")
            for key, word in (("stand", "willow"), ("name", "p1"), ("class", "bank"))
        ],
        ("file: velocities.csv", "file: velocities.csv, standard_error: 0.01"),
        ("unit: s m^(-1/3)", f"unit: {quoted}, symbol: {quoted}, meaning: {quoted}"),
        ("simulate: {members: 1024, seed: 7}", "simulate: {members: 64, seed: 7}\ninfer: {method: glue}"),
    ]
    path = write_reach(folder, COARSE, *changes)
    table = (folder / "velocities.csv").read_text(encoding="utf-8")
    (folder / "velocities.csv").write_text(table.replace("above", name).replace("below", f"{name}2"), encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.parametrize("name", [EVIL, AWAY])
def test_a_name_is_text_wherever_it_comes_to_stand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    folder = tmp_path / "a" / "b" / "c"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder)
    case = load_case(strange_reach(folder, name))
    assert list(case.experiments) == [name]
    vegglue.check(case)
    vegglue.simulate(case, jobs=1)
    vegglue.infer(case)
    vegglue.diagnose(case, jobs=1)
    vegglue.compare([case], jobs=1)
    vegglue.report(case)
    vegglue.overview([case])
    pages = [path for path in (folder / "runs").rglob("*") if path.suffix in (".html", ".svg")]
    assert len([path for path in pages if path.suffix == ".html"]) >= 2
    for path in pages:
        text = path.read_text(encoding="utf-8")
        assert EVIL not in text, path
        assert "<script>alert" not in text, path
    report = (folder / "runs" / "brook" / "report.html").read_text(encoding="utf-8")
    assert "&lt;script&gt;alert(1)" in report or name == AWAY
    outside = [path for path in tmp_path.rglob("*") if path.is_file() and folder / "runs" not in path.parents]
    assert sorted(path.name for path in outside) == OWN_FILES
