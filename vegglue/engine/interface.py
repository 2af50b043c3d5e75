"""What inference and diagnosis ask of a flow engine, and nothing else of it.

A model is a function from z (p,) to predictions (n,) at stations. Points z are places of the prior in which every
parameter is standard normal, z = Phi^-1(F(theta)), so that the misfit of the prior is |z|^2.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from vegglue.arrays import Array, Single
from vegglue.case.gridded_site import Site
from vegglue.case.schema import Case
from vegglue.effects.definition import Amplitude
from vegglue.flow.local_changes import Term


@dataclass(frozen=True)
class Point:
    """A model linearised at z (p,): predictions (n,) [m/s or m] and slopes d prediction / dz (n, p).

    flows: by experiment, what the engine keeps of the flow there; nobody else looks into it.
    """

    z: Array
    prediction: Array
    slope: Array
    flows: Mapping[str, Any]


@dataclass(frozen=True)
class Cause:
    """A change whose response is asked for: a case that differs by its effects alone, with one parameter more, which
    does nothing at `amplitude.off`.

    experiments: where it acts, empty for all of them.
    """

    case: Case
    parameter: str
    amplitude: Amplitude
    experiments: tuple[str, ...] = ()


@dataclass(frozen=True)
class CentreFlow:
    """The flow of one experiment at cell centres, (nx, ny): depth [m], u along x and v across [m/s]."""

    depth: Array
    u: Array
    v: Array


# Told predictions (n,), whether their slopes are worth their time. Where they are not no point is given, either.
Wanted = Callable[[Array], bool]


def always(prediction: Array) -> bool:
    """Slopes are wanted whatever the predictions are."""
    return True


@dataclass(frozen=True)
class Engine:
    """How a flow is computed. A new engine is one value of this kind, see `newton` and `marching`.

    linearise(model, z, near, wanted): the model and its slopes at z (p,), or None where no steady flow is found;
        near: a point to start from, of this model or of one on cells of twice the size, whose experiments may be
        fewer; wanted: see `Wanted`.
    predict(model, points, z): predictions (m, n) at z (m, p), NaN where no flow is found; points: some that are known.
    responses(model, point, causes): d prediction / d (amplitude - off)^power at off, (n, causes).
    responses_to_cells(model, point, experiment, terms): d prediction / d term of the stations of an experiment, for a
        change in each cell of one of the TERMS of `flow/local_changes`, (n, nx, ny) by term.
    flow_at_centres(model, point, experiment): depth and velocities of a point.
    by_itself(model, point): the point with nothing borrowed from a flow nearby, where `responses_to_cells` is to be
        exact to a per cent.
    with_coarse_correction(point, before, after): a point to start from, moved as the flow on cells of twice the size
        moved from one point to another; the point itself where an engine has no use for it.
    """

    name: str
    linearise: Callable[["Model", Array, Point | None, Wanted], Point | None]
    predict: Callable[["Model", Sequence[Point], Array], Array]
    responses: Callable[["Model", Point, Sequence[Cause]], Array]
    responses_to_cells: Callable[["Model", Point, str, Sequence[Term]], Mapping[Term, Single]]
    flow_at_centres: Callable[["Model", Point, str], CentreFlow]
    by_itself: Callable[["Model", Point], Point]
    with_coarse_correction: Callable[[Point, Point, Point], Point]


@dataclass(frozen=True)
class Model:
    """A case on its grid, read at stations by an engine: a function from z (p,) to predictions (n,)."""

    case: Case
    site: Site
    station: pd.DataFrame
    engine: Engine

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.case.parameters)

    @cached_property
    def rows(self) -> dict[str, np.ndarray]:
        """Which stations stand in each experiment."""
        names = self.station["experiment"].to_numpy()
        return {experiment: np.flatnonzero(names == experiment) for experiment in self.case.experiments}

    @cached_property
    def _stations(self) -> dict[str, pd.DataFrame]:
        return {experiment: self.station.iloc[rows] for experiment, rows in self.rows.items()}

    def station_of(self, experiment: str) -> pd.DataFrame:
        """The stations of one experiment."""
        return self._stations[experiment]


def linearise(model: Model, z: Array, near: Point | None = None, wanted: Wanted = always) -> Point | None:
    """Predictions and slopes at z (p,); None when a flow finds no rest, or slopes are not `wanted`. near: a point to
    start from.
    """
    return model.engine.linearise(model, z, near, wanted)


def linearise_from(model: Model, z: Array, near: Point | None) -> Point | None:
    """`linearise` from a point nearby, and from afar where that leads nowhere or there is none."""
    found = None if near is None else linearise(model, z, near)
    return found or linearise(model, z)


def predict(model: Model, points: Sequence[Point], z: Array) -> Array:
    """Predictions (m, n) at z (m, p), NaN where no flow is found; points: some that are known already."""
    return model.engine.predict(model, points, z)


def responses(model: Model, point: Point, causes: Sequence[Cause]) -> Array:
    """d prediction / d (amplitude - off)^power at off, (n, causes): the fingerprints of causes at a point."""
    return model.engine.responses(model, point, causes)


def responses_to_cells(model: Model, point: Point, experiment: str, terms: Sequence[Term]) -> Mapping[Term, Single]:
    """d prediction / d term (n, nx, ny) [unit of a station per that of the term] for a change of it in each cell."""
    return model.engine.responses_to_cells(model, point, experiment, terms)


def by_itself(model: Model, point: Point) -> Point:
    """The point with nothing borrowed from a flow nearby: its responses to cells are then exact to a per cent."""
    return model.engine.by_itself(model, point)


def linearise_as_coarse(model: Model, point: Point, before: Point, after: Point) -> Point | None:
    """`linearise` at the z of `after`, a point on cells of twice the size, from a point whose own on these is `before`.

    The case may have an effect more or less at `after`.
    """
    start = model.engine.with_coarse_correction(point, before, after)
    return linearise(model, after.z, start) or linearise_from(model, after.z, after)


def flow_at_centres(model: Model, point: Point, experiment: str) -> CentreFlow:
    """Depth and velocities at cell centres of one experiment at a point."""
    return model.engine.flow_at_centres(model, point, experiment)
