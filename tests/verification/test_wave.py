"""Standing waves in closed basins: frequency and damping of the marching scheme against its own linear theory."""

import numpy as np
import pytest
from channels import GRAVITY, centres, filled, make_problem

from vegglue.effects import bed_laws
from vegglue.flow.march import march
from vegglue.flow.problem import LEVEL

DEPTH, LENGTH, CELLS, HEIGHT = 1.0, 20.0, 40, 1e-6


def basin(shape: tuple[int, int], cell: tuple[float, float]):
    """Walls all around, next to no friction."""
    nothing = {"inflows": (), "outlet": np.zeros(shape[1], bool), "film": 1e-6}
    return make_problem(np.zeros(shape), cell, 0.0, DEPTH, (bed_laws.CHEZY, 1e6), **nothing)


def amplitudes(problem, shape, step, steps, theta):
    """The part of a mode in the level after every step, from rest with the mode as its level."""
    state = filled(problem, DEPTH)
    state[:, LEVEL, :, 0] += HEIGHT * shape
    found = [1.0]
    for _ in range(steps):
        state = march(problem, state, step, 1, theta)
        found.append(float((shape * (state[:, LEVEL, :, 0] - DEPTH)).sum() / (HEIGHT * (shape**2).sum())))
    return np.array(found)


def wave(number: float, cell: float) -> float:
    """Frequency on the staggered grid, 2 sqrt(g h) / dx sin(k dx / 2) [1/s]."""
    return 2.0 * np.sqrt(GRAVITY * DEPTH) / cell * np.sin(0.5 * number * cell)


def factor(frequency: float, step: float, theta: float) -> complex:
    """Amplification of a step, (1 - i w (1 - theta) dt) / (1 + i w theta dt): |1| for theta = 1/2, below it else."""
    return (1.0 - 1j * frequency * (1.0 - theta) * step) / (1.0 + 1j * frequency * theta * step)


@pytest.mark.parametrize("along", [True, False], ids=["along", "across"])
@pytest.mark.parametrize("theta", [0.5, 0.6, 1.0])
def test_standing_wave_follows_the_theta_scheme(along, theta):
    """Every one of 200 steps, to a hundred thousandth of the height (measured 6e-7 .. 2e-6)."""
    mode = np.cos(2.0 * np.pi * centres(LENGTH, CELLS) / LENGTH)
    shape = np.repeat(mode[:, None], 3, axis=1) if along else np.repeat(mode[None], 3, axis=0)
    cell = (LENGTH / CELLS, 1.0) if along else (1.0, LENGTH / CELLS)
    step = 0.1
    found = amplitudes(basin(shape.shape, cell), shape, step, 200, theta)
    turn = factor(wave(2.0 * np.pi / LENGTH, LENGTH / CELLS), step, theta)
    error = np.abs(found - (turn ** np.arange(201)).real).max()
    print(f"theta {theta}: largest error {error:.1e}, damping over 200 steps {abs(turn) ** 200:.3f}")
    assert error < 1e-5


def test_frequency_and_damping_with_small_steps():
    """theta = 1/2 with small steps: the period of linear wave theory, L / sqrt(g h) for the second mode; no damping."""
    mode = np.cos(2.0 * np.pi * centres(LENGTH, CELLS) / LENGTH)
    shape = np.repeat(mode[:, None], 3, axis=1)
    period = LENGTH / np.sqrt(GRAVITY * DEPTH)
    found = amplitudes(basin(shape.shape, (LENGTH / CELLS, 1.0)), shape, period / 400, 1200, 0.5)
    crests = np.array([np.argmax(found[n * 400 - 100 : n * 400 + 100]) + n * 400 - 100 for n in (1, 2, 3)])
    assert crests == pytest.approx([400, 800, 1200], abs=4)
    assert found[crests] == pytest.approx(1.0, abs=2e-4)


def test_a_slanting_mode_keeps_its_frequency_and_height():
    """Both sweeps at once: the frequency is sqrt(w_x^2 + w_y^2), and alternating directions do not damp."""
    x, y = centres(LENGTH, CELLS), centres(12.0, 24)
    shape = np.cos(np.pi * x / LENGTH)[:, None] * np.cos(np.pi * y / 12.0)[None]
    frequency = np.hypot(wave(np.pi / LENGTH, 0.5), wave(np.pi / 12.0, 0.5))
    step = 2.0 * np.pi / frequency / 200
    found = amplitudes(basin(shape.shape, (0.5, 0.5)), shape, step, 400, 0.5)
    error = np.abs(found - np.cos(frequency * step * np.arange(401))).max()
    print(f"slanting mode over two periods: largest error {error:.1e}")
    assert error < 1.5e-3
