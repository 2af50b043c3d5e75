"""How a refined posterior predicts what it has not seen, in sentences for the terminal and the page."""

import numpy as np

from vegglue.inference.refine import groups_left_out
from vegglue.inference.weighted_statistics import TRUSTED_K_HAT
from vegglue.results.posterior import GroupsLeftOut, LeaveOneOut, MisfitTest, Posterior, Refinement
from vegglue.results.verdict import MisfitTooSmall, is_too_small
from vegglue.wording.numbers import in_digits, so_many
from vegglue.wording.sentences import phrase

# p-values [-]: below the first, the customary 1 in 20, its words are guarded; below the second, something
# is said to be missing, which a run should not say by chance.
DOUBTED, UNBELIEVED = 0.05, 0.001
# Outlying stations named one by one, at most; more are no single errors, and make a list nobody reads.
OUTLIERS_NAMED = 5


def validation_in_words(posterior: Posterior, refined: Refinement) -> list[str]:
    """How a refined posterior predicts: misfit under all errors, stations left out, bands, stations that stand out."""
    return [
        *(() if refined.error_model.errors == "estimated" else _misfit_under_errors(refined.misfit)),
        *_left_out(posterior, refined.leave_one_out, refined.groups),
        *_bands(refined.leave_one_out),
        *_outliers(posterior, refined.misfit),
    ]


def _misfit_under_errors(misfit: MisfitTest) -> list[str]:
    missing = "the errors do not explain what is left, something is missing in the model or in its data."
    told = chi2_in_words(misfit, missing)
    return [told if misfit.freedom < 1 else f"Under these errors {told}"]


def chi2_in_words(misfit: MisfitTest, missing: str) -> str:
    """chi2 with its degrees of freedom, and whether the errors explain it; missing: what is said where they do not."""
    if misfit.freedom < 1:
        untested = "with no more readings than parameters: these data do not test the model."
        return f"chi2 = {in_digits(misfit.chi2, 4)} {untested}"
    degrees = so_many(misfit.freedom, "degree")
    result = f"chi2 = {in_digits(misfit.chi2, 4)} with {degrees} of freedom (p = {misfit.p_misfit:.2g})"
    if misfit.p_misfit < UNBELIEVED:
        return f"{result}: {missing}"
    if is_too_small(misfit.chi2, misfit.freedom):
        why = phrase("why_misfit_too_small", MisfitTooSmall(misfit.chi2, misfit.freedom))
        return f"{result}, less than chance makes it: {why}."
    return f"{result}: the errors {'hardly ' if misfit.p_misfit < DOUBTED else ''}explain what is left."


def _left_out(posterior: Posterior, alone: LeaveOneOut, groups: GroupsLeftOut) -> list[str]:
    doubtful = int(np.sum(alone.score_k > TRUSTED_K_HAT))
    doubt = f", {doubtful} of them not to be trusted (k-hat above {TRUSTED_K_HAT})" if doubtful else ""
    sentences = [
        f"Leaving each station out in turn, the log predictive density is {alone.elpd:.1f} ± "
        f"{alone.elpd_error:.1f} over {posterior.fit.used} stations{doubt}."
    ]
    untrusted = [str(name) for name, k in zip(groups.left_out, groups.left_out_k, strict=True) if k > TRUSTED_K_HAT]
    if groups.left_out.size:
        each = _scores_in_errors(posterior, groups)
        worst = int(np.argmin(each))
        sentences.append(
            f"Of {groups.left_out.size} sections and experiments left out in turn, the one told worst from the others "
            f"is {groups.left_out[worst]} ({each[worst]:.2f} a station, its values in their errors; "
            f"{np.median(each):.2f} in the middle)."
        )
    if untrusted:
        sentences.append(
            f"Without {', '.join(untrusted)} the posterior moves too far for these draws: not to be trusted."
        )
    return sentences


def _scores_in_errors(posterior: Posterior, groups: GroupsLeftOut) -> np.ndarray:
    """(ln p(y) + sum_i ln s_i) / n of each group of n stations (group,): the density of y_i / s_i, s_i the errors.

    That of y_i itself is the higher the smaller its unit and errors: of levels and velocities, velocities told alike
    would be told worst.
    """
    used = posterior.station["used"].to_numpy()
    size, rows = np.log(posterior.fit.noise[used]), groups_left_out(posterior.station[used])
    sizes = [size[rows[name]].mean() if name in rows else size.mean() for name in groups.left_out]
    return np.asarray(groups.left_out_score / groups.left_out_stations + sizes)


def _bands(alone: LeaveOneOut) -> list[str]:
    counted = (
        f"Predicted from all others, {100 * alone.inside50:.0f} % of the measurements lie within their 50 % band and "
        f"{100 * alone.inside95:.0f} % within that of 95 %"
    )
    if alone.p_calibration < DOUBTED:
        return [f"{counted}; they fill their bands unevenly (p = {alone.p_calibration:.2g})."]
    return [f"{counted}, as evenly as they should (p = {alone.p_calibration:.2g})."]


def _outliers(posterior: Posterior, misfit: MisfitTest) -> list[str]:
    outliers = int(misfit.outlier.sum())
    if outliers > OUTLIERS_NAMED:
        worst = misfit.worst_outlier
        return [
            f"{outliers} stations stand out by more than chance allows from what all others and the model tell, most "
            f"of all {where_it_stands(posterior, worst)}, by {misfit.surprise[worst]:+.1f} of its errors: so many are "
            "no single errors but something missing."
        ]
    return [
        f"Station {where_it_stands(posterior, row)} stands out by {misfit.surprise[row]:+.1f} of its errors from what "
        "all others and the model tell; it is kept."
        for row in np.flatnonzero(misfit.outlier).tolist()
    ]


def where_it_stands(posterior: Posterior, row: int) -> str:
    """`high D at x = 12.5 m, y = -0.3 m`: experiment, section and place of the station in a row."""
    station = posterior.station.iloc[row]
    return f"{station['experiment']} {station['section']} at x = {station['x']:g} m, y = {station['y']:g} m"
