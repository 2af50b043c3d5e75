"""A code of others as the engine: the second solver, called as a command, names what is hidden in its own measurements.

A code has its own errors of grid and scheme: here cells four times as large as those of the built-in engine. What is
judged is the misfit of that code, which its own truth without anything hidden leaves at the errors of measurement.
"""

from pathlib import Path

import blind_truth
import numpy as np
import pandas as pd
import pytest
from blind_truth import perfect_site, true_values
from commands import by_server, served
from reach import ROOT
from site_reach import EDDY_VISCOSITY

import vegglue
from vegglue.case.config import load_case
from vegglue.case.schema import Case
from vegglue.measurements.observations import read_observations

# Cells of the second solver [m]: a member takes a second, where finer ones take ten.
CELLS = (1.0, 0.375)
TRUE = {"n_b": 0.03, "phi": 2.0}
# Known to both, so that a place costs five runs instead of nine. Viscosity is as the config has it [m2/s].
KNOWN = {"k_s": 0.5, "canopy_height": 0.7, "eddy_viscosity": EDDY_VISCOSITY}
# A secondary current of this strength [-] is some twenty standard errors long, and plausible.
HIDDEN = {"secondary_current": {"strength": 0.02}}
CHANGES = (
    ("../data/twin/", ""),
    ("canopy_height: canopy_height", f"canopy_height: {KNOWN['canopy_height']}"),
    ("k_s: k_s}", f"k_s: {KNOWN['k_s']}}}"),
)


MID = "  mid: {discharge: 2.0, level: 0.90}\n"


def small_twin(folder: Path, mid: bool = False) -> Path:
    """The short channel in two experiments, three with mid, and two parameters, so that a test of it is short."""
    text = (ROOT / "configs" / "twin.yaml").read_text(encoding="utf-8")
    told = ("  k_s:", "  canopy_height:")
    text = "".join(line for line in text.splitlines(keepends=True) if not line.startswith(told))
    for old, new in CHANGES if mid else (*CHANGES, (MID, "")):
        assert old in text
        text = text.replace(old, new)
    for name in ("velocities", "levels"):
        table = pd.read_csv(ROOT / "data" / "twin" / f"{name}.csv")
        table[mid | (table["experiment"] != "mid")].to_csv(folder / f"{name}.csv", index=False)
    (folder / "twin.yaml").write_text(text, encoding="utf-8")
    return folder / "twin.yaml"


def measured_by_second(case: Case, station: pd.DataFrame, hidden: dict[str, dict[str, float]]) -> None:
    """Replace the measurements of the case by those of the second solver, with errors as they state them."""
    write_with_errors(case, station, second(case, station, hidden)(TRUE))


def write_with_errors(case: Case, station: pd.DataFrame, value: np.ndarray) -> None:
    """Values of stations and errors as they state them, into the tables of the case."""
    value = value + np.random.default_rng(3).standard_normal(value.size) * station["standard_error"].to_numpy(float)
    for observation in case.observations:
        column = "u" if observation.kind == "velocity" else "level"
        table = pd.read_csv(observation.file)
        table[column] = value[(station["kind"] == observation.kind).to_numpy()]
        table.to_csv(observation.file, index=False)


def second(case: Case, station: pd.DataFrame, hidden: dict[str, dict[str, float]] | None = None):  # type: ignore[no-untyped-def]
    def predict(theta: dict[str, float]) -> np.ndarray:
        site = perfect_site(case, "twin", theta | KNOWN, len(station))
        try:
            return np.asarray(true_values(site, case, "twin", station, hidden or {}))
        except RuntimeError as error:  # not steady: a failed run
            raise ValueError(str(error)) from None

    return predict


@pytest.mark.slow
def test_it_names_what_is_hidden_in_its_own_measurements(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Half a minute: some twenty runs of another solver, without which nothing of this kind is shown."""
    monkeypatch.setitem(blind_truth.CELLS, "twin", CELLS)
    config = small_twin(tmp_path)
    case = load_case(config)
    station = read_observations(case).table
    measured_by_second(case, station, HIDDEN)
    with served(second(case, station)) as port:
        found = vegglue.diagnose(by_server(config, port), runs=tmp_path / "runs", jobs=1)
    assert found.verdict.kind == "identified"
    assert found.set == ["secondary_current"]
    strength = found.candidate_effect("secondary_current").amplitude.value
    assert strength == pytest.approx(HIDDEN["secondary_current"]["strength"], rel=0.2)
    assert found.verdict.remarks[0].startswith("Predictions and slopes are those of the command of `engine`")
    assert found.parameters.last["n_b"][0] == pytest.approx(TRUE["n_b"], rel=0.2)
