"""YAML as a person means it, of bounded size: no tags, no recursion, no aliases that grow without end.

Numbers are those of YAML 1.2: 1e-7 is one, 1:30 and 2024-05-01 are text; 010, which is 8 for some and 10 for others, is
refused, and so is the comma of {discharge: 2,66}, behind which YAML sees a key of its own. `yaml_problem` puts the
complaints of the parser in plain words.
"""

import re
from collections.abc import Callable
from typing import Any

import yaml
from yaml.constructor import ConstructorError
from yaml.reader import ReaderError

from vegglue.case.size_limits import DEEPEST_KEYS, MOST_DIGITS, MOST_PARTS
from vegglue.case.text_files import unprintable

WHOLE = re.compile(r"[-+]?[0-9]+")
BROKEN = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
TEXT = "tag:yaml.org,2002:str"
# What a key is written as is its name: an experiment is called 1, 007 or on, and JSON has no other keys either.
TEXT_AS_KEY = tuple(f"tag:yaml.org,2002:{kind}" for kind in ("int", "float", "bool", "null"))
# Kinds of plain words that YAML 1.1 reads as something else than a person means, or with rules of its own.
ANOTHER_WAY = ("int", "float", "timestamp", "value")


def yaml_of(tree: Any) -> str:
    """The YAML text of keys and values, which `safe_yaml` reads as the same; in quotes what looks like a number."""
    return yaml.dump(tree, Dumper=_Dumper, sort_keys=False, allow_unicode=True)


def safe_yaml(text: str) -> Any:
    """The keys and values of a YAML text. Errors: yaml.YAMLError, with the place and a sentence."""
    return yaml.load(text, Loader=_Loader)


class _Loader(yaml.SafeLoader):
    """What is refused is refused while the text is read, before anything is made of it."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._level = self._begun = 0
        self._finished: dict[int, tuple[int, int]] = {}  # of each node that is whole: its height, and its parts

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event = self.peek_event()
        if isinstance(event, yaml.AliasEvent):
            node = super().compose_node(parent, index)
            if id(node) not in self._finished:
                raise _refused("an alias stands within what it names: write its parts out", event)
            return node
        if getattr(event, "tag", None) not in (None, "!"):
            raise _refused(f"the tag `{event.tag}` is not known here: leave it out", event)
        self._level, self._begun = self._level + 1, self._begun + 1
        if self._begun > MOST_PARTS:
            raise _refused(f"there are more than {MOST_PARTS:,} parts: make it smaller", event)
        if self._level > DEEPEST_KEYS:
            raise _refused(f"keys stand within keys more than {DEEPEST_KEYS} times: write them flatter", event)
        node = super().compose_node(parent, index)
        self._level -= 1
        below = node.value if isinstance(node, yaml.CollectionNode) else []  # what follows counts aliases written out
        inner = [one for item in below for one in (item if isinstance(item, tuple) else (item,))]
        sizes = [self._finished[id(one)] for one in inner]
        height, parts = 1 + max((high for high, _ in sizes), default=0), 1 + sum(many for _, many in sizes)
        if height > DEEPEST_KEYS or parts > MOST_PARTS:
            limits = f"{MOST_PARTS:,} parts and {DEEPEST_KEYS} keys within keys"
            raise _refused(f"with its aliases written out it is larger than {limits}: make it smaller", event)
        self._finished[id(node)] = height, parts
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        keys: set[Any] = set()
        for key_node, value_node in node.value:
            if isinstance(key_node, yaml.ScalarNode) and key_node.value in keys:
                raise _refused(f"the key `{key_node.value}` stands twice", key_node)
            # A key without a value that begins with a digit follows a decimal comma, as 66 in {discharge: 2,66}.
            nothing = isinstance(value_node, yaml.ScalarNode) and value_node.style is None and not value_node.value
            digits = isinstance(key_node, yaml.ScalarNode) and key_node.value[:1].isdigit()
            if node.flow_style and nothing and digits:
                raise _refused(f"`{key_node.value}` has no value: write decimals with a point, not a comma", key_node)
            keys.add(key_node.value if isinstance(key_node, yaml.ScalarNode) else id(key_node))
            if isinstance(key_node, yaml.ScalarNode) and key_node.tag in TEXT_AS_KEY:
                key_node.tag = TEXT
        return super().construct_mapping(node, deep)


def _refused(problem: str, at: Any) -> ConstructorError:
    return ConstructorError(None, None, problem, at.start_mark)


def _whole(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> int:
    digits = node.value.lstrip("+-")
    if len(digits) > 1 and digits.startswith("0"):
        complaint = f"`{node.value}` may mean two numbers: write it without the 0 in front, or text in quotes"
        raise _refused(complaint, node)
    if len(digits) > MOST_DIGITS:
        complaint = f"a number has {len(digits)} digits, more than {MOST_DIGITS}: correct it"
        raise _refused(complaint, node)
    return int(node.value)


def _words(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> str:
    if (sign := unprintable(node.value)) is not None:
        raise _refused(f"a text holds the sign {sign!a}, which is no letter", node)
    return str(node.value)


# The rules of PyYAML for plain words, without those replaced here.
_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in rules if tag.removeprefix("tag:yaml.org,2002:") not in ANOTHER_WAY]
    for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_CONSTRUCTORS: dict[str, Callable[..., Any]] = {
    "int": _whole,
    "float": lambda loader, node: float(node.value.lower().replace(".inf", "inf").replace(".nan", "nan")),
    "str": _words,
}
for _kind, _construct in _CONSTRUCTORS.items():
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", _construct)
for _kind, _pattern in (("int", WHOLE), ("float", BROKEN)):
    _Loader.add_implicit_resolver(
        f"tag:yaml.org,2002:{_kind}", re.compile(rf"(?:{_pattern.pattern})$"), list("-+.0123456789")
    )


class _Dumper(yaml.SafeDumper):
    """Quotes what either version of YAML would not read as text."""


_Dumper.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(rf"(?:{BROKEN.pattern})$"), list("-+.0123456789"))


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
    mark, problem = error.problem_mark, error.problem or "is not valid YAML"
    where = f", line {mark.line + 1}, column {mark.column + 1}" if mark else ""
    context, line = error.context or "", error.context_mark.line + 1 if error.context_mark else 1
    found = re.fullmatch(r"expected ',' or '[}\]]', but got '(.+)'", problem)
    if context in CLOSING and found:
        opening, closing = CLOSING[context]
        return (
            f"{where}: expected a comma or the `{closing}` that closes the `{opening}` of line {line}, got "
            f"{_token(found[1])}; add the `{closing}`, or a comma where one part ends"
        )
    if "quoted scalar" in context and "found unexpected" in problem:
        return f"{where}: expected the quote that ends the text begun in line {line}, got the end of the file; add it"
    for pattern, sentence in PROBLEMS:
        if found := re.search(pattern, problem):
            shown: Callable[[str], str] = _token if "got {}" in sentence else str
            return f"{where}: {sentence.format(*(shown(group) for group in found.groups() or ('',)))}"
    return f"{where}: {problem}; {THERE}"


def _token(name: str) -> str:
    return TOKENS.get(name, f"`{name}`")
