"""rung, comparison and questions.json: read back as they were, and not where they belong to another state."""

import json
import math
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from rungs import a_rung

from vegglue.results.kept_words import (
    COMPARISON_FILE,
    QUESTIONS_FILE,
    RUNG_FILE,
    ladder_that_fits,
    questions_that_fit,
    rung_that_fits,
    write_ladder,
    write_questions,
    write_rung,
)
from vegglue.results.ladder import Ladder, LadderStep
from vegglue.results.open_questions import ProposedMeasurement, Question

HASH, OTHER = "a" * 64, "b" * 64
STEP = LadderStep("brook", "brook.yaml", HASH, ("Größe",), 4, 0.011, 0.02, 0.03, 0.04, 0.012)
LADDER = Ladder((STEP,), 2, "Added: eddies.", "Missing: eddies.", ("eddies",))
ASIDE = [("June", "velocity", "Größe", 1.0, 0.1 + 0.2, 0.5)]
GAUGE = (ProposedMeasurement("a gauge", "June", 5.0, 1, 0.5, 0.2, 9.0),)
QUESTIONS = (Question("eddies from wind", GAUGE), Question("eddies from a change of n_b", GAUGE, 25.0))


def test_what_is_kept_is_read_back(tmp_path: Path) -> None:
    write_ladder(tmp_path, LADDER, HASH)
    write_questions(tmp_path, QUESTIONS, HASH)
    assert ladder_that_fits(tmp_path, HASH) == LADDER
    assert questions_that_fit(tmp_path, HASH) == QUESTIONS


def test_a_rung_is_read_back_to_the_last_digit(tmp_path: Path) -> None:
    rung = a_rung("brook", 1 / 3)
    write_rung(tmp_path, rung, ASIDE, HASH)
    json.loads((tmp_path / RUNG_FILE).read_text(encoding="utf-8"), parse_constant=pytest.fail)
    found = rung_that_fits(tmp_path, ASIDE, HASH)
    assert found is not None
    np.testing.assert_equal(asdict(found), asdict(rung))
    assert rung_that_fits(tmp_path, [], HASH) is None
    assert rung_that_fits(tmp_path, ASIDE, OTHER) is None


@pytest.mark.parametrize("damage", ['"rmse": {', '"values": {', '"clusters": [', '"velocity": ['])
def test_a_damaged_rung_counts_as_not_there(tmp_path: Path, damage: str) -> None:
    write_rung(tmp_path, a_rung("brook"), ASIDE, HASH)
    whole = (tmp_path / RUNG_FILE).read_text(encoding="utf-8")
    (tmp_path / RUNG_FILE).write_text(whole.replace(damage, f'{damage[:-1]}3, "there": {damage[-1]}', 1), "utf-8")
    assert rung_that_fits(tmp_path, ASIDE, HASH) is None


def test_what_is_no_number_is_null_in_the_file(tmp_path: Path) -> None:
    unknown = LadderStep("brook", "brook.yaml", HASH, (), 4, 0.011, math.nan, 0.03, math.nan, 0.012)
    write_ladder(tmp_path, Ladder((unknown,), 0, ""), HASH)
    told = json.loads((tmp_path / COMPARISON_FILE).read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert told["told"]["steps"][0]["unseen"] is None
    found = ladder_that_fits(tmp_path, HASH)
    assert found is not None
    assert math.isnan(found.steps[0].unseen)
    assert math.isnan(found.steps[0].held_out_sections)


def test_nothing_left_to_ask_is_not_the_same_as_nobody_asked(tmp_path: Path) -> None:
    assert questions_that_fit(tmp_path, HASH) is None
    write_questions(tmp_path, (), HASH)
    assert questions_that_fit(tmp_path, HASH) == ()


@pytest.mark.parametrize("broken", ["", "{", "[]", '{"format": "vegglue comparison 0", "config_hash": "a"}', "null"])
def test_what_does_not_fit_counts_as_not_there(tmp_path: Path, broken: str) -> None:
    write_ladder(tmp_path, LADDER, HASH)
    write_questions(tmp_path, QUESTIONS, HASH)
    assert ladder_that_fits(tmp_path, OTHER) is None
    assert questions_that_fit(tmp_path, OTHER) is None
    write_rung(tmp_path, a_rung("brook"), ASIDE, HASH)
    for name in (RUNG_FILE, COMPARISON_FILE, QUESTIONS_FILE):
        (tmp_path / name).write_text(broken, encoding="utf-8")
    assert ladder_that_fits(tmp_path, HASH) is None
    assert questions_that_fit(tmp_path, HASH) is None
    assert rung_that_fits(tmp_path, ASIDE, HASH) is None
