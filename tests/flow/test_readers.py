"""Every kind of observation read off a flow: against its fields, and its weights against differences of the reading."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from channels import centres, even_geometry, river, solved

from vegglue.case.grid import Grid
from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.library import library
from vegglue.errors import InputError
from vegglue.flow.closures import bent_plants, closures
from vegglue.flow.equations import faces
from vegglue.flow.problem import ACROSS, ALONG, LEVEL, Problem, take
from vegglue.flow.sensor import nearest_face, read_sensors, reading_weights
from vegglue.measurements.kinds import KINDS

CELLS = (30, 24)
# At centres of cells and between them, in the water beside and among the plants, and on a bank that is partly dry.
X, Y = np.array([3.5, 14.0, 15.5, 29.7, 7.77]), np.array([4.6875, 5.2, 5.8, 4.4, 2.1])
STEP = 1e-5


@pytest.fixture(scope="module")
def flowing() -> tuple[Problem, np.ndarray, Grid]:
    problem = river(CELLS)
    grid = Grid(centres(30.0, CELLS[0]), centres(9.0, CELLS[1]), problem.dx, problem.dy)
    return problem, solved(problem, 1e-9), grid


def stations(kind: str) -> pd.DataFrame:
    return pd.DataFrame({"kind": kind, "x": X, "y": Y, "section": "A", "device": "p"})


def read(flowing: tuple[Problem, np.ndarray, Grid], kind: str) -> np.ndarray:
    return read_sensors(*flowing, stations(kind), ()).prediction[0]


def test_at_a_cell_centre_the_reading_is_the_cell(flowing) -> None:
    problem, state, grid = flowing
    now, i, j = faces(problem, state), 3, 12
    assert (grid.x[i], grid.y[j]) == (X[0], Y[0])
    u, v = 0.5 * (now.u[i, j, 0] + now.u[i + 1, j, 0]), 0.5 * (now.v[i, j, 0] + now.v[i, j + 1, 0])
    wanted = {"velocity": u, "velocity_across": v, "speed": np.hypot(u, v), "level": now.level[i, j, 0]}
    assert {kind: read(flowing, kind)[0] for kind in wanted} == pytest.approx(wanted, rel=1e-12)
    assert abs(v) > 1e-5


def test_a_field_that_is_linear_is_read_exactly_between_centres(flowing) -> None:
    problem, _, grid = flowing
    state = np.zeros((CELLS[0], 3, CELLS[1], 1))
    south = (np.arange(CELLS[1]) * problem.dy)[None]  # y of the faces on which v stands
    state[:, ACROSS, :, 0] = 0.1 * south
    state[:, LEVEL, :, 0] = 1.0 + 0.01 * grid.x[:, None] + 0.02 * grid.y[None]
    assert read((problem, state, grid), "velocity_across") == pytest.approx(0.1 * Y)
    assert read((problem, state, grid), "level") == pytest.approx(1.0 + 0.01 * np.minimum(X, grid.x[-1]) + 0.02 * Y)


def test_three_readings_of_one_probe_agree(flowing) -> None:
    u, v, speed = (read(flowing, kind) for kind in ("velocity", "velocity_across", "speed"))
    assert speed == pytest.approx(np.hypot(u, v), rel=1e-14)
    assert np.ptp(v) > 0.01


def test_discharge_is_what_passes_the_nearest_face(flowing) -> None:
    problem, state, grid = flowing
    now = faces(problem, state)
    flux = [(now.face_x[face] * now.u[face]).sum() * problem.dy for face in (3, 14, 15, 30, 8)]
    assert read(flowing, "discharge") == pytest.approx(flux, rel=1e-12)
    assert flux == pytest.approx([2.0] * 5, rel=1e-6)
    assert [nearest_face(grid, x) for x in (-5.0, 0.4, 0.6, 30.0, 99.0)] == [0, 0, 1, 30, 30]


@pytest.mark.parametrize("lifted", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_weights_are_the_derivative_of_the_reading(flowing, kind: str, lifted: bool) -> None:
    problem, state, grid = flowing
    if lifted:
        problem = replace(problem, bed_rise=0.05 * np.cos(np.arange(24))[None, :, None] * np.ones((30, 1, 1)))
    direction = np.random.default_rng(3).standard_normal((*state.shape[:3], 8))
    direction[:, ACROSS, 0] = 0.0
    weights = reading_weights(problem, state, grid, stations(kind))
    many = take(problem, np.zeros(8, dtype=np.int64))
    ahead, behind = (read_sensors(many, state + s * STEP * direction, grid, stations(kind), ()) for s in (1.0, -1.0))
    found = (ahead.prediction - behind.prediction).T / (2.0 * STEP)
    told = np.einsum("ikjn,ikjp->np", weights, direction)
    assert np.abs(told - found).max() < 1e-6 * np.abs(found).max()
    assert np.abs(found).max(axis=1).min() > 1e-3


def test_beside_the_inflow_a_velocity_answers_to_the_face_ahead_alone(flowing) -> None:
    """The one behind is set by the inflow; it counted as the one ahead, so that all answers were twice as large."""
    problem, state, grid = flowing
    first = stations("velocity").assign(x=0.2)
    direction = np.zeros((*state.shape[:3], 1))
    direction[0, ALONG] = 1.0
    ahead, behind = (read_sensors(problem, state + s * STEP * direction, grid, first, ()) for s in (1.0, -1.0))
    found = (ahead.prediction - behind.prediction)[0] / (2.0 * STEP)
    told = np.einsum("ikjn,ikjp->np", reading_weights(problem, state, grid, first), direction)[:, 0]
    np.testing.assert_allclose(told, found, rtol=1e-6)
    assert found == pytest.approx(0.5)


def test_at_rest_a_speed_answers_to_nothing(flowing) -> None:
    problem, state, grid = flowing
    still = np.zeros_like(state)
    still[:, LEVEL] = 0.9
    dry = stations("speed").assign(x=15.0, y=0.2)
    assert reading_weights(problem, still, grid, dry).max() == 0.0
    assert read_sensors(problem, still, grid, dry, ()).prediction.max() == 0.0


def test_an_unknown_kind_is_refused_and_not_read_as_a_level(flowing) -> None:
    for reading in (read_sensors, reading_weights):
        with pytest.raises(InputError, match="temperature"):
            reading(*flowing, stations("temperature"), *([()] if reading is read_sensors else []))


def shown(flowing, name: str, **values: float) -> dict[str, np.ndarray]:
    """What an effect adds to the readings of each kind."""
    problem, state, grid = flowing
    effect = ActiveEffect(library()[name], {key: np.array([value]) for key, value in values.items()})
    changed = replace(problem, effects=(effect,))
    return {kind: read((changed, state, grid), kind) - read(flowing, kind) for kind in KINDS}


def test_a_gain_acts_on_velocities_of_every_direction(flowing) -> None:
    change = shown(flowing, "probe_gain", gain=0.1)
    for kind in ("velocity", "velocity_across", "speed"):
        assert change[kind] == pytest.approx(0.1 * read(flowing, kind))
    assert not change["level"].any()
    assert not change["discharge"].any()


def test_probes_among_plants_stand_among_what_is_left_of_them_upright(flowing) -> None:
    """They saw the canopy of the config, however far the flow had bent it."""
    problem, state, grid = flowing
    column, row = problem.plants.column, problem.plants.row
    geometry = even_geometry(problem.bed, problem.friction.friction_class, (problem.dx, problem.dy))
    bending = ActiveEffect(library()["canopy_deflection"], {"rate": np.array([3.0])})
    among = ActiveEffect(library()["among_plants"], {"gain": np.array([0.5])})
    bent, both = (replace(problem, effects=effects, geometry=geometry) for effects in ((bending,), (bending, among)))
    there = pd.DataFrame(
        {"kind": ["velocity"], "x": grid.x[column[:1]], "y": grid.y[row[:1]], "section": "A", "device": "p"}
    )
    plain, seen = (read_sensors(one, state, grid, there, ()).prediction[0, 0] for one in (bent, both))
    depth = faces(problem, state).cell
    height = bent_plants(bent, state, depth)[1][0, 0]
    assert height < 0.6 * problem.plants.canopy_height[0, 0]
    share = min(height / depth[column[0], row[0], 0], 1.0)
    assert seen / plain == pytest.approx(1.0 + 0.5 * share, rel=0.05)


def test_two_places_that_mix_less_leave_no_negative_viscosity(flowing) -> None:
    problem, state, _ = flowing
    geometry = even_geometry(problem.bed, problem.friction.friction_class, (problem.dx, problem.dy))
    values = {"viscosity": -0.4, "x": 15.0, "y": 0.0, "length": 2.0, "width": 1.0}
    hole = ActiveEffect(library()["unlisted_viscosity"], {name: np.array([value]) for name, value in values.items()})
    two = replace(problem, effects=(hole, hole), geometry=geometry)
    least = closures(two, state, faces(problem, state).cell).viscosity.min()
    assert least == 0.0


def test_a_probe_beside_its_place_reads_what_flows_there(flowing) -> None:
    problem, state, grid = flowing
    inside = (slice(1, 3),)  # where fields are smooth to either side
    change = shown(flowing, "station_shift", shift=0.01)
    for kind in ("velocity", "velocity_across", "speed"):
        sides = [
            read_sensors(problem, state, grid, stations(kind).assign(y=Y + d), ()).prediction[0]
            for d in (-0.375, 0.375)
        ]
        assert change[kind][inside] == pytest.approx(0.01 * (sides[1] - sides[0])[inside] / 0.75, rel=1e-3, abs=1e-6), (
            kind
        )


def test_gauges_alone_stand_on_another_datum(flowing) -> None:
    change = shown(flowing, "gauge_datum", shift=0.02)
    assert change.pop("level") == pytest.approx(0.02)
    assert not any(values.any() for values in change.values())
