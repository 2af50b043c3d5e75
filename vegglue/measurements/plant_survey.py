"""The plant survey, and the phi of rigid cylinders that it amounts to, with its uncertainty by Monte Carlo."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.case.schema import Survey
from vegglue.errors import InputError, shown_path
from vegglue.measurements.csv_table import read_table, refuse_repeated, refuse_rows

SURVEYED = (
    "plant_height", "stem_height", "undergrowth_height", "stem_diameter", "stem_diameter_with_debris",
    "undergrowth_diameter", "branch_diameter", "stems", "branches_per_stem",
)  # fmt: skip
DRAWS = 20000  # their mean is known to 0.7 % of their spread
DRAG_COEFFICIENT = 1.0  # [-] of submerged plants: Berends et al. (2020), after Wunder et al. (2011)


@dataclass(frozen=True)
class SurveyedQuantity:
    """One row of the survey, in SI.

    Attributes
    ----------
    mean, standard_deviation, samples
        Of the plants, between them (0 if unknown), and how many of them.
    """

    mean: float
    standard_deviation: float
    samples: int


@dataclass(frozen=True)
class RigidCylinder:
    """phi of a stand of rigid cylinders.

    Attributes
    ----------
    draws : ndarray (draws,)
        Of phi [-].
    parts : dict of float
        Mean contribution of stems, branches and undergrowth to phi [-].
    undergrowth_density : (float, float) or None
        Assumed range, as it was not surveyed [1/m2]; None without undergrowth.
    """

    draws: Array
    parts: dict[str, float]
    undergrowth_density: tuple[float, float] | None

    @property
    def mean(self) -> float:
        """Mean of the draws [-]."""
        return float(self.draws.mean())

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of the draws [-]."""
        return float(self.draws.std())

    def quantile(self, probability: float) -> float:
        """phi [-] which the draws stay below with this probability."""
        return float(np.quantile(self.draws, probability))


def read_survey(path: Path) -> dict[str, SurveyedQuantity]:
    """Read a table of `quantity,mean,standard_deviation,samples`, one row for each of SURVEYED.

    Returns
    -------
    dict of str to SurveyedQuantity
        By quantity [SI].

    Raises
    ------
    InputError
        Naming file and row, for what is missing, unknown, repeated, or not positive.
    """
    rows = read_table(path, ("quantity",), ("mean", "standard_deviation", "samples"))
    refuse_rows(path, ~rows["quantity"].isin(SURVEYED), "unknown_name", rows["quantity"], known=list(SURVEYED))
    refuse_repeated(path, rows, ("quantity",))
    refuse_rows(path, rows["mean"] <= 0.0, "out_of_bounds", rows["mean"], above=0.0)
    for name, least in (("standard_deviation", 0.0), ("samples", 1.0)):
        refuse_rows(path, rows[name] < least, "out_of_bounds", rows[name], least=least)
    missing = [name for name in SURVEYED if name not in set(rows["quantity"])]
    if missing:
        raise InputError(
            f"{shown_path(path)}: expected a row for each of {', '.join(SURVEYED)}, got none for {', '.join(missing)}; "
            "add it."
        )
    columns = (rows["quantity"], rows["mean"], rows["standard_deviation"], rows["samples"])
    return {
        name: SurveyedQuantity(mean, error, int(samples)) for name, mean, error, samples in zip(*columns, strict=True)
    }


def rigid_cylinder(
    survey: dict[str, SurveyedQuantity], choice: Survey, draws: int = DRAWS, seed: int = 1
) -> RigidCylinder:
    """phi = C_d m (D_s h_s + b D_b (h_p - h_s)) min(h_d / h_p, 1) + C_d m_u D_u min(h_u, h_d).

    m stems [1/m2] of diameter D_s and height h_s, b branches on each from there to the plant height h_p, bent rigidly
    at the bed to the deflected height h_d (all lengths shrink by the cosine h_d / h_p; upright if
    `choice.deflected_height` is not given), and m_u stems of undergrowth of diameter D_u and height h_u, which stay
    upright [m]; C_d = 1. No foliage. Heights and diameters are lognormal with the surveyed means and standard
    deviations, so that 4 +- 4 mm stays positive.

    Parameters
    ----------
    survey
        As of `read_survey`.
    choice : Survey
        Its `spread` is `plants`, that between plants, as the +- of Berends et al. (2020) must be, or `mean`, the error
        of the mean over the sampled plants. `undergrowth_density` is the range [1/m2] of m_u, log-uniform, which was
        not surveyed; without it there is no undergrowth.
    draws, seed
        How many draws, and their seed.

    References
    ----------
    Berends et al. (2020), section 3.2; Baptist et al. (2007), doi 10.1080/00221686.2007.9521778; bending after
    Verschoren et al. (2016).
    """
    generator, drawn = np.random.default_rng(seed), {}
    for name in SURVEYED:
        one = survey[name]
        error = one.standard_deviation / (math.sqrt(one.samples) if choice.spread == "mean" else 1.0)
        variance = math.log1p((error / one.mean) ** 2)
        drawn[name] = generator.lognormal(math.log(one.mean) - variance / 2.0, math.sqrt(variance), draws)
    height, stem_height = drawn["plant_height"], np.minimum(drawn["stem_height"], drawn["plant_height"])
    deflected = np.full(draws, choice.deflected_height or np.inf)
    bent = DRAG_COEFFICIENT * drawn["stems"] * np.minimum(deflected / height, 1.0)
    diameter = drawn["stem_diameter_with_debris" if choice.debris else "stem_diameter"]
    stems = bent * diameter * stem_height
    branches = bent * drawn["branches_per_stem"] * drawn["branch_diameter"] * (height - stem_height)
    low, high = choice.undergrowth_density or (0.0, 0.0)
    density = np.exp(generator.uniform(np.log(low), np.log(high), draws)) if high > 0.0 else np.zeros(draws)
    covered = np.minimum(drawn["undergrowth_height"], deflected)
    undergrowth = DRAG_COEFFICIENT * density * drawn["undergrowth_diameter"] * covered
    parts = {"stems": stems, "branches": branches, "undergrowth": undergrowth}
    means = {name: float(part.mean()) for name, part in parts.items()}
    return RigidCylinder(stems + branches + undergrowth, means, (low, high) if high > 0.0 else None)
