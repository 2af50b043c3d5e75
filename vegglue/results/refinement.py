"""How draws around the modes of a posterior were made, under which errors, and how well they predict unseen stations.

A mode is a set of parameters from which no small step improves the fit. Members are drawn in rounds, each of which uses
what the rounds before it found.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from vegglue.results.fitting import IN_WORDS, WHOLE_NUMBERS, YES_OR_NO
from vegglue.results.layout import Stored

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
