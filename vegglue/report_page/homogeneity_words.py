"""What calibrating each experiment alone says, in plain sentences with numbers."""

from collections.abc import Mapping

import numpy as np

from vegglue.results.posterior import Posterior, Transfer

# Chance below which a parameter is said to differ, between all parameters that were compared.
REJECTED = 0.01
# Chance below which it is doubted, on its own.
DOUBTED_ALONE = 0.05
# In a reference table, what others found for the same chi2.
PREFIX = "chi2_"


def moving_parameters(transfer: Transfer) -> np.ndarray:
    """Which parameters (parameter,) are not one value for all experiments."""
    compared = int(np.sum(transfer.freedom > 0))
    return np.nan_to_num(transfer.p, nan=1.0) * max(compared, 1) < REJECTED


def rejected(transfer: Transfer) -> bool:
    """Whether the calibration does not carry over between experiments."""
    return bool(moving_parameters(transfer).any()) or transfer.p_all < REJECTED


def homogeneity_in_words(posterior: Posterior, transfer: Transfer, others: Mapping[str, object]) -> list[str]:
    """Sentences on each shared parameter, the worst first, and what to make of them; others: reference values."""
    order = [int(j) for j in np.argsort(-np.nan_to_num(transfer.chi2)) if transfer.freedom[j] > 0]
    if not order:
        return ["Calibrated alone, no two experiments tell the same parameter: nothing to compare between them."]
    moves = moving_parameters(transfer)
    alike = [j for j in order[1:] if transfer.p[j] >= DOUBTED_ALONE and PREFIX + posterior.parameters[j] not in others]
    said = [_parameter(posterior, transfer, j, bool(moves[j]), others) for j in order if j not in alike]
    if alike:
        rest = ", ".join(posterior.parameters[j] for j in alike)
        least = min(transfer.p[j] for j in alike)
        said.append(f"One value for all will do as well for {rest} (p = {least:.2g} or more).")
    names = [posterior.parameters[j] for j in order if moves[j]]
    return [*said, _misfits(transfer), _meaning(names, rejected(transfer))]


def _parameter(posterior: Posterior, transfer: Transfer, j: int, moves: bool, others: Mapping[str, object]) -> str:
    name, doubted = posterior.parameters[j], transfer.p[j] < DOUBTED_ALONE
    scale = f"log10 {name}" if name in posterior.marginals.log10_median else name
    each = ", ".join(
        f"{value:.3g} ± {error:.1g} ({experiment})"
        for experiment, value, error in zip(
            transfer.experiments, transfer.value[:, j], transfer.error[:, j], strict=True
        )
        if np.isfinite(value)
    )
    verdict = "one value for all will do"
    if moves or doubted:
        verdict = "not one value for all" if moves else "hardly one value for all"
    other = others.get(PREFIX + name)
    beside = f"; the source has {other:g}" if isinstance(other, int | float) else ""
    return (
        f"From each experiment alone, {scale} = {each}: chi2 of homogeneity {transfer.chi2[j]:.3g} with "
        f"{_degrees(int(transfer.freedom[j]))} of freedom (p = {transfer.p[j]:.2g}{beside}), {verdict}."
    )


def _degrees(count: int) -> str:
    return "1 degree" if count == 1 else f"{count} degrees"


def _misfits(transfer: Transfer) -> str:
    each = ", ".join(
        f"{together:.3g} together and {alone:.3g} alone over {int(stations)} stations ({experiment})"
        for experiment, together, alone, stations in zip(
            transfer.experiments, transfer.misfit_together, transfer.misfit_alone, transfer.stations, strict=True
        )
    )
    errors = f" (errors {transfer.scale:.2f} times as large, as the experiments alone leave them)"
    return (
        f"The misfit chi2 is {each}{errors if transfer.scale != 1.0 else ''}: with parameters of its own for each "
        f"experiment it falls by {transfer.gain:.3g} for {transfer.more} more (p = {transfer.p_all:.2g})."
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
