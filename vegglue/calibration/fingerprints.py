"""Fingerprints at one point: how predictions change with every candidate effect, and with a spot anywhere."""

from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import SearchModel
from vegglue.calibration.candidates import Candidate, candidates_of, cause_of
from vegglue.calibration.places import Places, places_of
from vegglue.effects.definition import Amplitude
from vegglue.engine.interface import Cause, Point, responses
from vegglue.errors import InputError


@dataclass(frozen=True)
class Fingerprints:
    """values (station, c): d prediction / d gain of candidates, [m/s or m] per unit of gain, one column per setting.

    columns: for each candidate, its columns; settings, amplitudes, causes: of each column (c,).
    """

    point: Point
    candidates: list[Candidate]
    columns: list[np.ndarray]
    settings: list[dict[str, float]]
    amplitudes: list[Amplitude]
    causes: list[Cause]
    values: Array
    places: tuple[Places, ...]

    @property
    def only_sign(self) -> np.ndarray:
        """The only sign that a gain of each column (c,) may have, 0 where it may have both."""
        return np.array([amplitude.only_sign for amplitude in self.amplitudes], dtype=int)

    def allowed(self, gains: Array, largest: float) -> np.ndarray:
        """Whether gains (c,), and their opposites, are allowed for each column, (2, c); see `Amplitude.allows`."""
        pairs = list(zip(self.amplitudes, gains, strict=True))
        return np.array([[amplitude.allows(sign * gain, largest) for amplitude, gain in pairs] for sign in (1.0, -1.0)])


def fingerprints_of(search: SearchModel, half_width: float) -> Fingerprints:
    """Fingerprints of the search model, exact enough for a direction; half_width: of the floor of the channel [m]."""
    model, point = search.model, search.point
    candidates = candidates_of(model.case, model.station)
    tried = [one.settings() for one in candidates]
    every = [(one, shapes) for one, settings in zip(candidates, tried, strict=True) for shapes in settings]
    causes = [cause_of(model.case, one, shapes) for one, shapes in every]
    values = responses(model, point, causes)
    for column in np.flatnonzero(~np.isfinite(values[model.station["used"].to_numpy(bool)]).all(axis=0)):
        raise InputError(f"The effect `{every[column][0].name}` gives what is no finite number; mend it.")
    return Fingerprints(
        point=point,
        candidates=candidates,
        columns=[np.arange(*ends) for ends in pairwise(accumulate(map(len, tried), initial=0))],
        settings=[shapes for _, shapes in every],
        amplitudes=[one.amplitude for one, _ in every],
        causes=causes,
        values=values,
        places=places_of(model, point, half_width),
    )
