"""What is said of places, fields and laws, and how they go before effects and instruments."""

import pytest
from diagnoses import a_candidate_effect, a_field, an_anomaly, an_instrument, candidate_laws_of
from vegglue.diagnosis.remarks import TOO_SHALLOW
from verdicts import MISSES, inputs, said, step

from vegglue.diagnosis.competition import Hypothesis
from vegglue.diagnosis.search_state import Undecided
from vegglue.results.verdict import make_verdict


def test_a_place_wins_over_steps_and_all_are_told() -> None:
    found = inputs(step("a"), places=(an_anomaly(), an_anomaly(term="bed", unit="m", x=12.0)), misfit=MISSES)
    verdict, sentence, _ = said(found, [a_candidate_effect("a")])
    assert verdict == "none-of-these"
    first, second, third = sentence.split("; and ")
    assert "at x = 33.0, y = -0.6 m it acts as if something holds the flow back (0.4 1/m, 0.3 to 0.5; 4 to 1" in first
    assert "at x = 12.0, y = -0.6 m it acts as if the bed lies 0.40 m higher (0.3 to 0.5 m; 4 to 1" in second
    assert third.startswith("a of 0.3")


@pytest.mark.parametrize(
    ("term", "more", "less"),
    [
        ("drag", "holds the flow back", "lets the flow pass or pushes it on"),
        ("bed", "0.40 m higher", "0.40 m lower"),
        ("inflow", "water enters, 0.4 m3/s (0.3 to", "water leaves, 0.4 m3/s (0.3 to"),
        ("viscosity", "mixes more", "mixes less"),
    ],
)
def test_a_place_is_told_by_its_term_and_its_sign(term: str, more: str, less: str) -> None:
    assert more in said(inputs(places=(an_anomaly(term=term),)))[1]
    assert less in said(inputs(places=(an_anomaly(term=term, amplitude=-0.4),)))[1]


def test_odds_are_told_against_the_closest_other_term() -> None:
    odds = {"wind": 2.0, "bed": 400.0, "viscosity": 7000.0}
    assert "400 to 1 against bed" in said(inputs(places=(an_anomaly(odds=odds),)))[1]
    assert "over 1,000 to 1 against bed" in said(inputs(places=(an_anomaly(odds={"bed": 7000.0}),)))[1]
    assert "; 1 to 3 against bed" in said(inputs(places=(an_anomaly(odds={"bed": 0.35}),)))[1], "and not 0 to 1"


def test_odds_against_what_is_known_are_told_where_it_is_near() -> None:
    near = {"bed": 400.0, "wind": 8.0, "probe": 9.0}
    assert "400 to 1 against bed; 8 to 1 against wind)" in said(inputs(places=(an_anomaly(odds=near),)))[1]
    assert "against a probe that is off" in said(inputs(places=(an_anomaly(odds={"probe": 8.0}),)))[1]
    assert "against" not in said(inputs(places=(an_anomaly(odds={"wind": 21.0}),)))[1]


def test_a_field_is_none_of_the_known_effects() -> None:
    verdict, sentence, _ = said(inputs(step("a"), field=a_field()), [a_candidate_effect("a")])
    assert verdict == "none-of-these"
    assert "some 15 m along and 3 m across, most surely around x = 31.0, y = 0.5 m (+60%), rather than a of" in sentence
    bed = a_field(term="bed", value=-0.12)
    assert "the bed level that differs" in said(inputs(misfit=MISSES, field=bed))[1]
    assert "(-0.12 m)" in said(inputs(misfit=MISSES, field=bed))[1]


# What competed last and led to nothing.
UNSURE = Undecided((Hypothesis("effect", "wind", 3.0, 0, None),), (1.0,))  # type: ignore[arg-type]
LIKELY = candidate_laws_of("law_bank_speed_step", "law_bank_speed_ramp")


def test_a_verdict_says_whether_its_sentence_tells_of_laws() -> None:
    assert make_verdict(inputs(laws=LIKELY, misfit=MISSES), ()).tells_laws
    assert make_verdict(inputs(laws=candidate_laws_of("a", chance=0.2)), ()).tells_laws
    assert not make_verdict(inputs(step("a"), laws=LIKELY), [a_candidate_effect("a")]).tells_laws, "a remark does"


def test_a_law_is_none_of_the_known_effects() -> None:
    kind, sentence, remarks = said(inputs(laws=LIKELY, misfit=MISSES))
    assert kind == "none-of-these"
    assert "a law of the speed in friction of the banks would explain it, with a chance of 75% among all" in sentence
    assert "`vegglue discover`" in sentence
    assert "still larger than the errors allow" not in remarks, "it is that without the law"
    assert said(inputs(laws=LIKELY, undecided=UNSURE))[0] == "none-of-these"


def test_an_instrument_that_is_clearly_off_goes_before_a_law_that_may_be() -> None:
    """Not before one that is likelier than all else, and not where the instrument is off by little."""
    clear, faint = (
        an_instrument(offset=0.1, interval95=(0.08, 0.12)),
        an_instrument(offset=0.1, interval95=(0.04, 0.16)),
    )
    unlikely = candidate_laws_of("a", chance=0.2)
    kind, sentence, _ = said(inputs(laws=unlikely, instruments=(clear,)))
    assert kind == "instrument"
    assert sentence.startswith("One reading at x = 36, y = 1 m is off by 0.1 m/s")
    assert "cannot tell whether anything else is missing: a law of" in sentence
    assert said(inputs(laws=unlikely, instruments=(clear, faint)))[0] == "cannot-tell"
    beside = said(inputs(laws=unlikely, instruments=(clear,), neighbours=True))
    assert beside[0] == "cannot-tell"
    assert "readings side by side" in beside[1]
    assert said(inputs(laws=LIKELY, instruments=(clear,)))[0] == "none-of-these"


def test_where_laws_stand_out_nothing_missing_is_never_said() -> None:
    """Not where they are less likely than all else together either, nor where a parameter lies far off its prior."""
    for told in (inputs(laws=candidate_laws_of("a", chance=0.2)), inputs(laws=LIKELY, strained=("k_s", 4.5))):
        kind, sentence, _ = said(told)
        assert kind == "cannot-tell"
        assert "a law of the speed" in sentence
        assert "`vegglue discover`" in sentence


def test_a_law_beside_what_was_found_is_a_remark() -> None:
    for beside in ({"places": (an_anomaly(),)}, {"undecided": UNSURE, "strained": ("k_s", 4.5)}):
        _, sentence, remarks = said(inputs(laws=LIKELY, **beside))
        assert "a law of" not in sentence
        assert "To first order a law of the speed in friction of the banks" in remarks
    kind, _, remarks = said(inputs(step("a"), laws=LIKELY), [a_candidate_effect("a")])
    assert kind == "identified"
    assert "rather than a. `vegglue discover`" in remarks


def test_water_too_shallow_for_a_place_is_told() -> None:
    """Else "no place stands out" is said of none."""
    assert TOO_SHALLOW in said(inputs(places_searched=False))[2]
    assert "deeper than 5 cm" in TOO_SHALLOW
    assert TOO_SHALLOW not in said(inputs())[2]
