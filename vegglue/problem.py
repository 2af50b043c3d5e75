"""From a case to what the solver needs: values of parameters put in place, one problem for each experiment."""

from collections.abc import Mapping

import numpy as np

from vegglue import kernels
from vegglue.flow import Array, Inflow, Plants, Problem
from vegglue.schema import Case, Experiment, Stand, StandOverride, Value
from vegglue.schema import Inflow as InflowPart
from vegglue.site import Site

LAWS = {"manning": (kernels.MANNING, "n"), "keulegan": (kernels.KEULEGAN, "k_s"), "chezy": (kernels.CHEZY, "c")}
Theta = Mapping[str, Array]


def build_problem(case: Case, site: Site, experiment: str, theta: Theta) -> Problem:
    """The problem of one experiment for all members of theta, {parameter: (members,)}."""
    members = len(next(iter(theta.values()))) if theta else 1
    setting = case.experiments[experiment]
    classes = [case.friction.classes[name] for name in site.class_names]
    return Problem(
        dx=site.grid.dx,
        dy=site.grid.dy,
        bed=site.bed,
        friction_class=site.friction_class,
        law=np.array([LAWS[item.law][0] for item in classes], dtype=np.int64),
        coefficient=np.array([_value(getattr(item, LAWS[item.law][1]), theta, members) for item in classes]),
        plants=_plants(case, site, setting, theta, members),
        viscosity=_value(case.eddy_viscosity, theta, members),
        inflows=tuple(
            _inflow(inflow, site, _value(setting.discharge[name], theta, members))
            for name, inflow in case.inflows.items()
        ),
        outlet=_within(case.outlet.range, site.grid.y),
        outlet_level=_value(setting.level, theta, members),
        film=case.numerics.film_depth,
        log_argument_minimum=case.numerics.bank_argument_minimum,
        phi_proportional=case.numerics.emergent == "proportional",
    )


def _value(value: Value, theta: Theta, members: int) -> Array:
    """A number for all members, or the parameter of that name, (members,)."""
    if isinstance(value, str):
        return np.array(theta[value], dtype=np.float64)
    return np.full(members, float(value))


def _plants(case: Case, site: Site, setting: Experiment, theta: Theta, members: int) -> Plants:
    """Vegetated cells of the patches present; phi is proportional to stems."""
    column, row = np.nonzero(site.patch >= 0)
    patches = [case.plants.patches[index] for index in site.patch[column, row]]
    present = np.array([setting.plants is True or (setting.plants and p.name in setting.plants) for p in patches], bool)
    column, row, patches = column[present], row[present], [p for p, here in zip(patches, present, strict=True) if here]
    values = {
        name: _stand(stand, setting.stands.get(name), theta, members) for name, stand in case.plants.stands.items()
    }
    fields = np.empty((3, column.size, members))
    for cell, patch in enumerate(patches):
        phi, height, chezy = values[patch.stand]
        fields[:, cell] = phi * patch.stems / case.plants.stands[patch.stand].stems, height, chezy
    return Plants(column, row, fields[0], fields[1], fields[2])


def _stand(stand: Stand, override: StandOverride | None, theta: Theta, members: int) -> tuple[Array, Array, Array]:
    """phi, canopy height and bare Chezy coefficient of a stand in one experiment."""

    def own(name: str) -> Array:
        other = getattr(override, name) if override is not None else None
        return _value(getattr(stand, name) if other is None else other, theta, members)

    return own("phi"), own("canopy_height"), own("bare_chezy")


def _inflow(inflow: InflowPart, site: Site, discharge: Array) -> Inflow:
    cells = np.flatnonzero(_within(inflow.range, site.grid.y if inflow.side == "west" else site.grid.x))
    return Inflow(inflow.side, int(cells[0]), int(cells[-1]) + 1, discharge, inflow.spread == "conveyance")


def _within(part: tuple[float, float] | None, centres: Array) -> np.ndarray:
    """Cells whose centre lies in a range, all of them without one."""
    if part is None:
        return np.ones(centres.size, dtype=bool)
    return (centres >= part[0]) & (centres < part[1])
