"""What the page says of a misfit agrees with what the command line says of it."""

from dataclasses import replace

import pytest

from vegglue.pages.key_numbers import against_measurement_error
from vegglue.pages.posterior_words import measurement_error
from vegglue.results.posterior import Posterior


@pytest.mark.parametrize(
    ("chance", "said"),
    [(0.5, "no more than the measurement error"), (0.03, "hardly explains"), (0.0005, "times the measurement error")],
)
def test_a_misfit_that_errors_hardly_explain(refined: Posterior, chance: float, said: str) -> None:
    """At p = 0.03 the page said `no more than`, and the command line `hardly`."""
    assert refined.refinement is not None
    misfit = replace(refined.refinement.misfit, p_misfit=chance)
    errors = replace(refined.refinement.error_model, errors="stated")
    told = replace(refined, refinement=replace(refined.refinement, misfit=misfit, error_model=errors))
    miss = 1.1 * measurement_error(told, "velocity")
    assert said in against_measurement_error(told, "velocity", miss)
