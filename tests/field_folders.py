"""Folders of field teams that tests of importers share: made, imported, or refused."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import vegglue
from vegglue.case.schema import Case
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations

SITE: dict[str, Any] = {
    "channel": {"length_m": 40.0, "bottom_width_m": 3.0, "bank_slope_v_per_h": 0.6667, "bed_slope": 0.001},
    "patches": [{"x": [16, 20], "y": [0, 1.5], "stems_per_m2": 20}, {"x": [26, 30], "y": [-1.5, 0], "stems_per_m2": 1}],
    "canopy_height_guess_m": 0.6,
    "experiments": {"low": {"discharge_m3_s": 1.2, "downstream_level_m": 0.7}},
    "holdout": {"high": {"discharge_m3_s": 2.0, "downstream_level_m": 0.9}},
}

# A channel and an experiment as a site file has them.
CHANNEL = "channel: {length_m: 30, bottom_width_m: 3, bank_slope_v_per_h: 0.5, bed_slope: 0.001}\n"
JUNE = "experiments: {June: {discharge: 2000 l/s, level: 95 cm}}\n"


def field_folder(folder: Path, **changes: Any) -> Path:
    """What a field team would hand over."""
    folder.mkdir()
    (folder / "site.json").write_text(json.dumps(SITE | changes), encoding="utf-8")
    (folder / "velocities.csv").write_text("experiment,section,x,y,u,u_se\nlow,A,12,0.5,0.45,0.01\n", encoding="utf-8")
    (folder / "levels.csv").write_text("experiment,x,y,level,level_se\nlow,10,0,0.74,0.002\n", encoding="utf-8")
    (folder / "holdout.csv").write_text("experiment,section,x,y,u\nhigh,A,12,0.5,0.6\n", encoding="utf-8")
    return folder


def folder_of(path: Path, site: str, **files: str) -> Path:
    """A folder of measurements; names of files with __ for the point."""
    path.mkdir(parents=True)
    (path / "site.yaml").write_text(site, encoding="utf-8")
    for name, text in files.items():
        (path / name.replace("__", ".")).write_text(text, encoding="utf-8")
    return path


@dataclass(frozen=True)
class Imported:
    """A case, its stations, and what was taken from each file, by its name."""

    case: Case
    table: pd.DataFrame
    taken: dict[str, str]

    def values(self, kind: str = "velocity") -> list[float]:
        """Of one kind, in their order."""
        return self.table.loc[self.table["kind"] == kind, "value"].tolist()


def imported(folder: Path) -> Imported:
    """A folder as a case beside it."""
    case = vegglue.import_folder(folder, folder.parent / f"{folder.name}.yaml")
    return Imported(case, read_observations(case).table, {one.name: one.taken for one in case.imported or ()})


def import_of(tmp_path: Path, site: str = CHANNEL + JUNE, **files: str) -> Imported:
    """A site file and tables as a case."""
    return imported(folder_of(tmp_path / f"brook{len(list(tmp_path.iterdir()))}", site, **files))


def refusal_of(tmp_path: Path, site: str = CHANNEL + JUNE, **files: str) -> str:
    """Why a site file and tables are refused: one line, and nothing is written."""
    folder = folder_of(tmp_path / f"brook{len(list(tmp_path.iterdir()))}", site, **files)
    return refusal(folder)


def refusal(folder: Path) -> str:
    """Why a folder is refused: one line, and nothing is written."""
    target = folder.parent / "made" / "brook.yaml"
    with pytest.raises(InputError) as refused:
        vegglue.import_folder(folder, target)
    assert len(str(refused.value).splitlines()) == 1
    assert not target.parent.exists()
    return str(refused.value)
