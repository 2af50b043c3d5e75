"""What is shown of a posterior: commands that can be copied, and how a misfit is judged."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from refined_reach import SolvedReach

from vegglue.cli.brief_posterior import show_posterior
from vegglue.pages.key_numbers import against_measurement_error
from vegglue.pages.next_words import next_steps
from vegglue.pages.posterior_words import measurement_error
from vegglue.results.posterior import Posterior


def test_the_report_of_an_inference(refined: Posterior, reach: SolvedReach, capsys: pytest.CaptureFixture[str]) -> None:
    case = reach[0].model_copy(update={"source": Path("a folder/my brook, June 2024, second survey.yaml")})
    show_posterior(case, Path("elsewhere/brook"), refined)
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == "  vegglue report 'a folder/my brook, June 2024, second survey.yaml' --runs elsewhere"


def test_the_next_step_of_a_page() -> None:
    run = SimpleNamespace(case=SimpleNamespace(source=Path("my brook.yaml")), behind=None)
    assert next_steps(run)[0].startswith("<code>vegglue diagnose &#x27;my brook.yaml&#x27;</code>")


def test_a_misfit_is_judged_by_its_chance(refined: Posterior) -> None:
    """Of one that errors explain, hardly explain, and do not explain three things are shown."""
    assert refined.refinement is not None
    errors, shown = replace(refined.refinement.error_model, errors="stated"), set()
    for chance in (0.5, 0.03, 0.0005):
        misfit = replace(refined.refinement.misfit, p_misfit=chance)
        judged = replace(refined, refinement=replace(refined.refinement, misfit=misfit, error_model=errors))
        shown.add(against_measurement_error(judged, "velocity", 1.1 * measurement_error(judged, "velocity")))
    assert len(shown) == 3
