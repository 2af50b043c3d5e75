"""Velocities against the stream and levels that run uphill are named before anything is solved."""

from pathlib import Path

import pytest
from reach import write_reach

from vegglue.case.config import load_case
from vegglue.diagnosis.directions import remarks_on_directions
from vegglue.measurements.observations import read_observations

LINE = "  - {kind: velocity, file: velocities.csv, experiment: June}\n"


def said_of(folder: Path, velocities: str = "", levels: str = "", across: str = "") -> list[str]:
    """What is said of the brook with other tables."""
    added = {"level": ("levels.csv", levels), "velocity_across": ("across.csv", across)}
    more = [f"  - {{kind: {kind}, file: {file}, experiment: June}}\n" for kind, (file, text) in added.items() if text]
    config = write_reach(folder, (LINE, LINE + "".join(more)))
    if velocities:
        (folder / "velocities.csv").write_text(velocities, encoding="utf-8")
    for file, text in added.values():
        (folder / file).write_text(text, encoding="utf-8")
    case = load_case(config)
    return list(remarks_on_directions(case, read_observations(case)))


def test_a_brook_that_runs_downhill_has_no_remark(tmp_path: Path) -> None:
    assert said_of(tmp_path, levels="x,y,level,level_se\n2,0,0.99,0.002\n25,0,0.96,0.002\n") == []


def test_the_whole_stream_reversed(tmp_path: Path) -> None:
    (said,) = said_of(tmp_path, "section,x,y,u\nA,8,-1,-0.4\nA,8,0,-0.5\nB,20,0,-0.4\n")
    assert "run upstream, -0.4 m/s in the middle" in said
    assert "`flip: [x]`" in said


def test_a_centreline_drawn_upstream_is_to_be_reversed(tmp_path: Path) -> None:
    case = load_case(write_reach(tmp_path, ("cell: ", "centreline: {parts: [{length: 30}]}, cell: ")))
    (tmp_path / "velocities.csv").write_text("section,x,y,u\nA,8,-1,-0.4\nA,8,0,-0.5\nB,20,0,-0.4\n", encoding="utf-8")
    (said,) = remarks_on_directions(case, read_observations(case))
    assert "`reverse: true`" in said
    assert "flip" not in said


def test_one_section_reversed(tmp_path: Path) -> None:
    rows = "section,x,y,u\n" + "".join(f"A,8,{y},-0.2\nB,14,{y},0.4\nC,20,{y},0.5\n" for y in (-1, 0, 1))
    (said,) = said_of(tmp_path, rows)
    assert said.startswith("All velocities of A in experiment June run upstream")


def test_an_eddy_is_no_reversed_section(tmp_path: Path) -> None:
    assert said_of(tmp_path, "section,x,y,u\nA,8,-2,-0.05\nA,8,0,0.5\nA,8,1,0.4\n") == []


def test_components_exchanged(tmp_path: Path) -> None:
    (said,) = said_of(tmp_path, "section,x,y,u\nA,8,0,0.02\n", across="section,x,y,v\nA,8,0,-0.4\n")
    assert "u and v are exchanged" in said


@pytest.mark.parametrize(("last", "said"), [("1.05", 1), ("0.992", 0)])
def test_levels_that_rise_downstream(tmp_path: Path, last: str, said: int) -> None:
    found = said_of(tmp_path, levels=f"x,y,level,level_se\n2,0,0.99,0.002\n25,0,{last},0.002\n")
    assert len(found) == said
    assert all("rise downstream, by 0.06 m" in one for one in found)
