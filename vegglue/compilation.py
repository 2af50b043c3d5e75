"""How loops are compiled: cached, and without the lock that would keep threads from running side by side."""

import re
import sys
from collections.abc import Callable
from functools import cache
from hashlib import sha256
from multiprocessing import current_process
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.sigutils import normalize_signature

# Files that loops take constants and flags from, beside those that hold loops themselves.
SHARED = ("compilation.py", "physical_constants.py")
# Products and sums may fuse.
FUSED = {"contract", "nsz"}
# Without the lock, and not wrapped for calls from C, which nothing makes: a fifteenth of the time to compile.
UNLOCKED: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def compiled(loop: Callable[..., Any]) -> Any:
    """A loop whose products and sums may fuse."""
    return _cached(loop, fastmath=FUSED)


def compiled_inside(loop: Callable[..., Any]) -> Any:
    """As `compiled`, of a loop that only other loops call: neither kept by itself nor wrapped for calls from Python.

    An eighth of the time to compile all, and half of what is kept.
    """
    flags: dict[str, Any] = {"fastmath": FUSED, "no_cpython_wrapper": True}
    return njit(**UNLOCKED, **flags)(loop)


def compiled_on_views(loop: Callable[..., Any]) -> Any:
    """As `compiled_inside`, of a loop on arrays of its caller, whose views of them are not counted.

    Counting takes two thirds of a residual of one member in columns of 22 rows, and nearly half of one of 16 members.
    Such a loop makes no array, and returns none to a loop that counts, which would free it too early.
    """
    flags: dict[str, Any] = {"fastmath": FUSED, "no_cpython_wrapper": True, "_nrt": False}
    return njit(**UNLOCKED, **flags)(loop)


def compiled_within(loop: Callable[..., Any]) -> Any:
    """As `compiled`, of a loop that others call: it is inlined in each.

    Otherwise it is called in the process that compiles, and inlined in those that read the cache. Products then fuse
    differently, and last digits differ.
    """
    return _cached(loop, fastmath=FUSED, forceinline=True)


def compiled_exactly(loop: Callable[..., Any]) -> Any:
    """A loop whose order of operations is part of the result: an elimination."""
    return _cached(loop)


def _cached(loop: Callable[..., Any], **flags: Any) -> Any:
    """The loop, its machine code kept between runs where there is a folder for it."""
    try:
        kept = njit(cache=True, **UNLOCKED, **flags)(loop)
    except RuntimeError:  # numba found no folder that it can write to: a read-only install without a home
        _say_uncached()
        return njit(**UNLOCKED, **flags)(loop)
    # The cache is stale as soon as any file that the loop is made of changes: numba looks at the file of the loop only.
    index: Any = getattr(getattr(kept, "_cache", None), "_cache_file", None)
    if hasattr(index, "_source_stamp"):  # documented nowhere: a numba without it caches as it always does
        index._source_stamp = (index._source_stamp, _stamp(Path(loop.__code__.co_filename)))

        def save(key: tuple[Any, ...], code: Any) -> None:
            # In a file named after its types: two processes that number files may give two of them one name, and the
            # index of one then leads to the code of the other.
            types = sha256(repr(key).encode()).hexdigest()[:16]
            index._data_name_pattern = f"{index._index_name}.{types}.{{number:d}}.nbc"
            type(index).save(index, key, code)

        index.save = save
    return kept


@cache
def _say_uncached() -> None:
    """Once, and not by each worker."""
    if current_process().name == "MainProcess":
        from vegglue.wording.sentences import phrase  # whose files are not stamped with those of loops

        print(phrase("compiled_anew"), file=sys.stderr)


def is_kept(loop: Any) -> bool:
    """Whether an earlier process has left machine code of the loop; True where that cannot be known."""
    index: Any = getattr(getattr(loop, "_cache", None), "_cache_file", None)
    # Documented nowhere, as above: an index is empty where there is no file, or it is of other code or another numba.
    return not hasattr(index, "_load_index") or bool(index._load_index())


def compile_for(loop: Any, *types: str) -> None:
    """Compile a loop for arguments of these types, or take from the cache what an earlier process has left."""
    loop.compile(normalize_signature(f"({', '.join(types)})")[0])  # kept code of types as text is not found by values


@cache
def _stamp(file: Path) -> str:
    """Hash of a file and of those it imports that hold loops, or constants and flags of loops."""
    if not file.is_file():  # in an archive, which does not change
        return ""
    text = file.read_text(encoding="utf-8")
    names = re.findall(r"^from vegglue\.([\w.]+) import", text, re.MULTILINE)
    files = [Path(__file__).parent / f"{name.replace('.', '/')}.py" for name in names]
    return sha256("".join([text, *map(_stamp, filter(shapes_loops, files))]).encode()).hexdigest()


def shapes_loops(file: Path) -> bool:
    """Whether a file holds compiled loops, or constants and flags of loops."""
    return file.name in SHARED or (file.is_file() and "compilation import compiled" in file.read_text(encoding="utf-8"))
