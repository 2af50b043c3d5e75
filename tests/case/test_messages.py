"""Words of refusals."""

from vegglue.case.messages import nearest, nearest_effect
from vegglue.effects.library import library


def test_few_of_many_known_words_are_listed():
    said = nearest("x", [f"word{number}" for number in range(100)])
    assert said.startswith("known here are word0, word1,")
    assert said.endswith("word29 and 70 more")


def test_an_unknown_effect_is_not_answered_with_hundreds_of_names() -> None:
    known = [*library()]
    assert nearest_effect("streamlinin", known) == "did you mean `streamlining`?"
    assert nearest_effect("gravel_bar", known) == "`vegglue effects` lists them."
