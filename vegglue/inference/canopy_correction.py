"""phi of a stand for another canopy height, as Berends et al. (2020) corrected it."""

import numpy as np

from vegglue.arrays import Array
from vegglue.case.schema import Case
from vegglue.effects.physical_constants import GRAVITY
from vegglue.effects.plant_laws import above_canopy, baptist_chezy
from vegglue.errors import InputError
from vegglue.inference.weighted_statistics import weighted_median, weighted_quantile, weighted_sd
from vegglue.results.posterior import LEVELS, CorrectedCanopy


def correct_phi_for_canopy(
    phi: Array, from_height: float, to_height: float, depth: float, bare_chezy: float | Array
) -> Array:
    """phi' with C(phi', to_height) = C(phi, from_height) at the same depth h [-], C of `baptist_chezy`.

        phi' = 2 g ((C - C_above)^-2 - 1/C_b^2), C_above the part of the water above plants of to_height

    phi: any shape; heights h_d and depth h [m]; bare_chezy C_b [m^1/2/s]. 0 where even the bare bed would be too rough,
    infinite where no plants would be rough enough. Berends et al. (2020) corrected D3b like this and do not print the
    formula: equal C is the natural reading. C: Baptist et al. (2007), https://doi.org/10.1080/00221686.2007.9521778.
    """
    chezy = np.vectorize(baptist_chezy, otypes=[np.float64])(phi, from_height, depth, bare_chezy)
    within = chezy - above_canopy(to_height, depth)
    with np.errstate(divide="ignore"):
        corrected = 2 * GRAVITY * (np.maximum(within, 0.0) ** -2 - 1 / np.square(bare_chezy))
    return np.maximum(corrected, 0.0)


def corrected_canopy(theta: dict[str, Array], case: Case, weights: Array) -> CorrectedCanopy | None:
    """phi of the stand that the case asks to correct, for all members; None when it asks for nothing."""
    asked = case.canopy_correction
    if asked is None:
        return None
    stand = case.plants.stands[asked.stand]
    if not isinstance(stand.phi, str):
        raise InputError(f"canopy_correction: phi of the stand {asked.stand} is a number; make it a parameter.")
    bare = theta[stand.bare_chezy] if isinstance(stand.bare_chezy, str) else stand.bare_chezy
    raw = theta[stand.phi]
    phi = correct_phi_for_canopy(raw, asked.from_height, asked.to_height, asked.depth, bare)
    with np.errstate(divide="ignore"):
        log10_phi = np.log10(phi)
    return CorrectedCanopy(
        parameter=stand.phi,
        from_height=asked.from_height,
        to_height=asked.to_height,
        depth=asked.depth,
        phi=phi,
        median=weighted_median(phi, weights),
        sd=weighted_sd(phi, weights),
        quantiles=weighted_quantile(phi, weights, LEVELS),
        log10_median=weighted_median(log10_phi, weights),
        log10_sd=weighted_sd(log10_phi, weights),
    )
