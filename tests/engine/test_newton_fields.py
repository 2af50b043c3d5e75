"""Responses to a term in each cell, by adjoints: against those of uniform effects, and against solved flows."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from channels import stations_at

from vegglue.arrays import Array
from vegglue.calibration.candidates import Candidate, cause_of, place_candidate, with_effect
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case
from vegglue.effects.library import library
from vegglue.engine.interface import Model, Point, linearise, responses, responses_to_cells
from vegglue.engine.newton import NEWTON
from vegglue.flow.local_changes import Term

TERMS: tuple[Term, ...] = ("drag", "bed", "inflow", "viscosity")
CASE = Case.model_validate(
    {
        "source": Path("fields"),
        "name": "fields",
        "grid": {"x": (0.0, 24.0), "y": (-3.0, 3.0), "cell": (1.0, 0.5)},
        "bed": [{"trapezoid": {"axis": 0.0, "bottom_width": 3.0, "bank_slope": 0.5, "bed_slope": 0.001, "level": 0.0}}],
        "friction": {"classes": {"bed": {"law": "manning", "n": "n_b"}}, "default": "bed"},
        "inflows": {"main": {"side": "west"}},
        "eddy_viscosity": 0.02,
        "experiments": {"high": {"discharge": {"main": 2.0}, "level": 0.8}},
        "parameters": {"n_b": {"distribution": "uniform", "low": 0.02, "high": 0.08, "unit": "s m^(-1/3)"}},
    }
)


PLACES = {"velocity": ((6.5, 12.5), (-1.25, 0.25, 1.25)), "level": ((3.5,), (0.25,))}


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(CASE, build_site(CASE), stations_at(["high"], PLACES), NEWTON)


@pytest.fixture(scope="module")
def point(model: Model) -> Point:
    found = linearise(model, np.array([0.2]))
    assert found is not None
    return found


@pytest.fixture(scope="module")
def cells(model: Model, point: Point) -> dict[Term, Array]:
    [(rows, of)] = responses_to_cells(model, point, "high", TERMS)
    assert np.array_equal(rows, model.rows["high"])
    return dict(of)


def of_effects(model: Model, point: Point, *names: str) -> Array:
    """Responses to effects of the library (station, effect)."""
    causes = [cause_of(CASE, Candidate(library()[name]), {}) for name in names]
    return responses(model, point, causes)


def test_viscosity_in_all_cells_is_that_of_everywhere(model: Model, point: Point, cells: dict[Term, Array]) -> None:
    everywhere = of_effects(model, point, "viscosity")[:, 0]
    assert cells["viscosity"].sum(axis=(1, 2)) == pytest.approx(everywhere, abs=0.02 * np.abs(everywhere).max())


def test_beds_of_all_cells_are_those_of_floor_and_banks(model: Model, point: Point, cells: dict[Term, Array]) -> None:
    """Beside the inflow, too, where a bed changes how water is spread over it."""
    together = of_effects(model, point, "floor_level_error", "bank_level_error").sum(axis=1)
    assert cells["bed"].sum(axis=(1, 2)) == pytest.approx(together, abs=0.02 * np.abs(together).max())


# The effect that changes a term, and how small a change is a small one, in its unit.
IN_ONE_CELL = {
    "drag": ("unlisted_object", 0.005), "bed": ("unlisted_bed", 0.002),
    "inflow": ("unlisted_inflow", 1e-5), "viscosity": ("unlisted_viscosity", 0.001),
}  # fmt: skip


@pytest.mark.parametrize("x", [0.5, 8.5])
@pytest.mark.parametrize("term", TERMS)
def test_the_response_of_one_cell_is_the_difference_of_two_flows(
    model: Model, point: Point, cells: dict[Term, Array], term: Term, x: float
) -> None:
    """A spot so small that it fills one cell and no other: its middle is that of the cell. Beside the inflow, too,
    where it changes how the discharge is shared over all rows: what a bed there does was off by as much as it is.
    """
    name, size = IN_ONE_CELL[term]
    grid = model.site.grid
    i, j = int(np.argmin(np.abs(grid.x - x))), int(np.argmin(np.abs(grid.y - 0.25)))
    shapes = {"x": float(grid.x[i]), "y": float(grid.y[j]), "length": 0.05, "width": 0.05}
    candidate = place_candidate(library()[name], shapes)
    with_it = replace(model, case=with_effect(CASE, candidate, shapes))
    sd = candidate.amplitude.scale
    moved = linearise(with_it, np.array([*point.z, size / sd]), point)
    assert moved is not None
    per_unit = np.pi * shapes["length"] * shapes["width"] if term == "inflow" else 1.0
    difference = (moved.prediction - point.prediction) / size * per_unit
    assert np.abs(difference).max() > 0.0
    assert cells[term][:, i, j] == pytest.approx(difference, abs=0.01 * np.abs(difference).max())
