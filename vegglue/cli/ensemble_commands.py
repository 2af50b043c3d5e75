"""The shell of the ensemble: check, simulate, infer, report; and run, which goes the whole way."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Literal

import typer

import vegglue
from vegglue.cli.doubts import opened_run, print_doubts_of_ensemble
from vegglue.cli.hearing import heard
from vegglue.cli.options import RUNS, Cluster, Config, Force, Jobs, Json, Members, Quiet, Runs, Trust
from vegglue.cli.output import command_line, print_object
from vegglue.cli.telling import tell
from vegglue.errors import shown_path
from vegglue.wording.numbers import without_asides


def check_command(
    config: Config, runs: Runs = RUNS, as_object: Json = False, quiet: Quiet = False, trust: Trust = False
) -> None:
    """Read everything a case names, say what is odd, and draw the channel, before hours are spent."""
    case = vegglue.load_case(config, trust)
    with heard(quiet, as_object):
        found = vegglue.check(case, runs=runs)
    tell(case, runs, found, as_object)


def simulate_command(
    config: Config,
    members: Members = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    force: Force = False,
) -> None:
    """Solve every member of the ensemble; a run that was stopped goes on where it was.

    With --force, members for which the command of an `engine` failed are run again.
    """
    opened = opened_run(config, trust)
    from vegglue.inference.command_ensemble import refuse_useless
    from vegglue.workflow.simulate import is_up_to_date

    with heard(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        run = opened.with_settings(runs, jobs, watch, force).sized(members)
        current = is_up_to_date(run)
        ensemble = vegglue.simulate(run)
    case = run.case
    if as_object:
        from vegglue.cli.objects import object_of

        print_object(object_of(case, runs, ensemble) | {"up_to_date": current})
    elif current:
        print(f"{runs / case.name / 'ensemble.h5'} is up to date.")
    else:
        tell(case, runs, ensemble, as_object)
    refuse_useless(case, ensemble)
    print_doubts_of_ensemble(run)


def infer_command(
    config: Config,
    method: Annotated[
        Literal["refine", "glue"] | None,
        typer.Option(help="Draws around the best members, or these members weighed; instead of the config's."),
    ] = None,
    members: Members = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Infer the parameters from the measurements and say what was found."""
    opened = opened_run(config, trust)
    with heard(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        run = opened.with_settings(runs, jobs, watch)
        posterior = vegglue.infer(run, method=method, members=members)
    print_doubts_of_ensemble(run)
    tell(opened.case, runs, posterior, as_object)


def report_command(
    config: Config,
    members: Members = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Make the page and the figures of a run."""
    opened = opened_run(config, trust)
    with heard(quiet, as_object) as watch:
        run = opened.with_settings(runs, watch=watch)
        page = vegglue.report(run, members=members)
    print_doubts_of_ensemble(run)
    tell(opened.case, runs, page, as_object)


def run_command(
    config: Config,
    members: Members = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    force: Force = False,
) -> None:
    """The whole loop: diagnose, add what is missing, watch the error fall; posterior and report of the last model."""
    opened, results = opened_run(config, trust), list[tuple[Any, Any]]()

    def show(of: Any, result: Any) -> None:
        results.append((of, result))
        if not as_object:
            tell(of, runs, result, as_object)

    with heard(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        extension = vegglue.run(opened.with_settings(runs, jobs, watch, force), members=members, show=show)
    if as_object:
        from vegglue.cli.objects import run_object

        print_object(run_object(runs, results))
    else:  # what was found scrolled by, with all that was done after it
        print("\n".join(["In short:", *(f"- {line}" for line in _in_short(extension, results))]))
        for following in _left_to_add(results):
            print(f"Next: {command_line('extend', following, '--auto', runs=runs, trust=trust)}")


def _in_short(extension: Any, results: Sequence[tuple[Any, Any]]) -> list[str]:
    """A line each: the verdict, what was added, laws, the verdict on the last model, and parameters at bounds."""
    from vegglue.pages.prior_words import ends_at_bounds
    from vegglue.pages.typography import PLAIN_TEXT
    from vegglue.results.posterior import Posterior
    from vegglue.workflow.discover import DiscoveredCase

    laws = [result.found.sentence for _, result in results if isinstance(result, DiscoveredCase)]
    at_bounds = [ends_at_bounds(result, PLAIN_TEXT) for _, result in results if isinstance(result, Posterior)][-1:]
    lines = [extension.sentence, extension.reason, *laws, *_of_the_last(results), *at_bounds]
    return [without_asides(line) for line in lines if line]


def _left_to_add(results: Sequence[tuple[Any, Any]]) -> Iterator[str]:
    """The last config, where it is another than the first and its diagnosis found more."""
    from vegglue.results.diagnosis import Diagnosis

    diagnosed = [(of, one) for of, one in results if isinstance(one, Diagnosis)]
    last, found = diagnosed[-1]
    if last.name != diagnosed[0][0].name and (found.steps or found.places):
        yield shown_path(last.source)


def _of_the_last(results: Sequence[tuple[Any, Any]]) -> list[str]:
    """The verdict on the last model that was diagnosed, where it is another than the first."""
    from vegglue.results.diagnosis import Diagnosis

    found = [(of, result) for of, result in results if isinstance(result, Diagnosis)]
    last, verdict = found[-1][0], found[-1][1].verdict
    return [] if last.name == found[0][0].name else [f"With that: {verdict.sentence}"]
