"""How often errors alone sound the alarms of a diagnosis: that of everything listed, and that of laws.

    python tests/studies/law_alarms.py [--draws N] [--whole] [--products]

The model of the short channel as an import writes it, calibrated to its own predictions at true places of the prior.
Errors of the data are drawn, or all that the noise allows, and the model is calibrated to them to first order:
screening needs no further flow. With --products a law of the grammar is true and in the model, and the alarm is that of
its products with other quantities.
"""

import argparse
from dataclasses import dataclass, replace

import numpy as np
from blind_lines import interval
from blind_sets import PLACES, place_of

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, baseline
from vegglue.calibration.candidates import with_effect
from vegglue.calibration.law_screening import law_fingerprints, screen_laws, screen_products
from vegglue.calibration.noise import noise_of
from vegglue.calibration.residual_screening import screen
from vegglue.calibration.score_test import alarm_p
from vegglue.decision_constants import constants
from vegglue.engine.interface import Point, linearise
from vegglue.parallel import at_most

# Laws that are true in turn at the true places, where the alarm of products is asked for: of each term and many forms.
TRUE_LAWS = (
    "law_viscosity_offset_step", "law_floor_offset_ramp", "law_bank_depth_hump", "law_floor_along_part",
    "law_plants_speed_power", "law_viscosity_speed_ramp", "law_bank_along_stretch",
)  # fmt: skip


@dataclass(frozen=True)
class AlarmsDrawn:
    """p of everything listed, and p of laws, in each draw (draws,) [-]."""

    listed: Array
    laws: Array

    @property
    def rates(self) -> list[tuple[str, int]]:
        """What was counted in words, and how often."""
        silent = self.listed >= constants().false_alarm_rate
        rate = constants().law_alarm_rate
        return [
            (f"alarm of everything listed, at {constants().false_alarm_rate:.0%}", int(np.sum(~silent))),
            (
                f"alarm of laws, at {constants().law_alarm_rate:.0%}",
                int(np.sum(self.laws < constants().law_alarm_rate)),
            ),
            ("alarm of laws where nothing listed sounds one", int(np.sum(silent & (self.laws < rate)))),
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


def product_alarms_drawn(place: int, draws: int, whole: bool = False) -> Array:
    """p of products and whether they are likelier than all else, (draws, 2), at one true place; a law is true."""
    ground, _ = place_of("twin", place)
    on_site = baseline(
        replace(ground.model, station=ground.model.station.assign(value=ground.here.prediction)), ground.here.z
    )
    known = law_fingerprints(on_site)
    law = next(one for one in known.laws if one.law.name == TRUE_LAWS[place % len(TRUE_LAWS)])
    shapes = law.candidate.settings()[len(law.candidate.settings()) // 2]
    model, z = replace(ground.model, case=with_effect(ground.model.case, law.candidate, shapes)), ground.here.z
    truth = linearise(model, np.append(z, 1.0))  # one plausible strength
    assert truth is not None
    base = baseline(replace(model, station=model.station.assign(value=truth.prediction)), truth.z)
    lower = (base.noise if whole else noise_of(model.station)).lower
    random, found = np.random.default_rng((place, 29)), []
    for _ in range(draws):
        one = moved(base, lower @ random.standard_normal(len(lower)))
        screening = screen_products(one, known.listed, law, shapes.get("reference"))
        assert screening is not None
        found.append((screening.p, screening.kind.total > max(screening.others, 0.0)))
    return np.array(found)


def _tell(words: str, count: int, draws: int) -> None:
    low, high = interval(count, draws)
    print(f"{words}: {count} of {draws} ({count / draws:.1%}; 95 %: {low:.1%} to {high:.1%})")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--whole", action="store_true", help="errors of the grid and of the model, too, as allowed")
    parser.add_argument("--draws", type=int, default=50, help="draws at each true place")
    parser.add_argument("--products", action="store_true", help="of products, where a law is true and in the model")
    given = parser.parse_args()
    if given.products:
        with at_most(1):
            p, likelier = np.vstack(
                [product_alarms_drawn(place, given.draws, given.whole) for place in range(PLACES)]
            ).T
        rate = constants().product_alarm_rate
        sounded = p < rate
        _tell(f"alarm of products, at {rate:.0%}", int(np.sum(sounded)), p.size)
        _tell("products likelier than all else, too", int(np.sum(sounded & (likelier > 0.0))), p.size)
        return
    with at_most(1):
        drawn = [alarms_drawn(place, given.draws, given.whole) for place in range(PLACES)]
    both = AlarmsDrawn(*(np.concatenate([getattr(one, name) for one in drawn]) for name in ("listed", "laws")))
    for words, count in both.rates:
        _tell(words, count, both.laws.size)


if __name__ == "__main__":
    main()
