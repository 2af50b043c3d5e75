"""Commands that are told can be copied as they stand, and tables say what their numbers are under."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from diagnoses import IMPLAUSIBLE, a_diagnosis
from model_scores import a_model_score
from posteriors import a_posterior, changed

from vegglue.cli.ensemble_commands import _in_short
from vegglue.cli.output import command_line
from vegglue.cli.tables import show_diagnosis, show_ladder, show_questions
from vegglue.results.verdict import UncertainBetweenSections
from vegglue.workflow.compare import Comparison


def test_a_command_that_is_told_can_be_copied() -> None:
    assert command_line("next", Path("brook.yaml")) == "vegglue next brook.yaml"
    assert command_line("run", Path("weir brook.yaml")) == "vegglue run 'weir brook.yaml'"
    told = command_line("extend", Path("brook.yaml"), "--auto", runs=Path("out"), trust=True)
    assert told == "vegglue extend brook.yaml --auto --runs out --trust"


def test_differences_between_experiments_are_told_with_the_errors_they_are_under(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """`infer` said that one value does as well, of what `compare` told apart: one of them makes errors larger."""
    alike, apart = a_model_score("brook"), replace(a_model_score("brook-wind"), homogeneity={"phi": 1e-5, "n_b": 0.3})
    show_ladder(Comparison((alike,), pd.DataFrame()))
    assert "under the errors as stated" not in capsys.readouterr().out
    show_ladder(Comparison((alike, apart), pd.DataFrame()))
    said = " ".join(capsys.readouterr().out.split())
    assert (
        "- brook-wind: differs between experiments: phi (p = 1e-05) These differences are under the errors as" in said
    )


def test_that_no_measurement_is_proposed_claims_no_more_than_was_weighed(capsys: pytest.CaptureFixture[str]) -> None:
    """`no rivals` stood below a verdict with `or else something in no list ... (8%)`, which is not asked about."""
    show_questions("brook", [])
    said = " ".join(capsys.readouterr().out.split())
    assert (
        "no two listed effects are left to be told apart, and what is in no list is weighed only where it is likelier"
        in said
    )


def test_what_a_run_found_is_a_short_line_each() -> None:
    """It ended in one paragraph of up to 200 words, without a word on phi at its bound."""
    unsure = {"kind": "cannot-tell", "effects": (), "places": (), "reasons": (UncertainBetweenSections(1.5),)}
    first, last = a_diagnosis(), a_diagnosis(verdict=unsure)
    pressed = {name: np.array([name == "phi", False]) for name in ("n_b", "phi")}
    posterior = changed(a_posterior(False), bound_hit=pressed)
    of, child = SimpleNamespace(name="brook"), SimpleNamespace(name="brook-wind")
    extension = SimpleNamespace(sentence="Missing: wind (of 0.3; which blows).", reason="Added: wind.")
    lines = _in_short(extension, [(of, first), (child, last), (child, posterior)])
    assert lines[:2] == ["Missing: wind.", "Added: wind."]
    assert "1.5 times" in lines[2]
    assert "(chi2" not in lines[2]
    assert lines[3].startswith("phi ends at a bound of its prior, and the bound, not the data, ends the range")
    assert len(lines) == 4


def test_a_verdict_that_doubts_the_data_is_followed_by_no_table_of_effects(capsys: pytest.CaptureFixture[str]) -> None:
    """Effects followed with chances and amplitudes, as if these meant something."""
    show_diagnosis(a_diagnosis())
    assert "detectable from" in capsys.readouterr().out
    show_diagnosis(a_diagnosis(verdict={"kind": "cannot-tell", "reasons": (IMPLAUSIBLE,)}))
    said = capsys.readouterr().out
    assert "detectable from" not in said
    assert "Mend them, or find them right, first" in " ".join(said.split())
