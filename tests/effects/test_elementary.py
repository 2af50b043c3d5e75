"""Logarithm and cube root against those of numpy in extended precision; its double ones err by up to three units."""

import numpy as np

from vegglue.effects.bed_laws import cube_root, logarithm


def test_logarithm_and_cube_root_are_right_to_four_units():
    x = np.concatenate([np.exp(np.random.default_rng(3).uniform(-40.0, 40.0, 20_000)), [1.0, 2.0, 0.5, 1e-12, 1e12]])
    x = np.concatenate([x, 1.0 + np.geomspace(1e-12, 0.5, 200), 1.0 - np.geomspace(1e-12, 0.5, 200)])
    found, cube = np.array([[logarithm(value), cube_root(value)] for value in x]).T
    wide = x.astype(np.longdouble)
    assert (np.abs(found - np.log(wide)) <= 4.0 * np.spacing(np.abs(np.log(x)))).all()
    assert (np.abs(cube - np.cbrt(wide)) <= 4.0 * np.spacing(np.cbrt(x))).all()
    assert logarithm(1.0) == 0.0
