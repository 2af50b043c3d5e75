"""The models of a case whose `engine` is a command: corrected to it where it fits best, which the next verb reads.

runs/<name>/engine/place.json holds that place and the hash of the case; all runs of the command lie beside it.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.command_place import CommandPlace, command_place
from vegglue.case.parameter_space import theta_at, z_at
from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case
from vegglue.case.text_files import LARGEST_JSON, read_text, write_text
from vegglue.engine.command import command_predictions, command_runs, ended_runs
from vegglue.engine.corrected import corrected, correction_at, without_effects
from vegglue.engine.interface import Model, Point, linearise
from vegglue.errors import InputError, shown_path
from vegglue.inference.weighted_statistics import root_mean_square, stations_by_kind
from vegglue.measurements.kinds import STREAMWISE, kind_of
from vegglue.progress import Watch
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.verdict import CommandCompared, CommandDiffers, CommandNotSettled
from vegglue.whole_files import MAKE_ROOM
from vegglue.wording.numbers import in_digits

PLACE_FILE = "place.json"
# Share of a standard error [-] by which the command may differ from what was reckoned with before it is a doubt.
# Chosen, not measured: half an error hardly moves a score.
CLOSE_ENOUGH = 0.5
# Standard errors by which it may differ before no verdict is believed: larger than what names rest on. Chosen after a
# command that gave the same numbers for all parameters was told as water that enters the channel.
BEYOND_BELIEF = 3.0
# How many times as large as those of the built-in engine velocities are that may be in another unit: 10 is dm/s.
OF_ANOTHER_UNIT = 5.0


def with_command(model: Model, folder: Path, watch: Watch) -> Model:
    """The model with the engine of its command, if its case has one; folder: of the results of the case.

    Errors: InputError when the command cannot be run, or fails where it fits best.
    """
    return model if model.case.engine is None else _place_of(model, folder, watch).model


def unseen_with_command(unseen: Model, model: Model, folder: Path, watch: Watch) -> Model:
    """The model at stations that no calibration sees, with the command corrected there at the place of `model`."""
    if model.case.engine is None:
        return unseen
    runs = command_runs(model.case, folder)
    correction = correction_at(runs, unseen, _place_of(model, folder, watch).z, watch)
    return replace(unseen, engine=corrected(correction, runs, watch))


def with_words_on_command(found: Diagnosis, model: Model, folder: Path, watch: Watch) -> Diagnosis:
    """The diagnosis with a remark, its first, on what the command said and what the built-in engine did; the command is
    run once more for it, at the last parameters that were found.
    """
    if model.case.engine is None:
        return found
    place, runs = _place_of(model, folder, watch), command_runs(model.case, folder)
    bare = replace(without_effects(model), engine=place.model.engine)
    theta = {name: found.parameters.last[name][0] for name in bare.names}
    z = z_at(bare.case, {name: np.array([value]) for name, value in theta.items()})[0]
    reckoned = linearise(bare, z)
    why = "running the command once more"
    there, reasons = command_predictions(runs, bare.case, model.station, [theta], watch, why)
    compared = _compared(place, len(bare.names), there[0], reasons[0], reckoned, found.predictions.error)
    verdict = replace(found.verdict, notes=(compared, *found.verdict.notes))
    if compared.errors > BEYOND_BELIEF:
        verdict = replace(verdict, kind="cannot-tell", distrust=CommandDiffers(compared.errors))
    elif place.rough and not place.settled:
        # Noise in differences alone is a caution, as of a parameter that hardly matters; with a search that did not
        # settle it has led astray: a command with noise of a third of an error, to friction that was not there.
        verdict = replace(verdict, kind="cannot-tell", distrust=CommandNotSettled(tuple(place.rough)))
    return replace(found, verdict=verdict)


def _compared(
    place: CommandPlace, parameters: int, there: Array, failure: str, reckoned: Point | None, error: Array
) -> CommandCompared:
    """How far the command is from its linear model; error: of each station, NaN if it does not count."""
    off = float("nan")
    if not failure and reckoned is not None:
        used = np.isfinite(error)
        off = root_mean_square((there - reckoned.prediction)[used] / error[used])
    return CommandCompared(
        place.places, parameters, off, failure.removesuffix("."), tuple(place.rough), place.settled, off > CLOSE_ENOUGH
    )


def command_tried(model: Model, folder: Path) -> str:
    """What came of one run of the command, at the medians of the priors; differences are root mean squares.

    Errors: InputError when it fails.
    """
    case, bare = model.case, without_effects(model)
    middle = np.zeros(len(bare.names))
    theta = {name: float(value[0]) for name, value in theta_at(bare.case, middle).items()}
    runs = command_runs(case, folder)
    ((_, end),) = ended_runs(runs, bare.case, model.station, [theta])
    if end.prediction is None:
        raise InputError(
            f"{shown_path(case.source)}: the command of `engine` failed at the medians of the priors: {end.reason}; "
            f"its files lie in {shown_path(runs.folder)}."
        )
    own = linearise(bare, middle)
    told = []
    for name, rows in stations_by_kind(model.station).items():
        kind, found = kind_of(name), end.prediction[rows]
        off = "" if own is None else _beside_the_own(found, own.prediction[rows], name == STREAMWISE)
        told.append(f"{kind.words} {in_digits(found.min())} to {in_digits(found.max())} {kind.unit}{off}")
    return f"The command of `engine` took {end.seconds:.1f} s at the medians of the priors: {'; '.join(told)}."


def _beside_the_own(found: Array, own: Array, along: bool) -> str:
    """How far the command is from the built-in engine, and why velocities along x may be of another size or sign."""
    said = f", {in_digits(root_mean_square(found - own), 2)} from the built-in engine"
    times = float(found @ own) / float(own @ own) if along and own.any() else 1.0
    if times < 0.0:
        return f"{said} (the other way: check their sign)"
    if not 1.0 / OF_ANOTHER_UNIT < times < OF_ANOTHER_UNIT:
        return f"{said} ({in_digits(times, 2)} times as large: check their unit, and that stations keep their numbers)"
    return said


def refuse_command(case: Case, verb: str) -> None:
    """Errors: InputError for a case with an `engine`, in a verb that needs the built-in one."""
    if case.engine is not None:
        raise InputError(
            f"{shown_path(case.source)}: `{verb}` works with the built-in engine only; take `engine` out of the config."
        )


def _place_of(model: Model, folder: Path, watch: Watch) -> CommandPlace:
    """The place where the command fits best: as an earlier verb has left it, or searched and kept."""
    runs, path, wanted = command_runs(model.case, folder), folder / "engine" / PLACE_FILE, case_hash(model.case)
    known = _kept_place(path, wanted, len(model.names))
    if known is not None:
        z, settled, places = known
        correction = correction_at(runs, model, z, watch)
        here = replace(model, engine=corrected(correction, runs, watch))
        return CommandPlace(here, z, settled, places, correction.rough)
    found = command_place(runs, model, watch=watch)
    text = json.dumps({"config_hash": wanted, "z": found.z.tolist(), "settled": found.settled, "places": found.places})
    write_text(path, text, MAKE_ROOM)
    return found


def _kept_place(path: Path, wanted: str, parameters: int) -> tuple[Array, bool, int] | None:
    try:
        found = json.loads(read_text(path, LARGEST_JSON))
        z = np.array(found["z"], dtype=float)
        if found["config_hash"] == wanted and z.shape == (parameters,) and np.isfinite(z).all():
            return z, bool(found["settled"]), int(found["places"])
    except (InputError, ValueError, KeyError, TypeError, RecursionError):
        pass
    return None
