"""An engine without derivatives: flows marched in time until they rest, slopes and responses by differences.

It shares the equations with `newton` and nothing of how they are solved, and shows what another engine has to give.
Slow: for small channels.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from vegglue.arrays import Array, Single
from vegglue.case.channel_geometry import channel_geometry
from vegglue.case.parameter_space import theta_at
from vegglue.engine.interface import Cause, CentreFlow, Engine, Model, Point, StationsOfCells, Wanted, always
from vegglue.engine.newton import problem_at
from vegglue.flow.equations import faces
from vegglue.flow.local_changes import Term, with_changed_term
from vegglue.flow.march import march
from vegglue.flow.problem import EMPTY, Problem
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.sensor import predictions_at_sensors
from vegglue.flow.starts import backwater

# A flow rests when no level or velocity changes faster than this [m/s, m/s2]: chosen, not measured, a smaller rate
# marches for longer. It is checked every so many steps: every 100 take a quarter more time than every 30, and answers
# to cells differ by 7e-5 of the largest at most.
REST_RATE, STEPS_BETWEEN_CHECKS = 1e-9, 30
# Step of central differences in z [standard deviations of the prior].
MARCHED_DIFFERENCE_STEP = 0.02
# Small changes of a term in one cell, in its unit: large against what is left of the march when it ends.
MARCHED_CHANGE: dict[Term, float] = {
    "friction": 0.02, "drag": 1e-3, "bed": 1e-3, "inflow": 1e-4, "viscosity": 1e-3, "mixing": 0.05,
    "advection": 0.02,
}  # fmt: skip


def marching(time_step: float = 1.0, longest: float = 7200.0) -> Engine:
    """The engine with steps of `time_step` [s]; a flow that does not rest within `longest` [s] has no steady state."""

    def read_at_rest(model: Model, experiment: str, problem: Problem, start: Array) -> tuple[Array, Array]:
        """States (nx, 3, ny, m) marched until all rest, and predictions (m, stations); NaN if a member does not."""
        state = start
        for _ in range(int(longest / (time_step * STEPS_BETWEEN_CHECKS))):
            before = march(problem, state, time_step, STEPS_BETWEEN_CHECKS)
            state = march(problem, before, time_step, 1)
            rate = np.abs(state - before).max(axis=(0, 1, 2)) / time_step
            if (rate < REST_RATE).all():
                break
        else:
            state = np.where(rate < REST_RATE, state, np.nan)
        return state, predictions_at_sensors(problem, state, model.site.grid, model.stations[experiment])

    def linearise(model: Model, z: Array, near: Point | None, wanted: Wanted) -> Point | None:
        """All members of the central differences are marched side by side, the first of them at z itself."""
        steps = MARCHED_DIFFERENCE_STEP * np.eye(z.size)
        members = np.vstack([z[None], z + steps, z - steps])
        prediction, flows = np.full((len(members), len(model.station)), np.nan), {}
        for experiment in model.case.experiments:
            problem = problem_at(model, experiment, members)
            state, readings = read_at_rest(model, experiment, problem, _start(problem, near, experiment))
            prediction[:, model.rows[experiment]], flows[experiment] = readings, state[..., :1].copy()
        if not np.isfinite(prediction).all() or not wanted(prediction[0]):
            return None
        ahead, behind = prediction[1 : 1 + z.size], prediction[1 + z.size :]
        return Point(z, prediction[0], (ahead - behind).T / (2.0 * MARCHED_DIFFERENCE_STEP), flows)

    def predict(model: Model, points: Sequence[Point], z: Array) -> Array:
        prediction = np.full((len(z), len(model.station)), np.nan)
        for experiment in model.case.experiments:
            problem = problem_at(model, experiment, z)
            start = _start(problem, points[0], experiment)
            prediction[:, model.rows[experiment]] = read_at_rest(model, experiment, problem, start)[1]
        prediction[np.isnan(prediction).any(axis=1)] = np.nan
        return prediction

    def responses_of(model: Model, point: Point, causes: Sequence[Cause]) -> Array:
        """(f(small) - f(off)) / gain of small; all causes that act in an experiment are marched side by side."""
        found, theta = np.zeros((len(model.station), len(causes))), theta_at(model.case, point.z)
        values = [np.array([cause.amplitude.off + cause.amplitude.small]) for cause in causes]
        gains = np.array([cause.amplitude.gain(value[0]) for cause, value in zip(causes, values, strict=True)])
        for experiment in model.case.experiments:
            here = [j for j, cause in enumerate(causes) if not cause.experiments or experiment in cause.experiments]
            if not here:
                continue
            with_causes = [
                build_problem(causes[j].case, model.site, experiment, theta | {causes[j].parameter: values[j]})
                for j in here
            ]
            problem, rows = joined(with_causes), model.rows[experiment]
            start = _start(problem, point, experiment)
            moved = read_at_rest(model, experiment, problem, start)[1] - point.prediction[rows]
            found[np.ix_(rows, np.array(here))] = moved.T / gains[here]
        return found

    def responses_to_cells(model: Model, point: Point, experiment: str, terms: Sequence[Term]) -> StationsOfCells:
        """(f(change) - f(-change)) / (2 change) for every cell of the grid: two members each. (f(change) - f(0)) /
        change for water that enters, which comes without momentum, while water that leaves takes its own along.
        """
        nx, ny = model.site.bed.shape
        one, found = problem_at(model, experiment, point.z[None]), dict[Term, Single]()
        geometry, cells = channel_geometry(model.case, model.site, experiment), np.eye(nx * ny).reshape(nx, ny, -1)
        for term in terms:
            change, inflow = MARCHED_CHANGE[term], term == "inflow"
            behind = np.zeros((nx, ny, 1)) if inflow else -change * cells
            problem = with_changed_term(one, geometry, term, np.concatenate([change * cells, behind], axis=2))
            start = np.repeat(point.flows[experiment], problem.members, axis=3)
            prediction = read_at_rest(model, experiment, problem, start)[1]
            response = (prediction[: nx * ny] - prediction[nx * ny :]).T / (change * (1.0 if inflow else 2.0))
            found[term] = response.reshape(-1, nx, ny).astype(np.float32)
        yield model.rows[experiment], found

    def flow_at_centres(model: Model, point: Point, experiment: str) -> CentreFlow:
        now = faces(problem_at(model, experiment, point.z[None]), point.flows[experiment])
        u, v = 0.5 * (now.u[1:] + now.u[:-1]), 0.5 * (now.v[:, 1:] + now.v[:, :-1])
        return CentreFlow(now.cell[..., 0], u[..., 0], v[..., 0])

    return Engine(
        name="marching",
        linearise=linearise,
        linearise_around=lambda model, z, near: [linearise(model, one, near, always) for one in z],
        predict=predict,
        responses=lambda model, points, causes: np.array([responses_of(model, one, causes) for one in points]),
        responses_to_cells=responses_to_cells,
        flow_at_centres=flow_at_centres,
        relinearised=lambda model, point: point,
        with_coarse_correction=lambda point, before, after: point,
    )


def _start(problem: Problem, near: Point | None, experiment: str) -> Array:
    """From a point of the same grid, else from a backwater curve; (nx, 3, ny, m)."""
    if near is None or experiment not in near.flows or near.flows[experiment].shape[::2] != problem.shape:
        return backwater(problem)
    return np.repeat(near.flows[experiment], problem.members, axis=3)


def joined(problems: Sequence[Problem]) -> Problem:
    """Problems of one experiment on one grid as one, the members of each after those of the one before.

    What is alike, as the grid and its classes, is that of the first; effects of each are off in members of all others.
    """
    first, members = problems[0], [one.members for one in problems]
    start, total = np.cumsum([0, *members]), sum(members)

    def together(parts: Iterable[Array]) -> Array:
        return np.concatenate(list(parts), axis=-1)

    def as_far_as_any(parts: Sequence[Array]) -> Array:
        """Arrays (nx, ny, m), 0 of a problem without one; empty if none has one."""
        shape = next((one.shape[:2] for one in parts if one.size), None)
        if shape is None:
            return EMPTY
        return together(
            one if one.size else np.zeros((*shape, count)) for one, count in zip(parts, members, strict=True)
        )

    inflows = []
    for alike in zip(*(one.boundaries.inflows for one in problems), strict=True):
        cells = max(len(one.spread) for one in alike)
        spread = [np.broadcast_to(one.spread, (cells, count)) for one, count in zip(alike, members, strict=True)]
        inflows.append(replace(alike[0], discharge=together(one.discharge for one in alike), spread=together(spread)))
    effects = []
    for one, begin in zip(problems, start, strict=False):
        for active in one.effects:
            amplitude = active.effect.amplitude
            values = {name: np.full(total, value[0]) for name, value in active.values.items()}
            values[amplitude.name][:] = amplitude.off
            for name, value in active.values.items():
                values[name][begin : begin + one.members] = value
            effects.append(replace(active, values=values))
    return replace(
        first,
        friction=replace(first.friction, coefficient=together(one.friction.coefficient for one in problems)),
        plants=replace(
            first.plants,
            phi=together(one.plants.phi for one in problems),
            canopy_height=together(one.plants.canopy_height for one in problems),
            bare_chezy=together(one.plants.bare_chezy for one in problems),
        ),
        viscosity=together(one.viscosity for one in problems),
        boundaries=replace(
            first.boundaries,
            inflows=tuple(inflows),
            outlet_level=together(one.boundaries.outlet_level for one in problems),
            lateral_inflow=as_far_as_any([one.boundaries.lateral_inflow for one in problems]),
        ),
        bed_rise=as_far_as_any([one.bed_rise for one in problems]),
        walls=replace(first.walls, rate=together(one.walls.rate for one in problems)),
        effects=tuple(effects),
        geometry=next((one.geometry for one in problems if one.geometry is not None), None),
    )
