"""Commands that are printed can be copied as they stand, and results fit a terminal."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from diagnoses import EVERY_KIND, IMPLAUSIBLE, NOTHING, Rival, a_diagnosis
from model_scores import a_model_score
from posteriors import a_posterior, changed

from vegglue.cli.printed import (
    TERMINAL_WIDTH,
    VERDICT_LINES,
    show,
    show_diagnosis,
    show_ladder,
    summary_lines,
    verdict_lines,
)
from vegglue.cli.terminal import command_line
from vegglue.inference.statements import parameters_at_bounds
from vegglue.pages.headline import Headline
from vegglue.results.verdict import ErrorsStillLarger, TooManyGroups
from vegglue.wording.sentences import phrase, sentence
from vegglue.workflow.compare import Comparison

MANY = TooManyGroups(tuple(Rival(f"discharge_error[experiment {k}]", "effect", 0.03) for k in range(30)))
LONG = "vegglue diagnose 'a folder/my brook, June 2024.yaml' --details --runs somewhere/else"


def test_a_command_can_be_copied() -> None:
    assert command_line("next", Path("brook.yaml")) == "vegglue next brook.yaml"
    assert command_line("run", Path("weir brook.yaml")) == "vegglue run 'weir brook.yaml'"
    shown = command_line("extend", Path("brook.yaml"), "--auto", runs=Path("out"), trust=True)
    assert shown == "vegglue extend brook.yaml --auto --runs out --trust"


@pytest.mark.parametrize(
    "found",
    [
        NOTHING, a_diagnosis(), EVERY_KIND, replace(EVERY_KIND, field=None),
        a_diagnosis(verdict={"kind": "cannot-tell", "effects": (), "places": (), "reasons": (MANY,)}),
        a_diagnosis(errors={"scale": 2.0}, verdict={"remaining": (ErrorsStillLarger(2.0),) * 9,
                                                    "not_excluded": (("wind", "waves"), ("drag",)) * 9}),
    ],
)  # fmt: skip
def test_a_verdict_fits_fifteen_lines_of_eighty_columns(found, capsys: pytest.CaptureFixture[str]) -> None:
    case = SimpleNamespace(name="brook", source=Path("brook.yaml"))
    show(case, Path("runs"), found)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) < VERDICT_LINES, "one line is left for the next command"
    assert max(map(len, lines)) <= TERMINAL_WIDTH
    assert lines[0].startswith("open-x: ")
    assert any(line.endswith(": vegglue diagnose brook.yaml --details") for line in lines)
    assert verdict_lines(found, LONG, 13)[-1].endswith(f": {LONG}"), "a command is never broken"


def test_details_have_the_table_unless_the_data_are_doubtful(capsys: pytest.CaptureFixture[str]) -> None:
    """Effects followed with chances and amplitudes, as if these meant something."""
    show_diagnosis(a_diagnosis())
    printed = capsys.readouterr().out
    assert all(one.name in printed for one in a_diagnosis().candidate_effects)
    assert a_diagnosis().verdict.remarks[0] in printed
    show_diagnosis(a_diagnosis(verdict={"kind": "cannot-tell", "reasons": (IMPLAUSIBLE,)}))
    assert "mixing[D3]  " not in capsys.readouterr().out


def test_differences_between_experiments_name_the_errors_they_are_under(capsys: pytest.CaptureFixture[str]) -> None:
    """`infer` said that one value does as well, of what `compare` told apart: one of them makes errors larger."""
    alike, apart = a_model_score("brook"), replace(a_model_score("brook-wind"), homogeneity={"phi": 1e-5, "n_b": 0.3})
    under = phrase("differences_under_stated_errors")
    show_ladder(Comparison((alike,), pd.DataFrame()))
    assert under not in capsys.readouterr().out
    show_ladder(Comparison((alike, apart), pd.DataFrame()))
    printed = capsys.readouterr().out
    assert under in printed
    assert phrase("differs_between_experiments", "brook-wind", {"phi": 1e-5}) in printed


def test_a_run_in_short_is_a_few_values() -> None:
    """It ended in one paragraph of up to 200 words, without a word on phi at its bound."""
    first, last = replace(a_diagnosis(), name="brook"), replace(NOTHING, name="brook-wind")
    pressed = {name: np.array([name == "phi", False]) for name in ("n_b", "phi")}
    posterior = changed(a_posterior(False), bound_hit=pressed)
    of, child = SimpleNamespace(name="brook"), SimpleNamespace(name="brook-wind")
    extension = SimpleNamespace(sentence="", reason="Added: wind.")
    results = [(of, first), (child, last), (child, posterior)]
    printed = " ".join(line.strip() for line in summary_lines(extension, results))
    verdicts = Headline(first.verdict, "brook"), Headline(last.verdict, "brook-wind")
    values = verdicts[0], "Added: wind.", verdicts[1], parameters_at_bounds(posterior)
    assert printed == " ".join(["In short:", *(f"- {sentence(one)}" for one in values)])
    assert summary_lines(extension, results[:1])[0] == "In short:"
