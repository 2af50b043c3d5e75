"""The shell of the library of effects: list it, show one, check a file of one's own."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import vegglue
from vegglue.cli.hearing import heard
from vegglue.cli.options import FLAG, RUNS, Json, Quiet, Runs
from vegglue.cli.output import print_object
from vegglue.errors import InputError

if TYPE_CHECKING:
    from vegglue.case.schema import Case
    from vegglue.effects.definition import Effect


def effects_command(
    name: Annotated[
        str | None, typer.Argument(help="One effect; all of them if not given.", show_default=False)
    ] = None,
    config: Annotated[Path | None, typer.Option(help="Say also what this case does with it.")] = None,
    check: Annotated[Path | None, typer.Option(help="Check the effects of a Python file of your own.")] = None,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Annotated[
        bool, typer.Option("--trust", metavar=FLAG, help="Run the Python file of effects that is named.")
    ] = False,
    runs: Runs = RUNS,
) -> None:
    """List the physical effects that can be added, or show one of them."""
    if check is not None:
        _check(check, as_object, trust)
        return
    case = vegglue.load_case(config, trust) if config is not None else None
    from vegglue.case.messages import nearest_effect
    from vegglue.effects.library import library

    known = library(case.effect_file if case is not None else None)
    if name is None:
        _list(tuple(effect for effect in known.values() if "law" not in effect.tags), as_object)
    elif name not in known:
        raise InputError(f"effects: there is no effect `{name}`: {nearest_effect(name, known)}")
    else:
        _show(known[name], case, as_object)
        if case is not None and case.observations and not as_object:
            _draw(case, known[name], runs, quiet)


def _list(known: "tuple[Effect, ...]", as_object: bool) -> None:
    from vegglue.report.effect_page import by_stage, effect_json

    if as_object:
        print_object([effect_json(effect) for effect in known])
        return
    for heading, effects in by_stage(known):
        print(heading)
        for effect in effects:
            print(f"  {effect.name:<22}{effect.title}")
    at_a_place = sum("search" in effect.tags for effect in known)
    print(
        f"{len(known)} entries: {len(known) - at_a_place} effects that a diagnosis tries, some once for each "
        f"experiment, section, device or patch, and {at_a_place} for something at a place that nobody listed."
    )


def _show(effect: "Effect", case: "Case | None", as_object: bool) -> None:
    from vegglue.report.effect_page import effect_in_words, effect_json, work_in_case

    doing = list(work_in_case(case, effect)) if case is not None else []
    if as_object:
        print_object(effect_json(effect) | ({"case": doing} if case is not None else {}))
        return
    for line in (*effect_in_words(effect), *doing):
        print(line)


def _draw(case: "Case", effect: "Effect", runs: Path, quiet: bool) -> None:
    from vegglue.workflow.diagnose import draw_fingerprint_of

    with heard(quiet, as_object=False) as watch:
        picture = draw_fingerprint_of(case, effect, runs=runs, watch=watch)
    print(f"Fingerprint drawn in {picture}")


def _check(file: Path, as_object: bool, trust: bool) -> None:
    from vegglue.workflow.check import check_effects

    found = check_effects(file, trust=trust)
    if as_object:
        print_object(found)
    else:
        for name, sentences in found.items():
            print(f"{name}: {'keeps the contract' if not sentences else 'breaks it'}")
            for sentence in sentences:
                print(f"  - {sentence}")
    broken = [name for name, sentences in found.items() if sentences]
    if broken:
        raise InputError(f"{file}: {len(broken)} of {len(found)} effects break the contract: {', '.join(broken)}.")
