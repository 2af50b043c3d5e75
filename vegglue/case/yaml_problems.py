"""Why YAML cannot be read, in plain words instead of a parser's: where, what was expected, what came, what to do."""

import re
from collections.abc import Callable

import yaml
from yaml.reader import ReaderError

QUOTES = "put the text in quotes"
SPACES = "correct the spaces in front of the line"
THERE = "correct the YAML there or just before"
CLOSING = {"while parsing a flow mapping": ("{", "}"), "while parsing a flow sequence": ("[", "]")}
# What a parser calls the things it meets.
TOKENS = {
    "<stream end>": "the end of the file",
    "<scalar>": "a further text",
    "<block mapping start>": "one further to the right",
    "<block sequence start>": "a list",
    "<block end>": "a line further to the left",
    "?": "one in another place",
    "-": "a line that begins with `-`",
}
# Problems of the parser, and of each the sentence; what a pattern finds is put where braces stand.
PROBLEMS: tuple[tuple[str, str], ...] = (
    (r"found character '\\t'", "expected spaces, got a tab; write spaces instead"),
    (r"found character '(.+)' that cannot start", f"expected a text or a number, got the sign `{{}}`; {QUOTES}"),
    (
        r"mapping values are not allowed",
        f"expected one `key: value` in a line, got a second colon; {SPACES}, write a space behind every colon, or put "
        "a text that has a colon in quotes",
    ),
    (
        r"could not find expected ':'",
        f"expected `key: value`, got a line without a colon; add it and a space behind it, or {SPACES}",
    ),
    (r"expected <block end>, but found '([}\]])'", "got a `{}` that closes nothing; take it out"),
    (
        r"expected <block end>, but found '<scalar>'",
        "expected the end of the line, got a further text; put all of it in quotes",
    ),
    (
        r"expected <block end>, but found '(.+)'",
        f"expected a key as far from the left as those above it, got {{}}; {SPACES}",
    ),
    (r"sequence entries are not allowed", "expected a value, got a `-`; begin a list in a line of its own"),
    (r"expected the node content, but found '(.+)'", "expected a value, got {}; add the value, or take out the sign"),
    (r"found unknown escape character '(.+)'", "expected no `\\{}` within double quotes; write single ones"),
    (r"found undefined alias '(.+)'", f"expected a text, got `*{{}}`, a reference to nothing; {QUOTES}"),
    (r"expected '<document start>'", "expected the end of the file, got more; take out a brace that closes too early"),
    (r"but found another document", "expected one set of keys, got a further one below `---`; take one out"),
    (r"expected alphabetic or numeric character", f"expected a text, got a sign that YAML takes for more; {QUOTES}"),
    (r"expected chomping or indentation", f"expected a text, got a sign that YAML takes for more; {QUOTES}"),
)


def yaml_problem(error: yaml.YAMLError, text: str) -> str:
    """The place in the text and the rest of the sentence, as in `, line 3, column 1: expected ..., got ...; do ...`."""
    if isinstance(error, ReaderError):
        line = text[: error.position].count("\n") + 1
        return f", line {line}: expected text, got the sign {chr(error.character)!a}, which is no letter; take it out"
    if not isinstance(error, yaml.MarkedYAMLError):
        return f": {' '.join(str(error).split())}; {THERE}"
    mark = error.problem_mark
    where = f", line {mark.line + 1}, column {mark.column + 1}" if mark else ""
    return f"{where}: {_left_open(error) or _in_plain_words(error.problem or 'is not valid YAML')}"


def _left_open(error: yaml.MarkedYAMLError) -> str | None:
    """The sentence about a brace or a quote that is not closed; None for another problem."""
    context, begun = error.context or "", error.context_mark
    line = begun.line + 1 if begun else 1
    found = re.fullmatch(r"expected ',' or '[}\]]', but got '(.+)'", error.problem or "")
    if context in CLOSING and found:
        opening, closing = CLOSING[context]
        return (
            f"expected a comma or the `{closing}` that closes the `{opening}` of line {line}, got {_token(found[1])}; "
            f"add the `{closing}`, or a comma where one part ends"
        )
    if "quoted scalar" in context and "found unexpected" in (error.problem or ""):
        return f"expected the quote that ends the text begun in line {line}, got the end of the file; add it"
    return None


def _in_plain_words(problem: str) -> str:
    for pattern, sentence in PROBLEMS:
        if found := re.search(pattern, problem):
            shown: Callable[[str], str] = _token if "got {}" in sentence else str
            return sentence.format(*(shown(group) for group in found.groups() or ("",)))
    return f"{problem}; {THERE}"


def _token(name: str) -> str:
    return TOKENS.get(name, f"`{name}`")
