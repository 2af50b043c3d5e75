"""config -> ensemble, each member a run of the command of its `engine`; appended as they end.

A case with effects adds what they change in the built-in solver, which knows them and the command does not.
"""

from contextlib import closing
from pathlib import Path

import numpy as np

from vegglue.case.parameter_space import PriorSample, sample_of, sobol_sample
from vegglue.case.resolved_config import simulation_hash
from vegglue.case.schema import Case
from vegglue.engine.command import CommandEnd, CommandRuns, ended_runs, own_parameters
from vegglue.flow.status import FAILED, RUN_BY_COMMAND
from vegglue.inference.solve_ensemble import (
    Rows,
    left_to_do,
    make_header,
    refuse_too_many,
    section_positions,
    solved_members,
)
from vegglue.measurements.observations import Observations
from vegglue.progress import Progress, Watch
from vegglue.results.resume import ensemble_writer


def run_ensemble(
    case: Case, observations: Observations, path: Path, runs: CommandRuns, jobs: int, watch: Watch
) -> None:
    """Run all members of the case and write them to `path`; what an earlier run of the same case has run is kept.

    jobs: processes of the built-in solver, where the case has effects. Errors: InputError for a case without
    parameters; StorageError when another run holds the folder or the disk is full (what was written stays).
    """
    wanted = simulation_hash(case)
    refuse_too_many(case, observations)
    sample, names = sobol_sample(case), own_parameters(case)
    chunks = [np.array([member]) for member in range(case.simulate.members)]  # a run costs more than to write it down
    with ensemble_writer(path, make_header(case, wanted, observations, sample.theta, chunks, None)) as writer:
        todo = left_to_do(writer, case, chunks, watch)
        resumed, failed, phase = len(chunks) - len(todo), 0, f"running the command of {case.name}"
        watch(Progress(phase, resumed, len(chunks), "members", failed, resumed))
        added = _added_by_effects(case, observations, sample, names, jobs)  # of all: chunks decide their last digits
        thetas = [{name: float(sample.theta[name][member]) for name in names} for member in todo]
        with closing(ended_runs(runs, case, observations.table, thetas)) as ends:
            for solved, (position, end) in enumerate(ends, resumed + 1):
                rows = _rows(case, observations, end, added[todo[position]])
                writer.append(todo[position], chunks[todo[position]], rows)
                failed += int(rows["status"][0] == FAILED)
                watch(Progress(phase, solved, len(chunks), "members", failed, resumed))


def _added_by_effects(
    case: Case, observations: Observations, sample: PriorSample, names: tuple[str, ...], jobs: int
) -> np.ndarray:
    """What the effects of the case change in predictions of the built-in solver (member, station), NaN where it finds
    no flow; zero without effects.
    """
    if not case.effects or not len(sample.points):
        return np.zeros((len(sample.points), len(observations.table)))
    bare = case.model_copy(update={"effects": {}, "parameters": {name: case.parameters[name] for name in names}})
    without = sample_of(bare, {name: sample.theta[name] for name in names})
    return solved_members(case, observations, sample, jobs) - solved_members(bare, observations, without, jobs)


def _rows(case: Case, observations: Observations, end: CommandEnd, added: np.ndarray) -> Rows:
    """The rows of one member; what a command does not tell is NaN."""
    reason = end.reason
    if end.prediction is not None and np.isnan(added).any():
        reason = "the built-in solver found no flow with or without the effects of the case"
    stations, sections = len(observations.table), section_positions(observations)
    prediction = np.full(stations, np.nan) if end.prediction is None or reason else end.prediction + added
    return {
        "prediction": prediction[None],
        "section_flow": np.full((1, len(case.experiments), len(sections)), np.nan),
        "mass_error": np.array([np.nan]),
        "status": np.array([FAILED if reason else RUN_BY_COMMAND], np.int8),
        "reason": np.array([reason], object),
        "iterations": np.zeros(1, np.int32),
        "seconds": np.array([end.seconds]),
    }
