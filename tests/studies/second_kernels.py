"""Compiled loops of the second solver (`second_solver` has the equations). They fill what they are given, in place."""

import numpy as np
from numba import njit

# kappa and the depth over which water shears (the smaller of two cells) are as found in the open cases, see DECISIONS.
GRAVITY, KARMAN = 9.81, 0.41
# Water is at rest in cells below this depth [m]: that of the open cases.
DRY = 0.01
# Squares under which a slope is taken as smooth, for levels [m2] and velocities [m2/s2]: 1 mm and 1 cm/s.
SMOOTH_LEVEL, SMOOTH_VELOCITY = 1e-6, 1e-4
compiled = njit(cache=True, fastmath=True, error_model="numpy")


@compiled
def _half_slope(back, here, ahead, smooth):
    """Half the change of a value over a cell (van Albada et al. 1982)."""
    a, b = here - back, ahead - here
    aa, bb = a * a + smooth, b * b + smooth
    return 0.5 * (a * bb + b * aa) / (aa + bb)


@compiled
def slopes_x(h, eta, u, v, se, su, sv):
    for i in range(1, h.shape[0] - 1):
        for j in range(h.shape[1]):
            wet = min(h[i - 1, j], h[i, j], h[i + 1, j]) > DRY
            on = 1.0 if wet else 0.0
            se[i, j] = on * _half_slope(eta[i - 1, j], eta[i, j], eta[i + 1, j], SMOOTH_LEVEL)
            su[i, j] = on * _half_slope(u[i - 1, j], u[i, j], u[i + 1, j], SMOOTH_VELOCITY)
            sv[i, j] = on * _half_slope(v[i - 1, j], v[i, j], v[i + 1, j], SMOOTH_VELOCITY)


@compiled
def slopes_y(h, eta, u, v, se, su, sv):
    for i in range(h.shape[0]):
        for j in range(1, h.shape[1] - 1):
            wet = min(h[i, j - 1], h[i, j], h[i, j + 1]) > DRY
            on = 1.0 if wet else 0.0
            se[i, j] = on * _half_slope(eta[i, j - 1], eta[i, j], eta[i, j + 1], SMOOTH_LEVEL)
            su[i, j] = on * _half_slope(u[i, j - 1], u[i, j], u[i, j + 1], SMOOTH_VELOCITY)
            sv[i, j] = on * _half_slope(v[i, j - 1], v[i, j], v[i, j + 1], SMOOTH_VELOCITY)


@compiled
def _hllc(hl, nl, tl, hr, nr, tr):
    """Fluxes of water, of momentum across (n) and along (t) a face; the middle wave carries t."""
    cl, cr = np.sqrt(GRAVITY * hl), np.sqrt(GRAVITY * hr)
    sl = min(min(nl - cl, nr - cr), -1e-9)
    sr = max(max(nl + cl, nr + cr), 1e-9)
    ql, qr = hl * nl, hr * nr
    water = (sr * ql - sl * qr + sl * sr * (hr - hl)) / (sr - sl)
    push_l, push_r = ql * nl + 0.5 * GRAVITY * hl * hl, qr * nr + 0.5 * GRAVITY * hr * hr
    push = (sr * push_l - sl * push_r + sl * sr * (qr - ql)) / (sr - sl)
    return water, push, water * (tl if water > 0.0 else tr)


@compiled
def _face(hl, el, nl, tl, hr, er, nr, tr, bed):
    """Fluxes over a face between states of depth <= 2 h: water, push on the left and right cell, momentum along.

    hl, hr are means of the cells; el, er, n, t stand at the face. Pushes hold g h^2/2 less that of the face's own side,
    and the bed inside a cell is added by `_bed_push`.
    """
    depth_l = min(max(el - bed, 0.0), 2.0 * hl)
    depth_r = min(max(er - bed, 0.0), 2.0 * hr)
    top = max(el - depth_l, er - depth_r)
    star_l, star_r = max(el - top, 0.0), max(er - top, 0.0)
    star_l, star_r = min(star_l, depth_l), min(star_r, depth_r)
    water, push, along = _hllc(star_l, nl, tl, star_r, nr, tr)
    left = push + 0.5 * GRAVITY * (depth_l * depth_l - star_l * star_l)
    right = push + 0.5 * GRAVITY * (depth_r * depth_r - star_r * star_r)
    return water, left, right, along, depth_l, depth_r


@compiled
def _bed_push(low, high, eta_low, eta_high):
    """g h (z_low - z_high), with the depths at both faces of a cell and z = eta - h."""
    return 0.5 * GRAVITY * (low + high) * ((eta_low - low) - (eta_high - high))


@compiled
def rates_x(h, eta, u, v, se, su, sv, zx, dx, rh, ru, rv):
    """Add what faces between rows i and i + 1 bring; pushes of the bed too, but for the ends.

    rates_y mirrors it line by line: a loop shared by both rounds otherwise in the last bit, and so would all data sets.
    """
    nx, ny = h.shape
    per = 1.0 / dx
    for i in range(nx - 1):
        k = i + 1
        for j in range(ny):
            el, er = eta[i, j] + se[i, j], eta[k, j] - se[k, j]
            water, left, right, along, dl, dr = _face(
                h[i, j], el, u[i, j] + su[i, j], v[i, j] + sv[i, j],
                h[k, j], er, u[k, j] - su[k, j], v[k, j] - sv[k, j], zx[k, j],
            )  # fmt: skip
            rh[i, j] -= per * water
            rh[k, j] += per * water
            # g (h_w + h_e)/2 (z_w - z_e), split at the centre, where the depth is h and the level eta
            ru[i, j] -= per * (left - _bed_push(h[i, j], dl, eta[i, j], el))
            ru[k, j] += per * (right + _bed_push(dr, h[k, j], er, eta[k, j]))
            rv[i, j] -= per * along
            rv[k, j] += per * along


@compiled
def rates_y(h, eta, u, v, se, su, sv, zy, dy, rh, ru, rv):
    nx, ny = h.shape
    per = 1.0 / dy
    for i in range(nx):
        for j in range(ny - 1):
            k = j + 1
            el, er = eta[i, j] + se[i, j], eta[i, k] - se[i, k]
            water, left, right, along, dl, dr = _face(
                h[i, j], el, v[i, j] + sv[i, j], u[i, j] + su[i, j],
                h[i, k], er, v[i, k] - sv[i, k], u[i, k] - su[i, k], zy[i, k],
            )  # fmt: skip
            rh[i, j] -= per * water
            rh[i, k] += per * water
            rv[i, j] -= per * (left - _bed_push(h[i, j], dl, eta[i, j], el))
            rv[i, k] += per * (right + _bed_push(dr, h[i, k], er, eta[i, k]))
            ru[i, j] -= per * along
            ru[i, k] += per * along


@compiled
def walls(h, eta, zy, dy, rv):
    """Push of the walls at either side, with the water at rest there."""
    last = h.shape[1] - 1
    for i in range(h.shape[0]):
        low = min(max(eta[i, 0] - zy[i, 0], 0.0), 2.0 * h[i, 0])
        high = min(max(eta[i, last] - zy[i, last + 1], 0.0), 2.0 * h[i, last])
        e, f = eta[i, 0], eta[i, last]
        rv[i, 0] += (0.5 * GRAVITY * low * low + _bed_push(low, h[i, 0], e, e)) / dy
        rv[i, last] -= (0.5 * GRAVITY * high * high - _bed_push(h[i, last], high, f, f)) / dy


@compiled
def ends(h, eta, u, v, zx, dx, dy, discharge, level, share, rh, ru, rv):
    nx, ny = h.shape
    total = 0.0
    for j in range(ny):
        if h[0, j] > DRY:
            total += share[j] * h[0, j] ** (5.0 / 3.0) * dy
    for j in range(ny):
        depth = min(max(eta[0, j] - zx[0, j], 0.0), 2.0 * h[0, j])
        q = discharge * share[j] * h[0, j] ** (5.0 / 3.0) / total if h[0, j] > DRY else 0.0
        push = q * q / max(depth, DRY) + 0.5 * GRAVITY * depth * depth
        rh[0, j] += q / dx
        ru[0, j] += (push + _bed_push(depth, h[0, j], eta[0, j], eta[0, j])) / dx
        i = nx - 1
        own = min(max(eta[i, j] - zx[nx, j], 0.0), 2.0 * h[i, j])
        kept = max(level - zx[nx, j], 0.0) if h[i, j] > DRY else own
        speed = u[i, j] + 2.0 * (np.sqrt(GRAVITY * own) - np.sqrt(GRAVITY * kept)) if h[i, j] > DRY else 0.0
        water = kept * speed
        rh[i, j] -= water / dx
        push = water * speed + 0.5 * GRAVITY * kept * kept
        ru[i, j] -= (push - _bed_push(h[i, j], own, eta[i, j], eta[i, j])) / dx
        rv[i, j] -= water * v[i, j] / dx


@compiled
def mixing_x(h, u, v, dx, nu, ru, rv):
    nx, ny = h.shape
    for i in range(nx - 1):
        for j in range(ny):
            if min(h[i, j], h[i + 1, j]) > DRY:
                eddy, depth = 0.5 * (nu[i, j] + nu[i + 1, j]), 0.5 * (h[i, j] + h[i + 1, j])
                rate = eddy * depth / (dx * dx)
                du, dv = rate * (u[i + 1, j] - u[i, j]), rate * (v[i + 1, j] - v[i, j])
                ru[i, j] += du
                ru[i + 1, j] -= du
                rv[i, j] += dv
                rv[i + 1, j] -= dv


@compiled
def mixing_y(h, u, v, dy, nu, ru, rv):
    nx, ny = h.shape
    for i in range(nx):
        for j in range(ny - 1):
            if min(h[i, j], h[i, j + 1]) > DRY:
                eddy, shallow = 0.5 * (nu[i, j] + nu[i, j + 1]), min(h[i, j], h[i, j + 1])
                rate = eddy * shallow / (dy * dy)
                du, dv = rate * (u[i, j + 1] - u[i, j]), rate * (v[i, j + 1] - v[i, j])
                ru[i, j] += du
                ru[i, j + 1] -= du
                rv[i, j] += dv
                rv[i, j + 1] -= dv


@compiled
def advance(h, u, v, rh, ru, rv, k, dt, out_h, out_u, out_v):
    """One explicit step with friction implicit in each cell: q' = (q + dt r) / (1 + dt k |U|)."""
    for i in range(h.shape[0]):
        for j in range(h.shape[1]):
            depth = max(h[i, j] + dt * rh[i, j], 0.0)
            slowed = 1.0 + dt * k[i, j] * np.sqrt(u[i, j] ** 2 + v[i, j] ** 2)
            per = 1.0 / (slowed * max(depth, DRY)) if depth > DRY else 0.0
            out_h[i, j] = depth
            out_u[i, j] = (h[i, j] * u[i, j] + dt * ru[i, j]) * per
            out_v[i, j] = (h[i, j] * v[i, j] + dt * rv[i, j]) * per


@compiled
def mean(h, u, v, h2, u2, v2):
    """Heun: the mean of the state before and after two steps, into the first."""
    for i in range(h.shape[0]):
        for j in range(h.shape[1]):
            depth = 0.5 * (h[i, j] + h2[i, j])
            per = 0.5 / depth if depth > DRY else 0.0
            u[i, j] = (h[i, j] * u[i, j] + h2[i, j] * u2[i, j]) * per
            v[i, j] = (h[i, j] * v[i, j] + h2[i, j] * v2[i, j]) * per
            h[i, j] = depth
