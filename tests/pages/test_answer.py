"""The top of the page: verdict, ladder, what to do next, and what forbids using it, before anything else."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnoses import (
    EVERY_KIND,
    IMPLAUSIBLE,
    NOTHING,
    a_diagnosis,
    a_field,
    an_anomaly,
    an_instrument,
    candidate_laws_of,
)
from posteriors import a_refinement, changed
from report_runs import a_toy, told_of, written

from vegglue.flow.status import FAILED
from vegglue.pages.answer import answer_of
from vegglue.pages.answer_words import headline, headline_lines, of_which_model, where_it_fails, why_not_to_rely
from vegglue.pages.diagnosis_words import diagnosis_section
from vegglue.pages.findings import findings
from vegglue.pages.ladder_words import causes_of, ladder_in_words
from vegglue.pages.next_words import next_steps
from vegglue.pages.run import LoopResults, Run
from vegglue.pages.sections import safe_json
from vegglue.pages.tables import station_rows
from vegglue.results.causes import Rival, Step
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.model_comparison import ComparedModel, ModelComparison
from vegglue.results.open_questions import HiddenEffect, ProposedMeasurement, Question, RivalEffects
from vegglue.results.verdict import (
    EffectsStillSignificant,
    ErrorsStillLarger,
    NoneLeads,
    ParameterFarFromPrior,
    UncertainBetweenSections,
)

FIRST = ComparedModel("toy", "toy.yaml", "a", (), 4, 0.04, 0.041, 0.063, 0.039, 0.012)
LAST = ComparedModel("toy-eddies", "toy+eddies.yaml", "b", ("eddies",), 5, 0.012, 0.013, 0.014, 0.0033, 0.012)
LADDER = ModelComparison((FIRST, LAST), 0, "Added: eddies.")
STEP = Step("eddies", ("eddies",), (0.3,), (("eddies",),), 9.0, 5.0, 1e-3, {"p": 0.6}, {"p": an_anomaly()})
INSTRUMENTS = replace(STEP, chances=(0.55,), others={"reading": 0.3, "probe": 0.15}, places={})
NO_EFFECT = a_diagnosis(steps=(INSTRUMENTS,), verdict={"kind": "one-of"})
LIKELIER = a_diagnosis(steps=(STEP,), verdict={"kind": "one-of"})
GAUGE = ProposedMeasurement("a gauge at x = 5 m", "June", 5.0, 1, 0.5, 0.2, 9.0)


@pytest.fixture(scope="module")
def toy(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return a_toy(tmp_path_factory.mktemp("toy"))


def plain(words: str) -> str:
    return re.sub("<[^>]*>", "", words).replace("\u202f", " ")


def off(cleared: bool) -> Diagnosis:
    """One reading is off, and whether its verdict clears the model."""
    verdict = replace(NOTHING.verdict, kind="instrument", clears_the_model=cleared)
    return replace(NOTHING, verdict=verdict, instruments=(an_instrument(),))


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (NOTHING, "Nothing is missing from this model that these data could show."),
        (a_diagnosis(verdict={"kind": "one-of"}), "most likely (70 %) störung – größer als 0 (eddies, size 0.300 m2/s"),
        (LIKELIER, "(60 %) more drag by 0.40 1/m at x = 33.0 m, y = −0.6 m, which is in no list, or else (30 %)"),
        (LIKELIER, "Something is missing from this model: most likely (60 %)"),
        (NO_EFFECT, "Something is missing from this model: most likely (55 %) störung"),
        (NO_EFFECT, ", or no listed effect (45 %)"),
        (a_diagnosis(steps=(), verdict={"kind": "none-of-these"}), "Something is missing from this model that is in"),
        (replace(a_diagnosis(steps=()), places=(an_anomaly(amplitude=-0.56, x_error=6.7),),
                 verdict=replace(NOTHING.verdict, kind="none-of-these")),
         "less drag by 0.56 1/m at x = 33.0 ± 6.7 m, y = −0.6 m"),
        (off(cleared=True),
         "The model is sound, but an instrument is off: one reading, at x = 36.0 m, y = 1.0 m."),
        (off(cleared=False),
         "More may be missing, but an instrument is off: one reading"),
        (replace(EVERY_KIND, field=None), "else is missing from this model that is in no list: water that enters"),
        (a_diagnosis(steps=(), verdict={"kind": "none-of-these"}), "more drag by 0.40 1/m at x = 33.0 m, y = −0.6 m"),
        (replace(EVERY_KIND, steps=(), field=None, places=(),
                 verdict=replace(EVERY_KIND.verdict, kind="cannot-tell", laws=EVERY_KIND.laws)),
         "these data cannot tell; the likeliest, with a chance of 75 %, is a law of the speed in friction of the"),
        (a_diagnosis(verdict={"kind": "cannot-tell", "reasons": (ParameterFarFromPrior("<it>", 4.5),)}), "&lt;it&gt;"),
        (replace(EVERY_KIND, field=a_field()), "over some 15 m along"),
        (replace(EVERY_KIND, field=None, places=()),
         "missing from this model that is in no list: friction of the banks changes at one value of the speed."),
    ],
)  # fmt: skip
def test_every_verdict_is_one_plain_sentence(toy: Run, found, said: str) -> None:
    words = plain(headline(replace(toy, diagnosis=found)))
    assert said in words
    assert words.endswith(".")


def test_the_page_of_a_child_tells_what_was_missing(toy: Run) -> None:
    """`run` makes no page of the case itself: that of its last child has to tell the whole."""
    first = a_diagnosis(verdict={"kind": "one-of"})
    child = replace(toy, diagnosis=replace(NOTHING, name="child"), loop=LoopResults(behind=first, ladder=LADDER))
    said = plain(headline(child))
    assert f"was missing from {first.name}: most likely (70 %) störung" in said
    assert said.endswith("Nothing is missing from this model that these data could show.")
    assert of_which_model(child).startswith(f"What follows is of the model made of {FIRST.name} by adding")
    assert child.behind is first, "of which both models are drawn"
    more = replace(child, diagnosis=replace(first, name="child"))
    assert re.search(f"was missing from {first.name}: .* is missing from this model: ", plain(headline(more)))
    assert of_which_model(more) == of_which_model(child)
    assert more.behind is more.diagnosis, "whose models are drawn"


def test_a_law_suspected_of_a_child_hides_nothing_of_what_was_found(toy: Run) -> None:
    """The law is not calibrated: both models of what was found are drawn, and told first."""
    first = a_diagnosis(steps=(), verdict={"kind": "none-of-these"})
    suspected = replace(NOTHING, name="child", laws=candidate_laws_of("law_bank_speed_step"))
    suspected = replace(suspected, verdict=replace(NOTHING.verdict, kind="none-of-these"))
    child = replace(toy, diagnosis=suspected, loop=LoopResults(behind=first, ladder=_ending_with(toy)))
    said = plain(headline(child))
    assert said.startswith(
        f"Something was missing from {first.name} that is in no list: more drag by 0.40 1/m at x = 33.0"
    )
    assert "What is left looks like a law that is in no list: friction of the banks changes" in said
    assert child.behind is first
    assert "vegglue discover toy.yaml" in next_steps(child)[0]
    assert not any("Compare with" in step for step in next_steps(child)), "there is no page of the first model"


def _ending_with(run: Run) -> ModelComparison:
    return replace(LADDER, steps=(replace(FIRST, name="brook"), replace(LAST, name=run.case.name)))


def test_without_a_diagnosis_the_calibration_speaks_and_the_command_is_named(toy: Run) -> None:
    assert "identified" in headline(toy) or "first look" in headline(toy)
    assert "vegglue diagnose toy.yaml" in next_steps(toy)[0]
    assert "vegglue run toy.yaml" in answer_of(toy).ladder_words


def test_the_name_of_a_file_is_no_markup(toy: Run) -> None:
    named = replace(toy, case=toy.case.model_copy(update={"source": Path("a<b>&c.yaml")}))
    assert "vegglue run &#x27;a&lt;b&gt;&amp;c.yaml&#x27;" in answer_of(named).ladder_words


@pytest.mark.parametrize(
    ("unseen", "said"),
    [(0.0391, "stays at 0.039 m/s"), (0.045, "rises from 0.039 to 0.045"), (float("nan"), "is 0.039")],
)
def test_an_error_that_stays_neither_falls_nor_rises(unseen: float, said: str) -> None:
    first, last = (0.039, unseen) if unseen == unseen else (unseen, 0.039)
    steps = replace(FIRST, unseen=first), replace(LAST, unseen=last)
    assert f"has seen {said}" in plain(ladder_in_words(replace(LADDER, steps=steps)))


def test_the_ladder_is_told_by_what_no_calibration_has_seen() -> None:
    said = plain(ladder_in_words(LADDER))
    assert said.startswith("With eddies, the error at measurements no calibration has seen falls from 0.039 to 0.0033")
    assert "errors of measuring alone, at what it was calibrated to, are 0.012 m/s" in said
    unseen = replace(LADDER, steps=tuple(replace(step, unseen=float("nan")) for step in LADDER.steps))
    assert "at sections left out in turn falls from 0.041 to 0.013" in plain(ladder_in_words(unseen))
    assert "rises from 0.0033 to 0.039" in plain(ladder_in_words(replace(LADDER, steps=(LAST, FIRST))))
    unclear = plain(ladder_in_words(replace(LADDER, unclear=("eddies",))))
    assert unclear.endswith(" By the errors at what was held out, this fall cannot be told from chance.")
    both = replace(LADDER, steps=(FIRST, replace(LAST, added=("eddies", "wind"))), unclear=("wind",))
    assert plain(ladder_in_words(both)).endswith("held out, what wind adds to it cannot be told from chance.")
    alone = plain(ladder_in_words(ModelComparison((FIRST,), 0, "Nothing is added: nothing is missing.")))
    assert alone.startswith("The model misses measurements no")
    assert alone.endswith(" Nothing is added: nothing is missing.")


def test_the_ladder_is_of_what_was_added_and_not_of_what_is_left(toy: Run) -> None:
    """The page of a child that lacks something else: the fall of its errors is told of what its parent lacked."""
    place, steps = (an_anomaly(),), (replace(FIRST, name="parent"), LAST)
    parent, child = replace(a_diagnosis(), name="parent", places=()), replace(NOTHING, name="child", places=place)
    loop = LoopResults(behind=parent, ladder=replace(LADDER, steps=steps))
    assert causes_of(replace(toy, diagnosis=child, loop=loop)) == "eddies"
    other = replace(LAST, added=("unlisted_object_x33_y_0_6",))
    assert causes_of(replace(toy, loop=replace(loop, ladder=replace(LADDER, steps=(steps[0], other))))) == ""
    found = replace(parent, places=place)
    both = replace(LADDER, steps=(steps[0], replace(LAST, added=("eddies", *other.added))))
    told = causes_of(replace(toy, diagnosis=found, loop=LoopResults(behind=found, ladder=both)))
    assert told == "more drag at x = 33.0 m, y = −0.6 m and eddies"


def test_what_to_do_next_names_the_other_model_and_the_measurement(toy: Run) -> None:
    question, page = Question(RivalEffects(("eddies", "<wind>")), (GAUGE,)), {"toy-eddies": "../toy-eddies/report.html"}
    loop = LoopResults(ladder=LADDER, questions=(question,), pages=page)
    better, measure, *_ = next_steps(replace(toy, diagnosis=a_diagnosis(), loop=loop))
    assert '<a href="../toy-eddies/report.html">' in better
    assert "Measure <b>a gauge at x = 5 m</b>, to tell eddies from &lt;wind&gt;: 1 station" in measure
    nothing = next_steps(replace(toy, diagnosis=NOTHING, loop=replace(loop, questions=())))
    assert any("what that model leaves open stands in its report" in step for step in nothing)
    alone = next_steps(replace(toy, diagnosis=NOTHING, loop=LoopResults(questions=())))
    assert any("No further measurement is needed" in step for step in alone)
    asked = next_steps(replace(toy, diagnosis=a_diagnosis()))
    assert any("vegglue extend toy.yaml --auto" in step for step in asked)
    assert any("vegglue next toy.yaml" in step for step in asked)


def test_no_field_work_is_proposed_before_wrong_measurements_are_mended(toy: Run) -> None:
    """Of velocities in cm/s read as m/s the page said to measure another section for six hours."""
    doubted = a_diagnosis((), (), verdict={"kind": "cannot-tell", "reasons": (IMPLAUSIBLE,)})
    question = Question(HiddenEffect("eddies", "k_s"), (GAUGE,))
    steps = [
        plain(step) for step in next_steps(replace(toy, diagnosis=doubted, loop=LoopResults(questions=(question,))))
    ]
    assert "Mend the measurements first. vegglue check toy.yaml says all that is odd of them." in steps
    assert not any("field work" in step for step in steps)


def test_what_is_found_with_doubtful_measurements_is_folded_and_says_so(toy: Run) -> None:
    doubted = a_diagnosis(verdict={"kind": "cannot-tell", "reasons": (IMPLAUSIBLE,)})
    sound, section = diagnosis_section(a_diagnosis()), diagnosis_section(doubted)
    assert sound.condition == ""
    assert "found with the measurements as they stand" in section.condition
    assert section.suspects == []
    assert sorted(one.name for one in section.other_suspects) == sorted(
        one.name for one in [*sound.suspects, *sound.other_suspects]
    )


def test_a_law_is_not_the_likeliest_where_another_cause_is_told_before_it(toy: Run) -> None:
    """The page began with a law of 6 %, and left out the place of 79 % that its diagnosis told."""
    rivals = (Rival("unlisted_bed", "bed", 0.79, 9.0, 0.5, 0.1), Rival("eddies", "effect", 0.08))
    undecided = replace(NOTHING.verdict, kind="cannot-tell", undecided=rivals, reasons=(NoneLeads(),))
    found = replace(NOTHING, laws=candidate_laws_of("law_bank_speed_step"), verdict=undecided)
    page = replace(toy, diagnosis=found)
    assert "79%" in headline(page)
    assert "a law" not in headline(page)
    assert "discover" not in "".join(next_steps(page))
    told = replace(found, verdict=replace(undecided, laws=found.laws))
    assert "the likeliest, with a chance of 50" in plain(headline(replace(toy, diagnosis=told)))


def test_a_last_model_that_lacks_more_says_how_to_go_on(toy: Run) -> None:
    loop = LoopResults(ladder=_ending_with(toy), questions=())
    steps = list(map(plain, next_steps(replace(toy, diagnosis=a_diagnosis(), loop=loop))))
    assert "vegglue extend toy.yaml --auto adds what this model still lacks, and shows the error fall." in steps[0]
    assert "No measurement is proposed: no two listed effects are left to be told apart." in steps


def test_where_a_law_stands_out_discover_is_named(toy: Run) -> None:
    found = replace(NOTHING, laws=candidate_laws_of("law_bank_speed_step"))
    assert "vegglue discover toy.yaml" in next_steps(replace(toy, diagnosis=found))[0]
    assert "discover" not in "".join(next_steps(replace(toy, diagnosis=NOTHING)))


def test_a_measurement_that_would_not_do_is_not_proposed(toy: Run) -> None:
    hidden = Question(HiddenEffect("eddies", "k_s"), (replace(GAUGE, then=3.0),))
    unknown = Question(RivalEffects(("eddies", "wind")), ())
    steps = next_steps(replace(toy, diagnosis=NOTHING, loop=LoopResults(questions=(hidden, unknown))))
    said = "to test eddies, which a change of k_s hides; nor to tell eddies from wind."
    assert list(map(plain, steps)) == [f"No single measurement would do {said}"]


def test_no_field_work_is_proposed_for_what_is_answered(toy: Run) -> None:
    answered = Question(HiddenEffect("eddies", "k_s"), (replace(GAUGE, now=30.0, then=60.0),), 25.0)
    steps = next_steps(replace(toy, diagnosis=NOTHING, loop=LoopResults(questions=(answered,))))
    assert list(map(plain, steps)) == ["No further measurement is needed."]


def test_the_page_of_a_parent_does_not_speak_for_its_child(toy: Run) -> None:
    """All was answered of the parent, and its page said that no measurement is needed; the child lacked something."""
    answered = Question(HiddenEffect("eddies", "k_s"), (replace(GAUGE, now=30.0, then=60.0),), 25.0)
    for questions in ((answered,), ()):
        parent = replace(toy, diagnosis=a_diagnosis(), loop=LoopResults(ladder=LADDER, questions=questions))
        said = " ".join(map(plain, next_steps(parent)))
        assert "No further measurement is needed" not in said
        assert "What toy-eddies still lacks, and what that model leaves open stands in its report." in said
    child = replace(toy, diagnosis=NOTHING, loop=LoopResults(ladder=_ending_with(toy), questions=(answered,)))
    assert "No further measurement is needed." in " ".join(map(plain, next_steps(child)))


def test_a_measurement_says_what_it_is_for_in_plain_words(toy: Run) -> None:
    hidden = Question(HiddenEffect("steep_bank", "k_s"), (GAUGE,))
    (step,) = next_steps(replace(toy, diagnosis=NOTHING, loop=LoopResults(questions=(hidden,))))
    assert "to test “Steep banks touch more water than their width says” (steep_bank), which a change" in plain(step)
    both = LoopResults(questions=(hidden, Question(HiddenEffect("eddies", "phi"), (GAUGE,))))
    (step,) = next_steps(replace(toy, diagnosis=NOTHING, loop=both))
    assert "which a change of k_s hides, and to test eddies, which a change of phi hides: 1 station" in plain(step)


def test_the_page_of_a_child_tells_whose_verdict_it_is(toy: Run) -> None:
    found = told_of(toy, a_diagnosis())
    loop = LoopResults(behind=found, ladder=replace(LADDER, steps=(replace(FIRST, name="brook"), LAST)))
    top = answer_of(replace(toy, loop=loop))
    assert "missing from open-x" in top.headline
    assert "made of brook" in top.subject
    assert top.in_full == found.verdict.sentence
    assert top.sections.added
    assert answer_of(replace(toy, diagnosis=found, loop=loop)).subject == ""


def test_what_forbids_using_the_answer_is_one_sentence(toy: Run) -> None:
    few = replace(toy, diagnosis=a_diagnosis(), posterior=changed(toy.posterior, effective_size=7.0))
    assert "the weights are worth 7 of" in why_not_to_rely(few)
    assert why_not_to_rely(replace(few, diagnosis=None)) == "", "the headline says it"
    enough = replace(toy, posterior=changed(toy.posterior, effective_size=900.0, pareto_k=0.1))
    assert why_not_to_rely(enough) == ""
    badly = a_diagnosis(misfit={"p": 1e-9})
    said = why_not_to_rely(replace(few, diagnosis=badly))
    assert said.startswith("Neither the verdict nor the parameters below are")
    assert "larger than the errors allow; the weights" in said
    assert said.count(".") == 1


def test_members_that_failed_are_no_doubt_of_draws_that_were_solved(toy: Run) -> None:
    """2 of 64 failed where the search for the best began, and the parameters were not to be relied on."""
    assert toy.ensemble is not None
    status = toy.ensemble.status.copy()
    status[: len(status) // 10] = FAILED
    run = replace(toy, posterior=changed(toy.posterior, effective_size=900.0, pareto_k=0.1, failed=0),
                  ensemble=replace(toy.ensemble, status=status))  # fmt: skip
    assert "204 of 2,048 members failed" in why_not_to_rely(run)
    drawn = replace(run, posterior=replace(run.posterior, refinement=a_refinement()))
    assert why_not_to_rely(drawn) == ""
    assert "40 of 2,048 members failed" in why_not_to_rely(
        replace(drawn, posterior=changed(drawn.posterior, failed=40))
    )
    (told,) = (one for one in findings(drawn) if one.subject == "members")
    assert "204 failed; the posterior is of 2,048 draws of its own, of which none failed." in told.text
    assert not told.doubt


@pytest.mark.slow
def test_the_answer_stands_before_all_else(toy: Run, tmp_path: Path) -> None:
    run = replace(toy, folder=tmp_path, diagnosis=told_of(toy, a_diagnosis()), loop=LoopResults(ladder=LADDER))
    text = written(run)
    parts = ['class="verdict"', 'id="ladder"', "What to do next", 'class="sections"', 'id="parameters"', 'id="missing"']
    places = [text.index(part) for part in [*parts, 'id="found"', 'id="health"']]
    assert places == sorted(places)
    caveats = text[text.index('id="found"') : text.index('id="health"')]
    number = re.search(r"<summary>(\d+) caveats?,", caveats)
    assert number is not None
    assert int(number[1]) == caveats.count('class="doubt"')
    assert a_diagnosis().verdict.remarks[0] in caveats


def test_stations_are_told_as_well_as_they_were_measured(toy: Run) -> None:
    """A point gauge read to half a millimetre was told to err by one, and no unit was told."""
    table = toy.observations.table.assign(value=0.09718, standard_error=0.0005, kind="level", x=4.25)
    row = station_rows(replace(toy, observations=replace(toy.observations, table=table)))[0]
    assert row.measured.replace("\u202f", " ") == "0.09718 ± 0.00050 m"
    assert row.x == "4.25"
    unknown = replace(toy.observations, table=table.assign(standard_error=float("nan")))
    assert station_rows(replace(toy, observations=unknown))[0].measured.startswith("0.097 ± –")


def test_words_of_users_close_no_script() -> None:
    text = safe_json([{"section": "</script><script>alert('weeds')</script> & \u2028"}])
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text)[0]["section"].startswith("</script><script>")


def test_what_the_model_still_asks_for_stands_beside_its_verdict(toy: Run) -> None:
    """The page said "identified" above errors twice as large as stated, and nothing of these."""
    found = a_diagnosis(verdict={"kind": "identified", "remaining": (ErrorsStillLarger(2.1),)}, errors={"scale": 2.1})
    assert headline(replace(toy, diagnosis=found)).endswith(found.verdict.left_over)
    whose = "standard errors (each 2.1 times as large as stated). Errors of measuring alone would make 1."
    assert whose in where_it_fails(found)
    numbers = {one.name: one.value for one in diagnosis_section(found).numbers}
    assert numbers["errors of the data"] == "2.1 times"
    assert "errors of the data" not in [one.name for one in diagnosis_section(a_diagnosis()).numbers]


def test_the_head_of_the_page_is_a_few_short_lines(toy: Run) -> None:
    """It was one paragraph of up to 200 words, with all that stands in brackets in the verdict."""
    beside = EffectsStillSignificant((("wind", 0.004),), remainder=False)
    first = told_of(toy, a_diagnosis(verdict={"kind": "one-of", "remaining": (beside,)}))
    unsure = replace(NOTHING.verdict, kind="cannot-tell", reasons=(UncertainBetweenSections(1.5),))
    own = replace(NOTHING, name="child", verdict=replace(unsure, clears_the_model=False))
    child = replace(toy, diagnosis=own, loop=LoopResults(behind=first, ladder=LADDER))
    lines = [plain(line) for line in headline_lines(child)]
    assert len(lines) == 3
    assert lines[0].startswith("Something was missing from")
    assert not any("(p =" in line or "(chi2" in line for line in lines[1:])
    assert answer_of(child).lines == headline_lines(child)


def test_a_parameter_at_its_bound_is_told_in_the_headline(toy: Run) -> None:
    """phi ended at 100, and only the table and the caveats said so."""
    hit = {name: np.array([False, name == "phi"]) for name in toy.posterior.parameters}
    pressed = replace(toy, diagnosis=NOTHING, posterior=changed(toy.posterior, bound_hit=hit))
    assert plain(headline_lines(pressed)[-1]).startswith("φ (upper) ends at a bound of its prior, and the bound, not")
    assert "bound" not in headline(replace(toy, diagnosis=NOTHING, posterior=changed(toy.posterior, bound_hit={
        name: np.array([False, False]) for name in toy.posterior.parameters})))  # fmt: skip
    doubted = a_diagnosis(verdict={"kind": "cannot-tell", "reasons": (IMPLAUSIBLE,)})
    assert "bound" not in headline(replace(pressed, diagnosis=doubted)), "which only follows from the data"


def test_a_misfit_that_is_far_too_small_is_told_in_the_headline(toy: Run) -> None:
    small, usual = (
        replace(toy, diagnosis=NOTHING, posterior=replace(toy.posterior, refinement=a_refinement(chi2, 150)))
        for chi2 in (61.5, 150.0)
    )
    assert "chi2 is only 0.41 times its degrees of freedom" in headline(small)
    assert "chi2 is only" not in headline(usual)


def test_gauges_that_are_missed_most_are_no_section() -> None:
    zones = a_diagnosis().misfit.zones
    assert "misses most at section D3, floor, in experiment low" in where_it_fails(a_diagnosis())
    of_gauges = where_it_fails(a_diagnosis(misfit={"zones": zones[zones["section"] == "gauges"]}))
    assert "misses most at gauges, level, in experiment low: by 0.5 standard errors" in of_gauges
