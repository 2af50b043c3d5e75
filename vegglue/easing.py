"""Momentum of thin water eased for chord steps: rows in which friction is so far from linear that frozen slopes fail.

Steps with another member's Jacobian overshoot along the waterline long after the rest of the flow has settled. Written
with its own root, a row is linear in its velocity: 8 steps instead of 15 for a member of one chunk of the paper's
ensemble, 15 instead of 30 in another (means of 100), and 2 factorisations instead of 11, 7 instead of 17.
This is a left nonlinear preconditioner, as in Cai and Keyes 2002, doi:10.1137/S106482750037620X; not
checked against it.
"""

import math

import numpy as np

from vegglue.kernels import REST_SPEED, compiled

# Films of depth above which a row stays as it is; 2 needs two more steps in ten, 10 none fewer.
THIN = 5.0


@compiled
def _friction(state, depth, drag, west, i, j, k, along):
    """Own velocity [m/s], the rest of |U|^2 [m2/s2] and k [1/m] of the east face of cell i, j, or of its south face."""
    nx, _, ny, _ = state.shape
    if along:
        b, n = min(i + 1, nx - 1), min(j + 1, ny - 1)
        other = 0.25 * (state[i, 1, j, k] + state[i, 1, n, k] + state[b, 1, j, k] + state[b, 1, n, k])
        here, beside, k_here, k_beside = depth[i, j, k], depth[b, j, k], drag[i, j, k], drag[b, j, k]
    else:
        s = max(j - 1, 0)
        if i > 0:
            behind = state[i - 1, 2, j, k] + state[i - 1, 2, s, k]
        else:
            behind = west[j, k] / depth[0, j, k] + west[s, k] / depth[0, s, k]
        other = 0.25 * (state[i, 2, j, k] + state[i, 2, s, k] + behind)
        here, beside, k_here, k_beside = depth[i, j, k], depth[i, s, k], drag[i, j, k], drag[i, s, k]
    rough = (k_here * here + k_beside * beside) / (here + beside)
    return state[i, 2 if along else 1, j, k], other * other + REST_SPEED * REST_SPEED, rough


@compiled
def friction_slope(state, depth, drag, west):
    """d(k |U| u)/du [1/s] of the unknowns (nx, 3, ny, m); none for levels."""
    nx, _, ny, m = state.shape
    slope = np.zeros((nx, 3, ny, m))
    for i in range(nx):
        for j in range(ny):
            for e in (1, 2):
                for k in range(m):
                    own, rest, rough = _friction(state, depth, drag, west, i, j, k, e == 2)
                    speed = math.sqrt(own * own + rest)
                    slope[i, e, j, k] = rough * (speed + own * own / speed)
    return slope


@compiled
def ease(out, state, depth, drag, west, slope, film):
    """Momentum rows of thin water, in place, as slope (u - u*): u* is their root in u, all else as it is.

    slope (nx, 3, ny, 1): of the state whose factors are in use. Roots stay roots; blended in below THIN films.
    """
    nx, _, ny, m = state.shape
    for i in range(nx):
        for j in range(ny):
            if depth[i, j].min() > 2.0 * THIN * film:
                continue
            for e in (1, 2):
                if (e == 1 and j == 0) or (e == 2 and i == nx - 1):
                    continue
                for k in range(m):
                    beside = depth[i + 1, j, k] if e == 2 else depth[i, j - 1, k]
                    share = 0.5 * (depth[i, j, k] + beside) / (THIN * film)
                    if share > 1.0:
                        continue
                    own, rest, rough = _friction(state, depth, drag, west, i, j, k, e == 2)
                    drive = math.sqrt(own * own + rest) * own - out[i, e, j, k] / rough
                    root = math.sqrt(0.5 * (math.sqrt(rest * rest + 4.0 * drive * drive) - rest))
                    eased = slope[i, e, j, 0] * (own - math.copysign(root, drive))
                    out[i, e, j, k] += (1.0 - share * share) * (eased - out[i, e, j, k])
