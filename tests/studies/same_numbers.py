"""Whether two builds give the same numbers: `record` runs one, `compare` sets two records side by side.

    python tests/studies/same_numbers.py record VEGGLUE FOLDER [--cases DIRECTORY] [--only NAME ...]
    python tests/studies/same_numbers.py compare BEFORE AFTER

VEGGLUE is the command of a build. Each open case is imported, diagnosed, extended and compared; each config of the
project is simulated with 256 members and inferred. Every number of the JSON objects and of the HDF5 files is compared,
and every text without a blank: kinds, names and sets are such texts, sentences are not.
"""

import argparse
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np

ROOT = Path(__file__).parents[2]
CONFIGS = ("d0", "d3a", "d3a_refined", "d3b", "d3b_paper")
MEMBERS = "256"
# What tells of the build, the machine or the hour, and not of the case.
OF_THE_BUILD = ("version", "hash", "digest", "seconds", "created", "config", "path", "picture", "file", "source")
# Results are computed in the same order in both builds; printing and reading back costs the last digits.
RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE = 1e-9, 1e-12


def record(vegglue: str, folder: Path, cases: Path, only: list[str]) -> None:
    """Run all cases with one build and keep what it prints as JSON and writes as HDF5."""
    folder.mkdir(parents=True, exist_ok=True)
    for case in sorted(cases.glob("open-*")):
        if only and case.name not in only:
            continue
        site = folder / "sites" / case.name
        shutil.rmtree(site, ignore_errors=True)
        site.mkdir(parents=True)
        for path in case.iterdir():
            if path.name != "answer.json":
                shutil.copy(path, site / path.name)
        config = f"{case.name}.yaml"
        _run([vegglue, "import", str(site), "--to", config], folder)
        _keep(folder / f"{case.name}.diagnose.json", _run([vegglue, "diagnose", config, "--json"], folder))
        extended = _run([vegglue, "extend", config, "--auto"], folder)
        last = [line.split("Last config: ")[1].strip() for line in extended.splitlines() if "Last config: " in line]
        children = [one for one in last if one != config]
        _keep(folder / f"{case.name}.compare.json", _run([vegglue, "compare", config, *children, "--json"], folder))
        _keep(folder / f"{case.name}.infer.json", _run([vegglue, "infer", *(children or [config]), "--json"], folder))
        print(case.name, flush=True)
    for name in CONFIGS:
        if only and name not in only:
            continue
        config = str(ROOT / "configs" / f"{name}.yaml")
        _run([vegglue, "simulate", config, "--members", MEMBERS], folder)
        _keep(folder / f"{name}.infer.json", _run([vegglue, "infer", config, "--members", MEMBERS, "--json"], folder))
        print(name, flush=True)


def _run(command: list[str], folder: Path) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    if done.returncode:
        print(f"exit code {done.returncode}: {' '.join(command)}\n{done.stderr[-2000:]}", file=sys.stderr)
    return done.stdout


def _keep(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def values_of(folder: Path) -> dict[str, Any]:
    """Every number and name of a record, by its place."""
    found: dict[str, Any] = {}
    for path in sorted(folder.glob("*.json")):
        text = path.read_text(encoding="utf-8")
        if text.strip():
            _flatten(path.stem, json.loads(text), found)
    for path in sorted((folder / "runs").glob("*/*.h5")):
        with h5py.File(path) as file:
            begin = f"{path.parent.name}/{path.stem}"
            file.visititems(lambda name, item, begin=begin: _dataset(f"{begin}/{name}", item, found))
    return found


def _dataset(name: str, item: Any, found: dict[str, Any]) -> None:
    if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiub":
        found[name] = np.asarray(item[()], dtype=float)


def _flatten(name: str, value: Any, found: dict[str, Any]) -> None:
    if isinstance(value, dict):
        for key, one in value.items():
            _flatten(f"{name}.{key}", one, found)
    elif isinstance(value, list):
        for position, one in enumerate(value):
            _flatten(f"{name}[{position}]", one, found)
    elif isinstance(value, bool | int | float):
        found[name] = np.asarray(float(value))
    elif isinstance(value, str) and " " not in value:
        found[name] = value


def compare(before: Path, after: Path) -> int:
    """Print what differs and what is gone; 1 if anything is, else 0."""
    old, new = values_of(before), values_of(after)
    kept = {name: value for name, value in old.items() if not any(word in name for word in OF_THE_BUILD)}
    gone = [name for name in kept if name not in new]
    moved = [name for name in kept if name in new and not _same(kept[name], new[name])]
    for name in gone:
        print(f"gone     {name}")
    for name in moved:
        print(f"differs  {name}: {_in_short(kept[name], new[name])}")
    numbers = sum(value.size if isinstance(value, np.ndarray) else 1 for value in kept.values())
    print(f"{len(kept):,} values with {numbers:,} numbers: {len(gone)} gone, {len(moved)} differ, {len(new)} after")
    return 1 if gone or moved else 0


def _same(old: Any, new: Any) -> bool:
    if isinstance(old, str) or isinstance(new, str):
        return bool(np.all(old == new))
    close = {"rtol": RELATIVE_TOLERANCE, "atol": ABSOLUTE_TOLERANCE, "equal_nan": True}
    return old.shape == new.shape and np.allclose(old, new, **close)


def _in_short(old: Any, new: Any) -> str:
    if isinstance(old, str) or isinstance(new, str) or old.shape != new.shape:
        return f"{old!r:.60} -> {new!r:.60}"
    with np.errstate(invalid="ignore"):
        apart = np.nanmax(np.abs(old - new)) if old.size else 0.0
    return f"{old!s} -> {new!s}" if old.ndim == 0 else f"{old.shape}, up to {apart:.3g} apart"


def main() -> int:
    """Parse the command line and do what it asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    one = verbs.add_parser("record")
    one.add_argument("vegglue")
    one.add_argument("folder", type=Path)
    one.add_argument("--cases", type=Path, default=ROOT / "data" / "open_cases")
    one.add_argument("--only", nargs="*", default=[])
    two = verbs.add_parser("compare")
    two.add_argument("before", type=Path)
    two.add_argument("after", type=Path)
    given = parser.parse_args()
    if given.verb == "compare":
        return compare(given.before, given.after)
    record(str(Path(given.vegglue).resolve()), given.folder.resolve(), given.cases.resolve(), given.only)
    return 0


if __name__ == "__main__":
    sys.exit(main())
