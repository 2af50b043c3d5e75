"""Words of refusals."""

from vegglue.case.messages import nearest


def test_few_of_many_known_words_are_listed():
    said = nearest("x", [f"word{number}" for number in range(100)])
    assert said.startswith("known here are word0, word1,")
    assert said.endswith("word29 and 70 more")
