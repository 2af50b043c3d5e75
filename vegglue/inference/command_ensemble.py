"""config -> ensemble, each member a run of the command of its `engine`; appended as they end.

Of a case with effects what these change in the built-in solver is added: the command has none of them.
"""

from contextlib import closing
from pathlib import Path

import numpy as np

from vegglue.case.parameter_space import sample_of, sobol_sample
from vegglue.case.resolved_config import simulation_hash
from vegglue.case.schema import Case
from vegglue.engine.command import CommandRuns, ended_runs, own_parameters
from vegglue.flow.status import FAILED, RUN_BY_COMMAND
from vegglue.inference.solve_ensemble import (
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

    jobs: processes of the built-in solver, if the case has effects. Raises InputError for a case without parameters,
    StorageError if another run holds the folder or the disk is full (what was written stays).
    """
    wanted = simulation_hash(case)
    refuse_too_many(case, observations)
    sample, names = sobol_sample(case), own_parameters(case)
    chunks = [np.array([member]) for member in range(case.simulate.members)]  # a run costs more than to write it down
    stations, sections = len(observations.table), len(section_positions(observations))
    with ensemble_writer(path, make_header(case, wanted, observations, sample.theta, chunks, None)) as writer:
        todo = left_to_do(writer, case, chunks, watch)
        resumed, failed, phase = len(chunks) - len(todo), 0, f"running the command of {case.name}"
        watch(Progress(phase, resumed, len(chunks), "members", failed, resumed))
        # What effects change in the built-in solver, NaN if it finds no flow; of all: chunks decide their last digits.
        added = np.zeros((len(sample.points), stations))
        if case.effects and len(sample.points):
            bare = case.model_copy(
                update={"effects": {}, "parameters": {name: case.parameters[name] for name in names}}
            )
            without = sample_of(bare, {name: sample.theta[name] for name in names})
            added = solved_members(case, observations, sample, jobs) - solved_members(bare, observations, without, jobs)
        thetas = [{name: float(sample.theta[name][member]) for name in names} for member in todo]
        with closing(ended_runs(runs, case, observations.table, thetas)) as ends:
            for solved, (position, end) in enumerate(ends, resumed + 1):
                index, reason = todo[position], end.reason
                if end.prediction is not None and np.isnan(added[index]).any():
                    reason = "the built-in solver found no flow with or without the effects of the case"
                found = np.full(stations, np.nan) if end.prediction is None or reason else end.prediction + added[index]
                # What a command does not give is NaN.
                rows = {
                    "prediction": found[None],
                    "section_flow": np.full((1, len(case.experiments), sections), np.nan),
                    "mass_error": np.array([np.nan]),
                    "status": np.array([FAILED if reason else RUN_BY_COMMAND], np.int8),
                    "reason": np.array([reason], object),
                    "iterations": np.zeros(1, np.int32),
                    "seconds": np.array([end.seconds]),
                }
                writer.append(index, chunks[index], rows)
                failed += int(bool(reason))
                watch(Progress(phase, solved, len(chunks), "members", failed, resumed))
