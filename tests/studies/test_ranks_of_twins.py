"""The ranks of 200 truths among draws of their posteriors are uniform, and would not be were the draws too narrow."""

from pathlib import Path

import numpy as np
import pytest
import scipy.stats
from ranks_of_twins import DRAWS, PARAMETERS, ranks, save_figure

BINS = 10


def chance(found: np.ndarray) -> float:
    """p of the least uniform of the parameters, all counted."""
    counts = [np.histogram(column, np.linspace(0, DRAWS + 1, BINS + 1))[0] for column in found.T]
    return PARAMETERS * min(float(scipy.stats.chisquare(count).pvalue) for count in counts)


@pytest.fixture(scope="module")
def found() -> np.ndarray:
    return ranks()


@pytest.mark.slow
def test_ranks_are_uniform(found: np.ndarray, tmp_path: Path) -> None:
    assert chance(found) > 0.01
    save_figure(found, tmp_path / "ranks.png")
    assert (tmp_path / "ranks.png").stat().st_size > 5000


@pytest.mark.slow
def test_draws_a_quarter_too_narrow_would_be_noticed(found: np.ndarray) -> None:
    normal = scipy.stats.norm.ppf((found + 0.5) / (DRAWS + 1))
    assert chance(np.floor(scipy.stats.norm.cdf(normal / 0.75) * (DRAWS + 1))) < 0.01
