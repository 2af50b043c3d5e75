"""config -> ensemble, each member a run of the command of its `engine`; appended as they end.

Of a case with effects what these change in the built-in solver is added: the command has none of them.
"""

from collections import Counter
from contextlib import closing
from dataclasses import dataclass
from itertools import combinations_with_replacement
from pathlib import Path

import numpy as np
from scipy.special import fdtrc

from vegglue.arrays import Array
from vegglue.case.parameter_space import PriorSample, sample_of, sobol_sample
from vegglue.case.schema import Case
from vegglue.engine.command import CommandRuns, ended_runs, own_parameters
from vegglue.errors import InputError, shown_path
from vegglue.flow.status import FAILED, RUN_BY_COMMAND
from vegglue.inference.solve_ensemble import (
    ensemble_hash,
    left_to_do,
    make_header,
    refuse_too_many,
    section_positions,
    solved_members,
)
from vegglue.measurements.kinds import kind_of
from vegglue.measurements.observations import Observations
from vegglue.progress import Progress, Watch
from vegglue.results.ensemble import Ensemble
from vegglue.results.resume import ensemble_writer
from vegglue.wording.phases import RUNNING_COMMAND
from vegglue.wording.sentences import phrase, sentence

# Share of a prediction [-] below which two are the same: what a sum in another order changes.
SAME = 1e-12
# Chance of a fit as good by errors alone [-], at any station, above which a parameter is stated to change nothing.
# Chosen: a command that reads a parameter gives chances that are smaller by many powers of ten.
NO_INFLUENCE = 1e-3
# Members for each term of a regression [-]. Chosen: with fewer a parameter may have an influence that does not show.
FEWEST_MEMBERS_PER_TERM = 2


@dataclass(frozen=True)
class PredictionsUnchanged:
    """All members have the same predictions at every used station, whatever these parameters are."""

    parameters: tuple[str, ...]
    members: int


@dataclass(frozen=True)
class StationsUnchanged:
    """Used stations at which all members predict the same.

    Attributes
    ----------
    count, total : int
        How many of the used ones.
    experiment : str
        Of the first of them.
    first : (float, float)
        Its x and y [m].
    value : float
        Its prediction [unit].
    """

    count: int
    total: int
    experiment: str
    first: tuple[float, float]
    value: float
    unit: str
    members: int


@dataclass(frozen=True)
class PredictionsRepeated:
    """So many members have exactly the predictions of another one, whose parameters differ."""

    count: int
    members: int


@dataclass(frozen=True)
class ParametersWithoutInfluence:
    """Parameters that no prediction at a used station depends on, as far as these members show."""

    parameters: tuple[str, ...]
    members: int


@dataclass(frozen=True)
class FailuresFollowParameter:
    """Failed members lie at the high or the low end of a parameter: half of them beyond `median` [its unit]."""

    parameter: str
    high: bool
    median: float
    failed: int


EnsembleDoubt = (
    FailuresFollowParameter
    | PredictionsUnchanged
    | StationsUnchanged
    | PredictionsRepeated
    | ParametersWithoutInfluence
)


def doubts_of_predictions(ensemble: Ensemble) -> tuple[EnsembleDoubt, ...]:
    """What is odd about the members of a command: predictions that do not follow the parameters, failures that do.

    Parameters
    ----------
    ensemble : Ensemble
        Of any engine; one of the built-in engine is never doubted.

    Returns
    -------
    tuple of EnsembleDoubt
        `PredictionsUnchanged` alone if all predictions are the same. A parameter has no influence if no station of a
        quadratic regression shows it (Fisher's F), and failures follow it by the test of Mann and Whitney.
    """
    used = ensemble.station["used"].to_numpy(bool)
    solved = np.isfinite(ensemble.prediction[:, used]).all(axis=1) & (ensemble.status != FAILED)
    members, station = int(solved.sum()), ensemble.station[used]
    if not ensemble.by_command or members < 2 or not used.any():
        return ()
    predicted = ensemble.prediction[np.ix_(solved, used)]
    unchanged = np.ptp(predicted, axis=0) <= SAME * np.abs(predicted).max(axis=0)
    if unchanged.all():
        return (PredictionsUnchanged(tuple(ensemble.parameters), members),)
    found: list[EnsembleDoubt] = []
    if 2 < members < solved.size - 2:
        from scipy.stats import mannwhitneyu  # late: other commands need not wait for it

        for name, values in ensemble.parameters.items():
            test = mannwhitneyu(values[~solved], values[solved])
            if test.pvalue < NO_INFLUENCE:
                high = bool(test.statistic > 0.5 * members * (solved.size - members))
                middle = float(np.median(values[~solved]))
                found.append(FailuresFollowParameter(name, high, middle, solved.size - members))
    if unchanged.any():
        row = station.iloc[int(np.argmax(unchanged))]
        value, unit = float(predicted[0, np.argmax(unchanged)]), kind_of(str(row["kind"])).unit
        at = (float(row["x"]), float(row["y"]))
        count = int(unchanged.sum())
        found.append(StationsUnchanged(count, unchanged.size, str(row["experiment"]), at, value, unit, members))
    theta = np.column_stack([values[solved] for values in ensemble.parameters.values()])
    different = len(np.unique(np.column_stack([theta, predicted]), axis=0))
    if repeated := different - len(np.unique(predicted, axis=0)):
        found.append(PredictionsRepeated(repeated, members))
    without = _without_influence(theta, predicted[:, ~unchanged], tuple(ensemble.parameters))
    return (*found, ParametersWithoutInfluence(without, members)) if without else tuple(found)


def _without_influence(theta: Array, predicted: Array, names: tuple[str, ...]) -> tuple[str, ...]:
    """Names whose terms explain nothing in a quadratic fit of predicted (m, n) to ranks of theta (m, p); Fisher's F."""
    m, p = theta.shape
    rank = (np.argsort(np.argsort(theta, axis=0), axis=0) + 0.5) / m - 0.5
    terms = [(), *((j,) for j in range(p)), *combinations_with_replacement(range(p), 2)]
    if p < 2 or m < FEWEST_MEMBERS_PER_TERM * len(terms):
        return ()
    columns = np.column_stack([np.prod(rank[:, list(term)], axis=1) for term in terms])

    def left(keep: list[int]) -> Array:
        basis = np.linalg.qr(columns[:, keep])[0]
        return np.asarray(np.sum((predicted - basis @ (basis.T @ predicted)) ** 2, axis=0))

    everything, found = left([*range(len(terms))]), []
    for j, name in enumerate(names):
        keep = [at for at, term in enumerate(terms) if j not in term]
        more, free = len(terms) - len(keep), m - len(terms)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = (left(keep) - everything) / more / (everything / free)
        chance = fdtrc(more, free, np.maximum(np.nan_to_num(ratio, posinf=np.inf), 0.0))
        if not (chance * predicted.shape[1] < NO_INFLUENCE).any():
            found.append(name)
    return tuple(found)


def refuse_useless(case: Case, ensemble: Ensemble) -> None:
    """Refuse an ensemble of which nothing can be inferred; its file stays.

    Raises
    ------
    InputError
        If all members failed, or the members of a command predict the same.
    """
    failed = ensemble.status == FAILED
    if failed.all():
        reason, many = Counter(map(str, ensemble.reason[failed])).most_common(1)[0]
        again = "" if case.engine is None else " with --force"
        raise InputError(
            f"{shown_path(case.source)}: expected members with a solution, got none of {failed.size:,}; {many:,} of "
            f"them: {reason or 'no steady flow'}. Mend that, or the priors, and simulate again{again}."
        )
    for doubt in doubts_of_predictions(ensemble):
        if isinstance(doubt, PredictionsUnchanged):
            raise InputError(f"{shown_path(case.source)}: {sentence(doubt)}")


def run_ensemble(
    case: Case,
    observations: Observations,
    path: Path,
    runs: CommandRuns,
    jobs: int,
    watch: Watch,
    given: PriorSample | None = None,
) -> None:
    """Run all members of the case and write them to `path`; what an earlier run of the same case has run is kept.

    Parameters
    ----------
    case : Case
        With at least one parameter.
    observations : Observations
        Stations at which the command predicts.
    path : Path
        Of the HDF5 file.
    jobs : int
        Processes of the built-in solver, if the case has effects.
    watch : callable
        Is called after each run.
    given : PriorSample, optional
        Members in place of those that the case draws from its priors; as many as it has.

    Raises
    ------
    InputError
        If the case has no parameters, or too many predictions.
    StorageError
        If another run holds the folder or the disk is full; what was written stays.
    """
    wanted = ensemble_hash(case, given)
    refuse_too_many(case, observations)
    sample, names = given or sobol_sample(case), own_parameters(case)
    chunks = [np.array([member]) for member in range(case.simulate.members)]  # a run costs more than to write it down
    stations, sections = len(observations.table), len(section_positions(observations))
    with ensemble_writer(path, make_header(case, wanted, observations, sample.theta, chunks, None)) as writer:
        todo = left_to_do(writer, case, chunks, watch)
        resumed, failed, phase = len(chunks) - len(todo), 0, RUNNING_COMMAND.format(case.name)
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
                    reason = phrase("no_built_in_flow")
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
