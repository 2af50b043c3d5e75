"""Laws of the grammar: each keeps the contract, has g of the size of 1, and stays out of the usual search."""

from pathlib import Path

import numpy as np
import pytest

from vegglue.case.config import load_case
from vegglue.checks.effect_contract import breaches
from vegglue.checks.trial_channel import moving_water, trial
from vegglue.effects.definition import Effect
from vegglue.effects.grammar import EFFECTS, LAWS, SAME_AS
from vegglue.effects.library import SHIPPED, library
from vegglue.flow.closures import closures
from vegglue.flow.equations import faces
from vegglue.measurements.observations import read_observations
from vegglue.screening.candidates import candidates_of

CONFIG = Path(__file__).parents[2] / "configs" / "twin.yaml"


@pytest.mark.slow
@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_every_law_keeps_the_contract(effect: Effect) -> None:
    assert breaches(effect) == []


def test_laws_are_effects_but_no_suspects() -> None:
    case = load_case(CONFIG)
    assert set(LAWS) <= set(library())
    assert not set(LAWS) & {effect.name for effect in SHIPPED}
    assert not set(LAWS) & {one.effect.name for one in candidates_of(case, read_observations(case).table)}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_g_is_of_the_size_of_one(law) -> None:
    """Centred, or 1 at most: nearly 0 at the reference, a few at a tenth and at ten times it."""
    q = np.geomspace(0.1, 10.0, 41) * law.quantity.usual if law.quantity.usual else np.linspace(-0.5, 0.5, 41)
    g = law.form.of(q, law.quantity.usual)
    assert 0.4 <= np.abs(g).max() <= 2.4
    if law.form.name not in ("fading", "hump", "stretch"):
        assert law.form.of(np.array([law.quantity.usual]), law.quantity.usual) == pytest.approx(0.0)


@pytest.mark.parametrize(("name", "listed"), SAME_AS.items())
def test_a_law_that_restates_a_listed_effect_does_the_same(name: str, listed: str) -> None:
    """Where the water is deeper than a tenth of the reference: below, the law is held."""
    rates = []
    for effect in (library()[name], library()[listed]):
        tried = trial(effect)
        problem = tried.problem(0.4)
        state = moving_water(problem)
        depth = faces(problem, state).cell
        rates.append(closures(problem, state, depth).rate[depth > 0.05])
    assert rates[0] == pytest.approx(rates[1], rel=1e-12)
