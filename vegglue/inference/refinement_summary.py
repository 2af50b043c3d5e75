"""What a refined posterior tells besides its weighted draws: its modes, its errors, and predictions of unseen data."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pandas as pd
from scipy.special import ndtr

from vegglue.arrays import Array
from vegglue.calibration.fit import chance_of_misfit, freedom_of_misfit, squared_misfit
from vegglue.calibration.noise import Noise, covariance_of
from vegglue.case.parameter_space import theta_at
from vegglue.case.prior import sample_prior
from vegglue.inference.importance_sampling import Sample
from vegglue.inference.leave_one_out import leave_one_out, leave_out, share_inside
from vegglue.inference.likelihood import root_mean_square
from vegglue.inference.map_and_errors import ModesAndErrors
from vegglue.results.refinement import (
    ErrorModel,
    GroupsLeftOut,
    ImportanceDraws,
    LeaveOneOut,
    MisfitTest,
    PosteriorModes,
    Refinement,
)

# A station is an outlier when errors alone put any of all stations as far off with a chance below this.
OUTLIER_BELOW = 0.01


def refinement_of(base: ModesAndErrors, drawn: Sample, best: int) -> Refinement:
    """base: errors and modes; drawn: the members drawn around the modes; best: index of the member that fits best."""
    case, noise = base.model.case, base.noise
    kept = drawn.weights > 0
    left, weights = noise.value - drawn.values[np.ix_(kept, noise.rows)], drawn.weights[kept]
    precision = precision_of(noise)
    at_all = partial(noise.among_all, stations=len(base.model.station))
    return Refinement(
        error_model=ErrorModel(
            errors="stated" if case.infer.sigma == "known" else "estimated",
            correlation=noise.correlation,
            scale=noise.scale,
            grid_error=root_mean_square(noise.grid_error) if base.grid_error_known else float("nan"),
        ),
        modes=_modes(base, drawn),
        draws=ImportanceDraws(
            drawn=np.array(drawn.drawn),
            worth=np.array(drawn.effective),
            log_density=drawn.log_density,
            prior_theta=sample_prior(case.parameters, len(drawn.z), case.simulate.seed),
        ),
        leave_one_out=_leave_one_out(left, precision, weights, at_all),
        misfit=_misfit(base, drawn.values[best], at_all),
        groups=_groups_left_out(left, precision, weights, base.model.station.iloc[noise.rows]),
    )


def _modes(base: ModesAndErrors, drawn: Sample) -> PosteriorModes:
    near = np.argmin([np.linalg.norm(drawn.z - one.point.z, axis=1) for one in base.fits], axis=0)
    theta = theta_at(base.model.case, np.stack([one.point.z for one in base.fits]))
    return PosteriorModes(
        starts=base.starts,
        mode_theta=np.column_stack(list(theta.values())),
        mode_chi2=np.array([one.chi2 for one in base.fits]),
        mode_weight=np.bincount(near, drawn.weights, len(base.fits)),
    )


def _leave_one_out(left: Array, precision: Array, weights: Array, at_all: Callable[[Array], Array]) -> LeaveOneOut:
    """Residuals (m, n) of members with weights (m,); at_all puts values of the used stations (n,) among all."""
    from scipy.stats import kstest  # late: other commands need not wait for it

    scored = leave_one_out(left, precision, weights)
    return LeaveOneOut(
        elpd=float(scored.score.sum()),
        elpd_error=float(np.sqrt(left.shape[1]) * scored.score.std()),
        inside50=share_inside(scored.below, 0.5),
        inside95=share_inside(scored.below, 0.95),
        p_calibration=float(kstest(scored.below, "uniform").pvalue),
        score=at_all(scored.score),
        score_k=at_all(scored.k),
        below=at_all(scored.below),
    )


def _misfit(base: ModesAndErrors, prediction: Array, at_all: Callable[[Array], Array]) -> MisfitTest:
    """chi2 = |W (y - f)|^2 of the best member's predictions f (station,), and each residual that stands out."""
    noise, count = base.noise, base.noise.rows.size
    chi2 = squared_misfit(noise, prediction)
    freedom = freedom_of_misfit(count, base.fits[0].covariance)
    return MisfitTest(
        chi2=chi2,
        freedom=freedom,
        p_misfit=chance_of_misfit(chi2, freedom),
        surprise=at_all(base.standardised),
        outlier=at_all(count * ndtr(-np.abs(base.standardised)) * 2) < OUTLIER_BELOW,
    )


def _groups_left_out(left: Array, precision: Array, weights: Array, used: pd.DataFrame) -> GroupsLeftOut:
    groups = groups_left_out(used)
    without = [leave_out(left, precision, weights, rows) for rows in groups.values()]
    return GroupsLeftOut(
        left_out=np.array(list(groups), object),
        left_out_stations=np.array([rows.size for rows in groups.values()]),
        left_out_score=np.array([one.score for one in without]),
        left_out_k=np.array([one.k for one in without]),
    )


def groups_left_out(used: pd.DataFrame) -> dict[str, np.ndarray]:
    """Rows of each section of each experiment, then of each experiment; none where there is only one of them."""
    names = used["experiment"].astype(str).to_numpy()
    sections = used["section"].astype(str).to_numpy()
    sections = np.where(sections == "", used["kind"].astype(str) + "s", sections)
    named = np.array([f"{a} {b}" for a, b in zip(names, sections, strict=True)])
    found: dict[str, np.ndarray] = {}
    for labels, word in ((named, ""), (names, "experiment ")):
        each = dict.fromkeys(labels)
        if len(each) > 1:
            found |= {f"{word}{label}": np.flatnonzero(labels == label) for label in each}
    return found


def precision_of(noise: Noise) -> Array:
    """Inverse covariance of the errors of the used stations, (n, n)."""
    return np.asarray(np.linalg.inv(covariance_of(noise)))
