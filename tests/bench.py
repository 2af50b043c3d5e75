"""Measured speed of the solver at the paper's scale: `make bench`. States figures, asserts none."""

import cProfile
import os
import platform
import pstats
import time
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from vegglue.config import load_case
from vegglue.march import advance
from vegglue.neighbourhood import leaves
from vegglue.observations import read_observations
from vegglue.prior import sample_prior
from vegglue.problem import build_problem
from vegglue.simulate import begin_at, chunk_size, solve_chunk, unit_places
from vegglue.site import build_site
from vegglue.start import backwater

CONFIG = Path(__file__).parents[1] / "configs" / "d3a.yaml"
PHASES = {
    "residual": "residual",
    "jacobian": "Jacobian, its residuals included",
    "factor": "factorisation",
    "solve": "back-substitution",
    "next_state": "Anderson mixing",
}
PAPER_STEPS = 6000


def main() -> None:
    case = load_case(CONFIG)
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, numpy {np.__version__}")
    step = marching(case)
    member = steady(case)
    print(f"steady state by Newton / {PAPER_STEPS:,} marched steps: {PAPER_STEPS * step / member:.0f} times faster")
    cores(case)


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


def steady(case) -> float:  # type: ignore[no-untyped-def]
    """Seconds a member on one core, in a chunk of the 5,000-member ensemble."""
    site, observations = build_site(case), read_observations(case)
    places = unit_places(case, sample_prior(case.parameters, case.simulate.members, case.simulate.seed))
    chunk = places[leaves(places, chunk_size(len(places)))[7]]
    begin = begin_at(case, site)
    solve_chunk(case, site, observations, chunk[:2], begin)
    profile = cProfile.Profile()
    began = time.perf_counter()
    rows = profile.runcall(solve_chunk, case, site, observations, chunk, begin)
    seconds = time.perf_counter() - began
    print(
        f"steady, 1142 x 40 cells: {len(chunk) / seconds:.1f} members/s on one core, "
        f"{np.median(rows['iterations']):.0f} iterations a member, mass error {rows['mass_error'].max():.0e}, "
        f"{int((rows['status'] == 1).sum())} marched, {int((rows['status'] == 2).sum())} failed"
    )
    calls = {key[2]: (value[1], value[3]) for key, value in pstats.Stats(profile).stats.items() if "vegglue" in key[0]}  # type: ignore[attr-defined]
    for name, words in PHASES.items():
        count, spent = calls[name]
        print(f"  {words}: {count} calls, {100 * spent / seconds:.0f} % of the time")
    return seconds / len(chunk)


def cores(case) -> None:  # type: ignore[no-untyped-def]
    """Speed-up from one to two processes over the same two chunks of the 5,000-member ensemble."""
    site, observations = build_site(case), read_observations(case)
    places = unit_places(case, sample_prior(case.parameters, case.simulate.members, case.simulate.seed))
    chunks = leaves(places, chunk_size(len(places)))[8:10]
    begin = begin_at(case, site)
    members, spent = sum(chunk.size for chunk in chunks), []
    for jobs in (1, 2):
        with Parallel(n_jobs=jobs) as pool:
            pool(delayed(solve_chunk)(case, site, observations, places[chunk[:2]], begin) for chunk in chunks)
            began = time.perf_counter()
            pool(delayed(solve_chunk)(case, site, observations, places[chunk], begin) for chunk in chunks)
            spent.append(time.perf_counter() - began)
    gain = spent[0] / spent[1]
    print(f"{members} members: {spent[0]:.0f} s with one job, {spent[1]:.0f} s with two: {gain:.2f} times faster")


if __name__ == "__main__":
    main()
