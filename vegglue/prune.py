"""Backwards: which effects accepted earlier a later one has made superfluous."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from vegglue.baseline import Baseline
from vegglue.candidates import at_work
from vegglue.fit import fit
from vegglue.linearise import Model, linearise, z_of

# An earlier effect whose amplitude lies closer to off than this many standard errors is dropped again.
NEEDED = 2.0


def pruned(base: Baseline, earlier: list[str], say: Callable[[str], None]) -> tuple[Baseline, list[str]]:
    """The model without those of its earlier effects whose amplitude has become compatible with off; their names."""
    unneeded: list[str] = []
    for name in earlier:
        one = next(one for one in at_work(base.model.case).values() if one.name == name)
        j = base.model.names.index(one.parameter)
        spread = float(np.sqrt(base.fitted.covariance[j, j]))
        off = z_of(base.model.case.parameters[one.parameter], one.effect.amplitude.off)
        if abs(base.fitted.point.z[j] - off) > NEEDED * spread:
            continue
        say(f"{name} is no longer needed")
        fewer = _without(base, one.key, one.parameter)
        if fewer is not None:
            base, unneeded = fewer, [*unneeded, name]
    return base, unneeded


def _without(base: Baseline, key: str, parameter: str) -> Baseline | None:
    """The model calibrated again without one of its effects."""

    def less(model: Model) -> Model:
        case = model.case
        effects = {name: one for name, one in case.effects.items() if name != key}
        parameters = {name: one for name, one in case.parameters.items() if name != parameter}
        return replace(model, case=case.model_copy(update={"effects": effects, "parameters": parameters}))

    kept = np.array([name != parameter for name in base.model.names])
    start = linearise(less(base.model), base.fitted.point.z[kept], base.fitted.point)
    if start is None:
        return None
    fitted = fit(less(base.model), base.noise, start)
    coarse = None if base.coarse is None else less(base.coarse)
    on_coarse = None if coarse is None else linearise(coarse, fitted.point.z, base.on_coarse)
    return Baseline(less(base.model), base.noise, fitted, coarse, on_coarse)
