"""case -> remarks: what is odd about a case, before hours are spent on it; and about a file of effects."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vegglue.calibration.law_screening import laws_beyond_their_range
from vegglue.case.case_effects import effect_of
from vegglue.case.schema import Case
from vegglue.diagnosis.case_check import check_case, critical_remarks
from vegglue.effects.library import effects_of
from vegglue.engine.finished import compared_flows
from vegglue.engine.interface import linearise
from vegglue.engine.model import coarser
from vegglue.errors import InputError
from vegglue.measurements.section_discharge import CarriedDischarge, carried_discharges
from vegglue.parallel import one_thread
from vegglue.wording.sentences import sentence
from vegglue.workflow.case_run import CaseRun, case_run
from vegglue.workflow.command_model import command_tried

if TYPE_CHECKING:
    from vegglue.diagnosis.effect_contract import Breach


@dataclass(frozen=True)
class CheckedCase:
    """What a check has found.

    Attributes
    ----------
    remarks : tuple
        What is odd about the case: frozen values of `vegglue.diagnosis`, or text of the case's own command.
        `vegglue.wording.sentences.sentence` renders each, `tagged` makes it JSON.
    carried : tuple of CarriedDischarge
        What the velocities of each section carry.
    picture : Path
        Drawing of the channel.
    """

    remarks: tuple[object, ...]
    carried: tuple[CarriedDischarge, ...]
    cells: int
    stations: int
    used_stations: int
    picture: Path


@one_thread()
def check(case: Case | CaseRun, *, runs: Path | str = "runs") -> CheckedCase:
    """Read everything that a case names, and report what is odd about it.

    The channel is drawn in runs/<name>/channel.png; the command of `engine`, if there is one, runs once.

    Parameters
    ----------
    case : Case or CaseRun
    runs : Path or str
        Folder that holds the folders of runs.

    Returns
    -------
    CheckedCase

    Raises
    ------
    InputError
        If a file cannot be read, or the command fails.
    """
    from vegglue.pages.channel import save_channel_figure  # late: every command reports what is odd, one draws

    run = case_run(case, runs)
    case, observations, site = run.case, run.observations, run.site
    picture = run.folder / "channel.png"
    remarks: list[object] = [*check_case(case, site, observations), *beyond_seen(run)]
    if case.finished_result is not None:
        remarks.insert(0, compared_flows(run.model).agreement)
    save_channel_figure(case, site, observations, picture)
    if case.engine is not None:
        remarks.append(command_tried(run.model, run.folder))
    table = observations.table
    carried = tuple(carried_discharges(case, site, table))
    return CheckedCase(tuple(remarks), carried, site.bed.size, len(table), int(table["used"].sum()), picture)


@one_thread()
def critical_warnings(run: CaseRun) -> list[object]:
    """Remarks on what would mislead all that is computed with the measurements of a case.

    Raises
    ------
    InputError
        If a file cannot be read.
    """
    return [*critical_remarks(run.case, run.site, run.observations), *beyond_seen(run)]


def beyond_seen(run: CaseRun) -> list[str]:
    """Laws that are used beyond the range they were found in, in the experiments of the case and of its validation.

    Told of the flow in the middle of the prior on coarse cells: depths and speeds hang on discharge and outlet most.
    """
    case = run.case
    if not any(effect_of(case, key).seen for key in case.effects) or case.engine is not None:
        return []
    found: list[str] = []
    for model in filter(None, (run.model, run.validation_model)):
        cheap = coarser(model) or model
        point = linearise(cheap, np.zeros(len(cheap.names)))
        found += [] if point is None else map(sentence, laws_beyond_their_range(cheap, point))
    return list(dict.fromkeys(found))


@one_thread()
def check_effects(file: Path, *, trust: bool = False) -> "dict[str, list[Breach]]":
    """What each effect of a Python file breaks of the contract.

    Parameters
    ----------
    trust : bool
        Whether the file may be run.

    Returns
    -------
    dict
        By name of the effect; no breach for a good one.

    Raises
    ------
    InputError
        If the file may not be run, or is not there.
    """
    if not trust:
        raise InputError(f"{file}: runs as code when it is checked: read it, and add --trust if you trust it.")
    if not file.is_file():
        raise InputError(f"{file}: expected an existing Python file of effects; correct the path.")
    from vegglue.diagnosis.effect_contract import breaches

    return {effect.name: breaches(effect, file.resolve()) for effect in effects_of(file.resolve())}
