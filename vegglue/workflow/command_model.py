"""Models of a case that another model predicts: a command of `engine`, linearised from its predictions where it fits
best, or a finished run.

runs/<name>/engine/place.json holds that place and the hash of the case; all runs of the command lie beside it.
"""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import CommandPlace, command_place
from vegglue.case.parameter_space import thetas_at, z_at
from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case
from vegglue.case.text_files import LARGEST_JSON, read_text, write_text
from vegglue.engine.command import CommandEnd, command_predictions, command_runs, ended_runs
from vegglue.engine.corrected import corrected, correction_at, with_correction, without_effects
from vegglue.engine.finished import compared_flows
from vegglue.engine.interface import Model, Point, linearise
from vegglue.errors import InputError, shown_path
from vegglue.inference.weighted_statistics import root_mean_square, stations_by_kind
from vegglue.measurements.kinds import STREAMWISE, kind_of
from vegglue.progress import Watch
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.verdict import CommandCompared, CommandDiffers, CommandNotSettled, ResultCompared
from vegglue.wording.phases import COMMAND_ONCE_MORE
from vegglue.wording.remedies import MAKE_ROOM

if TYPE_CHECKING:
    from vegglue.inference.surrogate import CommandToLearn

PLACE_FILE, FINISHED = "place.json", "finished"
# Standard deviation of the discharge along the channel over its mean [-], above which a flow is not at rest. Chosen:
# what is lost by interpolation between the cells of a mesh is some per cent.
SPREAD_OF_STEADY = 0.05
# Difference between the command and its linear model [standard errors, root mean square] above which sizes and chances
# are taken with care. Chosen, not measured: half an error hardly moves a score.
CLOSE_ENOUGH = 0.5
# The same above which no verdict is believed: larger than what names rest on. Chosen after a command that gave the same
# numbers for all parameters was diagnosed as water that enters the channel.
BEYOND_BELIEF = 3.0


@dataclass(frozen=True)
class PredictedRange:
    """Predictions of one kind by a command: its words, smallest and largest value [unit].

    apart: root mean square difference from the built-in engine [unit], NaN without its flow; times: how many times as
    large velocities along x are, by least squares [-], 1 for other kinds.
    """

    words: str
    low: float
    high: float
    unit: str
    apart: float
    times: float

    @property
    def opposite(self) -> bool:
        """Whether velocities have the other sign."""
        return self.times < 0.0

    @property
    def of_another_unit(self) -> bool:
        """Whether velocities may be in another unit: five times as large or small; dm/s are ten times."""
        return not self.opposite and not 0.2 < self.times < 5.0


@dataclass(frozen=True)
class CommandTried:
    """Runs of the command of `engine`, at the medians of the priors and a step ahead in each parameter.

    seconds: of the first [s]; unchanged: parameters whose step changes no prediction, of `parameters` in all; failed:
    those at whose step the command fails; step: in standard deviations of the prior [-].
    """

    seconds: float
    kinds: tuple[PredictedRange, ...]
    parameters: int = 0
    unchanged: tuple[str, ...] = ()
    failed: tuple[str, ...] = ()
    step: float = 0.1


def with_command(model: Model, folder: Path, watch: Watch) -> Model:
    """The model with the engine of its command or of its finished run, if its case has one.

    Parameters
    ----------
    folder : Path
        Of the results of the case.
    watch : callable
        Is called with each phase.

    Raises
    ------
    InputError
        If the command cannot be run, or fails where it fits best; if the flow of the finished run is too far from that
        of the built-in engine.
    """
    if model.case.engine is not None:
        return place_of_command(model, folder, watch).model
    if model.case.finished_result is None:
        return model
    found = compared_flows(model)
    refuse_unlike(model.case, found.agreement)
    return replace(model, engine=with_correction(found.correction.at, FINISHED))


def command_to_learn(model: Model, folder: Path, watch: Watch) -> "tuple[Model, CommandToLearn]":
    """The built-in engine corrected where the command of a case fits best, and what a surrogate is learned from.

    Parameters
    ----------
    folder : Path
        Of the results of the case.
    watch : callable
        Is called with each phase.

    Returns
    -------
    Model
        With that engine, so that many predictions cost no run.
    CommandToLearn
    """
    from vegglue.inference.surrogate import CommandToLearn  # late: only `infer` of a command waits for it

    place, runs = place_of_command(model, folder, watch), command_runs(model.case, folder)
    near = replace(model, engine=with_correction(place.correction.at, "place"))
    return near, CommandToLearn(runs, place.run, place.failed, runs.settings.most_runs)


def refuse_unlike(case: Case, found: ResultCompared) -> None:
    """Raise InputError if the flow of a finished run is beyond the limits of its difference from the built-in one."""
    if found.alike:
        return
    shares = (found.velocity_share, found.level_share, found.area_share)
    worst = max(range(3), key=lambda one: shares[one] / found.limits[one])
    raise InputError(
        "unlike_flow", file=case.source, quantity=("velocity", "level", "area")[worst], limit=found.limits[worst],
        got=shares[worst], beyond=found.beyond_mesh if found.beyond_mesh > 0.5 * found.limits[2] else 0.0,
        spread=found.discharge_spread if found.discharge_spread > SPREAD_OF_STEADY else 0.0,
    )  # fmt: skip


def unseen_with_command(unseen: Model, model: Model, folder: Path, watch: Watch) -> Model:
    """The model at held-out stations, with the command linearised there at the place of `model`."""
    if model.case.engine is None:
        if model.case.finished_result is None:
            return unseen
        return replace(unseen, engine=with_correction(compared_flows(unseen).correction.at, FINISHED))
    runs = command_runs(model.case, folder)
    correction = correction_at(runs, unseen, place_of_command(model, folder, watch).z, watch)
    return replace(unseen, engine=corrected(correction, runs, watch))


def with_command_compared(found: Diagnosis, model: Model, folder: Path, watch: Watch) -> Diagnosis:
    """The diagnosis with a first note on how far the command is from its linear model at the last parameters.

    The command is run once more for it. A verdict on numbers that the command does not give is not believed. With a
    finished run, the note is how far its flow is from the built-in engine's.
    """
    if model.case.engine is None:
        if model.case.finished_result is None:
            return found
        beside = compared_flows(model).agreement
        return replace(found, verdict=replace(found.verdict, notes=(beside, *found.verdict.notes)))
    place, runs = place_of_command(model, folder, watch), command_runs(model.case, folder)
    bare = replace(without_effects(model), engine=place.model.engine)
    theta = {name: found.parameters.last[name][0] for name in bare.names}
    z = z_at(bare.case, {name: np.array([value]) for name, value in theta.items()})[0]
    linear = linearise(bare, z)
    why = COMMAND_ONCE_MORE
    there, failures = command_predictions(runs, bare.case, model.station, [theta], watch, why)
    compared = command_compared(place, len(bare.names), there[0], failures[0], linear, found.predictions.error)
    verdict = replace(found.verdict, notes=(compared, *found.verdict.notes))
    if compared.errors > BEYOND_BELIEF:
        verdict = replace(verdict, kind="cannot-tell", distrust=CommandDiffers(compared.errors))
    elif place.correction.rough and not place.settled:
        # Noise in differences alone is a caution, as of a parameter that hardly matters; with a search that did not
        # settle it has led astray: a command with noise of a third of an error, to friction that was not there.
        verdict = replace(verdict, kind="cannot-tell", distrust=CommandNotSettled(tuple(place.correction.rough)))
    return replace(found, verdict=verdict)


def command_compared(
    place: CommandPlace, parameters: int, there: Array, failure: str, linear: Point | None, error: Array
) -> CommandCompared:
    """How far the command is from its linear model; error: of each station, NaN if it does not count."""
    off = float("nan")
    if not failure and linear is not None:
        used = np.isfinite(error)
        off = root_mean_square((there - linear.prediction)[used] / error[used])
    return CommandCompared(
        place.places,
        parameters,
        off,
        failure.removesuffix("."),
        tuple(place.correction.rough),
        place.settled,
        off > CLOSE_ENOUGH,
    )


def command_tried(model: Model, folder: Path) -> CommandTried:
    """Run the command at the medians of the priors and a step ahead in each parameter; a diagnosis uses the same runs.

    Parameters
    ----------
    folder : Path
        Of the results of the case.

    Raises
    ------
    InputError
        If it fails at the medians.
    """
    case, bare = model.case, without_effects(model)
    middle, runs = np.zeros(len(bare.names)), command_runs(case, folder)

    def run_at(points: Array) -> dict[int, CommandEnd]:
        return dict(ended_runs(runs, bare.case, model.station, thetas_at(bare.case, points)))

    end = run_at(middle[None])[0]
    if end.prediction is None:
        raise InputError(
            f"{shown_path(case.source)}: the command of `engine` failed at the medians of the priors: {end.reason}; "
            f"its files lie in {shown_path(runs.folder)}."
        )
    ahead = run_at(runs.settings.step * np.eye(middle.size))
    unchanged = tuple(
        name
        for row, name in enumerate(bare.names)
        if (there := ahead[row].prediction) is not None and np.array_equal(there, end.prediction)
    )
    failed = tuple(name for row, name in enumerate(bare.names) if ahead[row].prediction is None)
    own, ranges = linearise(bare, middle), []
    for name, rows in stations_by_kind(model.station).items():
        kind, found = kind_of(name), end.prediction[rows]
        apart, times = float("nan"), 1.0
        if own is not None:
            built_in = own.prediction[rows]
            apart = root_mean_square(found - built_in)
            if name == STREAMWISE and built_in.any():
                times = float(found @ built_in) / float(built_in @ built_in)
        ranges.append(PredictedRange(kind.words, float(found.min()), float(found.max()), kind.unit, apart, times))
    return CommandTried(end.seconds, tuple(ranges), len(bare.names), unchanged, failed, runs.settings.step)


def refuse_command(case: Case, verb: str) -> None:
    """Raise InputError for a case with an `engine`, in a verb that needs the built-in one."""
    if case.of_another_model:
        key = "engine" if case.engine is not None else "finished_result"
        raise InputError(
            f"{shown_path(case.source)}: `{verb}` works with the built-in engine only; take `{key}` out of the config."
        )


def place_of_command(model: Model, folder: Path, watch: Watch) -> CommandPlace:
    """The place where the command of a case fits best: as an earlier verb has left it, or searched and kept.

    Parameters
    ----------
    folder : Path
        Of the results of the case.
    watch : callable
        Is called with each phase.
    """
    runs, path, wanted = command_runs(model.case, folder), folder / "engine" / PLACE_FILE, case_hash(model.case)
    known = kept_place(path, wanted, len(model.names))
    if known is not None:
        z, settled, places, run, failed = known
        correction = correction_at(runs, model, z, watch)
        here = replace(model, engine=corrected(correction, runs, watch))
        return CommandPlace(here, z, settled, places, correction, run, failed)
    found = command_place(runs, model, watch=watch)
    text = json.dumps(
        {
            "config_hash": wanted, "z": found.z.tolist(), "settled": found.settled, "places": found.places,
            "run": found.run.tolist(), "failed": found.failed,
        }
    )  # fmt: skip
    write_text(path, text, MAKE_ROOM)
    return found


def kept_place(path: Path, wanted: str, parameters: int) -> tuple[Array, bool, int, Array, int] | None:
    """The place of a command in a file.

    Parameters
    ----------
    wanted : str
        Hash of the case.
    parameters : int
        p.

    Returns
    -------
    tuple or None
        z (p,), whether its search settled, places tried, where the command ran (k, q), and how many runs failed; None
        if the file is damaged or of another case.
    """
    try:
        kept = json.loads(read_text(path, LARGEST_JSON))
        z, run = np.array(kept["z"], dtype=float), np.array(kept["run"], dtype=float)
        fitting = z.shape == (parameters,) and run.ndim == 2 and np.isfinite(z).all() and np.isfinite(run).all()
        if kept["config_hash"] == wanted and fitting:
            return z, bool(kept["settled"]), int(kept["places"]), run, int(kept["failed"])
    except (InputError, ValueError, KeyError, TypeError, RecursionError):
        pass
    return None
