"""The numbers that decide a verdict, in one frozen value: each with its unit, where it comes from, and on which data.

`tests/studies/sensitivity.py` diagnoses the open cases with half and twice of each, by `using`; docs/sensitivity.md
holds the table.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import Enum
from typing import Any


class Provenance(Enum):
    """Where a constant comes from."""

    DERIVED = "derived"
    MEASURED = "measured"
    CHOSEN = "chosen"


def _constant(value: float, unit: str, provenance: Provenance, basis: str, near_one: bool = False) -> Any:
    """near_one: a share or a correlation that is varied by its distance from 1, which it may not exceed."""
    notes = {"unit": unit, "provenance": provenance, "basis": basis, "near_one": near_one}
    return field(default=value, metadata=notes)


DERIVED, MEASURED, CHOSEN = Provenance.DERIVED, Provenance.MEASURED, Provenance.CHOSEN


@dataclass(frozen=True)
class DecisionConstants:
    """All of them; `dataclasses.fields` has unit, provenance and basis of each as its metadata."""

    # The errors of what is compared.
    fingerprint_error: float = _constant(
        0.15, "-", MEASURED, "relative error of a fingerprint: those of mixing differ by 10 to 25 % on cells of two "
        "thirds of the size; before the open cases",
    )  # fmt: skip
    grid_error_share: float = _constant(
        0.6, "-", DERIVED, "error of the grid over the difference to cells of twice the size: 1/(2^p - 1) for an order "
        "p between 1 and 2; from 0.3 to 1 the sets of open-a to f were the same, with 0 there were false names",
    )  # fmt: skip
    grid_error_correlation: float = _constant(
        0.5, "-", CHOSEN, "correlation of that error between stations: above 0, as a grid that is too fast is so "
        "everywhere; below 1, as the pattern is not known exactly; before the open cases",
    )  # fmt: skip
    shape_error: float = _constant(
        0.5, "-", CHOSEN, "what a spot leaves of an object of another shape, over all that it does; after open-f, "
        "beside whose spot two more places were accepted without it",
    )  # fmt: skip
    law_fingerprint_error: float = _constant(
        0.07, "-", CHOSEN, "relative error of the fingerprint of a law in `discover`, most of it being common to the "
        "quantities of one term; after 76 sets of the study of laws with 0, 0.07 and 0.15",
    )  # fmt: skip
    misplaced_share: float = _constant(
        0.1, "-", MEASURED, "share of an accepted fingerprint that the model may place wrongly; on open-c and open-e"
    )
    scale_evidence: float = _constant(
        6.6, "-", DERIVED, "rise of twice the log-likelihood above which stated errors are too small: 99 % point of "
        "chi2 with one degree of freedom",
    )  # fmt: skip
    uncorrelated_chance: float = _constant(
        0.5, "-", CHOSEN, "prior probability that the errors of neighbours are not correlated: the data alone decide"
    )
    # Plausible sizes of what may be missing or off.
    spot_drag: float = _constant(
        1.0, "-", CHOSEN, "drag at a place over that of a cylinder of C_D = 1 as long as the shortest spot, 1/(2 l); "
        "on a floor of 3 m 1.1 1/m, which were 1 after twelve unlisted objects of the blind study",
    )  # fmt: skip
    spot_rise: float = _constant(
        0.3, "-", CHOSEN, "bed at a place over the mean depth; after the twelve objects and the measured confluence"
    )
    spot_inflow: float = _constant(0.05, "-", CHOSEN, "water that enters at a place over that of the inflows")
    spot_viscosity: float = _constant(
        0.3, "-", CHOSEN, "viscosity at a place over h u*: the least of streams (Fischer et al. 1979); 0.03 m2/s in "
        "1.1 m of water on a slope of 0.001",
    )  # fmt: skip
    spots_in_noise: float = _constant(
        0.3, "-", CHOSEN, "sizes of spots over plausible ones when the correlation of errors is estimated, as hundreds "
        "overlap; the verdicts of open-a to f were the same from 0.1 to 1",
    )  # fmt: skip
    reading_offset: float = _constant(10.0, "standard errors", CHOSEN, "plausible offset of a single reading")
    probe_offset: float = _constant(5.0, "standard errors", CHOSEN, "plausible offset of a probe, or of its position")
    gauge_offset: float = _constant(10.0, "standard errors", CHOSEN, "plausible offset of a gauge")
    line_offset: float = _constant(
        0.2, "m", CHOSEN, "plausible offset of a surveyed line: a staff misread by a decimetre or two; before river-h "
        "ran with it",
    )  # fmt: skip
    effect_sizes: float = _constant(
        1.0, "-", CHOSEN, "plausible sizes of listed effects over those of the library, of which some are relations of "
        "the literature and most are chosen: `vegglue effects NAME`",
    )  # fmt: skip
    extent_log_sd: float = _constant(
        0.7, "-", CHOSEN, "standard deviation of ln length and ln width of plants that are not on the map, around the "
        "medians of the patches on it, and of ln width of spots; before any patch was fitted",
    )  # fmt: skip
    patch_turn: float = _constant(
        15.0, "deg", CHOSEN, "standard deviation of the inclination of such plants; before any patch was fitted"
    )
    mapped_share: float = _constant(
        0.5, "-", CHOSEN, "share of such plants on those of the map above which a side of a patch lies off instead; "
        "before any patch was fitted",
    )  # fmt: skip
    # Odds and chances.
    missing_odds: float = _constant(
        5.0, "-", CHOSEN, "odds by which all hypotheses together have to lead nothing; after open-o (7.0), and natural "
        "reaches of seeds 301 to 348 with nothing hidden, four of whose seven false names had 1.6 to 4.5 (on 32 cells "
        "across, with bars too high near both ends)",
    )  # fmt: skip
    known_first_odds: float = _constant(
        5.0, "-", CHOSEN, "odds by which places have to lead what is known; after open-n (4.7) and eight objects of "
        "the blind study led by 5 to 10",
    )  # fmt: skip
    field_odds: float = _constant(
        100.0, "-", CHOSEN, "odds by which a field must lead all else, decisive evidence of Jeffreys (1961); after 10 "
        "gave three fields on 53 sites of the blind study with nothing hidden",
    )  # fmt: skip
    strong_odds: float = _constant(
        10.0, "-", CHOSEN, "odds within which a rival of another kind is followed, and by which a law must lead: "
        "strong evidence of Jeffreys (1961); same verdicts of open-a to f from e to e^6, one reading of open-b apart",
    )  # fmt: skip
    same_kind_odds: float = _constant(
        3.0, "-", CHOSEN, "odds within which a rival of the same kind is followed; after open-l and two drawn sites"
    )
    common_omission: float = _constant(
        3.0, "-", CHOSEN, "prior weight of a common omission, two surfaces stated as one, beside another listed "
        "effect; after the compound channel A1 of docs/measured.md, whose grass four effects explain alike",
    )  # fmt: skip
    listed_over_laws: float = _constant(
        10.0, "-", CHOSEN, "prior odds of all listed effects together to all laws together"
    )
    set_chance: float = _constant(0.95, "-", CHOSEN, "chance that a set holds; before the blind study", True)
    rival_share: float = _constant(
        0.05, "-", CHOSEN, "chance of a rival over the best one's below which it is excluded: odds of 20, strong "
        "evidence of Kass and Raftery (1995)",
    )  # fmt: skip
    alike_cosine: float = _constant(
        0.9, "-", CHOSEN, "cosine of projected fingerprints above which the data cannot separate them", True
    )
    # Alarms.
    false_alarm_rate: float = _constant(0.05, "-", CHOSEN, "rate at which errors alone sound the first alarm: usual")
    later_alarm_share: float = _constant(0.2, "-", CHOSEN, "rate of later alarms over that of the first")
    law_alarm_rate: float = _constant(0.01, "-", CHOSEN, "rate at which errors alone sound the alarm of laws")
    product_alarm_rate: float = _constant(
        0.01, "-", CHOSEN, "rate at which errors alone sound the alarm of products of laws, on top of that of laws"
    )
    effect_alarm_rate: float = _constant(
        0.04, "-", CHOSEN, "rate at which errors alone reach the score that counts as detectable"
    )
    detected_chance: float = _constant(
        0.95, "-", CHOSEN, "chance with which an effect of the smallest detectable size is detected: 19 of 20", True
    )
    significance: float = _constant(
        0.01, "-", CHOSEN, "chance that errors alone make any effect look as strong, below which one that was not "
        "accepted is significant: the rate of the alarm beside what was accepted",
    )  # fmt: skip
    hopeless_search: float = _constant(
        4.0, "-", CHOSEN, "fall of the objective that a search still needs, over the one that its next step promises, "
        "beyond which it is given up; after plants that are tried on river-c, f and g: up to 2.1 where plants are "
        "missing on the map, 4 to 11 after two to six steps where they are not",
    )  # fmt: skip
    # The verdict.
    instrument_errors: float = _constant(
        4.5, "standard errors", CHOSEN, "offset of an instrument that is a verdict; after seven false alarms of 3.1 to "
        "3.6 where two codes differed",
    )  # fmt: skip
    mostly_elsewhere: float = _constant(
        3.0, "-", CHOSEN, "largest change halfway between the sections over that at the stations from which `extend` "
        "adds no place (`diagnose` does not use it); after one object of 6.0 among 68 of the blind study, 0.1 to 2.2 "
        "in others",
    )  # fmt: skip
    least_bed_error: float = _constant(
        0.03, "-", CHOSEN, "error of the bed, as a mean over a spot and over the mean depth, below which it is not "
        "reported: 3 cm in 1 m, as surveys of natural reaches are judged",
    )  # fmt: skip
    held_out_ratio: float = _constant(
        1.3, "-", CHOSEN, "held-out errors over expected ones above which the model disagrees with the data"
    )
    held_out_alarm_rate: float = _constant(
        0.05, "-", CHOSEN, "rate at which errors alone exceed the ratio of held-out errors that a model may have: usual"
    )
    between_share: float = _constant(
        0.95, "-", CHOSEN, "share of the cases in which errors between the sections are below the reported bound", True
    )
    neighbours_within: float = _constant(
        1.5, "spacings", CHOSEN, "distance of two excluded readings of a section within which they are neighbours, "
        "which fall together as a misfit of the model does: neighbours are about one apart, others two",
    )  # fmt: skip
    few_sections: float = _constant(
        4.0, "sections", CHOSEN, "up to which same_kind_odds of another name without one of them are a doubt; of more "
        "one hardly decides, and strong_odds are needed: these after C of docs/measured.md without t0",
    )  # fmt: skip
    fingerprint_elsewhere: float = _constant(
        0.5, "-", CHOSEN, "share of a name's squared fingerprint that other sections must hold for one without which "
        "another name leads to be a doubt: after a drawn reach whose inflow had 80 % of it in one section",
    )  # fmt: skip
    model_error_evidence: float = _constant(
        3.3, "-", DERIVED, "rise of the log-likelihood above which the model needs more error of its own than it is "
        "allowed: half of the 99 % point of chi2 with one degree of freedom",
    )  # fmt: skip
    absurd_misfit: float = _constant(
        4.0, "-", CHOSEN, "chi2 over its degrees of freedom above which no name is believed: twice all errors allowed"
    )
    absurd_errors: float = _constant(
        4.0, "-", CHOSEN, "errors over stated ones, with all that was found, above which no name is believed; after A1 "
        "(2.3, named rightly) and F (6.0, wrongly) of docs/measured.md; in 347 runs of open, drawn and measured sites "
        "what is named beside these two has at most 1.7",
    )  # fmt: skip
    absurd_model_error: float = _constant(
        4.0, "-", CHOSEN, "the model's own error over the allowed one above which no law is believed: four times"
    )
    far_off_prior: float = _constant(
        4.0, "standard deviations", CHOSEN, "distance from its prior beyond which a parameter replaces a cause, and "
        "size over a plausible one beyond which an effect or a place does; after river-f, whose place of a wrong kind "
        "has 4.4; places of the open cases have at most 1.2",
    )  # fmt: skip
    implausible_size: float = _constant(
        3.0, "-", CHOSEN, "size of an effect over a plausible one above which it is told as too large to be believed, "
        "and not accepted if these data could not show it at plausible sizes; as the former since before the open "
        "cases, as the latter after the compound channel A2 of docs/measured.md (4.8); true effects of 300 drawn "
        "natural reaches that were accepted so had 1.4 to 2.6",
    )  # fmt: skip
    largest_scale: float = _constant(
        1.25, "-", CHOSEN, "errors over stated ones above which they, not the model, explain the misfit: stated errors "
        "are good to a quarter",
    )  # fmt: skip
    largest_correlation: float = _constant(
        0.8, "-", CHOSEN, "correlation of errors above which they, not the model, explain the misfit", True
    )
    testable_sizes: float = _constant(
        2.0, "-", CHOSEN, "sizes over plausible ones within which an effect must be detectable to be testable"
    )
    testable_share: float = _constant(
        0.25, "-", CHOSEN, "share of effects that must be testable before nothing is found missing"
    )
    most_groups: float = _constant(3.0, "-", CHOSEN, "groups of effects above which a set is too wide to be stated")
    poor_fit_chance: float = _constant(
        1e-3, "-", CHOSEN, "chance of the last misfit under errors alone below which something is still missing"
    )
    clear_fall: float = _constant(
        2.0, "standard errors", CHOSEN, "reduction of held-out mean square errors above which `extend` takes it for "
        "clear: 19 times of 20 it is no chance",
    )  # fmt: skip
    needed_errors: float = _constant(
        2.0, "standard errors", CHOSEN, "distance of an amplitude from off below which an earlier effect is dropped"
    )


_in_use = DecisionConstants()


def constants() -> DecisionConstants:
    """The constants in use."""
    return _in_use


@contextmanager
def using(values: DecisionConstants) -> Iterator[None]:
    """Other constants in all threads of this process, for a test or a study; no option of a user sets them.

    A process keeps calibrated baselines, which are not computed again: a study starts a process for each set.
    """
    global _in_use
    before, _in_use = _in_use, values
    try:
        yield
    finally:
        _in_use = before
