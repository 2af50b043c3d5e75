"""A calibrated model is the same whatever command ran before it. Places are two wells; no flow is solved."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from linear_baseline import stations_of

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline
from vegglue.calibration.fit import fit
from vegglue.calibration.noise import noise_of
from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import theta_at
from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import excluded_by
from vegglue.engine.interface import Model, Point, Wanted, always
from vegglue.engine.newton import NEWTON
from vegglue.errors import InputError
from vegglue.workflow import case_run
from vegglue.workflow.case_run import CaseRun

CONFIG = Path(__file__).parents[2] / "configs" / "twin.yaml"
STARTS: list[Array | None] = []


def two_wells(model: Model, z: Array, near: Point | None = None, wanted: Wanted = always) -> Point:
    """Misfits (z^2 - 1) / 5 and (z - 1) / 40 of the first z, in m/s: wells at -1 and, lower, at 1."""
    first = z[0]
    prediction, slope = np.zeros(len(model.station)), np.zeros((len(model.station), z.size))
    prediction[:2] = (first**2 - 1.0) / 5.0, (first - 1.0) / 40.0
    slope[:2, 0] = 2.0 * first / 5.0, 1.0 / 40.0
    return Point(z, prediction, slope, {})


@pytest.fixture
def case(monkeypatch: pytest.MonkeyPatch) -> Case:
    case = load_case(CONFIG)
    station: pd.DataFrame = stations_of(case, ("D1",), 3).assign(value=0.0)
    model = Model(case, build_site(case), station, NEWTON)
    STARTS.clear()
    monkeypatch.setattr(CaseRun, "model", model)
    monkeypatch.setattr("vegglue.workflow.case_run.linearise_from", two_wells)
    monkeypatch.setattr("vegglue.calibration.fit.linearise", two_wells)
    return case


def from_prior_at(first: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The search of the prior begins at that first z."""

    def searched(model: Model, known: Array | None = None) -> Baseline:
        STARTS.append(known)
        z = np.zeros(len(model.names))
        z[0] = first
        noise = noise_of(model.station)
        return Baseline(model, noise, fit(model, noise, two_wells(model, z if known is None else known)), None, None)

    for name in ("baseline", "kept_baseline"):
        monkeypatch.setattr(f"vegglue.workflow.case_run.{name}", searched)


def first_z(case: Case, folder: Path, known: float | None) -> float:
    """The first z of the calibrated case, when an earlier command kept that one."""
    run = CaseRun(case, folder)
    if known is not None:
        z = np.zeros((1, len(case.parameters)))
        z[0, 0] = known
        theta = {name: value[0] for name, value in theta_at(case, z).items()}
        case_run.keep_best_fit(case, run.folder, theta, case_hash(case))
    return float(case_run.calibrated(run, excluded_by()).fitted.point.z[0])


@pytest.mark.parametrize(("known", "searches"), [(0.999, 2), (1.3, 2), (0.7, 2), (-0.9, 3)])
def test_a_kept_fit_that_leads_no_lower_changes_nothing(
    known: float, searches: int, case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from_prior_at(0.8, monkeypatch)
    assert first_z(case, tmp_path / "with", known) == first_z(case, tmp_path / "without", None)
    # Only one that leads elsewhere is worth a search of its own: its errors are others.
    assert len(STARTS) == searches


def test_a_kept_fit_that_leads_lower_is_taken(case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from_prior_at(-0.8, monkeypatch)
    assert first_z(case, tmp_path / "without", None) < -0.9
    assert first_z(case, tmp_path / "with", 0.7) > 0.9


def test_the_same_again_gives_the_same(case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from_prior_at(0.8, monkeypatch)
    first = first_z(case, tmp_path / "runs", None)
    again = case_run.calibrated(CaseRun(case, tmp_path / "runs"), excluded_by())
    assert float(again.fitted.point.z[0]) == first


def test_a_case_has_as_many_members_as_were_solved(case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """So a report, and an export, of a run with other `--members` than the config needs no such option."""
    assert case_run.as_solved(case, tmp_path) is case
    (tmp_path / "ensemble.h5").touch()
    monkeypatch.setattr(
        "vegglue.workflow.case_run.read_ensemble", lambda path, **_: SimpleNamespace(status=np.zeros(12))
    )
    assert case_run.as_solved(case, tmp_path).simulate.members == 12


@pytest.mark.parametrize(
    ("members", "wanted"),
    [*((number, "1 to 1,048,576, got") for number in (0, -1, 2**30)),
     *((number, f"a whole number, got {number!r}") for number in ("8", 8.0))],
)  # fmt: skip
def test_a_number_of_members_is_whole_and_no_larger_than_the_largest(members: int, wanted: str) -> None:
    with pytest.raises(InputError, match=f"members: expected {wanted}"):
        case_run.of_size(load_case(CONFIG), members)
