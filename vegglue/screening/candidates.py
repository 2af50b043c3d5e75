"""What a case could lack: every effect of the library where it may act, as a case with one parameter more."""

import itertools
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.case.case_effects import effect_of
from vegglue.case.parts import Value
from vegglue.case.schema import Case, EffectEntry, Parameter
from vegglue.effects.definition import Effect
from vegglue.effects.library import library
from vegglue.engine.interface import Cause
from vegglue.measurements.kinds import velocity_rows

# Combinations of shapes that a search tries at most.
MOST_SHAPES = 12


@dataclass(frozen=True)
class Candidate:
    """An effect and where it would act; empty tuples mean everywhere. shapes: values a search tries, by name."""

    effect: Effect
    experiments: tuple[str, ...] = ()
    sections: tuple[str, ...] = ()
    devices: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """discharge_error[high]: the effect, and where it acts if not everywhere."""
        where = (*self.experiments, *self.sections, *self.devices)
        return f"{self.effect.name}[{','.join(where)}]" if where else self.effect.name

    @property
    def key(self) -> str:
        """The same as a word, for a config, where a parameter is named after it."""
        return re.sub(r"\W", "_", "_".join([self.effect.name, *self.experiments, *self.sections, *self.devices]))

    @property
    def parameter(self) -> str:
        return f"{self.key}_{self.effect.amplitude.name}"

    def settings(self) -> list[dict[str, float]]:
        """Values of the shapes to try: their grids, or their defaults."""
        grids = [shape.grid or (shape.default,) for shape in self.effect.shapes]
        names = [shape.name for shape in self.effect.shapes]
        combinations = [dict(zip(names, values, strict=True)) for values in itertools.product(*grids)]
        every = -(-len(combinations) // MOST_SHAPES)
        return combinations[::every]


def candidates_of(case: Case, station: pd.DataFrame) -> list[Candidate]:
    """All effects of the library that could act in the case and do not yet, once for each place they may act in."""
    found = []
    places = places_of(case, station)
    for effect in library(case.effect_file).values():
        if "search" in effect.tags or (effect.stage == "plants" and not case.plants.patches):
            continue
        if effect.each == "case":
            found.append(Candidate(effect))
            continue
        for place in places[effect.each]:
            found.append(Candidate(effect, **{f"{effect.each}s": (place,)}))
    return [one for one in found if one.key not in case.effects]


def places_of(case: Case, station: pd.DataFrame) -> dict[str, list[str]]:
    """Where a cause of its own may act: experiments, sections of velocities, and devices, as far as they are used."""
    used = station[station["used"].to_numpy(bool)]
    velocity = used[velocity_rows(used)]
    return {
        "experiment": list(case.experiments),
        "section": [str(name) for name in velocity["section"].unique()],
        "device": [str(name) for name in used["device"].unique() if str(name)],
    }


def at_work(case: Case) -> dict[str, Candidate]:
    """What the effects of a case once were, by their keys."""
    return {
        key: Candidate(effect_of(case, key), working.experiments or (), working.sections, working.devices)
        for key, working in case.effects.items()
    }


def working_of(candidate: Candidate, amplitude: Value, shapes: Mapping[str, float]) -> EffectEntry:
    """The entry of a candidate in a case; amplitude: a number or the name of a parameter."""
    effect = candidate.effect
    return EffectEntry(
        effect=effect.name if candidate.key != effect.name else None,
        values={effect.amplitude.name: amplitude}
        | {shape.name: float(shapes.get(shape.name, shape.default)) for shape in effect.shapes},
        experiments=candidate.experiments or None,
        sections=candidate.sections,
        devices=candidate.devices,
    )


def with_effect(case: Case, candidate: Candidate, shapes: Mapping[str, float]) -> Case:
    """The case with one effect more; its amplitude is a parameter, its shapes are numbers."""
    parameter = candidate.parameter
    return case.model_copy(
        update={
            "effects": {**case.effects, candidate.key: working_of(candidate, parameter, shapes)},
            "parameters": {**case.parameters, parameter: prior_of(candidate.effect)},
        }
    )


def cause_of(case: Case, candidate: Candidate, shapes: Mapping[str, float]) -> Cause:
    """The case with one effect more, as a cause whose answer is the fingerprint of the effect."""
    changed = with_effect(case, candidate, shapes)
    return Cause(changed, candidate.parameter, candidate.effect.amplitude, candidate.experiments)


def prior_of(effect: Effect) -> Parameter:
    """Normal around off, as wide as plausible, within the support."""
    amplitude = effect.amplitude
    return Parameter(
        distribution="normal",
        mean=amplitude.off,
        sd=amplitude.scale,
        low=amplitude.low,
        high=amplitude.high,
        unit=amplitude.unit,
        symbol="",
        meaning=amplitude.meaning,
    )


def start_of(effect: Effect, gain: float) -> float:
    """The amplitude of that gain, kept off the ends of its support."""
    amplitude = effect.amplitude
    margin = 0.01 * min(amplitude.scale, amplitude.high - amplitude.low)
    return float(np.clip(amplitude.at(gain), amplitude.low + margin, amplitude.high - margin))
