"""Momentum that effects carry: what one row of cells gives another one gets, and nothing goes through the sides."""

import numpy as np

from vegglue.flow import kernels
from vegglue.flow.stretch import Bend

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
