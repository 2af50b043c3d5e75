"""Detection: whether the residual points at an effect, at a spot of drag, at a single station, or at nothing."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from vegglue.calibration.fit import fit
from vegglue.calibration.noise import downweight_outliers
from vegglue.progress import Say
from vegglue.results.diagnosis import Step
from vegglue.screening.residual_screening import Screening, screen

Detected = Literal["effect", "drag", "outlier", "nothing"]
# Rates of false alarms: how often errors alone make some listed effect, or some spot of drag, be detected. 5 %
# together, as is usual; listed effects get most of it, as drag at any place is the vaguer answer.
FALSE_ALARMS_OF_EFFECTS, FALSE_ALARMS_OF_DRAG = 0.04, 0.01
# Chance under errors alone below which a station is an outlier.
FALSE_OUTLIERS = 0.01
# By how much rarer a false alarm must be once an effect was accepted.
STRICTER_LATER = 0.2
# Logarithm of the odds by which drag must beat every listed effect, or a single station both: 20 to 1, where strong
# evidence begins (Kass and Raftery 1995, doi:10.2307/2291091). From 1 to 6 only one station of open-b depends on it.
STRONG_EVIDENCE = 3.0
# Share of an accepted fingerprint, in standard errors, that the model may have put wrong and another effect then picks
# up: with the true effect in open-c and open-e 0.1 of their length was left along one other, at the waterline.
MISPLACED_SHARE = 0.1
# Stations that are rejected at most.
MOST_OUTLIERS = 6


def detected(screening: Screening, steps: Sequence[Step]) -> Detected:
    """What the residual points at most surely, by the family-wise p of its best score: see `family_wise_p`.

    steps: what was accepted before, of which scores may hold a remainder.
    """
    explained = sum(max(one.chi2_before - one.chi2_after, 0.0) for one in steps)
    remainder = MISPLACED_SHARE * float(np.sqrt(explained))
    families = screening.effects, screening.spots, screening.stations
    effect, drag, station = (family.log_p(remainder) for family in families)
    strictness = STRICTER_LATER if steps else 1.0
    if station < np.log(FALSE_OUTLIERS) and station < min(effect, drag) - STRONG_EVIDENCE:
        return "outlier"
    effect_stands_out = effect < np.log(strictness * FALSE_ALARMS_OF_EFFECTS)
    drag_stands_out = drag < np.log(strictness * FALSE_ALARMS_OF_DRAG)
    if drag_stands_out and (drag < effect - STRONG_EVIDENCE or not effect_stands_out):
        return "drag"
    return "effect" if effect_stands_out else "nothing"


def without_outliers(screening: Screening, steps: Sequence[Step], say: Say) -> Screening:
    """The screening once outliers are rejected: each counts for nothing, and the model is calibrated again."""
    while detected(screening, steps) == "outlier" and len(screening.flagged) < MOST_OUTLIERS:
        say("setting a station aside")
        station, base = screening.stations.best, screening.base
        noise = downweight_outliers(base.noise, np.array([station]))
        base = replace(base, noise=noise, fitted=fit(base.model, noise, base.fitted.point))
        screening = screen(base, (*screening.flagged, station), screening)
    return screening
