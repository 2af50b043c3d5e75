"""case -> diagnosis: where the model misses and which effect is missing; and what one effect would change."""

from pathlib import Path

import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration.candidates import Candidate, cause_of
from vegglue.case.resolved_config import case_hash, resolved_yaml
from vegglue.case.schema import Case
from vegglue.diagnosis.diagnose import diagnose_model
from vegglue.effects.definition import Effect
from vegglue.engine.first_use import with_compilation
from vegglue.engine.interface import responses
from vegglue.parallel import at_most, import_beside, one_thread
from vegglue.progress import Progress, Watch, silent
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.result_files import diagnosis_that_fits, write_diagnosis
from vegglue.workflow.command_model import with_command, with_words_on_command
from vegglue.workflow.run_folder import calibrated, folder_of, keep_best_fit, model_in, validation_of
from vegglue.workflow.set_aside import set_aside_of


@one_thread()
def diagnose(case: Case, *, runs: Path | str = "runs", jobs: int = -1, watch: Watch = silent) -> Diagnosis:
    """Say where the model fails, which effect is missing, and how sure that is; kept in runs/<name>/diagnosis.h5 and
    drawn in diagnosis.png.

    A diagnosis of exactly this case is read instead. Errors: InputError when the model finds no flow, or a station has
    no standard error.
    """
    folder, wanted = folder_of(runs, case), case_hash(case)
    path = folder / "diagnosis.h5"
    kept = diagnosis_that_fits(path, wanted)
    if kept is not None:
        return kept
    import_beside("vegglue.report.diagnosis_figures")  # drawing takes a third of a second to import
    with at_most(jobs):
        model = with_command(model_in(case), folder, watch)
        found = diagnose_model(model, watch, validation_of(case, folder, watch))
        found = with_words_on_command(found, model, folder, watch)
    from vegglue.report.diagnosis_figures import save_diagnosis_figure

    save_diagnosis_figure(found, case, folder / "diagnosis.png")
    keep_best_fit(case, folder, found.parameters.first, wanted)
    write_diagnosis(path, found, resolved_yaml(case), wanted)  # last: where it is, nothing else is missing
    return found


@one_thread()
def draw_fingerprint_of(case: Case, effect: Effect, *, runs: Path | str = "runs", watch: Watch = silent) -> Path:
    """Draw what an effect of plausible size would change at the stations of the calibrated case, before calibration
    takes its part; in runs/<name>/fingerprint_<effect>.png, which is returned. What its diagnosis has set aside does
    not count.
    """
    folder = folder_of(runs, case)
    path = folder / f"fingerprint_{effect.name}.png"
    watch(Progress(with_compilation(f"calibrating {case.name}")))
    trace, station = _fingerprint_of(case, folder, set_aside_of(case, runs), effect, watch)
    amplitude = effect.amplitude
    plausible = amplitude.off + amplitude.scale
    size = f"{effect.name}, {amplitude.name} {plausible:g}{'' if amplitude.unit == '-' else f' {amplitude.unit}'}"
    from vegglue.report.diagnosis_figures import save_fingerprint_figure

    save_fingerprint_figure(amplitude.gain(plausible) * trace, station, size, path)
    return path


def _fingerprint_of(
    case: Case, folder: Path, aside: pd.DataFrame, effect: Effect, watch: Watch
) -> tuple[Array, pd.DataFrame]:
    """What one effect, everywhere and at its default shapes, would change at the stations of the case, calibrated
    without what was set aside, per unit of (amplitude - off)^power: (station,) and the stations.
    """
    base, one = calibrated(case, folder, aside, watch), Candidate(effect)
    shapes = {shape.name: shape.default for shape in effect.shapes}
    changed = cause_of(base.model.case, one, shapes)
    return responses(base.model, base.fitted.point, [changed])[:, 0], base.model.station
