"""The loop on data that another code made, with nothing hidden in them, or an instrument that is off."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from open_cases import OPEN_CASES, looked_into, on_larger_cells

from vegglue.case.config import load_case
from vegglue.importers.field_folder import case_from_folder
from vegglue.workflow.diagnose import diagnose

pytestmark = pytest.mark.slow


def test_where_nothing_is_hidden_nothing_is_found(campaigns: Path) -> None:
    found = looked_into(on_larger_cells("open-a", campaigns))
    assert found.verdict.kind == "nothing-missing", found.verdict.sentence


@pytest.mark.parametrize(("name", "kind", "offset"), [("open-j", "probe", 0.05), ("open-k", "gauge", -0.015)])
def test_an_instrument_that_is_off_is_set_aside_alone(name: str, kind: str, offset: float, campaigns: Path) -> None:
    found = looked_into(on_larger_cells(name, campaigns))
    (faulty,) = found.instruments
    assert found.verdict.kind == "instrument", found.verdict.sentence
    assert (faulty.kind, found.steps, found.places) == (kind, (), ())
    assert faulty.interval95[0] <= offset <= faulty.interval95[1]
    assert np.isnan(faulty.factor), "it reads too much by the same everywhere"


def test_of_a_probe_that_is_off_by_a_factor_nothing_is_left(campaigns: Path) -> None:
    """Half as much again at one y, where velocities are 0.27 to 0.63 m/s: no offset makes up for it in all sections."""
    folder, config = campaigns / "probe_factor", campaigns / "probe_factor.yaml"
    shutil.copytree(OPEN_CASES / "open-a", folder)
    velocities = pd.read_csv(folder / "velocities.csv")
    velocities.loc[(velocities["y"] + 0.6).abs() < 0.01, "u"] *= 1.5
    velocities.to_csv(folder / "velocities.csv", index=False)
    config.write_text(yaml.safe_dump(case_from_folder(folder, config).tree), encoding="utf-8")
    found = diagnose(load_case(config), runs=campaigns / "runs", watch=print)
    assert found.verdict.kind == "instrument", found.verdict.sentence
    assert [(one.kind, one.y) for one in found.instruments] == [("probe", -0.6)]
    assert found.instruments[0].factor == pytest.approx(1.5, abs=0.05)
    assert (found.steps, found.places) == ((), ())
