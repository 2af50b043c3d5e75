"""What commands and pages print, as rendered examples: a person read each once, and each change is to be read again.

`PYTHONPATH=tests python tests/wording/test_rendered.py` writes the files beside this one anew.
"""

import re
import textwrap
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import get_args

import numpy as np
import pandas as pd
import pytest
from diagnoses import (
    EVERY_KIND,
    IMPLAUSIBLE,
    NOTHING,
    a_candidate_effect,
    a_diagnosis,
    a_patch,
    an_anomaly,
    an_effect_found,
    an_instrument,
    candidate_laws_of,
)
from model_scores import a_model_score
from posteriors import a_posterior, a_refinement, changed

from vegglue.case.safe_yaml import YamlProblem
from vegglue.cli.printed import (
    TERMINAL_WIDTH,
    posterior_lines,
    show_diagnosis,
    show_ladder,
    show_plan,
    show_questions,
    verdict_lines,
)
from vegglue.diagnosis.comparison import MEASUREMENT
from vegglue.diagnosis.stepwise_choice import HeldOutErrorsDidNotFall, UnclearFall
from vegglue.effects.library import SHIPPED
from vegglue.errors import InputError
from vegglue.importers.import_notes import (
    BanksOfBed,
    CentrelineTaken,
    ConfluenceAssumptions,
    CountedStems,
    FlowTaken,
    ImportNote,
    Noted,
    PatchesRead,
    RepeatsAveraged,
    SiteAssumptions,
    ThickStems,
    UnitsAssumed,
    UnreadFiles,
    UnreadHoldout,
    UnreadKeys,
)
from vegglue.inference.statements import (
    CalibrationDiffers,
    CalibrationTransfers,
    ErrorsEstimated,
    ErrorsOfComparison,
    ErrorsScaled,
    GroupsLeftOutScore,
    GroupsUntrusted,
    MisfitOfExperiments,
    MisfitTested,
    ModeFound,
    NamedParameter,
    NothingToCompare,
    ParameterAtBound,
    ParameterBetweenExperiments,
    ParameterNotIdentified,
    ParameterOffPrior,
    ParametersAlike,
    ParametersAtBounds,
    ParametersCorrelated,
    ReadingsExcluded,
    StationsStandOut,
    SurrogateLearned,
    ValidationProposed,
    WeightTailHeavy,
    posterior_statements,
)
from vegglue.measurements.kinds import kind_of
from vegglue.pages.answer import ErrorFall, NextStep, NotReliable, Purpose, SubjectModel
from vegglue.pages.findings import (
    CanopyHeightRead,
    CylinderCompared,
    DischargeMeasured,
    FlowOfBuiltInEngine,
    MassError,
    MembersSolved,
    ReadingsExcludedSince,
)
from vegglue.pages.headline import WorstZone
from vegglue.pages.parameters import PosteriorVerdict, ResidualCompared
from vegglue.results.causes import TERMS_AT_PLACES, CandidateEffect, FaultyInstrument, ModelErrorUsed, Rival
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.ensemble import FieldsTooLarge
from vegglue.results.field_exports import QUANTITIES_OF_FLOW
from vegglue.results.loop_results import HiddenEffect, OneOfRivals, ProposedMeasurement, Question, RivalEffects
from vegglue.results.plan import (
    Confusion,
    EffectsInGeneral,
    FieldPlan,
    OneEffect,
    PlannedEffect,
    PlannedParameter,
    PlannedPiece,
    ProposedPieces,
    TwoEffects,
    Work,
)
from vegglue.results.verdict import (
    AmplitudeBeyondPlausible,
    BedCorrected,
    BeyondHandbook,
    CellsTooCoarse,
    ChiSquare,
    CommandCompared,
    Conclusion,
    CorrelatedErrors,
    EffectsExcluded,
    EffectsNotExcluded,
    EffectsStillSignificant,
    EffectsUntestable,
    ErrorsLargerThanStated,
    ErrorsStillLarger,
    EstimateAtBound,
    EstimateOffPrior,
    FewTestable,
    HeldOutMissed,
    ImplausibleAmplitude,
    InflowDevelops,
    InstrumentExcluded,
    LawStandsOut,
    MeasuredStretch,
    MisfitBeyondErrors,
    MisfitRemains,
    MisfitTooSmall,
    MisfitUnexplained,
    ModelErrorExceeded,
    NameHangsOnSection,
    NeighboursCorrelated,
    NoneLeads,
    OneSection,
    ParameterFarFromPrior,
    ResultCompared,
    ShearLayer,
    StatedErrorsTooSmall,
    TooManyGroups,
    TooShallow,
    UncertainBetweenSections,
)
from vegglue.wording.sentences import layout, page_sentence, phrase, sentence
from vegglue.workflow.compare import Comparison
from vegglue.workflow.extend import ExtensionReason

HERE = Path(__file__).parent
COMMAND = "vegglue diagnose brook.yaml --details"
STEEP = next(one for one in SHIPPED if one.name == "steep_bank")
SURFACES = next(one for one in SHIPPED if one.name == "bank_roughness")


def brook(**verdict: object) -> Diagnosis:
    """A diagnosis of the brook with one real effect, and parts of its verdict replaced."""
    candidates: tuple[CandidateEffect, ...] = (
        replace(a_candidate_effect("steep_bank", amplitude=BANK), title=STEEP.title),
        replace(a_candidate_effect("bank_trend", test={"score": 2.1, "p_family": 0.3}), title="The banks change"),
    )
    found = a_diagnosis(candidates, (), verdict={"effects": (bank(),), "places": ()} | verdict)
    return replace(found, name="brook", places=(), instruments=())


BANK = {"value": 0.67, "interval95": (0.54, 0.79), "unit": "-", "refitted": True}


def bank(**fields: object):
    usual = {"title": STEEP.title, "amplitude": 0.67, "interval95": (0.54, 0.79), "unit": "-"}
    name = str(fields.pop("name", "steep_bank"))
    return an_effect_found(name, **(usual | {"rivals": (), "probability": 0.999} | fields))


def doubt(*reasons: object, **verdict: object) -> Diagnosis:
    return brook(kind="cannot-tell", **({"effects": ()} | verdict), reasons=reasons)


A_POOL = BedCorrected(49.0, -1.2, 1.4, 0.9, 1.3, 1.3, -0.3, (-0.45, -0.15), 9.2, 3.1, (45.0, 54.0))
A_LINE = FaultyInstrument("line", 36.0, 0.0, (), 0.149, (0.11, 0.188), "m", 11.4)
VERDICTS: dict[str, Diagnosis] = {
    "identified": brook(kind="identified"),
    "one of several": brook(kind="one-of", effects=(
        bank(probability=0.7, rivals=(Rival("bank_trend", "effect", 0.2), Rival("gauge", "gauge", 0.06, 12.0, np.nan))),
    )),
    "alike": brook(kind="one-of", effects=(bank(probability=0.9, alike=("bank_level_error",)),)),
    "a place is likelier": brook(kind="one-of", effects=(
        bank(probability=0.3, likelier=an_anomaly(x_error=0.4), likelier_probability=0.6),
    )),
    "two places": brook(kind="none-of-these", effects=(), places=(
        an_anomaly(term="bed", amplitude=-0.19, interval95=(-0.22, -0.16), unit="m"),
        an_anomaly(term="inflow", amplitude=0.05, interval95=(0.03, 0.07), unit="m3/s", x=12.0),
    )),
    "a place and an effect": brook(kind="none-of-these", places=(an_anomaly(),)),
    "an obstacle across the channel": brook(kind="none-of-these", effects=(), places=(
        an_anomaly(
            term="barrier", effect="unlisted_barrier", amplitude=52.8, interval95=(45.5, 60.2), unit="-", x_error=0.4,
            odds={"drag": 2.6e5, "gauge": 0.03},
        ),
    )),
    "plants that are not on the map": brook(kind="none-of-these", effects=(), places=(a_patch(),)),
    "plants along the channel that are not on the map": brook(
        kind="none-of-these", effects=(), places=(a_patch(angle=5.0),)
    ),
    "a field": brook(kind="none-of-these", effects=(), field=EVERY_KIND.field),
    "a law": brook(kind="none-of-these", effects=(), laws=candidate_laws_of("law_bank_speed_step")),
    "a law or an effect": brook(kind="one-of", laws=candidate_laws_of("law_bank_speed_step", calibrated=True)),
    "a law rather than an effect": brook(kind="none-of-these", laws=candidate_laws_of("law_bank_speed_step")),
    "perhaps a law": doubt(laws=candidate_laws_of("law_bank_speed_step")),
    "a law and a doubt": doubt(UncertainBetweenSections(1.5), laws=candidate_laws_of("law_bank_speed_step")),
    "an instrument and perhaps a law": brook(
        kind="instrument", effects=(), instruments=(an_instrument(),), laws=candidate_laws_of("law_bank_speed_step"),
    ),
    "nothing": replace(NOTHING, name="brook"),
    "an instrument": brook(kind="instrument", effects=(), instruments=(an_instrument(),), clears_the_model=True),
    "a surveyed line, and the bed": brook(
        kind="instrument", effects=(), instruments=(A_LINE,), clears_the_model=True, bed=A_POOL
    ),
    "nothing but the bed": brook(kind="nothing-missing", effects=(), clears_the_model=True, bed=A_POOL),
    "an instrument and a doubt": brook(
        kind="instrument", effects=(), instruments=(an_instrument(kind="probe", x=np.nan, factor=1.3),),
        reasons=(UncertainBetweenSections(1.5),),
    ),
    "wrong measurements": doubt(IMPLAUSIBLE),
    "undecided": doubt(NoneLeads(), undecided=(
        Rival("unlisted_bed", "bed", 0.79, 9.0, 0.5, 0.1), Rival("steep_bank", "effect", 0.08),
    )),
    "too many": doubt(TooManyGroups(tuple(Rival(name, "effect", 0.2) for name in ("wind", "waves", "steep_bank")))),
    "a name of one section": doubt(NameHangsOnSection("steep_bank", "B", "wind"), effects=(bank(),)),
    "one section": doubt(OneSection("B"), effects=(bank(),)),
    "two surfaces": brook(kind="identified", effects=(
        bank(name="bank_roughness", title=SURFACES.title, amplitude=1.1, interval95=(0.9, 1.3)),
    )),
    "a far parameter": doubt(ParameterFarFromPrior("n_b", 4.5), effects=(bank(),)),
    "a parameter that hangs on a section": doubt(ParameterFarFromPrior("eddy_viscosity", 6.0, ("t0", 0.1))),
    "an absurd size": doubt(AmplitudeBeyondPlausible("wind", 5.2), effects=(bank(),)),
    "misfit beyond errors": doubt(MisfitBeyondErrors(2.3), effects=(bank(),)),
    "misfit unexplained": doubt(MisfitUnexplained()),
    "larger errors": doubt(ErrorsLargerThanStated(1.8)),
    "correlated errors": doubt(CorrelatedErrors(0.85)),
    "model error": doubt(ModelErrorExceeded(1.6, 0.05)),
    "held out": doubt(HeldOutMissed(1.4)),
    "few testable": doubt(FewTestable()),
    "more is left": brook(
        kind="one-of", remaining=(ErrorsStillLarger(2.1), EffectsStillSignificant((("wind", 0.004),), remainder=True)),
        not_excluded=(("wind", "waves"), ("weir",)),
    ),
}  # fmt: skip
N_B, PHI = NamedParameter("n_b", "n_b", "s m^(-1/3)"), NamedParameter("phi", "φ", "-")
VELOCITY = kind_of("velocity")
NOTES = (
    EstimateAtBound("n_b", 0.0051, "s m^(-1/3)", 0.005, 0.05, True),
    InflowDevelops("probe_gain[x2.2]", 2.2, 14.9, 76.0), CellsTooCoarse(0.027, 0.015),
    ShearLayer(13.0, 0.95, 0.031, 0.147),
    BeyondHandbook("n_b", 0.062, "s m^(-1/3)", 0.01, 0.06, "chow-major"),
    EstimateOffPrior("eddy_viscosity", 0.002, "m2/s", 2.9),
    MisfitTooSmall(61.5, 150), ImplausibleAmplitude("wind", 3.4), EffectsNotExcluded(("wind", "waves"), beside=True),
    A_POOL, replace(A_POOL, x=2.0, change=0.11, interval95=(0.02, 0.2), between=(float("nan"), float("nan"))),
    InstrumentExcluded(A_LINE, True, 4.5),
    EffectsExcluded((("wind", "a laboratory"), ("unlisted_inflow", "glass walls"))),
    ModelErrorUsed(0.05, 0.01, 0.6, 0.0), LawStandsOut(candidate_laws_of("law_bank_speed_step"), ("steep_bank",)),
    NeighboursCorrelated(0.3), StatedErrorsTooSmall(1.2), InstrumentExcluded(an_instrument(), True, 4.5),
    EffectsUntestable((("k_s", ("wind", "waves")), ("", ("weir",))), 3, 3, False),
    EffectsUntestable((("k_s", ("wind",)),), 9, 12, True),
    MeasuredStretch(10.0, 30.0, 200.0, ("bed_trend", "wind")), TooShallow(0.02),
    MisfitRemains(ChiSquare(260.0, 150, 1e-8)), CommandCompared(2, 3, 0.4, "", ("k_s",), True, False),
    ResultCompared("HEC-RAS", 0.065, 0.001, 0.02, 0.029, 0.0007, 0.0, 0.003, 0.023, True, (0.15, 0.05, 0.15)),
    ResultCompared("", 0.21, 0.03, 0.3, 0.1, 0.02, 0.2, 0.3, np.nan, False, (0.15, 0.05, 0.15)),
)  # fmt: skip
STATEMENTS = (
    ModeFound(1, ((N_B, 0.031), (PHI, 8.1)), 61.5, 0.7), ErrorsEstimated(((VELOCITY, 0.02),), (kind_of("level"),)),
    ErrorsScaled(1.35), WeightTailHeavy(0.9), ParameterNotIdentified(PHI, 0.1, 80.0, 0.96),
    ParameterAtBound(PHI, "upper", 100.0, 0.14), ParameterOffPrior(N_B, 0.02, 0.04),
    ParametersAtBounds(((PHI, ("upper",)),)), ParametersAtBounds(((PHI, ("upper",)), (N_B, ("lower",)))),
    ParametersCorrelated(N_B, PHI, -0.93), ReadingsExcluded(1, 15),
    *(MisfitTested(*one) for one in (
        (3.1, 0, 1.0, "untested"), (300.0, 50, 1e-9, "unexplained"), (70.0, 50, 0.03, "hardly-explained"),
        (61.5, 150, 1.0, "too-small"), (50.0, 50, 0.5, "explained"),
    )),
    GroupsLeftOutScore(3, "June A", -2.92, -1.1), GroupsUntrusted(("June A",)),
    StationsStandOut(1, "June", "A", 12.5, -0.3, 4.2), StationsStandOut(9, "June", "A", 12.5, -0.3, 4.2),
    NothingToCompare(),
    ParameterBetweenExperiments(PHI, True, (("low", 0.9, 0.02), ("high", 1.1, 0.03)), 33.0, 1, 1e-8, 16.9, "differs"),
    MisfitOfExperiments((("low", 20.0, 12.0, 15), ("high", 15.0, np.nan, 15)), 1.2, 8.0, 1, 0.005),
    ParametersAlike((N_B,), 0.3),
    SurrogateLearned(22, 0, True, 0.0123, 0.034, 0.051), SurrogateLearned(100, 41, False, 0.21, 0.33, np.nan),
    ValidationProposed(1.0, 4.0), ErrorsOfComparison(False, 1.2), CalibrationTransfers(),
    CalibrationDiffers((PHI,), 1.2),
)  # fmt: skip
STEPS = (
    *(NextStep(action, "brook.yaml") for action in ("diagnose", "discover", "extend", "extend-again", "mend", "next")),
    NextStep("go-on", model=("brook+wind.yaml", "../brook-wind/report.html")),
    NextStep("compare", model=("brook.yaml", "")),
    NextStep("measure", measurement=ProposedMeasurement("a gauge at x = 5 m", "June", 5.0, 1, 0.5, 0.2, 9.0),
             purposes=(Purpose("steep_bank", STEEP.title, "k_s"), Purpose("wind from waves", "", ""))),
    NextStep("no-measurement", purposes=(Purpose("wind from waves", "", ""), Purpose("weir", "", "n_b"))),
    NextStep("done"), NextStep("done-here", model=("brook-wind", "")), NextStep("none-proposed"),
    NextStep("check-instrument", instrument=an_instrument()),
)  # fmt: skip
TOP = (
    SubjectModel("brook", ("wind", "steep_bank")),
    NotReliable(True, True, True, (), (7.0, 2048), False, (40, 2048), 0.002),
    NotReliable(False, True, False, (), None, True, None, None),
    ErrorFall("unseen", 2, "steep_bank", 0.039, 0.0033, 0.012, (), False, ""),
    ErrorFall("held_out_sections", 3, "wind and waves", 0.041, 0.038, np.nan, ("wind",), False, ""),
    ErrorFall("in_sample", 1, "", 0.02, 0.02, 0.012, (), False, "Nothing is added."),
    WorstZone("D3", "floor", "low", 2.3, 1.4, False, True),
)
FINDINGS = (
    PosteriorVerdict((N_B,), (PHI,), (), 21, True, 900.0, 2048, ResidualCompared(VELOCITY, 0.02, 0.015, "hardly")),
    PosteriorVerdict((), (), (), 21, False, 7.0, 2048, ResidualCompared(VELOCITY, 0.02, np.nan, "unknown")),
    *(ResidualCompared(VELOCITY, 0.02, 0.008, one, best=True) for one in ("exceeds", "explained", "far-less")),
    CylinderCompared(PHI, 2.3, 0.4, 2.2, 3.6, None), CanopyHeightRead("D3", "high", 0.8, 0.05, "", (0.75,)),
    ReadingsExcludedSince(2, "brook.yaml"),
    DischargeMeasured("D3", "high", 2.1, 0.1, 1.7, "", 4.0), DischargeMeasured("D3", "high", 2.1, 0.1, None, "", 0.0),
    MembersSolved(2044, 1, 3, None, (2048, 0)), MassError(2e-6), FlowOfBuiltInEngine(),
)  # fmt: skip


YAML = (
    *(YamlProblem(kind) for kind in (
        "tab", "second-colon", "no-colon", "further-text", "list-in-line", "closed-early", "second-document",
        "special-sign",
    )),
    YamlProblem("sign", "@"), YamlProblem("closes-nothing", "}"), YamlProblem("indentation", "<block mapping start>"),
    YamlProblem("no-value", "-"), YamlProblem("escape", "d"), YamlProblem("reference", "x"),
    YamlProblem("no-letter", "'\\x07'"), YamlProblem("open-bracket", "<stream end>", "{", "}", 3),
    YamlProblem("open-quote", begun=2), YamlProblem("other", "is not valid YAML"),
)  # fmt: skip
EXTENSIONS = (
    *(ExtensionReason((), kind) for kind in (
        "law", "nothing-missing", "instrument", "none-of-these", "cannot-tell", "one-of",
    )),
    ExtensionReason(
        ("wind", "unlisted_bed[x4,y1]"), "", (("unlisted_bed[x4,y1]", 4.62, 0.45),),
        {"wind": UnclearFall((("sections", 2e-5, 4e-4),))}, {"waves": HeldOutErrorsDidNotFall()},
    ),
)  # fmt: skip
BUDGET = (FieldsTooLarge(123.456, 5000, 100.0, 30.0, 12.5),)


def three_days(value: float) -> ProposedMeasurement:
    return ProposedMeasurement("section 0", "June", 1.0, 3, 1.5, 2.0, value)


QUESTIONS = (
    Question(RivalEffects(("wind", "waves")), (three_days(9.0),)),
    Question(OneOfRivals("wind", ("waves", "weir")), (three_days(2.1),)),
    Question(HiddenEffect("bed_trend", "n_b"), (ProposedMeasurement("gauge", "June", 1.0, 1, 0.5, 12.0, 60.0),), 25.0),
    Question(HiddenEffect("bed_trend", "n_b"), (ProposedMeasurement("gauge", "June", 1.0, 1, 0.5, 26.0, 60.0),), 25.0),
    Question(HiddenEffect("bed_trend", "n_b"), (ProposedMeasurement("gauge", "June", 1.0, 1, 0.5, 17.0, 18.0),), 25.0),
    Question(RivalEffects(("wind", "waves")), (ProposedMeasurement("gauge", "June", 1.0, 1, 0.5, 17.0, 18.0),)),
)


def printed(show: Callable[[], None]) -> str:
    with redirect_stdout(out := StringIO()):
        show()
    return out.getvalue().rstrip()


def wrapped(values: object) -> str:
    return "\n".join("\n".join(textwrap.wrap(sentence(one), TERMINAL_WIDTH)) for one in values)  # type: ignore[attr-defined]


def ladder() -> str:
    before, after = a_model_score("brook"), replace(a_model_score("brook-wind", 0.025), homogeneity={"phi": 1e-5})
    excluded = pd.DataFrame([["June", "velocity", "A", 1.0, 2.0, 0.5]], columns=MEASUREMENT)
    return printed(lambda: show_ladder(Comparison((before, after), excluded)))


def posterior() -> str:
    found = a_posterior(True)
    refined = replace(found, refinement=a_refinement(300.0, 50))
    pressed = changed(refined, bound_hit={"n_b": np.array([False, False]), "phi": np.array([False, True])})
    lines = posterior_lines(pressed, "runs/brook/posterior.h5", "vegglue report brook.yaml")
    return "\n".join([*lines, "", wrapped([*posterior_statements(found), *posterior_statements(refined)])])


def plan() -> str:
    def effect(name: str, smallest: float, chance: float, *similar: str) -> PlannedEffect:
        others = tuple(Confusion(other, 0.95) for other in similar)
        sizes = smallest, 0.5 * smallest, 2.0 * smallest, 0.5, 2.0
        return PlannedEffect(name, "", "-", *sizes, chance, chance, 0.9, others, None, "n_b", 0.3)

    transect = PlannedPiece(Work.TRANSECT, "low", 46.0, (-0.5, 0.0, 0.5), 1.4)
    gauge = PlannedPiece(Work.GAUGE, "low", 10.0, (0.0,), 0.5)
    line = PlannedPiece(Work.SURVEY_LINE, "", 46.0, (-1.0, 0.0, 1.0), 1.0)
    again = replace(transect, experiment="high", again=True)
    found = FieldPlan(
        case="brook", pieces=(transect, gauge), at_hand=0, proposed=False, hours=1.9, budget=16.0, draws=3,
        effects=(effect("elder", 0.2, 1.0, "viscosity"), effect("wind", 0.8, 0.5), effect("foliage", np.inf, 0.02)),
        places=(), instruments=(),
        parameters=(PlannedParameter("n_b", "s m^(-1/3)", "", 0.045, (0.0, 1.0), (0.4, 0.5)),),
        question=EffectsInGeneral(3), answer=1.2,
        further=(ProposedPieces((again,), 5.4, 1.2, 1.9, 1.7), ProposedPieces((line,), 1.0, 1.2, 1.25, 1.2)),
        extended=ProposedPieces((again, line), 6.4, 1.2, 2.0, 1.8),
    )  # fmt: skip
    about = replace(found, question=OneEffect("streamlining", -0.5, "-"), answer=0.3, further=(), extended=None)
    between = replace(about, question=TwoEffects("elder", "viscosity"), proposed=True, at_hand=12)
    shown = "\n\n".join(
        printed(lambda one=one, details=details: show_plan(one, details, "vegglue plan brook.yaml --details"))
        for one, details in ((found, False), (about, False), (between, True))
    )
    return "\n".join([shown, *(phrase("files_of_plan", "runs/brook/plan", planned) for planned in (True, False))])


def senses() -> str:
    """What both signs of an amplitude mean, of all effects that state it."""
    found = [(one.name, a, str(phrase("sense", one.name, a))) for one in SHIPPED for a in (1.1, -1.1)]
    return "\n".join(f"{name} {a:+g}: {text}" for name, a, text in found if text)


def page() -> str:
    return "\n".join(page_sentence(one) for one in (brook().verdict, *STATEMENTS[4:6], *STEPS[6:9]))


# Every kind of note of `import`, with a number and names; and what a site file leaves open.
IMPORTED = [
    *(ImportNote(kind, 2.0 if kind is not Noted.NEAR_AVERAGE else 0.4, ("x", "y")) for kind in Noted),
    ImportNote(Noted.UNNAMED_SECTIONS, 1),
    SiteAssumptions("site.yaml", 2.0, 0.8, True, False), SiteAssumptions("site.yaml", None, None, False, True),
    UnreadKeys("site.yaml", ("weather", "patches[0].diameter"), True), ThickStems(), CountedStems(),
    UnreadFiles(("gauging.xls", "t.mat")), UnreadFiles(tuple(f"IMG_{n}.jpg" for n in range(9))),
    UnreadHoldout("holdout.csv", "site.yaml"), UnreadHoldout("holdout.xlsx", "site.yaml", "holdout.csv"),
    RepeatsAveraged(1, at=(2.0, 0.5), copied=True, needed=3),
    RepeatsAveraged(12, together=2.2, apart=4.1, worst=(2.0, 0.5)),
    BanksOfBed(0.25, 3.1, 3.0), BanksOfBed(0.25, None, 3.0),
    PatchesRead(2, ("Density",), (), (), ("d_mm",), ()), PatchesRead(1, (), ("x", "y"), (), ("stems",), ("stems",)),
    CentrelineTaken(52.4, 31.0, 18.2), CentrelineTaken(40.0, 0.0, None),
    FlowTaken("HEC-RAS", "20JUN2026 12:00:00", 1400, 1210, 4.2, 12.345), FlowTaken("TELEMAC", "", 1, 1, 0.05, 0.2),
    UnitsAssumed(("x", "y"), ("stems",)), ConfluenceAssumptions(0.02, 0.01, 0.001, 0.011, 0.15),
]  # fmt: skip
CSV = Path("adv.csv")
FILES = "site.yaml: `files.adv.csv`"
AT_ROW = {"file": CSV, "row": 3}
OF_SITE = {"known": ("low", "high"), "site": "site.yaml", "key": "experiments"}
FOREIGN_FILES = (
    ("a.las", "a point cloud (LAS, LAZ)", "points"), ("a.dxf", "a drawing (DXF)", "drawn"),
    ("a.xls", "a workbook of Excel 97 (.xls)", "workbook"),
)  # fmt: skip
REFUSED = [
    InputError("unreadable", file=CSV, why="No such file or directory"),
    *(
        InputError("unreadable", file=Path("brook"), why="Is a directory", advice=one, by=Path("reed.yaml"))
        for one in ("path", "extends", "import", "site", "twin")
    ),
    InputError("not_there", folder=Path("brook"), key="files", name="b.csv"),
    InputError("file_too_large", file=CSV, most=1_000_000, got=2_000_000, result=False),
    InputError("file_too_large", file=Path("map.nc"), most=1_000_000, got=2_000_000, result=True),
    InputError("library_missing", file=Path("a.xlsx"), library="openpyxl", extra="field", instead="CSV"),
    *(
        InputError("option_value", option=option, expected=expected, choice=choice, got=got)
        for option, expected, choice, got in (
            ("--jobs", "a whole number", "", "two"), ("--to", "", "'spoty' is not one of 'pest', 'spotpy'.", "spoty")
        )
    ),
    *(
        InputError("invalid_json", file=Path("site.json"), line=2, column=14, problem=problem)
        for problem in ("key", "end", None)
    ),
    InputError("no_options", where=FILES, got="'low'"),
    InputError("unknown_option", where=FILES, key="experimnet", known=["columns", "experiment"]),
    InputError("unknown_option", where=f"{FILES}.columns", key="Q3", known=["u", "x"]),
    InputError("unexpected_option", where=f"{FILES}.line", expected="two points", got="[1, 2]"),
    InputError("zero_on_map", where=FILES),
    InputError("unknown_unit", where=f"{FILES}.units.u", quantity="velocity", got="cm/sek", known=["m/s", "cm/s"]),
    InputError("no_scale", where=f"{FILES}.units.x", quantity="length", got="0 m"),
    InputError("no_number_in_si", where=f"{FILES}.start[0]", unit="m", got="'far'"),
    *(InputError("no_result", file=Path("map.nc"), mesh=mesh) for mesh in (True, False)),
    InputError("no_geojson", file=Path("p.geojson"), what="polygons"),
    *(
        InputError("missing_columns", file=CSV, wanted=("x", "y", "u"), got=got, missing=missing)
        for got, missing in ((["x", "y", "v"], ["u"]), (["x"], ["y", "u"]), ([], ["x", "y", "u"]))
    ),
    *(
        InputError("far_places", where="a.csv", origin=[683120.0, 247480.0], got=[2.5, 8.25], apart=2.24e6, cause=cause)
        for cause in ("exchanged", "degrees", "channel", "digits", "ft", "")
    ),
    *(InputError("foreign_format", file=Path(name), name=of, instead=kind) for name, of, kind in FOREIGN_FILES),
    InputError("ragged_record", file=Path("a.dat"), row=2, fields=18, got=17),
    *(
        InputError("option_of_records", file=Path(name), option="position", records="records of a probe", dat=dat)
        for name, dat in (("a.dat", True), ("a.csv", False))
    ),
    *(
        InputError("unreadable_as", file=Path(name), kind=kind, why="File is not a zip file")
        for name, kind in (("a.xlsx", "workbook"), ("map.nc", "result"))
    ),
    InputError("other_structures", file=Path("a.mat"), kind="QRev", why="no transects"),
    InputError("binary_record", file=Path("a.vec"), nortek=True, ending=".vec"),
    InputError("binary_record", file=Path("a.r00"), nortek=False, ending=".r00"),
    InputError("no_table", file=CSV, sheets=()),
    InputError("no_table", file=Path("a.xlsx"), sheets=("Notes", "April", "May")),
    InputError("no_sheet", file=Path("a.xlsx"), sheet="May", got=["April", "June"]),
    InputError("no_number", **AT_ROW, column="u", got="x", why="no number"),
    InputError("no_number", **AT_ROW, column="u", got="0,5", why="point"),
    *(InputError("no_number", **AT_ROW, column="u", got=got, why="") for got in ("u", "")),
    *(InputError("unit_elsewhere", **AT_ROW, roles=roles, unit="ft") for roles in (["level"], ["x", "y", "level"])),
    InputError("no_name", **AT_ROW, column="case", got=""),
    InputError("unprintable_name", **AT_ROW, column="case", got="\x1b"),
    InputError("unknown_name", **AT_ROW, column="experiment", known=["low", "high"], got="mid"),
    InputError("out_of_bounds", **AT_ROW, column="u_std", got=0.0, above=0.0),
    InputError("out_of_bounds", **AT_ROW, column="u_se", got=-0.1, least=0.0),
    InputError("out_of_bounds", **AT_ROW, column="u", got=1e12, most=1e9),
    *(InputError("odd_error", **AT_ROW, column="u_se", got=got, least=1e-9, most=1e9) for got in (1e-12, -0.01)),
    InputError("other_x", **AT_ROW, column="x", case="low/S1", first=2.0, got=2.5),
    InputError("other_width", **AT_ROW, fields=4, got=5, headed=True, commas=True),
    InputError("other_width", **AT_ROW, fields=4, got=5, headed=False, commas=False),
    InputError("places_in_degrees", where="adv.csv, column 'lon'", role="x"),
    InputError("wide_table", where="adv.csv:", experiments=("low", "high"), got=["u low", "u high"]),
    InputError("unknown_experiment", where="adv.csv, row 3", name="mid", elsewhere=False, option=False, **OF_SITE),
    InputError("unknown_experiment", where="adv.csv, row 3", name="", elsewhere=False, option=False, **OF_SITE),
    InputError("unknown_experiment", where="adv.csv", name="flood", elsewhere=True, option=True, **OF_SITE),
    InputError("no_column_of_experiments", where="adv.csv:", file="adv.csv", known=("low", "high"), alike=[]),
    InputError(
        "no_column_of_experiments", where="adv.csv:", file="adv.csv", known=("low", "high"),
        alike=[("Q", ["small", "large"], True)],
    ),
    InputError("no_measurements", where="brook", files=["velocities.csv", "levels.csv"]),
    InputError("no_value_measured", where="brook", tables=[{"name": "adv.csv", "taken": "x from x; 3 rows"}]),
    InputError(
        "no_measurement_in_file", where="adv.csv", got="x from x; 3 rows; not read: Ve1",
        usual=[("velocities", ("u", "velocity")), ("levels", ("level", "stage"))],
    ),
    InputError("no_polygon", file=Path("plants.geojson"), feature=2, got="Point"),
    InputError("no_polygon", file=Path("plants.geojson"), feature=2, got=""),
    InputError("no_polygon", file=Path("plants.geojson"), feature=2, got="Area"),
    InputError("few_corners", file=Path("plants.geojson"), polygon=2, got=2),
    InputError("no_levels", file=Path("bed.asc")),
    InputError("no_bed_columns", file=CSV, got=("x", "y", "depth"), deep=True),
    InputError("no_bed_columns", file=CSV, got=("Chainage", "Station", "Elevation"), deep=False),
    *(InputError("no_effects_in_file", file=Path("own.py"), got=one) for one in (None, "", "Effect", "int")),
    InputError("not_computed", file=Path("a.hdf"), areas=True),
    InputError("not_computed", file=Path("a.hdf"), areas=False),
    InputError("not_on_mesh", file=Path("map.nc"), missing=["u", "v"], layers=True),
    InputError("no_roughness", file=Path("map.nc"), lawless=True),
    InputError("flow_off_grid", file=Path("map.nc"), most=15.0, got=40.2, x=3.2, straight=True),
    InputError("unlike_flow", file=Path("a.yaml"), quantity="level", limit=0.05, got=0.1, beyond=0.0, spread=0.2),
    InputError("unlike_flow", file=Path("a.yaml"), quantity="area", limit=0.05, got=0.1, beyond=0.08, spread=0.0),
    InputError("unlike_flow", file=Path("a.yaml"), quantity="velocity", limit=0.15, got=0.2, beyond=0.0, spread=0.0),
]  # fmt: skip
# Titles and meanings in configs that are made, and names in exported files.
MADE = [
    *(phrase("title_of_case", one, "brook") for one in ("folder", "confluence", "flat", "twin", "relevelled")),
    *(
        phrase("meaning_of_parameter", one)
        for one in (
            "bed", "walls", "banks", "viscosity", "phi", "canopy_height", "discharge", "side_discharge", "outlet_level"
        )
    ),
    phrase("meaning_of_parameter", "viscosity_within", 2.0), phrase("meaning_of_parameter", "bed_class", "gravel"),
    phrase("meaning_of_parameter", "bed_of_run", ("HEC-RAS", 0.035)), phrase("sheet_to_fill_in"), phrase("sealed"),
    *(phrase("quantity_of_flow", one) for one in QUANTITIES_OF_FLOW), phrase("any_time"),
    *(phrase("coordinates_of", one) for one in ("model", "map")), phrase("flow_of", "posterior", False, True),
    phrase("flow_of", "prior", True), phrase("comparison_in_short", 2), phrase("no_built_in_flow"),
    phrase("compiled_anew"), phrase("new_reach", "brook/case.yaml", 40.0),
    phrase("next_measurements", "`vegglue check`"),
    phrase("next_commands", ["`vegglue check`", "`vegglue run`"]), phrase("no_room_for", ["RMSE", "chi2"]),
]  # fmt: skip
RENDERED: dict[str, Callable[[], str]] = {
    "made": lambda: "\n".join(MADE),
    "imports": lambda: wrapped(IMPORTED),
    "refusals": lambda: wrapped(map(str, REFUSED)),
    "files": lambda: wrapped((*YAML, *EXTENSIONS, *BUDGET)),
    "verdicts": lambda: "\n\n".join(
        "\n".join([f"## {name}", *verdict_lines(found, COMMAND, 13), "", wrapped([found.verdict])])
        for name, found in VERDICTS.items()
    ),
    "details": lambda: printed(lambda: show_diagnosis(brook(notes=(NeighboursCorrelated(0.3),)))),
    "notes": lambda: wrapped(NOTES),
    "posterior": posterior,
    "statements": lambda: wrapped(STATEMENTS),
    "answer": lambda: "\n".join([wrapped([*TOP, *STEPS]), str(phrase("error_before", TOP[3]))]),
    "findings": lambda: wrapped(FINDINGS),
    "ladder": ladder,
    "questions": lambda: printed(lambda: (show_questions("brook", QUESTIONS), show_questions("brook", []))[0]),
    "effect": lambda: layout("effect_described", STEEP),
    "plan": plan,
    "senses": senses,
    "page": page,
}


@pytest.mark.parametrize("name", RENDERED)
def test_words_are_those_that_were_read(name: str) -> None:
    assert RENDERED[name]() + "\n" == (HERE / f"{name}.txt").read_text(encoding="utf-8")


def test_a_verdict_is_short_and_a_command_is_whole() -> None:
    for name, found in VERDICTS.items():
        lines = verdict_lines(found, COMMAND, 13)
        assert len(lines) <= 13, name
        assert max(map(len, lines)) <= TERMINAL_WIDTH, name


def test_each_conclusion_is_among_the_examples() -> None:
    assert {found.verdict.conclusion for found in VERDICTS.values()} == set(get_args(Conclusion))


def test_each_refusal_has_a_template_and_an_example() -> None:
    package = HERE.parents[1] / "vegglue"
    template = (package / "wording" / "templates" / "refusals.j2").read_text(encoding="utf-8")
    worded = set(re.findall(r"macro (\w+)\(v\)", template))
    code = "".join(path.read_text(encoding="utf-8") for path in package.rglob("*.py"))
    raised = set(re.findall(r'InputError\(\s*"(\w+)",|refuse_rows\(.*?"(\w+)",', code))
    assert {one or other for one, other in raised} == worded == {one.kind for one in REFUSED}


def test_each_list_of_words_by_place_term_has_them_all() -> None:
    """`plan` ended without its page when obstacles across the channel were new."""
    wording = HERE.parents[1] / "vegglue" / "wording"
    lists = [
        set(re.findall(r'"(\w+)":', words))
        for path in wording.rglob("*.j2")
        for words in re.findall(r'\{"drag":[^{}]*\}', path.read_text(encoding="utf-8"))
    ]
    assert len(lists) >= 3
    assert all(one == set(TERMS_AT_PLACES) for one in lists)


if __name__ == "__main__":
    for name, render in RENDERED.items():
        (HERE / f"{name}.txt").write_text(render() + "\n", encoding="utf-8")
