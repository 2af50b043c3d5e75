"""What `vegglue effects` says: the library by stage, one effect in words or as JSON, and how a config names it."""

from collections.abc import Iterable, Iterator
from typing import Any

from vegglue.case.schema import Case, EffectEntry
from vegglue.effects.definition import STAGES, Amplitude, Effect, Shape

ACTS_ON = {
    "site": "the bed",
    "boundary": "what enters and leaves",
    "plants": "drag and height of plants",
    "resistance": "friction",
    "exchange": "lateral exchange of momentum",
    "force": "forces",
    "sensor": "what instruments show",
}
CAUSES = {
    "case": "one cause for the whole case",
    "experiment": "a cause of its own in each experiment",
    "section": "a cause of its own at each section",
    "device": "a cause of its own in each device",
    "patch": "a cause of its own in each patch",
}


def by_stage(effects: Iterable[Effect]) -> Iterator[tuple[str, tuple[Effect, ...]]]:
    """(heading, its effects) for every stage that has any, in the order in which they act."""
    effects = tuple(effects)
    for stage in STAGES:
        there = tuple(effect for effect in effects if effect.stage == stage)
        if there:
            yield f"{stage}: {ACTS_ON[stage]}", there


def effect_in_words(effect: Effect) -> Iterator[str]:
    """An effect as `vegglue effects NAME` prints it: equation, parameters, stage, source and its lines of a config."""
    yield f"{effect.name}: {effect.title}"
    yield f"  {effect.equation}"
    yield ""
    for parameter in effect.parameters:
        yield f"  {parameter.name} [{parameter.unit}]: {parameter.meaning}; {_numbers(parameter)}"
    yield ""
    turned = "" if effect.mirrored else "; not the same in a mirrored channel"
    yield f"  Stage {effect.stage} ({ACTS_ON[effect.stage]}); {CAUSES[effect.each]}{turned}."
    if effect.tags:
        yield f"  {', '.join(effect.tags).capitalize()}."
    yield f"  Source: {effect_source(effect)}."
    yield ""
    yield "  In a config:"
    yield from (f"    {line}" for line in config_snippet(effect))


def effect_source(effect: Effect) -> str:
    """Where it comes from, and whether the formula was compared with it, or with the code of another program."""
    doi = f", doi:{effect.doi}" if effect.doi else ""
    if effect.checked:
        return f"{effect.source}{doi}"
    read = f"read in the code of {effect.read_in}, not in the source" if effect.read_in else "not compared with it"
    return f"{effect.source}{doi} (formula {read})"


def config_snippet(effect: Effect) -> tuple[str, ...]:
    """YAML that puts an effect to work, its amplitude unknown around off."""
    a = effect.amplitude
    return (
        "effects:",
        f"  {effect.name}: {{values: {{{a.name}: {effect.name}}}}}",
        "parameters:",
        f"  {effect.name}: {{distribution: normal, mean: {a.off:g}, sd: {a.scale:g}, low: {a.low:g}, "
        f'high: {a.high:g}, unit: "{a.unit}"}}',
    )


def work_in_case(case: Case, effect: Effect) -> Iterator[str]:
    """What a case does with an effect, one line for each entry of `effects`."""
    entries = [(key, working) for key, working in case.effects.items() if (working.effect or key) == effect.name]
    if not entries:
        yield f"{case.name} does not have it."
    for key, working in entries:
        yield f"At work in {case.name} as `{key}`: {_values(case, working)}{_where(working)}."


def effect_json(effect: Effect) -> dict[str, Any]:
    """All that is declared of an effect."""
    return {
        "name": effect.name,
        "stage": effect.stage,
        "title": effect.title,
        "equation": effect.equation,
        "amplitude": vars(effect.amplitude),
        "shapes": [vars(shape) for shape in effect.shapes],
        "source": effect.source,
        "doi": effect.doi,
        "checked": effect.checked,
        "read_in": effect.read_in,
        "each": effect.each,
        "mirrored": effect.mirrored,
        "tags": list(effect.tags),
    }


def _numbers(parameter: Amplitude | Shape) -> str:
    span = f"from {parameter.low:g} to {parameter.high:g}"
    if isinstance(parameter, Amplitude):
        power = "" if parameter.power == 1 else f", answers to its power {parameter.power}"
        return f"off at {parameter.off:g}, plausible {parameter.scale:g}, {span}{power}"
    tried = f", tried at {', '.join(f'{value:g}' for value in parameter.grid)}" if parameter.grid else ""
    return f"{parameter.default:g} unless told, {span}{tried}"


def _values(case: Case, working: EffectEntry) -> str:
    written = []
    for name, value in working.values.items():
        prior = f" ({case.parameters[value].distribution})" if isinstance(value, str) else ""
        written.append(f"{name} = {value}{prior}")
    return ", ".join(written)


def _where(working: EffectEntry) -> str:
    limits = (
        ("experiments", working.experiments or ()),
        ("sections", working.sections),
        ("devices", working.devices),
    )
    return "".join(f"; {kind} {', '.join(names)}" for kind, names in limits if names)
