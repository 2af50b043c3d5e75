"""Where a command fits best: the built-in engine leads there, and the command is run to correct it on the way.

At each place the built-in engine is corrected to the predictions and slopes of the command (`engine/corrected`) and
calibrated; where that ends, the command is run again. A place is kept when the command itself fits better there.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, baseline, places_of_prior
from vegglue.calibration.fit import NEGLIGIBLE_DECREASE, objective
from vegglue.calibration.noise import Noise
from vegglue.engine.command import CommandRuns
from vegglue.engine.corrected import Correction, InsensitiveCommandError, corrected, correction_at
from vegglue.engine.interface import Model, linearise
from vegglue.errors import InputError
from vegglue.progress import Watch

# Places at which the command is linearised at most, and how often a step that fits worse is halved. Chosen, not
# measured: most cases need three places, and each costs two runs for each parameter.
MOST_PLACES, MOST_HALVINGS = 8, 4


@dataclass(frozen=True)
class CommandPlace:
    """A model with the engine of its command, corrected at z (p,) where the command fits best; settled: whether the
    next step would have been negligible; places: at how many the slopes of the command were taken; correction: that at
    z; run: where the command ran in the search (k, q); failed: how many runs failed.
    """

    model: Model
    z: Array
    settled: bool
    places: int
    correction: Correction
    run: Array
    failed: int


def command_place(runs: CommandRuns, model: Model, watch: Watch) -> CommandPlace:
    """The search, from the first place of the prior where the command runs: it depends on nothing but the case.

    Raises
    ------
    InputError
        If the command runs at none of these places, or the built-in engine finds no flow.
    """

    tried: list[Correction] = []

    def correction_there(z: Array, phase: Watch, slopes: bool = True) -> Correction:
        tried.append(correction_at(runs, model, z, phase, slopes))
        return tried[-1]

    def found(settled: bool) -> CommandPlace:
        run = np.unique(np.concatenate([one.run for one in tried]), axis=0)
        return CommandPlace(here, z, settled, places, correction, run, sum(one.failed for one in tried))

    def in_phase(words: str) -> Watch:
        """A phase of its own, so that the time that is left is that of its runs."""
        return lambda now: watch(replace(now, phase=f"{now.phase}, {words}"))

    def model_at(correction: Correction, phase: Watch = watch) -> Model:
        return replace(model, engine=corrected(correction, runs, phase))

    def objective_at(here: Model, noise: Noise, z: Array) -> float:
        point = linearise(here, z)
        return np.inf if point is None else objective(noise, point)

    def lower_place(here: Model, base: Baseline, z: Array, phase: Watch) -> Array | None:
        """A place towards the calibrated model where the command itself fits better than at z (p,), if there is one."""
        before, step = objective_at(here, base.noise, z), base.fitted.point.z - z
        for _ in range(MOST_HALVINGS):
            try:
                there = correction_there(z + step, phase, slopes=False)
            except InputError:  # the command fails there: it may not nearer by
                there = None
            if there is not None and objective_at(model_at(there, phase), base.noise, z + step) < before:
                return np.asarray(z + step)
            step = step / 2.0
        return None

    z, correction = _start(model, lambda z, slopes: correction_there(z, in_phase("place 1"), slopes))
    here = model_at(correction)
    base = baseline(here)
    for places in range(1, MOST_PLACES + 1):
        away = base.fitted.point.z - z
        if away @ np.linalg.solve(base.fitted.covariance, away) < NEGLIGIBLE_DECREASE:
            return found(True)
        if places == MOST_PLACES:
            break
        lower = lower_place(here, base, z, in_phase(f"on the way to place {places + 1}"))
        if lower is None:
            break
        z, correction = lower, correction_there(lower, in_phase(f"place {places + 1}"))
        here = model_at(correction)
        base = baseline(here, z)
    return found(False)


def _start(model: Model, correction_there: Callable[[Array, bool], Correction]) -> tuple[Array, Correction]:
    """The middle of the prior or, if the command fails there, the next of its Sobol' points."""
    refused = InputError(f"{model.case.name}: the command has no place to start from.")
    for z in places_of_prior(len(model.names)):
        try:
            correction_there(z, False)  # alone: a command that fails may take its time
            return z, correction_there(z, True)
        except InsensitiveCommandError:  # it fails anywhere else too
            raise
        except InputError as error:
            refused = error
    raise refused
