"""Effects on what stands in the water: plant drag phi [-] and canopy height h_d [m] of each vegetated cell."""

import numpy as np

from vegglue.effect import Amplitude, Array, Effect, Shape, Stand


def streamlining(stand: Stand, vogel_exponent: Array, reference_speed: Array) -> dict[str, Array]:
    """phi -> phi (|U| / U_0)^chi, |U| at least 0.02 m/s."""
    return {"phi": stand.phi * (np.maximum(stand.speed, 0.02) / reference_speed) ** vogel_exponent}


EFFECTS = (
    Effect(
        name="streamlining",
        stage="plants",
        title="Plants bend and streamline: drag grows slower than the square of speed",
        equation="phi -> phi (|U| / U_0)^chi",
        act=streamlining,
        amplitude=Amplitude("vogel_exponent", "-", "Vogel exponent chi, 0 for rigid plants", 0.5, -2.0, 1.0),
        shapes=(Shape("reference_speed", "m/s", "speed U_0 at which phi holds", 0.35, 0.05, 2.0),),
        source="Vogel (1984); Järvelä (2004)",
        doi="10.1016/j.jhydrol.2003.10.018",
    ),
)
