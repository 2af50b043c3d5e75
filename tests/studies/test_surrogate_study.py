"""A command that sleeps: its posterior by few runs beside that of all runs; what fails and what is kept."""

from pathlib import Path

import numpy as np
import pytest
from surrogate import brook_by_command, compare

import vegglue
from vegglue.inference.statements import SurrogateLearned, ValidationProposed, posterior_statements
from vegglue.results.result_files import read_posterior

# Of the issue that this answers: runs, medians [standard deviations], and standard deviations [share].
MOST_RUNS, MEDIANS, SPREADS = 60, 0.1, 0.15


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "seed"), [("cells", 1), ("parameters", 2), ("few data", 3)])
def test_few_runs_give_the_posterior_of_all(tmp_path: Path, kind: str, seed: int) -> None:
    """`python tests/studies/surrogate.py` has more seeds, and more draws."""
    both = compare(tmp_path, kind, seed)
    assert both.surrogate.surrogate is not None
    assert both.surrogate.surrogate.settled
    assert both.surrogate.surrogate.runs <= MOST_RUNS
    kept = set((tmp_path / "runs" / "own" / "engine").glob("*.json"))
    assert len(kept) == both.surrogate.surrogate.runs + 1, "each is a place of its own; one file is that of the best"
    assert np.abs(both.medians).max() < MEDIANS
    assert np.abs(both.spreads).max() < SPREADS


@pytest.mark.slow
def test_runs_are_kept_and_failures_counted(tmp_path: Path) -> None:
    """With few runs it is not settled; with more, none is repeated but those that failed, and numbers are the same."""
    with brook_by_command(tmp_path, "few data", 1, fails_above=30.0) as brook:
        assert brook.case.engine is not None
        short = brook.case.model_copy(update={"engine": brook.case.engine.model_copy(update={"most_runs": 14})})
        first = vegglue.infer(short, runs=tmp_path / "runs", jobs=1).surrogate
        assert first is not None
        assert (first.settled, first.runs) == (0, 14)
        found = vegglue.infer(brook.case, runs=tmp_path / "runs", jobs=1)
        one, ran = found.surrogate, brook.runs
        assert one is not None
        assert one.failed > 0
        assert one.runs - one.failed <= ran <= one.runs + first.failed
        again = vegglue.infer(brook.case, runs=tmp_path / "runs", jobs=1)
        assert brook.runs - ran <= one.failed
    assert again.marginals.median == found.marginals.median
    kept = read_posterior(tmp_path / "runs" / brook.case.name / "posterior.h5")
    assert kept.settings.method == "surrogate"
    assert kept.surrogate is not None
    assert kept.surrogate == one
    kinds = [type(statement) for statement in posterior_statements(kept)]
    assert {SurrogateLearned, ValidationProposed} <= set(kinds)
    assert (one.validation_low, one.validation_high) == (1.0, 4.0)
