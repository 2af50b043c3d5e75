"""Errors of a site, in units of a station, against the flow of a site that is wrong by as much."""

from dataclasses import replace

import numpy as np
import pytest
from coarse_twin import CASE, coarse_twin

from vegglue.arrays import Array
from vegglue.calibration.model_error import CellResponses, cell_responses, site_error_columns
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case, ModelError
from vegglue.engine.interface import Model, Point, linearise

PARTS = ("stems", "edges", "probes", "discharge")


@pytest.fixture(scope="module")
def flowing() -> tuple[Model, Point]:
    return coarse_twin()


@pytest.fixture(scope="module")
def cells(flowing: tuple[Model, Point]) -> CellResponses:
    return cell_responses(*flowing, ("friction", "drag"))


@pytest.fixture(scope="module")
def columns(flowing: tuple[Model, Point], cells: CellResponses) -> dict[str, Array]:
    """Of each part alone, with an error of 1."""
    return {part: site_error_columns(*flowing, ModelError(**{part: 1.0}), cells) for part in PARTS}


def change(flowing: tuple[Model, Point], case: Case) -> Array:
    """Of the predictions when the case is this one."""
    model, point = flowing
    there = linearise(replace(model, case=case, site=build_site(case)), point.z, point)
    assert there is not None
    return there.prediction - point.prediction


def test_a_probe_beside_its_place_sees_the_slope_of_the_flow(
    flowing: tuple[Model, Point], columns: dict[str, Array]
) -> None:
    """Central differences of the flow 1 cm to either side; gauges do not move."""
    model, point = flowing
    moved = [
        linearise(replace(model, station=model.station.assign(y=model.station["y"] + step)), point.z, point)
        for step in (0.01, -0.01)
    ]
    assert all(one is not None for one in moved)
    slope = (moved[0].prediction - moved[1].prediction) / 0.02
    velocity = (model.station["kind"] == "velocity").to_numpy()
    found = columns["probes"] @ columns["probes"].T
    assert np.abs(found - np.diag(np.diag(found))).max() == 0.0, "each probe errs by itself"
    assert not np.diag(found)[~velocity].any()
    size, true = np.sqrt(np.diag(found))[velocity], np.abs(slope[velocity])
    # coarse cells: a slope over two of them is not that at a place
    assert np.corrcoef(size, true)[0, 1] > 0.8
    assert size.sum() == pytest.approx(true.sum(), rel=0.15)


def test_a_wrong_discharge_is_that_of_one_experiment(flowing: tuple[Model, Point], columns: dict[str, Array]) -> None:
    mid = CASE.experiments["mid"]
    more = mid.model_copy(update={"discharge": {name: 1.01 * float(value) for name, value in mid.discharge.items()}})
    case = flowing[0].case.model_copy(update={"experiments": {**CASE.experiments, "mid": more}})
    found = columns["discharge"][:, list(CASE.experiments).index("mid")]
    assert 0.01 * found == pytest.approx(change(flowing, case), abs=2e-4)


def test_stems_are_the_friction_of_each_patch(cells: CellResponses, columns: dict[str, Array]) -> None:
    planted = coarse_twin()[0].site.patch >= 0
    everywhere = cells.of["friction"][:, planted].sum(axis=1)
    assert columns["stems"].shape[1] == len(CASE.plants.patches)
    assert columns["stems"].sum(axis=1) == pytest.approx(everywhere, rel=1e-3, abs=1e-5)


@pytest.mark.parametrize(("sign", "alike"), [(1.0, 0.7), (-1.0, 0.9)])
def test_a_side_further_out_is_a_larger_patch(
    sign: float, alike: float, flowing: tuple[Model, Point], columns: dict[str, Array]
) -> None:
    """The first patch, which ends at y = 0, one cell wider or narrower there: the same pattern, to first order."""
    model, _ = flowing
    first, *others = model.case.plants.patches
    cell = sign * model.site.grid.dy
    moved = first.model_copy(update={"y": (first.y[0], first.y[1] + cell)})
    plants = model.case.plants.model_copy(update={"patches": (moved, *others)})
    true = change(flowing, model.case.model_copy(update={"plants": plants}))
    outwards, inwards = columns["edges"][:, 0::2].T, columns["edges"][:, 1::2].T
    sides = cell * np.sqrt(2.0) * (outwards if sign > 0.0 else inwards)
    found = max(sides, key=lambda one: float(one @ true))
    assert found @ true > alike * np.linalg.norm(found) * np.linalg.norm(true)
    assert 0.4 < np.linalg.norm(found) / np.linalg.norm(true) < 2.5


def test_errors_add_up_and_none_is_none(
    flowing: tuple[Model, Point], cells: CellResponses, columns: dict[str, Array]
) -> None:
    sizes = dict(zip(PARTS, (0.1, 0.05, 0.02, 0.01), strict=True))
    both = site_error_columns(*flowing, ModelError(**sizes), cells)
    apart = sum(sizes[part] ** 2 * columns[part] @ columns[part].T for part in PARTS)
    assert both @ both.T == pytest.approx(apart, rel=1e-6, abs=1e-12)
    assert not site_error_columns(*flowing, ModelError(friction=0.05), cells).any()
