"""The posterior as values: weighted members, what follows from them, and how they were drawn.

`posterior_file.py` lays them out in posterior.h5. A mode is a set of parameters from which no small step improves the
fit. Members are drawn in rounds, each of which uses what the rounds before it found.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pandas as pd

from vegglue.measurements.kinds import errors_in_short
from vegglue.results.ensemble import VALUE_UNIT
from vegglue.results.layout import IN_WORDS, WHOLE_NUMBERS, YES_OR_NO, Stored
from vegglue.wording.numbers import in_short, in_short_html, interval_in_short
from vegglue.wording.sentences import phrase

OWN_UNIT = "that of the parameter, see `unit`"


@dataclass(frozen=True)
class ErrorModel:
    """The errors of the data that the misfit is weighed by."""

    errors: str  # stated or estimated
    correlation: float  # of the errors of neighbours along a section [-]
    scale: float  # of the stated errors [-]
    grid_error: float  # root mean square, from a grid of twice the cell size [m/s, m]; NaN where that cannot be made


@dataclass(frozen=True)
class PosteriorModes:
    """Where the search for the best fit ended, the best mode first."""

    starts: int  # members that were followed downhill
    mode_theta: Annotated[np.ndarray, Stored(("mode", "parameter"), OWN_UNIT)]
    mode_chi2: Annotated[np.ndarray, Stored(("mode",))]
    mode_weight: Annotated[np.ndarray, Stored(("mode",))]  # of the draws nearest to each


@dataclass(frozen=True)
class ImportanceDraws:
    """How the members were drawn, and as many draws from the prior to compare them with."""

    drawn: Annotated[np.ndarray, Stored(("round",), type=WHOLE_NUMBERS)]  # members after each round
    worth: Annotated[np.ndarray, Stored(("round",))]  # effective members after each round
    log_density: Annotated[np.ndarray, Stored(("member",))]  # of the posterior up to a constant; -inf failed
    prior_theta: Annotated[dict[str, np.ndarray], Stored(("parameter", "member"), OWN_UNIT)]  # draws from the prior


@dataclass(frozen=True)
class LeaveOneOut:
    """Each station predicted from all others."""

    elpd: float  # sum of the log predictive densities of stations left out in turn [-]
    elpd_error: float
    inside50: float  # share of measurements within the 50 % band of the prediction from all others [-]
    inside95: float
    p_calibration: float  # chance that shares below are as uneven as these (Kolmogorov-Smirnov) [-]
    score: Annotated[np.ndarray, Stored(("station",))]  # log predictive density given all other stations
    score_k: Annotated[np.ndarray, Stored(("station",))]  # k-hat of it
    below: Annotated[np.ndarray, Stored(("station",))]  # share of the prediction below the measurement


@dataclass(frozen=True)
class MisfitTest:
    """Whether the errors explain what the best member leaves, at all stations together and at each."""

    chi2: float  # of the best member, whitened by the covariance of the errors [-]
    freedom: int
    p_misfit: float  # chance of a chi2 as large under errors alone [-]
    surprise: Annotated[np.ndarray, Stored(("station",))]  # residual that calibration cannot explain, in its errors
    outlier: Annotated[np.ndarray, Stored(("station",), type=YES_OR_NO)]  # one such among all is no chance

    @property
    def worst_outlier(self) -> int:
        """The row of the station that stands out most, of those that are outliers; ValueError without any."""
        return int(np.nanargmax(np.abs(np.where(self.outlier, self.surprise, np.nan))))


@dataclass(frozen=True)
class GroupsLeftOut:
    """Each section, and each experiment, predicted from all other stations."""

    left_out: Annotated[np.ndarray, Stored(("group",), type=IN_WORDS)]  # sections and experiments left out in turn
    left_out_stations: Annotated[np.ndarray, Stored(("group",), type=WHOLE_NUMBERS)]
    left_out_score: Annotated[np.ndarray, Stored(("group",))]  # log predictive density of them together
    left_out_k: Annotated[np.ndarray, Stored(("group",))]


@dataclass(frozen=True)
class Refinement:
    """What a refined posterior knows more than a weighted ensemble."""

    error_model: ErrorModel
    modes: PosteriorModes
    draws: ImportanceDraws
    leave_one_out: LeaveOneOut
    misfit: MisfitTest
    groups: GroupsLeftOut


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

    method: str  # glue: members of the ensemble weighed; refine: draws around the modes; surrogate: of a surrogate
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
    """Each experiment calibrated alone: its estimate of each parameter, and whether that is one value for all.

    Values and errors on the scale on which the prior is flat (log10 of a log-uniform one); NaN where the data constrain
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
class Surrogate:
    """Of a command: what a posterior by a surrogate rests on, and how far it is known.

    Errors are standard errors over realisations of what the surrogate does not know, the largest of any parameter.
    """

    runs: int  # of the command, with those that failed
    failed: int
    settled: int  # 1 if the errors were small enough, and stayed so when runs were added
    median_error: float  # of a median [standard deviations of the posterior]
    sd_error: float  # of a standard deviation, over itself [-]
    last_error: float  # of the surrogate at the last runs, root mean square [standard errors of the data]
    validation_low: float  # discharges at which measurements would test it [m3/s]; NaN if the case has any
    validation_high: float
    station_error: Annotated[np.ndarray, Stored(("station",), VALUE_UNIT)]  # of the surrogate, counted in the errors


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
    surrogate: Surrogate | None = None  # of a command, with `method: surrogate`

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
                phrase("members_in_posterior", sample.members, sample.failed, worth),
                "" if self.claimed else phrase("posterior_not_claimed", CLAIMED_FROM),
                *(
                    interval_in_short(name, marginals.median[name], low, high, sample.unit[name])
                    for name, (low, high) in ranges.items()
                ),
                phrase("errors_of_median", self.fit.used, errors),
            ],
        )

    def _repr_html_(self) -> str:
        marginals, unit = self.marginals, self.sample.unit
        ends = [LEVELS.index(0.025), LEVELS.index(0.975)]
        rows = [
            (
                name,
                f"{marginals.median[name]:.3g}",
                "{:.3g} to {:.3g}".format(*marginals.quantiles[name][ends]),
                unit[name],
            )
            for name in self.parameters
        ]
        heading, *lines = repr(self).split("\n")
        others = [line for line in lines if not line.strip().startswith(tuple(f"{name}: " for name in self.parameters))]
        return in_short_html("\n".join([heading, *others]), ("parameter", "median", "95 % range", "unit"), rows)
