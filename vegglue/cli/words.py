"""Results in words, as they are printed for a reader."""

from collections import Counter
from pathlib import Path
from typing import Any

from vegglue.case.schema import Case
from vegglue.cli.brief_posterior import show_posterior
from vegglue.cli.tables import show_carried, show_diagnosis, show_ladder, show_questions
from vegglue.errors import shown_path
from vegglue.flow.status import FAILED, SOLVED_BY_MARCHING, members_with
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior
from vegglue.wording.numbers import so_many
from vegglue.wording.sentences import sentences
from vegglue.workflow.check import CheckedCase
from vegglue.workflow.compare import Comparison
from vegglue.workflow.discover import DiscoveredCase
from vegglue.workflow.extend import StepwiseExtension


def show(case: Case, runs: Path, result: Any) -> None:
    """Print a result of a case: what a verb returns, or a sentence as it is."""
    folder = runs / case.name
    match result:
        case str():
            print(result)
        case CheckedCase():
            _show_check(case, result)
        case Diagnosis():
            show_diagnosis(result)
            print(f"Written to {folder / 'diagnosis.h5'}, drawn in {folder / 'diagnosis.png'}.")
        case DiscoveredCase():
            _show_discovery(result)
        case StepwiseExtension():
            show_ladder(result.comparison)
            print(result.sentence)
            print(result.reason)
            print(f"Last config: {result.cases[-1].source}")
        case Comparison():
            show_ladder(result)
            print(f"Drawn in {folder / 'ladder.png'}")
        case list():
            show_questions(case.name, result)
        case Ensemble():
            print(f"{folder / 'ensemble.h5'}: {_solved(result)}")
        case Posterior():
            show_posterior(case, folder, result)
        case Path():
            print(f"Report: {result.resolve()}")


def _show_discovery(result: DiscoveredCase) -> None:
    print(result.found.sentence)
    for first, *further in result.found.ranked:
        print("\n".join([f"- {first}", *(f"  {line}" for line in further)]))
    if result.aside:
        print(f"- {result.aside}")
    if result.child is not None and result.effect_file is not None:
        print(f"Effect file: {shown_path(result.effect_file)}")
        print(f"Child config: {shown_path(result.child.source)}")


def _show_check(case: Case, found: CheckedCase) -> None:
    show_carried(found.carried)
    for sentence in sentences(found.remarks):
        print(f"- {sentence}")
    print(
        f"{case.name}: {so_many(len(case.experiments), 'experiment')}, {found.cells:,} cells, {found.used_stations} of "
        f"{found.stations} stations in use, {so_many(len(found.remarks), 'remark')}. Channel drawn in {found.picture}"
    )


def _reasons(ensemble: Ensemble) -> str:
    """The reason of most failures, '' without any."""
    reasons = Counter(ensemble.reason[ensemble.status == FAILED].astype(str)).most_common(1)
    return "".join(f"; {count} of them: {reason}" for reason, count in reasons)


def _solved(ensemble: Ensemble) -> str:
    status = ensemble.status
    if ensemble.by_command:
        return f"{len(status):,} members, run by the command, {members_with(status, FAILED)} failed{_reasons(ensemble)}"
    marched, failed = (members_with(status, number) for number in (SOLVED_BY_MARCHING, FAILED))
    return (
        f"{len(status):,} members, {marched} by marching, {failed} failed, "
        f"largest mass error {ensemble.mass_error[status != FAILED].max(initial=0.0):.1e}"
    )
