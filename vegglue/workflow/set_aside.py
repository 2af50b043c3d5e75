"""Which measurements the diagnoses kept in the folder of runs have set aside: no model is judged by them afterwards."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import pandas as pd

from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case
from vegglue.diagnosis.excluded_stations import excluded_by
from vegglue.results.json_store import comparison_that_fits
from vegglue.results.result_files import diagnosis_that_fits


def left_out(cases: Sequence[Case], runs: Path | str) -> pd.DataFrame:
    """The measurements that are set aside of any of the cases, see `set_aside_of`."""
    # A comparison may begin with one of the cases as it was before: of its name, but of another hash.
    models = dict.fromkeys(one for case in cases for one in judged_by(case, Path(runs)).items())
    return _set_aside(models, Path(runs))


def set_aside_of(case: Case, runs: Path | str) -> pd.DataFrame:
    """Those that the diagnosis of a case has set aside, or that of the model which its comparison begins with."""
    return _set_aside(judged_by(case, Path(runs)).items(), Path(runs))


def judged_by(case: Case, runs: Path) -> dict[str, str]:
    """Names and hashes of the models whose diagnoses count: its own, and the first of its ladder."""
    wanted = case_hash(case)
    comparison = comparison_that_fits(runs / case.name, wanted)
    first = {} if comparison is None else {comparison.steps[0].name: comparison.steps[0].config_hash}
    return {**first, case.name: wanted}


def _set_aside(models: Iterable[tuple[str, str]], runs: Path) -> pd.DataFrame:
    found = (diagnosis_that_fits(runs / name / "diagnosis.h5", wanted) for name, wanted in models)
    return excluded_by(*(one for one in found if one is not None))
