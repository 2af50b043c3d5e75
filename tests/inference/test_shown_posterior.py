"""What is shown of a posterior: commands that can be copied, and how a misfit is judged."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from refined_reach import SolvedReach

from vegglue.cli.printed import show
from vegglue.inference.statements import measurement_error, misfit_tested
from vegglue.pages.answer import next_steps
from vegglue.pages.parameters import residual_compared
from vegglue.results.posterior import Posterior


def test_the_report_of_an_inference(refined: Posterior, reach: SolvedReach, capsys: pytest.CaptureFixture[str]) -> None:
    case = reach[0].model_copy(update={"source": Path("a folder/my brook, June 2024, second survey.yaml")})
    show(case.model_copy(update={"name": "brook"}), Path("elsewhere"), refined)
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == "  vegglue report 'a folder/my brook, June 2024, second survey.yaml' --runs elsewhere"


def test_the_next_step_of_a_page() -> None:
    run = SimpleNamespace(case=SimpleNamespace(source=Path("my brook.yaml")), behind=None)
    (step,) = next_steps(run)
    assert (step.action, step.config) == ("diagnose", "'my brook.yaml'")


@pytest.mark.parametrize(
    ("chance", "page", "terminal"),
    [(0.5, "explained", "explained"), (0.03, "hardly", "hardly-explained"), (0.0005, "exceeds", "unexplained")],
)
def test_a_misfit_is_judged_by_its_chance(refined: Posterior, chance: float, page: str, terminal: str) -> None:
    assert refined.refinement is not None
    misfit = replace(refined.refinement.misfit, p_misfit=chance)
    errors = replace(refined.refinement.error_model, errors="stated")
    judged = replace(refined, refinement=replace(refined.refinement, misfit=misfit, error_model=errors))
    rmse = 1.1 * measurement_error(judged, "velocity")
    assert residual_compared(judged, "velocity", rmse).compared == page
    tested = misfit_tested(judged)
    assert tested is not None
    assert tested.outcome == terminal
