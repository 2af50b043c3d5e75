"""case -> twin: measurements with a hidden effect and a sealed answer; and how well its diagnosis guessed."""

from collections.abc import Sequence
from pathlib import Path

from vegglue.case.config import load_case
from vegglue.case.parameter_space import refuse_without_parameters
from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case
from vegglue.errors import shown_command
from vegglue.parallel import one_thread
from vegglue.results.result_files import diagnosis_that_fits
from vegglue.workflow.case_run import case_run
from vegglue.workflow.command_model import refuse_command
from vegglue.workflow.reveal import guess_in_words
from vegglue.workflow.sealed_answer import opened_answer, sealed_answer
from vegglue.workflow.twin_files import SEAL, config_in, in_rows_of_twin, write_twin
from vegglue.workflow.twin_measurements import measured_twin, true_place, twin_base


@one_thread()
def make_twin(
    case: Case,
    to: Path | str,
    *,
    hide: Sequence[str] = ("?",),
    snr: float = 6.0,
    noise: str = "white",
    seed: int = 1,
    force: bool = False,
) -> Case:
    """Make measurements at the stations of a case from a truth that hides something; config, tables and the sealed
    answer are written into a folder.

    hide: `EFFECT`, `EFFECT=SIZE`, `unlisted:NAME`, `bad_probe`, `nothing`, or `?` for any; snr: how visible an effect
    without a size is made [standard errors]; noise: `white`, `ar1:0.5` or `understated:1.5`; force: replace
    files there that vegglue did not write, too. Errors: InputError.
    """
    refuse_command(case, "twin")
    model = case_run(case, "runs").model
    refuse_without_parameters(case)
    station, answer = measured_twin(twin_base(model, true_place(len(model.names), seed)), hide, snr, noise, seed)
    seal = sealed_answer(in_rows_of_twin(answer, station))
    # The twin names the effect file of its case, which was trusted when that was read.
    return load_case(write_twin(case, Path(to), station, seal, force), case.effect_file is not None)


def reveal(folder: Path | str, *, runs: Path | str = "runs", trust: bool = False) -> list[str]:
    """Open the seal of a twin: what is true and, where there is a diagnosis of it, how well that guessed; one sentence
    each. trust: as for `load_case`. Errors: InputError when there is no seal, or it is broken.
    """
    folder = Path(folder)
    answer = opened_answer(folder / SEAL)
    case = load_case(config_in(folder), trust)
    there = Path(runs) / case.name
    diagnosis = diagnosis_that_fits(there / "diagnosis.h5", case_hash(case))
    lines = guess_in_words(answer, diagnosis)
    if diagnosis is None:
        lines.append(f"No diagnosis of it in {there}: {shown_command('diagnose', config_in(folder))} makes one.")
    return lines
