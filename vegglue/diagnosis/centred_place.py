"""Something unlisted at a place, moved to the mean of all places where it may be.

    (x, y) = sum_j p_j (x_j, y_j),   var = sum_j p_j (x_j - x)^2,   p_j ~ exp(E_j),   E_j their evidence

The sums go over the spots of its term and length. Spots stand as far apart as they are long, and neighbours often fit
alike: the best of them is where errors put it, and the mean has the smaller expected error. Chances are not tempered as
in a competition: what the trace of an object is wrong by is much the same at two places side by side.
"""

import numpy as np
import scipy.special

from vegglue.arrays import Array
from vegglue.diagnosis.competition import tempering
from vegglue.diagnosis.refits import Refit, RefitTrial, refits_of, start_with
from vegglue.screening.candidates import place_candidate
from vegglue.screening.evidence import HypothesisKind
from vegglue.screening.places import Places
from vegglue.screening.residual_screening import Screening

# Lengths of spots are told to a centimetre.
ROUNDED = 0.01


def centred(screening: Screening, term: str, refit: Refit) -> Refit:
    """The refit of a term at a spot, or the same spot at the mean place where that explains nearly as much: less by a
    factor of e at most, tempered.
    """
    places, kind = places_and_kind(screening, term)
    x, y, *_ = mean_place(places, kind.log_evidence, refit.shapes["length"])
    shapes = {**refit.shapes, "x": round(x, 2), "y": round(y, 2)}
    candidate = place_candidate(refit.candidate.effect, shapes, places.plausible)
    search, amplitude = screening.search, candidate.amplitude
    z = refit.fitted.point.z[:-1]
    start = start_with(search.model.case, candidate, shapes, z, amplitude.gain(refit.amplitude))
    (moved,) = refits_of(search, [RefitTrial(candidate, shapes, (start,))])
    lost = np.inf if moved is None else refit.log_factor - moved.log_factor
    return moved if moved is not None and lost < tempering(np.array(refit.log_factor)) else refit


def places_and_kind(screening: Screening, term: str) -> tuple[Places, HypothesisKind]:
    """The spots of a term, and their evidence."""
    places = next(one for one in screening.fingerprints.places if one.term == term)
    return places, next(one for one in screening.kinds if one.name == term)


def mean_place(places: Places, log_evidence: Array, length: float) -> tuple[float, float, float, float]:
    """x, y and their standard deviations [m], see the head of this file; log_evidence (spot,), length [m]."""
    same = np.abs(places.length - length) < ROUNDED
    x, y, chance = places.x[same], places.y[same], scipy.special.softmax(log_evidence[same])
    middle_x, middle_y = float(chance @ x), float(chance @ y)
    variance = chance @ (x - middle_x) ** 2, chance @ (y - middle_y) ** 2
    return middle_x, middle_y, float(np.sqrt(variance[0])), float(np.sqrt(variance[1]))
