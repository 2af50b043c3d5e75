"""Two engines behind one interface give the same: Newton's with exact derivatives, and marching with differences."""

from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from channels import stations_at
from marching_engine import marching

from vegglue.calibration.candidates import candidates_of, cause_of, with_effect
from vegglue.calibration.fit import fit
from vegglue.calibration.noise import noise_of
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case
from vegglue.diagnosis.diagnose import diagnose_model
from vegglue.effects.library import library
from vegglue.engine.interface import Model, Point, flow_at_centres, linearise, predict, responses, responses_to_cells
from vegglue.engine.newton import NEWTON
from vegglue.flow.local_changes import Term

pytestmark = pytest.mark.slow

CASE = Case.model_validate(
    {
        "source": Path("engines"),
        "name": "engines",
        "grid": {"x": (0.0, 24.0), "y": (-3.0, 3.0), "cell": (2.0, 0.75)},
        "bed": [{"trapezoid": {"axis": 0.0, "bottom_width": 5.0, "bank_slope": 0.5, "bed_slope": 0.001, "level": 0.0}}],
        "friction": {"classes": {"bed": {"law": "manning", "n": "n_b"}}, "default": "bed"},
        "plants": {
            "stands": {"willow": {"phi": "phi", "canopy_height": 0.4}},
            "patches": [{"name": "p1", "stand": "willow", "x": (8.0, 12.0), "y": (-0.75, 1.5)}],
        },
        "inflows": {"main": {"side": "west"}},
        "experiments": {
            "low": {"discharge": {"main": 1.5}, "level": 0.6},
            "high": {"discharge": {"main": 2.5}, "level": 0.8},
        },
        "parameters": {
            "n_b": {"distribution": "uniform", "low": 0.02, "high": 0.08, "unit": "s m^(-1/3)"},
            "phi": {"distribution": "loguniform", "low": 1.0, "high": 30.0, "unit": "-"},
        },
    }
)
Z = np.array([0.3, -0.4])
# An effect of every stage that acts on the flow, one of them in one experiment alone.
OF_EVERY_STAGE = (
    "floor_level_error", "discharge_error[high]", "streamlining", "depth_dependent_bed", "elder", "wind", "gauge_datum",
)  # fmt: skip


PLACES = {"velocity": ((5.0, 11.0, 17.0), (-1.2, 0.1, 1.2)), "level": ((3.0,), (0.0,))}


@pytest.fixture(scope="module")
def models() -> tuple[Model, Model]:
    newton = Model(CASE, build_site(CASE), stations_at(CASE.experiments, PLACES), NEWTON)
    return newton, replace(newton, engine=marching())


@pytest.fixture(scope="module")
def points(models: tuple[Model, Model]) -> tuple[Point, Point]:
    found = [linearise(model, Z) for model in models]
    assert found[0] is not None
    assert found[1] is not None
    return found[0], found[1]


def test_predictions_and_slopes_agree(models: tuple[Model, Model], points: tuple[Point, Point]) -> None:
    exact, marched = points
    assert marched.prediction == pytest.approx(exact.prediction, abs=5e-6)
    assert marched.slope == pytest.approx(exact.slope, abs=2e-3 * np.abs(exact.slope).max())
    z = Z + 0.2 * np.array([[1.0, -1.0], [-1.0, 0.5], [0.0, 1.0]])
    found = [predict(model, [point], z) for model, point in zip(models, points, strict=True)]
    assert found[1] == pytest.approx(found[0], abs=5e-6)


def test_responses_to_causes_agree(models: tuple[Model, Model], points: tuple[Point, Point]) -> None:
    chosen = [one for one in candidates_of(CASE, models[0].station) if one.name in OF_EVERY_STAGE]
    assert len(chosen) == len(OF_EVERY_STAGE)
    causes = [cause_of(CASE, one, one.settings()[0]) for one in chosen]
    exact, marched = (responses(model, point, causes) for model, point in zip(models, points, strict=True))
    for j, one in enumerate(chosen):
        assert marched[:, j] == pytest.approx(exact[:, j], abs=0.03 * np.abs(exact[:, j]).max()), one.name
    alone = [one.name for one in chosen].index("discharge_error[high]")
    assert not exact[models[0].rows["low"], alone].any()


@pytest.mark.parametrize("term", get_args(Term))
def test_responses_to_a_term_in_each_cell_agree(
    models: tuple[Model, Model], points: tuple[Point, Point], term: Term
) -> None:
    """Adjoints in single precision against a member for every cell; land, which carries no water, left out.

    The bed beside the inflow, which changes how water is spread over all of it, is left out as well: see
    `newton.responses_by_adjoints`.
    """
    found = [next(responses_to_cells(*one, "high", [term])) for one in zip(models, points, strict=True)]
    assert np.array_equal(found[0][0], models[0].rows["high"])
    exact, marched = (of[term] for _, of in found)
    wet = flow_at_centres(models[0], points[0], "high").depth > 0.1
    close = (0.015 if term == "inflow" else 0.01) * float(np.abs(exact).max())
    if term == "bed":
        wet[0] = False
    assert wet.sum() > 50
    assert marched[:, wet] == pytest.approx(exact[:, wet], abs=close)


def test_flows_at_centres_agree(models: tuple[Model, Model], points: tuple[Point, Point]) -> None:
    exact, marched = (flow_at_centres(model, point, "low") for model, point in zip(models, points, strict=True))
    for name in ("depth", "u", "v"):
        assert getattr(marched, name) == pytest.approx(getattr(exact, name), abs=1e-5)


def test_calibration_ends_at_the_same_place(models: tuple[Model, Model], points: tuple[Point, Point]) -> None:
    random = np.random.default_rng(4)
    truth = predict(models[0], [points[0]], Z[None] + 0.5)[0]
    measured = models[0].station.assign(value=truth + 0.01 * random.standard_normal(truth.size))
    noise = noise_of(measured)
    ends = [fit(replace(m, station=measured), noise, p) for m, p in zip(models, points, strict=True)]
    spread = np.sqrt(np.diag(ends[0].covariance))
    assert np.abs(ends[1].point.z - ends[0].point.z).max() < 0.05 * spread.min()


def test_a_whole_diagnosis_says_the_same(models: tuple[Model, Model]) -> None:
    """Streamlining is hidden; scores of effects of every stage and of drag at places, verdict and amplitude come
    out alike. Other effects are left out: a flow of each is marched (`test_effect_contract` compares these).
    """
    kept = {"unlisted_object", *(name.partition("[")[0] for name in OF_EVERY_STAGE)}
    fewer = CASE.model_copy(update={"exclude": dict.fromkeys(library(None).keys() - kept, "left out")})
    hidden = next(one for one in candidates_of(CASE, models[0].station) if one.name == "streamlining")
    truth = linearise(replace(models[0], case=with_effect(CASE, hidden, {})), np.array([*Z, -2.0]))
    assert truth is not None
    errors = 0.002 * np.random.default_rng(1).standard_normal(truth.prediction.size)
    measured = models[0].station.assign(value=truth.prediction + errors, standard_error=0.002)
    exact, marched = (diagnose_model(replace(model, case=fewer, station=measured)) for model in models)
    assert exact.set
    assert (marched.verdict.kind, set(marched.set)) == (exact.verdict.kind, set(exact.set))
    # Those that bend alike are as likely to a per cent: which comes first is no difference.
    for one, other in zip(exact.steps, marched.steps, strict=True):
        assert other.chance == pytest.approx(one.chance, abs=0.03)
    # The model's own error is that of where the search on coarse cells ends, up to 0.14 standard errors from the best
    # place: other starts of the same engine move chi2 by 0.6 %.
    assert marched.misfit.chi2 == pytest.approx(exact.misfit.chi2, rel=0.02)
    for name, score in exact.first_screening.scores.items():
        if abs(score) > 2.0:  # what hardly shows has no direction that differences could find
            assert marched.first_screening.scores[name] == pytest.approx(score, abs=0.1), name
