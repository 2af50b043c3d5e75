"""What a refinement found, in plain sentences with numbers: draws, errors, misfit, and what it predicts unseen."""

import math

import numpy as np

from vegglue.calibration import TRUSTED_BELOW
from vegglue.posterior import Posterior, Refinement

UNIT_OF_KIND = {"velocity": "m/s", "level": "m"}
# Chances below which errors alone are not believed to explain what is seen.
DOUBTED, UNBELIEVED = 0.05, 0.001
# Stations that are named one by one, at most.
NAMED = 5


def drawn(posterior: Posterior, refined: Refinement) -> list[str]:
    """Sentences on the search, the modes, the draws and the errors they were weighed by."""
    many = refined.starts > 1
    starts = f"{refined.starts} of the best members were followed" if many else "The best member was followed"
    return [
        f"{starts} downhill and ended in {_modes(posterior, refined)}; {posterior.members} members were drawn around, "
        f"{posterior.failed or 'none'} of them failed (no weight).",
        *_errors(posterior, refined),
    ]


def _modes(posterior: Posterior, refined: Refinement) -> str:
    if refined.mode_chi2.size == 1:
        return "one mode"
    each = (
        f"{', '.join(f'{name} = {value:.3g}' for name, value in zip(posterior.parameters, theta, strict=True))} "
        f"with chi2 = {misfit:.4g} and weight {weight:.2g}"
        for theta, misfit, weight in zip(refined.mode_theta, refined.mode_chi2, refined.mode_weight, strict=True)
    )
    return f"{refined.mode_chi2.size} modes ({'; '.join(each)})"


def _errors(posterior: Posterior, refined: Refinement) -> list[str]:
    sizes = " and ".join(f"{value:.3g} {UNIT_OF_KIND[kind]} for {kind}" for kind, value in posterior.sigma.items())
    if refined.errors == "estimated":
        estimate = (
            f"The errors are estimated from what the best place leaves, {sizes}: what the model misses counts as "
            "error, so its chi2 says nothing; give standard errors and `infer.sigma: known` to test the model."
        )
        return [estimate, *_correlated(refined)]
    grid = (
        f"that of the grid ({refined.grid_error:.2g} on the whole) among them"
        if math.isfinite(refined.grid_error)
        else "without that of the grid, whose cells cannot be doubled"
    )
    sentences = [f"The errors are those stated with the data, {sizes}, {grid}.", *_correlated(refined)]
    if refined.scale > 1.0:
        sentences.append(
            f"They had to be multiplied by {refined.scale:.2f}: stations beside each other scatter more than is stated."
        )
    return sentences


def _correlated(refined: Refinement) -> list[str]:
    if refined.correlation == 0.0:
        return []
    return [f"Errors of neighbours along a section are correlated by {refined.correlation:.2f} (estimated)."]


def unseen(posterior: Posterior, refined: Refinement) -> list[str]:
    """Sentences on the misfit under all errors, stations left out, bands, and stations that stand out."""
    return [*_misfit(refined), *_scores(posterior, refined), *_bands(refined), *_outliers(posterior, refined)]


def _misfit(refined: Refinement) -> list[str]:
    if refined.errors == "estimated":
        return []
    said = f"Under these errors chi2 = {refined.chi2:.4g} with {refined.freedom} degrees of freedom (p = "
    said += f"{refined.p_misfit:.2g})"
    if refined.p_misfit < UNBELIEVED:
        return [f"{said}: the errors do not explain what is left, something is missing in the model or in its data."]
    return [f"{said}: the errors {'hardly ' if refined.p_misfit < DOUBTED else ''}explain what is left."]


def _scores(posterior: Posterior, refined: Refinement) -> list[str]:
    doubtful = int(np.sum(refined.score_k > TRUSTED_BELOW))
    doubt = f", {doubtful} of them not to be trusted (k-hat above {TRUSTED_BELOW})" if doubtful else ""
    sentences = [
        f"Leaving each station out in turn, the log predictive density is {refined.elpd:.1f} ± "
        f"{refined.elpd_error:.1f} over {posterior.used} stations{doubt}."
    ]
    shaky = [str(name) for name, k in zip(refined.left_out, refined.left_out_k, strict=True) if k > TRUSTED_BELOW]
    if refined.left_out.size:
        each = refined.left_out_score / refined.left_out_stations
        worst = int(np.argmin(each))
        sentences.append(
            f"Of {refined.left_out.size} sections and experiments left out in turn, the one told worst from the others "
            f"is {refined.left_out[worst]} ({each[worst]:.2f} a station, {np.median(each):.2f} in the middle)."
        )
    if shaky:
        sentences.append(f"Without {', '.join(shaky)} the posterior moves too far for these draws: not to be trusted.")
    return sentences


def _bands(refined: Refinement) -> list[str]:
    said = (
        f"Predicted from all others, {100 * refined.inside50:.0f} % of the measurements lie within their 50 % band and "
        f"{100 * refined.inside95:.0f} % within that of 95 %"
    )
    if refined.p_calibration < DOUBTED:
        return [f"{said}; they fill their bands unevenly (p = {refined.p_calibration:.2g})."]
    return [f"{said}, as evenly as they should (p = {refined.p_calibration:.2g})."]


def _outliers(posterior: Posterior, refined: Refinement) -> list[str]:
    many = int(refined.outlier.sum())
    if many > NAMED:
        worst = int(np.nanargmax(np.abs(np.where(refined.outlier, refined.surprise, np.nan))))
        row = posterior.station.iloc[worst]
        return [
            f"{many} stations stand out by more than chance allows from what all others and the model tell, most "
            f"of all {row['experiment']} {row['section']} at x = {row['x']:g} m, y = {row['y']:g} m, by "
            f"{refined.surprise[worst]:+.1f} of its errors: so many are no single errors but something missing."
        ]
    return [
        f"Station {row['experiment']} {row['section']} at x = {row['x']:g} m, y = {row['y']:g} m stands out by "
        f"{surprise:+.1f} of its errors from what all others and the model tell; it is kept."
        for (_, row), surprise in zip(
            posterior.station[refined.outlier].iterrows(), refined.surprise[refined.outlier], strict=True
        )
    ]
