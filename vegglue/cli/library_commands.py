"""The commands new, export, effects, twin and reveal."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

import vegglue
from vegglue.cli.reporting import progress_reporter
from vegglue.cli.terminal import FLAG, RUNS, Config, Force, Json, Quiet, Runs, Trust, command_line, print_object
from vegglue.errors import InputError, shown_path
from vegglue.wording.commands import HELP
from vegglue.wording.sentences import phrase

if TYPE_CHECKING:
    from vegglue.effects.definition import Effect


FORMS: tuple[Literal["csv", "geotiff", "netcdf"], ...] = ("csv", "geotiff", "netcdf")


def new_command(
    name: Annotated[str, typer.Argument(metavar="NAME", help=HELP["new.name"], show_default=False)],
    length: Annotated[float, typer.Option(metavar="NUMBER", help=HELP["new.length"])] = 40.0,
    width: Annotated[float, typer.Option(metavar="NUMBER", help=HELP["new.width"])] = 3.0,
    slope: Annotated[float, typer.Option(metavar="NUMBER", help=HELP["new.slope"])] = 0.001,
    depth: Annotated[float, typer.Option(metavar="NUMBER", help=HELP["new.depth"])] = 0.9,
    discharge: Annotated[float, typer.Option(metavar="NUMBER", help=HELP["new.discharge"])] = 1.5,
    plants: Annotated[bool, typer.Option(metavar=FLAG, help=HELP["new.plants"])] = True,
    folder: Annotated[Path, typer.Option(metavar="FOLDER", help=HELP["new.folder"])] = Path("."),
    as_object: Json = False,
    quiet: Quiet = False,
) -> None:
    """Make an example folder: a commented case of a straight reach, and its measurements."""
    from vegglue.workflow.new import Reach

    with progress_reporter(quiet, as_object):
        case = vegglue.new(name, Reach(length, width, slope, depth, discharge, plants), folder=folder)
    config = shown_path(case.source)
    if as_object:
        print_object({"config": config, "case": case.name, "parameters": list(case.parameters)})
        return
    print(phrase("new_reach", config, length))
    if not quiet:
        print(phrase("next_commands", [command_line("check", config), command_line("run", config)]))


def export_command(
    config: Config,
    only: Annotated[Literal["csv", "geotiff", "netcdf"] | None, typer.Option(help=HELP["export.only"])] = None,
    to: Annotated[Literal["pest", "spotpy"] | None, typer.Option(help=HELP["export.to"])] = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Write flow and stations as CSV, GeoTIFF and netCDF (UGRID), or the case for PEST++ or SPOTPY."""
    if only is not None and to is not None:
        raise InputError("export: expected --only or --to, got both; leave one out.")
    case = vegglue.load_case(config, trust)
    with progress_reporter(quiet, as_object) as watch:
        found = vegglue.export(case, runs=runs, forms=(only,) if only else FORMS, to=to, watch=watch)
    if as_object:
        print_object({"files": found.files, "parameters": found.parameters})
        return
    print(f"{'Members' if to else 'Flow'} of {found.parameters}, {len(found.files)} files in {found.files[0].parent}:")
    for path in found.files:
        print(f"  {path.name}")


def effects_command(
    name: Annotated[str | None, typer.Argument(metavar="EFFECT", help=HELP["effects.name"], show_default=False)] = None,
    config: Annotated[
        Path | None, typer.Option("--config", "--case", metavar="CONFIG", help=HELP["effects.config"])
    ] = None,
    check: Annotated[Path | None, typer.Option(metavar="FILE", help=HELP["effects.check"])] = None,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Annotated[bool, typer.Option("--trust", metavar=FLAG, help=HELP["effects.trust"])] = False,
    runs: Runs = RUNS,
) -> None:
    """List the physical effects of the library, or show one of them."""
    from vegglue.wording.sentences import layout, phrase, sentences

    if check is not None:
        from vegglue.workflow.check import check_effects

        found = {effect: sentences(broken) for effect, broken in check_effects(check, trust=trust).items()}
        if as_object:
            print_object(found)
        else:
            print("\n".join(layout("effect_checked", effect, broken) for effect, broken in found.items()))
        if broken := [effect for effect, breaches in found.items() if breaches]:
            raise InputError(f"{check}: {len(broken)} of {len(found)} effects break the contract: {', '.join(broken)}.")
        return
    case = vegglue.load_case(config, trust) if config is not None else None
    from vegglue.case.case_effects import effect_named
    from vegglue.case.messages import nearest_effect
    from vegglue.effects.definition import STAGES
    from vegglue.effects.library import library

    known = library(case.effect_file if case is not None else None)
    if name is None:
        listed = [effect for effect in known.values() if "law" not in effect.tags]
        if as_object:
            print_object([effect_json(effect) for effect in listed])
            return
        stages = [(stage, [effect for effect in listed if effect.stage == stage]) for stage in STAGES]
        at_a_place = sum("search" in effect.tags for effect in listed)
        print(layout("effect_list", [one for one in stages if one[1]], len(listed), at_a_place))
        return
    if name not in known:
        raise InputError(f"effects: there is no effect `{name}`: {nearest_effect(name, known)}")
    effect, doing = known[name] if case is None else effect_named(case, name), []
    for key, entry in ({} if case is None else case.effects).items():
        if case is not None and (entry.effect or key) == name:
            of = {one: case.parameters[one].distribution for one in entry.values.values() if isinstance(one, str)}
            values = [(shape, value, of.get(str(value), "")) for shape, value in entry.values.items()]
            limits = [(kind, getattr(entry, kind) or ()) for kind in ("experiments", "sections", "devices")]
            doing.append(phrase("effect_in_case", case.name, key, values, limits))
    if case is not None and not doing:
        doing = [phrase("effect_absent", case.name)]
    if as_object:
        print_object(effect_json(effect) | ({"case": doing} if case is not None else {}))
        return
    print("\n".join([layout("effect_described", effect), *doing]))
    if case is not None and case.observations:
        from vegglue.workflow.diagnose import draw_fingerprint_of

        with progress_reporter(quiet, as_object=False) as watch:
            picture = draw_fingerprint_of(case, effect, runs=runs, watch=watch)
        print(f"Fingerprint drawn in {picture}")


def effect_json(effect: "Effect") -> dict[str, object]:
    """All that is declared of an effect."""
    plain = ("name", "stage", "title", "equation", "source", "doi", "checked", "read_in", "each", "mirrored", "needs")
    of_values = {"amplitude": vars(effect.amplitude), "shapes": [vars(shape) for shape in effect.shapes]}
    return {name: getattr(effect, name) for name in plain} | of_values | {"tags": list(effect.tags)}


def twin_command(
    config: Annotated[Path, typer.Argument(metavar="CONFIG", help=HELP["twin.config"], show_default=False)],
    to: Annotated[Path, typer.Option(metavar="FOLDER", help=HELP["twin.to"], show_default=False)],
    hide: Annotated[list[str] | None, typer.Option(metavar="EFFECT", help=HELP["twin.hide"])] = None,
    snr: Annotated[float, typer.Option(min=0.1, metavar="NUMBER", help=HELP["twin.snr"])] = 6.0,
    noise: Annotated[str, typer.Option(metavar="KIND", help=HELP["twin.noise"])] = "white",
    seed: Annotated[int, typer.Option(min=0, metavar="N", help=HELP["twin.seed"])] = 1,
    as_object: Json = False,
    quiet: Quiet = False,
    force: Force = False,
    trust: Trust = False,
) -> None:
    """Make synthetic measurements with a hidden effect, to test `diagnose`; the answer is encoded."""
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
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help=HELP["reveal.folder"], show_default=False)],
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Decode the answer of a twin, and compare it with its diagnosis."""
    lines = vegglue.reveal(folder, runs=runs, trust=trust)
    if as_object:
        print_object({"folder": folder, "sentences": lines})
        return
    for line in lines:
        print(f"- {line}")
