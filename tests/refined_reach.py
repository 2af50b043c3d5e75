"""The brook of docs/own_case.md with an ensemble of few members, for tests of posteriors."""

from pathlib import Path

from reach import write_reach

from vegglue.case.config import load_case
from vegglue.case.schema import Case
from vegglue.inference.solve_ensemble import solve_ensemble
from vegglue.measurements.observations import Observations, read_observations
from vegglue.results.ensemble import Ensemble
from vegglue.results.result_files import read_ensemble

FEW_MEMBERS = ("simulate: {members: 1024, seed: 7}", "simulate: {members: 64, seed: 7}\ninfer: {sigma: known}")
STATED_ERRORS = ("velocities.csv, experiment: June}", "velocities.csv, experiment: June, standard_error: 0.01}")
SolvedReach = tuple[Case, Observations, Ensemble]


def solved_reach(folder: Path, *changes: tuple[str, str]) -> SolvedReach:
    case = load_case(write_reach(folder, *changes))
    observations = read_observations(case)
    solve_ensemble(case, observations, folder / "ensemble.h5", 1, lambda progress: None)
    return case, observations, read_ensemble(folder / "ensemble.h5")
