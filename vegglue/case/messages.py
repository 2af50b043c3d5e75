"""Why the schema refuses a file, as one sentence: where, what was expected, what came, what to do."""

import json
import re
import textwrap
from collections.abc import Iterable, Mapping
from typing import Any, get_args, get_origin

from vegglue.case.schema import Case
from vegglue.case.site_schema import Part
from vegglue.case.text_files import case_name
from vegglue.wording.numbers import most_like, nearest
from vegglue.wording.sentences import phrase

OF_A_PAIR = 2  # numbers in a range, or in a place
KeyPath = tuple[str | int, ...]


class CaseError(ValueError):
    """What is wrong with a part of a case: the keys that lead to it, and the rest of the sentence about it."""

    def __init__(self, place: KeyPath, complaint: str) -> None:
        super().__init__(complaint)
        self.place, self.complaint = place, complaint


def first_refusal(tree: Mapping[str, Any], problems: Iterable[Mapping[str, Any]]) -> CaseError:
    """The first of pydantic's problems with a tree of keys and values; misspelt keys before what they leave missing."""
    problem = min(problems, key=lambda problem: problem["type"] != "extra_forbidden")
    kind, location, got = problem["type"], problem["loc"], problem["input"]
    if kind == "missing":
        place = (*_place(tree, location[:-1]), location[-1])
        return CaseError(place, f"is missing{_meaning(place)}: add it")
    place = _place(tree, location)
    if kind == "extra_forbidden":
        return CaseError(place, f"is not a known key: {nearest(str(place[-1]), _keys(place[:-1]))}")
    expected = expected_in_words(problem)
    advice = ""
    if isinstance(got, str) and "number" in expected:
        if re.fullmatch(r"[-+]?\d+,\d+.*", got):
            advice = "comma"
        elif re.fullmatch(r"[-+]?[\d.]+\s*[A-Za-z%].*", got):
            advice = "unit"
        elif re.fullmatch(r"[-+\d.eE]+", got):
            advice = "quoted"
    if kind == "string_pattern_mismatch":  # of the name of a case, which is that of a folder
        return CaseError(
            place, f"expected {_meaning(place)[2:-1]} alone, got {shown_value(got)}; write {case_name(got)}"
        )
    if kind == "string_type":
        expected, advice = "a text", "unquoted" if isinstance(got, int | float) else ""
    return CaseError(place, phrase("unexpected_value", _meaning(place), expected, shown_value(got), advice))


def expected_in_words(problem: Mapping[str, Any]) -> str:
    """What one of pydantic's problems expected, without its opening words and the names of our types."""
    if problem["type"] == "too_long" and problem["ctx"]["max_length"] == OF_A_PAIR:
        return phrase("expected_pair")
    if problem["type"] == "tuple_type":
        return phrase("expected_list")
    if problem["type"] == "too_short":
        return phrase("expected_at_least", problem["ctx"]["min_length"])
    if problem["type"] == "too_long":
        return phrase("expected_at_most", problem["ctx"]["max_length"])
    if problem["type"] == "missing":
        return "a value"
    if problem["type"] in ("int_parsing", "int_from_float"):
        return "a whole number"
    if problem["type"] == "float_parsing":
        return "a number"
    expected = problem["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    if problem["type"] not in ("value_error", "literal_error"):
        for theirs, ours in (
            ("greater than or equal to", "a number of at least"), ("greater than", "a number above"),
            ("less than or equal to", "a number of at most"), ("less than", "a number below"),
            ("valid number", "number"),
        ):  # fmt: skip
            expected = expected.replace(theirs, ours)
    return re.sub(r"a valid dictionary( or instance of \w+)?", "keys and values", expected)


def refuse_unknown_without_value(tree: Mapping[str, Any], above: KeyPath = ()) -> None:
    """Raise CaseError for a key that has no value and that no part of a case knows; null only takes known keys away."""
    annotation = _annotation_at(above)
    free = any(get_origin(part) is dict for part in (annotation, *_alternatives(annotation)))
    known = None if free else _keys(above)  # free: names of the user's own, such as those of experiments
    for key, value in tree.items():
        if isinstance(value, Mapping):
            refuse_unknown_without_value(value, (*above, key))
        elif value is None and known and key not in known:
            raise CaseError((*above, key), f"is not a known key: {nearest(str(key), known)}")


def nearest_effect(word: str, known: Iterable[str]) -> str:
    """The end of a sentence about an unknown effect: the known one most like it, else where they are listed."""
    near = most_like(word, known)
    return f"did you mean `{near}`?" if near else phrase("effects_listed")


def dotted(place: KeyPath) -> str:
    """friction.zones[0].class for ('friction', 'zones', 0, 'class')."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place).lstrip(".")


def shown_value(got: Any) -> str:
    """A value of a config or site file as it may be written there."""
    if isinstance(got, dict):
        text = ", ".join(f"{key}: {value}" for key, value in got.items())
    else:
        text = json.dumps(got) if got is None or isinstance(got, bool) else repr(got)
    return textwrap.shorten(text or "nothing", 120, placeholder=" ...")


def _place(tree: Any, location: KeyPath) -> KeyPath:
    """The part of a pydantic location that is keys of the tree, without the names of alternatives tried."""
    place: KeyPath = ()
    for key in location:
        inside = key in tree if isinstance(tree, dict) else isinstance(tree, list) and key in range(len(tree))
        if inside:
            tree, place = tree[key], (*place, key)
    return place


def _below(annotation: Any, key: str | int) -> Any:
    """The type that stands at a key of a value of the annotated type, or None."""
    if isinstance(annotation, type) and issubclass(annotation, Part):
        field = _fields(annotation).get(str(key))
        return field.annotation if field else None
    parts = get_args(annotation)
    if get_origin(annotation) is dict:
        return parts[1]
    if get_origin(annotation) is tuple:
        return parts[0]
    return next((below for part in parts if (below := _below(part, key)) is not None), None)


def _fields(annotation: Any) -> dict[str, Any]:
    if isinstance(annotation, type) and issubclass(annotation, Part):
        return {field.alias or name: field for name, field in annotation.model_fields.items()}
    return {key: field for part in get_args(annotation) for key, field in _fields(part).items()}


def _annotation_at(place: KeyPath) -> Any:
    annotation: Any = Case
    for key in place:
        annotation = _below(annotation, key)
    return annotation


def _fields_at(place: KeyPath) -> dict[str, Any]:
    return _fields(_annotation_at(place))


def _alternatives(annotation: Any) -> list[Any]:
    """All types within an annotation that is no mapping, such as the sides of a union."""
    parts = [] if get_origin(annotation) is dict else [*get_args(annotation)]
    return parts + [inner for part in parts for inner in _alternatives(part)]


def _keys(place: KeyPath) -> list[str]:
    return [key for key, field in _fields_at(place).items() if not field.exclude]


def _meaning(place: KeyPath) -> str:
    field = _fields_at(place[:-1]).get(str(place[-1])) if place else None
    return f" ({field.description})" if field else ""
