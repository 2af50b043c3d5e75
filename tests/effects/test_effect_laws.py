"""Every effect against a number worked out by hand from its equation; one row each, none left out."""

from dataclasses import fields, replace
from math import cos, exp, log, pi, sin, sqrt, tanh

import numpy as np
import pytest

from vegglue.effects.library import SHIPPED, library
from vegglue.effects.plants import bent_blade
from vegglue.effects.surroundings import BoundaryValues, Cells, ChannelGeometry, PlantCells, Reading

LINE = np.arange(-2.0, 3.0)


def filled(kind, given, shape):
    """A noun with some fields given, 0 in all others, of one shape; numbers and parts of it as they are."""
    kept = {
        name: given[name]
        for name in ("length", "dx", "dy", "filter_width", "geometry", "viscosity", "shear_depth")
        if name in given
    }
    names = [item.name for item in fields(kind) if item.name not in kept]
    return kept | {name: np.broadcast_to(np.asarray(given.get(name, 0.0), float), shape) for name in names}


def geometry(**given):
    usual = {"length": 4.5, "dx": 0.5, "dy": 0.25, "filter_width": 0.3, "stretch": 1.0}
    usual |= {"depth_scale": 1.0, "speed_scale": 0.5}
    return ChannelGeometry(**filled(ChannelGeometry, usual | given, (5, 5, 1)))


def cells(u=0.0, v=0.0, on=None, **given):
    """Water of 0.8 m; u and v [m/s] may depend on x and y, five cells each."""
    x, y = 0.5 * LINE[:, None, None], 0.25 * LINE[None, :, None]
    u, v = (value(x, y) if callable(value) else value for value in (u, v))
    settings = {"depth": 0.8, "rate": 0.1, "bed_rate": 0.05, "u": u, "v": v, "viscosity": np.array([0.01])}
    settings["shear_depth"] = np.zeros((0, 0, 0))
    return Cells(**filled(Cells, settings | {"geometry": on or geometry()} | given, (5, 5, 1)))


def plant_cells(**given):
    return PlantCells(
        **filled(
            PlantCells,
            {"phi": 2.0, "canopy_height": 0.5, "depth": 0.8, "speed": 0.7, "speed_scale": 0.5} | given,
            (1, 1),
        )
    )


def reading(**given):
    """A probe that measures across a flow whose u is of no matter to it."""
    settings = {"value": 0.5, "velocity": 1.0, "component": 0.5, "component_y": 0.4, "depth": 0.8, "rate": 0.05}
    return Reading(**filled(Reading, settings | {"u": 0.9} | given, (1, 1)))


def gauge(**given):
    return reading(**{"velocity": 0.0, "level": 1.0, "component": 0.0, "component_y": 0.0} | given)


def boundary():
    return BoundaryValues(
        discharge=np.array([[2.0], [1.0]]),
        level=np.array([0.9]),
        spread=np.ones((2, 2, 1)),
        lateral=np.zeros(1),
        position=np.array([[[-0.5], [0.5]], [[-0.5], [0.5]]]),
    )


def shear(x, y):
    return 0.6 + 0.2 * y


U = sqrt(0.6**2 + 1e-6)
HELIX = sqrt(0.05 * 0.8) / 0.41
# Two half lengths and one half width from the middle of a spot.
SPOT = {"x": 1.0, "y": 1.5, "length": 0.3, "width": 0.5}
NEAR = geometry(x=1.6, y=2.0)
# The share of a cell there within a rectangle turned by 90 degrees: 0.5 m along and -0.6 m across from its middle.
WITHIN = 0.25 * (tanh(3.2) - tanh(0.8)) * (tanh(-0.8) - tanh(-8.8))
LE = 1.0 - (1.0 - 0.9 * 64.0 ** (-1 / 3)) / (1.0 + 64.0**-1.5 * 8.0)

# name: (what it gets, amplitude and shapes, what it hands on in the middle)
ROWS = {
    "floor_level_error": (geometry(bank=0.0), {"rise": 0.1}, {"bed": 0.1}),
    "bank_level_error": (geometry(bank=1.0), {"rise": 0.1}, {"bed": 0.1}),
    "bed_slope_error": (
        geometry(x=np.array([0.0, 2.0, 4.0, 6.0, 8.0])[:, None, None]),
        {"slope": 0.01},
        {"bed": 0.01 * (8.0 - 4.0)},
    ),
    "cross_slope_error": (geometry(offset=0.5, half_width=3.0), {"slope": 0.02}, {"bed": 0.02 * 1.5}),
    "flank_scour": (geometry(edge=0.8), {"depth": 0.1, "width": 0.4}, {"bed": -0.1 * exp(-1.0)}),
    "patch_deposit": (geometry(planted=1.0), {"rise": 0.1}, {"bed": 0.1}),
    "wake_deposit": (geometry(wake=6.0), {"rise": 0.1, "length": 3.0}, {"bed": 0.1 * exp(-2.0)}),
    "discharge_error": (boundary(), {"relative_error": 0.1}, {"discharge": [[2.2], [1.1]]}),
    "inflow_skew": (boundary(), {"skew": 0.2}, {"spread": [[[0.9], [1.1]]] * 2}),
    "inflow_core": (boundary(), {"excess": 0.4}, {"spread": 1.0 + 0.2 * (1.0 - 0.75)}),
    "inflow_peak": (
        boundary(),
        {"excess": 0.4, "middle": 0.5, "width": 0.5},
        {"spread": [[[1.0 + 0.4 * exp(-4.0)], [1.4]]] * 2},
    ),
    "inflow_distribution": (
        boundary(),
        {"excess": 0.4, "mode": 2.0, "first_other": 0.2, "second_other": 0.6, "third_other": -0.4},
        {
            "spread": [[
                [exp(0.2 * cos(0.25 * k1) + 0.2 * cos(0.5 * k1) + 0.2 * cos(0.75 * k1) - 0.1 * cos(k1))]
                for k1 in (pi, 3.0 * pi)
            ]] * 2
        },
    ),
    "lateral_inflow": (boundary(), {"share": 0.1}, {"lateral": 0.3}),
    "outlet_level_error": (boundary(), {"rise": 0.05}, {"level": 0.95}),
    "streamlining": (plant_cells(), {"vogel_exponent": -1.0, "reference_speed": 0.35}, {"phi": 1.0}),
    "canopy_height_error": (plant_cells(), {"relative_error": 0.2}, {"phi": 2.4, "canopy_height": 0.6}),
    "canopy_deflection": (plant_cells(), {"rate": 1.0}, {"canopy_height": 0.5 * exp(-0.7)}),
    "canopy_bending": (
        plant_cells(),
        {"share": 1.0, "cauchy": 16.0, "buoyancy": 0.0, "reference_speed": 0.35},
        {"phi": 2.0 * LE, "canopy_height": 0.5 * (1.0 - (1.0 - 64.0**-0.25) / (1.0 + 4.0 * 64.0**-0.6 + 8.0 / 4096.0))},
    ),
    "undergrowth": (plant_cells(depth=0.15), {"drag": 3.0, "height": 0.3}, {"phi": 2.0 + 1.5}),
    "foliage": (
        plant_cells(depth=0.25),
        {"drag": 3.0, "vogel_exponent": -1.0, "reference_speed": 0.35},
        {"phi": 2.0 + 3.0 * 0.5 * 0.5},
    ),
    "emergent_part": (plant_cells(depth=0.3), {"share": 0.5}, {"phi": 2.0 * (1.0 - 0.5 * 0.4)}),
    "slow_stems": (plant_cells(speed=0.1), {"share": 1.0, "diameter": 0.01}, {"phi": 2.2}),  # Re = 1000, C_D = 1.1
    "debris_screen": (plant_cells(front=0.5), {"excess": 2.0, "length": 0.5}, {"phi": 2.0 * (1.0 + 2.0 * exp(-1.0))}),
    "density_trend": (plant_cells(front=2.0), {"trend": 0.3, "length": 2.0}, {"phi": 2.0}),
    "edge_thinning": (plant_cells(edge=-0.3), {"share": 0.4, "width": 0.3}, {"phi": 2.0 * (1.0 - 0.4 * exp(-1.0))}),
    "patch_density": (plant_cells(patch=1.0), {"excess": 0.5, "patch": 2.0}, {"phi": 2.0 * 1.5}),
    "depth_dependent_bank": (
        cells(on=geometry(bank=1.0)),
        {"exponent": -1.0, "reference_depth": 0.4},
        {"rate": 0.1 * 0.5},
    ),
    "depth_dependent_bed": (cells(), {"exponent": 2.0, "reference_depth": 0.4}, {"rate": 0.1 * 4.0}),
    "bank_trend": (cells(on=geometry(bank=1.0, share_along=0.25)), {"trend": 2.0}, {"rate": 0.1 * exp(0.5)}),
    "bank_drag_trend": (
        cells(on=geometry(bank=1.0, share_along=-0.25)),
        {"drag": 0.4, "direction": -1.0},
        {"rate": 0.1 + 0.4 * 0.75},
    ),
    "bed_trend": (cells(on=geometry(share_along=-0.25)), {"trend": 2.0}, {"rate": 0.1 * exp(-0.5)}),
    "bank_difference": (cells(on=geometry(bank=1.0, offset=-1.3)), {"log_ratio": 1.0}, {"rate": 0.1 * exp(-0.5)}),
    "bank_roughness": (cells(on=geometry(bank=1.0)), {"log_ratio": 1.5}, {"rate": 0.1 * exp(1.5)}),
    "floor_difference": (cells(on=geometry(offset=0.5)), {"log_ratio": 1.0}, {"rate": 0.1 * exp(0.5)}),
    "bed_stretch": (
        cells(on=geometry(share_along=0.25)),
        {"log_ratio": 1.0, "middle": 0.0, "share": 0.5},
        {"rate": 0.1 * exp(exp(-1.0))},
    ),
    "steep_bank": (cells(on=geometry(side_slope=0.75)), {"share": 1.0}, {"rate": 0.1 * 1.25}),  # 3, 4, 5
    "bank_vegetation": (
        cells(on=geometry(bank=1.0)),
        {"drag": 0.6, "height": 0.3},
        {"rate": 0.1 + 0.6 / (2.0 * 0.8)},
    ),
    "stem_blockage": (cells(on=geometry(planted=1.0)), {"share": 0.5}, {"rate": 0.4}),
    "viscosity": (cells(), {"added": 0.02}, {"viscosity": 0.02}),
    "elder": (cells(u=0.6), {"coefficient": 0.1}, {"viscosity": 0.1 * 0.8 * 0.2 * U}),  # u* = (0.05 0.8)^(1/2) U
    "smagorinsky": (
        cells(u=lambda x, y: 0.3 * x + 0.2 * y, v=lambda x, y: 0.1 * x - 0.4 * y),
        {"coefficient": 0.2},
        {"viscosity": 0.04 * 0.09 * sqrt(2 * 0.09 + 2 * 0.16 + 0.09)},
    ),
    "mixing_length": (cells(u=shear), {"length": 0.5}, {"viscosity": 0.25 * 0.2}),
    "edge_mixing": (
        cells(u=shear, on=geometry(edge=-0.6)),
        {"coefficient": 0.2, "width": 0.6},
        {"viscosity": 0.2 * 0.36 * 0.2 * exp(-1.0)},
    ),
    "coherent_structures": (
        cells(u=shear),
        {"coefficient": 0.1, "width": 2.0, "mean_depth": 0.4},
        {"viscosity": 0.01 * 4.0 * 0.5 * 0.2},
    ),
    "growing_shear_layer": (  # 2.25 m from the inflow, where 2 k = 0.1 1/m
        cells(u=shear),
        {"spreading": 0.2, "rate": 0.05},
        {"viscosity": (0.07 * 0.2 * (1.0 - exp(-0.225)) / 0.1) ** 2 * 0.2},
    ),
    "wake_mixing": (
        cells(u=0.6, on=geometry(wake=5.0)),
        {"coefficient": 0.05, "length": 5.0},
        {"viscosity": 0.05 * exp(-1.0) * U},
    ),
    "secondary_current": (
        cells(u=0.6, on=geometry(offset=0.5)),
        {"strength": 0.02},
        {"xy": 0.02 * sin(pi / 2.0) * exp(-1.0 / 81.0) * 0.8 * 0.36},
    ),
    "dispersion": (
        cells(u=0.6, v=-0.2),
        {"excess": 0.1},
        {"xx": 0.08 * 0.36, "xy": -0.08 * 0.12, "yy": 0.08 * 0.04},
    ),
    # A turn of radius 20 m to the left, at its lowest point: v = u x / R.
    "helical_flow": (
        cells(u=0.6, v=lambda x, y: 0.6 * x / 20.0),
        {"share": 1.0},
        {
            "xx": 0.0,
            "xy": -(5 * HELIX - 15.6 * HELIX**2 + 37.5 * HELIX**3) * 0.8 * 0.36
            * (turn := 0.8 / 20.0 * 0.6**3 / (0.36 + 0.0025) ** 1.5) / sqrt(1.0 + 4.0 * turn**2),
        },
    ),
    "wind": (cells(), {"speed": -10.0}, {"x": -1.3e-3 * 1.2e-3 * 100.0 / 0.8}),
    "panel_current": (
        cells(u=0.6, on=geometry(bank=1.0)),
        {"strength": 0.1, "slope": 0.001, "bank_ratio": -1.0},
        {"x": 0.1 * 9.81 * 0.001 * 0.6 / U, "y": 0.0},
    ),
    "turning_earth": (cells(u=0.6, v=0.2), {"parameter": 1e-4}, {"x": 2e-5, "y": -6e-5}),
    "probe_gain": (reading(), {"gain": 0.05}, {"value": 0.525}),
    "device_gain": (gauge(), {"gain": 0.05}, {"value": 0.5}),
    "zero_offset": (reading(), {"offset": 0.01}, {"value": 0.51}),
    "station_shift": (reading(), {"shift": 0.1}, {"value": 0.54}),
    "partial_depth": (reading(), {"excess": 0.2}, {"value": 0.5 * (1.0 + 0.2 * 0.2 / 0.41)}),
    "among_plants": (reading(canopy_share=0.5), {"gain": 0.2}, {"value": 0.55}),
    "gauge_datum": (gauge(), {"shift": 0.02}, {"value": 0.52}),
    "gauge_head": (gauge(u=0.981), {"share": 1.0}, {"value": 0.5 + 0.981 * 0.981 / 19.62}),
    "unlisted_object": (cells(on=NEAR), {"drag": 2.0, **SPOT}, {"rate": 0.1 + 2.0 * exp(-5.0)}),
    "unlisted_patch": (
        cells(on=NEAR),
        {"drag": 2.0, **SPOT, "angle": 90.0, "height": 0.4, "proportional": 0.0},
        {"rate": 0.1 + WITHIN * ((1.04**-0.5 + log(2.0) / 0.41) ** -2 - (0.04**-0.5 + log(2.0) / 0.41) ** -2) / 0.8},
    ),
    "unlisted_barrier": (
        cells(on=NEAR), {"loss": 2.0, **SPOT}, {"rate": 0.1 + 2.0 * exp(-5.0) / (2.0 * sqrt(pi) * SPOT["length"])}
    ),
    "unlisted_bed": (NEAR, {"rise": 0.2, **SPOT}, {"bed": 0.2 * exp(-5.0)}),
    "unlisted_inflow": (NEAR, {"discharge": 0.2, **SPOT}, {"inflow": 0.2 * exp(-5.0) / (pi * 0.3 * 0.5)}),
    "unlisted_viscosity": (cells(on=NEAR), {"viscosity": 0.02, **SPOT}, {"viscosity": 0.02 * exp(-5.0)}),
}  # fmt: skip


def test_every_effect_has_a_row():
    assert set(ROWS) == {effect.name for effect in SHIPPED}


@pytest.mark.parametrize("name", ROWS)
def test_effect_hands_on_what_its_equation_says(name):
    gets, values, wanted = ROWS[name]
    effect = library()[name]
    assert set(values) == {parameter.name for parameter in effect.parameters}
    found = effect.act(gets, **{key: np.array([value]) for key, value in values.items()})
    for key, number in wanted.items():
        middle = found[key]
        if middle.ndim == 3 and middle.shape[:2] == (5, 5):
            middle = middle[2, 2]
        assert middle == pytest.approx(np.broadcast_to(number, middle.shape), rel=1e-9, abs=1e-15), key


@pytest.mark.parametrize(
    ("name", "elsewhere", "unchanged"),
    [
        ("patch_density", plant_cells(patch=0.0), {"phi": 2.0}),
        ("bank_trend", cells(on=geometry(share_along=0.25)), {"rate": 0.1}),
        ("bank_drag_trend", cells(on=geometry(share_along=-0.25)), {"rate": 0.1}),
        ("bed_trend", cells(on=geometry(bank=1.0, share_along=0.25)), {"rate": 0.1}),
        ("bed_trend", cells(on=geometry(planted=1.0, share_along=0.25)), {"rate": 0.1}),
    ],
)
def test_an_effect_of_a_part_leaves_the_others_alone(name, elsewhere, unchanged):
    values = {key: np.array([value]) for key, value in ROWS[name][1].items()}
    found = library()[name].act(elsewhere, **values)
    assert {key: float(np.ravel(found[key])[0]) for key in unchanged} == pytest.approx(unchanged)


def test_less_than_nothing_pushes_at_a_place_but_mixes_no_less():
    """Drag that is taken away may push, as a jet does; viscosity leaves none, and no less."""
    middle = {"x": 1.6, "y": 2.0, "length": 0.3, "width": 0.5}
    values = {key: np.array([value]) for key, value in middle.items()}
    drag = library()["unlisted_object"].act(cells(on=NEAR), drag=np.array([-2.0]), **values)["rate"]
    added = library()["unlisted_viscosity"].act(cells(on=NEAR), viscosity=np.array([-0.3]), **values)["viscosity"]
    assert drag[2, 2, 0] == pytest.approx(0.1 - 2.0)
    assert added[2, 2, 0] == pytest.approx(-0.01), "what is there already, and no more"


def test_water_that_enters_at_a_place_is_all_the_water():
    """Over a grid that holds the spot, q dx dy sums up to Q."""
    line = 0.05 * np.arange(-100, 101)
    wide = ChannelGeometry(
        **filled(
            ChannelGeometry,
            {"length": 10.05, "dx": 0.05, "dy": 0.05, "filter_width": 0.05, "stretch": 1.0},
            (201, 201, 1),
        )
    )
    wide = replace(wide, x=line[:, None, None], y=line[None, :, None])
    spot = {"x": np.array([0.3]), "y": np.array([-0.2]), "length": np.array([1.1]), "width": np.array([0.4])}
    entering = library()["unlisted_inflow"].act(wide, discharge=np.array([0.7]), **spot)["inflow"]
    assert entering.sum() * 0.05**2 == pytest.approx(0.7, rel=1e-6)


def test_no_instrument_effect_touches_a_discharge():
    through = gauge(level=0.0)
    for name, (_, values, _) in ROWS.items():
        effect = library()[name]
        if effect.stage == "sensor":
            found = effect.act(through, **{key: np.array([value]) for key, value in values.items()})
            assert found["value"] == 0.5, name


def test_partial_depth_of_a_log_law():
    """Means of u = u*/kappa ln(z/z_0) over parts of the depth, by strips, against the shares of its docstring."""
    z = (np.arange(1_000_000) + 0.5) / 1_000_000
    u = np.log(z / 1e-4)
    above, below = u[z > 0.05].mean() - u.mean(), u[z < 0.85].mean() - u.mean()
    assert above == pytest.approx(-0.05 * log(0.05) / 0.95, abs=1e-4)
    assert below == pytest.approx(log(0.85), abs=1e-4)
    assert (round(above, 2), round(below, 2)) == (0.16, -0.16)


def test_blades_stand_until_the_flow_is_strong_and_buoyancy_holds_them_up():
    cauchy = np.geomspace(1e-3, 1e5, 60)
    length, height = bent_blade(cauchy, np.zeros(60))
    buoyed, held = bent_blade(cauchy, np.full(60, 100.0))
    assert (length[cauchy < 0.7] == 1.0).all()
    assert (np.diff(height[cauchy > 1.0]) < 0.0).all()
    assert length[-1] == pytest.approx(0.9 * 1e5 ** (-1 / 3), rel=1e-3)
    assert (held >= height).all()
    assert (buoyed >= length).all()
