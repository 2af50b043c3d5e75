"""rung, comparison and questions.json: read back as they were, and not where they belong to another state."""

import json
import math
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from model_scores import a_model_score

from vegglue.results.loop_results import (
    COMPARISON_FILE,
    QUESTIONS_FILE,
    SCORE_FILE,
    ComparedModel,
    HiddenEffect,
    ModelComparison,
    ProposedMeasurement,
    Question,
    RivalEffects,
    comparison_that_fits,
    model_score_that_fits,
    questions_that_fit,
    write_comparison,
    write_model_score,
    write_questions,
)

HASH, OTHER = "a" * 64, "b" * 64
STEP = ComparedModel("brook", "brook.yaml", HASH, ("Größe",), 4, 0.011, 0.02, 0.03, 0.04, 0.012)
LADDER = ModelComparison((STEP,), 2, "Added: eddies.", "Missing: eddies.", ("eddies",))
ASIDE = [("June", "velocity", "Größe", 1.0, 0.1 + 0.2, 0.5)]
GAUGE = (ProposedMeasurement("a gauge", "June", 5.0, 1, 0.5, 0.2, 9.0),)
QUESTIONS = (Question(RivalEffects(("eddies", "wind")), GAUGE), Question(HiddenEffect("eddies", "n_b"), GAUGE, 25.0))


def test_what_is_kept_is_read_back(tmp_path: Path) -> None:
    write_comparison(tmp_path, LADDER, HASH)
    write_questions(tmp_path, QUESTIONS, HASH)
    assert comparison_that_fits(tmp_path, HASH) == LADDER
    assert questions_that_fit(tmp_path, HASH) == QUESTIONS


def test_a_rung_is_read_back_to_the_last_digit(tmp_path: Path) -> None:
    score = a_model_score("brook", 1 / 3)
    write_model_score(tmp_path, score, ASIDE, HASH)
    json.loads((tmp_path / SCORE_FILE).read_text(encoding="utf-8"), parse_constant=pytest.fail)
    found = model_score_that_fits(tmp_path, ASIDE, HASH)
    assert found is not None
    np.testing.assert_equal(asdict(found), asdict(score))
    assert model_score_that_fits(tmp_path, [], HASH) is None
    assert model_score_that_fits(tmp_path, ASIDE, OTHER) is None


@pytest.mark.parametrize("damage", ['"rmse": {', '"values": {', '"clusters": [', '"velocity": ['])
def test_a_damaged_rung_counts_as_not_there(tmp_path: Path, damage: str) -> None:
    write_model_score(tmp_path, a_model_score("brook"), ASIDE, HASH)
    whole = (tmp_path / SCORE_FILE).read_text(encoding="utf-8")
    (tmp_path / SCORE_FILE).write_text(whole.replace(damage, f'{damage[:-1]}3, "there": {damage[-1]}', 1), "utf-8")
    assert model_score_that_fits(tmp_path, ASIDE, HASH) is None


def test_what_is_no_number_is_null_in_the_file(tmp_path: Path) -> None:
    unknown = ComparedModel("brook", "brook.yaml", HASH, (), 4, 0.011, math.nan, 0.03, math.nan, 0.012)
    write_comparison(tmp_path, ModelComparison((unknown,), 0, ""), HASH)
    told = json.loads((tmp_path / COMPARISON_FILE).read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert told["told"]["steps"][0]["unseen"] is None
    found = comparison_that_fits(tmp_path, HASH)
    assert found is not None
    assert math.isnan(found.steps[0].unseen)
    assert math.isnan(found.steps[0].held_out_sections)


def test_nothing_left_to_ask_is_not_the_same_as_nobody_asked(tmp_path: Path) -> None:
    assert questions_that_fit(tmp_path, HASH) is None
    write_questions(tmp_path, (), HASH)
    assert questions_that_fit(tmp_path, HASH) == ()


@pytest.mark.parametrize("broken", ["", "{", "[]", '{"format": "vegglue comparison 0", "config_hash": "a"}', "null"])
def test_what_does_not_fit_counts_as_not_there(tmp_path: Path, broken: str) -> None:
    write_comparison(tmp_path, LADDER, HASH)
    write_questions(tmp_path, QUESTIONS, HASH)
    assert comparison_that_fits(tmp_path, OTHER) is None
    assert questions_that_fit(tmp_path, OTHER) is None
    write_model_score(tmp_path, a_model_score("brook"), ASIDE, HASH)
    for name in (SCORE_FILE, COMPARISON_FILE, QUESTIONS_FILE):
        (tmp_path / name).write_text(broken, encoding="utf-8")
    assert comparison_that_fits(tmp_path, HASH) is None
    assert questions_that_fit(tmp_path, HASH) is None
    assert model_score_that_fits(tmp_path, ASIDE, HASH) is None
