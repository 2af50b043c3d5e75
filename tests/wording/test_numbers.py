"""How values show themselves in a notebook: a few lines, with units and the sentence that matters."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from diagnoses import NOTHING, a_diagnosis
from model_scores import a_model_score
from posteriors import a_posterior
from reach import write_reach
from stored import ALL, a_header, write_chunks

from vegglue.case.config import load_case
from vegglue.cli.printed import show_ladder
from vegglue.diagnosis.comparison import MEASUREMENT
from vegglue.flow.status import FAILED
from vegglue.measurements.kinds import errors_in_short
from vegglue.results.loop_results import (
    ComparedModel,
    HiddenEffect,
    ModelComparison,
    ProposedMeasurement,
    Question,
    RivalEffects,
)
from vegglue.results.result_files import read_ensemble
from vegglue.wording.numbers import (
    duration_in_short,
    in_digits,
    in_short,
    interval_in_short,
    range_in_digits,
    section_in_words,
    so_many,
)
from vegglue.workflow.compare import Comparison
from vegglue.workflow.extend import StepwiseExtension

MOST_LETTERS = 600


def test_building_blocks() -> None:
    assert in_short("heading", ["one", "", "two"]) == "heading\n  one\n  two"
    assert (so_many(1, "patch", "patches"), so_many(2000, "patch", "patches")) == ("1 patch", "2,000 patches")
    assert interval_in_short("phi", 8.123, 7.0, 9.35, "-") == "phi: 8.12, 95 % 7 to 9.35"
    assert interval_in_short("k_s", 0.5, 0.4, 0.6, "m").endswith("0.6 m")
    assert interval_in_short("outlet", 102.368, 102.346, 102.391, "m") == "outlet: 102.37, 95 % 102.35 to 102.39 m"
    assert errors_in_short({"level": 0.0021, "velocity": np.nan}) == "level 0.0021 m"


def test_a_case_says_what_it_holds(tmp_path: Path) -> None:
    case = load_case(write_reach(tmp_path))
    assert repr(case) == str(case)
    parts = (case.name, case.title, *case.experiments, "n_b [s m^(-1/3)]", "velocities.csv", "1,024", "brook.yaml")
    assert all(part in repr(case) for part in parts)


def test_an_ensemble_counts_its_members(tmp_path: Path) -> None:
    write_chunks(tmp_path / "ensemble.h5", ALL, a_header())
    found = read_ensemble(tmp_path / "ensemble.h5")
    first, *further = repr(found).splitlines()
    assert [int(count) for count in re.findall(r"\d+", first)] == [12, 4, 4, 4]
    assert any("1e-05" in line for line in further)
    nothing = replace(found, status=np.full(12, FAILED, np.int8), mass_error=np.full(12, np.nan))
    by_command = replace(nothing, config="name: brook\nengine:\n  command: own\n")
    assert ["Newton" in repr(one).splitlines()[0] for one in (nothing, by_command)] == [True, False]


@pytest.mark.parametrize(
    ("value", "digits", "told"),
    [
        (1523.0, 2, "1500"), (312.0, 1, "300"), (-1523.0, 3, "-1520"), (99_600.0, 2, "100000"),
        (123_456.0, 3, "1.23e+05"), (0.00123, 2, "0.0012"), (0.00965, 3, "0.00965"), (0.0, 3, "0"),
        (float("inf"), 3, "inf"), (float("nan"), 2, "nan"),
    ],
)  # fmt: skip
def test_sizes_that_people_read_are_written_in_full(value: float, digits: int, told: str) -> None:
    assert in_digits(value, digits) == told


def test_large_numbers_have_one_form_in_tables_and_sentences(capsys: pytest.CaptureFixture[str]) -> None:
    before, after = a_model_score("brook"), a_model_score("brook-wind")
    worse = replace(before, held_out=replace(before.held_out, sections=np.array([0.045, 0.065])))
    show_ladder(Comparison((worse, after), pd.DataFrame(columns=MEASUREMENT)))
    assert "60 ± 20 %" in capsys.readouterr().out, "it was 3e+01"
    assert interval_in_short("force", 1523.4, 1200.0, 1900.0, "N") == "force: 1520, 95 % 1200 to 1900 N"
    assert range_in_digits((1234.0, 5678.0)) == "1230 to 5680"


@pytest.mark.parametrize("found", [a_diagnosis(), NOTHING])
def test_a_diagnosis_says_its_sentence(found) -> None:
    shown = repr(found)
    assert shown.startswith(f"Diagnosis of open-x: {found.verdict.kind}\n  {found.verdict.sentence}\n")
    assert all(f"  {name}: 0.3, 95 % -inf to 0.333 m2/s" in shown for name in found.set)
    assert len(shown) < MOST_LETTERS


def test_a_comparison_is_a_line_for_each_model() -> None:
    nothing = pd.DataFrame(columns=MEASUREMENT)
    found = Comparison((a_model_score("brook"), a_model_score("brook-wind", 0.025)), nothing)
    _, first, second = repr(found).splitlines()
    assert "brook," in first
    assert "brook-wind," in second
    assert ("0.025" in first, "0.025" in second) == (False, True)
    aside = pd.DataFrame([["June", "velocity", "A", 1.0, 2.0, 0.5]], columns=MEASUREMENT)
    assert len(repr(Comparison(found.model_scores, aside)).splitlines()) == 4
    cases = tuple(SimpleNamespace(name=one.name) for one in found.model_scores)
    models, *reasons = repr(StepwiseExtension(cases, found, "Missing: wind.", "Added: wind.")).splitlines()[:3]
    assert models.endswith("brook -> brook-wind")
    assert reasons == ["  Missing: wind.", "  Added: wind."]


def test_a_question_names_its_best_measurements() -> None:
    best = ProposedMeasurement("section 0", "June", 1.0, 3, 1.5, 2.0, 9.0)
    about = RivalEffects(("wind", "waves"))
    _, *named = repr(Question(about, tuple(replace(best, name=f"section {n}") for n in range(6)))).splitlines()
    assert [line.split(":")[0] for line in named] == [f"- section {n}" for n in range(4)]
    for other in ((replace(best, then=2.1),), (replace(best, now=9.0, then=9.1),), ()):
        assert Question(about, other).useful == ()
        assert len(repr(Question(about, other)).splitlines()) == 1


MARKUP = "<script>alert(1)</script>"


def shown_in_a_notebook(folder: Path) -> list[object]:
    write_chunks(folder / "ensemble.h5", ALL, a_header())
    posterior, step = (
        a_posterior(canopy=False),
        ComparedModel(MARKUP, "a.yaml", "", (), 4, 0.02, 0.03, float("nan"), 0.04, 0.01),
    )
    scores = Comparison((a_model_score(MARKUP),), pd.DataFrame(columns=MEASUREMENT))
    odd = replace(posterior, sample=replace(posterior.sample, unit=dict.fromkeys(posterior.parameters, MARKUP)))
    ensemble = replace(read_ensemble(folder / "ensemble.h5"), version=MARKUP)
    return [ensemble, odd, replace(a_diagnosis(), name=MARKUP), ModelComparison((step,), 0, ""), scores]


def test_a_notebook_shows_values_short_escaped_and_without_scripts(tmp_path: Path) -> None:
    for value in shown_in_a_notebook(tmp_path):
        page = value._repr_html_()  # type: ignore[attr-defined]
        assert "<script" not in page, type(value)
        assert "&lt;script&gt;" in page, type(value)
        assert len(page) < 4 * MOST_LETTERS, type(value)
        assert not re.search(r"[\x00-\x1f]", page)
        open_tags, closed = re.findall(r"<([a-z]+)>", page), re.findall(r"</([a-z]+)>", page)
        assert sorted(open_tags) == sorted(closed)


@pytest.mark.parametrize(("now", "answered"), [(12.0, False), (26.0, True)])
def test_what_these_data_would_have_shown_is_answered(now: float, answered: bool) -> None:
    """Field work was ranked for what a diagnosis had looked for and not seen."""
    section = ProposedMeasurement("section 0", "June", 1.0, 3, 1.5, now, 60.0)
    hidden = Question(HiddenEffect("bed_trend", "n_b"), (section,), 25.0)
    assert (hidden.answered, hidden.useful) == (answered, () if answered else (section,))
    assert len(repr(hidden).splitlines()) == (1 if answered else 2)


def test_a_time_is_told_in_the_unit_that_it_is_twice() -> None:
    """A terminal told minutes from 90 s on, a page from 120 s on."""
    told = [duration_in_short(seconds) for seconds in (0.4, 119.0, 120.0, 7199.0, 7200.0, 9000.0)]
    assert told == ["0 s", "119 s", "2 min", "120 min", "2.0 h", "2.5 h"]


def test_a_section_named_after_its_place_is_told_once() -> None:
    assert section_in_words("D3", 42.004) == "D3, x = 42 m"
    assert section_in_words("x45.00", 45.0) == "x = 45 m"
    assert section_in_words("x+0.50", 0.5) == "x = 0.5 m"
    assert section_in_words("x1", 3.0) == "x1, x = 3 m"
