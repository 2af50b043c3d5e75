"""What `extend --auto` tries of a diagnosis: effects and places that were found, and places that are likelier."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from vegglue.calibration.baseline import Baseline
from vegglue.calibration.candidates import Candidate
from vegglue.case.schema import Case
from vegglue.diagnosis.between_sections import acts_elsewhere
from vegglue.diagnosis.child_config import candidate_at, candidate_named, spread_over_its_error
from vegglue.diagnosis.comparison import By, model_score
from vegglue.diagnosis.stepwise_choice import Choice, Names, Nominee, chosen
from vegglue.results.causes import LocalAnomaly
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.model_comparison import ModelScore

Addition = tuple[Candidate, Mapping[str, float]]  # an effect, and values of its shapes


def found_additions(case: Case, found: Diagnosis) -> list[Addition]:
    """Effects and places of a diagnosis in the order they were found, places spread over where they may lie; none that
    is at work in the case already.
    """
    station = found.predictions.station
    added: list[Addition] = [
        (candidate_named(case, station, step.accepted), found.candidate_effect(step.accepted).shapes)
        for step in found.steps
    ]
    spread = [spread_over_its_error(place) for place in found.places]
    added += [(candidate_at(case, place), place.shapes) for place in spread]
    # The last model of the diagnosis holds the parameters of what was found in that order.
    order = {name: position for position, name in enumerate(found.parameters.last)}
    added = [one for one in added if one[0].key not in case.effects]
    return sorted(added, key=lambda one: order.get(one[0].parameter, len(order)))


def tried_additions(case: Case, found: Diagnosis) -> list[Addition]:
    """What was found, and after each effect the place that is likelier than it: errors at what is held out decide, and
    where they are the same, what is known.
    """
    likelier = _likelier_places(found)
    tried: list[Addition] = []
    for one in found_additions(case, found):
        place = likelier.get(one[0].name)
        tried += [one, (candidate_at(case, place), place.shapes)] if place else [one]
    return tried


def choice_among(case: Case, found: Diagnosis, base_with: Callable[[Names], Baseline | None]) -> Choice:
    """Which of what is tried a model keeps, see `stepwise_choice`; no place that acts mostly where nobody measured.

    base_with: the calibrated model with some of what is tried, by name; None where it finds no flow.
    """
    scores: dict[Names, ModelScore | None] = {}

    def score_with(names: Names) -> ModelScore | None:
        if names not in scores:
            base = base_with(names)
            scores[names] = None if base is None else model_score(base)
        return scores[names]

    tried = nominees(case, found)
    elsewhere = _acting_elsewhere(case, found, [one.name for one in tried], base_with)
    choice = chosen([one for one in tried if one.name not in elsewhere], score_with, in_doubt(found))
    return replace(choice, refused=elsewhere | choice.refused)


def _acting_elsewhere(
    case: Case, found: Diagnosis, tried: Sequence[str], base_with: Callable[[Names], Baseline | None]
) -> dict[str, str]:
    """Why a place is not added, by its name, for it acts mostly where nobody measured."""
    parent, places = base_with(()), {candidate_at(case, place).name for place in places_tried(found)}
    alone = {name: base_with((name,)) for name in tried if name in places}
    told = {
        name: acts_elsewhere(parent, base) for name, base in alone.items() if parent is not None and base is not None
    }
    return {name: why for name, why in told.items() if why}


def nominees(case: Case, found: Diagnosis) -> list[Nominee]:
    """What is tried, as it is chosen from."""
    known = {candidate_at(case, place).name: name for name, place in _likelier_places(found).items()}
    return [
        Nominee(one.name, one.parameter, one.amplitude.off, known.get(one.name, ""), _only_in(one))
        for one, _ in tried_additions(case, found)
    ]


def _only_in(one: Candidate) -> dict[By, str]:
    """The one experiment or section in which an effect acts, if it acts in one only."""
    groups: dict[By, tuple[str, ...]] = {"experiments": one.experiments, "sections": one.sections}
    return {by: names[0] for by, names in groups.items() if len(names) == 1}


def places_tried(found: Diagnosis) -> list[LocalAnomaly]:
    """Places that were found and those that are likelier than an effect, spread over where they may lie."""
    return [*(spread_over_its_error(place) for place in found.places), *_likelier_places(found).values()]


def _likelier_places(found: Diagnosis) -> dict[str, LocalAnomaly]:
    """Places that are likelier than an accepted effect, by its name, spread over where they may lie."""
    return {
        step.accepted: spread_over_its_error(step.places[step.likelier_place])
        for step in found.steps
        if step.likelier_place
    }


def values_tried(case: Case, found: Diagnosis) -> dict[str, float]:
    """`values_found`, and the sizes of the likelier places."""
    likelier = _likelier_places(found).values()
    return values_found(case, found) | {candidate_at(case, one).parameter: one.amplitude for one in likelier}


def values_found(case: Case, found: Diagnosis) -> dict[str, float]:
    """Parameters of the last model of a diagnosis by name, sizes of places as large as they are spread."""
    values = {name: three[0] for name, three in found.parameters.last.items()}
    for place in found.places:
        share = spread_over_its_error(place).plausible / place.plausible
        values[candidate_at(case, place).parameter] *= share
    return values


def in_doubt(found: Diagnosis) -> bool:
    """Whether what was found may stand in for something else: then held-out errors must fall clearly."""
    return found.verdict.kind == "cannot-tell" or found.field is not None
