"""A misfit that is far too small is told, with the number and what to do; one that chance makes is not."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from posteriors import a_posterior, a_refinement
from verdicts import FITS, inputs, said

from vegglue.cli.brief_posterior import brief_posterior
from vegglue.pages.key_numbers import against_measurement_error
from vegglue.pages.posterior_words import fit_in_words
from vegglue.pages.validation_words import chi2_in_words
from vegglue.results.diagnosis import Misfit
from vegglue.results.small_misfit import is_too_small, small_misfit_in_words


def test_chance_makes_a_small_misfit_as_often_as_is_said() -> None:
    chi2 = np.random.default_rng(5).chisquare(40, 20_000)
    share = np.mean([is_too_small(one, 40) for one in chi2])
    assert 2e-4 < share < 2e-3


@pytest.mark.parametrize(("ratio", "small"), [(0.41, True), (0.6, True), (0.9, False), (1.0, False), (3.0, False)])
def test_of_150_readings_041_is_too_small_and_09_is_not(ratio: float, small: bool) -> None:
    assert bool(small_misfit_in_words(150.0 * ratio, 150)) == small


def test_few_readings_do_not_tell() -> None:
    assert not is_too_small(0.41 * 6, 6)
    assert not is_too_small(0.0, 0)


def test_infer_says_so_with_the_number_and_what_to_do() -> None:
    told = chi2_in_words(a_refinement(61.5, 150).misfit, "something is missing")
    assert told.startswith(
        "chi2 = 61.5 with 150 degrees of freedom (p = 1), less than chance makes it: errors as stated,"
    )
    assert "too large (0.64 times as large would fit)" in told
    assert "explain what is left" in chi2_in_words(a_refinement(140.0, 150).misfit, "something is missing")
    lines = brief_posterior(replace(a_posterior(False), refinement=a_refinement(61.5, 150)), "posterior.h5", "report")
    assert "0.64 times as large would fit" in " ".join(" ".join(lines).split())


def test_diagnose_says_so() -> None:
    small = Misfit(61.5, 61.5, 150, 1.0, pd.DataFrame())
    assert "chi2 is only 0.41 times its degrees of freedom" in said(inputs(misfit=small))[2]
    assert "chi2 is only" not in said(inputs(misfit=FITS))[2]


def test_the_page_says_far_less_than_the_errors_explain() -> None:
    posterior = a_posterior(False)
    station = posterior.station.assign(used=True, kind="velocity", standard_error=0.02)
    stated, small = (replace(posterior, station=station, refinement=a_refinement(chi2, 150)) for chi2 in (140.0, 61.5))
    assert "no more than" in against_measurement_error(stated, "velocity", 0.01)
    assert "far less than" in against_measurement_error(small, "velocity", 0.01)
    estimated = replace(small, refinement=a_refinement(61.5, 150, "estimated"))
    assert "no more than" in against_measurement_error(estimated, "velocity", 0.01)


def test_weighed_members_say_so_too() -> None:
    posterior = a_posterior(False)
    fit = replace(posterior.fit, chi2=61.5, used=152)
    assert "Chi2 is only 0.41 times" in " ".join(fit_in_words(replace(posterior, fit=fit)))
