"""What inference and diagnosis need of a flow engine: eight functions.

A model is a function f from z (p,) to predictions (n,) at stations. z is a place of the prior in which every parameter
is standard normal, z = Phi^-1(F(theta)), so that the misfit of the prior is |z|^2.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vegglue.arrays import Array, Single
from vegglue.case.gridded_site import Site
from vegglue.case.schema import Case
from vegglue.effects.definition import Amplitude
from vegglue.flow.local_changes import Term


@dataclass(frozen=True)
class Point:
    """A model linearised at one place of the prior.

    Parameters
    ----------
    z
        The place (p,) [standard deviations].
    prediction
        f(z) (n,) [unit of each station].
    slope
        df/dz (n, p).
    flows
        What the engine keeps of the flow by experiment, for its own use.
    """

    z: Array
    prediction: Array
    slope: Array
    flows: Mapping[str, Any]


@dataclass(frozen=True)
class Cause:
    """A change of a model whose response is wanted.

    Parameters
    ----------
    case
        A case that differs by its effects alone, with one parameter more.
    parameter, amplitude
        That parameter, and the amplitude that it is of; it does nothing at `amplitude.off`.
    experiments
        Where it acts; empty: in all.
    """

    case: Case
    parameter: str
    amplitude: Amplitude
    experiments: tuple[str, ...] = ()


@dataclass(frozen=True)
class CentreFlow:
    """The flow of one experiment at cell centres.

    Attributes
    ----------
    depth
        (nx, ny) [m]
    u, v
        Velocity along x and across (nx, ny) [m/s].
    """

    depth: Array
    u: Array
    v: Array


# Rows of some stations of an experiment (n,), and by term what each cell does to them (n, nx, ny).
StationsOfCells = Iterator[tuple[NDArray[np.int_], Mapping[Term, Single]]]
# Whether the slopes of predictions (n,) are worth their time. If not, no point is returned, either.
Wanted = Callable[[Array], bool]


def always(prediction: Array) -> bool:
    """Slopes are wanted whatever the predictions are."""
    return True


@dataclass(frozen=True)
class Engine:
    """How a flow is computed. A new engine is one value of this kind, see `newton`.

    Parameters
    ----------
    name
        Of the engine.
    linearise
        (model, z, near, wanted) -> f(z) and df/dz as a Point at z (p,), or None if no steady flow is found. near: a
        point to start from, of this model or of one on cells of twice the size, whose experiments may be fewer.
    linearise_around
        (model, z, near) -> the same at z (m, p) around a point of the same model.
    predict
        (model, points, z) -> f (m, n) at z (m, p), NaN where no flow is found; points: some that are known, of the
        model or of one without its last parameters.
    responses
        (model, points, causes) -> df / d(amplitude - off)^power at off (points, n, causes).
    responses_to_cells
        (model, point, experiment, terms) -> df / d term (n, nx, ny) by term for a change in each cell, of the stations
        of the experiment, some rows of them at a time; terms: of `flow.local_changes.Term`.
    flow_at_centres
        (model, point, experiment) -> depth and velocities of a point.
    relinearised
        (model, point) -> the point with nothing reused from a flow nearby, so that `responses_to_cells` is exact to a
        per cent.
    with_coarse_correction
        (point, before, after) -> a point to start from, moved as the flow on cells of twice the size moved from
        `before` to `after`; the point itself if an engine has no use for it.
    """

    name: str
    linearise: Callable[["Model", Array, Point | None, Wanted], Point | None]
    linearise_around: Callable[["Model", Array, Point], list[Point | None]]
    predict: Callable[["Model", Sequence[Point], Array], Array]
    responses: Callable[["Model", Sequence[Point], Sequence[Cause]], Array]
    responses_to_cells: Callable[["Model", Point, str, Sequence[Term]], "StationsOfCells"]
    flow_at_centres: Callable[["Model", Point, str], CentreFlow]
    relinearised: Callable[["Model", Point], Point]
    with_coarse_correction: Callable[[Point, Point, Point], Point]


@dataclass(frozen=True)
class Model:
    """A case on its grid, read at stations by an engine: a function f from z (p,) to predictions (n,).

    Parameters
    ----------
    case, site
        The case, and its grid.
    station
        Table of stations (n rows), see `measurements.observations`.
    engine
        How its flows are computed.
    """

    case: Case
    site: Site
    station: pd.DataFrame
    engine: Engine

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.case.parameters)

    @cached_property
    def rows(self) -> dict[str, np.ndarray]:
        """Rows of the stations of each experiment."""
        names = self.station["experiment"].to_numpy()
        return {experiment: np.flatnonzero(names == experiment) for experiment in self.case.experiments}

    @cached_property
    def stations(self) -> dict[str, pd.DataFrame]:
        """The stations of each experiment."""
        return {experiment: self.station.iloc[rows] for experiment, rows in self.rows.items()}


def linearise(model: Model, z: Array, near: Point | None = None, wanted: Wanted = always) -> Point | None:
    """f(z) and df/dz.

    Parameters
    ----------
    z : (p,) [standard deviations of the prior]
    near : Point, optional
        A point to start from, of this model or of one on cells of twice the size.
    wanted : callable
        Whether the slopes of predictions (n,) are needed; no point is returned if not.

    Returns
    -------
    Point or None
        None if a flow has no steady state, or slopes are not wanted.
    """
    return model.engine.linearise(model, z, near, wanted)


def linearise_from(model: Model, z: Array, near: Point | None) -> Point | None:
    """f(z) and df/dz from a point nearby, and from afar if that fails or there is none.

    Parameters
    ----------
    model, z, near
        As `linearise`.

    Returns
    -------
    Point or None
        None if a flow has no steady state.
    """
    found = None if near is None else linearise(model, z, near)
    return found or linearise(model, z)


def linearise_around(model: Model, z: Array, near: Point) -> list[Point | None]:
    """f and df/dz at places around a point, for less than `linearise_from` one by one.

    Parameters
    ----------
    z : (m, p) [standard deviations of the prior]
    near : Point
        Of this model.

    Returns
    -------
    list of Point or None
        One for each place; None if a flow has no steady state.
    """
    return model.engine.linearise_around(model, z, near)


def predict(model: Model, points: Sequence[Point], z: Array) -> Array:
    """f at many points.

    Parameters
    ----------
    points : sequence of Point
        Some that are known, to start from, of the model or of one without its last parameters.
    z : (m, p) [standard deviations of the prior]

    Returns
    -------
    (m, n)
        Predictions [unit of each station], NaN if no flow is found.
    """
    return model.engine.predict(model, points, z)


def responses(model: Model, point: Point, causes: Sequence[Cause]) -> Array:
    """df / d(amplitude - off)^power at off: the fingerprints of causes at a point.

    Returns
    -------
    (n, causes)
        [unit of each station per unit of the gain]
    """
    return responses_at(model, [point], causes)[0]


def responses_at(model: Model, points: Sequence[Point], causes: Sequence[Cause]) -> Array:
    """df / d(amplitude - off)^power at off, for less than `responses` at one point after the other.

    Parameters
    ----------
    points : sequence of Point
        Of the same experiments.

    Returns
    -------
    (points, n, causes)
        [unit of each station per unit of the gain]
    """
    return model.engine.responses(model, points, causes)


def responses_to_cells(model: Model, point: Point, experiment: str, terms: Sequence[Term]) -> StationsOfCells:
    """df / d term for a change of it in each cell, of some stations at a time: those of all may not fit the memory
    beside what they are made of.

    Yields
    ------
    (n,), mapping of str to (n, nx, ny)
        Rows of stations of the experiment, and theirs [unit of each station per unit of the term].
    """
    return model.engine.responses_to_cells(model, point, experiment, terms)


def relinearised(model: Model, point: Point) -> Point:
    """The point with nothing reused from a flow nearby: its responses to cells are exact to a per cent.

    Returns
    -------
    Point
        The same z and predictions.
    """
    return model.engine.relinearised(model, point)


def linearise_as_coarse(model: Model, point: Point, before: Point, after: Point) -> Point | None:
    """f(z) and df/dz at the z of a point on coarser cells, from the flow that moved as the coarse one did.

    Parameters
    ----------
    point : Point
        To start from.
    before, after : Point
        On cells of twice the size: at the z of `point`, and where f is wanted, maybe with an effect more or less.

    Returns
    -------
    Point or None
        None if a flow has no steady state.
    """
    start = model.engine.with_coarse_correction(point, before, after)
    return linearise(model, after.z, start) or linearise_from(model, after.z, after)


def flow_at_centres(model: Model, point: Point, experiment: str) -> CentreFlow:
    """Depth and velocities of one experiment at a point."""
    return model.engine.flow_at_centres(model, point, experiment)
