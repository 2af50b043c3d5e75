"""The folder of a twin: measurements, a config that extends the one it is a twin of, and the sealed answer."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.case.centreline import on_map
from vegglue.case.grid import centreline_in
from vegglue.case.made_files import write_made
from vegglue.case.resolved_config import as_yaml
from vegglue.case.schema import Case
from vegglue.case.text_files import case_name
from vegglue.errors import InputError, shown_path
from vegglue.measurements.kinds import KINDS, Kind, kind_of
from vegglue.workflow.sealed_answer import Answer

SEAL = "answer.sealed"


def write_twin(case: Case, folder: Path, station: pd.DataFrame, seal: str, force: bool = False) -> Path:
    """Write all files and return the config. force: replace what vegglue did not write, too.

    Errors: InputError when such files are there; StorageError when the folder cannot be written.
    """
    name = case_name(folder.resolve().name, "twin")
    used = _on_the_map(case, station[station["used"].to_numpy(bool)])
    kinds = [kind for kind in KINDS.values() if (used["kind"] == kind.name).any()]
    tree = {
        "extends": Path(os.path.relpath(case.source, folder.resolve())).as_posix(),
        "name": name,
        "title": f"Twin of {case.name}, something may be hidden (synthetic)",
        "observations": [{"kind": kind.name, "file": kind.file, "synthetic": True} for kind in kinds],
        **{key: None for key in ("validation", "reference") if getattr(case, key) is not None},
    }
    note = f"# Made by `vegglue twin` from {case.name}; the answer is sealed in {SEAL}.\n"
    texts = {kind.file: _stations(used, kind) for kind in kinds}
    target = folder / f"{name}.yaml"
    if target.resolve() == case.source:
        raise InputError(f"--to {shown_path(folder)}: holds the config that the twin is made of; give another folder.")
    named = texts | {SEAL: seal, target.name: note + as_yaml(tree)}
    write_made({folder / file: text for file, text in named.items()}, "give another folder by --to", force)
    return target


def in_rows_of_twin(answer: Answer, station: pd.DataFrame) -> Answer:
    """The answer with bad probes by their rows in what the files of the twin hold: used stations alone, by kind.

    station: that of the case, in which they were chosen.
    """
    used, kinds = station["used"].to_numpy(bool), station["kind"].to_numpy()
    order = [int(row) for kind in KINDS.values() for row in np.flatnonzero(used & (kinds == kind.name))]
    hidden = [replace(one, station=order.index(one.station)) if one.station >= 0 else one for one in answer.hidden]
    return replace(answer, hidden=tuple(hidden))


def _on_the_map(case: Case, station: pd.DataFrame) -> pd.DataFrame:
    """Points of the grid on the map, as files of stations have them; as they are without a centreline."""
    line, at_point = centreline_in(case), [kind_of(name).at_point for name in station["kind"]]
    if line is None:
        return station
    x, y = on_map(line, station["x"].to_numpy(float), station["y"].to_numpy(float))
    return station.assign(x=station["x"].where(~np.array(at_point), x), y=station["y"].where(~np.array(at_point), y))


def _stations(used: pd.DataFrame, kind: Kind) -> str:
    """The stations of a kind as a table."""
    names = {"value": kind.column, "standard_error": kind.error_column}
    named = used[used["kind"] == kind.name].rename(columns=names)
    columns = ["experiment", *(["section"] if kind.velocity else []), "x", "y", *names.values()]
    return str(named[columns].to_csv(index=False, float_format="%.5f"))


def config_in(folder: Path) -> Path:
    """The config that `write_twin` left there, beside its children maybe. Errors: InputError when it cannot be told."""
    own = folder / f"{case_name(folder.resolve().name, 'twin')}.yaml"
    found = [own] if own.is_file() else sorted(folder.glob("*.yaml"))
    if len(found) != 1:
        raise InputError(f"{folder}: expected one config, got {len(found)}; `vegglue twin --to {folder}` writes it.")
    return found[0]
