"""YAML as a person means it, of bounded size: no tags, no recursion, no aliases that grow without end.

Numbers are those of YAML 1.2: 1e-7 is one, 1:30 and 2024-05-01 are text; 010, which is 8 for some and 10 for others, is
refused, and so is the comma of {discharge: 2,66}, behind which YAML sees a key of its own. `yaml_problem` puts the
complaints of the parser in plain words.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import yaml
from yaml.constructor import ConstructorError
from yaml.reader import ReaderError

from vegglue.case.size_limits import DEEPEST_KEYS, MOST_DIGITS, MOST_PARTS
from vegglue.case.text_files import unprintable
from vegglue.wording.sentences import sentence

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
    """The keys and values of a YAML text.

    Raises
    ------
    yaml.YAMLError
        With the place and a sentence.
    """
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


def _whole_number(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> int:
    digits = node.value.lstrip("+-")
    if len(digits) > 1 and digits.startswith("0"):
        raise _refused(f"`{node.value}` may mean two numbers: write it without the 0 in front, or text in quotes", node)
    if len(digits) > MOST_DIGITS:
        raise _refused(f"a number has {len(digits)} digits, more than {MOST_DIGITS}: correct it", node)
    return int(node.value)


def _printable_text(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> str:
    if (sign := unprintable(node.value)) is not None:
        raise _refused(f"a text holds the sign {sign!a}, which is no letter", node)
    return str(node.value)


# The rules of PyYAML for plain words, without those replaced here.
_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in rules if tag.removeprefix("tag:yaml.org,2002:") not in ANOTHER_WAY]
    for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_CONSTRUCTORS: dict[str, Callable[..., Any]] = {
    "int": _whole_number,
    "float": lambda loader, node: float(node.value.lower().replace(".inf", "inf").replace(".nan", "nan")),
    "str": _printable_text,
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


CLOSING = {"while parsing a flow mapping": ("{", "}"), "while parsing a flow sequence": ("[", "]")}
# Problems as the parser words them, and their kinds; a group of a pattern is what was found.
YAML_PROBLEMS: tuple[tuple[str, str], ...] = (
    (r"found character '\\t'", "tab"),
    (r"found character '(.+)' that cannot start", "sign"),
    (r"mapping values are not allowed", "second-colon"),
    (r"could not find expected ':'", "no-colon"),
    (r"expected <block end>, but found '([}\]])'", "closes-nothing"),
    (r"expected <block end>, but found '<scalar>'", "further-text"),
    (r"expected <block end>, but found '(.+)'", "indentation"),
    (r"sequence entries are not allowed", "list-in-line"),
    (r"expected the node content, but found '(.+)'", "no-value"),
    (r"found unknown escape character '(.+)'", "escape"),
    (r"found undefined alias '(.+)'", "reference"),
    (r"expected '<document start>'", "closed-early"),
    (r"but found another document", "second-document"),
    (r"expected (alphabetic or numeric character|chomping or indentation)", "special-sign"),
)


@dataclass(frozen=True)
class YamlProblem:
    """Why a text is not YAML, in words by the macro of that name: `found` is the sign, token or text that the parser
    met; opening, closing, begun: brackets that are not closed, and the line in which a part begins.
    """

    kind: str
    found: str = ""
    opening: str = ""
    closing: str = ""
    begun: int = 1


def yaml_problem(error: yaml.YAMLError, text: str) -> str:
    """The place in the text and the rest of the sentence, as in `, line 3, column 1: expected ..., got ...; do ...`."""
    if isinstance(error, ReaderError):
        line = text[: error.position].count("\n") + 1
        return f", line {line}: {sentence(YamlProblem('no-letter', ascii(chr(error.character))))}"
    if not isinstance(error, yaml.MarkedYAMLError):
        return f": {sentence(YamlProblem('other', ' '.join(str(error).split())))}"
    mark, problem = error.problem_mark, error.problem or "is not valid YAML"
    where = f", line {mark.line + 1}, column {mark.column + 1}" if mark else ""
    context, begun = error.context or "", error.context_mark.line + 1 if error.context_mark else 1
    open_part = re.fullmatch(r"expected ',' or '[}\]]', but got '(.+)'", problem)
    if context in CLOSING and open_part:
        return f"{where}: {sentence(YamlProblem('open-bracket', open_part[1], *CLOSING[context], begun))}"
    if "quoted scalar" in context and "found unexpected" in problem:
        return f"{where}: {sentence(YamlProblem('open-quote', begun=begun))}"
    for pattern, kind in YAML_PROBLEMS:
        if found := re.search(pattern, problem):
            return f"{where}: {sentence(YamlProblem(kind, found[1] if found.groups() else ''))}"
    return f"{where}: {sentence(YamlProblem('other', problem))}"
