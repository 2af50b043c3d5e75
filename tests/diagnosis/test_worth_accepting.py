"""What is accepted has to beat nothing on the case's own grid, and a field has to beat it clearly."""

from types import SimpleNamespace
from typing import Any

import pytest

from vegglue.diagnosis import diagnose
from vegglue.diagnosis.competition import Contender
from vegglue.diagnosis.conclusion import field_goes_first
from vegglue.diagnosis.findings import Findings
from vegglue.progress import silent

SEARCHED, FINE = 6.0, {"poor": 3.5, "weak": 5.0, "good": 7.5}  # ln B on the grid of the search, and on the case's own


@pytest.fixture
def on_own_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    """Evidence is what a base is called; the prior costs 4."""
    monkeypatch.setattr(diagnose, "centred", lambda _screening, _kind, refit: refit)
    monkeypatch.setattr(diagnose, "calibrated_with", lambda _base, refit: refit.further)
    monkeypatch.setattr(diagnose, "log_evidence", lambda base: {"before": 0.0, **FINE}[base.name])
    monkeypatch.setattr(diagnose, "chi2", lambda *_: 100.0)
    monkeypatch.setattr(diagnose, "location_found", lambda *_: SimpleNamespace())
    monkeypatch.setattr(diagnose, "step_found", lambda *_: SimpleNamespace(accepted="a", groups=()))


def followed(kind: str, end: str) -> Any:
    """What comes of one contender whose evidence on its own grid is FINE[end] - 4."""
    fitted = SimpleNamespace(chi2=90.0, point=None)
    further = SimpleNamespace(name=end, fitted=fitted)
    refit = SimpleNamespace(log_factor=SEARCHED, further=further, candidate=SimpleNamespace(name="a"))
    base = SimpleNamespace(name="before", noise=None, fitted=fitted)
    one = Contender(kind, "a", SEARCHED - 4.0, 0, refit)  # type: ignore[arg-type]
    return diagnose._branch(SimpleNamespace(base=base), [one], 0, Findings(), silent)  # type: ignore[arg-type]


@pytest.mark.parametrize(("kind", "end", "accepted"), [
    ("effect", "poor", False), ("effect", "weak", True), ("drag", "poor", False), ("drag", "weak", False),
    ("drag", "good", True),
])  # fmt: skip
def test_an_effect_has_to_beat_nothing_on_its_own_grid_and_a_place_by_ten_to_one(
    on_own_grid: None, kind: str, end: str, accepted: bool
) -> None:
    assert (followed(kind, end) is not None) == accepted


@pytest.mark.parametrize(("log_factor", "gained", "first"), [
    (3.7, 0.0, False), (1.8, -2.0, False), (6.0, 0.0, True), (30.0, 26.0, False), (30.0, 10.0, True),
])  # fmt: skip
def test_a_field_beats_the_rest_by_a_hundred_to_one(log_factor: float, gained: float, first: bool) -> None:
    """The first two were told on sites of the blind study on which nothing is hidden."""
    assert field_goes_first(log_factor, gained) == first
