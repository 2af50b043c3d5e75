"""From what was found to a verdict in words: when it names, when it only remarks, and when it cannot tell."""

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from diagnoses import a_candidate_effect, a_field, an_anomaly, an_instrument, candidate_laws_of
from verdicts import ABSURD, AS_STATED, MISSES, NONE, inputs, said, step

from vegglue.calibration.candidates import Instrument
from vegglue.calibration.fit import chance_of_misfit
from vegglue.diagnosis.competition import Hypothesis
from vegglue.diagnosis.refits import Refit
from vegglue.diagnosis.rivals import undecided_of
from vegglue.results.causes import ModelErrorUsed, Step
from vegglue.results.diagnosis import Misfit
from vegglue.results.verdict import EstimatedErrors, make_verdict


def test_nothing_is_missing_only_where_it_would_be_seen() -> None:
    assert said(inputs())[0] == "nothing-missing"
    blind = [a_candidate_effect("wind", detectability={"testable": False})] * 9
    assert said(inputs(), [NONE, *blind])[0] == "cannot-tell"
    assert said(inputs(misfit=MISSES))[0] == "cannot-tell"


NEEDS_MORE = ModelErrorUsed(0.05, 0.01, needed=3.0, log_ratio=9.0)
# What takes silence away, the same just within its bounds, and what is said of it.
UNEARNED = {
    "scale": ({"errors": replace(AS_STATED, scale=1.3)}, {"errors": replace(AS_STATED, scale=1.2)}, "1.3 times"),
    "correlation": (
        {"errors": replace(AS_STATED, correlation=0.85)},
        {"errors": replace(AS_STATED, correlation=0.75)},
        "correlated by 0.85",
    ),
    "neighbours": ({"neighbours": True}, {"neighbours": False}, "side by side"),
    "model error": (
        {"model_error": NEEDS_MORE},
        {"model_error": replace(NEEDS_MORE, log_ratio=3.0)},
        "15% in friction where 5%",
    ),
    "less model error": ({"model_error": NEEDS_MORE}, {"model_error": replace(NEEDS_MORE, needed=0.25)}, "15%"),
    "unseen": ({"unseen": 1.5}, {"unseen": 1.2}, "1.5 times what is expected"),
    "few unseen": ({"unseen": 2.1, "by_chance": 1.96}, {"unseen": 1.9, "by_chance": 1.96}, "2.1 times what is exp"),
    "no flow there": ({"unseen": np.inf}, {"unseen": 1.0}, "no steady flow in experiments that were not calibrated"),
    "unseen beside others": ({"unseen": 1.5}, {"unseen": float("nan")}, "not calibrated to"),
}


@pytest.mark.parametrize("why", UNEARNED)
def test_silence_has_to_be_earned(why: str) -> None:
    too_much, within, words = UNEARNED[why]
    kind, sentence, _ = said(inputs(**too_much))
    assert kind == "cannot-tell"
    assert words in sentence
    assert said(inputs(**within))[0] == "nothing-missing"


@pytest.mark.parametrize("why", UNEARNED)
def test_an_instrument_alone_is_named_only_where_silence_is_earned(why: str) -> None:
    too_much, within, _ = UNEARNED[why]
    kind, sentence, _ = said(inputs(instruments=(an_instrument(),), **too_much))
    assert kind == "cannot-tell"
    assert sentence.startswith("Nothing" if why == "neighbours" else "One reading at x = 36, y = 1 m is off by 0.1 m/s")
    assert "Nothing is missing" not in sentence
    kind, sentence, _ = said(inputs(instruments=(an_instrument(),), **within))
    assert kind == "instrument"
    assert "One reading at x = 36, y = 1 m is off by 0.1 m/s (0.08 to 0.12); it was set aside." in sentence
    assert "Nothing else is missing" in sentence


def test_silence_is_not_earned_where_the_model_may_miss_between_the_sections() -> None:
    kind, sentence, _ = said(inputs(between=1.5))
    assert kind == "cannot-tell"
    assert "the model may miss by as much as 1.5 times the errors of the data" in sentence
    assert said(inputs(between=1.2))[0] == "nothing-missing"
    assert said(inputs(between=float("nan")))[0] == "nothing-missing"


def test_only_a_verdict_that_says_so_clears_the_model() -> None:
    off, candidate_effects = (an_instrument(),), (NONE,)
    assert make_verdict(inputs(), candidate_effects).clears_the_model
    assert make_verdict(inputs(instruments=off), candidate_effects).clears_the_model
    assert not make_verdict(inputs(instruments=off, between=1.5), candidate_effects).clears_the_model
    assert not make_verdict(inputs(step("a")), [a_candidate_effect("a")]).clears_the_model


def test_an_instrument_has_to_be_off_by_more_where_the_flow_is_unsure() -> None:
    """0.1 m/s is clear with a standard error of 0.010 m/s; with 0.026 it is 3.9 of them. It is told all the same."""
    clear, faint = an_instrument(), an_instrument(interval95=(0.05, 0.15))
    kind, sentence, _ = said(inputs(instruments=(clear,), between=1.5))
    assert kind == "instrument"
    assert "it was set aside. Nothing else stands out (chi2 is " in sentence
    assert "freedom), but where nobody measured" in sentence
    kind, sentence, remarks = said(inputs(instruments=(faint,), between=1.5))
    assert kind == "cannot-tell"
    assert "it was set aside" not in sentence
    assert "is off by 0.1 m/s (0.05 to 0.15); it was set aside." in remarks
    assert said(inputs(instruments=(clear, faint), between=1.5))[0] == "cannot-tell"


def test_an_instrument_that_is_off_a_little_is_no_verdict() -> None:
    clear, faint = an_instrument(x=3.0), an_instrument(interval95=(0.05, 0.15))
    kind, sentence, remarks = said(inputs(instruments=(faint,)))
    assert kind == "nothing-missing"
    assert "set aside" not in sentence
    assert "it was set aside. It is off by less than 4.5 standard errors" in remarks
    kind, sentence, remarks = said(inputs(instruments=(clear, faint)))
    assert kind == "instrument"
    assert "x = 3" in sentence
    assert "x = 36" not in sentence
    assert "less than 4.5" in remarks


@pytest.mark.parametrize(
    ("kind", "where", "words"),
    [
        ("probe", {"x": np.nan, "y": 0.5}, "The probe at y = 0.5 m is off in all sections by"),
        ("position", {"x": 3.0, "y": 0.5}, "The probe at x = 3, y = 0.5 m is off in all experiments by"),
        ("gauge", {"x": 3.0, "y": 0.0}, "The gauge at x = 3, y = 0 m is off in all experiments by"),
    ],
)
def test_instruments_are_told_by_where_they_stood(kind: str, where: dict[str, float], words: str) -> None:
    one = an_instrument(kind=kind, **where)
    assert words in said(inputs(instruments=(one,)))[1]
    assert words in said(inputs(step("a"), instruments=(one,)), [a_candidate_effect("a")])[1]
    assert words in said(inputs(places=(an_anomaly(),), instruments=(one,)))[2]


def test_data_that_cannot_be_are_told_before_all_else() -> None:
    odd = inputs(step("a"), places=(an_anomaly(),), field=a_field(), absurd=("levels lie below the bed.",))
    kind, sentence, _ = said(odd, [a_candidate_effect("a")])
    assert kind == "cannot-tell"
    assert sentence == "Before anything can be said of the model: levels lie below the bed."


def test_what_scores_below_the_alarm_is_not_excluded() -> None:
    groups = (("effect0", "effect1"), tuple(f"effect{k}" for k in range(2, 11)))
    verdict, _, remarks = said(inputs(not_excluded=groups))
    assert verdict == "nothing-missing"
    assert "effect0" in remarks
    assert "and 3 more" in remarks
    assert "wind" not in remarks


def test_an_alarm_that_nothing_came_of_is_no_all_clear() -> None:
    hypotheses = tuple(Hypothesis("effect", name, 1.0, 0, None) for name in ("wind", "elder", "steep_bank", "jet"))
    verdict, sentence, _ = said(inputs(undecided=undecided_of(hypotheses, (), np.array([]))))
    assert verdict == "cannot-tell"
    assert "it may be wind (25%) or elder (25%) or steep_bank (25%), but none of them surely" in sentence


def test_what_may_be_it_is_told_in_words() -> None:
    """Something at a place and an instrument go by what they do and where, with their chances."""
    spot = Refit(None, {"x": 9.8, "y": 0.5}, None, 5.0, -0.3, (-0.4, -0.2))
    probe = Instrument("position", (1, 2), 14.2, 1.5)
    hypotheses = (
        Hypothesis("bed", "unlisted_bed[x9.8,y0.5]", 3.0, 0, spot), Hypothesis("position", "position", 2.0, 0, probe)
    )  # fmt: skip
    sentence = said(inputs(undecided=undecided_of(hypotheses, (), np.array([]))))[1]
    assert "it may be something in no list, as if the bed lies 0.30 m lower at x = 9.8, y = 0.5 m (7" in sentence
    assert "or a probe that is off in all experiments at x = 14.2, y = 1.5 m (2" in sentence


def test_what_was_followed_is_told_with_the_chances_that_decided() -> None:
    hypotheses = tuple(
        Hypothesis("effect", name, evidence, 0, None)
        for name, evidence in (("wind", 2.0), ("elder", 0.0), ("jet", 0.0))
    )
    alone = undecided_of(hypotheses, (), np.array([])).chances
    found = undecided_of(hypotheses, ("wind", "elder"), np.array([0.25, 0.75]))
    assert found.chances == pytest.approx((0.25 * (1.0 - alone[2]), 0.75 * (1.0 - alone[2]), alone[2]))
    assert "it may be elder (67%) or wind (22%) or jet" in said(inputs(undecided=found))[1]


def test_a_misfit_is_not_said_to_hide() -> None:
    assert "effect0" in said(inputs(not_excluded=(("effect0",),)))[2]
    assert "effect0" not in said(inputs(misfit=MISSES, not_excluded=(("effect0",),)))[2]


@pytest.mark.parametrize(
    ("rivals", "verdict"),
    [(["a"], "identified"), (["a", "b", "c"], "one-of"), (["a", "b", "c", "d"], "cannot-tell")],
)
def test_a_set_of_more_than_three_groups_tells_nothing(rivals: list[str], verdict: str) -> None:
    assert said(inputs(step(*rivals)), [a_candidate_effect(name) for name in rivals])[0] == verdict


def test_rivals_are_told_with_their_chances() -> None:
    both = Step("a", ("a", "b", "c"), (0.5, 0.3, 0.16), (("a", "b"), ("c",)), 200.0, 5.0, 1e-4)
    sentence = said(inputs(both), [a_candidate_effect(name) for name in "abc"])[1]
    assert (
        "trace in these data as b, together with a chance of 80% among all that was tried, or else c (16%)" in sentence
    )


def test_what_is_of_another_kind_may_be_it_instead() -> None:
    alone = step("a", chances=(0.8,), others={"bed": 0.15})
    kind, sentence, _ = said(inputs(alone), [a_candidate_effect("a")])
    assert kind == "one-of"
    assert "or else bed (15%)" in sentence
    assert "likeliest" not in sentence


def test_an_instrument_that_may_be_it_instead_is_told_in_words() -> None:
    """The terminal said `or position (4%)`, which is how the program calls it."""
    alone = step("a", chances=(0.9,), others={"position": 0.04, "reading": 0.03})
    sentence = said(inputs(alone), (a_candidate_effect("a"),))[1]
    assert "or else a probe that is off in all experiments (4%) or one reading that is off (3%)" in sentence


def test_what_may_be_it_instead_is_told_the_likeliest_first() -> None:
    """Effects came before all else: `b (7%) or something in no list, as if water enters, ... (21%)`."""
    found = step("a", "b", chances=(0.6, 0.07), others={"reading": 0.04, "bed": 0.21})
    sentence = said(inputs(found), (a_candidate_effect("a"), a_candidate_effect("b")))[1]
    assert "or else bed (21%) or b (7%) or one reading that is off (4%)" in sentence


def test_a_place_that_is_likelier_comes_first_and_in_words() -> None:
    """Of two that may be it the likelier is told first; what is less likely is told as what it does, and where."""
    bed, inflow = an_anomaly(term="bed", unit="m", x=12.0), an_anomaly(term="inflow", unit="m3/s")
    places = {"unlisted_bed": bed, "unlisted_inflow": inflow}
    alone = step("a", chances=(0.24,), others={"unlisted_inflow": 0.1, "unlisted_bed": 0.66}, places=places)
    kind, sentence, _ = said(inputs(alone), [a_candidate_effect("a")])
    assert kind == "one-of"
    assert sentence.startswith("Missing: most likely something in no list (66%): at x = 12.0, y = -0.6 m it acts as if")
    assert "; or else a of 0.3" in sentence
    assert (
        "with a chance of 24% among all that was tried, or else something in no list, as if water enters, 0.4 m3/s at x"
        in sentence
    )
    assert "degrees of freedom with a." in sentence


def test_what_leaves_the_same_trace_is_as_likely_as_all_of_it_together() -> None:
    place = {"bed": an_anomaly(term="bed", unit="m")}
    alike = Step("a", ("a", "b"), (0.3, 0.25), (("a", "b"),), 200.0, 5.0, 1e-4, {"bed": 0.45}, place)
    sentence = said(inputs(alike), [a_candidate_effect(name) for name in "ab"])[1]
    assert "most likely" not in sentence
    assert "or else something in no list, as if the bed lies 0.40 m higher at x = 33.0, y = -0.6 m (45%)" in sentence


def test_an_implausible_size_is_remarked() -> None:
    usual = a_candidate_effect("a", amplitude={"value": 0.9, "scale": 0.5})
    huge = a_candidate_effect("a", amplitude={"value": -0.34, "scale": 0.1})
    assert "plausible" not in said(inputs(step("a")), [usual])[2]
    assert "3.4 times what is plausible" in said(inputs(step("a")), [huge])[2]


AT_ITS_END = {"value": 1.0, "support": (-1.0, 1.0), "scale": 0.5}
# What takes a name away, the same just within its bounds, and what is said of it.
DOUBTED = {
    "absurd": ({"misfit": ABSURD}, {"misfit": MISSES}, {}, {}, "misses by 2.4 times"),
    "far off": ({"strained": ("k_s", 4.5)}, {"strained": ("k_s", 3.5)}, {}, {}, "k_s would have to lie 4.5"),
    "at its upper end": ({}, {}, AT_ITS_END, AT_ITS_END | {"value": 0.97}, "a would have to be as large as can be"),
    "as far as a calibration goes": ({}, {}, {"value": 3.0, "scale": 0.5}, {"value": 2.9, "scale": 0.5}, "as large as"),
    "at its lower end": ({}, {}, AT_ITS_END | {"value": -0.996}, AT_ITS_END | {"value": -0.97}, "as large as can be"),
}


@pytest.mark.parametrize("why", DOUBTED)
def test_a_name_has_to_be_earned(why: str) -> None:
    too_much, within, amplitude, smaller, words = DOUBTED[why]
    kind, sentence, _ = said(inputs(step("a"), **too_much), [a_candidate_effect("a", amplitude=amplitude)])
    assert kind == "cannot-tell"
    assert words in sentence
    assert "What explains most of the misfit: a of" in sentence
    assert said(inputs(step("a"), **within), [a_candidate_effect("a", amplitude=smaller)])[0] == "identified"


@pytest.mark.parametrize("why", ["absurd", "far off"])
def test_a_place_has_to_be_earned(why: str) -> None:
    too_much, within, *_, words = DOUBTED[why]
    kind, sentence, _ = said(inputs(places=(an_anomaly(),), **too_much))
    assert kind == "cannot-tell"
    assert words in sentence
    assert said(inputs(places=(an_anomaly(),), **within))[0] == "none-of-these"


def test_only_what_was_accepted_can_stand_in_for_something_else() -> None:
    beside = a_candidate_effect("b", amplitude=AT_ITS_END)
    assert said(inputs(step("a")), [a_candidate_effect("a"), beside])[0] == "identified"


def test_an_effect_that_is_off_at_the_end_of_its_support_is_not_at_a_bound_there() -> None:
    """Its size is small, and what is small does not stand in for anything."""
    small = a_candidate_effect("a", amplitude={"value": 0.005, "support": (0.0, 1.0), "off": 0.0})
    assert said(inputs(step("a")), [small])[0] == "identified"


def test_a_support_without_ends_has_no_bound() -> None:
    endless = a_candidate_effect("a", amplitude={"support": (-np.inf, np.inf), "value": 3.0, "scale": 2.0})
    assert said(inputs(step("a")), [endless])[0] == "identified"


def test_the_chance_of_a_misfit() -> None:
    assert chance_of_misfit(5.0, 5) == pytest.approx(0.4159, abs=1e-3)
    assert np.isfinite(chance_of_misfit(0.0, 0))


def test_what_is_left_too_large_is_remarked_after_a_step_only() -> None:
    left = "left is still larger than the errors allow"
    assert left in said(inputs(step("a"), misfit=MISSES), [a_candidate_effect("a")])[2]
    assert left not in said(inputs(step("a")), [a_candidate_effect("a")])[2]
    assert left not in said(inputs(misfit=MISSES))[2]
    assert left not in said(inputs(step(*"abcd"), misfit=MISSES), [a_candidate_effect(name) for name in "abcd"])[2]


def test_a_name_is_told_with_what_its_model_still_asks_for() -> None:
    """ "identified, 100 %" said nothing of errors twice as large as stated, nor of what stood out beside it."""
    twice, candidate_effects = replace(AS_STATED, scale=2.1), [a_candidate_effect("a"), NONE]
    one = {"b": 0.008}
    kind, sentence, remarks = said(inputs(step("a"), errors=twice, significant_effects=one), candidate_effects)
    assert kind == "identified"
    assert sentence.endswith(
        " with it. Even so the model asks for errors 2.1 times as large as stated; chi2 and intervals are under these. "
        "Beside it b (p = 0.008) stands out among all effects, but was not accepted."
    )
    assert "too small by a factor" not in remarks, "twice"
    verdict = make_verdict(inputs(step("a"), errors=twice, significant_effects=one), candidate_effects)
    assert (verdict.sentence.endswith(verdict.left_over), verdict.significant_effects) == (True, one)
    of_place = said(inputs(places=(an_anomaly(),), errors=twice))[1]
    assert "Even so the model asks for errors 2.1 times as large as stated" in of_place


@pytest.mark.parametrize(
    "parts",
    [
        {"steps": [step("a")], "errors": replace(AS_STATED, scale=1.2)},
        {"errors": replace(AS_STATED, scale=2.1), "laws": candidate_laws_of("a"), "misfit": MISSES},
        {"errors": replace(AS_STATED, scale=2.1), "instruments": (an_instrument(),)},
        {"significant_effects": {"b": 0.008}},
    ],
)
def test_only_what_is_clear_is_told_beside_a_name(parts: dict[str, Any]) -> None:
    verdict = make_verdict(inputs(*parts.pop("steps", ()), **parts), [a_candidate_effect("a")])
    assert "Even so" not in verdict.sentence + verdict.left_over
    assert "Beside it" not in verdict.sentence


def test_what_may_be_a_remainder_is_told_as_such() -> None:
    sentence = said(inputs(step("a"), significant_effects={"b": 0.008}, remainder=True), [a_candidate_effect("a")])[1]
    assert (
        "but was not accepted: a remainder of what was, which no model has quite right, may look like that." in sentence
    )


def test_of_many_that_stand_out_three_are_named() -> None:
    many = {f"e{k}": 0.001 * k for k in range(5, 0, -1)} | {"least": 1 / 3001}
    sentence = said(inputs(step("a"), significant_effects=many), [a_candidate_effect("a")])[1]
    assert (
        "Beside it least (p < 0.0003), e1 (p = 0.001), e2 (p = 0.002) and 3 more stand out among all effects, but were "
        "not accepted."
    ) in sentence


def test_errors_that_are_not_as_stated_are_remarked() -> None:
    remarks = said(inputs(errors=EstimatedErrors(0.4, 1.2, 0.0, (3, 4))))[2]
    assert "correlated by 0.40" in remarks
    assert "too small by a factor of 1.20" in remarks
    assert said(inputs())[2] == ""


def test_the_model_error_that_is_allowed_is_remarked() -> None:
    used = ModelErrorUsed(0.05, 0.01, needed=0.5, log_ratio=1.0)
    assert (
        "by 5% of its friction and 1 cm of its bed everywhere, and its site as the config says; the misfit asks for 50%"
        in said(inputs(model_error=used))[2]
    )
    assert "the misfit asks for none of that." in said(inputs(model_error=replace(used, needed=0.0)))[2]


def test_more_model_error_than_is_allowed_is_told_with_its_doubt() -> None:
    """Two gauges asked for 900% of it."""
    used = ModelErrorUsed(0.05, 0.01, needed=9.0, log_ratio=0.6)
    remark = said(inputs(model_error=used))[2]
    assert "the misfit asks for 900% of that, though what is allowed explains it nearly as well." in remark
    assert "the misfit asks for 900% of that." in said(inputs(model_error=replace(used, log_ratio=5.0)))[2]


def test_one_degree_of_freedom_is_one() -> None:
    assert Misfit(2.0, 2.0, 1, 0.2, pd.DataFrame()).of_freedom == "for 1 degree of freedom"


def test_what_looks_like_a_parameter_is_untestable_for_that_reason() -> None:
    hidden = a_candidate_effect("wind", detectability={"testable": False, "cosine": -0.9})
    assert "wind (looks like a change of k_s)" in said(inputs(), [hidden])[2]


def test_many_untestable_effects_are_told_in_groups() -> None:
    """Some fifty names stood in one line, each with the same words behind it."""
    parts = {"k_s": (20, -0.9), "n_b": (5, 0.9), "phi": (1, 0.2)}
    hidden = [
        a_candidate_effect(f"of_{name}{k}", detectability={"testable": False, "confounder": name, "cosine": cosine})
        for name, (count, cosine) in parts.items()
        for k in range(count)
    ]
    told = (
        "neither present nor absent: 26 effects: "
        "of_k_s0, of_k_s1, of_k_s2 and 17 more (look like a change of k_s); "
        "of_n_b0, of_n_b1, of_n_b2 and 2 more (look like a change of n_b); of_phi0. "
        "The table of effects on the page of the run (`vegglue report`) lists all."
    )
    assert told in said(inputs(), hidden)[2]


def test_candidates_are_not_counted_as_effects() -> None:
    """One effect in three experiments counted as three: 54 effects in the pages, 62 and 67 in the terminal."""
    in_each = [a_candidate_effect(f"discharge_error[{name}]") for name in ("low", "mid", "high")]
    assert "none of 4 candidates of 2 effects stands out" in said(inputs(), [*in_each, NONE])[1]
    assert "none of 1 effect stands out" in said(inputs(), [NONE])[1]


def test_what_stands_out_is_not_called_untestable() -> None:
    hidden = [a_candidate_effect("a"), a_candidate_effect("probe_gain", detectability={"testable": False})]
    assert "Untestable with these data, neither present nor absent: probe_gain" in said(inputs(step("a")), hidden)[2]
    assert "Untestable" not in said(inputs(step("a"), significant_effects={"probe_gain": 0.008}), hidden)[2]


def test_what_was_found_is_not_called_untestable() -> None:
    hidden = [a_candidate_effect(name, detectability={"testable": False}) for name in ("wind", "elder")]
    assert "neither present nor absent: elder." in said(inputs(step("wind")), hidden)[2]
