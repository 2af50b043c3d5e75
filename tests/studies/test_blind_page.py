"""The page of the study: what counts as what, on records made by hand."""

from pathlib import Path
from typing import Any

import pytest
from blind_figures import interval
from blind_page import (
    caught,
    counts,
    covered,
    one_too_many,
    pair_printed,
    rightly_told_apart,
    set_size,
    told_apart,
    write_page,
    wrongly_named,
)
from scipy import stats


def record(group: str, verdict: str, *rivals: str, **changes: Any) -> dict[str, Any]:
    """The hidden effect is `eddies`; each rival is a group of its own."""
    chances = [0.6, 0.2, 0.15, 0.03][: len(rivals)]
    step = {"rivals": list(rivals), "chances": chances, "groups": [[name] for name in rivals]}
    steps = [{"accepted": rivals[0], **step}] if rivals else []
    inside = "eddies" in rivals
    mark = {
        "hidden": {"name": "eddies"}, "found": inside, "inside": inside, "named": rivals == ("eddies",),
        "amplitude": None, "away": None,
    }  # fmt: skip
    return {
        "key": f"{group}/0", "group": group, "hide": ["eddies"], "hidden": [{"name": "eddies"}], "marks": [mark],
        "verdict": verdict, "steps": steps, "set": list(rivals), "not_excluded": [], "alike": {}, "seconds": 3.0,
        "gain": 1e-4 if rivals else None, "signal": 6.0, "flagged": 0, "threshold": 3.17, "held_out": [0.02, 0.01],
    } | changes  # fmt: skip


NAMED = record("snr6", "identified", "eddies")
WRONG = record("snr6", "identified", "wind")
MANY = record("snr6", "cannot-tell", "wind", "eddies", "sun", "moon")
SILENT = record("snr6", "nothing-missing")
LEFT_OUT = {"key": "snr6/9", "group": "snr6", "hide": ["sun"], "left_out": "not visible"}


def test_what_counts_as_what() -> None:
    everything = [NAMED, WRONG, MANY, SILENT, LEFT_OUT]
    assert counts(everything, ["snr6"], caught) == (2, 4)
    assert counts(everything, ["snr6"], told_apart) == (2, 4)
    assert counts(everything, ["snr6"], wrongly_named) == (1, 4)
    assert counts(everything, ["snr3"], caught) == (0, 0)
    hiding = SILENT | {"not_excluded": [["sun"], ["eddies"]]}
    assert counts([*everything, hiding], ["snr6"], covered) == (3, 5), "not excluded where nothing stands out"
    false = SILENT | {"not_excluded": [["sun"], ["moon"]]}
    assert counts([hiding, false], ["snr6"], told_apart) == (2, 2)
    assert counts([hiding, false], ["snr6"], rightly_told_apart) == (1, 2)
    beside = record("snr6", "identified", "eddies", steps=[NAMED["steps"][0], WRONG["steps"][0]])
    assert counts([*everything, beside], ["snr6"], one_too_many) == (2, 5)
    assert counts([beside], ["snr6"], wrongly_named) == (0, 1)
    assert [set_size(one) for one in (NAMED, MANY, SILENT)] == [1, 4, 0]


def test_a_pair_counts_where_there_is_one() -> None:
    alike = {"alike": {"eddies": {"moon": 0.95, "sun": 0.91}}}
    assert pair_printed(NAMED) is None
    assert pair_printed(NAMED | alike) is False
    assert pair_printed(MANY | alike) is True
    assert pair_printed(WRONG | alike) is None, "missed, which counts elsewhere"


def test_an_interval_of_a_share() -> None:
    low, high = interval(14, 200)
    assert stats.binom.sf(13, 200, low) == pytest.approx(0.025, rel=1e-6)
    assert stats.binom.cdf(14, 200, high) == pytest.approx(0.025, rel=1e-6)
    assert interval(0, 20)[0] == 0.0
    assert interval(20, 20)[1] == 1.0


def test_the_page(tmp_path: Path) -> None:
    studies = {"twin": [NAMED, WRONG, MANY, SILENT, LEFT_OUT], "campaign": [NAMED]}
    write_page(studies, {0.95: (0.96, 0.381), 0.9: (0.93, 0.532)}, tmp_path)
    page = (tmp_path / "blind.md").read_text(encoding="utf-8")
    assert "Measured on 4 small twins" in page
    assert "| Hidden effect in the set, ratio 6 | 2 | 4 | 50.0% |" in page
    assert "| Hidden effect in the set, ratio 6 | 1 | 1 | 100.0% |" in page.partition("## A sample")[2]
    assert "| 50% to 75% | 60% | 3 | 1 | 33% |" in page, "three names told at 60 %, one of them true"
    assert "three groups in 38% of such data" in page
    assert "`sun`" in page
    for name in ("alarms", "ratio", "sizes", "gains", "sets"):
        assert f"blind-{name}.svg" in page
        assert (tmp_path / f"blind-{name}.svg").stat().st_size > 1000
