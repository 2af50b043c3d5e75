"""What a diagnosis concludes from its first and its last screening, as the values it is kept and told in."""

from collections.abc import Mapping, Sequence

import numpy as np
import scipy.stats

from vegglue.calibration.fit import chi2, interval95
from vegglue.diagnosis.detection import FALSE_ALARMS_OF_EFFECTS, MOST_OUTLIERS, Detected, detected
from vegglue.diagnosis.misfit_zones import misfit_zones
from vegglue.diagnosis.suspects import not_excluded
from vegglue.diagnosis.verdict import judged
from vegglue.inference.likelihood import root_mean_square
from vegglue.results.diagnosis import (
    Diagnosis,
    DragLocation,
    DragMap,
    EstimatedErrors,
    FirstScreening,
    Misfit,
    ParameterEstimates,
    Predictions,
    Step,
    Suspect,
)
from vegglue.screening import score_test
from vegglue.screening.residual_screening import Screening
from vegglue.version import VERSION

# Effects whose likeness is kept, the strongest of the first screening.
COMPARED = 12
# Share of the squared fingerprint of a spot of drag above which an experiment is said to point at it.
POINTS_AT_IT = 0.1


def concluded(first: Screening, last: Screening, steps: Sequence[Step], suspects: Mapping[str, Suspect]) -> Diagnosis:
    """The diagnosis; steps: what was accepted between both screenings; suspects: of every effect by its name."""
    still = detected(last, steps)
    ranked = tuple(sorted(suspects.values(), key=lambda one: (not one.amplitude.refitted, -(one.test.score**2))))
    misfit, errors = _misfit(first, last), _errors(last)
    verdict = judged(
        errors,
        misfit,
        steps,
        ranked,
        location=_drag_location(last) if still == "drag" else None,
        not_excluded=not_excluded(last) if still == "nothing" and not steps else (),
        unexplained="" if steps else _unexplained(last, still),
    )
    base, before = last.base, first.base
    return Diagnosis(
        name=before.model.case.name,
        version=VERSION,
        verdict=verdict,
        suspects=ranked,
        steps=tuple(steps),
        misfit=misfit,
        errors=errors,
        first_screening=_first_screening(first),
        parameters=ParameterEstimates(
            {name: interval95(before.model, before.fitted, name)[0] for name in before.model.names},
            {name: interval95(base.model, base.fitted, name) for name in base.model.names},
        ),
        predictions=Predictions(
            station=before.model.station,
            first=before.fitted.point.prediction,
            last=base.fitted.point.prediction,
            error=base.noise.among_all(base.noise.data_error, len(base.model.station)),
        ),
        drag_map=_drag_map(last if still == "drag" else first),  # a location is found in what the steps leave
    )


def chance_of_misfit(misfit: float, freedom: int) -> float:
    """P(chi2_f >= chi2): the chance of a misfit as large under errors alone [-]; freedom: its degrees."""
    return float(scipy.stats.chi2.sf(misfit, max(freedom, 1)))


def _misfit(first: Screening, last: Screening) -> Misfit:
    before, after = first.base, last.base
    misfit = chi2(after.noise, after.fitted.point)
    freedom = after.noise.rows.size - after.fitted.point.z.size - len(last.flagged)
    return Misfit(
        chi2_first=chi2(before.noise, before.fitted.point),
        chi2=misfit,
        freedom=freedom,
        p=chance_of_misfit(misfit, freedom),
        zones=misfit_zones(before.model, before.noise, before.fitted.point),
    )


def _errors(screening: Screening) -> EstimatedErrors:
    noise = screening.base.noise
    flagged = tuple(int(noise.rows[row]) for row in screening.flagged)
    return EstimatedErrors(noise.correlation, noise.scale, root_mean_square(noise.grid_error), flagged)


def _first_screening(screening: Screening) -> FirstScreening:
    candidates, strongest = screening.fingerprints.candidates, screening.ranking[:COMPARED]
    columns = [screening.best_column(j) for j in strongest]
    return FirstScreening(
        threshold=screening.effects.threshold(FALSE_ALARMS_OF_EFFECTS),
        scores={one.name: screening.best_score(j) for j, one in enumerate(candidates)},
        compared=tuple(candidates[j].name for j in strongest),
        cosine=score_test.cosines(screening.projected)[np.ix_(columns, columns)],
    )


def _drag_location(screening: Screening) -> DragLocation:
    """Where the spot of drag lies that explains most."""
    family, spots, noise = screening.spots, screening.fingerprints.spots, screening.base.noise
    best = family.best
    drag = float(family.scores[best] / max(family.length[best], 1e-300))
    white = noise.whiten(noise.used(spots.fingerprints[:, best : best + 1]))[:, 0] ** 2
    names = screening.base.model.station["experiment"].to_numpy()[noise.rows]
    share = {str(name): float(white[names == name].sum() / white.sum()) for name in dict.fromkeys(names)}
    pointing = tuple(name for name, part in share.items() if part > POINTS_AT_IT)
    return DragLocation(float(spots.x[best]), float(spots.y[best]), pointing, drag, float(family.scores[best]))


def _drag_map(screening: Screening) -> DragMap:
    spots = screening.fingerprints.spots
    return DragMap(spots.x, spots.y, screening.spots.scores)


def _unexplained(screening: Screening, still: Detected) -> str:
    """What is detected although nothing came of it, '' if nothing is."""
    if still == "effect":
        strongest = screening.fingerprints.candidates[screening.ranking[0]].name
        return f"{strongest} stands out, but no calibrated flow with it fits better"
    return f"more than {MOST_OUTLIERS} stations stand alone" if still == "outlier" else ""
