"""ModelScores of an error ladder that tests share: small, with what could not be held out."""

import numpy as np

from vegglue.measurements.kinds import KINDS
from vegglue.results.loop_results import HeldOut, InSample, ModelScore, PredictiveScores


def a_model_score(name: str, validation: float = np.nan) -> ModelScore:
    """Three parameters; held-out errors of 0.03 and 0.04 m/s at its two velocities."""
    rmse = dict.fromkeys(KINDS, np.nan) | {"velocity": 0.021, "level": 0.002}
    held_out = HeldOut(
        np.array([0.03, 0.04]), np.full(2, np.nan), np.array([True, True]), (("June", "A"), ("June", "B"))
    )
    values = {name: (value - 0.1, value, value + 0.1) for name, value in (("n_b", 1.0), ("phi", 0.9), ("k_s", 1.1))}
    seen, scores = InSample(rmse, 8.0, 2, 0.01), PredictiveScores(1.0, 0.5, 0.95)
    return ModelScore(name, "", (), values, seen, held_out, scores, {"phi": 0.4}, validation)
