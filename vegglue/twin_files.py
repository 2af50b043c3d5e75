"""The folder of a twin: measurements, a config that extends the one it is a twin of, and the sealed answer."""

import os
import re
from pathlib import Path

import pandas as pd

from vegglue.config import as_yaml
from vegglue.errors import InputError, StorageError
from vegglue.schema import Case

SEAL = "answer.sealed"
FILES = {"velocity": ("velocities.csv", "u"), "level": ("levels.csv", "level")}


def write_twin(case: Case, folder: Path, station: pd.DataFrame, seal: str) -> Path:
    """Write all files and return the config. Errors: StorageError when the folder cannot be written."""
    name = re.sub(r"[^a-z0-9_-]+", "-", folder.resolve().name.lower()).strip("-") or "twin"
    target = folder / f"{name}.yaml"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        kinds = [kind for kind in FILES if _write_stations(folder, station, kind)]
        tree = {
            "extends": Path(os.path.relpath(case.source, folder.resolve())).as_posix(),
            "name": name,
            "title": f"Twin of {case.name}, something may be hidden (synthetic)",
            "observations": [{"kind": kind, "file": FILES[kind][0]} for kind in kinds],
            **{key: None for key in ("validation", "reference") if getattr(case, key) is not None},
        }
        text = f"# Made by `vegglue twin` from {case.name}; the answer is sealed in {SEAL}.\n"
        target.write_text(text + as_yaml(tree), encoding="utf-8")
        (folder / SEAL).write_text(seal, encoding="utf-8")
    except OSError as error:
        raise StorageError(f"{folder}: cannot be written ({error.strerror}); give another folder by --to.") from None
    return target


def _write_stations(folder: Path, station: pd.DataFrame, kind: str) -> bool:
    """Whether there are stations of a kind, which are written then."""
    file, value = FILES[kind]
    rows = station[station["used"].to_numpy(bool) & (station["kind"] == kind).to_numpy()]
    if rows.empty:
        return False
    named = rows.rename(columns={"value": value, "standard_error": f"{value}_se"})
    columns = ["experiment", *(["section"] if kind == "velocity" else []), "x", "y", value, f"{value}_se"]
    named[columns].to_csv(folder / file, index=False, float_format="%.5f")
    return True


def config_in(folder: Path) -> Path:
    """The config that `write_twin` left there. Errors: InputError when there is not exactly one."""
    found = sorted(folder.glob("*.yaml"))
    if len(found) != 1:
        raise InputError(f"{folder}: expected one config, got {len(found)}; `vegglue twin --to {folder}` writes it.")
    return found[0]
