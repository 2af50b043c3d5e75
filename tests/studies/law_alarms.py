"""How often errors alone sound the alarms of a diagnosis: that of everything listed, and that of laws.

    python tests/studies/law_alarms.py [--draws N] [--whole]

The model of the short channel as an import writes it, calibrated to its own predictions at true places of the prior.
Errors of the data are drawn, or all that the noise allows, and the model is calibrated to them to first order:
screening needs no further flow.
"""

import argparse
from dataclasses import dataclass, replace

import numpy as np
from blind_lines import interval
from blind_sets import PLACES, place_of

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, baseline
from vegglue.calibration.noise import noise_of
from vegglue.diagnosis.diagnose import FALSE_ALARMS
from vegglue.diagnosis.unlisted_laws import LAW_ALARMS
from vegglue.engine.interface import Point
from vegglue.parallel import at_most
from vegglue.screening.evidence import alarm_p
from vegglue.screening.law_screening import law_fingerprints, screen_laws
from vegglue.screening.residual_screening import screen


@dataclass(frozen=True)
class AlarmsDrawn:
    """p of everything listed, and p of laws, in each draw (draws,) [-]."""

    listed: Array
    laws: Array

    @property
    def rates(self) -> list[tuple[str, int]]:
        """What was counted in words, and how often."""
        silent = self.listed >= FALSE_ALARMS
        return [
            (f"alarm of everything listed, at {FALSE_ALARMS:.0%}", int(np.sum(~silent))),
            (f"alarm of laws, at {LAW_ALARMS:.0%}", int(np.sum(self.laws < LAW_ALARMS))),
            ("alarm of laws where nothing listed sounds one", int(np.sum(silent & (self.laws < LAW_ALARMS)))),
        ]


def moved(base: Baseline, errors: Array) -> Baseline:
    """The model calibrated to its own predictions with errors (n,) of the used stations, to first order."""
    point, noise = base.fitted.point, base.noise
    slope = noise.whiten(noise.used(point.slope))
    step = np.linalg.solve(slope.T @ slope + np.eye(point.z.size), slope.T @ noise.whiten(errors) - point.z)

    def there(one: Point) -> Point:
        return replace(one, z=one.z + step, prediction=one.prediction + one.slope @ step)

    assert base.on_coarse is not None
    return replace(
        base,
        noise=replace(noise, value=noise.used(point.prediction) + errors),
        fitted=replace(base.fitted, point=there(point)),
        on_coarse=there(base.on_coarse),
    )


def alarms_drawn(place: int, draws: int, whole: bool = False) -> AlarmsDrawn:
    """At one true place of the prior; whole: errors are drawn of the grid and of the model itself, too, as allowed."""
    ground, _ = place_of("twin", place)
    base = baseline(
        replace(ground.model, station=ground.model.station.assign(value=ground.here.prediction)), ground.here.z
    )
    random = np.random.default_rng((place, 17))
    lower = (base.noise if whole else noise_of(ground.model.station)).lower
    first = screen(base)
    traces = law_fingerprints(base, (), first.fingerprints)
    p = []
    for _ in range(draws):
        one = moved(base, lower @ random.standard_normal(len(lower)))
        listed = screen(one, (), first.fingerprints)
        p.append((alarm_p(listed.kinds, listed.errors, 1), screen_laws(one, traces).p))
    return AlarmsDrawn(*np.array(p).T)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--whole", action="store_true", help="errors of the grid and of the model, too, as allowed")
    parser.add_argument("--draws", type=int, default=50, help="draws at each true place")
    given = parser.parse_args()
    with at_most(1):
        drawn = [alarms_drawn(place, given.draws, given.whole) for place in range(PLACES)]
    both = AlarmsDrawn(*(np.concatenate([getattr(one, name) for one in drawn]) for name in ("listed", "laws")))
    for words, count in both.rates:
        low, high = interval(count, both.laws.size)
        print(f"{words}: {count} of {both.laws.size} ({count / both.laws.size:.1%}; 95 %: {low:.1%} to {high:.1%})")


if __name__ == "__main__":
    main()
