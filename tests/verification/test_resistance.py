"""Every resistance law against its closed form, written out again here with its own numbers, and in uniform flow."""

from dataclasses import replace

import numpy as np
import pytest
from channels import GRAVITY, discharge, make_problem, planted, sloping, solved

from vegglue.effects import bed_laws
from vegglue.flow.closures import drag
from vegglue.flow.equations import faces, residual
from vegglue.flow.problem import ALONG, LEVEL
from vegglue.flow.starts import backwater

SLOPE, LENGTH, COLUMNS, ROWS = 0.002, 40.0, 20, 3
# The law's speed is rounded at 1 mm/s so that its slope exists at rest.
ROUNDING = 1e-3


def manning(h, n):
    return h ** (1.0 / 6.0) / n


def keulegan(h, k_s, floor=1.3):
    return 18.0 * np.log10(max(12.0 * h / k_s, floor))


def baptist(h, phi, height, bare, proportional=False):
    share = min(1.0, h / height) if proportional else 1.0
    submerged = np.sqrt(9.81) / 0.41 * np.log(h / height) if h > height else 0.0
    return (1.0 / bare**2 + share * phi / (2.0 * 9.81)) ** -0.5 + submerged


def classes(law, value):
    return {"friction": (law, value)}


def plants(phi, height, bare=60.0, proportional=False):
    return {"plants": planted((COLUMNS, ROWS), phi, height, bare, proportional=proportional)}


# name: (depth [m], Chezy coefficient [m^1/2/s], what makes the problem)
LAWS = {
    "manning": (0.8, manning(0.8, 0.03), classes(bed_laws.MANNING, 0.03)),
    "manning-shallow": (0.1, manning(0.1, 0.06), classes(bed_laws.MANNING, 0.06)),
    "keulegan": (0.8, keulegan(0.8, 0.5), classes(bed_laws.KEULEGAN, 0.5)),
    "keulegan-clipped": (0.3, 18.0 * np.log10(1.3), classes(bed_laws.KEULEGAN, 2.9)),
    "keulegan-other-clip": (
        0.3,
        18.0 * np.log10(1.0129),
        classes(bed_laws.KEULEGAN, 4.0) | {"bank_argument_minimum": 1.0129},
    ),
    "chezy": (0.8, 35.0, classes(bed_laws.CHEZY, 35.0)),
    "baptist-emergent": (0.5, baptist(0.5, 2.0, 0.8, 60.0), plants(2.0, 0.8)),
    "baptist-emergent-proportional": (0.5, baptist(0.5, 2.0, 0.8, 60.0, True), plants(2.0, 0.8, proportional=True)),
    "baptist-submerged": (1.3, baptist(1.3, 2.0, 0.8, 60.0), plants(2.0, 0.8)),
    "baptist-submerged-proportional": (1.3, baptist(1.3, 2.0, 0.8, 60.0, True), plants(2.0, 0.8, proportional=True)),
    "baptist-bare": (0.8, 40.0, plants(1e-12, 0.8, bare=40.0)),
}


def uniform(depth, chezy, changes):
    """A wide channel without side friction carrying its normal discharge, q = C h sqrt(h S), at its normal depth."""
    bed = sloping(LENGTH, COLUMNS, ROWS, SLOPE)
    speed = chezy * np.sqrt(depth * SLOPE)
    # k sqrt(u^2 + e^2) u = g S, and k u0^2 = g S without the rounding e.
    speed = np.sqrt(np.sqrt(speed**4 + ROUNDING**4 / 4.0) - ROUNDING**2 / 2.0)
    width = ROWS * 1.5
    level = depth - SLOPE * LENGTH
    return make_problem(bed, (LENGTH / COLUMNS, 1.5), speed * depth * width, level, film=1e-6, **changes), speed


@pytest.mark.parametrize("name", LAWS)
def test_uniform_flow_has_its_normal_depth(name):
    """Newton finds the closed-form depth and speed in every cell."""
    depth, chezy, changes = LAWS[name]
    problem, speed = uniform(depth, chezy, changes)
    now = faces(problem, solved(problem))
    assert now.cell == pytest.approx(depth, rel=1e-8)
    assert now.u == pytest.approx(speed, rel=1e-8)
    assert np.abs(now.v).max() < 1e-10


@pytest.mark.parametrize("name", LAWS)
def test_drag_is_the_closed_form(name):
    """k = g / (C^2 h)."""
    depth, chezy, changes = LAWS[name]
    problem, _ = uniform(depth, chezy, changes)
    cells = np.full((COLUMNS, ROWS, 1), depth)
    assert drag(problem, cells) == pytest.approx(9.81 / (chezy**2 * depth), rel=1e-12)


@pytest.mark.parametrize("law", ["manning", "keulegan", "baptist"])
def test_drag_follows_depth(law):
    """Over depths from little to deep water, through k_s/12 and the canopy.

    The least are 1,000 films; there the wet depth, rounded off towards the waterline, is not quite that of the cell.
    """
    depth = np.geomspace(1e-3, 5.0, COLUMNS * ROWS).reshape(COLUMNS, ROWS, 1)
    changes, chezy = {
        "manning": (classes(bed_laws.MANNING, 0.05), [manning(h, 0.05) for h in depth.ravel()]),
        "keulegan": (classes(bed_laws.KEULEGAN, 2.7), [keulegan(h, 2.7) for h in depth.ravel()]),
        "baptist": (plants(40.0, 0.8), [baptist(h, 40.0, 0.8, 60.0) for h in depth.ravel()]),
    }[law]
    problem, _ = uniform(1.0, 50.0, changes)
    assert drag(problem, depth).ravel() == pytest.approx(9.81 / (np.array(chezy) ** 2 * depth.ravel()), rel=1e-9)


@pytest.mark.parametrize(
    ("law", "value", "chezy"),
    [
        (bed_laws.MANNING, 0.05, lambda h, n: manning(h.mean(), n)),
        (bed_laws.KEULEGAN, 1.0, lambda h, k_s: np.mean([keulegan(depth, k_s) for depth in h])),
        (bed_laws.CHEZY, 30.0, lambda h, c: c),
    ],
    ids=["manning", "keulegan", "chezy"],
)
def test_a_cell_on_a_slope_conveys_what_its_wet_part_does(law, value, chezy):
    """k = g (h / K)^2 with K = s C h_w^(3/2): share s, mean depth h_w and C of the wet ones of 5,000 strips.

    The wet depth is rounded off, by up to 9 % where the waterline leaves the cell, so that it has a derivative.
    """
    slope, film = 0.5, 1e-5
    bed = np.repeat(slope * (np.arange(12) + 0.5)[None], 6, axis=0)
    inside, reach = slope * ((np.arange(5000) + 0.5) / 5000 - 0.5), 0.5 * slope
    for level in (3.3, 3.44, 3.57):
        problem = make_problem(bed, (1.0, 1.0), 0.0, level, (law, value), film=film)
        depth = faces(problem, np.stack([np.full((6, 12, 1), level)] + 2 * [np.zeros((6, 12, 1))], axis=1)).cell
        rates = drag(problem, depth)[2, :, 0]
        for row in np.flatnonzero(level - bed[2] > -0.2):
            strips = level - bed[2, row] - inside
            wet = strips[strips > 0.0]
            conveyed = wet.size / strips.size * chezy(wet, value) * wet.mean() ** 1.5
            expected = 9.81 * (np.maximum(strips, 0.0).mean() / conveyed) ** 2
            crossed_or_deep = not 0.5 * reach < wet.mean() < 2.0 * reach
            assert rates[row] == pytest.approx(expected, rel=0.015 if crossed_or_deep else 0.11)


def test_emergent_conventions_differ_below_the_canopy_only():
    """phi kept (the printed equation) against phi h / h_d: the resistance ratio is h / h_d for dense plants."""
    bare = 1e6
    kept, _ = uniform(1.0, 50.0, plants(3.0, 0.8, bare))
    scaled = replace(kept, plants=replace(kept.plants, proportional=True))
    shape = (COLUMNS, ROWS, 1)
    for depth, ratio in ((0.2, 0.25), (0.6, 0.75), (0.8, 1.0), (1.5, 1.0)):
        cells = np.full(shape, depth)
        assert drag(scaled, cells) / drag(kept, cells) == pytest.approx(ratio, rel=1e-9)


def test_laws_stay_finite_as_water_vanishes():
    depth = np.full((COLUMNS, ROWS, 1), 1e-4)
    for changes in (classes(bed_laws.MANNING, 0.1), classes(bed_laws.KEULEGAN, 5.0), plants(100.0, 0.8)):
        problem, _ = uniform(1.0, 50.0, changes)
        rates = drag(problem, depth)
        assert np.isfinite(rates).all()
        assert (rates > 0.0).all()


def test_plants_replace_the_class_of_their_cells():
    """A patch in a corner: its cells have Baptist's drag, all others their class's."""
    problem, _ = uniform(1.0, 50.0, classes(bed_laws.CHEZY, 30.0))
    inside = planted((4, 2), 2.0, 0.8, 60.0)
    cells = np.full((COLUMNS, ROWS, 1), 0.5)
    rates = drag(replace(problem, plants=inside), cells)[..., 0]
    expected = np.full((COLUMNS, ROWS), 9.81 / (30.0**2 * 0.5))
    expected[:4, :2] = 9.81 / (baptist(0.5, 2.0, 0.8, 60.0) ** 2 * 0.5)
    assert rates == pytest.approx(expected, rel=1e-12)


def test_friction_is_linear_below_a_millimetre_per_second():
    """Creeping flow: the force is k sqrt(u^2 + (1 mm/s)^2) u, here at u = 0.5 mm/s."""
    problem, _ = uniform(1.0, 20.0, classes(bed_laws.CHEZY, 20.0))
    state = np.zeros((COLUMNS, 3, ROWS, 1))
    state[:, LEVEL], state[:, ALONG] = 1.0 + problem.bed[:, :, None], 5e-4
    drag_force = residual(problem, state)[3:-3, ALONG] + GRAVITY * SLOPE
    assert drag_force == pytest.approx(9.81 / 400.0 * np.sqrt(5e-4**2 + 1e-6) * 5e-4, rel=1e-6)


def test_the_start_is_uniform_flow_already():
    """The one-dimensional estimate has the normal depth of a channel that has one."""
    problem, speed = uniform(*LAWS["manning"])
    state = backwater(problem)
    assert state[:, LEVEL, :, 0] - problem.bed == pytest.approx(0.8, abs=0.501 * SLOPE * LENGTH / COLUMNS)
    assert state[:, ALONG] == pytest.approx(speed, rel=5e-3)


def test_normal_discharge_scales_with_the_width():
    problem, speed = uniform(*LAWS["keulegan"])
    assert discharge(problem, solved(problem)) == pytest.approx(speed * 0.8 * ROWS * 1.5, rel=1e-9)
