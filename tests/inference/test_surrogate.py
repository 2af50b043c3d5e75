"""A posterior of a command by few runs: the process that is learned, what fails, what is kept, and what is reported."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from built_models import model_of
from reach import COARSE, write_reach

import vegglue
from vegglue.calibration.noise import noise_of
from vegglue.case.parameter_space import z_at
from vegglue.engine.interface import predict
from vegglue.errors import InputError
from vegglue.inference.importance_sampling import mixture_at_modes
from vegglue.inference.posterior_modes import modes_and_errors, points_of_prior
from vegglue.inference.surrogate import CommandToLearn, Difference, gaussian_process, learn
from vegglue.measurements.observations import read_observations
from vegglue.progress import silent

NAMES = ("n_b", "phi")


def stations(count: int = 6) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "experiment": "June", "kind": "velocity", "section": [f"s{row}" for row in range(count)],
            "x": np.arange(count, dtype=float), "y": 0.0, "z": 0.0, "value": 0.5, "standard_error": 0.02, "used": True,
        }
    )  # fmt: skip


def bent(z: np.ndarray) -> np.ndarray:
    """A difference (m, 6) that no plane follows."""
    a, b = z.T
    return 0.02 * np.column_stack([a, a * b, np.sin(a), b**2, np.exp(0.3 * b), a - b])


def learned(runs: int, seed: int) -> Difference:
    station = stations()
    z = np.random.default_rng(seed).standard_normal((runs, 2))
    return gaussian_process(NAMES, station, noise_of(station), np.zeros(2), np.eye(2), z, bent(z))


def test_it_passes_through_its_runs_and_is_sure_there() -> None:
    found = learned(20, 1)
    np.testing.assert_allclose(found.mean(found.u), bent(found.u), atol=5e-4)
    assert found.variance(found.u).max() < 1e-3
    assert found.variance(np.array([[6.0, 6.0]]))[0] > 0.1


def test_covariance_and_variance_are_one() -> None:
    found, u = learned(12, 2), np.random.default_rng(0).standard_normal((30, 2))
    np.testing.assert_allclose(np.diag(found.covariance(u)), found.variance(u), atol=1e-9)


def test_what_it_states_of_its_error_holds() -> None:
    """Errors at places that were not run, whitened, over those stated: of 40 processes their mean square is near 1."""
    ratios, u = [], 0.8 * np.random.default_rng(0).standard_normal((50, 2))
    for seed in range(40):
        found = learned(12, seed)
        off = np.sum(((found.mean(u) - bent(u)) / 0.02) ** 2, axis=1)
        ratios.append(off.mean() / (found.variance(u).mean() * found.size.sum()))
    assert 0.3 < np.median(ratios) < 3.0


def test_slopes_are_those_of_its_mean(tmp_path: Path) -> None:
    case = vegglue.load_case(
        write_reach(tmp_path, COARSE, ("experiment: June}", "experiment: June, standard_error: 0.02}"))
    )
    model = model_of(case, read_observations(case))
    z = np.random.default_rng(1).standard_normal((15, 2))
    d = np.repeat(bent(z), 3, axis=1)[:, : len(model.station)]
    lower = np.array([[0.8, 0.0], [0.3, 1.2]])
    found = gaussian_process(NAMES, model.station, noise_of(model.station), np.ones(2), lower, z, d)
    here, steps = np.array([0.3, -0.4]), 1e-5 * np.eye(2)
    value, slope = found.at(model, here)
    ends = [found.at(model, here + sign * step)[0] for step in steps for sign in (1.0, -1.0)]
    np.testing.assert_allclose(slope[:, 0], (ends[0] - ends[1]) / 2e-5, atol=1e-8)
    np.testing.assert_allclose(slope[:, 1], (ends[2] - ends[3]) / 2e-5, atol=1e-8)
    elsewhere = model.station.assign(x=model.station["x"] + 0.25)
    assert not found.at(model.__class__(case, model.site, elsewhere, model.engine), here)[0].any()
    assert value.any()


def test_first_runs_that_fail_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One whose kept result was gone and that failed again was dropped, and one run more was made."""
    case = vegglue.load_case(
        write_reach(tmp_path, COARSE, ("experiment: June}", "experiment: June, standard_error: 0.02}"))
    )
    model = model_of(case, read_observations(case))
    asked: list[int] = []

    def predictions(*arguments: Any) -> tuple[np.ndarray, list[str]]:
        """Those of the built-in engine and some more; the fourth run fails."""
        asked.append(len(arguments[3]))
        z = z_at(case, {name: np.array([one[name] for one in arguments[3]]) for name in model.names})
        found = predict(model, [base.fits[0].point], z) + 0.01 * np.sin(z[:, :1])
        found[3:4] = np.nan
        return found, [""] * len(z)

    monkeypatch.setattr("vegglue.inference.surrogate.command_predictions", predictions)
    base = modes_and_errors(model, points_of_prior(model), "known", silent)
    best = base.fits[0]
    run = best.point.z + 0.5 * np.random.default_rng(1).standard_normal((12, best.point.z.size))
    start = mixture_at_modes(best.point.z[None], best.covariance[None], np.zeros(1))
    runs: Any = None
    found = learn(CommandToLearn(runs, run, 2, 14), base, start, silent)
    assert asked == [12]
    assert (found.result.runs, found.result.failed) == (14, 3)


def test_it_needs_an_engine(tmp_path: Path) -> None:
    case = vegglue.load_case(write_reach(tmp_path, COARSE))
    with pytest.raises(InputError, match=r"brook\.yaml"):
        vegglue.infer(case, runs=tmp_path / "runs", method="surrogate")
