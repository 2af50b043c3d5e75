"""Whether one value of each parameter fits all experiments, in sentences for the terminal and the page."""

from collections.abc import Mapping

import numpy as np

from vegglue.results.posterior import Posterior, Transfer
from vegglue.wording.numbers import in_digits, so_many, telling_digits

# p-value [-], over all parameters compared (Bonferroni), below which a parameter is said to differ between experiments.
# Stricter than the customary 0.05: whoever reads it gives up one value for all.
REJECTED_BELOW = 0.01
# p-value [-] of one parameter by itself below which one value for all is doubted: the customary 1 in 20.
DOUBTED_BELOW = 0.05
# Key of a reference table, before the name of a parameter: the chi2 of homogeneity that its source found.
REFERENCE_CHI2 = "chi2_"


def moving_parameters(transfer: Transfer) -> np.ndarray:
    """Whether each parameter (parameter,) differs between experiments: p times the number compared < REJECTED_BELOW."""
    compared = int(np.sum(transfer.freedom > 0))
    return np.nan_to_num(transfer.p, nan=1.0) * max(compared, 1) < REJECTED_BELOW


def homogeneity_rejected(transfer: Transfer) -> bool:
    """Whether the calibration does not carry over: a parameter differs, or all together do (p < REJECTED_BELOW)."""
    return bool(moving_parameters(transfer).any()) or transfer.p_all < REJECTED_BELOW


def homogeneity_in_words(posterior: Posterior, transfer: Transfer, others: Mapping[str, object]) -> list[str]:
    """Sentences on each shared parameter, that of the largest chi2 first, then the misfits and what follows.

    others: the reference table of the case, by key.
    """
    order = [int(j) for j in np.argsort(-np.nan_to_num(transfer.chi2)) if transfer.freedom[j] > 0]
    if not order:
        return ["Calibrated alone, no two experiments tell the same parameter: nothing to compare between them."]
    moves = moving_parameters(transfer)
    alike = [
        j
        for j in order[1:]
        if transfer.p[j] >= DOUBTED_BELOW and REFERENCE_CHI2 + posterior.parameters[j] not in others
    ]
    sentences = [_parameter(posterior, transfer, j, bool(moves[j]), others) for j in order if j not in alike]
    if alike:
        rest = ", ".join(posterior.parameters[j] for j in alike)
        least = min(transfer.p[j] for j in alike)
        sentences.append(f"One value for all will do as well for {rest} (p = {least:.2g} or more).")
    names = [posterior.parameters[j] for j in order if moves[j]]
    under = _under_which_errors(posterior, transfer)
    return [*sentences, f"{_misfits(transfer)} {under}", _meaning(names, homogeneity_rejected(transfer))]


def _under_which_errors(posterior: Posterior, transfer: Transfer) -> str:
    """`compare` asks the same of linear steps under the errors as stated, and may find what larger errors hide."""
    estimated = posterior.refinement is not None and posterior.refinement.error_model.errors == "estimated"
    if estimated:
        return "All of this is under errors that are estimated from what the experiments alone leave."
    if transfer.scale <= 1.0:
        return "All of this is under the errors as stated, with those of grid and model."
    return (
        f"All of this is under errors {transfer.scale:.2f} times as large as stated; `vegglue compare` asks it under "
        "those stated, and may find more that differ."
    )


def _parameter(posterior: Posterior, transfer: Transfer, j: int, moves: bool, others: Mapping[str, object]) -> str:
    name, doubted = posterior.parameters[j], transfer.p[j] < DOUBTED_BELOW
    scale = f"log10 {name}" if name in posterior.marginals.log10_median else name
    each = ", ".join(
        f"{value:.{telling_digits(value - error, value + error)}g} ± {error:.1g} ({experiment})"
        for experiment, value, error in zip(
            transfer.experiments, transfer.value[:, j], transfer.error[:, j], strict=True
        )
        if np.isfinite(value)
    )
    verdict = "one value for all will do"
    if moves or doubted:
        verdict = "not one value for all" if moves else "hardly one value for all"
    other = others.get(REFERENCE_CHI2 + name)
    reference = f"; the source has {other:g}" if isinstance(other, int | float) else ""
    return (
        f"From each experiment alone, {scale} = {each}: chi2 of homogeneity {in_digits(transfer.chi2[j])} with "
        f"{so_many(int(transfer.freedom[j]), 'degree')} of freedom (p = {transfer.p[j]:.2g}{reference}), {verdict}."
    )


def _misfits(transfer: Transfer) -> str:
    each = ", ".join(
        f"{in_digits(together)} together and "
        f"{f'{in_digits(alone)} alone' if np.isfinite(alone) else 'not found alone'} over "
        f"{int(stations)} stations ({experiment})"
        for experiment, together, alone, stations in zip(
            transfer.experiments, transfer.misfit_together, transfer.misfit_alone, transfer.stations, strict=True
        )
    )
    errors = f" (errors {transfer.scale:.2f} times as large, as the experiments alone leave them)"
    return (
        f"The misfit chi2 is {each}{errors if transfer.scale != 1.0 else ''}: with parameters of its own for each "
        f"experiment it falls by {in_digits(transfer.gain)} for {transfer.more} more (p = {transfer.p_all:.2g})."
    )


def _meaning(names: list[str], doubted: bool) -> str:
    if not doubted:
        return "The calibration carries over from one experiment to the others."
    many = len(names) != 1
    what = " and ".join(names) or "the parameters together"
    return (
        f"The calibration does not carry over: {what} {'have' if many else 'has'} to move between experiments to fit "
        f"each, so {'they stand' if many else 'it stands'} in for something that changes between them and that the "
        "model lacks, and a prediction for another flow cannot rest on one value. `vegglue diagnose` asks what that is."
    )
