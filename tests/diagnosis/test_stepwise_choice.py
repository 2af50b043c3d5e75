"""Which effects a model keeps, told by made-up errors at what was held out."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from vegglue.decision_constants import constants
from vegglue.diagnosis.comparison import By
from vegglue.diagnosis.stepwise_choice import (
    WAYS,
    AmplitudeNearOff,
    Choice,
    FallNotClear,
    HeldOutErrorsRose,
    Names,
    Nominee,
    NothingToHoldOut,
    NotNeeded,
    chosen,
    why_not_kept,
)
from vegglue.results.loop_results import HeldOut, InSample, ModelScore, PredictiveScores

STATIONS = 12
EXPERIMENTS = ("low", "high")
PARENT: Names = ()
A, B, C = ("a",), ("b",), ("c",)
# Held-out errors by sections and by experiments [m/s], each the same at all stations.
Errors = tuple[float, float]


def a_model_score(errors: Errors, amplitudes: Mapping[str, float], seen: float, spread: float = 0.0) -> ModelScore:
    """Amplitudes have a standard error of 1; spread: from station to station, of the errors."""
    uneven = spread * np.resize([1.0, -1.0], STATIONS)
    return ModelScore(
        name="+".join(amplitudes), title="", effects=tuple(amplitudes),
        values={name: (value, value - 1.96, value + 1.96) for name, value in amplitudes.items()},
        in_sample=InSample({}, seen, STATIONS, 0.01),
        held_out=HeldOut(
            errors[0] + uneven, errors[1] + uneven, np.ones(STATIONS, bool),
            tuple((EXPERIMENTS[i % 2], f"D{i // 2}") for i in range(STATIONS)),
        ),
        predictive=PredictiveScores(np.nan, np.nan, np.nan), homogeneity={}, validation=np.nan,
    )  # fmt: skip


def choice(
    models: Mapping[Names, Errors | None],
    named: Names = ("a", "b"),
    small: Mapping[Names, str] | None = None,
    clearly: bool = False,
    spread: float = 0.0,
) -> Choice:
    """Of models by the names in them, None where there is no flow; small: which amplitude is none in which model."""

    def score_with(names: Names) -> ModelScore | None:
        errors = models[names]
        if errors is None:
            return None
        amplitudes = {name: 0.5 if (small or {}).get(names) == name else 9.0 for name in names}
        return a_model_score(errors, amplitudes, seen=sum(errors), spread=spread if names else 0.0)

    return chosen([Nominee(name, name, 0.0) for name in named], score_with, clearly)


@pytest.mark.parametrize(
    ("models", "small", "made"),
    [
        ({A: (3, 3), B: (3, 3), A + B: (1, 2)}, {}, Choice((PARENT, A, A + B), {})),  # one after the other
        ({A: (5, 3), B: (4, 5), A + B: (1, 1)}, {}, Choice((PARENT, A + B), {})),  # only together
        ({A: (3, 3), A + B: (2, 2), B: (2, 2)}, {}, Choice((PARENT, B), {"a": NotNeeded()})),  # the next one suffices
        ({A: (3, 3), A + B: (2, 2), B: (2.5, 2.5)}, {A + B: "a"}, Choice((PARENT, B), {"a": AmplitudeNearOff()})),
        ({A: (3, 3), A + B: (2, 2), B: (2, 5)}, {A + B: "a"}, Choice((PARENT, A, A + B), {})),  # B is worse than none
    ],
)
def test_what_helps_is_added_and_what_is_not_needed_dropped(
    models: dict[Names, Errors | None], small: dict[Names, str], made: Choice
) -> None:
    assert choice({PARENT: (4, 4), **models}, small=small) == made


def test_two_of_three_are_enough_and_the_third_is_told() -> None:
    models: dict[Names, Errors | None] = {PARENT: (4, 4), A: (5, 5), B: (5, 5), C: (5, 5), A + B: (2, 2)}
    made = choice(models | {A + B + C: (3, 2)}, ("a", "b", "c"))
    assert made.stages == (PARENT, A + B)
    assert made.refused == {"c": HeldOutErrorsRose("sections", 2.0, 3.0)}


def test_what_has_no_flow_beside_others_keeps_its_own_reason() -> None:
    """Drag in the wake of a turbine was told to have no flow, which it had by itself."""
    models: dict[Names, Errors | None] = {PARENT: (4, 4), A: (5, 5), B: (6, 6), A + B: None}
    assert choice(models).refused["b"] == HeldOutErrorsRose("sections", 4.0, 6.0)


@pytest.mark.parametrize("errors", [(5.0, 1.0), (1.0, 5.0), (4.0, 4.0), None])
def test_no_model_is_left_worse_than_its_parent(errors: Errors | None) -> None:
    made = choice({PARENT: (4, 4), A: errors}, A)
    assert made.stages == (PARENT,)
    assert list(made.refused) == ["a"]


def test_a_fall_that_cannot_be_told_from_none_is_told_as_such() -> None:
    """An effect was credited with a fall of 20 +- 400: with any, that is."""
    models: dict[Names, Errors | None] = {PARENT: (4, 4), A: (3.6, 3.6)}
    unsure = choice(models, A, spread=4.0 * 0.4)
    assert unsure.stages == (PARENT, A)
    assert list(unsure.unclear) == ["a"]
    assert [by for by, *_ in unsure.unclear["a"].falls] == ["sections", "experiments"]
    assert choice(models, A, spread=0.1).unclear == {}
    errors = {PARENT: (4.0, 4.0), A: (1.0, 1.0), B: (4.0, 4.0), A + B: (0.9, 0.9)}

    def score_with(names: Names) -> ModelScore:
        return a_model_score(errors[names], dict.fromkeys(names, 9.0), sum(errors[names]), 0.3 if "b" in names else 0.0)

    both = chosen([Nominee(name, name, 0.0) for name in A + B], score_with)
    assert (both.stages[-1], list(both.unclear)) == (A + B, ["b"]), "what did the work is not in doubt"
    joint = choice({PARENT: (4, 4), A: (5, 5), B: (5, 5), A + B: (1, 1)})
    assert (joint.stages[-1], joint.unclear) == (A + B, {}), "together they clearly help"


def test_an_amplitude_compatible_with_none_is_dropped() -> None:
    made = choice({PARENT: (4, 4), A: (3, 3)}, A, small={A: "a"})
    assert made == Choice((PARENT,), {"a": AmplitudeNearOff()})


def test_in_doubt_errors_must_fall_clearly() -> None:
    models: dict[Names, Errors | None] = {PARENT: (4, 4), A: (3.9, 3.9)}
    assert choice(models, A, spread=1.0).stages == (PARENT,)  # the mean square has risen
    models[A] = (3.6, 3.6)
    assert choice(models, A, spread=1.3).stages == (PARENT, A)
    unclear = choice(models, A, clearly=True, spread=1.3)
    assert unclear.stages == (PARENT,)
    assert unclear.refused["a"] == FallNotClear("sections", constants().clear_fall)
    assert choice(models, A, clearly=True).stages == (PARENT, A)


def test_what_cannot_be_judged_is_not_added() -> None:
    made = choice({PARENT: (np.nan, np.nan), A: (np.nan, np.nan)}, A)
    assert made.stages == (PARENT,)
    assert made.refused["a"] == NothingToHoldOut(velocities=True)


def test_levels_alone_are_not_called_one_section() -> None:
    gauges = a_model_score((np.nan, np.nan), {"a": 9.0}, seen=1.0)
    gauges = replace(gauges, held_out=replace(gauges.held_out, velocity=np.zeros(STATIONS, bool)))
    assert why_not_kept(gauges, gauges, False, {}) == NothingToHoldOut(velocities=False)


@pytest.mark.parametrize(
    ("with_b", "spread", "kept"),
    [
        ((2.9, 2.9), 1.0, A),  # a little better, and far from surely
        ((1.0, 1.0), 0.0, B),  # much better, and surely
        ((3.0, 3.0), 0.0, A),
    ],
)
def test_what_is_vaguer_has_to_be_clearly_better(with_b: Errors, spread: float, kept: Names) -> None:
    """b is vague, and may be it instead of a: with b, a is needed no more."""
    models = {PARENT: (4.0, 4.0), A: (3.0, 3.0), B: with_b, A + B: with_b}

    def score_with(names: Names) -> ModelScore:
        return a_model_score(
            models[names], dict.fromkeys(names, 9.0), sum(models[names]), spread if "b" in names else 0.0
        )

    made = chosen([Nominee("a", "a", 0.0), Nominee("b", "b", 0.0, instead_of="a")], score_with)
    assert made.stages == (PARENT, kept)
    (refused,) = made.refused
    assert refused == ("b" if kept == A else "a")


@pytest.mark.parametrize(("off", "kept"), [(0.0, (PARENT,)), (np.nan, (PARENT, A))])
def test_one_of_several_amplitudes_near_off_shows_nothing(off: float, kept: tuple[Names, ...]) -> None:
    models = {PARENT: a_model_score((3.0, 3.0), {}, 6.0), A: a_model_score((1.0, 1.0), {"a": 0.5}, 1.0)}
    assert chosen([Nominee("a", "a", off)], lambda names: models[names]).stages == kept


@pytest.mark.parametrize(("by", "group"), [("experiments", "high"), ("sections", "D0")])
def test_what_acts_in_one_group_is_not_judged_there(by: By, group: str) -> None:
    """There it is not known, and errors rise; where it is, they fall."""
    parent, child = (a_model_score((3.0, 3.0), {}, 6.0), a_model_score((3.0, 3.0), {"a": 9.0}, 1.0))
    there = np.array([group in pair for pair in child.held_out.clusters])
    errors = {name: np.where(there, 9.0, 2.0) if name == by else getattr(child.held_out, name) for name in WAYS}
    child = replace(child, held_out=replace(child.held_out, **errors))
    models = {PARENT: parent, A: child}

    def kept(one: Nominee) -> tuple[Names, ...]:
        return chosen([one], lambda names: models[names]).stages

    assert kept(Nominee("a", "a", 0.0)) == (PARENT,)
    assert kept(Nominee("a", "a", 0.0, only_in={by: group})) == (PARENT, A)
    assert kept(Nominee("a", "a", 0.0, only_in={by: "another"})) == (PARENT,)
    rose = chosen([Nominee("a", "a", 0.0)], lambda names: models[names]).refused["a"]
    assert isinstance(rose, HeldOutErrorsRose)
    assert (rose.by, rose.before) == (by, pytest.approx(3.0))


@pytest.mark.parametrize(
    ("sections", "uneven", "kept"),
    [
        (1.0, 1.5, (PARENT, A)),  # much less by sections, more by experiments, but not clearly
        (1.0, 0.05, (PARENT,)),  # much less and clearly more
        (2.95, 1.5, (PARENT,)),  # less, but by less than it is more
    ],
)
def test_a_larger_fall_one_way_outweighs_a_rise_that_is_not_clear(
    sections: float, uneven: float, kept: tuple[Names, ...]
) -> None:
    spread = np.resize([1.0, -1.0], STATIONS)
    child = a_model_score((sections, 3.0), {"a": 9.0}, 1.0)
    errors = {"sections": sections + 0.1 * spread, "experiments": np.hypot(3.1 + uneven * spread, 0.0)}
    models = {PARENT: a_model_score((3.0, 3.0), {}, 6.0), A: replace(child, held_out=replace(child.held_out, **errors))}
    assert chosen([Nominee("a", "a", 0.0)], lambda names: models[names]).stages == kept
