"""Commands that are told can be copied, whatever the path of the config."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from refined_reach import SolvedReach

from vegglue.cli.brief_posterior import show_posterior
from vegglue.pages.next_words import next_steps
from vegglue.results.posterior import Posterior


def test_the_report_of_an_inference(refined: Posterior, reach: SolvedReach, capsys: pytest.CaptureFixture[str]) -> None:
    """The name stood unquoted and broken over two lines, and without --runs."""
    case = reach[0].model_copy(update={"source": Path("a folder/my brook, June 2024, second survey.yaml")})
    show_posterior(case, Path("elsewhere/brook"), refined)
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == "  vegglue report 'a folder/my brook, June 2024, second survey.yaml' --runs elsewhere"


def test_the_next_step_of_a_page() -> None:
    run = SimpleNamespace(case=SimpleNamespace(source=Path("my brook.yaml")), behind=None)
    assert next_steps(run)[0].startswith("<code>vegglue diagnose &#x27;my brook.yaml&#x27;</code>")
