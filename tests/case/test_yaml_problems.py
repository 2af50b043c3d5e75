"""What YAML refuses is told in plain words, with the line and what to do."""

import re
from pathlib import Path

import pytest

from vegglue.case.config import read_tree
from vegglue.errors import InputError

# Words of a parser, which say nothing to who writes a config.
JARGON = re.compile(r"<|token|scalar|stream|block|flow|mapping|node|sequence|#x")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: {b: 1\n", "line 2, column 1: expected a comma or the `}` that closes the `{` of line 1, got the end of"),
        ("a: {b: 1\nc: 2\n", "line 2, column 2: expected a comma or the `}` that closes the `{` of line 1, got `:`"),
        ("a:\n  - [1, 2\n", "the `]` that closes the `[` of line 2, got the end of the file; add the `]`"),
        ("a: {b: [1, 2}\n", "the `]` that closes the `[` of line 1, got `}`"),
        ("a: {b: 1}}\n", "column 10: got a `}` that closes nothing; take it out"),
        ("a: 1\n\tb: 2\n", "line 2, column 1: expected spaces, got a tab; write spaces instead"),
        ("a:\tb\n", "line 1, column 3: expected spaces, got a tab"),
        ("a: b: c\n", "expected one `key: value` in a line, got a second colon"),
        ("a: 1\nb\nc: 2\n", "expected `key: value`, got a line without a colon"),
        ("a:\n  b: 1\n c: 2\n", "line 3, column 2: expected a key as far from the left as those above it, got one"),
        ('a: "x" y\n', "expected the end of the line, got a further text"),
        ("a: 'x\nb: 2\n", "expected the quote that ends the text begun in line 1, got the end of the file"),
        ('a: "C:\\data"\n', "expected no `\\d` within double quotes"),
        ("a: @x\n", "expected a text or a number, got the sign `@`; put the text in quotes"),
        ("a: *x\n", "got `*x`, a reference to nothing"),
        ("a: &\n", "got a sign that YAML takes for more"),
        ("a: - b\n", "got a `-`; begin a list in a line of its own"),
        ("{a: 1}\nb: 2\n", "expected the end of the file, got more"),
        ("a: 1\n---\nb: 2\n", "got a further one below `---`"),
        ("a: }\n", "expected a value, got `}`"),
        ("a: 1\nb: \x07\n", "line 2: expected text, got the sign '\\x07'"),
    ],
)
def test_a_problem_of_yaml_is_one_plain_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, said: str
) -> None:
    """It was what the parser says: expected ',' or '}', but got '<stream end>'."""
    monkeypatch.chdir(tmp_path)
    Path("site.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_tree(Path("site.yaml"))
    sentence = str(refused.value)
    assert sentence.startswith("site.yaml, line ")
    assert said in sentence
    assert not JARGON.search(sentence)
    assert sentence.endswith(".")
    assert "\n" not in sentence
