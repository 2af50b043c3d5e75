"""Ranges of patches, zones, inflows and the outlet: one rule, and what is said of one that holds no cell centre."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from built_models import model_of

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case
from vegglue.case.zones import centres_within, inflow_cells, ranges_without_cells
from vegglue.engine.interface import Model
from vegglue.engine.model import coarser
from vegglue.errors import InputError
from vegglue.flow.problem_setup import build_problem
from vegglue.inference.solve_ensemble import solve_ensemble
from vegglue.measurements.observations import read_observations

# Cell centres along y: -2.75, -2.25, ..., 2.75.
TREE = {
    "name": "small",
    "grid": {"x": [0, 12], "y": [-3, 3], "cell": [1, 0.5]},
    "bed": [{"trapezoid": {"axis": 0.0, "bottom_width": 3.0, "bank_slope": 0.5, "bed_slope": 0.001, "level": 0.0}}],
    "friction": {
        "classes": {"bed": {"law": "manning", "n": "n_b"}, "bank": {"law": "chezy", "c": 20}},
        "default": "bed",
    },
    "inflows": {"upstream": {"side": "west"}},
    "experiments": {"one": {"discharge": 1, "level": 0.7}},
    "parameters": {"n_b": {"distribution": "uniform", "low": 0.02, "high": 0.04, "unit": "s m^(-1/3)"}},
    "simulate": {"members": 4},
}
EMPTY = [
    ({"inflows": {"upstream": {"side": "west", "range": [0.3, 0.7]}}}, "inflows.upstream.range"),
    # Closed, it would hold the centre at its upper end.
    ({"inflows": {"upstream": {"side": "west", "range": [0.3, 0.75]}}}, "inflows.upstream.range"),
    ({"outlet": {"range": [0.3, 0.75]}}, "outlet.range"),
]


def case_with(folder: Path, **changes: object) -> Case:
    (folder / "small.yaml").write_text(yaml.safe_dump(TREE | changes, sort_keys=False))
    return load_case(folder / "small.yaml")


def model_with(folder: Path, **changes: object) -> Model:
    case = case_with(folder, **changes)
    return model_of(case, read_observations(case))


def test_a_centre_on_a_shared_edge_belongs_to_the_upper_range() -> None:
    centres = np.array([0.25, 0.75, 1.25])
    assert centres_within((0.25, 0.75), centres).tolist() == [True, False, False]
    assert centres_within((0.75, 1.25), centres).tolist() == [False, True, False]
    assert centres_within(None, centres).all()


def test_zones_and_boundaries_hold_the_same_cells_and_patches_what_they_cover(tmp_path: Path) -> None:
    span = [0.25, 1.25]  # of the centres 0.25, 0.75 and 1.25 not the last
    case = case_with(
        tmp_path,
        friction=TREE["friction"] | {"zones": [{"class": "bank", "y": span}]},
        plants={
            "stands": {"reed": {"phi": 1.0, "canopy_height": 0.5}},
            "patches": [{"name": "p", "stand": "reed", "x": [0, 12], "y": span}],
        },
        inflows={"upstream": {"side": "west", "range": span}},
        outlet={"range": span},
    )
    site = build_site(case)
    problem = build_problem(case, site, "one", {"n_b": np.array([0.03])})
    cells = [6, 7]
    assert site.cover[0, 5:10] == pytest.approx([0.0, 0.5, 1.0, 0.5, 0.0])
    assert np.flatnonzero(site.friction_class[0] == 1).tolist() == cells
    assert np.flatnonzero(problem.boundaries.outlet).tolist() == cells
    assert inflow_cells(case.inflows["upstream"], site.grid).tolist() == cells
    assert (problem.boundaries.inflows[0].start, problem.boundaries.inflows[0].stop) == (6, 8)


@pytest.mark.parametrize(("changes", "key"), EMPTY)
def test_a_boundary_without_a_cell_is_refused_before_anything_is_solved(
    tmp_path: Path, changes: dict[str, object], key: str
) -> None:
    case = case_with(tmp_path, **changes)
    site = build_site(case)
    assert list(ranges_without_cells(case, site.grid)) == [key]
    sentence = f"small.yaml: `{key}`"
    with pytest.raises(InputError, match=sentence):
        build_problem(case, site, "one", {"n_b": np.array([0.03])})
    with pytest.raises(InputError, match=sentence):
        solve_ensemble(case, read_observations(case), tmp_path / "ensemble.h5", 1, lambda progress: None)
    assert not (tmp_path / "ensemble.h5").exists()


def test_a_grid_whose_boundary_would_lose_its_cells_is_not_coarsened(tmp_path: Path) -> None:
    model = model_with(tmp_path)
    assert coarser(model) is not None
    # Holds the centre 0.75, but neither 0.5 nor 1.5 of cells of 1 m.
    narrow = model_with(tmp_path, inflows={"upstream": {"side": "west", "range": [0.6, 1.0]}})
    assert coarser(narrow) is None
    assert coarser(replace(narrow, case=model.case)) is not None
