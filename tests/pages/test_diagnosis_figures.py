"""Figures of a diagnosis and of the ladder: what is drawn is what was found, and nothing missing breaks them."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from diagnoses import EVERY_KIND, NOTHING, a_candidate_effect, a_diagnosis, an_effect_found
from drawings import off_the_sheet, points, texts
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.image import imread
from matplotlib.patches import Polygon
from matplotlib.transforms import Bbox

from vegglue.case.config import load_case
from vegglue.case.zones import corners_of
from vegglue.diagnosis.comparison import held_out_rmse, improvement
from vegglue.pages.diagnosis_figures import (
    MARKS,
    draw_alike,
    draw_candidates,
    draw_diagnosis,
    draw_fingerprint,
    draw_gauges,
    draw_zones,
    save_diagnosis_figure,
    save_fingerprint_figure,
)
from vegglue.pages.flow_maps import Outline
from vegglue.pages.headline import Headline, candidate_rows, candidate_status, diagnosis_section, rms_residual
from vegglue.pages.ladder_figure import LINES, draw_errors, draw_ladder, save_ladder_figure
from vegglue.pages.svg import COLOUR
from vegglue.results.causes import Step
from vegglue.results.diagnosis import Diagnosis, Predictions
from vegglue.results.loop_results import ComparedModel, HeldOut, InSample, ModelComparison, ModelScore, PredictiveScores
from vegglue.wording.sentences import phrase, sentence

pytestmark = pytest.mark.slow

CONFIGS = Path(__file__).parents[2] / "configs"
CANDIDATES = pd.DataFrame({
    "name": list("abcdef"), "status": list(MARKS), "first": [40.0, -30.0, 9.5, 9.0, 1.0, 0.5],
    "left": [np.nan, np.nan, 4.0, 1.5, 0.2, np.nan], "visibility": [0.9, 0.5, 0.5, 0.4, 0.3, 0.01],
})  # fmt: skip


def stations(**columns: object) -> pd.DataFrame:
    return a_diagnosis().predictions.table.assign(**columns)


def test_statuses_follow_the_verdict() -> None:
    found = a_diagnosis()
    statuses = {row.effect.name: row.status for row in candidate_rows(found)}
    assert list(statuses.items()) == [
        ("eddies", "accepted"), ("mixing[D3]", "rival"), ("turning", "no sign"), ("wind", "untestable"),
    ]  # fmt: skip
    louder = a_diagnosis(first_screening={"scores": found.first_screening.scores | {"turning": -9.0}})
    assert candidate_status(louder, "turning") == "less likely"


def test_what_is_significant_is_not_called_untestable() -> None:
    """A row said both "untestable" and p = 0.008: at a size that is not plausible these data showed it all the same."""
    beside = a_diagnosis(verdict={"significant_effects": {"wind": 0.008}})
    assert not beside.candidate_effect("wind").detectability.testable
    assert candidate_status(beside, "wind") == "significant"
    assert diagnosis_section(beside).untestable == 0


def test_errors_leave_out_what_does_not_count() -> None:
    found = a_diagnosis()
    station = found.predictions.station
    value = station["value"].to_numpy(float)
    off = np.array([0.03, 9.0, 9.0, 0.04, 0.0, 9.0])  # row 1 is flagged, 2 and 5 are levels
    assert rms_residual(found, value - off) == pytest.approx(np.sqrt((0.03**2 + 0.04**2) / 3))
    assert rms_residual(found, value - off, "level") == pytest.approx(9.0)
    assert np.isnan(rms_residual(a_diagnosis(predictions={"station": station.assign(used=False)}), value))


def test_rows_have_scores_before_and_after() -> None:
    rows = {row.effect.name: row for row in candidate_rows(a_diagnosis())}
    assert rows["turning"].scores == (-1.0, -1.0)
    assert rows["eddies"].scores == (45.2,), "refitted, not screened again"
    assert np.isnan(rows["eddies"].p), "its p is of another score than the last one"
    assert (rows["eddies"].probability, rows["wind"].probability) == (0.7, None)
    assert diagnosis_section(a_diagnosis()).excluded[0].measured == 0.5


def test_what_a_later_step_accepts_has_its_chance() -> None:
    second = Step("mixing[D3]", ("mixing[D3]",), (1.0,), (("mixing[D3]",),), 9.0, 1.0, 0.0)
    found = replace(a_diagnosis(), steps=(*a_diagnosis().steps, second))
    assert found.chances == {"eddies": 0.7, "mixing[D3]": 1.0}
    assert found.set == ["eddies", "mixing[D3]"]


def test_gauges_show_millimetres() -> None:
    table = stations(value=1.2, prediction=1.195, prediction_first=1.19)
    low = draw_gauges(table, "eddies").axes[0]
    assert {round(float(line.get_ydata()[0]), 6) for line in low.lines if line.get_marker() == "o"} == {5.0, 10.0}


@pytest.mark.parametrize("rows", [1, 3])
def test_zones_print_the_misfit_and_fill_by_its_sign(rows: int) -> None:
    zones = a_diagnosis().misfit.zones.head(rows)
    axes = draw_zones(zones).axes[0]
    assert texts(axes)[:2] == ["2.3", "+5.0"]  # sqrt(11 / 2) and 0.02 / 0.004
    faces = [to_hex(squares.get_facecolor()[0]) for squares in axes.collections if len(squares.get_facecolor())]
    assert faces[0] == COLOUR["measured"]


def test_suspects_differ_by_form_and_not_by_colour_alone() -> None:
    scores, visible = draw_candidates(CANDIDATES, 3.4).axes
    marks = {line.get_label(): line for line in scores.lines if line.get_label() in MARKS}
    forms = {name: (line.get_marker(), line.get_markerfacecolor() == COLOUR["paper"]) for name, line in marks.items()}
    assert set(forms) == set(MARKS)
    assert len(set(forms.values())) == len(forms)
    assert list(marks["rival"].get_xdata()) == [30.0]
    assert [bar.get_width() for bar in visible.patches] == list(CANDIDATES["visibility"])
    assert "f (untestable)" in [tick.get_text() for tick in scores.get_yticklabels()]
    assert any(list(line.get_xdata()) == [3.4, 3.4] for line in scores.lines)


def test_alike_effects_stand_together_in_a_frame() -> None:
    cosine = np.array([[1, 0.1, 0.95], [0.1, 1, -0.2], [0.95, -0.2, 1]])
    axes = draw_alike(["a", "b", "c"], cosine).axes[0]
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["a", "c", "b"]
    frames = [patch for patch in axes.patches if to_hex(patch.get_edgecolor()) == COLOUR["measured"]]
    assert [(frame.get_xy(), frame.get_width()) for frame in frames] == [((-0.5, -0.5), 2)]
    hollow = [patch for patch in axes.patches if patch.get_facecolor()[3] == 0 and patch not in frames]
    assert len(hollow) == 2  # b and c are opposed, seen from both


def test_fingerprint_draws_each_experiment_across_each_section() -> None:
    station = a_diagnosis().predictions.station
    trace = np.array([0.1, 0.2, 0.003, 0.3, 0.4, 0.004])
    section, gauges = draw_fingerprint(trace, station, "wind, speed 5 m/s").axes
    lines = [list(line.get_ydata()) for line in section.lines if line.get_marker() == "."]
    assert sorted(lines) == [[0.1, 0.2], [0.3, 0.4]]
    assert section.get_ylabel() == "change of u [m/s]"
    assert gauges.get_ylabel() == "change of level [m]"
    assert section.figure.get_suptitle() == "by wind, speed 5 m/s"


@pytest.mark.parametrize("kind", ["velocity", "level"])
def test_fingerprint_of_one_kind_of_measurement_is_a_file(tmp_path: Path, kind: str) -> None:
    station = a_diagnosis().predictions.station
    station = station[station["kind"] == kind]
    trace = np.zeros(len(station))
    save_fingerprint_figure(trace, station, "-", tmp_path / "figures" / "trace.png")
    assert (tmp_path / "figures" / "trace.png").read_bytes().startswith(b"\x89PNG")
    figure = draw_fingerprint(trace, station, "-")
    (axes,) = figure.axes
    along = "y" if kind == "velocity" else "x"
    assert sorted(points(axes, ".")) == sorted((float(place), 0.0) for place in station[along])
    assert axes.get_xlabel() == f"{along} [m]"
    assert axes.get_ylabel() == ("change of u [m/s]" if kind == "velocity" else "change of level [m]")
    low, high = axes.get_ylim()
    assert low < 0.0 < high, "nothing changes, and the line that says so is inside"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["low", "high"]
    assert off_the_sheet(figure) == []


def alone(found: Diagnosis) -> Diagnosis:
    """One experiment, one section, no gauges."""
    every = found.predictions
    kept = (every.station["experiment"] == "low") & (every.station["kind"] == "velocity")
    arrays = (array[kept.to_numpy()] for array in (every.first, every.last, every.error))
    few = Predictions(every.station[kept].reset_index(drop=True), *arrays)
    return replace(found, predictions=few, misfit=replace(found.misfit, zones=found.misfit.zones.head(1)))


def crowded() -> Diagnosis:
    """As much as a screen has to hold: 70 effects with long names, three steps and a long sentence, many zones."""
    names = [f"outlet_level_error[campaign {number}]" for number in range(70)]
    steps = tuple(Step(name, (name,), (1.0,), ((name,),), 2300.5, 248.1, 0.0) for name in names[:3])
    suspects = tuple(a_candidate_effect(name, test={"score": 40.0 / (1 + number)}) for number, name in enumerate(names))
    cosine = np.full((12, 12), 0.3) + 0.7 * np.eye(12)
    rows = [(experiment, f"D{number}", zone) for experiment in ("low", "mid", "high") for number in range(6)
            for zone in ("floor", "bank", "plants", "edge")]  # fmt: skip
    zones = pd.DataFrame(rows, columns=["experiment", "section", "zone"])
    zones = zones.assign(stations=3, mean=0.02, standard_error=0.004, chi2=np.linspace(1.0, 900.0, len(zones)))
    found = tuple(an_effect_found(name) for name in names[:6])
    return a_diagnosis(
        suspects, steps, verdict={"effects": found, "places": ()}, misfit={"zones": zones},
        first_screening={"scores": {}, "compared": tuple(names[:12]), "cosine": cosine},
    )  # fmt: skip


SCREENS = {
    "usual": a_diagnosis(), "nothing": NOTHING, "alone": alone(a_diagnosis()),
    "no location": replace(a_diagnosis(steps=(), verdict={"places": ()}), places=()), "every kind": EVERY_KIND,
}  # fmt: skip


@pytest.mark.parametrize("diagnosis", SCREENS.values(), ids=SCREENS)
def test_every_diagnosis_fits_one_screen(diagnosis: Diagnosis) -> None:
    figure = draw_diagnosis(diagnosis, [])
    assert off_the_sheet(figure) == []
    zones, drag = diagnosis.misfit.zones, diagnosis.place_map
    assert " ".join(figure.get_suptitle().split()) == f"{diagnosis.name}: {sentence(Headline(diagnosis.verdict))}"
    scores, visible, alike, *rest = figure.axes
    assert {label.get_text().split()[0] for label in scores.get_yticklabels()} == {
        one.name for one in diagnosis.candidate_effects
    }
    shown = sorted(bar.get_width() for bar in visible.patches)
    assert shown == sorted(one.detectability.visibility for one in diagnosis.candidate_effects)
    assert {label.get_text() for label in alike.get_yticklabels()} == set(diagnosis.first_screening.compared)
    assert len(rest) == bool(len(zones)) + bool(drag.x.size)
    if len(zones):
        assert len(texts(rest[0])) == 2 * len(zones)
    if drag.x.size:
        station = diagnosis.predictions.station
        assert points(rest[-1], "*") == [(one.x, one.y) for one in diagnosis.places]
        assert set(points(rest[-1], ".")) == set(zip(station["x"], station["y"], strict=True))


def test_a_sentence_too_long_for_the_screen_is_broken() -> None:
    many = tuple(an_effect_found(f"effect_{number}") for number in range(6))
    figure = draw_diagnosis(a_diagnosis(verdict={"effects": many}), [])
    assert "\n" in figure.get_suptitle()
    assert off_the_sheet(figure) == []


@pytest.mark.parametrize("diagnosis", [a_diagnosis(), crowded()], ids=["usual", "crowded"])
def test_no_panel_of_a_screen_covers_another_or_the_sentence(diagnosis: Diagnosis) -> None:
    figure = draw_diagnosis(diagnosis, [])
    assert off_the_sheet(figure) == []
    title = next(text for text in figure.texts if text.get_text() == figure.get_suptitle())
    panels = [title.get_window_extent(), *(axes.get_tightbbox() for axes in figure.findobj(Axes))]
    assert [pair for pair in combinations(range(len(panels)), 2) if overlap(*(panels[k] for k in pair)) > 1.0] == []


def overlap(one: Bbox, other: Bbox) -> float:
    """By how many pixels two boxes lie over each other, the shorter way."""
    common = Bbox.intersection(one, other)
    return 0.0 if common is None else float(min(common.width, common.height))


def test_screen_of_a_diagnosis_is_a_file(tmp_path: Path) -> None:
    case = load_case(CONFIGS / "twin.yaml")
    save_diagnosis_figure(a_diagnosis(), case, tmp_path / "diagnosis.png")
    height, width, _ = imread(tmp_path / "diagnosis.png").shape
    assert (width, height) == (14 * 130, round(8.6 * 130))
    outlines = [corners_of(case, patch) for patch in case.plants.patches]
    drawn = draw_diagnosis(a_diagnosis(), [Outline("", corners) for corners in outlines]).axes[-1].patches
    patches = [patch for patch in drawn if isinstance(patch, Polygon)]
    assert [patch.get_xy()[:4].tolist() for patch in patches] == [corners.tolist() for corners in outlines]


def a_model_score(name: str, error: float, **changes: object) -> ModelScore:
    pattern = np.array([1.0, -1.0, 1.0, -1.0]) * error
    clusters = (("low", "D0"), ("low", "D3"), ("high", "D0"), ("high", "D3"))
    score = ModelScore(
        name=name, title=name, effects=(), values={"n_b": (0.03, 0.02, 0.04), "k_s": (0.5, 0.01, 3.0)},
        in_sample=InSample({"velocity": 0.8 * error, "level": 0.001}, chi2=4.0, stations=4, noise_floor=0.01),
        held_out=HeldOut(pattern, np.full(4, np.nan), np.ones(4, bool), clusters),
        predictive=PredictiveScores(log_score=1.0, inside50=0.5, inside95=0.95),
        homogeneity={"n_b": 0.001 if error > 0.02 else 0.4}, validation=float("nan"),
    )  # fmt: skip
    return replace(score, **changes)


def with_sections(score: ModelScore, errors: np.ndarray) -> ModelScore:
    return replace(score, held_out=replace(score.held_out, sections=errors))


def test_ladder_draws_held_out_errors_with_their_paired_error() -> None:
    before, after = a_model_score("a", 0.05), a_model_score("b", 0.012, effects=("eddies",))
    before = with_sections(before, before.held_out.sections * np.array([1.0, 1.1, 0.9, 1.2]))
    figure = draw_ladder([before, after])
    axes = figure.axes[0]
    solid = next(line for line in axes.lines if line.get_linestyle() == "-" and line.get_marker() == "o")
    assert list(solid.get_ydata()) == [held_out_rmse(before), held_out_rmse(after)]
    bar = axes.collections[0].get_segments()[1]
    assert (bar[1, 1] - bar[0, 1]) / 2 == pytest.approx(improvement(before, after)[1] / (2 * held_out_rmse(after)))
    assert "+ eddies" in axes.get_xticklabels()[1].get_text()
    named = {name for name, (_, words, _, _) in LINES.items() if phrase("label", words) in texts(axes)}
    assert named == {"held_out_sections", "in_sample", "noise_floor"}


def test_ladder_tells_parameters_that_move_from_those_that_stand_still() -> None:
    figure = draw_ladder([a_model_score("a", 0.05), a_model_score("b", 0.012)])
    n_b = next(axes for axes in figure.axes if axes.get_title(loc="left").startswith("n_b"))
    faces = [line.get_markerfacecolor() for line in n_b.lines]
    assert faces == [COLOUR["paper"], COLOUR["model"]]


@pytest.mark.parametrize(
    "scores",
    [
        [a_model_score("a", 0.05)],
        [with_sections(a_model_score("a", 0.05, values={}, homogeneity={}), np.full(4, np.nan))],
    ],
)
def test_ladder_of_one_rung_is_a_file(tmp_path: Path, scores: list[ModelScore]) -> None:
    save_ladder_figure(scores, tmp_path / "runs" / "ladder.svg")
    assert "<svg" in (tmp_path / "runs" / "ladder.svg").read_text(encoding="utf-8")
    figure = draw_ladder(scores)
    errors, *parameters = [axes for axes in figure.axes if axes.get_visible()]
    (score,) = scores
    expected = [held_out_rmse(score), score.in_sample.rmse["velocity"]]  # in sample is drawn beside what was held out
    assert points(errors) == [(1.0, value) for value in expected if np.isfinite(value)]
    assert errors.get_ylim() == pytest.approx((0.0, 1.12 * np.nanmax(expected)))
    assert [axes.get_title(loc="left").split("\n")[0] for axes in parameters] == list(score.values)
    for axes, (middle, low, high) in zip(parameters, score.values.values(), strict=True):
        assert points(axes) == [(1.0, middle)]
        assert axes.collections[0].get_segments()[0][:, 1].tolist() == [low, high]
    assert off_the_sheet(figure) == []


def test_the_errors_of_a_kept_ladder_are_drawn_for_the_page() -> None:
    """`compare` and the page drew the ladder by two stacks of code."""
    long = "unlisted_inflow_x27_22_y2_04"
    steps = (
        ComparedModel("toy", "toy.yaml", "a", (), 4, 0.04, 0.041, 0.063, 0.039, 0.012),
        ComparedModel(f"toy-{long}", "b.yaml", "b", (long, "wind"), 6, 0.012, 0.013, np.nan, 0.0033, 0.012),
    )
    figure = draw_errors(ModelComparison(steps, 0, ""))
    (axes,) = figure.axes
    held = next(line for line in axes.lines if line.get_linestyle() == "-" and line.get_marker() == "o")
    assert list(held.get_ydata()) == [0.041, 0.013]
    assert phrase("label", LINES["held_out_experiments"][1]) not in texts(axes), "of the last model it is not known"
    assert "wind" in axes.get_xticklabels()[1].get_text()
    assert off_the_sheet(figure) == []
