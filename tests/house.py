"""The package as it stands: its folders, what they import, how long things are.

`python tests/house.py` prints it, and brings the table of ARCHITECTURE.md up to date.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "vegglue"
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


def functions(path: Path) -> Iterator[tuple[str, int]]:
    """Name and length in lines of every function of a file."""
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.FunctionDef):
            assert node.end_lineno is not None
            yield node.name, node.end_lineno - node.lineno + 1


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


def main() -> None:
    write_page()
    print(page())
    lengths = [len(path.read_text(encoding="utf-8").splitlines()) for path in FILES]
    sizes = sorted((size, f"{module_of(path)}.{name}") for path in FILES for name, size in functions(path))
    print(f"\n{len(FILES)} files, median {median(lengths):g} lines, longest {max(lengths)}")
    print(f"{len(sizes)} functions, median {median(size for size, _ in sizes):g} lines, longest {sizes[-3:]}")
    for path, length in sorted(zip(FILES, lengths, strict=True), key=lambda pair: pair[1]):
        if length < 60 and path.name != "__init__.py":
            print(f"{length:4d} {path.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
