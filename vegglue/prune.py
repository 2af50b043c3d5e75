"""Backwards: which effects accepted earlier a later one has made superfluous."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from vegglue.baseline import Baseline
from vegglue.fit import fit
from vegglue.linearise import Model, linearise, z_at
from vegglue.schema import Case, Working

# An earlier effect whose amplitude lies closer to off than this many standard errors is dropped again.
NEEDED = 2.0


def pruned(base: Baseline, earlier: list[str], say: Callable[[str], None]) -> tuple[Baseline, list[str]]:
    """The model without those of its earlier effects whose amplitude has become compatible with off; their names."""
    unneeded: list[str] = []
    for name in earlier:
        key, parameter = _amplitude_of(base.model.case, name)
        j = base.model.names.index(parameter)
        spread = float(np.sqrt(base.fitted.covariance[j, j]))
        off = z_at(_alone(base.model.case, parameter), {parameter: np.array([_off(base.model.case, parameter)])})[0, 0]
        if abs(base.fitted.point.z[j] - off) > NEEDED * spread:
            continue
        say(f"{name} is no longer needed")
        fewer = _without(base, key, parameter)
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


def _amplitude_of(case: Case, name: str) -> tuple[str, str]:
    """Key and parameter of an accepted effect in a case."""
    key = next(key for key, working in case.effects.items() if _label(key, working) == name)
    return key, next(value for value in case.effects[key].values.values() if isinstance(value, str))


def _label(key: str, working: Working) -> str:
    """The name of a candidate, as discharge_error[high], from its entry in a case."""
    where = (*(working.experiments or ()), *working.sections, *working.devices)
    return f"{working.effect or key}[{','.join(where)}]" if where else working.effect or key


def _off(case: Case, parameter: str) -> float:
    return float(case.parameters[parameter].mean or 0.0)


def _alone(case: Case, parameter: str) -> Case:
    return case.model_copy(update={"parameters": {parameter: case.parameters[parameter]}})
