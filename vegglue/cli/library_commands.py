"""The commands new, export, effects, twin and reveal."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

import vegglue
from vegglue.cli.hearing import heard
from vegglue.cli.options import FLAG, RUNS, Config, Force, Json, Quiet, Runs, Trust
from vegglue.cli.output import command_line, print_object
from vegglue.errors import InputError, shown_path
from vegglue.wording.sentences import sentences

if TYPE_CHECKING:
    from vegglue.case.schema import Case
    from vegglue.effects.definition import Effect


FORMS: tuple[Literal["csv", "geotiff", "netcdf"], ...] = ("csv", "geotiff", "netcdf")


def new_command(
    name: Annotated[str, typer.Argument(help="Name of the folder to be made.", show_default=False)],
    length: Annotated[float, typer.Option(help=r"Length of the reach \[m].")] = 40.0,
    width: Annotated[float, typer.Option(help=r"Width of its floor \[m].")] = 3.0,
    slope: Annotated[float, typer.Option(help="Fall of the bed per length [-].")] = 0.001,
    depth: Annotated[float, typer.Option(help=r"Depth of the water at the outlet \[m].")] = 0.9,
    discharge: Annotated[float, typer.Option(help=r"Discharge \[m3/s].")] = 1.5,
    plants: Annotated[bool, typer.Option(metavar=FLAG, help="Whether there is a patch of plants.")] = True,
    folder: Annotated[Path, typer.Option(help="Folder to make it in.")] = Path("."),
    as_object: Json = False,
    quiet: Quiet = False,
) -> None:
    """Make a working folder: a commented case of a straight reach, and example measurements that belong to it."""
    from vegglue.workflow.new import Reach

    with heard(quiet, as_object):
        case = vegglue.new(name, Reach(length, width, slope, depth, discharge, plants), folder=folder)
    config = shown_path(case.source)
    if as_object:
        print_object({"config": config, "case": case.name, "parameters": list(case.parameters)})
        return
    print(f"{config}: a reach of {length:g} m with computed measurements beside it; put your own in their place.")
    if not quiet:
        print(f"Next: {command_line('check', config)}, then {command_line('run', config)}")


def export_command(
    config: Config,
    only: Annotated[
        Literal["csv", "geotiff", "netcdf"] | None, typer.Option(help="The one form to write; all if not given.")
    ] = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Write the flow and the stations for maps and tables: CSV, GeoTIFF, netCDF (UGRID); on the map, with a frame."""
    case = vegglue.load_case(config, trust)
    with heard(quiet, as_object) as watch:
        found = vegglue.export(case, runs=runs, forms=(only,) if only else FORMS, watch=watch)
    if as_object:
        print_object({"files": found.files, "parameters": found.parameters})
        return
    print(f"Flow of {found.parameters}, {len(found.files)} files in {found.files[0].parent}:")
    for path in found.files:
        print(f"  {path.name}")


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
    from vegglue.pages.effect_page import by_stage, effect_json

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
    from vegglue.pages.effect_page import effect_in_words, effect_json, work_in_case

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

    found = {name: sentences(broken) for name, broken in check_effects(file, trust=trust).items()}
    if as_object:
        print_object(found)
    else:
        for name, breaches in found.items():
            print(f"{name}: {'breaks the contract' if breaches else 'keeps the contract'}")
            for breach in breaches:
                print(f"  - {breach}")
    broken = [name for name, breaches in found.items() if breaches]
    if broken:
        raise InputError(f"{file}: {len(broken)} of {len(found)} effects break the contract: {', '.join(broken)}.")


def twin_command(
    config: Annotated[Path, typer.Argument(help="The case whose stations and errors are used.", show_default=False)],
    to: Annotated[Path, typer.Option(help="Folder for measurements, config and sealed answer.", show_default=False)],
    hide: Annotated[
        list[str] | None,
        typer.Option(help="EFFECT, EFFECT=SIZE, unlisted:NAME, bad_probe, nothing, or ? for any; may be repeated."),
    ] = None,
    snr: Annotated[float, typer.Option(min=0.1, help="How visible an effect without a size is made.")] = 6.0,
    noise: Annotated[str, typer.Option(help="white, ar1:0.5 or understated:1.5.")] = "white",
    seed: Annotated[int, typer.Option(min=0, help="Decides parameters, errors and what `?` is.")] = 1,
    as_object: Json = False,
    quiet: Quiet = False,
    force: Force = False,
    trust: Trust = False,
) -> None:
    """Make measurements with a hidden effect, to play blind against `diagnose`; the answer is sealed."""
    parent = vegglue.load_case(config, trust)
    case = vegglue.make_twin(parent, to, hide=hide or ["?"], snr=snr, noise=noise, seed=seed, force=force)
    from vegglue.measurements.observations import read_observations

    target = shown_path(case.source)
    measurements = int(read_observations(case).table["used"].sum())
    if as_object:
        print_object({"config": target, "folder": to, "measurements": measurements})
        return
    print(f"{target}: {measurements} measurements.")
    if not quiet:
        print(f"Next: {command_line('diagnose', target, trust=trust)}, then {command_line('reveal', to, trust=trust)}")


def reveal_command(
    folder: Annotated[Path, typer.Argument(help="Folder that `vegglue twin` made.", show_default=False)],
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Open the seal of a twin, and say how well its diagnosis guessed."""
    lines = vegglue.reveal(folder, runs=runs, trust=trust)
    if as_object:
        print_object({"folder": folder, "sentences": lines})
        return
    for line in lines:
        print(f"- {line}")
