"""Compiled sweeps of the semi-implicit step: tridiagonal systems for the level along x and along y, members innermost.

In a change (nx, 3, ny, m), 0 is the level, 1 v on south faces, 2 u on east faces.
"""

import numpy as np

from vegglue.compilation import compiled_exactly
from vegglue.effects.physical_constants import GRAVITY


@compiled_exactly
def sweep_x(change, face_x, storage, weight, outlet, time_step, theta, dx):
    """Thomas sweeps along x in place: level and u of `change`; weight (nx, ny, m) of the east face of each cell."""
    nx, _, ny, m = change.shape
    upper, right = np.empty((nx, m)), np.empty((nx, m))
    for j in range(ny):
        for i in range(nx):
            last = i == nx - 1
            for k in range(m):
                east = face_x[i + 1, j, k] / weight[i, j, k]
                pull_e = theta * theta * GRAVITY / (dx * dx) * east * (2.0 if last else 1.0)
                if last and not outlet[j]:
                    east, pull_e = 0.0, 0.0
                value = change[i, 0, j, k] - theta / dx * east * change[i, 2, j, k]
                diagonal = storage[i, j, k] / time_step + pull_e
                if i > 0:
                    west = face_x[i, j, k] / weight[i - 1, j, k]
                    pull_w = theta * theta * GRAVITY / (dx * dx) * west
                    value += theta / dx * west * change[i - 1, 2, j, k]
                    diagonal += pull_w - pull_w * upper[i - 1, k]
                    value += pull_w * right[i - 1, k]
                upper[i, k] = (0.0 if last else pull_e) / diagonal
                right[i, k] = value / diagonal
        for i in range(nx - 1, -1, -1):
            for k in range(m):
                level = right[i, k]
                if i < nx - 1:
                    level += upper[i, k] * change[i + 1, 0, j, k]
                    gap = change[i + 1, 0, j, k] - level
                else:
                    gap = -2.0 * level
                change[i, 0, j, k] = level
                if i < nx - 1 or outlet[j]:
                    u = (change[i, 2, j, k] - theta * GRAVITY * gap / dx) / weight[i, j, k]
                    change[i, 2, j, k] = u


@compiled_exactly
def sweep_y(change, face_y, storage, weight, time_step, theta, dy):
    """Thomas sweeps along y in place: level and v of `change`; weight (nx, ny, m) of the south face of each cell."""
    nx, _, ny, m = change.shape
    upper, right = np.empty((ny, m)), np.empty((ny, m))
    scale = theta * theta * GRAVITY / (dy * dy)
    for i in range(nx):
        for j in range(ny):
            for k in range(m):
                mass = storage[i, j, k] / time_step
                value, diagonal, pull_n = mass * change[i, 0, j, k], mass, 0.0
                if j < ny - 1:
                    north = face_y[i, j + 1, k] / weight[i, j + 1, k]
                    pull_n = scale * north
                    diagonal += pull_n
                    value -= theta / dy * north * change[i, 1, j + 1, k]
                if j > 0:
                    south = face_y[i, j, k] / weight[i, j, k]
                    value += theta / dy * south * change[i, 1, j, k]
                    diagonal += scale * south * (1.0 - upper[j - 1, k])
                    value += scale * south * right[j - 1, k]
                upper[j, k] = pull_n / diagonal
                right[j, k] = value / diagonal
        for j in range(ny - 1, -1, -1):
            for k in range(m):
                level = right[j, k] + (upper[j, k] * change[i, 0, j + 1, k] if j < ny - 1 else 0.0)
                change[i, 0, j, k] = level
        for j in range(1, ny):
            for k in range(m):
                gap = change[i, 0, j, k] - change[i, 0, j - 1, k]
                change[i, 1, j, k] = (change[i, 1, j, k] - theta * GRAVITY * gap / dy) / weight[i, j, k]
        for k in range(m):
            change[i, 1, 0, k] = 0.0
