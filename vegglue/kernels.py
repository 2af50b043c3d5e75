"""Compiled loops of the shallow-water residual; the innermost axis of every array is the member (a SIMD lane).

Staggered grid of nx x ny cells: level at cell centres, u on west-east faces, v on south-north faces. Shapes, with m
members: cells (nx, ny, m), west-east faces (nx + 1, ny, m), south-north faces (nx, ny + 1, m), corners (nx + 1, ny +
1, m).
"""

import math

import numpy as np
from numba import njit

GRAVITY = 9.81
KARMAN = 0.4
# Speed [m/s] below which friction becomes linear, so that its derivative exists at rest.
REST_SPEED = 1e-3
MANNING, KEULEGAN, CHEZY = 0, 1, 2
LOG_SLOPE = 18.0 / math.log(10.0)
GAUSS_PLACE = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))
GAUSS_WEIGHT = (5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0)
# Columns computed together, and those beside them they look at.
STRIP, HALO = 40, 3

# No flag that lets one compilation round otherwise than the next: the same numbers from a cold and a warm cache.
compiled = njit(cache=True, nogil=True, fastmath={"contract", "nsz"}, error_model="numpy")


@compiled
def _depth(above: float, reach: float, film: float) -> float:
    """h >= f/10 [m] of water standing `above` a bed that is even between -w and +w around its level, w = `reach`.

    h - f/10 is the mean of max(a - s, 0) over s in (-w, w), a = above - f/10: a cell wets from its lowest corner (the
    idea of Defina 2000, doi:10.1029/2000WR900167), and h has a derivative everywhere. The f/10 that stays on dry land
    lets the water table run on below it.
    """
    dry = 0.1 * film
    lifted = above - dry
    share = min(max(0.5 * (lifted + reach) / reach, 0.0), 1.0)
    return dry + reach * share * share + max(lifted - reach, 0.0)


@compiled
def _sheared(above: float, film: float) -> float:
    """max(a, 0) [m], rounded off within a film: the depth of the point itself, for land drags at no water beside it."""
    share = min(max(0.5 * (above + film) / film, 0.0), 1.0)
    return film * share * share + max(above - film, 0.0)


@compiled
def _afloat(depth: float, half_per_film: float) -> float:
    """Share of advection kept, 1 - O((2 f / h)^4): none in the film on dry land, where friction rules alone."""
    ratio = (depth * half_per_film) ** 2
    ratio *= ratio
    return ratio / (1.0 + ratio)


@compiled
def depths(level, bed, lift, reach, outlet_level, film):
    """Depth [m] at cells, on faces and at corners; on faces and corners that of the mean of level minus bed, at corners
    that of the point itself.

    reach (nx, ny): half the range of the bed within a cell [m]; lift (nx, ny, m): by how much members' beds lie higher
    [m], or empty.
    """
    if lift.size:
        level = level - lift
    nx, ny, m = level.shape
    cell = np.empty((nx, ny, m))
    face_x = np.empty((nx + 1, ny, m))
    face_y = np.empty((nx, ny + 1, m))
    corner = np.zeros((nx + 1, ny + 1, m))
    for i in range(nx):
        w = max(i - 1, 0)
        for j in range(ny):
            s = max(j - 1, 0)
            reach_x = 0.5 * (reach[i, j] + reach[w, j])
            reach_y = 0.5 * (reach[i, j] + reach[i, s])
            for k in range(m):
                here = level[i, j, k] - bed[i, j]
                west = level[w, j, k] - bed[w, j]
                south = level[i, s, k] - bed[i, s]
                diagonal = level[w, s, k] - bed[w, s]
                cell[i, j, k] = _depth(here, reach[i, j], film)
                face_x[i, j, k] = _depth(0.5 * (here + west), reach_x, film)
                face_y[i, j, k] = _depth(0.5 * (here + south), reach_y, film)
                corner[i, j, k] = _sheared(0.25 * (here + west + south + diagonal), film)
        for k in range(m):
            face_y[i, ny, k] = cell[i, ny - 1, k]
            corner[i, 0, k] = 0.0
    corner[0] = 0.0
    last, before = nx - 1, max(nx - 2, 0)
    for j in range(ny):
        for k in range(m):
            edge = bed[last, j] + 0.5 * (bed[last, j] - bed[before, j])
            above = outlet_level[k] - edge - (lift[last, j, k] if lift.size else 0.0)
            face_x[nx, j, k] = _depth(above, reach[last, j], film)
    return cell, face_x, face_y, corner


@compiled
def _chezy(law: int, coefficient: float, depth: float, log_argument_minimum: float) -> float:
    """C [m^1/2/s]: h^(1/6)/n (Manning), 18 log10(max(12 h/k_s, floor)) (Keulegan 1938), or as given."""
    if law == MANNING:
        return depth ** (1.0 / 6.0) / coefficient
    if law == KEULEGAN:
        return LOG_SLOPE * math.log(max(12.0 * depth / coefficient, log_argument_minimum))
    return coefficient


@compiled
def _conveyance(law: int, coefficient: float, mean: float, reach: float, floor: float) -> float:
    """Mean of C h^(3/2) over a cell of mean depth `mean` whose bed rises evenly by 2 w: three Gauss points where wet.

    As in the subgrid friction of Volp et al. 2013, doi:10.1002/wrcr.20324: one slope of the surface drives each depth.
    """
    above = mean if mean > reach else 2.0 * math.sqrt(reach * mean) - reach
    lowest, highest = max(above - reach, 0.0), above + reach
    total = 0.0
    for q in range(3):
        h = lowest + (highest - lowest) * GAUSS_PLACE[q]
        if h > 0.0:
            weight = GAUSS_WEIGHT[q] * 0.5 * (highest - lowest) / reach
            total += weight * _chezy(law, coefficient, h, floor) * h * math.sqrt(h)
    return total


@compiled
def class_drag(depth, reach, friction_class, law, coefficient, log_argument_minimum, film):
    """k = g / (C^2 h) [1/m] of the class laws; on a slope g h^2 / <C h^(3/2)>^2, the same for one depth throughout."""
    nx, ny, m = depth.shape
    drag = np.empty((nx, ny, m))
    dry = 0.1 * film
    of_film = np.empty(coefficient.shape)
    for c in range(law.size):
        for k in range(m):
            of_film[c, k] = _chezy(law[c], coefficient[c, k], dry, log_argument_minimum) * dry * math.sqrt(dry)
    for i in range(nx):
        for j in range(ny):
            c = friction_class[i, j]
            steep = reach[i, j] > 4.0001 * film
            for k in range(m):
                h = depth[i, j, k]
                if steep:
                    carried = _conveyance(law[c], coefficient[c, k], h - dry, reach[i, j], log_argument_minimum)
                    drag[i, j, k] = GRAVITY * (h / (carried + of_film[c, k])) ** 2
                else:
                    chezy = _chezy(law[c], coefficient[c, k], h, log_argument_minimum)
                    drag[i, j, k] = GRAVITY / (chezy * chezy * h)
    return drag


@compiled
def _upwind(flux: float, far_left: float, left: float, right: float, far_right: float) -> float:
    """Third-order upwind-biased value between `left` and `right` (kappa = 1/3; van Leer 1985)."""
    from_left = left + (right - left) / 3.0 + (left - far_left) / 6.0
    from_right = right + (left - right) / 3.0 + (right - far_right) / 6.0
    return from_left if flux > 0.0 else from_right


@compiled
def _upwind_downstream(flux: float, far_left: float, left: float, right: float) -> float:
    """The same where the flux runs downstream; first order against it, so that the Jacobian's blocks stay narrow."""
    return left + (right - left) / 3.0 + (left - far_left) / 6.0 if flux > 0.0 else right


@compiled
def momentum_x(out, offset, first, stop, level, u, v, wet, drag, viscosity, outlet, outlet_level, film, dx, dy):
    """Rate R_u [m/s2] on the east faces of columns first .. stop - 1, into out[offset ..]; wet = depths and fluxes."""
    per_x, per_y, half_per_film = 1.0 / dx, 1.0 / dy, 0.5 / film
    cell, face_x, face_y, corner, flux_x, flux_y = wet
    nx, ny, m = level.shape
    for f in range(first + 1, stop + 1):
        a, b = f - 1, min(f, nx - 1)
        f1, f2 = max(f - 2, 0), min(f + 1, nx)
        for j in range(ny):
            if f == nx and not outlet[j]:
                out[offset + a - first, 2, j] = u[f, j]
                continue
            j1, j2, j3, j4 = max(j - 2, 0), max(j - 1, 0), min(j + 1, ny - 1), min(j + 2, ny - 1)
            for k in range(m):
                here = u[f, j, k]
                c_w = (flux_x[f - 1, j, k] + flux_x[f, j, k]) / (face_x[f - 1, j, k] + face_x[f, j, k])
                c_e = (flux_x[f, j, k] + flux_x[f2, j, k]) / (face_x[f, j, k] + face_x[f2, j, k])
                c_s = (flux_y[a, j, k] + flux_y[b, j, k]) / (face_y[a, j, k] + face_y[b, j, k])
                c_n = (flux_y[a, j + 1, k] + flux_y[b, j + 1, k]) / (face_y[a, j + 1, k] + face_y[b, j + 1, k])
                u_w = _upwind_downstream(c_w, u[f1, j, k], u[f - 1, j, k], here)
                u_e = _upwind_downstream(c_e, u[f - 1, j, k], here, u[f2, j, k])
                u_s = _upwind(c_s, u[f, j1, k], u[f, j2, k], here, u[f, j3, k])
                u_n = _upwind(c_n, u[f, j2, k], here, u[f, j3, k], u[f, j4, k])
                carried = (c_e * (u_e - here) - c_w * (u_w - here)) * per_x + (
                    c_n * (u_n - here) - c_s * (u_s - here)
                ) * per_y
                nu_a, nu_b = viscosity[a, j, k], viscosity[b, j, k]
                t_e = 2.0 * nu_b * cell[b, j, k] * (u[f2, j, k] - here) * per_x
                t_w = 2.0 * nu_a * cell[a, j, k] * (here - u[f - 1, j, k]) * per_x
                nu_s = 0.25 * (nu_a + nu_b + viscosity[a, j2, k] + viscosity[b, j2, k])
                nu_n = 0.25 * (nu_a + nu_b + viscosity[a, j3, k] + viscosity[b, j3, k])
                t_s = nu_s * corner[f, j, k] * ((here - u[f, j2, k]) * per_y + (v[b, j, k] - v[a, j, k]) * per_x)
                turn_n = (u[f, j3, k] - here) * per_y + (v[b, j + 1, k] - v[a, j + 1, k]) * per_x
                t_n = nu_n * corner[f, j + 1, k] * turn_n
                mixed = (t_e - t_w) * per_x + (t_n - t_s) * per_y
                across = 0.25 * (v[a, j, k] + v[a, j + 1, k] + v[b, j, k] + v[b, j + 1, k])
                speed = math.sqrt(here * here + across * across + REST_SPEED * REST_SPEED)
                stress = drag[a, j, k] * cell[a, j, k] + drag[b, j, k] * cell[b, j, k]
                rough = stress / (cell[a, j, k] + cell[b, j, k]) * speed * here
                drop = level[b, j, k] - level[a, j, k] if f < nx else 2.0 * (outlet_level[k] - level[a, j, k])
                mixed *= 2.0 / (cell[a, j, k] + cell[b, j, k])
                moved = carried * _afloat(face_x[f, j, k], half_per_film) - mixed
                out[offset + a - first, 2, j, k] = moved + GRAVITY * drop * per_x + rough


@compiled
def momentum_y(out, offset, first, stop, level, u, v, wet, drag, viscosity, film, dx, dy):
    """Rate R_v [m/s2] on the south faces of columns first .. stop - 1, into out[offset ..]; rows 1 .. ny - 1 only."""
    per_x, per_y, half_per_film = 1.0 / dx, 1.0 / dy, 0.5 / film
    cell, face_x, face_y, corner, flux_x, flux_y = wet
    nx, ny, m = level.shape
    for i in range(first, stop):
        i1, i2, i3 = max(i - 2, 0), max(i - 1, 0), min(i + 1, nx - 1)
        for j in range(1, ny):
            j1, j4 = max(j - 2, 0), min(j + 2, ny)
            for k in range(m):
                here = v[i, j, k]
                c_s = (flux_y[i, j - 1, k] + flux_y[i, j, k]) / (face_y[i, j - 1, k] + face_y[i, j, k])
                c_n = (flux_y[i, j, k] + flux_y[i, j + 1, k]) / (face_y[i, j, k] + face_y[i, j + 1, k])
                c_w = (flux_x[i, j - 1, k] + flux_x[i, j, k]) / (face_x[i, j - 1, k] + face_x[i, j, k])
                c_e = (flux_x[i + 1, j - 1, k] + flux_x[i + 1, j, k]) / (face_x[i + 1, j - 1, k] + face_x[i + 1, j, k])
                v_s = _upwind(c_s, v[i, j1, k], v[i, j - 1, k], here, v[i, j + 1, k])
                v_n = _upwind(c_n, v[i, j - 1, k], here, v[i, j + 1, k], v[i, j4, k])
                # Water enters through the west side with no velocity across.
                v_w = _upwind_downstream(c_w, v[i1, j, k], v[i2, j, k], here) if i > 0 else 0.0
                v_e = _upwind_downstream(c_e, v[i2, j, k], here, v[i3, j, k])
                carried = (c_e * (v_e - here) - c_w * (v_w - here)) * per_x + (
                    c_n * (v_n - here) - c_s * (v_s - here)
                ) * per_y
                nu_s, nu_n = viscosity[i, j - 1, k], viscosity[i, j, k]
                t_n = 2.0 * nu_n * cell[i, j, k] * (v[i, j + 1, k] - here) * per_y
                t_s = 2.0 * nu_s * cell[i, j - 1, k] * (here - v[i, j - 1, k]) * per_y
                nu_w = 0.25 * (nu_s + nu_n + viscosity[i2, j - 1, k] + viscosity[i2, j, k])
                nu_e = 0.25 * (nu_s + nu_n + viscosity[i3, j - 1, k] + viscosity[i3, j, k])
                t_w = nu_w * corner[i, j, k] * ((u[i, j, k] - u[i, j - 1, k]) * per_y + (here - v[i2, j, k]) * per_x)
                turn_e = (u[i + 1, j, k] - u[i + 1, j - 1, k]) * per_y + (v[i3, j, k] - here) * per_x
                t_e = nu_e * corner[i + 1, j, k] * turn_e
                mixed = (t_e - t_w) * per_x + (t_n - t_s) * per_y
                along = 0.25 * (u[i, j, k] + u[i + 1, j, k] + u[i, j - 1, k] + u[i + 1, j - 1, k])
                speed = math.sqrt(here * here + along * along + REST_SPEED * REST_SPEED)
                stress = drag[i, j, k] * cell[i, j, k] + drag[i, j - 1, k] * cell[i, j - 1, k]
                rough = stress / (cell[i, j, k] + cell[i, j - 1, k]) * speed * here
                slope = (level[i, j, k] - level[i, j - 1, k]) * per_y
                mixed *= 2.0 / (cell[i, j, k] + cell[i, j - 1, k])
                moved = carried * _afloat(face_y[i, j, k], half_per_film) - mixed
                out[offset + i - first, 1, j, k] = moved + GRAVITY * slope + rough


@compiled
def continuity(out, offset, first, stop, flux_x, flux_y, dx, dy):
    """Rate R_level = d(hu)/dx + d(hv)/dy [m/s] of columns first .. stop - 1, into out[offset ..]."""
    per_x, per_y = 1.0 / dx, 1.0 / dy
    _, _, ny, m = out.shape
    for i in range(first, stop):
        for j in range(ny):
            for k in range(m):
                along = (flux_x[i + 1, j, k] - flux_x[i, j, k]) * per_x
                out[offset + i - first, 0, j, k] = along + (flux_y[i, j + 1, k] - flux_y[i, j, k]) * per_y


@compiled
def push(out, depth, x, y, xx, xy, yy, film, dx, dy):
    """R_u -= f_x - (1/h) div(h T) on east faces and R_v alike on south faces, h of a face the mean of its cells.

    Forces x, y [m/s2] and fluxes xx, xy, yy = h T [m3/s2] at cell centres (nx, ny, m), empty when there are none;
    nothing is carried through the sides of the grid. Faded out in the film on dry land like advection.
    """
    nx, ny, m = depth.shape
    half_per_film = 0.5 / film
    along, across = np.zeros((nx, ny, m)), np.zeros((nx, ny, m))
    for i in range(nx):
        before, after = max(i - 1, 0), min(i + 1, nx - 1)
        for j in range(ny):
            for k in range(m):
                if x.size:
                    along[i, j, k] = depth[i, j, k] * x[i, j, k]
                if y.size:
                    across[i, j, k] = depth[i, j, k] * y[i, j, k]
                if xy.size:
                    north = xy[i, j + 1, k] if j + 1 < ny else 0.0
                    south = xy[i, j - 1, k] if j > 0 else 0.0
                    along[i, j, k] -= (north - south) / (2.0 * dy)
                    if nx > 1:
                        across[i, j, k] -= (xy[after, j, k] - xy[before, j, k]) / ((after - before) * dx)
    for i in range(nx):
        for j in range(ny):
            for k in range(m):
                here = depth[i, j, k]
                if i + 1 < nx:
                    pair = here + depth[i + 1, j, k]
                    pushed = along[i, j, k] + along[i + 1, j, k]
                    if xx.size:
                        pushed -= 2.0 * (xx[i + 1, j, k] - xx[i, j, k]) / dx
                else:
                    pair, pushed = 2.0 * here, 2.0 * along[i, j, k]
                out[i, 2, j, k] -= pushed / pair * _afloat(0.5 * pair, half_per_film)
                if j > 0:
                    pair = here + depth[i, j - 1, k]
                    pushed = across[i, j, k] + across[i, j - 1, k]
                    if yy.size:
                        pushed -= 2.0 * (yy[i, j, k] - yy[i, j - 1, k]) / dy
                    out[i, 1, j, k] -= pushed / pair * _afloat(0.5 * pair, half_per_film)


@compiled
def cell_depth(state, bed, lift, reach, film):
    """h (nx, ny, m) at cell centres [m] of a state (nx, 3, ny, m)."""
    nx, _, ny, m = state.shape
    depth = np.empty((nx, ny, m))
    for i in range(nx):
        for j in range(ny):
            if lift.size:
                for k in range(m):
                    depth[i, j, k] = _depth(state[i, 0, j, k] - bed[i, j] - lift[i, j, k], reach[i, j], film)
                continue
            for k in range(m):
                depth[i, j, k] = _depth(state[i, 0, j, k] - bed[i, j], reach[i, j], film)
    return depth


@compiled
def velocities(state, first, stop, cell, west, south, north):
    """u on faces first .. stop and v on the south and north faces of columns first .. stop - 1, boundaries included.

    west (ny, m), south and north (nx, m): fluxes [m2/s] through the sides, positive into the domain; cell: their depth.
    """
    _, _, ny, m = state.shape
    u, v = np.empty((stop - first + 1, ny, m)), np.empty((stop - first, ny + 1, m))
    for i in range(first, stop):
        u[i - first + 1] = state[i, 2]
        v[i - first, 1:ny] = state[i, 1, 1:]
        for k in range(m):
            v[i - first, 0, k] = south[i, k] / cell[i - first, 0, k]
            v[i - first, ny, k] = -north[i, k] / cell[i - first, ny - 1, k]
    if first > 0:
        u[0] = state[first - 1, 2]
    else:
        u[0] = west / cell[0]
    return u, v


@compiled
def rates(state, bed, lift, reach, drag, viscosity, west, south, north, outlet, outlet_level, film, dx, dy):
    """R(state), (nx, 3, ny, m), strip by strip so that what lies between fits the cache."""
    nx = state.shape[0]
    out = np.empty_like(state)
    for first in range(0, nx, STRIP):
        stop = min(first + STRIP, nx)
        a, b = max(first - HALO, 0), min(stop + HALO, nx)
        level = state[a:b, 0].copy()
        cell, face_x, face_y, corner = depths(level, bed[a:b], lift[a:b], reach[a:b], outlet_level, film)
        u, v = velocities(state, a, b, cell, west, south, north)
        wet = (cell, face_x, face_y, corner, face_x * u, face_y * v)
        lo, hi = first - a, stop - a
        continuity(out, first, lo, hi, wet[4], wet[5], dx, dy)
        momentum_y(out, first, lo, hi, level, u, v, wet, drag[a:b], viscosity[a:b], film, dx, dy)
        momentum_x(out, first, lo, hi, level, u, v, wet, drag[a:b], viscosity[a:b], outlet, outlet_level, film, dx, dy)
        out[first:stop, 1, 0] = state[first:stop, 1, 0]
    return out
