"""What the study of laws counts as right, and its page."""

from pathlib import Path
from typing import Any

import pytest
from law_answers import has_quantity, is_silent, law_says_term, near_truth, quantity_alone, says_term
from law_limits import WAYS, likeliest_quantity
from law_page import BEGIN, END, write_law_page

SPEED = {"term": "floor", "quantity": "speed", "form": "step", "chance": 0.6, "same_as": ""}
DEPTH = SPEED | {"quantity": "depth", "chance": 0.2}


def record(*laws: dict[str, Any], others: dict[str, float] | None = None, **fields: Any) -> dict[str, Any]:
    """Of a set in which friction of the floor has a threshold in the speed; fields: to be changed."""
    return {
        "key": "law/0", "group": "law", "hide": "hidden_floor_speed_threshold", "hidden": {"signal": 8.0},
        "best": "law" if laws else "", "laws": list(laws), "others": others or {}, "seconds": 9.0,
        "held_out": {"before": 0.02, "after": 0.012 if laws else None, "truth": 0.010},
    } | fields  # fmt: skip


def test_a_law_is_right_by_its_term_and_quantity() -> None:
    assert [is_so(record(SPEED)) for is_so in (says_term, has_quantity, quantity_alone)] == [True] * 3
    beside = record(SPEED, DEPTH)
    assert [is_so(beside) for is_so in (says_term, has_quantity, quantity_alone)] == [True, True, False]
    wrong = record(SPEED | {"term": "bank"})
    assert [is_so(wrong) for is_so in (says_term, has_quantity, quantity_alone)] == [False] * 3
    assert not any(is_so(record()) for is_so in (says_term, has_quantity, quantity_alone))


def test_a_listed_effect_that_says_the_same_is_right_and_no_law() -> None:
    listed = record(others={"depth_dependent_bed": 0.9}, hide="hidden_floor_depth_hump")
    assert says_term(listed)
    assert has_quantity(listed)
    assert not law_says_term(listed)
    assert is_silent(listed)
    assert not says_term(record(others={"position": 0.9}))
    assert says_term(record(others={"patch_density[p1]": 0.9}, hide="hidden_plants_speed_threshold"))


def test_chances_are_judged_by_quantity() -> None:
    two_forms = record(SPEED, SPEED | {"form": "ramp", "chance": 0.1}, DEPTH, others={"position": 0.1})
    assert likeliest_quantity(two_forms) == (pytest.approx(0.7), True)
    assert likeliest_quantity(record()) is None
    assert likeliest_quantity(record(SPEED | {"term": "bank"})) == (pytest.approx(1.0), False)


def test_a_combination_is_right_with_either_quantity() -> None:
    assert has_quantity(record(SPEED | {"quantity": "along"}, hide="hidden_floor_offset_square_along"))


def test_predictions_are_those_of_what_was_written() -> None:
    assert near_truth(record(SPEED)) is True
    assert near_truth(record()) is False, "as it was: twice the error"
    assert near_truth(record(), probe=0.1) is True
    assert near_truth(record(held_out={"before": 0.02, "after": None, "truth": None})) is None


def test_the_page_has_shares_with_their_intervals(tmp_path: Path) -> None:
    listed = record(
        group="listed", hide="bank_trend", others={"bank_trend": 0.8}, key="listed/0",
        without=record(SPEED), held_out_without=record(SPEED)["held_out"],
    )  # fmt: skip
    nothing = record(group="nothing", hide="", hidden=None, key="nothing/0")
    left_out = {"key": "law/1", "group": "law", "hide": "x", "left_out": "never as visible as asked"}
    shares = {"in set": 1.0, "alone": 0.5}
    angles = [{"hide": "hidden_floor_speed_threshold"} | dict.fromkeys(WAYS, shares)]
    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n", encoding="utf-8")
    write_law_page([record(SPEED), listed, nothing, left_out], angles, page)
    text = page.read_text(encoding="utf-8")
    assert (text[:6], text[-6:], "old" in text) == ("before", "after\n", False)
    assert "3 data sets (1 with a law, 1 with nothing, 1 with a listed effect)" in text
    assert "changes the right term | at least 80 % | 1 | 100 % | 2 to 100 % | too few |" in text
    assert "| 95 to 100 % | 1 | 100 % | 100 % |" in text
    assert f"100 % and 50 % {WAYS['as it is']}" in " ".join(text.split())


@pytest.mark.parametrize("best", ["", "law_bank_speed_step"])
def test_silence_is_no_law_written(best: str) -> None:
    assert is_silent(record(best=best)) is not bool(best)
