"""An effect of one size leaves the same trace on the coarse cells of a search as on the cells of its case."""

import numpy as np
import pytest
from coarse_twin import CASE, coarse_twin

from vegglue.calibration.baseline import SearchModel
from vegglue.calibration.fingerprints import Fingerprints, fingerprints_of
from vegglue.calibration.noise import noise_of
from vegglue.case.channel_geometry import half_width
from vegglue.engine.interface import Model, linearise
from vegglue.engine.model import model_of
from vegglue.measurements.observations import read_observations

# Standard errors at a plausible size below which nobody looks at a trace.
UNSEEN = 0.01
# Length of a trace on coarse cells over that on the case's own. Shear is smoother there, least resolved in a layer of
# 0.3 m on cells of 0.375 m: half as long. A size that is
# counted in cells is off by 1.4 times where cells are wider, by twice or four times where they are longer as well.
SHORTEST, LONGEST = 0.4, 1.1


def traces(model: Model) -> Fingerprints:
    point = linearise(model, np.zeros(len(model.names)))
    assert point is not None
    return fingerprints_of(SearchModel(model, noise_of(model.station), point), half_width(model.site))


@pytest.fixture(scope="module")
def both() -> tuple[Fingerprints, Fingerprints]:
    coarse, _ = coarse_twin()
    return traces(model_of(CASE, read_observations(CASE))), traces(coarse)


def test_a_size_means_the_same_on_coarse_cells(both: tuple[Fingerprints, Fingerprints]) -> None:
    own, coarse = both
    assert own.settings == coarse.settings
    length, other = (np.linalg.norm(one.values, axis=0) for one in both)
    seen = length > UNSEEN
    share = other[seen] / length[seen]
    cosine = np.sum(own.values * coarse.values, axis=0)[seen] / (length * other)[seen]
    assert share.min() > SHORTEST
    assert share.max() < LONGEST
    assert cosine.min() > 0.9
