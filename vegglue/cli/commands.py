"""All commands of the shell: those of an ensemble, those of the loop, and the others."""

import os
import sys
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

import vegglue
from vegglue.cli.terminal import (
    FLAG,
    RUNS,
    Cluster,
    Config,
    Force,
    Jobs,
    Json,
    Members,
    MemoryLimit,
    Quiet,
    Runs,
    Trust,
    command_line,
    number_given,
    opened_run,
    opened_runs,
    print_doubts_of_ensemble,
    print_object,
    progress_reporter,
)
from vegglue.errors import InputError, shown_path
from vegglue.version import VERSION
from vegglue.wording.commands import DEMO, HELP
from vegglue.wording.numbers import so_many
from vegglue.wording.sentences import phrase

if TYPE_CHECKING:
    from vegglue.case.schema import Case
    from vegglue.effects.definition import Effect


def print_result(case: "Case", runs: Path, result: Any, as_object: bool, details: bool = False, more: str = "") -> None:
    """Print a result of a verb, kept in runs/<name>/, as an object or in words."""
    if as_object:
        from vegglue.cli.objects import object_of

        print_object(object_of(case, runs, result))
    else:
        from vegglue.cli.printed import show

        show(case, runs, result, details, more)


def check_command(
    config: Config, runs: Runs = RUNS, as_object: Json = False, quiet: Quiet = False, trust: Trust = False
) -> None:
    """Check all files of a case, report likely errors, and draw the channel."""
    case = vegglue.load_case(config, trust)
    with progress_reporter(quiet, as_object):
        found = vegglue.check(case, runs=runs)
    print_result(case, runs, found, as_object)


def simulate_command(
    config: Config,
    members: Members = None,
    parameters: Annotated[Path | None, typer.Option(metavar="CSV", help=HELP["simulate.parameters"])] = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    force: Force = False,
) -> None:
    """Solve all members of the ensemble; a stopped run is continued.

    With --force, members for which the command of an `engine` failed are run again.
    """
    if members is not None and parameters is not None:
        raise InputError("simulate: expected --members or --parameters, got both; leave one out.")
    opened = opened_run(config, trust)
    from vegglue.inference.command_ensemble import refuse_useless
    from vegglue.workflow.simulate import given_folder, is_up_to_date

    if parameters is not None:
        with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
            run = opened.with_settings(runs, jobs, watch, force)
            ensemble = vegglue.simulate(run, parameters=parameters)
        folder = given_folder(run, parameters)
        print_result(opened.case.model_copy(update={"name": folder.name}), folder.parent, ensemble, as_object)
        return
    with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        run = opened.with_settings(runs, jobs, watch, force).sized(members)
        current = is_up_to_date(run)
        ensemble = vegglue.simulate(run)
    case = run.case
    if as_object:
        from vegglue.cli.objects import object_of

        print_object(object_of(case, runs, ensemble) | {"up_to_date": current})
    elif current:
        print(phrase("up_to_date", runs / case.name / "ensemble.h5"))
    else:
        print_result(case, runs, ensemble, as_object)
    refuse_useless(case, ensemble)
    print_doubts_of_ensemble(run)


def infer_command(
    config: Config,
    method: Annotated[Literal["refine", "surrogate", "glue"] | None, typer.Option(help=HELP["infer.method"])] = None,
    members: Members = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Compute the posterior of the parameters from the measurements."""
    opened = opened_run(config, trust)
    with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        run = opened.with_settings(runs, jobs, watch)
        posterior = vegglue.infer(run, method=method, members=members)
    print_doubts_of_ensemble(run)
    print_result(opened.case, runs, posterior, as_object)


def report_command(
    config: Config,
    members: Members = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Write the page and the figures of a run."""
    opened = opened_run(config, trust)
    with progress_reporter(quiet, as_object) as watch:
        run = opened.with_settings(runs, watch=watch)
        page = vegglue.report(run, members=members)
    print_doubts_of_ensemble(run)
    print_result(opened.case, runs, page, as_object)


def run_command(
    config: Config,
    members: Members = None,
    jobs: Jobs = -1,
    memory: MemoryLimit = None,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    force: Force = False,
) -> None:
    """Run the whole loop: diagnose, add effects while held-out errors fall; posterior and report of the last model."""
    opened, results = opened_run(config, trust), list[tuple[Any, Any]]()

    def show(of: Any, result: Any) -> None:
        results.append((of, result))
        if not as_object:
            print_result(of, runs, result, as_object)

    with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        extension = vegglue.run(opened.with_settings(runs, jobs, watch, force, memory), members=members, show=show)
    if as_object:
        from vegglue.cli.objects import run_object

        print_object(run_object(runs, results))
        return
    from vegglue.cli.printed import last_of, summary_lines
    from vegglue.results.diagnosis import Diagnosis

    print("\n".join(summary_lines(extension, results)))  # what was found scrolled by, with all that was done after it
    last, found = last_of(results, Diagnosis)
    if last.name != opened.case.name and (found.steps or found.places):
        print(f"Next: {command_line('extend', shown_path(last.source), '--auto', runs=runs, trust=trust)}")


def demo_command(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help=HELP["demo.folder"])] = RUNS / "demo",
    short: Annotated[bool, typer.Option("--short", metavar=FLAG, help=HELP["demo.short"])] = False,
    no_open: Annotated[bool, typer.Option("--no-open", metavar=FLAG, help=HELP["demo.no-open"])] = False,
    jobs: Jobs = -1,
    as_object: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run the loop on synthetic measurements of the package, and open a page with the results."""
    results = list[tuple[Any, Any]]()

    def show(of: Any, result: Any) -> None:
        results.append((of, result))
        if not as_object and not quiet:
            print_result(of, folder, result, as_object)

    def begin(part: int) -> None:
        if not as_object and not quiet:
            print(DEMO[str(part)], flush=True)

    with progress_reporter(quiet, as_object) as watch:
        page = vegglue.demo(folder, short=short, jobs=jobs, watch=watch, show=show, part=begin)
    if as_object:
        from vegglue.cli.objects import run_object

        print_object(run_object(folder, results) | {"overview": page.resolve()})
        return
    print(DEMO["page"].format(page.resolve()))
    if not quiet:
        print(DEMO["copy"].format(folder))
    # Only where a person is in front of a desktop: without one, Linux would open a browser of the terminal.
    desktop = sys.platform in ("win32", "darwin") or bool(
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    )
    if desktop and sys.stdout.isatty() and not (no_open or os.environ.get("CI")):
        webbrowser.open(page.resolve().as_uri())


def import_command(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help=HELP["import.folder"])],
    to: Annotated[Path | None, typer.Option(metavar="CONFIG", help=HELP["import.to"])] = None,
    as_object: Json = False,
    quiet: Quiet = False,
    force: Force = False,
) -> None:
    """Make a case from a folder of measurements, with wide priors, ready for `vegglue run`.

    Tables may have any separator, units and names of columns; for each file one line reports what was read.

    The confluence data set of R.B. Canelas makes two cases, with the surveyed bed and with a plane bed.
    """
    case = vegglue.import_folder(folder, to, force=force)
    target = shown_path(case.source)
    patches = [patch.name for patch in case.plants.patches]
    imported = [one.model_dump() for one in case.imported or ()]
    from vegglue.workflow.import_folder import (
        assumptions_of,
        errors_of_site,
        unnamed_banks,
        unread_files,
        without_errors,
    )

    assumed = [*unread_files(case, folder), *assumptions_of(folder), *errors_of_site(case), *unnamed_banks(case)]
    unstated = without_errors(case)
    for sentence in unstated:
        print(sentence, file=sys.stderr)
    if as_object:
        names = {"experiments": list(case.experiments), "patches": patches, "parameters": list(case.parameters)}
        print_object({"config": target, "case": case.name, **names, "imported": imported, "assumed": assumed})
        return
    if not quiet:
        for sentence in [*(f"{one.name}: {one.taken}." for one in case.imported or ()), *assumed]:
            print(sentence)
    print(
        f"{target}: {so_many(len(case.experiments), 'experiment')}, {so_many(len(patches), 'patch', 'patches')}, "
        f"{so_many(len(case.parameters), 'parameter')} with wide priors."
    )
    if not quiet:
        print(f"Next: {command_line('check', target)}, then {command_line('run', target)}")


def diagnose_command(
    config: Config,
    details: Annotated[bool, typer.Option("--details", metavar=FLAG, help=HELP["diagnose.details"])] = False,
    jobs: Jobs = -1,
    memory: MemoryLimit = None,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Find the cause of the misfit: a missing effect, a local anomaly or a faulty instrument."""
    opened = opened_run(config, trust)
    with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        found = vegglue.diagnose(opened.with_settings(runs, jobs, watch, memory=memory))
    more = command_line("diagnose", config, "--details", runs=runs, trust=trust)
    print_result(opened.case, runs, found, as_object, details, more)
    if quiet or as_object:
        return
    if found.verdict.doubts_the_data:
        print(phrase("next_measurements", command_line("check", config)))
        return
    following = ("extend", config, "--auto") if found.steps or found.places else ("next", config)
    if found.verdict.tells_laws:
        following = ("discover", config)
    print(phrase("next_commands", [command_line(*following, runs=runs, trust=trust)]))


def discover_command(
    config: Config,
    without: Annotated[list[str] | None, typer.Option(metavar="EFFECT", help=HELP["discover.without"])] = None,
    to: Annotated[Path | None, typer.Option(metavar="CONFIG", help=HELP["discover.to"])] = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    force: Force = False,
) -> None:
    """Find an unlisted law that explains the misfit; write it as an effect file and a child config."""
    opened = opened_run(config, trust)
    with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        found = vegglue.discover(opened.with_settings(runs, jobs, watch, force), without=without or [], to=to)
    print_result(opened.case, runs, found, as_object)


def extend_command(
    config: Config,
    add: Annotated[list[str] | None, typer.Option(metavar="EFFECT", help=HELP["extend.add"])] = None,
    shape: Annotated[list[str] | None, typer.Option(metavar="NAME=NUMBER", help=HELP["extend.shape"])] = None,
    auto: Annotated[bool, typer.Option("--auto", metavar=FLAG, help=HELP["extend.auto"])] = False,
    to: Annotated[Path | None, typer.Option(metavar="CONFIG", help=HELP["discover.to"])] = None,
    jobs: Jobs = -1,
    memory: MemoryLimit = None,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    force: Force = False,
) -> None:
    """Write a child config with one or more further effects."""
    shapes = dict(number_given(text) for text in shape or [])
    if auto == bool(add):
        got = "both" if add else "neither"
        raise InputError(f"extend: expected either --auto or --add EFFECT, got {got}; give one.")
    if auto and (to is not None or shape):
        given = "--to" if to is not None else "--shape"
        raise InputError(f"extend: expected {given} with --add only, got it with --auto, which finds its own; drop it.")
    if auto:
        opened = opened_run(config, trust)
        with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
            extension = vegglue.extend_stepwise(opened.with_settings(runs, jobs, watch, force, memory))
        print_result(opened.case, runs, extension, as_object)
        return
    child = vegglue.extend(vegglue.load_case(config, trust), add or [], shapes=shapes, to=to, force=force, runs=runs)
    target = shown_path(child.source)
    if as_object:
        print_object({"config": target, "case": child.name, "added": add})
        return
    print(f"{target}: {child.name}.")
    if not quiet:
        commands = (("run", target), ("compare", config, target))
        print(f"Next: {', or '.join(command_line(*one, runs=runs, trust=trust) for one in commands)}")


def compare_command(
    configs: Annotated[list[Path], typer.Argument(metavar="CONFIG", help=HELP["compare.configs"], show_default=False)],
    jobs: Jobs = -1,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Compare the errors of models at calibration data and at held-out data."""
    opened = opened_runs(configs, trust)
    with progress_reporter(quiet, as_object) as watch:
        found = vegglue.compare([one.with_settings(runs, jobs, watch) for one in opened])
    print_result(opened[-1].case, runs, found, as_object)


def overview_command(
    configs: Annotated[list[Path], typer.Argument(metavar="CONFIG", help=HELP["overview.configs"], show_default=False)],
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Make one page of several runs: verdicts, parameters side by side, and links to the reports."""
    cases = [vegglue.load_case(config, trust) for config in configs]
    with progress_reporter(quiet, as_object) as watch:
        page = vegglue.overview(cases, runs=runs, trust=trust, watch=watch)
    print_result(cases[0], runs, page, as_object)


def next_command(
    config: Config,
    between: Annotated[list[str] | None, typer.Option(metavar="EFFECT", help=HELP["next.between"])] = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Propose measurements that distinguish the remaining hypotheses, by gain per hour of field work."""
    opened = opened_run(config, trust)
    with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        found = vegglue.next_measurement(opened.with_settings(runs, jobs, watch), between=between or [])
    print_result(opened.case, runs, found, as_object)


def plan_command(
    config: Config,
    about: Annotated[str, typer.Option(metavar="EFFECT", help=HELP["plan.about"])] = "",
    size: Annotated[float | None, typer.Option(metavar="NUMBER", help=HELP["plan.size"])] = None,
    between: Annotated[tuple[str, str] | None, typer.Option(metavar="EFFECT EFFECT", help=HELP["plan.between"])] = None,
    hours: Annotated[float | None, typer.Option(metavar="HOURS", help=HELP["plan.hours"])] = None,
    details: Annotated[bool, typer.Option("--details", metavar=FLAG, help=HELP["plan.details"])] = False,
    jobs: Jobs = -1,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Report what planned measurements would show, and which to add; write a page for the field."""
    opened = opened_run(config, trust)
    with progress_reporter(quiet, as_object) as watch:
        settings = opened.with_settings(runs, jobs, watch)
        found = vegglue.plan(settings, about=about, size=size, between=between or (), hours=hours)
    print_result(opened.case, runs, found, as_object, details, command_line("plan", config, "--details", runs=runs))


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


def version_command() -> None:
    """Print the version."""
    print(VERSION)
