"""What is said of effects along a channel of which a small part was measured."""

import pandas as pd
import pytest
from linear_baseline import CASE_OF_TWINS
from verdicts import inputs, said, step

from vegglue.case.schema import Case, EffectEntry
from vegglue.diagnosis.measured_stretch import stretch_in_words

WEST, EAST = CASE_OF_TWINS.grid.x
LENGTH = EAST - WEST


def station(*shares: float, used: bool = True) -> pd.DataFrame:
    """Velocities at shares of the channel, and a gauge at each of its ends."""
    x = [WEST + share * LENGTH for share in shares]
    kinds = ["velocity"] * len(x) + ["level"] * 2
    return pd.DataFrame({"kind": kinds, "x": [*x, WEST, EAST], "used": [used] * len(x) + [True] * 2})


def with_effects(*names: str) -> Case:
    return CASE_OF_TWINS.model_copy(update={"effects": {name: EffectEntry(values={}) for name in names}})


@pytest.mark.parametrize(
    ("shares", "effects", "told"),
    [
        ((0.3, 0.5), ("streamlining",), True),
        ((0.3, 0.5), ("bank_vegetation", "secondary_current"), True),
        ((0.3, 0.5), ("discharge_error", "streamlining"), True),
        ((0.3,), ("streamlining",), True),
        ((0.3, 0.85), ("streamlining",), False),  # more than half of the channel
        ((0.3, 0.5), ("discharge_error",), False),  # acts at an end
        ((0.3, 0.5), ("unlisted_object",), False),  # at a place of its own
        ((0.3, 0.5), (), False),
        ((), ("streamlining",), False),
    ],
)
def test_what_was_measured_is_told_where_it_is_a_part(
    shares: tuple[float, ...], effects: tuple[str, ...], told: bool
) -> None:
    words = stretch_in_words(with_effects(*effects), station(*shares))
    assert bool(words) is told
    if told:
        assert f"x = {WEST + shares[0] * LENGTH:g} to {WEST + shares[-1] * LENGTH:g} m" in words
        assert "discharge_error" not in words
        assert (" are the same" in words) is (effects == ("bank_vegetation", "secondary_current"))


def test_readings_that_are_not_used_do_not_count() -> None:
    assert not stretch_in_words(with_effects("streamlining"), station(0.3, used=False))


def test_the_verdict_remarks_on_it() -> None:
    words = "Velocities were measured from x = 36 to 50 m only."
    assert words in said(inputs(step("wind"), stretch=words))[2]
    assert "Velocities" not in said(inputs(step("wind")))[2]
