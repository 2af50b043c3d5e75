"""The posterior: weighted members, and what follows from them for parameters and predictions.

It is made of a few values, each of what belongs together. `posterior_file.py` says how they lie in posterior.h5.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pandas as pd

from vegglue.measurements.kinds import errors_in_short
from vegglue.results.ensemble import VALUE_UNIT
from vegglue.results.fitting import IN_WORDS, WHOLE_NUMBERS, YES_OR_NO
from vegglue.results.layout import Stored
from vegglue.results.refinement import OWN_UNIT, Refinement
from vegglue.wording.numbers import in_short, interval_in_short, so_many

LEVELS = (0.025, 0.25, 0.5, 0.75, 0.975)  # of all quantiles and bands: the 95 % and 50 % ranges and the median
IDENTIFIED_BELOW = 0.5  # 95 % range of the posterior over that of the prior
NEAR_BOUND = 0.02  # of the range of the prior
CHAINS, DRAWS_PER_CHAIN = 4, 500  # equal-weight draws for ArviZ
# Effective members below which no posterior is claimed: an end of the 95 % range rests on 2.5 % of them, here 2 or 3.
CLAIMED_FROM = 100
ByParameter = Annotated[dict[str, float], Stored(("parameter",), OWN_UNIT)]
ByLogParameter = Annotated[dict[str, float], Stored(("log_parameter",))]
ByKind = Annotated[dict[str, float], Stored(("kind",), VALUE_UNIT)]


@dataclass(frozen=True)
class InferenceSettings:
    """How the members were weighed, and which ensemble they come from."""

    method: str  # glue: members of the ensemble weighed; refine: draws around the modes of the posterior
    likelihood: str  # gaussian, nse or inverse-variance
    sigma_rule: str  # best-member or known
    threshold: float  # smallest efficiency of a member with weight [-]; -inf: none
    ensemble_hash: str  # config hash of the ensemble, '' where none was needed
    seed: int
    version: str


@dataclass(frozen=True)
class WeightedSample:
    """The members: their parameters, what each predicts, how well, and its weight."""

    members: int
    failed: int
    best: int  # member that fits best
    unit: Annotated[dict[str, str], Stored(("parameter",), type=IN_WORDS)]
    theta: Annotated[dict[str, np.ndarray], Stored(("parameter", "member"), OWN_UNIT)]
    weights: Annotated[np.ndarray, Stored(("member",))]  # sum 1
    efficiency: Annotated[np.ndarray, Stored(("member",))]  # Nash-Sutcliffe
    log_likelihood: Annotated[np.ndarray, Stored(("member", "station"))]  # Gaussian, refined: given all other stations
    prediction: Annotated[np.ndarray, Stored(("member", "station"), VALUE_UNIT)]


@dataclass(frozen=True)
class WeightStatistics:
    """What the weights are worth."""

    weighed: int  # members solved and above the threshold
    effective_size: float  # Kish: equal members that the weights are worth [-]
    largest_weight: float  # [-]
    pareto_k: float  # shape of the tail of the weights [-]; above 0.7 they are not to be trusted


@dataclass(frozen=True)
class Marginals:
    """Each parameter by its name, beside its prior, and the correlation of all pairs.

    Of a log-uniform or lognormal parameter, correlation, width_ratio and bound_mass are those of its log10.
    """

    median: ByParameter
    sd: ByParameter
    quantiles: Annotated[dict[str, np.ndarray], Stored(("parameter", "level"), OWN_UNIT)]
    prior_quantiles: Annotated[dict[str, np.ndarray], Stored(("parameter", "level"), OWN_UNIT)]
    log10_median: ByLogParameter
    log10_sd: ByLogParameter
    correlation: Annotated[np.ndarray, Stored(("parameter", "other_parameter"))]
    width_ratio: Annotated[dict[str, float], Stored(("parameter",))]  # 95 % range, posterior over prior
    identified: Annotated[dict[str, bool], Stored(("parameter",), type=YES_OR_NO)]
    bounds: Annotated[dict[str, np.ndarray], Stored(("parameter", "side"), OWN_UNIT)]  # of the prior, maybe infinite
    bound_mass: Annotated[dict[str, np.ndarray], Stored(("parameter", "side"))]  # within 2 % of the range of a bound
    bound_hit: Annotated[dict[str, np.ndarray], Stored(("parameter", "side"), type=YES_OR_NO)]  # it presses against it


@dataclass(frozen=True)
class GoodnessOfFit:
    """What is left between measured and predicted, and the errors it is compared with, by kind of observation."""

    used: int  # stations that count
    chi2: float  # of the best member against known standard errors [-], NaN where one is unknown
    sigma: ByKind  # RMS residual of the best member, or of the known standard errors
    rmse: ByKind  # of the median prediction
    best_rmse: ByKind
    noise: Annotated[np.ndarray, Stored(("station",), VALUE_UNIT)]  # residual standard deviation, NaN unknown
    residual: Annotated[np.ndarray, Stored(("station",), VALUE_UNIT)]  # measured minus median prediction
    best_residual: Annotated[np.ndarray, Stored(("station",), VALUE_UNIT)]  # measured minus best member


@dataclass(frozen=True)
class PredictiveDistribution:
    """What the posterior predicts at the stations: quantiles, and draws of equal weight."""

    model_band: Annotated[np.ndarray, Stored(("level", "station"), VALUE_UNIT)]  # spread of the members alone
    total_band: Annotated[np.ndarray, Stored(("level", "station"), VALUE_UNIT)]  # with the residual error
    draws: Annotated[np.ndarray, Stored(("chain", "draw"), type=WHOLE_NUMBERS)]  # member indices, equal weights
    predictive: Annotated[np.ndarray, Stored(("chain", "draw", "station"), VALUE_UNIT)]  # draws with residual error


@dataclass(frozen=True)
class CorrectedCanopy:
    """phi of a stand for another canopy height: equal Chézy coefficient at the same depth."""

    parameter: str
    from_height: float  # [m]
    to_height: float  # [m]
    depth: float  # [m]
    phi: Annotated[np.ndarray, Stored(("member",))]
    median: float
    sd: float
    quantiles: Annotated[np.ndarray, Stored(("level",))]
    log10_median: float
    log10_sd: float


@dataclass(frozen=True)
class Transfer:
    """Each experiment calibrated alone: what its data say of each parameter, and whether that is one value for all.

    Values and errors on the scale on which the prior is flat (log10 of a log-uniform one); NaN where the data say
    little. chi2 of homogeneity with its freedom and chance; misfits chi2 in the joint fit and alone.
    """

    scale: float  # of the errors, from what the experiments alone leave [-]
    gain: float  # by which chi2 falls when every experiment has its own parameters [-]
    more: int  # how many parameters more these are
    p_all: float  # chance of such a gain by errors alone [-]
    experiments: Annotated[np.ndarray, Stored(("experiment",), type=IN_WORDS)]
    value: Annotated[np.ndarray, Stored(("experiment", "parameter"), OWN_UNIT)]
    error: Annotated[np.ndarray, Stored(("experiment", "parameter"), OWN_UNIT)]
    chi2: Annotated[np.ndarray, Stored(("parameter",))]
    freedom: Annotated[np.ndarray, Stored(("parameter",))]
    p: Annotated[np.ndarray, Stored(("parameter",))]
    misfit_together: Annotated[np.ndarray, Stored(("experiment",))]
    misfit_alone: Annotated[np.ndarray, Stored(("experiment",))]
    stations: Annotated[np.ndarray, Stored(("experiment",), type=WHOLE_NUMBERS)]


@dataclass(frozen=True)
class Posterior:
    """Everything one inference finds. Arrays over stations count all rows of the table `station`."""

    settings: InferenceSettings
    sample: WeightedSample
    weighting: WeightStatistics
    marginals: Marginals
    fit: GoodnessOfFit
    predicted: PredictiveDistribution
    station: pd.DataFrame
    canopy: CorrectedCanopy | None
    refinement: Refinement | None
    transfer: Transfer | None  # of several experiments

    @property
    def parameters(self) -> tuple[str, ...]:
        return tuple(self.sample.theta)

    @property
    def claimed(self) -> bool:
        """Whether enough effective members carry the weight for anything to rest on it."""
        return self.weighting.effective_size >= CLAIMED_FROM

    def __repr__(self) -> str:
        sample, marginals, worth = self.sample, self.marginals, self.weighting.effective_size
        ends, errors = [LEVELS.index(0.025), LEVELS.index(0.975)], errors_in_short(self.fit.rmse)
        ranges = {name: values[ends] for name, values in marginals.quantiles.items()}
        return in_short(
            f"Posterior of {', '.join(self.parameters)} ({self.settings.method})",
            [
                f"{sample.members:,} members, {sample.failed:,} failed, worth {worth:.0f} of equal weight",
                "" if self.claimed else f"no posterior is claimed from fewer than {CLAIMED_FROM}",
                *(
                    interval_in_short(name, marginals.median[name], low, high, sample.unit[name])
                    for name, (low, high) in ranges.items()
                ),
                f"root mean square errors of the median at {so_many(self.fit.used, 'station')}: {errors}",
            ],
        )
