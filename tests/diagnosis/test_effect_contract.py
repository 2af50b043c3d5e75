"""The contract of effects over the whole library, no exclusions; and that it finds what breaks it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case
from vegglue.diagnosis.effect_contract import (
    AMPLITUDE,
    CHANNEL,
    ContractRule,
    breaches,
    moving_water,
    sizes,
    trial,
)
from vegglue.effects.definition import STAGES, Amplitude, Effect, Shape
from vegglue.effects.library import SHIPPED, library
from vegglue.flow import closures
from vegglue.flow.equations import residual
from vegglue.flow.march import march
from vegglue.flow.newton import newton
from vegglue.flow.problem import ALONG, take
from vegglue.flow.problem_setup import build_problem, share_under_water
from vegglue.flow.starts import backwater

# Length of the channel over that of a brook at which every shipped effect is tried [-]: a flume of 3 cm of water, a
# brook, a river of 10 m.
CHANNEL_SCALES = {"flume": 0.04, "brook": 1.0, "river": 15.0}
# Weather and the turn of the earth are as large at every site.
OF_THE_PLANET = ("wind", "turning_earth")


@pytest.mark.parametrize("scale", CHANNEL_SCALES)
@pytest.mark.parametrize("effect", SHIPPED, ids=lambda effect: effect.name)
def test_every_shipped_effect_keeps_the_contract_at_three_scales(effect, scale):
    assert breaches(effect, scale=CHANNEL_SCALES[scale]) == []


OF_THE_FLOW = [effect for effect in library().values() if effect.stage in ("resistance", "exchange", "force")]


@pytest.mark.parametrize("effect", OF_THE_FLOW, ids=lambda effect: effect.name)
def test_no_effect_depends_on_the_columns_that_are_worked_on_together(effect, monkeypatch):
    """A layer that grows from the inflow began anew after 200 columns."""
    problem = trial(effect).problem(effect.amplitude.off + effect.amplitude.small)
    state = moving_water(problem)
    whole = residual(problem, state)
    monkeypatch.setattr(closures, "CLOSURE_STRIP", 5)
    assert np.array_equal(residual(problem, state), whole)


def test_no_effect_holds_a_length_or_a_speed_of_its_own():
    """At 0.04 and 15 times the size each number has grown by the power of length of its unit, by Froude's law."""
    powers = {"m": 1.0, "m/s": 0.5, "m2/s": 1.5, "m3/s": 2.5, "1/m": -1.0, "s/m": -0.5, "-": 0.0}
    brook = {effect.name: trial(effect).effect for effect in SHIPPED}
    for scale in CHANNEL_SCALES.values():
        for effect in SHIPPED:
            there = trial(effect, scale=scale).effect
            for here, then in zip(brook[effect.name].parameters, there.parameters, strict=True):
                if effect.name in OF_THE_PLANET or getattr(here, "default", 1.0) == 0.0:
                    continue
                size = then.scale / here.scale if isinstance(here, Amplitude) else then.default / here.default
                assert size == pytest.approx(scale ** powers[here.unit], rel=0.12), (effect.name, here.name)


def test_water_enters_at_the_same_share_of_the_depth_at_three_scales():
    """From 0.2 m of depth on, as it was, all of it entered in no cell of a flume."""
    shares = []
    for scale in CHANNEL_SCALES.values():
        there = trial(SHIPPED[0], scale=scale)
        shares.append(share_under_water(there.case, there.site, there.case.experiments["flow"]))
    assert shares[0].max() == 1.0
    assert all(share == pytest.approx(shares[0], abs=1e-6) for share in shares)


def test_the_library_covers_all_stages():
    assert {effect.stage for effect in SHIPPED} == set(STAGES)
    assert len({effect.name for effect in SHIPPED}) == len(SHIPPED) >= 26
    for effect in SHIPPED:
        assert effect.doi == "" or effect.doi.startswith("10."), effect.name
        assert not effect.checked or effect.source.startswith("definition"), f"{effect.name}: was the source read?"
        assert not (effect.checked and effect.read_in), f"{effect.name}: a definition needs no other program"


@pytest.mark.parametrize("value", [-1.9, -0.5, 0.5, 0.8, 2.5])
def test_an_amplitude_and_its_gain_undo_each_other(value):
    amplitude = Amplitude("strength", "1/m", "drag c", 0.1, -2.0, 3.0, off=0.5, power=2)
    gain = amplitude.gain(value)
    assert gain == pytest.approx((value - 0.5) * abs(value - 0.5))
    assert amplitude.at(gain) == pytest.approx(value)
    assert amplitude.size(gain) == pytest.approx(value - 0.5)
    assert amplitude.at(gain + 100.0) == 3.0
    assert amplitude.gain(0.5 + amplitude.scale) == pytest.approx(amplitude.plausible_gain)


def test_a_size_may_be_within_its_support_and_within_belief():
    amplitude = Amplitude("strength", "1/m", "drag c", 0.1, -2.0, 3.0, off=0.5, power=2)
    assert [amplitude.allows(gain, 30.0) for gain in (6.2, -6.2, 6.3, -6.3)] == [True, True, False, False]
    assert amplitude.allows(0.2**2, 3.0), "two times its scale"
    assert not amplitude.allows(0.4**2, 3.0), "four times"


def drag(cells, strength):
    return {"rate": cells.rate + strength}


GOOD = Effect(
    name="more_drag",
    stage="resistance",
    title="More drag",
    equation="k -> k + c",
    act=drag,
    amplitude=Amplitude("strength", "1/m", "drag c", 0.1, 0.0, 1.0),
    source="definition",
)


def pushing(cells, strength):
    return {"rate": cells.rate - 50.0 * strength}


def always(cells, strength):
    return {"rate": cells.rate * (1.0 + strength + 1e-9)}


def of_others(cells, strength):
    return {"rate": cells.rate * (1.0 + strength * (1.0 + cells.u.mean(axis=2, keepdims=True)))}


def of_far(cells, strength):
    return {"rate": cells.rate * (1.0 + strength * cells.u.mean(axis=1, keepdims=True))}


def northward(cells, strength):
    return {"rate": cells.rate * np.exp(strength * cells.geometry.offset)}


def over_speed(cells, strength):
    return {"rate": cells.rate + strength / np.abs(cells.u)}


def jumping(cells, strength):
    return {"rate": cells.rate + 0.1 * (strength > 0.0) + strength}


def nothing(cells, strength):
    return {"rate": cells.rate + 0.0 * strength}


def crashing(cells, strength):
    return {"rate": cells.no_such_thing}


def of_far_upstream(cells, strength):
    return {"rate": cells.rate * (1.0 + strength * np.roll(cells.speed, -8, axis=0))}


def root_of_a_speed(cells, strength):
    return {"rate": cells.rate + strength * np.sqrt(cells.u)}


def kinked(cells, strength):
    return {"rate": cells.rate + np.abs(strength)}


def by_lot(cells, strength):
    return {"rate": cells.rate + strength * np.random.default_rng().uniform()}


BOTH_SIGNS = replace(GOOD.amplitude, low=-0.05)
WIDTH = Shape("width", "m", "width", 1.0, 0.1, 2.0)

BROKEN = [
    (ContractRule.DOWNSTREAM_ALONE, {"act": of_far_upstream}),
    (ContractRule.FUNCTION_RUNS, {"act": root_of_a_speed}),
    (ContractRule.TURNS, {"act": kinked, "amplitude": BOTH_SIGNS}),
    (ContractRule.REPEATS, {"act": by_lot}),
    (ContractRule.PARAMETER_TWICE, {"shapes": (WIDTH, WIDTH)}),
    (ContractRule.AMPLITUDE_FINITE, {"amplitude": replace(GOOD.amplitude, high=np.inf)}),
    (ContractRule.DRAG_POSITIVE, {"act": pushing}),
    (ContractRule.ROWS_ALONE, {"act": of_far}),
    (ContractRule.MEMBERS_ALONE, {"act": of_others}),
    (ContractRule.MIRRORED, {"act": northward}),
    (ContractRule.FUNCTION_RUNS, {"act": over_speed}),
    (ContractRule.POWER, {"act": jumping}),
    (ContractRule.ACTS, {"act": nothing}),
    (ContractRule.FUNCTION_RUNS, {"act": crashing}),
    (ContractRule.WORD_MISSING, {"source": ""}),
    (ContractRule.OFF_WITHIN_SUPPORT, {"amplitude": replace(GOOD.amplitude, off=-0.1)}),
    (ContractRule.SCALE_WITHIN_SUPPORT, {"amplitude": replace(GOOD.amplitude, scale=0.0)}),
    (ContractRule.PARAMETER_UNDECLARED, {"amplitude": replace(GOOD.amplitude, unit="")}),
    (ContractRule.SHAPE_WITHIN_SUPPORT, {"shapes": (replace(WIDTH, grid=(3.0,)),)}),
]


@pytest.fixture
def tried_as_shipped(monkeypatch):
    """Let a made-up effect be found in the library."""

    def put(effect):
        monkeypatch.setattr("vegglue.case.case_effects.library", lambda own: dict(library()) | {effect.name: effect})

    return put


def test_a_good_effect_passes(tried_as_shipped):
    tried_as_shipped(GOOD)
    assert breaches(GOOD) == []


@pytest.mark.parametrize(("rule", "change"), BROKEN)
def test_what_breaks_the_contract_is_found(rule, change, tried_as_shipped):
    effect = replace(GOOD, **change)
    tried_as_shipped(effect)
    assert rule in {breach.rule for breach in breaches(effect)}


def test_an_effect_that_is_not_off_is_found(tried_as_shipped, monkeypatch):
    """Nothing gets past `applied` at the off value; only a framework without that gate could let it."""
    effect = replace(GOOD, act=always)
    tried_as_shipped(effect)
    assert breaches(effect) == []
    monkeypatch.setattr("vegglue.effects.active_effect.ActiveEffect.on", property(lambda self: np.array([True])))
    assert ContractRule.OFF_IS_OFF in {breach.rule for breach in breaches(effect)}


@pytest.fixture(scope="module")
def everyone():
    """One member for each effect, which is on in that member alone."""
    names = [effect.name for effect in SHIPPED]
    parameters = dict.fromkeys(names, CHANNEL["parameters"][AMPLITUDE])
    every = [trial(effect).effect for effect in SHIPPED]
    works = {effect.name: {"values": {effect.amplitude.name: effect.name}} for effect in every}
    case = Case.model_validate(CHANNEL | {"source": Path("contract"), "effects": works, "parameters": parameters})
    off = np.array([effect.amplitude.off for effect in every])[:, None] * np.ones(len(SHIPPED))
    off[np.diag_indices(len(SHIPPED))] = [sizes(effect)[1] for effect in every]
    return build_problem(case, build_site(case), "flow", dict(zip(names, off, strict=True)))


@pytest.mark.slow
def test_marching_and_newton_agree_with_each_effect_on(everyone):
    """Newton's states stay where they are when marched, and states marched from one flow come to them."""
    count = everyone.members
    start = backwater(everyone)
    states = np.empty_like(start)
    for k in range(count):
        one = take(everyone, np.array([k]))
        states[..., k : k + 1] = newton(one, np.ascontiguousarray(start[..., k : k + 1]), 1e-11).state
    assert np.abs(march(everyone, states, 0.5, 4) - states).max() < 1e-8
    shared = np.repeat(states[..., -1:], count, axis=3)
    before = np.abs(shared - states)[:, ALONG].max(axis=(0, 1))
    moved = march(everyone, shared, 0.5, 300)
    after = np.abs(moved - states)[:, ALONG].max(axis=(0, 1))
    assert (after < np.maximum(0.1 * before, 1e-7)).all(), after / before
