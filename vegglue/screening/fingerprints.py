"""What could be missing, as traces in the predictions at one point: of every candidate, and of drag at every place."""

from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, search_model
from vegglue.effects.definition import Amplitude
from vegglue.engine.interface import Point, responses
from vegglue.screening.candidates import Candidate, candidates_of, cause_of
from vegglue.screening.spatial_scan import Spots, spots_of
from vegglue.site.channel_geometry import half_width


@dataclass(frozen=True)
class Fingerprints:
    """prints (station, c): d prediction / d gain of candidates, [m/s or m] per unit of gain.

    columns: for each candidate, its columns among the prints; settings, amplitudes: those of each column.
    """

    point: Point
    candidates: list[Candidate]
    columns: list[np.ndarray]
    settings: list[dict[str, float]]
    amplitudes: list[Amplitude]
    prints: Array
    spots: Spots

    @property
    def one_sided(self) -> np.ndarray:
        """Which columns (c,) are of effects that can only grow from off."""
        return np.array([amplitude.low >= amplitude.off for amplitude in self.amplitudes], bool)

    def may_be(self, gains: Array, most: float) -> np.ndarray:
        """Whether the effect of each column may have a gain (c,), and its opposite, (2, c): see `Amplitude.may_be`."""
        pairs = list(zip(self.amplitudes, gains, strict=True))
        return np.array([[amplitude.may_be(sign * gain, most) for amplitude, gain in pairs] for sign in (1.0, -1.0)])


def fingerprints_of(base: Baseline) -> Fingerprints:
    """Those of the search model: they only have to point the right way. Spots are sized by the model itself."""
    search = search_model(base)
    model, point = search.model, search.point
    candidates = candidates_of(model.case, model.station)
    tried = [one.settings() for one in candidates]
    every = [(one, shapes) for one, settings in zip(candidates, tried, strict=True) for shapes in settings]
    return Fingerprints(
        point=point,
        candidates=candidates,
        columns=[np.arange(*ends) for ends in pairwise(accumulate(map(len, tried), initial=0))],
        settings=[shapes for _, shapes in every],
        amplitudes=[one.effect.amplitude for one, _ in every],
        prints=responses(model, point, [cause_of(model.case, one, shapes) for one, shapes in every]),
        spots=spots_of(model, point, half_width(base.model.site)),
    )
