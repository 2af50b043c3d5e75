"""Commands that write among a user's own files: import, extend, twin; and a larger ensemble, which cost hours."""

import json
from pathlib import Path

import pytest
from reach import COARSE, Say, block, write_reach

from vegglue.calibration.candidates import Candidate, acting_in
from vegglue.case.config import load_case
from vegglue.diagnosis.child_config import child_name
from vegglue.effects.library import library

SIXTEEN = (COARSE, ("members: 1024", "members: 16"))
WITH_ERRORS = ("experiment: June}", "experiment: June, standard_error: 0.01}")


@pytest.fixture
def say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say) -> Say:
    monkeypatch.chdir(tmp_path)
    write_reach(tmp_path, *SIXTEEN, WITH_ERRORS)
    return say


def refused(said: tuple[int, str], *parts: str) -> None:
    code, error = said
    assert code == 2, error
    assert error.count("\n") == 1
    assert all(part in error for part in parts), error


def test_a_twin_leaves_the_folder_it_is_made_from_as_it_is(tmp_path: Path, say: Say) -> None:
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    refused(say("twin", "brook.yaml", "--to", ".", "--hide", "nothing"), "velocities.csv", "--force", "--to")
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
    assert say("twin", "brook.yaml", "--to", "riddle", "--hide", "nothing")[0] == 0
    assert say("twin", "brook.yaml", "--to", "riddle", "--hide", "nothing", "--seed", 2)[0] == 0, "its own"
    config = tmp_path / "riddle/riddle.yaml"
    config.write_text(config.read_text().replace("Twin of", "My twin of"))
    refused(say("twin", "brook.yaml", "--to", "riddle", "--hide", "nothing"), "riddle/riddle.yaml", "edited since")
    refused(say("twin", "riddle/riddle.yaml", "--to", "riddle", "--force"), "the config that the twin is made of")


def test_a_child_leaves_its_parent_and_other_files(tmp_path: Path, say: Say) -> None:
    extend = ("extend", "brook.yaml", "--add", "streamlining")
    before = (tmp_path / "brook.yaml").read_bytes()
    for more in ((), ("--force",)):
        refused(say(*extend, "--to", "brook.yaml", *more), "is the config that it extends")
    refused(say(*extend, "--to", "velocities.csv"), "velocities.csv: is there", "--force")
    assert (tmp_path / "brook.yaml").read_bytes() == before
    assert say(*extend) == (0, "")
    assert say(*extend, "--shape", "n=2")[0] in (0, 2)
    child = next(path for path in tmp_path.glob("brook+*.yaml"))
    child.write_text(child.read_text() + "# my own remark\n")
    refused(say(*extend), child.name, "edited since")
    assert say(*extend, "--force") == (0, "")


def test_a_second_import_keeps_edits(tmp_path: Path, say: Say) -> None:
    folder = tmp_path / "my-site"
    folder.mkdir()
    (folder / "site.json").write_text(block("json"), encoding="utf-8")
    (folder / "velocities.csv").write_text("experiment,section,x,y,u,u_se\nlow,A,50,0,0.4,0.01\n", encoding="utf-8")
    assert say("import", "my-site") == (0, "")
    site = json.loads(block("json")) | {"canopy_height_guess_m": 0.7}
    (folder / "site.json").write_text(json.dumps(site), encoding="utf-8")
    assert say("import", "my-site") == (0, ""), "its own"
    config = tmp_path / "my-site.yaml"
    config.write_text(config.read_text("utf-8").replace("Measurements of", "My measurements of"), "utf-8")
    refused(say("import", "my-site"), "my-site.yaml", "edited since")
    assert "My measurements" in config.read_text("utf-8")
    assert say("import", "my-site", "--force") == (0, "")
    refused(say("import", "my-site", "--to", ".", "--force"), "file", "--to")


def test_a_second_import_keeps_edited_tables(tmp_path: Path, say: Say) -> None:
    """Tables were written before it was known whether the config may be, and never asked about."""
    folder = tmp_path / "mill"
    folder.mkdir()
    ground = "bed: {file: bed.csv}\ngrid: {x: [0, 8], y: [-2, 2], cell: [1.0, 0.25]}\n"
    june = "experiments: {June: {discharge: 2, level: 1.0}}\n"
    (folder / "site.yaml").write_text(ground + june, encoding="utf-8")
    (folder / "bed.csv").write_text("x,y,z\n0,-2,0\n0,2,0\n8,-2,0\n8,2,0\n", encoding="utf-8")
    (folder / "u.csv").write_text("x;y;u;u_se\n4;0;0.4;0.01\n", encoding="utf-8")
    assert say("import", "mill") == (0, "")
    for name in ("u-velocity.csv", "bed.asc"):
        table = tmp_path / "mill-data" / name
        made = table.read_text()
        table.write_text(made + "\n")
        refused(say("import", "mill"), name, "edited since")
        assert table.read_text() == made + "\n"
        assert say("import", "mill", "--force") == (0, "")
        assert table.read_text() == made
    (folder / "u.csv").write_text("x;y;u;u_se\n4;0;0.5;0.01\n", encoding="utf-8")
    assert say("import", "mill") == (0, ""), "its own"


def test_a_larger_ensemble_stays(tmp_path: Path, say: Say) -> None:
    assert say("simulate", "brook.yaml", "--jobs", 1) == (0, "")
    before = (tmp_path / "runs/brook/ensemble.h5").read_bytes()
    for step in ("simulate", "run"):
        refused(say(step, "brook.yaml", "--members", 8), "holds 16 members of this case, which 8 would", "--members 16")
    assert (tmp_path / "runs/brook/ensemble.h5").read_bytes() == before
    assert say("simulate", "brook.yaml", "--members", 8, "--force", "--jobs", 1) == (0, "")
    assert say("simulate", "brook.yaml", "--members", 16, "--jobs", 1) == (0, ""), "more members need not be forced"


def test_a_child_of_a_long_name_has_another_than_its_parent(tmp_path: Path) -> None:
    added = [[Candidate(effect)] for effect in library().values()]
    names = {child_name("a" * 100, one) for one in added}
    assert len(names) == len(added)
    assert "a" * 100 not in names
    assert all(len(name) <= 100 for name in names)
    assert child_name("brook", added[0]).startswith("brook-")


def test_children_of_two_experiments_have_two_names() -> None:
    """An experiment without a Latin letter left no trace in the folder of results."""
    effect = library()["discharge_error"]
    added = [Candidate(effect), *(acting_in(effect, "experiment", (name,)) for name in ("高", "低"))]
    assert len({child_name("brook", [one]) for one in added}) == len(added)


def test_stations_outside_the_grid_give_no_posterior(tmp_path: Path, say: Say) -> None:
    assert load_case(tmp_path / "brook.yaml").name == "brook"
    table = tmp_path / "velocities.csv"
    heading, *rows = table.read_text(encoding="utf-8").splitlines()
    column = heading.split(",").index("x")
    far = [",".join("9999" if place == column else cell for place, cell in enumerate(row.split(","))) for row in rows]
    table.write_text("\n".join([heading, *[f"{row[:-1]}{number % 10}" for number, row in enumerate(far)]]) + "\n")
    refused(say("infer", "brook.yaml"), "expected a station in use, got none")
    (tmp_path / "brook.yaml").write_text(
        (tmp_path / "brook.yaml").read_text(encoding="utf-8") + "numerics: {tolerance: 1e9}\n", encoding="utf-8"
    )
    refused(say("check", "brook.yaml"), "`numerics.tolerance`", "0.01")
