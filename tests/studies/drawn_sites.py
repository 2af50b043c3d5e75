"""Sites of the second solver with something hidden that a seed decides: what is kept back until a method stands.

    python tests/studies/drawn_sites.py FOLDER FIRST COUNT

Writes FOLDER/site-SEED for COUNT seeds from FIRST on, as `sites` does: every kind that the open cases have in turn, at
sizes drawn from ranges about theirs, every other site with small imperfections.
"""

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from sites import EXPERIMENTS, GAUGES, STATIONS, make_set

Settings = dict[str, Any]
Draw = Callable[[np.random.Generator], Settings]
# Where objects stand [m]: from ahead of the first section to behind the last one.
ALONG, ACROSS = (28.0, 56.0), (-1.1, 1.1)


def _place(rng: np.random.Generator) -> list[float]:
    return [round(float(rng.uniform(*ALONG)), 1), round(float(rng.uniform(*ACROSS)), 2)]


def _either(rng: np.random.Generator, low: float, high: float) -> float:
    """A size of either sign."""
    return round(float(rng.choice([-1.0, 1.0]) * rng.uniform(low, high)), 4)


def _seep(rng: np.random.Generator) -> Settings:
    start, side = round(float(rng.uniform(10.0, 34.0)), 1), float(rng.choice([-1.0, 1.0]))
    across = sorted([side * 2.0, side * 2.6])
    return {"seep": [start, round(start + 8.0, 1), *across, round(float(rng.uniform(0.1, 0.18)), 3)]}


def _scour(rng: np.random.Generator) -> Settings:
    size = [_either(rng, 0.15, 0.3), round(float(rng.uniform(1.0, 2.2)), 1), round(float(rng.uniform(0.4, 0.7)), 2)]
    return {"scour": [*_place(rng), *size]}


KINDS: Mapping[str, Draw] = {
    "pier": lambda rng: {"pier": [*_place(rng), round(float(rng.uniform(1.5, 3.0)), 2)]},
    "secondary current": lambda rng: {"ervine": round(float(rng.uniform(0.006, 0.013)), 4)},
    "scour hole or bar": _scour,
    "reconfiguration": lambda rng: {"chi": round(float(-rng.uniform(0.7, 1.2)), 2)},
    "probe": lambda rng: {"station": float(rng.choice(STATIONS[6:21])), "bias": _either(rng, 0.04, 0.07)},
    "discharge": lambda rng: {
        "exp": str(rng.choice(list(EXPERIMENTS))), "factor": round(1.0 + _either(rng, 0.06, 0.1), 3)
    },
    "nothing": lambda rng: {},
    "mixing length": lambda rng: {"mixk": round(float(rng.uniform(0.3, 0.55)), 3)},
    "water that enters": _seep,
    "gauge": lambda rng: {"gauge": float(rng.choice(GAUGES[1:])), "shift": _either(rng, 0.012, 0.02)},
    "skewed inflow": lambda rng: {"skew": _either(rng, 0.15, 0.3)},
    "two effects": lambda rng: {
        "ervine": round(float(rng.uniform(0.006, 0.011)), 4), "mixk": round(float(rng.uniform(0.3, 0.5)), 3)
    },
    "banks rougher downstream": lambda rng: {"banktrend": round(float(rng.uniform(0.02, 0.04)), 4)},
}  # fmt: skip


def make_site(folder: Path, seed: int) -> None:
    """The site of a seed; names of kinds follow each other, so that few sites already hold all of them."""
    kind = list(KINDS)[seed % len(KINDS)]
    make_set(folder / f"site-{seed}", seed, kind, KINDS[kind](np.random.default_rng([seed, 3])), nature=seed % 2 == 1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("first", type=int)
    parser.add_argument("count", type=int)
    given = parser.parse_args()
    for seed in range(given.first, given.first + given.count):
        make_site(given.folder, seed)
        print(f"site-{seed}", flush=True)


if __name__ == "__main__":
    main()
