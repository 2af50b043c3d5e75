"""From what was found to a verdict: when it names, when it only notes, when it cannot tell, and why."""

from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
from diagnoses import (
    IMPLAUSIBLE,
    a_candidate_effect,
    a_diagnosis,
    a_field,
    an_anomaly,
    an_instrument,
    candidate_laws_of,
)
from verdicts import ABSURD, AS_STATED, FITS, MISSES, NONE, step, tags, verdict_on

from vegglue.calibration.candidates import Instrument
from vegglue.calibration.fit import chance_of_misfit
from vegglue.diagnosis.competition import Hypothesis
from vegglue.diagnosis.refits import Refit
from vegglue.diagnosis.search_state import rivals_in, undecided_of
from vegglue.results.causes import CandidateEffect, ModelErrorUsed, Rival, Step
from vegglue.results.verdict import (
    AmplitudeAtBound,
    AmplitudeBeyondPlausible,
    BedCorrected,
    ChiSquare,
    CorrelatedErrors,
    EffectsNotExcluded,
    EffectsStillSignificant,
    EffectsTested,
    EffectsUntestable,
    ErrorsLargerThanStated,
    ErrorsStillLarger,
    EstimatedErrors,
    HeldOutMissed,
    ImplausibleAmplitude,
    MisfitBeyondErrors,
    ModelErrorExceeded,
    NameHangsOnSection,
    NeighboursCorrelated,
    NeighboursExcluded,
    NoFlowHeldOut,
    Note,
    OneSection,
    ParameterFarFromPrior,
    Reason,
    Remaining,
    StatedErrorsTooSmall,
    UncertainBetweenSections,
    is_too_small,
)
from vegglue.wording import sentences as wording


def blind(name: str, **detectability: Any) -> CandidateEffect:
    return a_candidate_effect(name, detectability={"testable": False, **detectability})


def test_nothing_is_missing_only_if_it_would_be_seen() -> None:
    assert verdict_on().kind == "nothing-missing"
    few = verdict_on(candidates=(NONE, *[blind("wind")] * 9))
    assert (few.kind, tags(few.reasons), few.tested) == ("cannot-tell", ["few_testable"], EffectsTested(1, 10, 1))
    poor = verdict_on(misfit=MISSES)
    assert (poor.kind, tags(poor.reasons)) == ("cannot-tell", ["misfit_unexplained"])


NEEDS_MORE = ModelErrorUsed(0.05, 0.01, needed=3.0, log_ratio=9.0)
# What takes silence away, the same just within its bounds, and the reason.
UNEARNED: list[tuple[dict[str, Any], dict[str, Any], Reason]] = [
    ({"errors": replace(AS_STATED, scale=1.3)}, {"errors": replace(AS_STATED, scale=1.2)}, ErrorsLargerThanStated(1.3)),
    ({"errors": replace(AS_STATED, correlation=0.85)}, {"errors": replace(AS_STATED, correlation=0.75)},
     CorrelatedErrors(0.85)),
    ({"neighbours": True}, {"neighbours": False}, NeighboursExcluded()),
    ({"model_error": NEEDS_MORE}, {"model_error": replace(NEEDS_MORE, log_ratio=3.0)}, ModelErrorExceeded(3.0, 0.05)),
    ({"model_error": NEEDS_MORE}, {"model_error": replace(NEEDS_MORE, needed=0.25)}, ModelErrorExceeded(3.0, 0.05)),
    ({"held_out": 1.5}, {"held_out": 1.2}, HeldOutMissed(1.5)),
    ({"held_out": 2.1, "by_chance": 1.96}, {"held_out": 1.9, "by_chance": 1.96}, HeldOutMissed(2.1)),
    ({"held_out": np.inf}, {"held_out": 1.0}, NoFlowHeldOut()),
    ({"held_out": 1.5}, {"held_out": float("nan")}, HeldOutMissed(1.5)),
]  # fmt: skip


@pytest.mark.parametrize(("too_much", "within", "why"), UNEARNED)
def test_silence_has_to_be_earned(too_much: dict[str, Any], within: dict[str, Any], why: Reason) -> None:
    found = verdict_on(**too_much)
    assert (found.kind, found.reasons) == ("cannot-tell", (why,))
    assert verdict_on(**within).kind == "nothing-missing"


@pytest.mark.parametrize(("too_much", "within", "why"), UNEARNED)
def test_an_instrument_alone_is_a_verdict_only_if_silence_is_earned(
    too_much: dict[str, Any], within: dict[str, Any], why: Reason
) -> None:
    off = (an_instrument(),)
    found = verdict_on(instruments=off, **too_much)
    assert (found.kind, found.reasons, found.clears_the_model) == ("cannot-tell", (why,), False)
    assert found.instruments == (() if why == NeighboursExcluded() else off)
    found = verdict_on(instruments=off, **within)
    assert (found.kind, found.instruments, found.clears_the_model) == ("instrument", off, True)


def test_silence_is_not_earned_if_the_model_may_miss_between_the_sections() -> None:
    found = verdict_on(between=1.5)
    assert (found.kind, found.reasons) == ("cannot-tell", (UncertainBetweenSections(1.5),))
    assert verdict_on(between=1.2).kind == "nothing-missing"
    assert verdict_on(between=float("nan")).kind == "nothing-missing"


def test_only_a_verdict_without_anything_missing_clears_the_model() -> None:
    off = (an_instrument(),)
    assert verdict_on().clears_the_model
    assert verdict_on(instruments=off).clears_the_model
    assert not verdict_on(instruments=off, between=1.5).clears_the_model
    assert not verdict_on(step("a")).clears_the_model


def test_a_faint_instrument_is_no_verdict_and_is_noted_all_the_same() -> None:
    """0.1 m/s is clear with a standard error of 0.010 m/s; with 0.026 it is 3.9 of them."""
    clear, faint = an_instrument(x=3.0), an_instrument(interval95=(0.05, 0.15))
    for between in (1.0, 1.5):
        found = verdict_on(instruments=(clear,), between=between)
        assert (found.kind, found.instruments, found.notes) == ("instrument", (clear,), ())
        found = verdict_on(instruments=(faint,), between=between)
        assert found.kind == ("nothing-missing" if between < 1.5 else "cannot-tell")
        assert found.instruments == ()
        (note,) = found.notes
        assert (note.instrument, note.clear, note.least) == (faint, False, 4.5)
        found = verdict_on(instruments=(clear, faint), between=between)
        assert (found.kind, found.instruments) == (("instrument", (clear,)) if between < 1.5 else ("cannot-tell", ()))


@pytest.mark.parametrize(
    "off",
    [an_instrument(kind="probe", x=np.nan), an_instrument(kind="position"), an_instrument(kind="gauge", factor=1.2)],
)
def test_every_kind_of_instrument_is_named_or_noted(off: Any) -> None:
    assert verdict_on(instruments=(off,)).instruments == (off,)
    assert verdict_on(step("a"), instruments=(off,)).instruments == (off,)
    assert [one.instrument for one in verdict_on(places=(an_anomaly(),), instruments=(off,)).notes] == [off]


def test_values_that_cannot_be_come_before_all_else() -> None:
    found = verdict_on(step("a"), places=(an_anomaly(),), field=a_field(), implausible=(IMPLAUSIBLE,))
    assert (found.kind, found.reasons, found.doubts_the_data) == ("cannot-tell", (IMPLAUSIBLE,), True)


def test_the_doubt_about_the_data_does_not_hang_on_words(monkeypatch: pytest.MonkeyPatch) -> None:
    doubted = verdict_on(implausible=(IMPLAUSIBLE,))
    reworded = {**wording.macros(), "verdict": lambda _: "Anything else."}
    monkeypatch.setattr(wording, "macros", lambda: reworded)
    assert doubted.sentence == "Anything else."
    assert doubted.doubts_the_data
    assert not verdict_on().doubts_the_data


def test_effects_below_the_alarm_are_not_excluded_unless_the_misfit_is_poor() -> None:
    groups = (("effect0", "effect1"), tuple(f"effect{k}" for k in range(2, 11)))
    found = verdict_on(not_excluded=groups)
    assert found.kind == "nothing-missing"
    assert found.notes == (EffectsNotExcluded(tuple(f"effect{k}" for k in range(11)), beside=False),)
    assert verdict_on(step("a"), not_excluded=groups).notes[0].beside
    assert verdict_on(misfit=MISSES, not_excluded=groups).notes == ()


def test_an_alarm_that_nothing_came_of_is_no_all_clear() -> None:
    hypotheses = tuple(
        Hypothesis("effect", name, evidence, 0, None)
        for name, evidence in (("wind", 2.0), ("elder", 0.0), ("jet", 0.0))
    )
    alone = undecided_of(hypotheses, (), np.array([])).chances
    found = undecided_of(hypotheses, ("wind", "elder"), np.array([0.25, 0.75]))
    assert found.chances == pytest.approx((0.25 * (1.0 - alone[2]), 0.75 * (1.0 - alone[2]), alone[2]))
    verdict = verdict_on(undecided=rivals_in(found))
    assert (verdict.kind, tags(verdict.reasons)) == ("cannot-tell", ["none_leads"])
    assert [one.name for one in verdict.undecided] == ["elder", "wind", "jet"]


def test_what_competed_last_keeps_its_place() -> None:
    spot = Refit(None, {"x": 9.8, "y": 0.5}, None, 5.0, -0.3, (-0.4, -0.2))
    probe = Instrument("position", (1, 2), 14.2, 1.5)
    hypotheses = (
        Hypothesis("position", "position", 2.0, 0, probe), Hypothesis("bed", "unlisted_bed[x9.8,y0.5]", 3.0, 0, spot),
    )  # fmt: skip
    bed, position = rivals_in(undecided_of(hypotheses, (), np.array([])))
    assert bed == Rival("unlisted_bed[x9.8,y0.5]", "bed", bed.probability, 9.8, 0.5, -0.3)
    assert (position.kind, position.x, position.y) == ("position", 14.2, 1.5)
    assert verdict_on(undecided=(bed, position)).kind == "cannot-tell"


@pytest.mark.parametrize(("rivals", "kind"), [("a", "identified"), ("abc", "one-of"), ("abcd", "cannot-tell")])
def test_a_set_of_more_than_three_groups_names_nothing(rivals: str, kind: str) -> None:
    found = verdict_on(step(*rivals))
    assert found.kind == kind
    assert tags(found.reasons) == (["too_many_groups"] if kind == "cannot-tell" else [])


def test_an_effect_comes_with_its_rivals_the_likeliest_first() -> None:
    both = Step("a", ("a", "b", "c"), (0.5, 0.3, 0.06), (("a", "b"), ("c",)), 200.0, 5.0, 1e-4)
    (found,) = verdict_on(replace(both, others={"reading": 0.04, "bed": 0.11})).effects
    assert (found.alike, found.probability) == (("b",), pytest.approx(0.8))
    assert [(one.name, one.kind) for one in found.rivals] == [("bed", "bed"), ("c", "effect"), ("reading", "reading")]
    assert verdict_on(step("a", chances=(0.8,), others={"position": 0.15})).kind == "one-of"


def test_a_place_that_is_likelier_leads_unless_alike_effects_are_likelier_together() -> None:
    bed, inflow = an_anomaly(term="bed", unit="m", x=12.0), an_anomaly(term="inflow", unit="m3/s")
    places = {"unlisted_bed": bed, "unlisted_inflow": inflow}
    found = verdict_on(step("a", chances=(0.24,), others={"unlisted_inflow": 0.1, "unlisted_bed": 0.66}, places=places))
    (effect,) = found.effects
    assert (found.kind, effect.likelier, effect.likelier_probability) == ("one-of", bed, 0.66)
    assert effect.rivals == (Rival("unlisted_inflow", "inflow", 0.1, inflow.x, inflow.y, inflow.amplitude),)
    alike = Step("a", ("a", "b"), (0.3, 0.25), (("a", "b"),), 200.0, 5.0, 1e-4, {"bed": 0.45}, {"bed": bed})
    (effect,) = verdict_on(alike).effects
    assert effect.likelier is None
    assert [one.kind for one in effect.rivals] == ["bed"]


def test_an_implausible_size_is_noted() -> None:
    usual = a_candidate_effect("a", amplitude={"value": 0.9, "scale": 0.5})
    huge = a_candidate_effect("a", amplitude={"value": -0.34, "scale": 0.1})
    assert verdict_on(step("a"), candidates=(usual,)).notes == ()
    assert verdict_on(step("a"), candidates=(huge,)).notes == (ImplausibleAmplitude("a", pytest.approx(3.4)),)


AT_ITS_END = {"value": 1.0, "support": (-1.0, 1.0), "scale": 0.5}
# What takes a name away, the same just within its bounds, the amplitude in both, and the reason.
DOUBTED: list[tuple[dict[str, Any], dict[str, Any], dict[str, Any], dict[str, Any], Reason]] = [
    ({"misfit": ABSURD}, {"misfit": MISSES}, {}, {}, MisfitBeyondErrors(6.0**0.5)),
    ({"strained": ("k_s", 4.5)}, {"strained": ("k_s", 3.5)}, {}, {}, ParameterFarFromPrior("k_s", 4.5)),
    ({}, {}, AT_ITS_END, AT_ITS_END | {"value": 0.97}, AmplitudeAtBound(("a",))),
    ({}, {}, {"value": 3.0, "scale": 0.5}, {"value": 1.9, "scale": 0.5}, AmplitudeAtBound(("a",))),
    ({}, {}, {"value": 2.9, "scale": 0.5}, {"value": 1.9, "scale": 0.5}, AmplitudeBeyondPlausible("a", 5.8)),
    ({}, {}, AT_ITS_END | {"value": -0.996}, AT_ITS_END | {"value": -0.97}, AmplitudeAtBound(("a",))),
]


@pytest.mark.parametrize(("too_much", "within", "amplitude", "smaller", "why"), DOUBTED)
def test_a_name_and_a_place_have_to_be_earned(
    too_much: dict[str, Any], within: dict[str, Any], amplitude: dict[str, Any], smaller: dict[str, Any], why: Reason
) -> None:
    found = verdict_on(step("a"), candidates=(a_candidate_effect("a", amplitude=amplitude),), **too_much)
    assert (found.kind, found.reasons) == ("cannot-tell", (why,))
    assert [one.name for one in found.effects] == ["a"]
    fits = verdict_on(step("a"), candidates=(a_candidate_effect("a", amplitude=smaller),), **within)
    assert fits.kind == "identified"
    if too_much:
        assert verdict_on(places=(an_anomaly(),), **too_much).reasons == (why,)
        assert verdict_on(places=(an_anomaly(),), **within).kind == "none-of-these"


def test_a_place_many_times_as_large_as_plausible_is_none() -> None:
    found = verdict_on(places=(an_anomaly(amplitude=-4.4),))
    assert (found.kind, found.reasons) == ("cannot-tell", (AmplitudeBeyondPlausible("drag at a place", 4.4),))
    assert verdict_on(places=(an_anomaly(amplitude=3.9),)).kind == "none-of-these"


@pytest.mark.parametrize(
    "candidates",
    [
        (a_candidate_effect("a"), a_candidate_effect("b", amplitude=AT_ITS_END)),  # not accepted
        (
            a_candidate_effect("a", amplitude={"value": 0.005, "support": (0.0, 1.0), "off": 0.0}),
        ),  # at the end it is off
        (a_candidate_effect("a", amplitude={"support": (-np.inf, np.inf), "value": 3.0, "scale": 2.0}),),  # no end
    ],
)
def test_what_is_not_at_a_bound(candidates: tuple[CandidateEffect, ...]) -> None:
    assert verdict_on(step("a"), candidates=candidates).kind == "identified"


def test_a_misfit_that_remains_is_noted_beside_a_name_only() -> None:
    assert "misfit_remains" in tags(verdict_on(step("a"), misfit=MISSES).notes)
    for found in (verdict_on(step("a")), verdict_on(misfit=MISSES), verdict_on(step(*"abcd"), misfit=MISSES)):
        assert "misfit_remains" not in tags(found.notes)


def test_a_name_comes_with_what_its_model_still_asks_for() -> None:
    twice, one = replace(AS_STATED, scale=2.1), {"b": 0.008}
    found = verdict_on(step("a"), errors=twice, significant_effects=one)
    significant = EffectsStillSignificant((("b", 0.008),), remainder=False)
    assert (found.kind, found.remaining) == ("identified", (ErrorsStillLarger(2.1), significant))
    assert found.significant_effects == one
    assert found.left_over in found.sentence
    assert "stated_errors_too_small" not in tags(found.notes), "twice"
    assert verdict_on(places=(an_anomaly(),), errors=twice).remaining == (ErrorsStillLarger(2.1),)
    many = {f"e{k}": 0.001 * k for k in range(5, 0, -1)} | {"least": 1 / 3001}
    (ranked,) = verdict_on(step("a"), significant_effects=many, remainder=True).remaining
    assert [name for name, _ in ranked.effects] == ["least", "e1", "e2", "e3", "e4", "e5"]
    assert ranked.remainder


@pytest.mark.parametrize("parts", [{"steps": (step("a"),)}, {"places": (an_anomaly(),)}])
def test_no_name_stands_beside_errors_many_times_as_large_as_stated(parts: dict[str, Any]) -> None:
    """In the wake of a turbine two names were told beside errors six times as large as stated."""
    steps = parts.pop("steps", ())
    found = verdict_on(*steps, errors=replace(AS_STATED, scale=6.0), **parts)
    assert (found.kind, found.reasons) == ("cannot-tell", (ErrorsLargerThanStated(6.0),))
    assert found.conclusion == "best_explanation"


@pytest.mark.parametrize(
    "parts",
    [
        {"steps": [step("a")], "errors": replace(AS_STATED, scale=1.2)},
        {"errors": replace(AS_STATED, scale=2.1), "laws": candidate_laws_of("a"), "misfit": MISSES},
        {"errors": replace(AS_STATED, scale=2.1), "instruments": (an_instrument(),)},
        {"significant_effects": {"b": 0.008}},
    ],
)
def test_nothing_remains_without_a_name_that_is_clear(parts: dict[str, Any]) -> None:
    assert verdict_on(*parts.pop("steps", ()), **parts).remaining == ()


def test_errors_that_are_not_as_stated_are_noted() -> None:
    found = verdict_on(errors=EstimatedErrors(0.4, 1.2, 0.0, (3, 4)))
    assert found.notes == (NeighboursCorrelated(0.4), StatedErrorsTooSmall(1.2))
    assert verdict_on().notes == ()


@pytest.mark.parametrize(("needed", "log_ratio", "more"), [(0.5, 1.0, False), (9.0, 0.6, False), (9.0, 5.0, True)])
def test_the_allowed_model_error_is_noted(needed: float, log_ratio: float, more: bool) -> None:
    used = ModelErrorUsed(0.05, 0.01, needed, log_ratio)
    assert verdict_on(model_error=used).notes == (used,)
    assert used.asks_for_more is more


def test_untestable_effects_are_noted_by_what_they_look_like() -> None:
    parts = {"k_s": (20, -0.9), "n_b": (5, 0.9), "phi": (1, 0.2)}
    hidden = [
        blind(f"of_{name}{k}", confounder=name, cosine=cosine)
        for name, (count, cosine) in parts.items()
        for k in range(count)
    ]
    (note,) = verdict_on(candidates=tuple(hidden)).notes
    assert [(parameter, len(names)) for parameter, names in note.groups] == [("k_s", 20), ("n_b", 5), ("", 1)]
    assert (note.effects, note.candidates, note.also) == (26, 26, False)


def test_what_is_named_or_significant_is_not_called_untestable() -> None:
    hidden = (blind("wind"), blind("elder"))
    assert verdict_on(step("wind"), candidates=hidden).notes == (EffectsUntestable((("", ("elder",)),), 1, 1, True),)
    both = verdict_on(step("wind"), candidates=hidden, significant_effects={"elder": 0.008})
    assert "effects_untestable" not in tags(both.notes)


def test_candidates_are_not_counted_as_effects() -> None:
    """One effect in three experiments counted as three: 54 effects in the pages, 62 and 67 in the terminal."""
    in_each = [a_candidate_effect(f"discharge_error[{name}]") for name in ("low", "mid", "high")]
    assert verdict_on(candidates=(*in_each, NONE)).tested == EffectsTested(2, 4, 4)


def test_a_misfit_far_smaller_than_its_errors_is_noted() -> None:
    assert tags(verdict_on(misfit=ChiSquare(61.5, 150, 1.0)).notes) == ["misfit_too_small"]
    assert verdict_on(misfit=FITS).notes == ()
    chi2 = np.random.default_rng(5).chisquare(40, 20_000)
    assert 2e-4 < np.mean([is_too_small(one, 40) for one in chi2]) < 2e-3
    assert [is_too_small(150.0 * ratio, 150) for ratio in (0.41, 0.6, 0.9, 3.0)] == [True, True, False, False]
    assert not is_too_small(0.41 * 6, 6)
    assert not is_too_small(0.0, 0)


def test_every_reason_and_note_has_words() -> None:
    kinds = {wording.tag_of(one) for one in (*get_args(Reason), *get_args(Note), *get_args(Remaining))}
    assert kinds <= wording.macros().keys()


def test_the_chance_of_a_misfit() -> None:
    assert chance_of_misfit(5.0, 5) == pytest.approx(0.4159, abs=1e-3)
    assert np.isfinite(chance_of_misfit(0.0, 0))


# Places, fields and laws, and how they go before effects and instruments.


def test_a_place_wins_over_steps_and_all_are_named() -> None:
    places = (an_anomaly(), an_anomaly(term="bed", unit="m", x=12.0))
    found = verdict_on(step("a"), places=places, misfit=MISSES)
    assert (found.kind, found.places, found.anomaly) == ("none-of-these", places, places[0])
    assert [one.name for one in found.effects] == ["a"]


@pytest.mark.parametrize("term", ["drag", "bed", "inflow", "viscosity"])
@pytest.mark.parametrize("amplitude", [0.4, -0.4])
def test_a_place_of_every_term_and_sign_has_words(term: str, amplitude: float) -> None:
    assert verdict_on(places=(an_anomaly(term=term, amplitude=amplitude),)).kind == "none-of-these"


@pytest.mark.parametrize(
    ("odds", "nearest"),
    [
        ({"wind": 2000.0, "bed": 400.0, "viscosity": 7000.0}, ["bed"]),
        ({"bed": 400.0, "wind": 8.0, "probe": 9.0}, ["bed", "wind"]),
        ({"probe": 8.0}, ["probe"]),
        ({"wind": 21.0}, []),
    ],
)
def test_odds_are_against_the_nearest_term_and_what_is_known_and_near(
    odds: dict[str, float], nearest: list[str]
) -> None:
    assert [name for name, _ in an_anomaly(odds=odds).nearest_odds] == nearest


@pytest.mark.parametrize("term", ["friction", "bed", "viscosity", "inflow"])
def test_a_field_is_none_of_the_known_effects(term: str) -> None:
    found = verdict_on(step("a"), field=a_field(term=term))
    assert (found.kind, found.field) == ("none-of-these", a_field(term=term))


UNSURE = (Rival("wind", "effect", 1.0),)  # what competed last and led to nothing
LIKELY, UNLIKELY = candidate_laws_of("law_bank_speed_step", "law_bank_speed_ramp"), candidate_laws_of("a", chance=0.2)


def test_a_likely_law_is_none_of_the_known_effects() -> None:
    found = verdict_on(laws=LIKELY, misfit=MISSES)
    assert (found.kind, found.laws, found.tells_laws, found.notes) == ("none-of-these", LIKELY, True, ())
    assert verdict_on(laws=LIKELY, undecided=UNSURE).kind == "none-of-these"


def test_a_clear_instrument_goes_before_a_law_that_is_not_likelier_than_all_else() -> None:
    clear, faint = an_instrument(), an_instrument(interval95=(0.04, 0.16))
    found = verdict_on(laws=UNLIKELY, instruments=(clear,))
    assert (found.kind, found.instruments, found.laws) == ("instrument", (clear,), UNLIKELY)
    assert not found.clears_the_model
    assert verdict_on(laws=UNLIKELY, instruments=(clear, faint)).kind == "cannot-tell"
    beside = verdict_on(laws=UNLIKELY, instruments=(clear,), neighbours=True)
    assert (beside.kind, beside.reasons) == ("cannot-tell", (NeighboursExcluded(),))
    assert verdict_on(laws=LIKELY, instruments=(clear,)).kind == "none-of-these"


def test_with_significant_laws_the_verdict_is_never_nothing_missing() -> None:
    """Not if they are less likely than all else together, nor if a parameter lies far off its prior."""
    for parts in ({"laws": UNLIKELY}, {"laws": LIKELY, "strained": ("k_s", 4.5)}):
        found = verdict_on(**parts)
        assert (found.kind, found.laws) == ("cannot-tell", parts["laws"])


@pytest.mark.parametrize(
    ("steps", "parts"), [((), {"places": (an_anomaly(),)}), ((), {"undecided": UNSURE, "strained": ("k_s", 4.5)})]
)
def test_a_law_beside_what_was_found_is_a_note(steps: tuple[Step, ...], parts: dict[str, Any]) -> None:
    found = verdict_on(*steps, laws=LIKELY, **parts)
    assert found.laws is None
    (note,) = [one for one in found.notes if wording.tag_of(one) == "law_stands_out"]
    assert (note.laws, note.instead_of) == (LIKELY, tuple(one.accepted for one in steps))


@pytest.mark.parametrize(("chance", "kind"), [(0.95, "none-of-these"), (0.6, "one-of"), (0.2, "one-of")])
def test_a_law_and_a_listed_effect_are_one_competition(chance: float, kind: str) -> None:
    laws = replace(LIKELY, chance=chance)
    found = verdict_on(step("a"), laws=laws)
    assert (found.kind, found.laws, [one.name for one in found.effects]) == (kind, laws, ["a"])
    beside = verdict_on(step("a"), laws=replace(laws, needed=False))
    assert (beside.kind, beside.conclusion) == ("one-of", "law_or_effects"), "beside a nothing is left for it"
    doubted = verdict_on(step("a"), laws=laws, strained=("k_s", 4.5))
    assert (doubted.kind, doubted.laws) == ("cannot-tell", None)


def test_a_law_is_worth_a_search_unless_another_cause_comes_first() -> None:
    for kind, laws, worth in (("cannot-tell", None, False), ("cannot-tell", LIKELY, True), ("one-of", None, True)):
        assert replace(a_diagnosis(verdict={"kind": kind, "laws": laws}), laws=LIKELY).law_stands_out is worth


def test_a_name_that_hangs_on_one_section_is_none() -> None:
    """Three sections, one out in turn, gave three answers."""
    found = {"candidates": (a_candidate_effect("wind"),), "steps": (step("wind"),), "misfit": FITS}
    assert verdict_on(**found).kind in ("identified", "one-of")
    hanging = verdict_on(**found, hangs_on=NameHangsOnSection("wind", "B", "waves"))
    assert (hanging.kind, tags(hanging.reasons)) == ("cannot-tell", ["name_hangs_on_section"])


def test_one_section_in_one_experiment_gives_no_name() -> None:
    """A transect of the Tanana: a lower bed 47 m upstream, over 1,000 to 1."""
    of_wind = {"candidates": (a_candidate_effect("wind"),), "steps": (step("wind"),), "misfit": FITS}
    for found in (of_wind, {"places": (an_anomaly(),)}, {"laws": LIKELY}):
        told = verdict_on(**found, one_section=OneSection("T"))
        assert (told.kind, tags(told.reasons)) == ("cannot-tell", ["one_section"])
    assert verdict_on(misfit=FITS, one_section=OneSection("T")) == verdict_on(misfit=FITS), "silence has its own rules"
    doubted = verdict_on(
        **of_wind | {"misfit": MISSES}, errors=replace(AS_STATED, scale=7.2), one_section=OneSection("T")
    )
    assert tags(doubted.reasons) == ["one_section", "errors_larger_than_stated"], "no other doubt stands before it"


def test_no_law_is_named_beside_errors_without_sense() -> None:
    laws = candidate_laws_of("law_bank_speed_step")
    for absurd in ({"errors": replace(AS_STATED, scale=7.2)}, {"model_error": replace(NEEDS_MORE, needed=9.0)}):
        found = verdict_on(laws=laws, misfit=MISSES, **absurd)
        assert found.kind == "cannot-tell"
        assert tags(found.reasons)[0] in ("errors_larger_than_stated", "model_error_exceeded")


A_POOL = BedCorrected(49.0, -1.2, 1.4, 0.9, 1.3, 1.3, -0.3, (-0.45, -0.15), 9.2, 3.1, (45.0, 54.0))
A_BAR = replace(A_POOL, x=60.0, change=0.2, interval95=(0.1, 0.3), local_log_factor=1.0)


@pytest.mark.parametrize(
    ("parts", "told"),
    [
        ({}, True),
        ({"instruments": (an_instrument(interval95=(0.09, 0.11)),)}, True),
        ({"misfit": MISSES}, False),  # cannot tell
        ({"errors": replace(AS_STATED, scale=1.5)}, False),
        ({"places": (an_anomaly(),)}, False),  # named itself
    ],
)
def test_where_the_bed_differs_is_told_by_a_verdict_without_doubt(parts: dict[str, Any], told: bool) -> None:
    plain, found = verdict_on(**parts), verdict_on(**parts, bed=(A_POOL, A_BAR))
    assert found.kind == plain.kind
    assert found.bed == (A_POOL if told else None)
    assert [one for one in found.notes if isinstance(one, BedCorrected)] == ([A_BAR] if told else [A_POOL, A_BAR])
    if told:
        assert found.where is not None
        assert (found.where["term"], found.where["x"], found.where["amplitude"]) == ("bed", 49.0, -0.3)
    else:
        assert found.where == plain.where


def test_a_surveyed_line_is_the_place_of_a_verdict() -> None:
    line = an_instrument(kind="line", x=36.0, y=0.0, stations=(), offset=0.15, interval95=(0.11, 0.19), unit="m")
    found = verdict_on(instruments=(line,), bed=(A_POOL,))
    assert (found.kind, found.instruments) == ("instrument", (line,))
    assert found.where is not None
    assert (found.where["term"], found.where["x"], found.where["amplitude"]) == ("line", 36.0, 0.15)
    # One that may be chance is excluded, and no verdict.
    unclear = replace(line, interval95=(0.05, 0.25))
    assert verdict_on(instruments=(unclear,)).kind == "nothing-missing"
