"""Laws of the grammar: each keeps the contract, has g of the size of 1, and stays out of the usual search."""

from pathlib import Path

import numpy as np
import pytest

from vegglue.calibration.candidates import candidates_of
from vegglue.case.config import load_case
from vegglue.diagnosis.effect_contract import breaches, moving_water, trial
from vegglue.effects.definition import Effect
from vegglue.effects.grammar import EFFECTS, LAWS, PRODUCTS, SAME_AS, Law
from vegglue.effects.library import SHIPPED, library
from vegglue.effects.surroundings import Cells, ChannelGeometry
from vegglue.flow.closures import closures
from vegglue.flow.equations import faces
from vegglue.measurements.observations import read_observations

CONFIG = Path(__file__).parents[2] / "configs" / "twin.yaml"


@pytest.mark.slow
@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_every_law_keeps_the_contract(effect: Effect) -> None:
    assert breaches(effect) == []


def one_product_of_each_kind() -> dict[str, Law]:
    """One for each term and quantity that multiplies, and for each form of the law that is multiplied."""
    every = [product for some in PRODUCTS.values() for product in some if product.times is not None]
    kinds = {(one.term.name, one.quantity.name): one for one in every}
    kinds |= {(one.term.name, one.times.form.name): one for one in every if one.times is not None}
    return {one.name: one for one in kinds.values()}


@pytest.mark.slow
@pytest.mark.parametrize("product", one_product_of_each_kind().values(), ids=one_product_of_each_kind())
def test_products_keep_the_contract(product: Law) -> None:
    assert breaches(product.effect) == []


def test_a_product_multiplies_its_law_by_another_quantity_of_the_same_term() -> None:
    for name, products in PRODUCTS.items():
        law = LAWS[name]
        others = {other.quantity.name for other in LAWS.values() if other.term == law.term} - {law.quantity.name}
        assert {product.quantity.name for product in products} == others
        assert {product.term.name for product in products} == {law.term.name}
    cells = trial_cells()
    product = next(one for one in PRODUCTS["law_floor_speed_step"] if one.quantity.name == "depth")
    alone = LAWS["law_floor_depth_ramp"].g(cells, 0.3) * LAWS["law_floor_speed_step"].g(cells, 0.4)
    np.testing.assert_allclose(product.g(cells, 0.3, 0.4), alone)
    assert np.ptp(alone) > 0.0
    (changed,) = product.effect.act(cells, strength=np.array([0.5]), reference=0.3, first=0.4).values()
    np.testing.assert_allclose(np.log(changed / cells.rate), 0.5 * alone * product.term.share(cells), atol=1e-12)


def trial_cells() -> Cells:
    """Depths and speeds drawn at random, over a floor with plants on some of it."""
    random = np.random.default_rng(5)
    depth, u, rate = (random.uniform(0.1, 1.0, (6, 5, 1)) for _ in range(3))
    there = [random.integers(0, 2, (6, 5, 1)).astype(float) for _ in range(2)]
    place = np.zeros((6, 5, 1))
    geometry = ChannelGeometry(
        x=place, y=place, share_along=place, length=6.0, dx=1.0, dy=1.0, filter_width=1.0, bed=place, offset=place,
        half_width=1.0, side_slope=place,
        bank=there[0], planted=there[1], front=place, edge=place, wake=place, patch=place,
    )  # fmt: skip
    return Cells(geometry, depth, depth, u, place, rate, rate, rate, np.zeros((0, 0, 0)))


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
