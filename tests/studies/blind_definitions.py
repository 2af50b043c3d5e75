"""What counts as what in the study: pure functions of one record. None where a question does not arise."""

from typing import Any

import numpy as np

from vegglue.effects import sensor
from vegglue.effects.identity import EffectIdentity

Record = dict[str, Any]
Thing = dict[str, Any]  # a hidden one, a step, a place or an instrument

# Verdicts that say that something is there.
SAID = ("identified", "one-of", "none-of-these", "instrument")
# A place further off points at something else [m].
NEAR = 1.5
# Standard errors of a place below which its digits say enough [m], along and across: half of a spot.
STATED = (0.5, 0.25)
FEW = 3
ORACLE_SHARE, MISSED_SHARE = 1.1, 1.3
SENSORS = {effect.name for effect in sensor.EFFECTS}


def hidden_of(record: Record, kind: str) -> list[Thing]:
    """Hidden things of one kind: listed, unlisted or instrument."""
    return [one for one in record["hidden"] if one["kind"] == kind]


def hidden_names(record: Record) -> set[str]:
    """Names of hidden listed effects."""
    return {one["name"] for one in hidden_of(record, "listed")}


def truths(record: Record) -> set[str]:
    """Names that a diagnosis may rightly say: what is hidden, and imperfections that it finds with their sign."""
    sizes = record.get("sizes", {})
    also = {name for name, size in record["also_true"].items() if size * sizes.get(name, size) > 0.0}
    return hidden_names(record) | also


def is_true_step(record: Record, step: Thing) -> bool:
    """One of its rivals is so, or the place that it tells before them."""
    first = place_told_first(step)
    return bool(truths(record) & set(step["rivals"])) or (first is not None and bool(objects_near(record, first)))


def place_told_first(step: Thing) -> Thing | None:
    """A place that is likelier than every group of rivals, by the x and y [m] in its name; None without."""
    others = {name: chance for name, chance in step["others"].items() if name.startswith("unlisted_")}
    best = max(others, key=others.__getitem__, default="")
    chance = dict(zip(step["rivals"], step["chances"], strict=True))
    if not best or others[best] <= max(sum(chance[name] for name in group) for group in step["groups"]):
        return None
    x, y = best.partition("[x")[2].rstrip("]").split(",y")
    return {"x": float(x), "y": float(y)}


def objects_near(record: Record, place: Thing) -> list[Thing]:
    """Hidden unlisted objects within 1.5 m of a place that was found."""
    known = [one for one in hidden_of(record, "unlisted") if one["x"] is not None]
    return [one for one in known if np.hypot(place["x"] - one["x"], place["y"] - one["y"]) <= NEAR]


def is_true_instrument(record: Record, found: Thing) -> bool:
    """It shares a station with a hidden instrument."""
    return any(set(one["stations"]) & set(found["stations"]) for one in hidden_of(record, "instrument"))


def is_true_field(record: Record, found: Thing) -> bool:
    """It is of viscosity where that is truly off, or stands out most within 1.5 m of a hidden object."""
    return bool(objects_near(record, found)) or (found["term"] == "viscosity" and "viscosity" in truths(record))


def judged(record: Record) -> list[bool]:
    """Whether each step, place and instrument that the verdict names is true; of a field, that alone."""
    if not named(record):
        return []
    if record.get("field"):
        return [is_true_field(record, record["field"])]
    return [
        *(is_true_step(record, step) for step in record["steps"]),
        *(bool(objects_near(record, place)) for place in record["places"]),
        *(is_true_instrument(record, found) for found in record["instruments"]),
    ]


def named(record: Record) -> bool:
    """The verdict says that something is there. Where it cannot tell, what it held up to then is no name."""
    return record["verdict"] in SAID


def false_named(record: Record) -> bool:
    """Something that is not there was named; a verdict alone is false where nothing is hidden."""
    found = judged(record)
    return not all(found) if found else named(record) and not record["hidden"]


def only_false(record: Record) -> bool:
    """Something that is not there was named, and nothing that is."""
    return false_named(record) and not any(judged(record))


def hidden_found(record: Record) -> bool:
    """Some hidden thing was found, whatever else was named."""
    listed = {one["name"] for one in hidden_of(record, "listed")}
    return (
        any(listed & set(step["rivals"]) for step in record["steps"])
        or any(objects_near(record, place) for place in record["places"])
        or instrument_found(record) is True
    )


def false_beside_true(record: Record) -> bool:
    """Some hidden thing was found, and something false was named too."""
    return hidden_found(record) and not all(judged(record))


def in_steps(record: Record) -> bool | None:
    """Every hidden listed effect is among the rivals of some step."""
    rivals = {name for step in record["steps"] for name in step["rivals"]}
    listed = hidden_of(record, "listed")
    return all(one["name"] in rivals for one in listed) if listed else None


def in_set(record: Record) -> bool | None:
    """Every hidden listed effect is in a step, or, where nothing that is named is false, among what is not excluded."""
    listed = hidden_of(record, "listed")
    found = judged(record)
    if not listed or (named(record) and not (found and all(found))):
        return in_steps(record)
    rivals = {name for step in record["steps"] for name in step["rivals"]}
    left = {name for group in record["not_excluded"] for name in group}
    return all(one["name"] in rivals | left for one in listed)


def few_groups(record: Record) -> bool:
    """At most three groups: in the step with the hidden effect, else in what is not excluded if that holds it, else in
    the first step.
    """
    holding = [step for step in record["steps"] if hidden_names(record) & set(step["rivals"])]
    if holding or (record["steps"] and not in_set(record)):
        return len((holding or record["steps"])[0]["groups"]) <= FEW
    return (in_set(record) or not named(record)) and 0 < len(record["not_excluded"]) <= FEW


def few_and_true(record: Record) -> bool:
    """At most three groups, and the hidden effect in them."""
    return few_groups(record) and in_set(record) is True


def wrong_alone(record: Record) -> bool:
    """The verdict is one name, and no step is true."""
    return record["verdict"] == "identified" and not any(is_true_step(record, step) for step in record["steps"])


def wrong_for_object(record: Record) -> bool:
    """A name or an instrument is the verdict on an unlisted object, and no place near it was found."""
    return record["verdict"] in ("identified", "instrument") and not place_near(record)


def places_named(record: Record) -> list[Thing]:
    """Places of the verdict; of a field, where it stands out most."""
    if not named(record):
        return []
    return [record["field"]] if record.get("field") else list(record["places"])


def none_of_these(record: Record) -> bool:
    """The verdict is none of these."""
    return record["verdict"] == "none-of-these"


def known_first(record: Record) -> bool:
    """The verdict begins with a listed effect or an instrument."""
    steps = record["steps"]
    begins = place_told_first(steps[0]) is None if steps else bool(record["instruments"])
    return named(record) and not none_of_these(record) and begins


def told_near(record: Record) -> bool:
    """A place within 1.5 m of an unlisted object was named, or told first of several causes."""
    first = [place_told_first(step) for step in record["steps"]] if named(record) else []
    return place_near(record) or any(objects_near(record, place) for place in first if place is not None)


def place_near(record: Record) -> bool:
    """A place was named within 1.5 m of an unlisted object."""
    return any(objects_near(record, place) for place in places_named(record))


def place_as_told(record: Record) -> bool | None:
    """The first place lies within two of its stated standard errors of an unlisted object, along and across; errors
    below those of STATED count as these. None where no place was named.
    """
    hidden = hidden_of(record, "unlisted")
    if not hidden or not named(record) or record.get("field") or not record["places"]:
        return None
    place = record["places"][0]
    errors = [max(place[f"{axis}_error"], least) for axis, least in zip("xy", STATED, strict=True)]
    return any(
        all(abs(place[axis] - one[axis]) <= 2.0 * error for axis, error in zip("xy", errors, strict=True))
        for one in hidden
    )


def right_term(record: Record) -> bool:
    """A place was named within 1.5 m of an unlisted object, with its term; a field of friction is one of drag."""
    terms = [
        ("drag" if place["term"] == "friction" else place["term"], one["term"])
        for place in places_named(record)
        for one in objects_near(record, place)
    ]
    return any(found == true for found, true in terms)


def right_term_if_near(record: Record) -> bool | None:
    """The term is right, of those found within 1.5 m."""
    return right_term(record) if place_near(record) else None


def instrument_found(record: Record) -> bool | None:
    """Every hidden instrument shares a station with one that the verdict names."""
    hidden = hidden_of(record, "instrument")
    stations = {row for found in record["instruments"] for row in found["stations"]} if named(record) else set()
    return all(stations & set(one["stations"]) for one in hidden) if hidden else None


def reading_set_aside(record: Record) -> bool | None:
    """The bad reading was named as an instrument, or some station was set aside."""
    known = instrument_found(record)
    return None if known is None else known or record["flagged"] > 0


def sensor_in_set(record: Record) -> bool:
    """An effect of instruments is in the set, or the instrument was found."""
    return instrument_found(record) is True or any(EffectIdentity.parse(name).name in SENSORS for name in record["set"])


def amplitudes_held(record: Record) -> list[bool]:
    """Whether the interval of each amplitude holds the true one."""
    known = [one for one in record["amplitudes"] if None not in (one["low"], one["high"], one["true"])]
    return [one["low"] <= one["true"] <= one["high"] for one in known]


def error_of(record: Record, name: str) -> float | None:
    """One of the held-out errors [m/s], see `blind_held_out`; None where it is not known."""
    value = (record.get("held_out") or {}).get(name)
    return float(value) if value is not None and np.isfinite(value) else None


def error_fell(record: Record) -> bool | None:
    """The held-out error is less with all that was named, or held up to then."""
    return _less(record, "after", "before") if record["steps"] or record["places"] else None


def error_fell_where_said(record: Record) -> bool | None:
    """The held-out error is less with what was named, where the verdict names."""
    return error_fell(record) if named(record) else None


def error_fell_as_kept(record: Record) -> bool | None:
    """The held-out error is less with what `extend --auto` keeps, where it keeps something."""
    return _less(record, "kept", "parent")


def error_falls_with_truth(record: Record) -> bool | None:
    """The held-out error is less with the true effect in the model, calibrated, than without."""
    return _less(record, "oracle", "parent")


def _less(record: Record, after: str, before: str) -> bool | None:
    errors = error_of(record, after), error_of(record, before)
    return None if errors[0] is None or errors[1] is None else errors[0] < errors[1]


def near_oracle(record: Record) -> bool | None:
    """The held-out error is at most 1.1 times that with the true effect."""
    return _near_oracle(record, "after")


def near_oracle_as_kept(record: Record) -> bool | None:
    """That of the model as `extend --auto` leaves it, with something added or not, is."""
    kept = error_of(record, "kept")
    return _near_oracle(record, "parent" if kept is None else "kept")


def _near_oracle(record: Record, name: str) -> bool | None:
    after, oracle = error_of(record, name), error_of(record, "oracle")
    return None if after is None or oracle is None else after <= ORACLE_SHARE * oracle


def silent_beside_error(record: Record) -> bool | None:
    """Nothing is missing, it is said, while the held-out error is over 1.3 times the noise."""
    before, noise = error_of(record, "before"), error_of(record, "noise")
    if before is None or noise is None or record["verdict"] != "nothing-missing":
        return None
    return before > MISSED_SHARE * noise
