"""Measured speed of the solver at the paper's scale: `make bench`. States figures, asserts none."""

import cProfile
import os
import platform
import pstats
import tempfile
import time
from pathlib import Path

import loop
import memory
import numpy as np
import scale
import startup
import wide
from joblib import Parallel, delayed

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import parameters_at, sample_prior, sobol_points, sobol_sample
from vegglue.flow.batch import MEMBER_SLOTS, solve_members
from vegglue.flow.equations import faces
from vegglue.flow.march import advance, march
from vegglue.flow.parameter_metric import clusters, parameter_metric
from vegglue.flow.problem import crop, take
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.reference_member import settled
from vegglue.flow.sensor import read_sensors
from vegglue.flow.starts import backwater
from vegglue.flow.status import FAILED, SOLVED_BY_MARCHING, SOLVED_BY_NEWTON, members_with
from vegglue.flow.thin_water import eased
from vegglue.flow.wet_band import rows_inside, widen
from vegglue.inference.solve_ensemble import linearised_medians, solve_chunk, solve_ensemble, starts_and_chunks
from vegglue.measurements.observations import read_observations
from vegglue.results.result_files import read_ensemble

CONFIG = Path(__file__).parents[2] / "configs" / "d3a.yaml"
PHASES = {
    "thin_water.eased": "residual of chord steps",
    "jacobian.jacobian": "Jacobian, its residuals included",
    "block_elimination.factor": "factorisation",
    "block_elimination.solve": "back-substitution",
    "anderson.next_state": "Anderson mixing",
    "batch.starts_of": "starts from solved neighbours",
}
PAPER_STEPS = 6000
SAMPLE = 128
SHALLOW = 0.3
# Every so many members of a chunk are solved again, to a correction far below the tolerance [m/s, m].
EVERY, FURTHER = 8, 1e-9
# Marching: looked at every quarter of an hour of flow [min], in steps [s], until it is near [m/s, m] or too long [min].
QUARTER, MARCHED_STEP, NEAR, LONGEST = 15, 1.0, 1e-6, 300


def main() -> None:
    case = load_case(CONFIG)
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, numpy {np.__version__}")
    startup.main()
    step = marching(case)
    member = steady(case)
    print(f"steady state by Newton / {PAPER_STEPS:,} marched steps: {PAPER_STEPS * step / member:.0f} times faster")
    roofline(case)
    same(case)
    exact(case)
    whole(case)
    whole(on_grid(case, (300.0, 471.0), (0.5, 0.375)))
    sizes(case)
    second_core()
    cores(case)
    loop.main()
    scale.spread()
    memory.main()
    with tempfile.TemporaryDirectory() as folder:
        wide.main(Path(folder), None, wide.SMALL)


def marching(case) -> float:  # type: ignore[no-untyped-def]
    """Seconds a member and step, eight members at once."""
    site = build_site(case)
    problem = build_problem(case, site, "D3a", sample_prior(case.parameters, 8, 1))
    state = backwater(problem)
    advance(problem, state, 0.3, 1.0)
    began = time.perf_counter()
    for _ in range(10):
        state = state + advance(problem, state, 0.3, 1.0)
    seconds = (time.perf_counter() - began) / 10 / 8
    print(f"marching, 1142 x 40 cells, 8 members: {site.bed.size / seconds / 1e6:.1f} million cell-steps/s on one core")
    return seconds


def ensemble(case):  # type: ignore[no-untyped-def]
    """Site, measurements and all members."""
    return build_site(case), read_observations(case), sobol_sample(case)


def steady(case) -> float:  # type: ignore[no-untyped-def]
    """Seconds a member on one core, in a chunk of the 5,000-member ensemble."""
    site, observations, sample = ensemble(case)
    start_from, chunks = starts_and_chunks(case, site, sample.points)
    chunk = sample.take(chunks[7])
    solve_chunk(case, site, observations, chunk.take(np.arange(2)), start_from)
    profile = cProfile.Profile()
    began = time.perf_counter()
    rows = profile.runcall(solve_chunk, case, site, observations, chunk, start_from)
    seconds = time.perf_counter() - began
    print(
        f"steady, 1142 x 40 cells: {len(chunk.points) / seconds:.1f} members/s on one core, "
        f"{np.median(rows['iterations']):.0f} iterations a member, mass error {np.nanmax(rows['mass_error']):.0e}, "
        f"{members_with(rows['status'], SOLVED_BY_MARCHING)} marched, {members_with(rows['status'], FAILED)} failed"
    )
    found = pstats.Stats(profile).stats.items()  # type: ignore[attr-defined]
    calls = {f"{Path(file).stem}.{name}": (value[1], value[3]) for (file, _, name), value in found}
    for name, words in PHASES.items():
        count, spent = calls[name]
        print(f"  {words}: {count} calls, {100 * spent / seconds:.0f} % of the time")
    return seconds / len(chunk.points)


def roofline(case) -> None:  # type: ignore[no-untyped-def]
    """A chord step of MEMBER_SLOTS members by flops and bytes, beside what this core and its memory give."""
    problem = build_problem(case, build_site(case), "D3a", sample_prior(case.parameters, MEMBER_SLOTS, 1))
    end = settled(take(problem, np.array([0])), None, 1e-6)
    shared = end.factors
    assert shared is not None
    part, state = crop(problem, *end.band), np.repeat(end.solution.state, MEMBER_SLOTS, axis=3)
    rates = eased(part, state, shared.slope, part.boundaries.outlet)
    residual = shortest(lambda: eased(part, state, shared.slope, part.boundaries.outlet))
    solve = shortest(lambda: shared.step(rates))
    columns = shared.inverse.columns
    nx, _, n, _ = columns.shape
    block, right = np.ones((n, n), np.float32), np.ones((n, MEMBER_SLOTS), np.float32)
    flops, moved = 2.0 * columns.size * MEMBER_SLOTS, columns.nbytes + 3 * nx * right.nbytes
    product = shortest(lambda: [block @ right for _ in range(nx)])
    copied = shortest(lambda: columns.copy())
    print(
        f"a chord step of {MEMBER_SLOTS} members, one core: residual {1e3 * residual:.0f} ms, "
        f"{residual / rates.size * 3e9:.0f} ns a cell and member; solve {1e3 * solve:.0f} ms, "
        f"{flops / solve / 1e9:.0f} Gflop/s (products of its size in cache: {flops / 3 / product / 1e9:.0f}), "
        f"{moved / solve / 1e9:.1f} GB/s (a copy of its factors: {2 * columns.nbytes / copied / 1e9:.1f})"
    )


def shortest(work) -> float:  # type: ignore[no-untyped-def]
    """Least seconds of five times."""
    spent = []
    for _ in range(5):
        began = time.perf_counter()
        work()
        spent.append(time.perf_counter() - began)
    return min(spent)


def sizes(case) -> None:  # type: ignore[no-untyped-def]
    """Seconds a member in one process, SAMPLE neighbours in the middle of the prior, on other cells and reaches."""
    along = [on_grid(case, (471.0 - length, 471.0), (0.5, 0.375)) for length in (171.0, 684.0, 2736.0)]
    both = [on_grid(case, (300.0, 471.0), cell) for cell in ((1.0, 0.75), (0.5, 0.375), (0.25, 0.1875))]
    for words, cases in (("longer", along), ("refined both ways", both)):
        cells, seconds = np.array([timed(one) for one in cases]).T
        for number, spent in zip(cells, seconds, strict=True):
            print(f"{words}: {number:,.0f} cells, {1 / spent:.1f} members/s on one core")
        power = np.polyfit(np.log(cells), np.log(seconds), 1)[0]
        print(f"  cost grows with cells^{power:.2f} over a factor of {cells[-1] / cells[0]:.0f}")
    for cell in ((1.0, 0.75), (0.25, 0.1875)):
        number, spent = timed(on_grid(case, (0.0, 571.0), cell))
        print(f"the paper's channel on cells of {cell[0]} x {cell[1]} m ({number:,} cells): {1 / spent:.1f} members/s")


def on_grid(case, x: tuple[float, float], cell: tuple[float, float]):  # type: ignore[no-untyped-def]
    """A case on part of its channel, with the depth it has at its end, and on other cells."""
    shorter = float(np.ptp(case.grid.x) - np.ptp(x))
    rise = case.bed[0].trapezoid.bed_slope * shorter  # the floor is at one level at the start of any grid
    experiments = {name: one.model_copy(update={"level": one.level + rise}) for name, one in case.experiments.items()}
    grid = case.grid.model_copy(update={"x": x, "cell": cell})
    return case.model_copy(update={"grid": grid, "experiments": experiments})


def timed(case) -> tuple[int, float]:  # type: ignore[no-untyped-def]
    """Cells, and seconds a member on one core."""
    site, observations, sample = ensemble(case)
    start_from = linearised_medians(case, site)
    slopes = [one.slopes for one in start_from.values() if one is not None]
    around = [sample.take(some) for some in clusters(parameter_metric(sample.points, slopes).coordinates, SAMPLE)]
    chunk = min(around, key=lambda some: np.linalg.norm(some.points.mean(axis=0) - 0.5))
    solve_chunk(case, site, observations, chunk.take(np.arange(2)), start_from)
    began = time.perf_counter()
    rows = solve_chunk(case, site, observations, chunk, start_from)
    seconds = time.perf_counter() - began
    if (rows["status"] != SOLVED_BY_NEWTON).any():
        marched, failed = (members_with(rows["status"], number) for number in (SOLVED_BY_MARCHING, FAILED))
        print(f"  {marched} marched, {failed} failed")
    return site.bed.size, seconds / len(chunk.points)


def whole(case) -> None:  # type: ignore[no-untyped-def]
    """All members of an ensemble, over all cores, into a file."""
    with tempfile.TemporaryDirectory() as folder:
        path, began = Path(folder) / "ensemble.h5", time.perf_counter()
        solve_ensemble(case, read_observations(case), path, -1, lambda _: None)
        seconds, found = time.perf_counter() - began, read_ensemble(path)
    nx, ny = build_site(case).bed.shape
    print(
        f"{found.status.size:,} members on {nx} x {ny} cells, all cores: {seconds:.0f} s, "
        f"{found.iterations.mean():.1f} steps a member, mass error {np.nanmax(found.mass_error):.0e}, "
        f"{members_with(found.status, SOLVED_BY_MARCHING)} marched, {members_with(found.status, FAILED)} failed"
    )


def same(case) -> None:  # type: ignore[no-untyped-def]
    """64 members spread over the priors: by chord steps in an ensemble, by Newton alone, and marched."""
    short = on_grid(case, (300.0, 471.0), (0.5, 0.375))
    site = build_site(short)
    points = sobol_points(len(short.parameters), 64, 1)

    def build(some):  # type: ignore[no-untyped-def]
        return build_problem(short, site, "D3a", parameters_at(short, some))

    solved = solve_members(build(points), points, build, 1e-8)
    tasks = [(build(point[None]), solved.state[..., i : i + 1]) for i, point in enumerate(points)]
    found = Parallel(n_jobs=-1)(delayed(three_ways)(*task) for task in tasks)
    apart, left, minutes = (np.array(each) for each in zip(*found, strict=True))
    print(
        f"64 members over the priors, 342 x 40 cells: marched from a backwater estimate they come within "
        f"{left.max():.0e} m/s or m of Newton, the median in {np.median(minutes):.0f} min of flow, the slowest in "
        f"{minutes.max():.0f} (in the rows that are solved); ensemble and single member differ by at most "
        f"{apart.max():.0e} where water is deeper than "
        f"{SHALLOW:g} m (rows beyond the water differ)"
    )


def three_ways(problem, start):  # type: ignore[no-untyped-def]
    """How far a member of an ensemble, and one marched, are from Newton's; minutes of flow it was marched."""
    end = settled(problem, start, 1e-9)
    alone, band = end.solution, end.band
    part = crop(problem, *band)
    wet = faces(part, alone.state).cell[:, None] > SHALLOW
    apart = np.abs(rows_inside(start, band) - alone.state)[np.broadcast_to(wet, alone.state.shape)].max()
    state, left, minutes = rows_inside(backwater(problem), band), np.inf, 0
    while left > NEAR and minutes < LONGEST:
        state, minutes = march(part, state, MARCHED_STEP, int(QUARTER * 60.0 / MARCHED_STEP)), minutes + QUARTER
        left = np.abs(state - alone.state).max()
    return apart, left, minutes


def exact(case) -> None:  # type: ignore[no-untyped-def]
    """Predictions of a chunk of the 5,000 members beside those of the same members by Newton, each alone."""
    site, observations, sample = ensemble(case)
    start_from, chunks = starts_and_chunks(case, site, sample.points)
    chunk = sample.take(chunks[7])
    rows = solve_chunk(case, site, observations, chunk, start_from)
    apart = []
    for member in range(0, len(chunk.points), EVERY):
        one = chunk.take(np.array([member]))
        for experiment in case.experiments:
            problem = build_problem(case, site, experiment, one.theta)
            end = settled(problem, start_from[experiment].predict(one.points), FURTHER)
            assert end.factors is not None
            here = (observations.table["experiment"] == experiment).to_numpy()
            state = widen(end.solution.state, problem.shape[1], end.band)
            prediction = read_sensors(problem, state, site.grid, observations.table[here], ()).prediction[0]
            apart.append(np.abs(rows["prediction"][member, here] - prediction).max())
    print(
        f"predictions of {len(apart)} members of a chunk, 1142 x 40 cells: within {max(apart):.1e} m/s of Newton's to "
        f"{FURTHER:g}, the median within {np.median(apart):.0e}; mass error {np.nanmax(rows['mass_error']):.1e}"
    )


def cores(case) -> None:  # type: ignore[no-untyped-def]
    """Speed-up from one to two processes over the same two chunks of the 5,000-member ensemble."""
    site, observations, sample = ensemble(case)
    start_from, chunks = starts_and_chunks(case, site, sample.points)
    chunks = chunks[8:10]
    members, spent = sum(chunk.size for chunk in chunks), []
    for jobs in (1, 2):
        with Parallel(n_jobs=jobs) as pool:
            pool(delayed(solve_chunk)(case, site, observations, sample.take(chunk[:2]), start_from) for chunk in chunks)
            began = time.perf_counter()
            pool(delayed(solve_chunk)(case, site, observations, sample.take(chunk), start_from) for chunk in chunks)
            spent.append(time.perf_counter() - began)
    gain = spent[0] / spent[1]
    print(f"{members} members: {spent[0]:.0f} s with one job, {spent[1]:.0f} s with two: {gain:.2f} times faster")


def second_core() -> None:
    """What a second process adds on this machine at most: to products in cache, and to sums through memory."""
    gains = []
    with Parallel(n_jobs=2) as pool:
        for work in (products_in_cache, sums_through_memory):
            pool(delayed(work)() for _ in range(2))
            alone = shortest(lambda: pool([delayed(work)()]))  # noqa: B023
            gains.append(2.0 * alone / shortest(lambda: pool(delayed(work)() for _ in range(2))))  # noqa: B023
    print(
        f"a second process: {gains[0]:.2f} times as many products in cache, {gains[1]:.2f} times as many sums in memory"
    )


def products_in_cache() -> None:
    block = np.ones((96, 96))
    for _ in range(10_000):
        block @ block


def sums_through_memory() -> None:
    values = np.ones(4_000_000)
    total = values.copy()
    for _ in range(100):
        np.add(values, 1.0, out=total)


if __name__ == "__main__":
    main()
