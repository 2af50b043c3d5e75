"""YAML from anybody: read as a person means it, or refused in one sentence and at once."""

import re
import time
from pathlib import Path

import pytest

from vegglue.case.config import load_case
from vegglue.case.safe_yaml import safe_yaml
from vegglue.case.size_limits import LARGEST_CONFIG, LONGEST_CHAIN
from vegglue.errors import InputError

LAUGHS = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12)
)
MERGED = "a0: &a0 {x: 1}\n" + "".join(f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}]}}\n" for i in range(1, 12))
CHAIN = "a0: &a0 [x]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 3000))


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def refused(text: str) -> str:
    Path("a.yaml").write_text(text, encoding="utf-8")
    began = time.process_time()
    with pytest.raises(InputError) as caught:
        load_case("a.yaml")
    assert time.process_time() - began < 10.0  # a hang, not a measure of speed
    return str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "word"),
    [
        (LAUGHS, "50,000"), (MERGED, "50,000"), (CHAIN, "40"), ("[" + "x," * 60_000, "50,000"),
        ("a: &a [*a]", "alias"), ("a: &a {<<: *a}", "alias"), ("[" * 5000, "40"), ("{a: " * 5000, "40"),
        ("- " * 5000, "40"), ("a: !!python/object/apply:os.system [echo]", "os.system`"), ("a: !!timestamp x", "tag"),
        ("a: !!int x", "tag"), ("a: !!binary x", "tag"), ("a: !mine {b: 1}", "`!mine`"), (f"a: {'9' * 400}", "400"),
        (f"a: {'9' * 5000}", "5000"), ("a: 010", "`010`"), ("a: -007", "`-007`"), ('a: "\\ud800"', "'\\ud800'"),
        ('a: "x\\0y"', "'\\x00'"), ('"\\u202e": 1', "'\\u202e'"), ("a: *b", "`*b`"), ("? {a: 1}\n: 2", "key"),
    ],
    ids=lambda text: text[:24],
)  # fmt: skip
def test_what_is_meant_to_do_harm_is_refused_at_once(text: str, word: str) -> None:
    assert word in refused(text)


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("1:30", "1:30"), ("2024-05-01", "2024-05-01"), ("2024-13-45", "2024-13-45"), ("1_000", "1_000"),
        ("0x1F", "0x1F"), ("0b1", "0b1"), ("=", "="), ("0", 0), ("-3", -3), ("1e-7", 1e-7), ("2E3", 2e3),
        (".5", 0.5), ("1.", 1.0), ("+1.5e2", 150.0), (".inf", float("inf")), ("1e400", float("inf")),
        ("'010'", "010"), ("true", True), ("null", None), ("1 m", "1 m"),
    ],
)  # fmt: skip
def test_a_word_is_what_a_person_means(text: str, meant: object) -> None:
    found = safe_yaml(f"a: {text}")["a"]
    assert (found, type(found)) == (meant, type(meant))


def test_aliases_and_merged_keys_of_common_size_are_read() -> None:
    assert safe_yaml("a: &a {x: 1, y: 2}\nb: {<<: *a, y: 3}\nc: [*a, *a]") == {
        "a": {"x": 1, "y": 2}, "b": {"x": 1, "y": 3}, "c": [{"x": 1, "y": 2}] * 2,
    }  # fmt: skip


@pytest.mark.parametrize("text", ["{discharge: 2,66, level: 3}", "{a: 0,95 m}", "a: {b: {c: 7,3}}"])
def test_a_decimal_comma_within_braces_cuts_no_number_short(text: str) -> None:
    assert "comma" in refused(text)
    assert safe_yaml("{a: 1, 2: '', 3: {}}") == {"a": 1, "2": "", "3": {}}


def test_a_config_is_a_file_of_some_size() -> None:
    assert f"{LARGEST_CONFIG:,}" in refused("#" * (LARGEST_CONFIG + 1))
    for place in ("/dev/zero", "."):
        with pytest.raises(InputError, match="file"):
            load_case(place)


def test_a_long_chain_of_extends_is_refused() -> None:
    for number in range(LONGEST_CHAIN + 1):
        Path(f"{number}.yaml").write_text(f"extends: {number + 1}.yaml\n", encoding="utf-8")
    with pytest.raises(InputError, match="50"):
        load_case("0.yaml")


@pytest.mark.parametrize("name", ["1", "007", "1.10", "on", "no", "null", "2024-06-03", "1:30"])
def test_a_key_is_called_as_it_is_written(name: str) -> None:
    """Runs 1, 2 and 3 were refused, as no text, and `on` was called True."""
    assert safe_yaml(f"{{{name}: {{a: 1}}}}") == {name: {"a": 1}}


# Words of a parser, which the author of a config does not know.
JARGON = re.compile(r"<|token|scalar|stream|block|flow|mapping|node|sequence|#x")


@pytest.mark.parametrize(
    ("text", "place", "word"),
    [
        ("a: {b: 1\n", "line 2, column 1", "`}`"), ("a: {b: 1\nc: 2\n", "line 2, column 2", "`}`"),
        ("a:\n  - [1, 2\n", "line 3", "`]`"), ("a: {b: [1, 2}\n", "line 1", "`]`"),
        ("a: {b: 1}}\n", "line 1, column 10", "`}`"), ("a: 1\n\tb: 2\n", "line 2, column 1", "tab"),
        ("a:\tb\n", "line 1, column 3", "tab"), ("a: b: c\n", "line 1", "colon"),
        ("a: 1\nb\nc: 2\n", "line 3", "colon"),
        ("a:\n  b: 1\n c: 2\n", "line 3, column 2", "spaces"), ('a: "x" y\n', "line 1", "quotes"),
        ("a: 'x\nb: 2\n", "line 3", "quote"), ('a: "C:\\data"\n', "line 1", "`\\d`"), ("a: @x\n", "line 1", "`@`"),
        ("a: *x\n", "line 1", "`*x`"), ("a: &\n", "line 1", "quotes"), ("a: - b\n", "line 1", "`-`"),
        ("{a: 1}\nb: 2\n", "line 2", "more"), ("a: 1\n---\nb: 2\n", "line 2", "`---`"), ("a: }\n", "line 1", "`}`"),
        ("a: 1\nb: \x07\n", "line 2", "'\\x07'"),
    ],
)  # fmt: skip
def test_a_problem_of_yaml_is_one_plain_sentence_with_its_place(text: str, place: str, word: str) -> None:
    """It was what the parser says: expected ',' or '}', but got '<stream end>'."""
    said = refused(text)
    assert said.startswith(f"a.yaml, {place}")
    assert word in said
    assert not JARGON.search(said)
    assert said.endswith(".")
    assert "\n" not in said
