"""case -> diagnosis: where the model misses and which effect is missing; and what one effect would change."""

from pathlib import Path

from vegglue.calibration.candidates import Candidate, cause_of
from vegglue.case.resolved_config import resolved_yaml
from vegglue.case.schema import Case
from vegglue.diagnosis.diagnose import GIGABYTE, MEMORY_SHARE, diagnose_model, jobs_in_memory
from vegglue.effects.definition import Effect
from vegglue.engine.interface import responses
from vegglue.engine.model import with_compilation
from vegglue.parallel import at_most, cores_of, import_beside, memory_of_machine, one_thread
from vegglue.progress import Progress, Watch, silent
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.result_files import diagnosis_that_fits, write_diagnosis
from vegglue.workflow.case_run import CaseRun, calibrated, case_run, excluded_in, keep_best_fit
from vegglue.workflow.command_model import with_command_compared


@one_thread()
def diagnose(case: Case | CaseRun, *, runs: Path | str = "runs", jobs: int = -1, watch: Watch = silent) -> Diagnosis:
    """Report where a model fails, which effect is missing, and how probable each is.

    The diagnosis is kept in runs/<name>/diagnosis.h5 and drawn in diagnosis.png. One of exactly this case is read
    instead.

    Parameters
    ----------
    case : Case or CaseRun
    runs : Path or str
        Folder that holds the folders of runs.
    jobs : int
        Processes, -1 for one on each core. Results do not depend on it.
    watch : callable
        Gets a `Progress` at each step.

    Returns
    -------
    Diagnosis

    Raises
    ------
    InputError
        If the model finds no flow, or a station has no standard error.
    """
    run = case_run(case, runs, jobs, watch)
    wanted, path = run.config_hash, run.folder / "diagnosis.h5"
    kept = diagnosis_that_fits(path, wanted)
    if kept is not None:
        return kept
    import_beside("vegglue.pages.diagnosis_figures")  # drawing takes a third of a second to import
    model = run.commanded_model
    allowed = MEMORY_SHARE * memory_of_machine() if run.memory is None else run.memory * GIGABYTE
    with at_most(jobs_in_memory(model, cores_of(run.jobs), allowed)):
        found = diagnose_model(model, run.watch, run.validation_model)
        found = with_command_compared(found, model, run.folder, run.watch)
    from vegglue.pages.diagnosis_figures import save_diagnosis_figure

    save_diagnosis_figure(found, run.case, run.folder / "diagnosis.png")
    keep_best_fit(run.case, run.folder, found.parameters.first, wanted)
    write_diagnosis(path, found, resolved_yaml(run.case), wanted)  # last: where it is, nothing else is missing
    return found


@one_thread()
def draw_fingerprint_of(case: Case, effect: Effect, *, runs: Path | str = "runs", watch: Watch = silent) -> Path:
    """Draw what an effect of plausible size would change at the stations of the calibrated case, before calibration
    takes its part; in runs/<name>/fingerprint_<effect>.png, which is returned. What its diagnosis excludes does
    not count.
    """
    run = case_run(case, runs, watch=watch)
    path, amplitude = run.folder / f"fingerprint_{effect.name}.png", effect.amplitude
    watch(Progress(with_compilation(f"calibrating {case.name}")))
    base = calibrated(run, excluded_in(run))
    shapes = {shape.name: shape.default for shape in effect.shapes}
    trace = responses(base.model, base.fitted.point, [cause_of(base.model.case, Candidate(effect), shapes)])[:, 0]
    plausible = amplitude.off + amplitude.scale
    size = f"{effect.name}, {amplitude.name} {plausible:g}{'' if amplitude.unit == '-' else f' {amplitude.unit}'}"
    from vegglue.pages.diagnosis_figures import save_fingerprint_figure

    save_fingerprint_figure(amplitude.gain(plausible) * trace, base.model.station, size, path)
    return path
