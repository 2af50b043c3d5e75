"""Steady states on a reach of the paper's channel: what they conserve, and that every way to them leads to the same."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from channels import GRAVITY, centres, changed, discharge, family, make_problem, planted, river, sloping, solved
from scipy import sparse
from scipy.sparse.linalg import spsolve

from vegglue.case.grid import Grid
from vegglue.diagnosis.effect_contract import mirrored
from vegglue.effects import bed_laws
from vegglue.flow.batch import solve_members
from vegglue.flow.chord import chord
from vegglue.flow.equations import faces, residual
from vegglue.flow.jacobian import factors, jacobian
from vegglue.flow.march import USUAL_FALL_BACK, march, march_to_rest
from vegglue.flow.problem import ACROSS, ALONG, LEVEL, InflowSegment, take
from vegglue.flow.sensor import read_sensors
from vegglue.flow.starts import backwater
from vegglue.flow.status import SOLVED_BY_NEWTON

pytestmark = pytest.mark.slow

CHANCE = np.random.default_rng(3)


def disturbed(state, size):
    """The state with noise on all that is free."""
    noise = size * np.random.default_rng(5).standard_normal(state.shape)
    noise[:, ACROSS, 0] = 0.0
    return state + noise


def flipped(problem):
    """The problem seen in a mirror along its axis."""
    rows = problem.shape[1]
    return changed(
        problem,
        bed=np.ascontiguousarray(problem.bed[:, ::-1]),
        friction_class=np.ascontiguousarray(problem.friction.friction_class[:, ::-1]),
        plants=replace(problem.plants, row=rows - 1 - problem.plants.row),
    )


def test_every_section_carries_the_inflow():
    problem = river()
    error = np.abs(discharge(problem, solved(problem)) / 2.0 - 1.0).max()
    print(f"largest |Q / Q_in - 1|: {error:.1e}")
    assert error < 1e-9


def test_mirrored_channel_has_the_mirrored_residual():
    problem = river()
    state = disturbed(solved(problem), 0.02)
    difference = residual(flipped(problem), mirrored(state)) - mirrored(residual(problem, state))
    assert np.abs(difference).max() < 1e-11


def test_mirrored_channel_has_the_mirrored_flow():
    problem = river()
    difference = np.abs(solved(flipped(problem)) - mirrored(solved(problem))).max()
    print(f"mirror: {difference:.1e}")
    assert difference < 1e-10


def test_a_symmetric_channel_has_a_symmetric_flow():
    problem = river(plants=planted((0, 0), 0.0, 0.0, 0.0))
    state = solved(problem)
    assert np.abs(state - mirrored(state)).max() < 1e-10


def test_marched_is_newtons():
    """25 minutes in half-second steps from the backwater estimate: no further than 1e-8 from the root."""
    problem = river()
    marched = march(problem, backwater(problem), 0.5, 3000)
    difference = np.abs(marched - solved(problem, 1e-11)).max()
    print(f"marched - Newton: {difference:.1e}")
    assert difference < 1e-8


def test_settle_is_newtons():
    problem = river()
    settled = march_to_rest(problem, backwater(problem), 1e-10, USUAL_FALL_BACK)
    assert settled.steady
    assert settled.sentence == ""
    assert settled.state == pytest.approx(solved(problem), abs=1e-9)


def test_the_step_of_time_does_not_matter():
    problem = river()
    start = solved(problem, 1e-11)
    for step in (0.1, 1.0):
        assert np.abs(march(problem, start, step, 100) - start).max() < 1e-9


def test_a_member_alone_is_the_member_in_a_batch():
    """Residual, marching and chord steps, to round-off."""
    points = np.random.default_rng(2).random((7, 2))
    batch = family(points)
    centre = solved(take(batch, np.array([0])))
    start = np.repeat(centre, 7, axis=3)
    shared = factors(take(batch, np.array([0])), centre)
    together = (residual(batch, start), march(batch, start, 0.5, 50), chord(batch, start, shared, 1e-9).state)
    for member in (0, 3, 6):
        one, own = take(batch, np.array([member])), centre  # for a part of `start` loops would be compiled anew
        alone = (residual(one, own), march(one, own, 0.5, 50), chord(one, own, shared, 1e-9).state)
        for all_of_them, by_itself in zip(together, alone, strict=True):
            assert np.abs(all_of_them[..., member] - by_itself[..., 0]).max() < 1e-10


def test_members_do_not_depend_on_their_company():
    """An ensemble and a few of its members asked for alone; both against Newton from a cold start, where it is wet.

    Members are solved in the band of rows that may be wet, without what the film carries beyond (measured 1e-6 m/s).
    """
    points = np.random.default_rng(4).random((36, 2))
    chosen = np.array([1, 17, 35])
    together, few = (solve_members(family(some), some, family, 1e-7) for some in (points, points[chosen]))
    assert (together.status == SOLVED_BY_NEWTON).all()
    assert np.abs(discharge(family(points), together.state) / 2.0 - 1.0).max() < 1e-6
    company = np.abs(together.state[..., chosen] - few.state).max()
    print(f"in company - alone: {company:.1e}")
    assert company < 2e-7
    for member, point in enumerate(points[chosen]):
        exact = solved(family(point))[..., 0]
        wet = exact[:, LEVEL] > family(point).bed
        difference = np.abs(few.state[..., member] - exact)
        print(f"from Newton: {difference[:, LEVEL][wet].max():.1e} m, {difference[:, ALONG][wet].max():.1e} m/s")
        assert difference[:, LEVEL][wet].max() < 5e-6
        assert difference[:, ALONG][wet].max() < 2e-5


def readings(problem, state):
    grid = Grid(centres(30.0, 60), centres(9.0, 24) - 4.5, 0.5, 0.375)
    x, y = (part.ravel() for part in np.meshgrid([8.0, 14.0, 22.0], np.linspace(-2.5, 2.5, 11)))
    station = pd.DataFrame({"kind": "velocity", "x": x, "y": y})
    station.loc[::11, "kind"] = "level"
    return read_sensors(problem, state, grid, station, (("middle", 14.0),)).prediction


def blocks(problem, state):
    """Columns and far diagonal of the Jacobian."""
    found = jacobian(problem, state)
    return found.columns, found.far


def in_double_precision(problem, state):
    """Newton with a general sparse solver in double precision: nothing of the blocks but the entries of J."""
    nx, _, ny, _ = state.shape
    size = 3 * ny
    for _ in range(12):
        columns, far = (part.astype(np.float64) for part in blocks(problem, state))
        whole = sparse.block_diag([columns[i, 1] for i in range(nx)], format="lil")
        for i in range(1, nx):
            whole[i * size : (i + 1) * size, (i - 1) * size : i * size] = columns[i, 0]
            whole[(i - 1) * size : i * size, i * size : (i + 1) * size] = columns[i - 1, 2]
        whole.setdiag(far[2:].ravel(), -2 * size)
        step = spsolve(whole.tocsc(), residual(problem, state).ravel()).reshape(state.shape)
        state = state - step
        if np.abs(step).max() < 1e-13:
            return state
    raise AssertionError(f"still moving by {np.abs(step).max():.1e}")


def test_single_precision_factors_give_the_same_observations():
    """The residual, in double precision, decides; the factors, in single precision, only lead there."""
    problem = family(0.5 + 0.2 * (np.random.default_rng(6).random((5, 2)) - 0.5))
    centre = take(problem, np.array([0]))
    start = solved(centre, 1e-8)
    shared = factors(centre, start)
    assert shared.inverse.columns.dtype == np.float32
    solution = chord(problem, np.repeat(start, 5, axis=3), shared, 1e-8)
    assert solution.converged.all()
    read = readings(problem, solution.state)
    for member in (1, 4):
        one = take(problem, np.array([member]))
        exact = readings(one, in_double_precision(one, solution.state[..., member : member + 1]))[0]
        difference = np.abs(read[member] - exact).max()
        print(f"single - double precision at the observations: {difference:.1e} m/s or m")
        assert difference < 1e-7


def times(columns, far, vector):
    """J vector from its blocks: columns i - 1, i, i + 1 and the diagonal of i - 2."""
    product = np.einsum("ire,ie->ir", columns[:, 1], vector)
    product[1:] += np.einsum("ire,ie->ir", columns[1:, 0], vector[:-1])
    product[:-1] += np.einsum("ire,ie->ir", columns[:-1, 2], vector[1:])
    product[2:] += far[2:] * vector[:-2]
    return product


def compare_jacobian(problem, state):
    """|J d - dR| over |J| |d|, row by row, for random directions d and central differences dR; (nx, n)."""
    nx, _, ny, _ = state.shape
    columns, far = blocks(problem, state)
    worst = np.zeros((nx, 3 * ny))
    for _ in range(3):
        direction = CHANCE.standard_normal(state.shape)
        direction[:, ACROSS, 0] = 0.0
        step = 1e-6 * direction
        change = (residual(problem, state + step) - residual(problem, state - step)).reshape(nx, 3 * ny) / 2e-6
        vector = direction.reshape(nx, 3 * ny)
        size = times(np.abs(columns), np.abs(far), np.abs(vector)) + 1e-12
        worst = np.maximum(worst, np.abs(times(columns, far, vector) - change) / size)
    return worst


def test_jacobian_is_the_derivative_of_the_residual():
    """In deep water with currents both ways across: every row."""
    bed = 0.05 * np.sin(np.arange(20))[:, None] * np.cos(np.arange(8))[None]
    problem = make_problem(bed, (0.5, 0.4), 2.0, 1.0, (bed_laws.MANNING, 0.05), viscosity=np.array([0.02]))
    problem = changed(problem, inflows=(replace(problem.boundaries.inflows[0], by_conveyance=False),))
    worst = compare_jacobian(problem, disturbed(solved(problem), 0.01))
    print(f"J against differences, deep water: {worst.max():.1e} of the row's size")
    assert worst.max() < 5e-5


def test_jacobian_holds_over_dry_banks():
    """With banks, plants, the film and an inflow shared by depth, which ties all rows of the first column together.

    Half of the rows to 1e-7, the worst, in the film, to a percent.
    """
    problem = river()
    worst = compare_jacobian(problem, solved(problem))
    print(f"J over dry banks: median {np.median(worst):.1e}, worst {worst.max():.1e}")
    assert np.median(worst) < 1e-6
    assert worst.max() < 1e-2


def test_factors_undo_the_jacobian():
    """To single precision: three digits of the worst of 4,320 entries."""
    problem = river()
    state = solved(problem)
    vector = CHANCE.standard_normal(state.shape)
    product = times(*blocks(problem, state), vector.reshape(60, 72)).reshape(state.shape)
    error = np.abs(factors(problem, state).solve(product) - vector)
    print(f"J^-1 J: worst {error.max():.1e}, median {np.median(error):.1e}")
    assert error.max() < 2e-2
    assert np.median(error) < 1e-4


def on_dry_land(problem, state):
    """Largest share of a section's discharge between cells that both lie above the water."""
    dry = problem.bed > state[:, LEVEL, :, 0]
    now = faces(problem, state)
    flux = np.abs(now.flux_x[1:-1, :, 0]) * (dry[1:] & dry[:-1])
    return float(flux.sum(axis=1).max() * problem.dy / 2.0)


@pytest.mark.parametrize("film", [0.01, 0.002])
def test_the_film_carries_next_to_nothing(film):
    """Of 2 m3/s through a channel a third dry: measured 5e-6 (film of 1 cm) and 4e-7 (2 mm)."""
    problem = river(film=film)
    state = solved(problem)
    assert (problem.bed > state[:, LEVEL, :, 0]).mean() > 0.3
    share = on_dry_land(problem, state)
    print(f"film {film} m: {share:.1e} of the discharge on dry land")
    assert share < 1e-5


def test_the_film_hardly_moves_the_flow():
    """A film of 2 mm against one of 0.5 mm: velocity within 1 mm/s where the water is deeper than 10 cm."""
    thin, thick = river(film=0.0005), river(film=0.002)
    one, other = solved(thin), solved(thick)
    deep = one[:, LEVEL, :, 0] - thin.bed > 0.1
    difference = np.abs(one - other)[:, ALONG, :, 0][deep].max()
    print(f"film: {difference:.1e} m/s, {np.abs(one - other)[:, LEVEL].max():.1e} m")
    assert difference < 1e-3


def joined():
    """A flat rectangular channel joined by inflows from both banks."""
    sides = (
        InflowSegment("west", 0, 8, np.array([1.0]), by_conveyance=False),
        InflowSegment("south", 20, 28, np.array([0.5]), by_conveyance=False),
        InflowSegment("north", 30, 34, np.array([0.25]), by_conveyance=False),
    )
    changes = {"inflows": sides, "viscosity": np.array([0.02])}
    return make_problem(sloping(30.0, 60, 8, 0.0005), (0.5, 0.5), 1.0, 0.6, (bed_laws.MANNING, 0.03), **changes)


def test_side_inflows_conserve_mass():
    problem = joined()
    state = solved(problem)
    flow = discharge(problem, state)[:, 0]
    assert flow[:21] == pytest.approx(1.0, rel=1e-9)
    assert flow[28:31] == pytest.approx(1.5, rel=1e-9)
    assert flow[34:] == pytest.approx(1.75, rel=1e-9)
    assert np.diff(flow)[20:28] == pytest.approx(0.5 / 8, rel=1e-9)
    assert shown(problem, state).mass_error[0] < 1e-9


def shown(problem, state):
    """What `read_sensors` tells of the joined channel."""
    station, grid = pd.DataFrame({"kind": [], "x": [], "y": []}), Grid(centres(30.0, 60), centres(4.0, 8), 0.5, 0.5)
    return read_sensors(problem, state, grid, station, ())


@pytest.mark.parametrize("west", [1.0, 0.0])
def test_water_that_enters_unevenly_is_no_error_of_mass(west):
    """By conveyance more of it enters where it is deeper; west 0: nothing comes from the west end."""
    problem = joined()
    humps = 0.1 * np.sin(2.0 * np.pi * centres(30.0, 60) / 3.0)[:, None]
    sides = tuple(
        replace(one, by_conveyance=True, discharge=one.discharge * (west if one.side == "west" else 1.0))
        for one in problem.boundaries.inflows
        if west or one.side != "west"
    )
    problem = replace(problem, bed=problem.bed + humps, boundaries=replace(problem.boundaries, inflows=sides))
    state = solved(problem)
    gained = np.diff(discharge(problem, state)[:, 0])[20:28]
    assert gained.max() > 1.2 * gained.min()
    assert shown(problem, state).mass_error[0] < 1e-8


def test_inflow_is_spread_by_conveyance():
    """q is proportional to h^(5/3) across the inflow, and the whole of it is the discharge."""
    problem = river()
    now = faces(problem, solved(problem))
    share = now.cell[0] ** (5.0 / 3.0)
    assert now.flux_x[0] == pytest.approx(2.0 * share / (share.sum() * 0.375), rel=1e-9)


def test_side_inflow_pushes_the_main_flow_aside():
    """Where the south joins, water moves north everywhere but beside the far wall."""
    problem = joined()
    v = faces(problem, solved(problem)).v[20:28, :, 0]
    assert (v[:, :-2] > 0.0).all()
    assert v[:, 0] * 0.5 * 8 == pytest.approx(0.5 / faces(problem, solved(problem)).face_y[20:28, 0, 0], rel=1e-6)


@pytest.mark.parametrize(("side", "along"), [("south", 0.0), ("south", 1.0), ("north", 2.0)])
def test_side_inflow_brings_only_its_own_momentum_along(side, along):
    """Q^2/A + g A h/2 grows through a smooth junction by q v_in cot(angle) alone, within 2 % of what the flow takes up.

    Water that joined at the speed of the flow would leave all of it out.
    """
    sides = (
        InflowSegment("west", 0, 4, np.array([1.0])),
        InflowSegment(side, 30, 40, np.array([0.5]), by_conveyance=False, along=along),
    )
    changes = {"inflows": sides, "viscosity": np.array([0.2]), "film": 0.001}
    problem = make_problem(np.zeros((80, 4)), (0.5, 0.5), 1.0, 1.0, (bed_laws.CHEZY, 5e3), **changes)
    now = faces(problem, solved(problem))
    pushed = (now.flux_x * now.u + 0.5 * 9.81 * now.face_x**2).sum(axis=1)[:, 0] * 0.5
    taken = (now.flux_x * now.u).sum(axis=1)[:, 0] * 0.5
    v_in = 0.5 / (5.0 * now.cell[30:40, 0 if side == "south" else -1, 0].mean())
    assert pushed[60] - pushed[20] == pytest.approx(0.5 * v_in * along, abs=0.02 * (taken[60] - taken[20]))


def over(profile):
    """3 m3/s through a rectangular channel 6 m wide and 30 m long, 0.5 m deep at its outlet."""
    bed, changes = np.repeat(profile[:, None], 4, axis=1), {"viscosity": np.array([0.01]), "film": 0.002}
    return make_problem(bed, (0.5, 1.5), 3.0, 0.44, (bed_laws.MANNING, 0.03), **changes)


def weir(height):
    """A parabolic sill 4 m long."""
    x = centres(30.0, 60)
    return over(height * np.maximum(1.0 - ((x - 15.0) / 2.0) ** 2, 0.0) - 0.002 * x)


@pytest.mark.parametrize("height", [0.16, 0.20, 0.30])
def test_water_shoots_over_a_sill(height):
    """Froude numbers up to 3 behind the crest: steady, conservative, and the sill chokes the flow as it should.

    The energy head above is the crest's 3/2 h_c (and what friction takes), within 6 % on cells of h_c 1.7.
    """
    problem = weir(height)
    state = solved(problem, 1e-8)
    now = faces(problem, state)
    froude = np.abs(now.u[1:]) / np.sqrt(GRAVITY * now.cell)
    assert froude.max() > 1.5
    assert now.cell.min() > 0.0
    assert discharge(problem, state) == pytest.approx(3.0, rel=1e-9)
    head = state[25, LEVEL, 0, 0] + now.u[25, 0, 0] ** 2 / (2.0 * GRAVITY)
    crest = height - 0.03 + 1.5 * (0.5**2 / GRAVITY) ** (1.0 / 3.0)
    print(f"sill {height} m: Froude {froude.max():.2f}, head {head:.3f} m, crest {crest:.3f} m")
    assert head == pytest.approx(crest, rel=0.06)


def test_marching_settles_over_a_sill_too():
    problem = weir(0.2)
    settled = march_to_rest(problem, backwater(problem), 1e-9, USUAL_FALL_BACK)
    assert settled.steady
    assert settled.state == pytest.approx(solved(problem, 1e-9), abs=1e-7)


def test_a_flow_without_steady_state_claims_none():
    """A free fall of 0.4 m from a step: no steady state is claimed, and a sentence says what happened."""
    x = centres(30.0, 60)
    problem = over(0.4 * (x < 15.0) - 0.002 * x)
    settled = march_to_rest(problem, backwater(problem), 1e-8, USUAL_FALL_BACK)
    assert not settled.steady
    assert "600 s" in settled.sentence
