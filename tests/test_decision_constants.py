"""The constants that decide: each is described, and other values hold only as long as a study asks for them."""

from dataclasses import replace

import numpy as np
from described_constants import described

from vegglue.decision_constants import CHOSEN, constants, using
from vegglue.diagnosis.odds import tempered_probabilities


def test_each_constant_has_a_unit_a_provenance_and_a_basis() -> None:
    found = described()
    assert len({one.name for one in found}) == len(found)
    for one in found:
        assert one.unit, one.name
        assert one.basis, one.name
        assert not one.near_one or 0.5 < one.value < 1.0, one.name
    assert any(one.provenance is not CHOSEN for one in found)


def test_other_constants_hold_within_a_block_only() -> None:
    evidence = np.array([40.0, 38.0])
    before = tempered_probabilities(evidence)
    with using(replace(constants(), fingerprint_error=0.0)):
        np.testing.assert_allclose(tempered_probabilities(evidence), np.exp([0.0, -2.0]) / (1.0 + np.exp(-2.0)))
    np.testing.assert_array_equal(tempered_probabilities(evidence), before)
