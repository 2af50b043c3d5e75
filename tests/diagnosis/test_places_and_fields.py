"""A field is so free that it has to beat all else clearly, and a place is measured by what it competed with."""

from types import SimpleNamespace
from typing import Any

import pytest

from vegglue.diagnosis import diagnose
from vegglue.diagnosis.competition import Contender
from vegglue.diagnosis.conclusion import field_goes_first
from vegglue.diagnosis.findings import Findings
from vegglue.progress import silent


@pytest.mark.parametrize(("log_factor", "gained", "first"), [
    (3.7, 0.0, False), (1.8, -2.0, False), (6.0, 0.0, True), (30.0, 26.0, False), (30.0, 10.0, True),
])  # fmt: skip
def test_a_field_beats_the_rest_by_a_hundred_to_one(log_factor: float, gained: float, first: bool) -> None:
    """The first two were told on sites of the blind study on which nothing is hidden."""
    assert field_goes_first(log_factor, gained) == first


@pytest.mark.parametrize(("kind", "gained"), [("effect", -6.0), ("bed", 10.0)])
def test_the_error_of_its_shape_takes_nothing_from_what_a_place_explained(
    monkeypatch: pytest.MonkeyPatch, kind: str, gained: float
) -> None:
    """As the bar of open-i: ln B 21 where it competed, 5 with the error of its shape in the covariance, -11 for its
    prior.
    """
    after = SimpleNamespace(fitted=SimpleNamespace(chi2=225.0), log_evidence=5.0)
    before = SimpleNamespace(fitted=SimpleNamespace(point=None), noise=None, log_evidence=0.0)
    monkeypatch.setattr(diagnose, "calibrated_with", lambda *_: after)
    monkeypatch.setattr(diagnose, "log_evidence", lambda base: base.log_evidence)
    monkeypatch.setattr(diagnose, "_without_error_of_shape", lambda *_: 21.0)
    monkeypatch.setattr(diagnose, "chi2", lambda *_: 287.0)
    monkeypatch.setattr(diagnose, "location_found", lambda *_: SimpleNamespace())
    monkeypatch.setattr(diagnose, "step_found", lambda *_: SimpleNamespace(accepted="a", groups=()))
    what: Any = SimpleNamespace(log_factor=21.0)
    screening: Any = SimpleNamespace(base=before)
    following = diagnose._branch(screening, [Contender(kind, "a", 10.0, 0, what)], 0, Findings(), silent)
    assert following is not None
    assert following.found.gained(0.0, 5.0) == pytest.approx(gained)
