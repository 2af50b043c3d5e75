"""What tests of posteriors share: a small one, the same with other numbers, and whether two are the same."""

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import scipy.special
from stored import HASH, MEMBERS, a_header

from vegglue.results.posterior import (
    LEVELS,
    CorrectedCanopy,
    ErrorModel,
    GoodnessOfFit,
    GroupsLeftOut,
    ImportanceDraws,
    InferenceSettings,
    LeaveOneOut,
    Marginals,
    MisfitTest,
    Posterior,
    PosteriorModes,
    PredictiveDistribution,
    Refinement,
    WeightedSample,
    WeightStatistics,
)


def changed(value: Any, **changes: object) -> Any:
    """The value with other fields, wherever in it fields of these names lie."""
    own = {field.name: getattr(value, field.name) for field in fields(value)}
    inner = {name: changed(each, **changes) for name, each in own.items() if is_dataclass(each)}
    return replace(value, **inner, **{name: new for name, new in changes.items() if name in own})


def assert_same(one: Any, other: Any) -> None:
    assert type(one) is type(other)
    if isinstance(one, dict):
        assert list(one) == list(other)
        for key in one:
            assert_same(one[key], other[key])
    elif isinstance(one, pd.DataFrame):
        pd.testing.assert_frame_equal(one, other, check_dtype=False)
    elif is_dataclass(one):
        for field in fields(one):
            assert_same(getattr(one, field.name), getattr(other, field.name))
    else:
        np.testing.assert_array_equal(one, other)


def a_posterior(canopy: bool) -> Posterior:
    """Two parameters, two stations of which one is used; every number differs from every other."""
    random = np.random.default_rng(8)
    names, station = ("n_b", "phi"), a_header().station
    weights = random.random(MEMBERS)
    two, levels = {"n_b": 0.1, "phi": 2.0}, {name: random.random(len(LEVELS)) for name in names}
    sides = {name: random.random(2) for name in names}
    per_kind = {"velocity": 0.02}
    draws = random.integers(0, MEMBERS, (4, 500))
    log_likelihood = random.random((MEMBERS, 2)) * [1, np.nan]
    predictive = random.random((4, 500, 2))
    corrected = CorrectedCanopy("phi", 0.8, 1.06, 1.36, random.random(MEMBERS), 1.5, 0.2, levels["phi"], 0.18, 0.12)
    settings = InferenceSettings("glue", "gaussian", "best-member", -np.inf, HASH, 5, "0.1.0")
    sample = WeightedSample(
        members=MEMBERS, failed=1, best=3, unit={"n_b": "s m^(-1/3)", "phi": "-"},
        theta={name: random.random(MEMBERS) for name in names}, weights=weights / weights.sum(), efficiency=weights - 1,
        log_likelihood=log_likelihood, prediction=random.random((MEMBERS, 2)),
    )  # fmt: skip
    marginals = Marginals(
        median=two, sd=two, quantiles=levels, prior_quantiles=levels, log10_median={"phi": 0.3}, log10_sd={"phi": 0.1},
        correlation=random.random((2, 2)), width_ratio=two, identified={"n_b": True, "phi": False}, bounds=sides,
        bound_mass=sides, bound_hit={"n_b": np.array([True, False]), "phi": np.array([False, False])},
    )  # fmt: skip
    fit = GoodnessOfFit(
        used=1, chi2=np.nan, sigma=per_kind, rmse=per_kind, best_rmse=per_kind, noise=np.array([0.02, np.nan]),
        residual=random.random(2),
    )  # fmt: skip
    predicted = PredictiveDistribution(random.random((5, 2)), random.random((5, 2)), draws, predictive)
    return Posterior(
        settings=settings, sample=sample, weighting=WeightStatistics(11, 7.5, 0.3, 0.4), marginals=marginals, fit=fit,
        predicted=predicted, station=station, canopy=corrected if canopy else None, refinement=None, transfer=None,
    )  # fmt: skip


def a_refinement(chi2: float = 50.0, freedom: int = 50, errors: str = "stated") -> Refinement:
    """Draws around one mode under errors that leave this chi2; no number of the other parts means anything."""
    few, none = np.array([0.0]), np.array([False])
    return Refinement(
        error_model=ErrorModel(errors, 0.0, 1.0, np.nan),
        modes=PosteriorModes(1, np.zeros((1, 2)), few, np.ones(1)),
        draws=ImportanceDraws(np.array([MEMBERS]), few, np.zeros(MEMBERS), {}),
        leave_one_out=LeaveOneOut(0.0, 1.0, 0.5, 0.95, 0.5, few, few, few),
        misfit=MisfitTest(chi2, freedom, float(scipy.special.chdtrc(freedom, chi2)), few, none),
        groups=GroupsLeftOut(np.array([], dtype=str), np.array([], dtype=int), few[:0], few[:0]),
    )
