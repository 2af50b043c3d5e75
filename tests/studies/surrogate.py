"""How near a posterior by a surrogate of few runs comes to that of all runs: `python tests/studies/surrogate.py`.

The command is the built-in solver on the brook of docs/own_case.md with other cells, laws or parameters, asleep for a
while in each run. Both posteriors have the same errors; that of all runs draws from the other solver itself.
"""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).parents[1]))
from built_models import model_of
from commands import by_server, served
from reach import write_reach

import vegglue
from vegglue.case.parameter_space import theta_at, z_at
from vegglue.case.schema import Case
from vegglue.engine.interface import Model, linearise, predict
from vegglue.engine.newton import NEWTON
from vegglue.inference import refine as refine_module
from vegglue.inference.refine import refine
from vegglue.measurements.observations import read_observations
from vegglue.parallel import one_thread
from vegglue.progress import silent
from vegglue.results.posterior import Posterior
from vegglue.workflow.command_model import with_command

# Effective draws of both posteriors: with 1,000 of them their own errors are as large as what is looked for.
EFFECTIVE = 4000
TRUE, ASLEEP = {"n_b": 0.05, "phi": 8.0, "k_s": 0.8, "h_d": 0.7, "nu": 0.02}, 0.02
# What the command has other than the built-in solver: text of the case, error of a velocity [m/s], and whether its
# parameters are others: n = n_b (phi / 8)^0.3 and phi^1.5, which no line along the parameters follows.
OTHER: dict[str, tuple[list[tuple[str, str]], float, bool]] = {
    "cells": ([("cell: [1.0, 0.5]", "cell: [1.5, 0.75]")], 0.01, False),
    "laws": (
        [("parameters: ", "numerics: {shear_depth: smallest, bank_argument_minimum: 1.0129, emergent: proportional}\n"
                          "eddy_viscosity: 0.05\nparameters: ")],
        0.03, False,
    ),
    "plants": ([("canopy_height: 0.7}", "canopy_height: 0.5, law: yang-choi}")], 0.03, False),
    "parameters": ([], 0.01, True),
    "few data": ([], 0.04, True),
    "five parameters": (
        [("cell: [1.0, 0.5]", "cell: [1.5, 0.75]"),
         ("parameters: ", "numerics: {shear_depth: smallest, emergent: proportional}\nparameters: ")],
        0.02, False,
    ),
}  # fmt: skip
# Of the brook with five parameters, in both solvers.
FIVE = [
    ("k_s: 0.8}", "k_s: k_s}"), ("canopy_height: 0.7}", "canopy_height: h_d}"),
    ("parameters: ", "eddy_viscosity: nu\nparameters: "),
    ("observations:\n", "  k_s: {distribution: loguniform, low: 0.2, high: 3, unit: m}\n"
                        "  h_d: {distribution: normal, mean: 0.7, sd: 0.08, low: 0.3, high: 1.2, unit: m}\n"
                        "  nu: {distribution: lognormal, median: 0.02, log_sd: 0.69, unit: m2/s}\nobservations:\n"),
]  # fmt: skip


@dataclass(frozen=True)
class Compared:
    """Both posteriors, and what the surrogate's took [s]."""

    surrogate: Posterior
    all_runs: Posterior
    seconds: float

    @property
    def medians(self) -> np.ndarray:
        a, b = self.surrogate.marginals, self.all_runs.marginals
        return np.array([(a.median[name] - b.median[name]) / b.sd[name] for name in b.median])

    @property
    def spreads(self) -> np.ndarray:
        a, b = self.surrogate.marginals, self.all_runs.marginals
        return np.array([a.sd[name] / b.sd[name] - 1.0 for name in b.sd])


def moved(theta: dict[str, np.ndarray], crossed: bool) -> dict[str, np.ndarray]:
    """The parameters of the other solver."""
    if not crossed:
        return theta
    return {"n_b": theta["n_b"] * (theta["phi"] / 8.0) ** 0.3, "phi": 8.0 * (theta["phi"] / 8.0) ** 1.5}


@dataclass
class Brook:
    """The brook with a command, the model that the command solves, at its stations, and runs of it so far."""

    case: Case
    other: Model
    runs: int = 0


@contextmanager
def brook_by_command(folder: Path, kind: str, seed: int, fails_above: float = np.inf) -> Iterator[Brook]:
    """The brook with a command, which fails if phi is above a value [-]."""
    changes, error, crossed = OTHER[kind]
    settings = [
        ("experiment: June}", f"experiment: June, standard_error: {error}}}"),
        ("members: 1024, seed: 7}", f"members: 64, seed: {seed}}}\ninfer: {{sigma: known}}"),
        *(FIVE if kind == "five parameters" else []),
    ]
    (folder / "other").mkdir(parents=True)
    wider = [("low: 0.02, high: 0.10", "low: 0.005, high: 0.4"), ("low: 1, high: 100", "low: 0.1, high: 1000")]
    other_case = vegglue.load_case(write_reach(folder / "other", *settings, *wider, *changes))
    other = model_of(other_case, read_observations(other_case))
    truth = {name: TRUE[name] for name in other_case.parameters}
    middle = linearise(other, z_at(other_case, {name: np.array([value]) for name, value in truth.items()})[0])
    assert middle is not None

    def solved(theta: dict[str, np.ndarray]) -> np.ndarray:
        return predict(other, [middle], z_at(other_case, moved(theta, crossed)))

    def one(theta: dict[str, float]) -> np.ndarray:
        brook.runs += 1
        time.sleep(ASLEEP)
        if theta["phi"] > fails_above:
            raise ValueError("too much")
        found = solved({name: np.array([value]) for name, value in theta.items()})[0]
        if np.isnan(found).any():
            raise ValueError("no flow")
        return found

    config = write_reach(folder, *settings)
    own = vegglue.load_case(config)
    all_runs = replace(NEWTON, predict=lambda model, _, z: solved(theta_at(own, z)))
    brook = Brook(own, replace(other, engine=all_runs))
    # Without two in a section no correlation is estimated: at its limit it is 0 or 0.4, by where a search started.
    table = pd.read_csv(folder / "velocities.csv")
    table["section"] = [f"s{row}" for row in range(len(table))]
    table["u"] = one(truth) + error * np.random.default_rng(seed).standard_normal(len(table))
    table.to_csv(folder / "velocities.csv", index=False)
    with served(one) as port:
        brook.case, brook.runs = by_server(config, port), 0
        yield brook


@one_thread()
def posterior_of_all_runs(brook: Brook, folder: Path) -> Posterior:
    """`refine` with the same errors, whose draws are all flows of the other solver."""
    own = model_of(brook.case, read_observations(brook.case))
    model = with_command(own, folder, silent)
    return refine(None, replace(model, engine=replace(model.engine, predict=brook.other.engine.predict)))


def compare(folder: Path, kind: str, seed: int) -> Compared:
    with brook_by_command(folder, kind, seed) as brook:
        began = time.monotonic()
        found = vegglue.infer(brook.case, runs=folder / "runs", jobs=1)
        seconds = time.monotonic() - began
        return Compared(found, posterior_of_all_runs(brook, folder / "runs" / brook.case.name), seconds)


def main() -> None:
    refine_module.EFFECTIVE_DRAWS = EFFECTIVE
    seeds = range(1, 1 + int(sys.argv[1]) if len(sys.argv) > 1 else 6)
    for kind in sys.argv[2:] or OTHER:
        for seed in seeds:
            with TemporaryDirectory() as folder:
                both = compare(Path(folder), kind, seed)
            one = both.surrogate.surrogate
            assert one is not None
            print(
                f"{kind:12} {seed:3} runs {one.runs:3} failed {one.failed} settled {one.settled} "
                f"medians {np.abs(both.medians).max():.3f} ({one.median_error:.3f}) "
                f"sd {np.abs(both.spreads).max():.3f} ({one.sd_error:.3f}) last {one.last_error:.3f} "
                f"{both.medians.round(3)} {both.spreads.round(3)} "
                f"draws {both.all_runs.sample.members} {both.seconds:.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
