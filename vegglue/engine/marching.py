"""An engine without derivatives: flows marched in time until they rest, slopes and responses by differences.

It shares the equations with `newton` and nothing of how they are solved, and shows what another engine has to give.
Slow: for tests, on small channels.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from vegglue.arrays import Array
from vegglue.case.parameter_space import theta_at
from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.definition import Amplitude, Effect, Shape
from vegglue.effects.surroundings import Cells
from vegglue.engine.interface import Cause, CentreFlow, Engine, Model, Point
from vegglue.flow.backwater import backwater
from vegglue.flow.equations import faces
from vegglue.flow.problem import Problem, take
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.sensor import read_sensors
from vegglue.site.channel_geometry import channel_geometry
from vegglue.solver.march import march

# A flow rests when no level or velocity changes faster than this [m/s, m/s2]; this is
# checked every so many steps. Chosen, not measured: a smaller rate marches for longer.
REST_RATE, STEPS_BETWEEN_CHECKS = 1e-9, 100
# Central differences in z; the force [m/s2] of a response, a hundredth of what drives water down a slope of 1 in 1,000.
MARCHED_DIFFERENCE_STEP, SMALL_FORCE = 0.02, 1e-4


def marching(time_step: float = 1.0, longest: float = 7200.0) -> Engine:
    """The engine with steps of `time_step` [s]; a flow that does not rest within `longest` [s] has no steady state."""
    return Engine(
        name="marching",
        linearise=partial(_linearised, time_step=time_step, longest=longest),
        predict=partial(_predicted, time_step=time_step, longest=longest),
        responses=partial(_responses, time_step=time_step, longest=longest),
        force_response=partial(_force_response, time_step=time_step, longest=longest),
        flow_at_centres=_flow_at_centres,
    )


def _linearised(model: Model, z: Array, near: Point | None, time_step: float, longest: float) -> Point | None:
    """All members of the central differences are marched side by side, the first of them at z itself."""
    steps = MARCHED_DIFFERENCE_STEP * np.eye(z.size)
    members = np.vstack([z[None], z + steps, z - steps])
    prediction = np.full((len(members), len(model.station)), np.nan)
    flows = {}
    for experiment in model.case.experiments:
        problem = _problem(model, experiment, members)
        state = _rested(problem, _start(problem, near, experiment), time_step, longest)
        prediction[:, model.rows[experiment]] = _read(model, experiment, problem, state)
        flows[experiment] = state[..., :1]
    if not np.isfinite(prediction).all():
        return None
    ahead, behind = prediction[1 : 1 + z.size], prediction[1 + z.size :]
    return Point(z, prediction[0], (ahead - behind).T / (2.0 * MARCHED_DIFFERENCE_STEP), flows)


def _predicted(model: Model, points: Sequence[Point], z: Array, time_step: float, longest: float) -> Array:
    prediction = np.full((len(z), len(model.station)), np.nan)
    for experiment in model.case.experiments:
        problem = _problem(model, experiment, z)
        state = _rested(problem, _start(problem, points[0], experiment), time_step, longest)
        prediction[:, model.rows[experiment]] = _read(model, experiment, problem, state)
    prediction[np.isnan(prediction).any(axis=1)] = np.nan
    return prediction


def _responses(model: Model, point: Point, causes: Sequence[Cause], time_step: float, longest: float) -> Array:
    """(f(small) - f(off)) / small^power, one march for each cause and experiment in which it acts."""
    found = np.zeros((len(model.station), len(causes)))
    theta = theta_at(model.case, point.z)
    for j, cause in enumerate(causes):
        value = np.array([cause.amplitude.off + cause.amplitude.small])
        for experiment in cause.experiments or model.case.experiments:
            problem = build_problem(cause.case, model.site, experiment, theta | {cause.parameter: value})
            state = _rested(problem, point.flows[experiment], time_step, longest)
            moved = _read(model, experiment, problem, state)[0] - point.prediction[model.rows[experiment]]
            found[model.rows[experiment], j] = moved / cause.amplitude.small**cause.amplitude.power
    return found


def _force_response(model: Model, point: Point, experiment: str, time_step: float, longest: float) -> Array:
    """(f(force) - f(-force)) / (2 force) for every cell of the grid: a member each."""
    grid = model.site.grid
    x, y = (values.ravel() for values in np.meshgrid(grid.x, grid.y, indexing="ij"))
    one = _problem(model, experiment, point.z[None])
    many = take(one, np.zeros(x.size, dtype=np.int64))
    start = np.repeat(point.flows[experiment], x.size, axis=3)
    geometry = channel_geometry(model.case, model.site, experiment)
    predictions = []
    for force in (SMALL_FORCE, -SMALL_FORCE):
        pushed = ActiveEffect(POINT_FORCE, {"force": np.full(x.size, force), "x": x, "y": y})
        problem = replace(many, effects=(*many.effects, pushed), geometry=geometry)
        predictions.append(_read(model, experiment, problem, _rested(problem, start, time_step, longest)))
    response = (predictions[0] - predictions[1]).T / (2.0 * SMALL_FORCE)
    return response.reshape(-1, grid.x.size, grid.y.size)


def _flow_at_centres(model: Model, point: Point, experiment: str) -> CentreFlow:
    now = faces(_problem(model, experiment, point.z[None]), point.flows[experiment])
    u, v = 0.5 * (now.u[1:] + now.u[:-1]), 0.5 * (now.v[:, 1:] + now.v[:, :-1])
    return CentreFlow(now.cell[..., 0], u[..., 0], v[..., 0])


def _problem(model: Model, experiment: str, z: Array) -> Problem:
    return build_problem(model.case, model.site, experiment, theta_at(model.case, z))


def _start(problem: Problem, near: Point | None, experiment: str) -> Array:
    """From a point of the same grid, else from a backwater curve; (nx, 3, ny, m)."""
    if near is None or near.flows[experiment].shape[::2] != problem.shape:
        return backwater(problem)
    return np.repeat(near.flows[experiment], problem.members, axis=3)


def _rested(problem: Problem, state: Array, time_step: float, longest: float) -> Array:
    """States (nx, 3, ny, m) marched until all rest; NaN where a member does not."""
    for _ in range(int(longest / (time_step * STEPS_BETWEEN_CHECKS))):
        before = march(problem, state, time_step, STEPS_BETWEEN_CHECKS)
        state = march(problem, before, time_step, 1)
        rate = np.abs(state - before).max(axis=(0, 1, 2)) / time_step
        if (rate < REST_RATE).all():
            return state
    return np.where(rate < REST_RATE, state, np.nan)


def _read(model: Model, experiment: str, problem: Problem, state: Array) -> Array:
    return read_sensors(problem, state, model.site.grid, model.station_of(experiment), ()).prediction


def _point_force(cells: Cells, force: Array, x: Array, y: Array) -> dict[str, Array]:
    """f_x = force in the cell around (x, y), 0 elsewhere [m/s2]."""
    here = (np.abs(cells.geometry.x - x) < 0.5 * cells.geometry.dx) & (
        np.abs(cells.geometry.y - y) < 0.5 * cells.geometry.dy
    )
    return {"x": force * here}


POINT_FORCE = Effect(
    name="point_force",
    stage="force",
    title="A force along x in one cell",
    equation="f_x = force in the cell around (x, y)",
    act=_point_force,
    amplitude=Amplitude("force", "m/s2", "force on the water", SMALL_FORCE, -1.0, 1.0),
    shapes=(Shape("x", "m", "where along", 0.0, -1e9, 1e9), Shape("y", "m", "where across", 0.0, -1e9, 1e9)),
    source="definition",
    checked=True,
)
