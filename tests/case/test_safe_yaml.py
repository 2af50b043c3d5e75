"""YAML from anybody: read as a person means it, or refused in one sentence and at once."""

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
    ("text", "expected"),
    [
        (LAUGHS, "with its aliases written out it is larger than 50,000 parts"),
        (MERGED, "with its aliases written out it is larger than 50,000 parts"),
        (CHAIN, "40 keys within keys"),
        ("[" + "x," * 60_000, "there are more than 50,000 parts"),
        ("a: &a [*a]", "an alias stands within what it names"),
        ("a: &a {<<: *a}", "an alias stands within what it names"),
        ("[" * 5000, "more than 40 times"),
        ("{a: " * 5000, "more than 40 times"),
        ("- " * 5000, "more than 40 times"),
        ("a: !!python/object/apply:os.system [echo]", "the tag `tag:yaml.org,2002:python/object/apply:os.system`"),
        ("a: !!timestamp x", "is not known here: leave it out"),
        ("a: !!int x", "is not known here"),
        ("a: !!binary x", "is not known here"),
        ("a: !mine {b: 1}", "the tag `!mine`"),
        (f"a: {'9' * 400}", "a number has 400 digits"),
        (f"a: {'9' * 5000}", "a number has 5000 digits"),
        ("a: 010", "`010` may mean two numbers: write it without the 0 in front, or text in quotes"),
        ("a: -007", "`-007` may mean two numbers"),
        ('a: "\\ud800"', "a text holds the sign '\\ud800'"),
        ('a: "x\\0y"', "a text holds the sign '\\x00'"),
        ('"\\u202e": 1', "a text holds the sign '\\u202e'"),
        ("a: *b", "a reference to nothing"),
        ("? {a: 1}\n: 2", "unhashable key"),
    ],
    ids=lambda text: text[:24],
)
def test_what_is_meant_to_do_harm_is_refused_at_once(text: str, expected: str) -> None:
    assert expected in refused(text)


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
    assert "has no value: write decimals with a point, not a comma; correct the YAML there" in refused(text)
    assert safe_yaml("{a: 1, 2: '', 3: {}}") == {"a": 1, "2": "", "3": {}}


def test_a_config_is_a_file_of_some_size() -> None:
    assert "expected at most 1,000,000 bytes, got more" in refused("#" * (LARGEST_CONFIG + 1))
    for place in ("/dev/zero", "."):
        with pytest.raises(InputError, match="is not a file"):
            load_case(place)


def test_a_long_chain_of_extends_is_refused() -> None:
    for number in range(LONGEST_CHAIN + 1):
        Path(f"{number}.yaml").write_text(f"extends: {number + 1}.yaml\n", encoding="utf-8")
    with pytest.raises(InputError, match="more than 50 files in a row"):
        load_case("0.yaml")


@pytest.mark.parametrize("name", ["1", "007", "1.10", "on", "no", "null", "2024-06-03", "1:30"])
def test_a_key_is_called_as_it_is_written(name: str) -> None:
    """Runs 1, 2 and 3 were refused, as no text, and `on` was called True."""
    assert safe_yaml(f"{{{name}: {{a: 1}}}}") == {name: {"a": 1}}
