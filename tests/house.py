"""The package as it stands: its folders, what they import, and counts for a reader, none of which is a test.

`make house` prints them, and brings the table of ARCHITECTURE.md up to date.
"""

import ast
import inspect
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "vegglue"
# Calls and keywords whose texts are entries of a registry: effects, laws, schemas, options, constants.
REGISTERED = {
    "Effect", "_at_place", "_unlisted", "Amplitude", "Shape", "LawTerm", "LawQuantity", "LawForm", "Kind", "_constant",
    "Field", "Option", "Argument",
    "description", "help", "source", "meaning", "title", "provenance",
}  # fmt: skip
FILES = sorted(PACKAGE.rglob("*.py"))
DOCSTRING = re.compile(r"(?P<purpose>.*?)\n\nMay import: (?P<may>.*?)\.\nOpen first: (?P<first>.*?)\.\s*$", re.DOTALL)


@dataclass(frozen=True)
class Folder:
    """What the docstring of a folder says: what it is for, the folders it may import, the files to open first."""

    name: str
    purpose: str
    may_import: tuple[str, ...]
    first: tuple[str, ...]


@cache
def folders() -> dict[str, Folder]:
    """All folders of the package, lower ones before those that import them."""
    found = {path.parent.name: _folder(path) for path in PACKAGE.glob("*/__init__.py")}
    ordered: dict[str, Folder] = {}
    while len(ordered) < len(found):
        free = [one for one in found.values() if one.name not in ordered and set(one.may_import) <= set(ordered)]
        assert free, f"a circle among {sorted(found.keys() - ordered.keys())}"
        lowest = min(free, key=lambda one: (len(one.may_import), one.name))
        ordered[lowest.name] = lowest
    return ordered


def _folder(path: Path) -> Folder:
    text = ast.get_docstring(tree_of(path)) or ""
    said = DOCSTRING.match(text)
    assert said, f"{path}: expected a purpose, `May import: ....` and `Open first: ....`"
    may = () if said["may"].startswith("no ") else tuple(said["may"].replace("\n", " ").split(", "))
    purpose = " ".join(said["purpose"].split("\n\n")[0].split())  # how to add something may follow
    return Folder(path.parent.name, purpose, may, tuple(said["first"].split(", ")))


@cache
def module_of(path: Path) -> str:
    """vegglue.flow.kernels, of the path of its file."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def tree_of(path: Path) -> ast.Module:
    """A file of the package as Python reads it."""
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imported(path: Path) -> frozenset[str]:
    """Modules and names a file imports anywhere in it, in full."""
    names: set[str] = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return frozenset(names)


@cache
def imported_files(path: Path) -> frozenset[str]:
    """Modules of the package that a file imports."""
    return (imported(path) & {module_of(other) for other in FILES}) - {"vegglue"}


@cache
def imports_of(folder: str) -> frozenset[str]:
    """Other folders that the files of a folder import."""
    names = {name.split(".")[1] for path in (PACKAGE / folder).rglob("*.py") for name in imported_files(path)}
    return frozenset(name for name in names if (PACKAGE / name).is_dir()) - {folder}


def public_names(path: Path) -> set[str]:
    """Public functions, classes and constants that a file defines."""
    found: set[str] = set()
    for node in tree_of(path).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found |= {name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)}
    return {name for name in found if not name.startswith("_")}


def page() -> str:
    """The table of folders for ARCHITECTURE.md, from the docstrings."""
    rows = [f"| `{one.name}/` | {one.purpose} | {', '.join(one.first)} |" for one in folders().values()]
    return "\n".join(["| folder | what it is for | open first |", "|---|---|---|", *rows])


def write_page() -> None:
    """Put the table in its place in ARCHITECTURE.md."""
    path = ROOT / "ARCHITECTURE.md"
    text = path.read_text(encoding="utf-8")
    path.write_text(re.sub(r"\| folder \|.*?\n(?!\|)", page() + "\n", text, flags=re.DOTALL), encoding="utf-8")


def single_caller_helpers() -> list[str]:
    """Private functions and methods whose name occurs once in their file beside its definition."""
    found = []
    for path in FILES:
        used = Counter(
            node.id if isinstance(node, ast.Name) else node.attr
            for node in ast.walk(tree_of(path))
            if isinstance(node, ast.Name | ast.Attribute)
        )
        own = [node.name for node in ast.walk(tree_of(path)) if isinstance(node, ast.FunctionDef)]
        private = [name for name in own if name.startswith("_") and not name.startswith("__")]
        found += [f"{module_of(path)}.{name}" for name in private if used[name] == 1]
    return found


def printed_words(path: Path) -> int:
    """Words of texts of four words or more, without docstrings, errors that are raised, and entries of a registry."""
    left_out: set[int] = set()
    for node in ast.walk(tree_of(path)):
        called = node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""
        registered = called in REGISTERED or (isinstance(node, ast.keyword) and node.arg in REGISTERED)
        if isinstance(node, ast.Raise) or registered:
            left_out |= {id(one) for one in ast.walk(node)}
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            left_out.add(id(node.value))
    texts = [
        node.value
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in left_out
    ]
    counts = [len(re.findall(r"[A-Za-z][A-Za-z'-]+", text)) for text in texts]
    return sum(count for count in counts if count >= 4)


def structured_share() -> float:
    """Share of public functions and classes with a numpydoc section in the docstring [-], as `help` shows it."""
    public = [
        getattr(import_module(module_of(path)), node.name).__doc__ or ""
        for path in FILES
        for node in tree_of(path).body
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_")
    ]
    return sum("\n---" in inspect.cleandoc(text) for text in public) / len(public)


def lines_of(paths: Iterable[Path]) -> int:
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in paths)


def main() -> None:
    write_page()
    lines, helpers = lines_of(FILES), single_caller_helpers()
    words = sum(printed_words(path) for path in FILES if path.parent.name != "wording")
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]
    print(f"package  {len(folders())} folders, {len(FILES)} files, {lines:,} lines")
    print(f"tests    {lines_of((ROOT / 'tests').rglob('*.py')):,} lines")
    print(f"docs     {sum(len(path.read_text(encoding='utf-8').split()) for path in pages):,} words")
    print(f"private helpers with one caller    {len(helpers)}, {1000 * len(helpers) / lines:.1f} per 1,000 lines")
    print(f"words printed outside wording/     {words:,}, {1000 * words / lines:.0f} per 1,000 lines")
    print(f"public definitions with numpydoc   {structured_share():.0%}")
    by_folder = Counter(name.split(".")[1] for name in helpers)
    for folder in folders():
        files = list((PACKAGE / folder).rglob("*.py"))
        said = sum(map(printed_words, files))
        counts = f"{len(files):4d} files{lines_of(files):7,} lines{by_folder[folder]:5d} helpers{said:6,} words"
        print(f"  {folder:13s}{counts}")


if __name__ == "__main__":
    main()
