"""What configs made of folders have in common: priors, tables of measurements, and the settings of a first look."""

import math
from typing import Any

from vegglue.case.resolved_config import Tree
from vegglue.wording.sentences import phrase

# One bed of Manning's law, whose coefficient is the parameter n_b.
MANNING_BED = {"law": "manning", "n": "n_b"}
# Spread of what is known of a wall by its material [-]: a quarter, as between glass and wood.
WALL_LOG_SD = 0.25
# By how much the model itself may be wrong everywhere: friction by some per cent, as between two codes with the same
# laws or one patch of stones and the next, the bed by what a levelled survey is off. Chosen before the sets that it is
# judged by; the diagnosis says how much of it is needed.
MODEL_ERROR: Tree = {"model_error": {"friction": 0.05, "bed": 0.01}}
# Error of each side of a polygon of plants [m]: a stand ends within a stem or two of where it was walked. Error of how
# far across a vertical stood [m]: a tape read to 0.1 m, which is 0.1 / 12^(1/2) m. Both chosen after river-a, whose
# exact polygons show no error; a site of straight patches and a stated channel was laid out, and has neither.
# Discharges and stems get no error here: a diagnosis names them. With the 2 % of a usual gauging, the smallest error
# of a discharge that is detected on river-a rises from 2.4 to 11 %; with 10 % of stems, that of a patch by a quarter.
POLYGON_SIDES, PLACE_OF_VERTICAL = 0.1, 0.03
# Name of the eddy viscosity among the parameters, and the factor by which one that nobody knows is off at one standard
# deviation: transverse mixing is 0.1 to 0.2 h u* in straight flumes and 0.3 to 0.9 h u* in streams (Fischer et al.
# 1979, Mixing in inland and coastal waters, chapter 5; not checked against it).
VISCOSITY, VISCOSITY_FACTOR = "eddy_viscosity", 2.0
# The same of a flume, whose floor was set with a level.
MODEL_ERROR_OF_FLUME: Tree = {"model_error": {"friction": 0.05, "bed": 0.001}}
# 32 members show what a case is like and where to begin; the posterior is drawn around the best of them. All errors
# are those stated with the data.
FIRST_LOOK: Tree = {"simulate": {"members": 32, "seed": 1}, "infer": {"sigma": "known"}, **MODEL_ERROR}


def normal_prior(mean: float, sd: float, unit: str, symbol: str, meaning: str, **cut: float) -> Tree:
    """N(mean, sd^2), cut at `low` and `high` if they are given; all in the unit."""
    return {"distribution": "normal", "mean": mean, "sd": sd, **cut, **_words(unit, symbol, meaning)}


def loguniform_prior(low: float, high: float, unit: str, symbol: str, meaning: str) -> Tree:
    """ln uniform between ln low and ln high; both in the unit."""
    return {"distribution": "loguniform", "low": low, "high": high, **_words(unit, symbol, meaning)}


def lognormal_prior(median: float, log_sd: float, unit: str, symbol: str, meaning: str) -> Tree:
    """ln N(ln median, log_sd^2); the median in the unit."""
    return {"distribution": "lognormal", "median": median, "log_sd": log_sd, **_words(unit, symbol, meaning)}


def bed_prior(low: float, high: float) -> Tree:
    """The prior of n_b of MANNING_BED [s m^(-1/3)]."""
    return loguniform_prior(low, high, "s m^(-1/3)", "n_b", phrase("meaning_of_parameter", "bed"))


def viscosity_prior(stated: float, factor: float) -> Tree:
    """The prior of an eddy viscosity [m2/s] that is known to within a factor."""
    meaning = phrase("meaning_of_parameter", "viscosity_within", factor)
    return lognormal_prior(stated, round(math.log(factor), 4), "m2/s", "ν", meaning)


def wall_prior(median: float) -> Tree:
    """The prior of n_w, Manning's n of side walls about as known [s m^(-1/3)]."""
    return lognormal_prior(median, WALL_LOG_SD, "s m^(-1/3)", "n_w", phrase("meaning_of_parameter", "walls"))


def observed(kind: str, file: str, experiment: str | None = None) -> Tree:
    """A table of measurements of one kind; of one experiment, or of those that it names itself."""
    return {"kind": kind, "file": file} | ({} if experiment is None else {"experiment": experiment})


def validated(experiments: dict[str, Tree], observations: list[Tree]) -> Tree:
    """Measurements that no calibration sees, and the experiments they were made in."""
    return {"validation": {"experiments": experiments, "observations": observations}}


def even(cells: float) -> int:
    """The nearest even number of cells, so that a grid can be halved."""
    return 2 * round(cells / 2)


def _words(unit: str, symbol: str, meaning: str) -> dict[str, Any]:
    return {"unit": unit, "symbol": symbol, "meaning": meaning}
