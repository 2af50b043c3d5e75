"""The top of the page as values: verdict, ladder, what to do next, and what forbids using it, before anything else."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnoses import EVERY_KIND, IMPLAUSIBLE, NOTHING, a_diagnosis, an_anomaly, candidate_laws_of
from posteriors import a_refinement, changed
from report_runs import a_toy, told_of, written

from vegglue.flow.status import FAILED
from vegglue.inference.statements import ParametersAtBounds
from vegglue.pages.answer import (
    LawLeft,
    NextStep,
    Purpose,
    answer_of,
    causes_of,
    error_fall,
    headline_lines,
    next_steps,
    not_reliable,
    subject_model,
)
from vegglue.pages.findings import MembersSolved, findings, station_rows
from vegglue.pages.headline import Headline, diagnosis_section, worst_zone
from vegglue.pages.parameters import PosteriorVerdict
from vegglue.pages.run import LoopResults, Run
from vegglue.pages.sections import safe_json
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.loop_results import (
    ComparedModel,
    HiddenEffect,
    ModelComparison,
    ProposedMeasurement,
    Question,
    RivalEffects,
)
from vegglue.results.verdict import EffectsStillSignificant, MisfitTooSmall, NoneLeads
from vegglue.wording.sentences import page_sentence

FIRST = ComparedModel("toy", "toy.yaml", "a", (), 4, 0.04, 0.041, 0.063, 0.039, 0.012)
LAST = ComparedModel("toy-eddies", "toy+eddies.yaml", "b", ("eddies",), 5, 0.012, 0.013, 0.014, 0.0033, 0.012)
LADDER = ModelComparison((FIRST, LAST), 0, "Added: eddies.")
GAUGE = ProposedMeasurement("a gauge at x = 5 m", "June", 5.0, 1, 0.5, 0.2, 9.0)
DOUBTFUL = {"kind": "cannot-tell", "reasons": (IMPLAUSIBLE,)}
LAW = replace(NOTHING, laws=candidate_laws_of("law_bank_speed_step"))


@pytest.fixture(scope="module")
def toy(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return a_toy(tmp_path_factory.mktemp("toy"))


def of_kind(found: Diagnosis, kind: str, **fields: object) -> Diagnosis:
    return replace(found, verdict=replace(found.verdict, kind=kind, **fields))


def ending_with(run: Run) -> ModelComparison:
    return replace(LADDER, steps=(replace(FIRST, name="brook"), replace(LAST, name=run.case.name)))


def actions(run: Run, **parts: object) -> list[str]:
    return [one.action for one in next_steps(replace(run, **parts))]


@pytest.mark.parametrize("found", [NOTHING, a_diagnosis(), EVERY_KIND, LAW, a_diagnosis(verdict=DOUBTFUL)])
def test_every_verdict_has_a_headline(toy: Run, found: Diagnosis) -> None:
    first, *_ = headline_lines(replace(toy, diagnosis=found))
    assert first == Headline(found.verdict)
    assert page_sentence(first)


def test_the_page_of_a_child_has_what_was_missing(toy: Run) -> None:
    """`run` makes no page of the case itself: that of its last child has to show the whole."""
    first = a_diagnosis(verdict={"kind": "one-of"})
    child = replace(toy, diagnosis=replace(NOTHING, name="child"), loop=LoopResults(behind=first, ladder=LADDER))
    before, now = headline_lines(child)
    assert before == Headline(first.verdict, first.name, past=True)
    assert now == Headline(NOTHING.verdict)
    subject = subject_model(child)
    assert subject is not None
    assert subject.first == FIRST.name
    assert child.behind is first, "of which both models are drawn"
    more = replace(child, diagnosis=replace(first, name="child"))
    assert [one.past for one in headline_lines(more)] == [True, False]
    assert more.behind is more.diagnosis, "whose models are drawn"
    own = told_of(toy, first)
    assert answer_of(replace(toy, diagnosis=own, loop=LoopResults(behind=own, ladder=LADDER))).subject is None


def test_a_law_suspected_of_a_child_hides_nothing_of_what_was_found(toy: Run) -> None:
    """The law is not calibrated: both models of what was found are drawn, and stand first."""
    first = a_diagnosis(steps=(), verdict={"kind": "none-of-these"})
    suspected = of_kind(replace(LAW, name="child"), "none-of-these", laws=LAW.laws)
    child = replace(toy, diagnosis=suspected, loop=LoopResults(behind=first, ladder=ending_with(toy)))
    before, left = headline_lines(child)
    assert before == Headline(first.verdict, first.name, past=True)
    assert isinstance(left, LawLeft)
    assert child.behind is first
    assert next_steps(child)[0].action == "discover"
    assert "compare" not in actions(child), "there is no page of the first model"


def test_without_a_diagnosis_the_calibration_stands_first_and_the_command_is_named(toy: Run) -> None:
    (verdict,) = headline_lines(toy)
    assert isinstance(verdict, PosteriorVerdict)
    assert next_steps(toy) == [NextStep("diagnose", "toy.yaml")]
    assert answer_of(toy).error_fall is None
    named = replace(toy, case=toy.case.model_copy(update={"source": Path("a<b>&c.yaml")}))
    assert answer_of(named).to_compare == "'a<b>&c.yaml'"


def test_the_ladder_is_judged_by_what_no_calibration_used() -> None:
    fall = error_fall(LADDER)
    assert (fall.judged, fall.before, fall.after, fall.added) == ("unseen", 0.039, 0.0033, "eddies")
    unknown = replace(LADDER, steps=tuple(replace(step, unseen=float("nan")) for step in LADDER.steps))
    assert error_fall(unknown).judged == "held_out_sections"
    assert (error_fall(replace(LADDER, unclear=("eddies",))).all_unclear, fall.unclear) == (True, ())
    both = replace(LADDER, steps=(FIRST, replace(LAST, added=("eddies", "wind"))), unclear=("wind",))
    assert (error_fall(both).unclear, error_fall(both).all_unclear) == (("wind",), False)
    alone = error_fall(ModelComparison((FIRST,), 0, "Nothing is added."))
    assert (alone.models, alone.reason) == (1, "Nothing is added.")


def test_the_ladder_is_of_what_was_added_and_not_of_what_is_left(toy: Run) -> None:
    """The page of a child that lacks something else: the fall of its errors is that of what its parent lacked."""
    place, steps = (an_anomaly(),), (replace(FIRST, name="parent"), LAST)
    parent, child = replace(a_diagnosis(), name="parent", places=()), replace(NOTHING, name="child", places=place)
    loop = LoopResults(behind=parent, ladder=replace(LADDER, steps=steps))
    assert causes_of(replace(toy, diagnosis=child, loop=loop)) == "eddies"
    other = replace(LAST, added=("unlisted_object_x33_y_0_6",))
    assert causes_of(replace(toy, loop=replace(loop, ladder=replace(LADDER, steps=(steps[0], other))))) == ""
    found = replace(parent, places=place)
    both = replace(LADDER, steps=(steps[0], replace(LAST, added=("eddies", *other.added))))
    assert causes_of(replace(toy, diagnosis=found, loop=LoopResults(behind=found, ladder=both)))


def test_what_to_do_next(toy: Run) -> None:
    question, page = Question(RivalEffects(("eddies", "<wind>")), (GAUGE,)), {"toy-eddies": "../toy-eddies/report.html"}
    loop = LoopResults(ladder=LADDER, questions=(question,), pages=page)
    better, measure, *instruments = next_steps(replace(toy, diagnosis=a_diagnosis(), loop=loop))
    assert better == NextStep("go-on", model=(LAST.config, page["toy-eddies"]))
    assert measure == NextStep("measure", measurement=GAUGE, purposes=(Purpose("eddies from <wind>", "", ""),))
    assert "eddies from &lt;wind&gt;" in page_sentence(measure)
    assert [one.action for one in instruments] == ["check-instrument"]
    assert actions(toy, diagnosis=NOTHING, loop=replace(loop, questions=())) == ["go-on", "done-here"]
    assert actions(toy, diagnosis=NOTHING, loop=LoopResults(questions=())) == ["done"]
    assert actions(toy, diagnosis=a_diagnosis()) == ["extend", "next", "check-instrument"]
    last = LoopResults(ladder=ending_with(toy), questions=())
    assert actions(toy, diagnosis=a_diagnosis(), loop=last)[:2] == ["extend-again", "none-proposed"]
    assert actions(toy, diagnosis=LAW)[0] == "discover"
    assert "discover" not in actions(toy, diagnosis=of_kind(LAW, "cannot-tell"))


def test_no_field_work_is_proposed_before_wrong_measurements_are_corrected(toy: Run) -> None:
    """Of velocities in cm/s read as m/s the page said to measure another section for six hours."""
    asked = LoopResults(questions=(Question(HiddenEffect("eddies", "k_s"), (GAUGE,)),))
    assert actions(toy, diagnosis=replace(a_diagnosis((), (), verdict=DOUBTFUL), instruments=()), loop=asked) == [
        "mend"
    ]


def test_questions_without_a_measurement_and_those_that_are_answered(toy: Run) -> None:
    weak = Question(HiddenEffect("steep_bank", "k_s"), (replace(GAUGE, then=3.0),))
    (step,) = next_steps(replace(toy, diagnosis=NOTHING, loop=LoopResults(questions=(weak,))))
    assert step.action == "no-measurement"
    (purpose,) = step.purposes
    assert (purpose.what, purpose.hidden_by, bool(purpose.title)) == ("steep_bank", "k_s", True)
    answered = Question(HiddenEffect("eddies", "k_s"), (replace(GAUGE, now=30.0, then=60.0),), 25.0)
    assert actions(toy, diagnosis=NOTHING, loop=LoopResults(questions=(answered,))) == ["done"]
    for questions in ((answered,), ()):  # on the page of a parent nothing is known of its child
        parent = LoopResults(ladder=LADDER, questions=questions)
        assert "done-here" in actions(toy, diagnosis=a_diagnosis(), loop=parent)
    child = LoopResults(ladder=ending_with(toy), questions=(answered,))
    assert "done" in actions(toy, diagnosis=NOTHING, loop=child)


def test_candidates_found_with_doubtful_measurements_are_folded() -> None:
    sound, section = diagnosis_section(a_diagnosis()), diagnosis_section(a_diagnosis(verdict=DOUBTFUL))
    assert (sound.doubtful, section.doubtful) == (False, True)
    assert section.first == []
    assert sorted(row.effect.name for row in section.others) == sorted(row.effect.name for row in sound.first)


def test_what_forbids_using_the_answer(toy: Run) -> None:
    few = replace(toy, diagnosis=a_diagnosis(), posterior=changed(toy.posterior, effective_size=7.0))
    found = not_reliable(few)
    assert found is not None
    assert (found.verdict, found.parameters, found.few) == (False, True, (7.0, toy.posterior.sample.members))
    assert not_reliable(replace(few, diagnosis=None)) is None, "the headline states it"
    assert not_reliable(replace(toy, posterior=changed(toy.posterior, effective_size=900.0, pareto_k=0.1))) is None
    both = not_reliable(replace(few, diagnosis=a_diagnosis(misfit={"p": 1e-9})))
    assert both is not None
    assert (both.verdict, both.parameters, both.misfit) == (True, True, True)


def test_members_that_failed_are_no_doubt_of_draws_that_were_solved(toy: Run) -> None:
    """2 of 64 failed where the search for the best began, and the parameters were not to be relied on."""
    assert toy.ensemble is not None
    status = toy.ensemble.status.copy()
    status[: len(status) // 10] = FAILED
    run = replace(toy, posterior=changed(toy.posterior, effective_size=900.0, pareto_k=0.1, failed=0),
                  ensemble=replace(toy.ensemble, status=status))  # fmt: skip
    first = not_reliable(run)
    assert first is not None
    assert first.failed == (204, 2048)
    drawn = replace(run, posterior=replace(run.posterior, refinement=a_refinement()))
    assert not_reliable(drawn) is None
    failed = not_reliable(replace(drawn, posterior=changed(drawn.posterior, failed=40)))
    assert failed is not None
    assert failed.failed == (40, 2048)
    ((members, limits),) = (one for one in findings(drawn) if isinstance(one[0], MembersSolved))
    assert (members.failed, members.draws, limits) == (204, (2048, 0), False)


@pytest.mark.slow
def test_the_answer_stands_before_all_else(toy: Run, tmp_path: Path) -> None:
    run = replace(toy, folder=tmp_path, diagnosis=told_of(toy, a_diagnosis()), loop=LoopResults(ladder=LADDER))
    text = written(run)
    parts = ['class="verdict"', 'id="ladder"', 'class="next"', 'class="sections"', 'id="parameters"', 'id="missing"']
    places = [text.index(part) for part in [*parts, 'id="found"', 'id="health"']]
    assert places == sorted(places)
    caveats = text[text.index('id="found"') : text.index('id="health"')]
    number = re.search(r"<summary>(\d+) ", caveats)
    assert number is not None
    assert int(number[1]) == caveats.count('class="doubt"')


def test_stations_have_the_decimals_they_were_measured_with(toy: Run) -> None:
    """A point gauge read to half a millimetre was told to err by one."""
    table = toy.observations.table.assign(value=0.09718, standard_error=0.0005, kind="level", x=4.25)
    for error, places in ((0.0005, 5), (float("nan"), 3)):
        shown = replace(toy.observations, table=table.assign(standard_error=error))
        assert station_rows(replace(toy, observations=shown))[0].places == places


def test_words_of_users_close_no_script() -> None:
    text = safe_json([{"section": "</script><script>alert('weeds')</script> & \u2028"}])
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text)[0]["section"].startswith("</script><script>")


def test_the_head_of_the_page_is_a_few_values_and_says_what_limits_them(toy: Run) -> None:
    beside = EffectsStillSignificant((("<wind>", 0.004),), remainder=False)
    left_over = a_diagnosis(verdict={"kind": "one-of", "remaining": (beside,)})
    first, own = told_of(toy, left_over), of_kind(replace(NOTHING, name="child"), "cannot-tell", reasons=(NoneLeads(),))
    child = replace(toy, diagnosis=own, loop=LoopResults(behind=first, ladder=LADDER))
    lines = headline_lines(child)
    assert [type(one) for one in lines] == [Headline, EffectsStillSignificant, Headline]
    assert "&lt;wind&gt;" in page_sentence(lines[1])
    hit = {name: np.array([False, name == "phi"]) for name in toy.posterior.parameters}
    pressed = replace(toy, diagnosis=NOTHING, posterior=changed(toy.posterior, bound_hit=hit))
    *_, bounds = headline_lines(pressed)
    assert isinstance(bounds, ParametersAtBounds)
    assert [(one.name, sides) for one, sides in bounds.parameters] == [("phi", ("upper",))]
    doubtful = replace(pressed, diagnosis=a_diagnosis(verdict=DOUBTFUL))
    assert len(headline_lines(doubtful)) == 1, "which only follows from the data"
    for chi2, small in ((61.5, True), (150.0, False)):
        posterior = replace(toy.posterior, refinement=a_refinement(chi2, 150))
        last = headline_lines(replace(toy, diagnosis=NOTHING, posterior=posterior))[-1]
        assert isinstance(last, MisfitTooSmall) == small


def test_the_zone_that_is_missed_most() -> None:
    zones = a_diagnosis().misfit.zones
    worst = worst_zone(a_diagnosis(errors={"scale": 2.1}))
    assert worst is not None
    assert (worst.section, worst.zone, worst.experiment, worst.of_kind, worst.scale) == (
        "D3",
        "floor",
        "low",
        False,
        2.1,
    )
    gauges = worst_zone(a_diagnosis(misfit={"zones": zones[zones["section"] == "gauges"]}))
    assert gauges is not None
    assert (gauges.section, gauges.of_kind, round(gauges.size, 1)) == ("gauges", True, 0.5)
    assert worst_zone(NOTHING) is None
