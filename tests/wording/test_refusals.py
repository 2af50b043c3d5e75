"""Each refusal is raised with all values that its words need."""

import ast
import re
from pathlib import Path

import vegglue

PACKAGE = Path(vegglue.__file__).parent
# What is read only beside another value: the file that names one.
BESIDE = {"unreadable": {"by"}}
MACRO = re.compile(r"{%-? macro (\w+)\(v\) -?%}(.*?){%-? endmacro -?%}", re.DOTALL)


def needed_by_words() -> dict[str, set[str]]:
    """Of each macro the values that it reads without asking whether they are there."""
    text = (PACKAGE / "wording" / "templates" / "refusals.j2").read_text(encoding="utf-8")
    found = {}
    for name, body in MACRO.findall(text):
        asked = set(re.findall(r"v\.(\w+) is (?:not )?defined", body))
        found[name] = set(re.findall(r"\bv\.(\w+)", body)) - asked - BESIDE.get(name, set())
    return found


def test_refusals_have_the_values_that_their_words_need() -> None:
    """Beside `no_number` a value was missing, and a user saw a traceback of the templates."""
    needed, short, seen = needed_by_words(), [], set()
    for file in sorted(PACKAGE.rglob("*.py")):
        for call in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if not isinstance(call, ast.Call) or not call.args or not isinstance(call.args[0], ast.Constant):
                continue
            kind, given = call.args[0].value, {one.arg for one in call.keywords}
            if getattr(call.func, "id", "") != "InputError" or kind not in needed or None in given:
                continue
            seen.add(kind)
            if missing := needed[kind] - given:
                short.append(f"{file.name}, line {call.lineno}: {kind} without {', '.join(sorted(missing))}")
    assert len(seen) > 20
    assert short == []
