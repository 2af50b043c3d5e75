"""An engine of a command: the built-in one, corrected at one place so that predictions and slopes are the command's.

    f(z) = F(z) + [f_c - F_0](z_0) + [J_c - J_0](z_0) (z - z_0)

f_c and J_c are predictions and slopes of the command, the latter by central differences; F and F_0 the built-in engine
with and without the effects of the case, which the command does not know: they are added to what it predicts. At z_0
this is exact. Further off the built-in engine only says how the flow bends away from the tangent, and draws of a
posterior are runs of the command itself. Responses to effects and cells are those of the built-in engine.

References: first-order correction of one model by another, Alexandrov and Lewis 2001, doi:10.1023/A:1016042505922; not
checked against it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.parameter_space import FURTHEST, thetas_at
from vegglue.engine.command import CommandRuns, command_predictions, own_parameters
from vegglue.engine.interface import Cause, Engine, Model, Point, Wanted, linearise
from vegglue.engine.newton import NEWTON
from vegglue.errors import InputError
from vegglue.progress import Watch
from vegglue.wording.phases import RUNNING_COMMAND

# Share of a difference [-] that is bend or noise, above which a slope counts as rough: root mean square over
# stations of f(h) + f(-h) - 2 f(0) over f(h) - f(-h). A flow that bends as much as it slopes has a twentieth at a step
# of 0.1, and half at the largest step there is; noise alone has 1.7.
ROUGH_SHARE = 0.5
# What makes a station the same in two tables.
SAME_STATION = ["experiment", "kind", "section", "x", "y"]


@dataclass(frozen=True)
class Correction:
    """What the command has more than the built-in engine at one place.

    A station that is not in it, such as one that could be measured next, is predicted by the built-in engine alone.

    Parameters
    ----------
    names, z
        The parameters that the command is given, and their place (q,).
    station
        The stations (n rows).
    value, slope
        f_c - F_0 (n,) [unit of each station] and J_c - J_0 (n, q), zero if slopes were not wanted.
    rough
        Parameters whose slopes are mostly noise.
    run
        Where the command ran for it (k, q); failed: how many more runs failed.
    """

    names: tuple[str, ...]
    z: Array
    station: pd.DataFrame
    value: Array
    slope: Array
    rough: tuple[str, ...] = ()
    run: Array = field(default_factory=lambda: np.zeros((0, 0)))
    failed: int = 0

    def at(self, model: Model, z: Array) -> tuple[Array, Array]:
        """What is added to predictions (n,) and slopes (n, p) of the built-in engine at z (p,)."""
        rows = rows_of_stations(self.station, model.station)
        columns = [model.names.index(name) for name in self.names]
        of_stations = np.vstack([self.slope, np.zeros((1, len(columns)))])[rows]
        slope = np.zeros((rows.size, z.size))
        slope[:, columns] = of_stations  # no column, if the correction has no slopes
        return np.append(self.value, 0.0)[rows] + of_stations @ (z[columns] - self.z), slope


# What is added to predictions (n,) and slopes (n, p) of the built-in engine at z (p,).
Added = Callable[[Model, Array], tuple[Array, Array]]


def rows_of_stations(known: pd.DataFrame, wanted: pd.DataFrame) -> NDArray[np.int64]:
    """The row of each wanted station among the known ones, -1 if it is none of them.

    Parameters
    ----------
    known, wanted : tables of stations
    """
    if wanted is known:
        return np.arange(len(known))
    rows = {key: row for row, key in enumerate(known[SAME_STATION].itertuples(index=False, name=None))}
    return np.array([rows.get(key, -1) for key in wanted[SAME_STATION].itertuples(index=False, name=None)], np.int64)


class InsensitiveCommandError(InputError):
    """A command that predicts the same whatever its parameters are."""


def with_correction(added: Added, name: str) -> Engine:
    """F(z) + added(z): the built-in engine, corrected.

    Responses to causes and cells stay those of F.

    Parameters
    ----------
    added : callable
        (model, z (p,)) -> what is added to predictions (n,) and slopes (n, p) there.
    name : str
        Of the engine.
    """

    def linearise_corrected(model: Model, z: Array, near: Point | None, wanted: Wanted) -> Point | None:
        value, slope = added(model, z)
        point = NEWTON.linearise(model, z, near, lambda prediction: wanted(prediction + value))
        if point is None:
            return None
        return replace(point, prediction=point.prediction + value, slope=point.slope + slope)

    def linearise_around(model: Model, z: Array, near: Point) -> list[Point | None]:
        found: list[Point | None] = []
        for point, one in zip(NEWTON.linearise_around(model, z, near), z, strict=True):
            value, slope = added(model, one)
            found.append(point and replace(point, prediction=point.prediction + value, slope=point.slope + slope))
        return found

    def predict(model: Model, points: Sequence[Point], z: Array) -> Array:
        return NEWTON.predict(model, points, z) + np.stack([added(model, one)[0] for one in z])

    def responses(model: Model, points: Sequence[Point], causes: Sequence[Cause]) -> Array:
        own = [replace(one, prediction=one.prediction - added(model, one.z)[0]) for one in points]
        return NEWTON.responses(model, own, causes)

    return replace(
        NEWTON,
        name=name,
        linearise=linearise_corrected,
        linearise_around=linearise_around,
        predict=predict,
        responses=responses,
    )


def corrected(correction: Correction, runs: CommandRuns, watch: Watch) -> Engine:
    """f(z) = F(z) + [f_c - F_0](z_0) + [J_c - J_0](z_0) (z - z_0): the engine of a command.

    Parameters
    ----------
    correction
        Of the built-in engine, at one place.
    runs
        The command; predictions at many points are runs of it.
    watch
        Called with the progress of these.
    """

    def predict(model: Model, points: Sequence[Point], z: Array) -> Array:
        """Runs of the command, and what the effects of the case change in the built-in engine."""
        bare = without_effects(model)
        z_own = _own_parameters(model, z, bare.names)
        found, _ = _run_command(runs, model, bare, z_own, watch)
        if not model.case.effects:
            return found
        near = [linearise(bare, _own_parameters(model, point.z[None], bare.names)[0]) for point in points]
        known = [point for point in near if point is not None]
        if not known:
            return np.full_like(found, np.nan)
        return found + NEWTON.predict(model, points, z) - NEWTON.predict(bare, known, z_own)

    return replace(with_correction(correction.at, "command"), predict=predict)


def correction_at(runs: CommandRuns, model: Model, z: Array, watch: Watch, slopes: bool = True) -> Correction:
    """f_c - F_0 and J_c - J_0 at one place of a model.

    Parameters
    ----------
    runs, model
        The command, and a model of its case.
    z
        The place (p,).
    watch
        Called with the progress of runs.
    slopes
        Whether to run the command for slopes, twice for each parameter.

    Raises
    ------
    InputError
        If the command fails there, or the built-in engine finds no flow.
    InsensitiveCommandError
        If its predictions change with no parameter.
    """
    bare, name = without_effects(model), model.case.name
    names = bare.names
    here, q = _own_parameters(model, z[None], names)[0], len(names)
    steps = runs.settings.step * np.eye(q)  # the place itself, then a step ahead and behind in each parameter
    points = np.clip(np.vstack([here[None], here + steps, here - steps]), -FURTHEST, FURTHEST) if slopes else here[None]
    found, reasons = _run_command(runs, model, bare, points, watch)
    own = linearise(bare, here)
    if own is None:
        raise InputError(
            f"{name}: the built-in engine finds no flow where the command is calibrated; widen the priors, or look at "
            "the site with `vegglue check`."
        )
    if np.isnan(found[0]).any():
        raise InputError(f"{name}: the command failed where it is calibrated: {reasons[0]}.")
    value = found[0] - own.prediction
    ran = np.isfinite(found).all(axis=1)
    run, failed = points[ran], int((~ran).sum())
    if not slopes:
        return Correction(names, here, model.station, value, np.zeros_like(own.slope), (), run, failed)
    slope = np.zeros((found.shape[1], q))
    for j in range(q):  # central differences; one-sided if the command fails on the other side
        ahead, behind = 1 + j, 1 + q + j
        ends = [end for end in (ahead, behind) if np.isfinite(found[end]).all()]
        if not ends:
            raise InputError(
                f"{name}: the command failed on both sides of its best place for {names[j]}, so that it has no slope: "
                f"{reasons[ahead]}."
            )
        first, last = (ahead, behind) if len(ends) == 2 else (ends[0], 0)
        slope[:, j] = (found[first] - found[last]) / (points[first, j] - points[last, j])
    if names and not slope.any():
        raise InsensitiveCommandError(
            f"{name}: expected a command of `engine` whose predictions change with {' or '.join(names)}, got the same "
            "ones at either side of each; see whether it reads parameters.json, and reads and writes more than four "
            "digits; or set `engine.step` larger."
        )
    ahead_of, behind_of = found[1 : 1 + q], found[1 + q :]
    curve = np.sqrt(np.mean((ahead_of + behind_of - 2.0 * found[0]) ** 2, axis=1))
    change = np.sqrt(np.mean((ahead_of - behind_of) ** 2, axis=1))
    rough = tuple(name for name, a, b in zip(names, curve, change, strict=True) if a > ROUGH_SHARE * b)
    return Correction(names, here, model.station, value, slope - own.slope, rough, run, failed)


def without_effects(model: Model) -> Model:
    """The model that a command stands for: no effects, the parameters that the command gets, the built-in engine."""
    names = own_parameters(model.case)
    parameters = {name: model.case.parameters[name] for name in names}
    return replace(model, case=model.case.model_copy(update={"effects": {}, "parameters": parameters}), engine=NEWTON)


def _own_parameters(model: Model, z: Array, names: Sequence[str]) -> Array:
    """The columns of z (m, p) that are parameters of the command."""
    return z[:, [model.names.index(name) for name in names]]


def _run_command(runs: CommandRuns, model: Model, bare: Model, z: Array, watch: Watch) -> tuple[Array, list[str]]:
    """Runs of the command at z (m, q)."""
    why = RUNNING_COMMAND.format(model.case.name)
    return command_predictions(runs, bare.case, model.station, thetas_at(bare.case, z), watch, why)
