"""Cases that differ only in what an ensemble does not depend on share one."""

from pathlib import Path

import pytest
from reach import COARSE, write_reach

import vegglue
from vegglue.case.resolved_config import simulation_hash
from vegglue.progress import Progress
from vegglue.results.result_files import stored_hash


def write_beside(folder: Path, name: str, line: str) -> Path:
    path = folder / f"{name}.yaml"
    path.write_text(f"extends: brook.yaml\nname: {name}\n{line}\n", encoding="utf-8")
    return path


@pytest.mark.slow
def test_the_ensemble_of_a_run_beside_is_shared(tmp_path: Path) -> None:
    runs, heard = tmp_path / "runs", list[Progress]()
    case = vegglue.load_case(write_reach(tmp_path, COARSE, ("members: 1024", "members: 8")))
    weighed = vegglue.load_case(write_beside(tmp_path, "weighed", "infer: {method: glue}"))
    rougher = vegglue.load_case(write_beside(tmp_path, "rougher", "eddy_viscosity: 0.02"))
    first = vegglue.simulate(case, runs=runs, jobs=1)
    again = vegglue.simulate(weighed, runs=runs, jobs=1, watch=heard.append)
    assert heard == [], "nothing was solved"
    assert (again.prediction == first.prediction).all()
    vegglue.simulate(rougher, runs=runs, jobs=1, watch=heard.append)
    assert heard, "another flow is solved"

    changed = vegglue.load_case(write_reach(tmp_path, COARSE, ("members: 1024", "members: 4")))
    vegglue.simulate(changed, runs=runs, jobs=1, force=True)  # fewer members
    assert stored_hash(runs / "weighed" / "ensemble.h5") == simulation_hash(weighed), "a link is no tie"
