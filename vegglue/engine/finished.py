"""A finished run of another model as the engine: the built-in one, corrected at the parameters of that run.

    f(z) = F(z) + [f_theirs - F_0](z_0)

f_theirs is the flow of the run at the stations, F and F_0 the built-in engine with and without the effects of the case,
z_0 the parameters that the run was made with. Slopes are those of the built-in engine: that both flows agree at z_0 is
what they rest on, and `agreement` measures it.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.grid import Grid
from vegglue.case.parameter_space import z_of
from vegglue.engine.corrected import Correction, without_effects
from vegglue.engine.interface import Model, Point, flow_at_centres, linearise
from vegglue.errors import InputError
from vegglue.measurements.kinds import velocity_rows
from vegglue.results.verdict import ResultCompared

if TYPE_CHECKING:
    from vegglue.measurements.their_flow import TheirFlow

# Largest differences of both flows at which the slopes of one stand for the other. Derived: evidence takes the trace of
# an effect as known to 15 % (decision 15); friction gives u ~ h^(2/3), and its slope S ~ h^(-10/3), so that 5 % of the
# depth change S by 15 %.
MOST_APART, MOST_LEVEL_APART, MOST_AREA_APART = 0.15, 0.05, 0.15
# Shallower than this share of the mean depth [-] neither flow is compared: there, films and steps of the mesh decide.
SHALLOW = 0.1


def their_predictions(station: pd.DataFrame, flows: "dict[str, TheirFlow]", grid: Grid) -> Array:
    """Readings of the stations in the flow of the finished run (n,) [unit of each], NaN where it is dry.

    Parameters
    ----------
    station : table of n stations
    flows : dict of TheirFlow
        By experiment.
    grid : Grid
        Across which a discharge is taken.
    """
    found = np.full(len(station), np.nan)
    kinds, names = station["kind"].to_numpy(str), station["experiment"].to_numpy(str)
    x, y = station["x"].to_numpy(float), station["y"].to_numpy(float)
    for name, flow in flows.items():
        rows = np.flatnonzero(names == name)
        here = flow.at(x[rows], y[rows])
        readings = {"velocity": here["u"], "velocity_across": here["v"], "level": here["level"]}
        readings["speed"] = np.hypot(here["u"], here["v"])
        through = kinds[rows] == "discharge"
        of_sections = np.full(rows.size, np.nan)
        of_sections[through] = flow.discharge(grid, x[rows][through])[0]
        readings["discharge"] = of_sections
        found[rows] = np.array([readings[kind][at] for at, kind in enumerate(kinds[rows])])
    return found


@dataclass(frozen=True)
class ComparedFlows:
    """Our flow and theirs with the same parameters.

    Attributes
    ----------
    correction
        f_theirs - F_0, what is added to predictions.
    agreement
        How far both flows are apart.
    """

    correction: Correction
    agreement: ResultCompared


def compared_flows(model: Model) -> ComparedFlows:
    """[f_theirs - F_0](z_0), and how well F_0(z_0) agrees with the flow of the finished run.

    Parameters
    ----------
    model
        Of a case with a finished result.

    Raises
    ------
    InputError
        If a flow cannot be read, a station in use lies where theirs is dry, or the built-in engine finds none.
    """
    from vegglue.measurements.their_flow import read_their_flow  # late: few cases wait for its trees of places

    bare, result = without_effects(model), model.case.finished_result
    assert result is not None
    flows = {name: read_their_flow(result.files[name]) for name in model.case.experiments}
    # The parameters of the finished run, in the middle of their priors where it states none.
    stated = result.parameters
    z = [z_of(prior, stated[name]) if name in stated else 0.0 for name, prior in bare.case.parameters.items()]
    own = linearise(bare, np.array(z))
    if own is None:
        raise InputError(
            f"{model.case.name}: the built-in engine finds no flow with the parameters of `finished_result`; see "
            "`vegglue check`."
        )
    theirs = their_predictions(model.station, flows, model.site.grid)
    dry = np.isnan(theirs)
    if (used := dry & model.station["used"].to_numpy(bool)).any():
        first = model.station.iloc[int(np.argmax(used))]
        raise InputError(
            f"{model.case.name}: {int(used.sum())} of {len(dry)} stations lie where the flow of `finished_result` is "
            f"dry, the first at x = {first['x']:g}, y = {first['y']:g} m; leave them out."
        )
    value = np.where(dry, 0.0, theirs - own.prediction)
    none = np.zeros((len(value), 0))
    rows = velocity_rows(model.station) & model.station["used"].to_numpy(bool)
    off = (theirs - model.station["value"].to_numpy(float))[rows]
    measured = float(np.sqrt(np.mean(off**2))) if off.size else float("nan")
    agreement = _agreement(bare, own, flows, measured)
    return ComparedFlows(Correction((), np.zeros(0), model.station, value, none), agreement)


def _agreement(model: Model, point: Point, flows: "dict[str, TheirFlow]", measured: float) -> ResultCompared:
    """Both flows at the centres of our cells, of all experiments together."""
    result, limits = model.case.finished_result, (MOST_APART, MOST_LEVEL_APART, MOST_AREA_APART)
    code = result.code if result is not None else ""
    grid = model.site.grid
    x, y = (part.ravel() for part in np.meshgrid(grid.x, grid.y, indexing="ij"))
    parts: dict[str, list[Array]] = {"square": [], "speed": [], "level": [], "depth": []}
    wet, other, beyond, spread = 0, 0, 0, 0.0
    for name, flow in flows.items():
        own = flow_at_centres(model, point, name)
        theirs = flow.at(x, y)
        depth, u, v = (part.ravel() for part in (own.depth, own.u, own.v))
        mean = float(np.nanmean(theirs["depth"]))
        theirs_wet, ours_wet = np.nan_to_num(theirs["depth"]) > SHALLOW * mean, depth > SHALLOW * mean
        both = theirs_wet & ours_wet
        parts["square"].append(((u - theirs["u"])[both]) ** 2 + ((v - theirs["v"])[both]) ** 2)
        parts["speed"].append(np.hypot(theirs["u"], theirs["v"])[both])
        parts["level"].append((model.site.bed.ravel() + depth - theirs["level"])[both])
        parts["depth"].append(theirs["depth"][both])
        wet, other = wet + int(theirs_wet.sum()), other + int((theirs_wet != ours_wet).sum())
        beyond += int((ours_wet & ~flow.inside(x, y)).sum())
        carried, _ = flow.discharge(grid, np.linspace(grid.x[0], grid.x[-1], 12)[1:-1])
        spread = max(spread, float(np.std(carried)) / max(abs(float(np.mean(carried))), 1e-12))
    fields = {name: np.concatenate(each) for name, each in parts.items()}
    if not fields["speed"].size:  # no cell is wet in both
        return ResultCompared(code, 1.0, 1.0, 1.0, np.nan, np.nan, 1.0, spread, measured, False, limits)
    velocity, level = float(np.sqrt(fields["square"].mean())), float(np.sqrt(np.mean(fields["level"] ** 2)))
    speed, depth_mean = float(fields["speed"].mean()), float(fields["depth"].mean())
    found = (velocity / max(speed, 1e-12), level / depth_mean, other / wet)
    alike = all(one <= most for one, most in zip(found, limits, strict=True))
    return ResultCompared(code, *found, velocity, level, beyond / wet, spread, measured, alike, limits)
