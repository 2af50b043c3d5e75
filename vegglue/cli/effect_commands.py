"""The shell of the library of effects: list it, show one, check a file of one's own."""

import json
from pathlib import Path
from typing import Annotated

import typer

from vegglue.case.config import load_case
from vegglue.case.messages import nearest
from vegglue.case.schema import Case
from vegglue.cli.options import Json, Runs, console
from vegglue.effects.definition import Effect
from vegglue.effects.library import library
from vegglue.errors import InputError
from vegglue.report_page.effect_page import by_stage, effect_in_words, effect_json, work_in_case
from vegglue.workflow.check import check_effects
from vegglue.workflow.diagnose import draw_fingerprint_of


def effects_command(
    name: Annotated[
        str | None, typer.Argument(help="One effect; all of them if not given.", show_default=False)
    ] = None,
    config: Annotated[Path | None, typer.Option(help="Say also what this case does with it.")] = None,
    check: Annotated[Path | None, typer.Option(help="Check the effects of a Python file of your own.")] = None,
    as_object: Json = False,
    trust: Annotated[bool, typer.Option("--trust", help="Run the Python file of effects that is named.")] = False,
    runs: Runs = Path("runs"),
) -> None:
    """List the physical effects that can be added, or show one of them."""
    if check is not None:
        _check(check, as_object, trust)
        return
    case = load_case(config, trust) if config is not None else None
    known = library(case.effect_file if case is not None else None)
    if name is None:
        _list(tuple(known.values()), as_object)
    elif name in known:
        _show(known[name], case, as_object)
        if case is not None and case.observations and not as_object:
            console.print(f"Fingerprint drawn in {draw_fingerprint_of(case, known[name], runs=runs)}")
    else:
        raise InputError(f"effects: there is no effect `{name}`: {nearest(name, known)}")


def _list(known: tuple[Effect, ...], as_object: bool) -> None:
    if as_object:
        print(json.dumps([effect_json(effect) for effect in known], ensure_ascii=False))
        return
    for heading, effects in by_stage(known):
        console.print(heading)
        for effect in effects:
            console.print(f"  {effect.name:<22}{effect.title}")


def _show(effect: Effect, case: Case | None, as_object: bool) -> None:
    doing = list(work_in_case(case, effect)) if case is not None else []
    if as_object:
        print(json.dumps(effect_json(effect) | ({"case": doing} if case is not None else {}), ensure_ascii=False))
        return
    for line in (*effect_in_words(effect), *doing):
        console.print(line)


def _check(file: Path, as_object: bool, trust: bool) -> None:
    found = check_effects(file, trust=trust)
    if as_object:
        print(json.dumps(found, ensure_ascii=False))
    else:
        for name, sentences in found.items():
            console.print(f"{name}: {'keeps the contract' if not sentences else 'breaks it'}")
            for sentence in sentences:
                console.print(f"  - {sentence}")
    broken = [name for name, sentences in found.items() if sentences]
    if broken:
        raise InputError(f"{file}: {len(broken)} of {len(found)} effects break the contract: {', '.join(broken)}.")
