"""The identity of an effect: its text goes back to the same value, and one module alone reads that text."""

import ast
import re

import pytest
from house import FILES, module_of, tree_of

from vegglue.effects.identity import EffectIdentity
from vegglue.effects.library import library

TEXTS = {
    "steep_bank": EffectIdentity("steep_bank"),
    "discharge_error[high]": EffectIdentity("discharge_error", ("high",)),
    "discharge_error[low,mid]": EffectIdentity("discharge_error", ("low", "mid")),
    "probe_gain[km 12.5, left]": EffectIdentity("probe_gain", ("km 12.5", " left")),
    'probe_gain["A, left",B]': EffectIdentity("probe_gain", ("A, left", "B")),
    'probe_gain["the ""old"" bridge, left"]': EffectIdentity("probe_gain", ('the "old" bridge, left',)),
    "device_gain[adv [2]]": EffectIdentity("device_gain", ("adv [2]",)),
    "patch_density[p5]": EffectIdentity("patch_density", ("p5",)),
    "unlisted_bed[x47.29,y-0.23]": EffectIdentity.at_place("unlisted_bed", 47.29, -0.23),
    "unlisted_object[x1e-05,y100000]": EffectIdentity.at_place("unlisted_object", 1e-5, 1e5),
}


@pytest.mark.parametrize(("text", "identity"), TEXTS.items())
def test_text_and_value_go_back_and_forth(text: str, identity: EffectIdentity) -> None:
    assert EffectIdentity.parse(text) == identity
    assert identity.text == str(identity) == text
    assert re.fullmatch(r"\w+", identity.key)


def test_names_of_the_library_have_no_target() -> None:
    assert all(EffectIdentity.parse(name) == EffectIdentity(name) for name in library())
    assert EffectIdentity.parse("discharge_error[high]").key == "discharge_error_high"
    before, beyond = (EffectIdentity("station_shift", (section,)) for section in ("x-0.10", "x+0.10"))
    assert before.key != beyond.key, "as `import` names sections on both sides of a mouth"


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("unlisted_bed[x47.29,y-0.23]", (47.29, -0.23)),
        ("unlisted_bed[x1e-05,y.5]", (1e-5, 0.5)),
        ("unlisted_bed[x47.29]", None),
        ("unlisted_bed[y1,x2]", None),
        ("unlisted_bed[x1,y2,z3]", None),
        ("unlisted_bed[xnan,y1]", None),
        ("unlisted_bed", None),
    ],
)
def test_a_target_is_a_place_when_it_holds_two_coordinates(text: str, place: tuple[float, float] | None) -> None:
    assert EffectIdentity.parse(text).place == place


@pytest.mark.parametrize("text", ["steep_bank[", "steep_bank[high", "steep_bank[]"])
def test_a_text_that_is_no_identity_does_not_come_back(text: str) -> None:
    assert EffectIdentity.parse(text).text != text


def test_no_other_module_takes_a_name_apart() -> None:
    """Elsewhere no string is split at a bracket."""
    splits = {"partition", "rpartition", "split", "rsplit", "removesuffix", "rstrip", "find", "index"}
    found = [
        f"{module_of(path)}, line {node.lineno}"
        for path in FILES
        if module_of(path) != "vegglue.effects.identity"
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in splits
        if any(isinstance(one, ast.Constant) and one.value in ("[", "]") for one in node.args)
    ]
    assert found == []
