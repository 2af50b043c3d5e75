"""Small results as JSON in the folder of a run: rung.json, comparison.json and questions.json, each with the config
hash.

What belongs to another state of the case, or cannot be read, counts as not there.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

from vegglue.case.text_files import LARGEST_JSON, read_text, write_text
from vegglue.plain_json import plain
from vegglue.results.model_comparison import ModelComparison, ModelScore, comparison_from, model_score_from
from vegglue.results.open_questions import Question, questions_from
from vegglue.wording.remedies import MAKE_ROOM
from vegglue.wording.sentences import tagged

SCORE_FORMAT, COMPARISON_FORMAT, QUESTIONS_FORMAT = "vegglue rung 1", "vegglue comparison 3", "vegglue questions 4"
SCORE_FILE, COMPARISON_FILE, QUESTIONS_FILE = "rung.json", "comparison.json", "questions.json"
Kept = TypeVar("Kept")
# A measurement that is left out: where it stands, and its value.
MeasurementRow = Sequence[str | float]


def write_model_score(folder: Path, score: ModelScore, left_out: Sequence[MeasurementRow], config_hash: str) -> None:
    """Keep what a model misses, calibrated without some measurements. Errors: StorageError."""
    told = {"left_out": [*map(list, left_out)], "rung": asdict(score)}
    _write(folder / SCORE_FILE, SCORE_FORMAT, config_hash, told)


def model_score_that_fits(folder: Path, left_out: Sequence[MeasurementRow], config_hash: str) -> ModelScore | None:
    """What the model of exactly this config misses, without exactly these measurements; None where it is not kept."""

    def understand(told: Any) -> ModelScore | None:
        return model_score_from(told["rung"]) if told["left_out"] == [*map(list, left_out)] else None

    return _read_if_it_fits(folder / SCORE_FILE, SCORE_FORMAT, config_hash, understand)


def write_comparison(folder: Path, comparison: ModelComparison, config_hash: str) -> None:
    """Keep a comparison in the folder of one of its models, whose config hash is given. Errors: StorageError."""
    _write(folder / COMPARISON_FILE, COMPARISON_FORMAT, config_hash, asdict(comparison))


def comparison_that_fits(folder: Path, config_hash: str) -> ModelComparison | None:
    """The comparison kept there for exactly this config, None without."""
    return _read_if_it_fits(folder / COMPARISON_FILE, COMPARISON_FORMAT, config_hash, comparison_from)


def write_questions(folder: Path, questions: Sequence[Question], config_hash: str) -> None:
    """Keep what to measure next, which may be nothing. Errors: StorageError."""
    _write(folder / QUESTIONS_FILE, QUESTIONS_FORMAT, config_hash, tagged(tuple(questions)))


def questions_that_fit(folder: Path, config_hash: str) -> tuple[Question, ...] | None:
    """The questions kept there for exactly this config; None if none were asked, empty if nothing is left to ask."""
    return _read_if_it_fits(folder / QUESTIONS_FILE, QUESTIONS_FORMAT, config_hash, questions_from)


def _write(path: Path, file_format: str, config_hash: str, told: Any) -> None:
    tree = {"format": file_format, "config_hash": config_hash, "told": told}
    write_text(path, json.dumps(plain(tree), ensure_ascii=False, indent=1, allow_nan=False) + "\n", MAKE_ROOM)


def _read_if_it_fits(path: Path, file_format: str, config_hash: str, understand: Callable[[Any], Kept]) -> Kept | None:
    try:
        tree = json.loads(read_text(path, LARGEST_JSON))
        if (tree["format"], tree["config_hash"]) != (file_format, config_hash):
            return None
        return understand(tree["told"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        return None
