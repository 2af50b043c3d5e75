"""Simulation-based calibration (Talts et al. 2018, https://doi.org/10.48550/arXiv.1804.06788):
`python tests/studies/ranks_of_twins.py`.

Truths are drawn from the prior and measured by a small nonlinear model with errors; where each ranks among draws of
its own posterior is then uniform. The figure of the ranks goes to runs/ranks.png.
"""

import sys
from pathlib import Path

import numpy as np
import scipy.optimize
import scipy.stats

from vegglue.inference.importance_sampling import mixture_at_modes, sample
from vegglue.inference.weighted_statistics import systematic_draws

TWINS, DRAWS, PARAMETERS, STATIONS = 200, 99, 3, 12
ERROR = 0.3
PLACES = np.linspace(0.1, 1.2, STATIONS)


def predict(z: np.ndarray) -> np.ndarray:
    """Friction that multiplies, an offset, and a drag that saturates: (m, 3) -> (m, STATIONS)."""
    rough, offset, drag = z.T[:, :, None]
    return np.exp(-0.4 * rough) * (1 + PLACES) + 0.3 * offset * PLACES**2 - np.tanh(0.7 * drag) * (PLACES > 0.6)


def ranks(twins: int = TWINS, seed: int = 1) -> np.ndarray:
    """How many of DRAWS draws lie below the truth, (twins, PARAMETERS)."""
    random = np.random.default_rng(seed)
    return np.array([_ranked(random, seed + twin) for twin in range(twins)])


def _ranked(random: np.random.Generator, seed: int) -> np.ndarray:
    truth = random.normal(size=PARAMETERS)
    measured = predict(truth[None])[0] + ERROR * random.normal(size=STATIONS)

    def rows(z: np.ndarray) -> np.ndarray:
        return np.concatenate([(measured - predict(z[None])[0]) / ERROR, z])

    def density(z: np.ndarray, values: np.ndarray) -> np.ndarray:
        return -0.5 * np.sum(((measured - values) / ERROR) ** 2, axis=1) - 0.5 * np.sum(z**2, axis=1)

    best = scipy.optimize.least_squares(rows, np.zeros(PARAMETERS))
    start = mixture_at_modes(best.x[None], np.linalg.inv(best.jac.T @ best.jac)[None], np.zeros(1))
    drawn = sample(predict, density, start, 400, seed)
    draws = drawn.z[systematic_draws(drawn.weights, DRAWS, random)]
    return np.sum(draws < truth, axis=0)


def save_figure(found: np.ndarray, path: Path) -> None:
    """Histograms of the ranks with the band in which 19 of 20 bars of uniform ones lie."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, PARAMETERS, figsize=(9, 2.6), sharey=True, layout="constrained")
    low, high = scipy.stats.binom.ppf([0.025, 0.975], len(found), 0.1)
    for axis, column, name in zip(axes, found.T, ("friction", "offset", "drag"), strict=True):
        axis.axhspan(low, high, color="0.88")
        axis.hist(column, bins=np.linspace(0, DRAWS + 1, 11), color="#2a6f97", rwidth=0.9)
        axis.set(title=name, xlabel=f"rank of the truth among {DRAWS} draws")
    axes[0].set_ylabel(f"of {len(found)} twins")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
    plt.close(figure)


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "runs/ranks.png")
    save_figure(ranks(), target)
    print(target)
