"""The flow of the median parameters as it lies in flow.h5, so that a page need not solve it again."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from vegglue.flow.sensor import FlowFields
from vegglue.results.fitting import fitting, names_of
from vegglue.results.layout import Group, Stored, Variable

# Fields at cell centres, in units of FlowFields.
FIELD_UNITS_KEPT = {"bed": "m", "depth": "m", "level": "m", "u": "m/s", "v": "m/s"}


def flow_groups(flow: Mapping[str, FlowFields]) -> dict[str, Group]:
    """The groups of flow.h5, from fields by experiment, of which there is at least one."""
    first = next(iter(flow.values()))
    coordinates = {"experiment": np.array(list(flow), object), "x": first.x, "y": first.y}
    values = {
        name: Variable(("experiment", "x", "y"), np.stack([getattr(one, name) for one in flow.values()]), unit)
        for name, unit in FIELD_UNITS_KEPT.items()
    }
    return {"flow": Group(coordinates, values, {"x": "m", "y": "m"})}


def flow_attributes(theta: Mapping[str, float]) -> dict[str, str]:
    """The parameters the flow was solved with."""
    return {"theta": json.dumps({name: float(value) for name, value in theta.items()}, sort_keys=True)}


def flow_from(groups: Mapping[str, Mapping[str, Any]]) -> dict[str, FlowFields]:
    """The fields by experiment of a file with these groups."""
    at_cells = dict.fromkeys(FIELD_UNITS_KEPT, Stored(("experiment", "x", "y")))
    kept = fitting(groups["flow"], at_cells | {"x": Stored(("x",)), "y": Stored(("y",))})
    return {
        experiment: FlowFields(kept["x"], kept["y"], **{name: kept[name][place] for name in FIELD_UNITS_KEPT})
        for place, experiment in enumerate(names_of(kept, "experiment"))
    }
