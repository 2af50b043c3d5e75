"""Momentum that effects carry: what one row of cells gives another one gets, and nothing goes through the sides."""

from dataclasses import replace

import numpy as np
from channels import even_geometry, make_problem, sloping

from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.library import library
from vegglue.flow import kernels
from vegglue.flow.equations import faces
from vegglue.flow.kernels import Bend
from vegglue.flow.newton import newton
from vegglue.flow.problem import InflowSegment
from vegglue.flow.starts import backwater

NONE = np.zeros((0, 0, 0))
SIZE = (6, 5, 2)
FILM, DX, DY = 1e-6, 0.8, 0.3


def pushed(xy: np.ndarray, bend: Bend | None = None) -> np.ndarray:
    """R_u of fluxes h T_xy (nx, ny, m) [m3/s2] in water 1 m deep, (nx, ny, m) [m/s2]."""
    out = np.zeros((SIZE[0], 3, *SIZE[1:]))
    kernels.push(out, np.ones(SIZE), NONE, NONE, NONE, xy, NONE, FILM, DX, DY, bend)
    return out[:, 2]


def test_across_the_channel_nothing_is_lost_through_its_sides() -> None:
    """Half of what the outermost rows carried went through them."""
    xy = np.random.default_rng(1).standard_normal(SIZE)
    found = pushed(xy)
    assert np.abs(found).max() > 0.1
    np.testing.assert_allclose(found.sum(axis=1), 0.0, atol=1e-12)


def test_an_even_flux_pushes_beside_the_sides_alone() -> None:
    """There it ends, within the half of a row: -2 h T / (2 dy) and its opposite."""
    found = pushed(np.ones(SIZE))
    np.testing.assert_allclose(found[:, 1:-1], 0.0, atol=1e-12)
    np.testing.assert_allclose(found[:, 0], 1.0 / DY)
    np.testing.assert_allclose(found[:, -1], -1.0 / DY)


def test_nothing_is_pushed_out_where_the_outlet_is_closed() -> None:
    """By dispersion, or by what joins from the side: it was 3.5 % of the discharge."""
    bed, open_rows = sloping(40.0, 20, 10, 0.001), np.arange(10) // 4 == 1
    problem = make_problem(bed, (2.0, 1.0), 5.0, 0.8, viscosity=np.array([0.05]), film=0.002)
    joining = InflowSegment("south", 14, 20, np.array([1.0]), True, np.ones((6, 1)), 1.0)
    boundaries = replace(problem.boundaries, outlet=open_rows, inflows=(*problem.boundaries.inflows, joining))
    dispersion = ActiveEffect(library(None)["dispersion"], {"excess": np.array([0.3])})
    geometry = even_geometry(bed, np.zeros(bed.shape), (2.0, 1.0))
    pushed = replace(problem, boundaries=boundaries, effects=(dispersion,), geometry=geometry)
    solved = newton(pushed, backwater(pushed), 1e-9)
    assert solved.converged[0]
    flux = faces(pushed, solved.state).flux_x[-1, :, 0]
    np.testing.assert_allclose(flux[~open_rows], 0.0, atol=1e-9)
    assert flux.sum() * 1.0 > 5.9
