"""Compiled loops of the shallow-water residual; the innermost axis of every array is the member (a SIMD lane).

Staggered grid of nx x ny cells: level at cell centres, u on west-east faces, v on south-north faces. Shapes, with m
members: cells (nx, ny, m), west-east faces (nx + 1, ny, m), south-north faces (nx, ny + 1, m), corners (nx + 1, ny +
1, m). `bend` is None on a straight grid, for which each loop is compiled of its own, without a trace of bends.
"""

import math

import numpy as np

from vegglue.compilation import compiled
from vegglue.flow.stretch import at_cell, at_face, columns_of
from vegglue.flow.wet_and_dry import afloat, depths
from vegglue.resistance.physical_constants import GRAVITY

# Speed [m/s] below which friction becomes linear, so that its derivative exists at rest. Chosen, not measured, below
# what instruments resolve: larger ones add friction to slow water, smaller ones sharpen the bend that Newton meets.
REST_SPEED = 1e-3
# Columns computed together, so that what lies between fits the cache (chosen, not measured; no number hangs on it), and
# those beside them they look at: upwinding looks two columns upstream, and depths of their faces one further.
STRIP, HALO = 40, 3


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
def _straight_on(out, last, before_it):
    """Values (rows, m) one cell beyond the last: second order where a further neighbour is missing."""
    rows, m = out.shape
    for j in range(rows):
        for k in range(m):
            out[j, k] = 2.0 * last[j, k] - before_it[j, k]


@compiled
def _beyond_outlet(out, last, before_it, carrier):
    """Values (rows, m) one cell beyond the outlet: straight on where water leaves; where it enters, as in the last.

    Straight on, water that enters would be carried from upstream, and whatever disturbs it would grow by |c| / dx.
    """
    rows, m = out.shape
    for j in range(rows):
        for k in range(m):
            out[j, k] = 2.0 * last[j, k] - before_it[j, k] if carrier[j, k] > 0.0 else last[j, k]


@compiled
def _carrier(out, flux, depth, other_flux, other_depth):
    """Velocity [m/s] that carries momentum between two faces: their fluxes over their depths."""
    rows, m = out.shape
    for j in range(rows):
        for k in range(m):
            out[j, k] = (flux[j, k] + other_flux[j, k]) / (depth[j, k] + other_depth[j, k])


@compiled
def _shear(out, f, u, v, viscosity, corner, per_x, per_y, bend):
    """h nu (du/dy + dv/dx) [m3/s2] at the corners (ny + 1, m) of west-east faces f; none at walls and ends."""
    nx, ny, m = viscosity.shape
    a, b = max(f - 1, 0), min(f, nx - 1)
    out[0], out[ny] = 0.0, 0.0
    for j in range(1, ny):
        stretch = at_face(bend, f, j)
        for k in range(m):
            nu = 0.25 * (viscosity[a, j, k] + viscosity[b, j, k] + viscosity[a, j - 1, k] + viscosity[b, j - 1, k])
            turn = (u[f, j, k] - u[f, j - 1, k]) * per_y + (v[b, j, k] - v[a, j, k]) * (per_x / stretch)
            if bend is not None:
                turn += 0.5 * (u[f, j, k] + u[f, j - 1, k]) * bend.at_faces[f] / stretch
            out[j, k] = nu * corner[f, j, k] * turn


@compiled
def _strain_along(out, f, u, v, viscosity, cell, per_x, bend):
    """2 h nu du/dx [m3/s2] of the cells (ny, m) of column f; none beyond the outlet."""
    nx, ny, m = cell.shape
    for j in range(ny):
        stretch = at_cell(bend, min(f, nx - 1), j + 0.5)
        for k in range(m):
            stress = viscosity[f, j, k] * cell[f, j, k] * (u[f + 1, j, k] - u[f, j, k]) if f < nx else 0.0
            out[j, k] = 2.0 * stress * (per_x / stretch)
            if bend is not None and f < nx:
                turned = 0.5 * (v[f, j, k] + v[f, j + 1, k]) * bend.at_cells[f] / stretch
                out[j, k] -= 2.0 * viscosity[f, j, k] * cell[f, j, k] * turned


@compiled
def _beside_x(bend, f, j, per_x):
    """1 / (J dx) [1/m] of west-east face f in row j, and (J / that J)^2 at its south and its north end [-]."""
    stretch = at_face(bend, f, j + 0.5)
    lift_s, lift_n = at_face(bend, f, j) / stretch, at_face(bend, f, j + 1) / stretch
    return per_x / stretch, lift_s * lift_s, lift_n * lift_n


@compiled
def _beside_y(bend, i, j, per_x):
    """1 / (J dx) [1/m] of the south face of a cell, and J / that J in the cells south and north of it [-]."""
    stretch = at_cell(bend, i, j)
    return per_x / stretch, at_cell(bend, i, j - 0.5) / stretch, at_cell(bend, i, j + 0.5) / stretch


@compiled
def _neighbours_of_u(far, near, east, f, u, carrier, flux, face, cell):
    """u [m/s] two faces and one west of face f and one east of it, (ny, m) each; where a side is nearer, into
    what is given.

    On the west side the depth is not known, so that the first cell counts by the velocity in its middle: by its flux
    over its depth, at least half of that of its face.
    """
    nx, rows, m = cell.shape
    if f == nx:
        _beyond_outlet(east, u[nx], u[nx - 1], carrier)
    if f == 1:
        for j in range(rows):
            for k in range(m):
                # At a waterline no water is as fast as the flux over the depth of a cell far thinner than its face.
                thick = max(cell[0, j, k], 0.5 * face[1, j, k])
                near[j, k] = (flux[0, j, k] + flux[1, j, k]) / thick - u[1, j, k]
    west = u[f - 1] if f > 1 else near
    if f <= 2:
        _straight_on(far, west, u[f])
    return u[f - 2] if f > 2 else far, west, u[f + 1] if f < nx else east


@compiled
def _neighbours_of_v(far, near, east, i, v, carrier):
    """v [m/s] two columns and one west of column i and one east of it, (ny + 1, m) each; where a side is nearer, into
    what is given.

    Water enters through the west side with no velocity across: beyond it v has the other sign.
    """
    last = v.shape[0] - 1
    if i == last:
        _beyond_outlet(east[1:-1], v[i, 1:-1], v[max(i - 1, 0), 1:-1], carrier)
    if i == 0:
        near[:] = -v[0]
        _straight_on(far, near, v[0])
    if i == 1:
        far[:] = -v[0]
    return v[i - 2] if i > 1 else far, v[i - 1] if i > 0 else near, v[i + 1] if i < last else east


@compiled
def momentum_x(out, offset, first, stop, level, u, v, wet, drag, viscosity, outlet, outlet_level, film, dx, dy, bend):
    """Rate R_u [m/s2] on the east faces of columns first .. stop - 1, into out[offset ..]; wet = depths and fluxes."""
    per_x, per_y, half_per_film = 1.0 / dx, 1.0 / dy, 0.5 / film
    cell, face_x, face_y, corner, flux_x, flux_y = wet
    nx, ny, m = level.shape
    west, east, before, behind = np.empty((ny, m)), np.empty((ny, m)), np.empty((ny, m)), np.empty((ny, m))
    side, shear, ends = np.empty((ny + 1, m)), np.empty((ny + 1, m)), np.empty((3, ny, m))
    _carrier(east, flux_x[first], face_x[first], flux_x[first + 1], face_x[first + 1])
    _strain_along(behind, first, u, v, viscosity, cell, per_x, bend)
    for f in range(first + 1, stop + 1):
        a, b, f2 = f - 1, min(f, nx - 1), min(f + 1, nx)
        west, east, before, behind = east, west, behind, before
        _carrier(east, flux_x[f], face_x[f], flux_x[f2], face_x[f2])
        u1, u2, u3 = _neighbours_of_u(ends[0], ends[1], ends[2], f, u, east, flux_x, face_x, cell)
        _strain_along(behind, f, u, v, viscosity, cell, per_x, bend)
        _carrier(side, flux_y[a], face_y[a], flux_y[b], face_y[b])
        _shear(shear, f, u, v, viscosity, corner, per_x, per_y, bend)
        for j in range(ny):
            if f == nx and not outlet[j]:
                out[offset + a - first, 2, j] = u[f, j]
                continue
            j1, j2, j3, j4 = max(j - 2, 0), max(j - 1, 0), min(j + 1, ny - 1), min(j + 2, ny - 1)
            per_length, lift_s, lift_n = _beside_x(bend, f, j, per_x)
            for k in range(m):
                here = u[f, j, k]
                c_w, c_e, c_s, c_n = west[j, k], east[j, k], side[j, k], side[j + 1, k]
                u_w = _upwind_downstream(c_w, u1[j, k], u2[j, k], here)
                u_e = _upwind_downstream(c_e, u2[j, k], here, u3[j, k])
                u_s = _upwind(c_s, u[f, j1, k], u[f, j2, k], here, u[f, j3, k])
                u_n = _upwind(c_n, u[f, j2, k], here, u[f, j3, k], u[f, j4, k])
                carried = (c_e * (u_e - here) - c_w * (u_w - here)) * per_length + (
                    c_n * (u_n - here) - c_s * (u_s - here)
                ) * per_y
                mixed = (behind[j, k] - before[j, k]) * per_length + (
                    lift_n * shear[j + 1, k] - lift_s * shear[j, k]
                ) * per_y
                across = 0.25 * (v[a, j, k] + v[a, j + 1, k] + v[b, j, k] + v[b, j + 1, k])
                if bend is not None:
                    carried -= bend.at_faces[f] * dx * per_length * here * across
                speed = math.sqrt(here * here + across * across + REST_SPEED * REST_SPEED)
                stress = drag[a, j, k] * cell[a, j, k] + drag[b, j, k] * cell[b, j, k]
                drop = level[b, j, k] - level[a, j, k] if f < nx else 2.0 * (outlet_level[k] - level[a, j, k])
                moved = carried * afloat(face_x[f, j, k], half_per_film)
                pulled = (stress * speed * here - 2.0 * mixed) / (cell[a, j, k] + cell[b, j, k])
                out[offset + a - first, 2, j, k] = moved + GRAVITY * drop * per_length + pulled


@compiled
def momentum_y(out, offset, first, stop, level, u, v, wet, drag, viscosity, film, dx, dy, bend):
    """Rate R_v [m/s2] on the south faces of columns first .. stop - 1, into out[offset ..]; rows 1 .. ny - 1 only."""
    per_x, per_y, half_per_film = 1.0 / dx, 1.0 / dy, 0.5 / film
    cell, face_x, face_y, corner, flux_x, flux_y = wet
    _, ny, m = level.shape
    west, east, side = np.empty((ny - 1, m)), np.empty((ny - 1, m)), np.empty((ny, m))
    before, behind, strain = np.empty((ny + 1, m)), np.empty((ny + 1, m)), np.empty((ny, m))
    ends = np.empty((3, ny + 1, m))
    _carrier(east, flux_x[first, :-1], face_x[first, :-1], flux_x[first, 1:], face_x[first, 1:])
    _shear(behind, first, u, v, viscosity, corner, per_x, per_y, bend)
    for i in range(first, stop):
        f = i + 1
        west, east, before, behind = east, west, behind, before
        _carrier(east, flux_x[f, :-1], face_x[f, :-1], flux_x[f, 1:], face_x[f, 1:])
        v1, v2, v3 = _neighbours_of_v(ends[0], ends[1], ends[2], i, v, east)
        _shear(behind, f, u, v, viscosity, corner, per_x, per_y, bend)
        _carrier(side, flux_y[i, :-1], face_y[i, :-1], flux_y[i, 1:], face_y[i, 1:])
        if bend is not None:
            _strain_along(strain, i, u, v, viscosity, cell, per_x, bend)
        for j in range(1, ny):
            j1, j4 = max(j - 2, 0), min(j + 2, ny)
            per_length, lift_s, lift_n = _beside_y(bend, i, j, per_x)
            for k in range(m):
                here = v[i, j, k]
                c_s, c_n, c_w, c_e = side[j - 1, k], side[j, k], west[j - 1, k], east[j - 1, k]
                v_s = _upwind(c_s, v[i, j1, k], v[i, j - 1, k], here, v[i, j + 1, k])
                v_n = _upwind(c_n, v[i, j - 1, k], here, v[i, j + 1, k], v[i, j4, k])
                v_w = _upwind_downstream(c_w, v1[j, k], v2[j, k], here)
                v_e = _upwind_downstream(c_e, v2[j, k], here, v3[j, k])
                carried = (c_e * (v_e - here) - c_w * (v_w - here)) * per_length + (
                    c_n * (v_n - here) - c_s * (v_s - here)
                ) * per_y
                t_n = viscosity[i, j, k] * cell[i, j, k] * (v[i, j + 1, k] - here)
                t_s = viscosity[i, j - 1, k] * cell[i, j - 1, k] * (here - v[i, j - 1, k])
                mixed = (behind[j, k] - before[j, k]) * per_length + 2.0 * (lift_n * t_n - lift_s * t_s) * per_y * per_y
                along = 0.25 * (u[i, j, k] + u[i + 1, j, k] + u[i, j - 1, k] + u[i + 1, j - 1, k])
                if bend is not None:
                    carried += bend.at_cells[i] * dx * per_length * along * along
                    mixed += bend.at_cells[i] * dx * per_length * 0.5 * (strain[j, k] + strain[j - 1, k])
                speed = math.sqrt(here * here + along * along + REST_SPEED * REST_SPEED)
                stress = drag[i, j, k] * cell[i, j, k] + drag[i, j - 1, k] * cell[i, j - 1, k]
                slope = (level[i, j, k] - level[i, j - 1, k]) * per_y
                moved = carried * afloat(face_y[i, j, k], half_per_film)
                pulled = (stress * speed * here - 2.0 * mixed) / (cell[i, j, k] + cell[i, j - 1, k])
                out[offset + i - first, 1, j, k] = moved + GRAVITY * slope + pulled


@compiled
def continuity(out, offset, first, stop, flux_x, flux_y, dx, dy, bend):
    """Rate R_level = d(hu)/dx + d(hv)/dy [m/s] of columns first .. stop - 1, into out[offset ..]."""
    per_x, per_y = 1.0 / dx, 1.0 / dy
    _, _, ny, m = out.shape
    for i in range(first, stop):
        for j in range(ny):
            stretch = at_cell(bend, i, j + 0.5)
            lift_s, lift_n = at_cell(bend, i, j) / stretch, at_cell(bend, i, j + 1) / stretch
            for k in range(m):
                along = (flux_x[i + 1, j, k] - flux_x[i, j, k]) * (per_x / stretch)
                across = lift_n * flux_y[i, j + 1, k] - lift_s * flux_y[i, j, k]
                out[offset + i - first, 0, j, k] = along + across * per_y


@compiled
def push(out, depth, x, y, xx, xy, yy, film, dx, dy, bend):
    """R_u -= f_x - (1/h) div(h T) on east faces and R_v alike on south faces, h of a face the mean of its cells.

    Forces x, y [m/s2] and fluxes xx, xy, yy = h T [m3/s2] at cell centres (nx, ny, m), empty when there are none;
    nothing is carried through the sides of the grid. Faded out in the film on dry land like advection.
    """
    nx, ny, m = depth.shape
    half_per_film = 0.5 / film
    along, across = _pushed_at_centres(depth, x, y, xx, xy, dx, dy, bend)
    for i in range(nx):
        for j in range(ny):
            _, lift_s, lift_n = _beside_y(bend, i, j, 1.0)
            length = dx * at_face(bend, i + 1, j + 0.5)
            for k in range(m):
                here = depth[i, j, k]
                if i + 1 < nx:
                    pair = here + depth[i + 1, j, k]
                    pushed = along[i, j, k] + along[i + 1, j, k]
                    if xx.size:
                        pushed -= 2.0 * (xx[i + 1, j, k] - xx[i, j, k]) / length
                else:
                    pair, pushed = 2.0 * here, 2.0 * along[i, j, k]
                out[i, 2, j, k] -= pushed / pair * afloat(0.5 * pair, half_per_film)
                if j > 0:
                    pair = here + depth[i, j - 1, k]
                    pushed = across[i, j, k] + across[i, j - 1, k]
                    if yy.size:
                        pushed -= 2.0 * (lift_n * yy[i, j, k] - lift_s * yy[i, j - 1, k]) / dy
                    out[i, 1, j, k] -= pushed / pair * afloat(0.5 * pair, half_per_film)


@compiled
def _pushed_at_centres(depth, x, y, xx, xy, dx, dy, bend):
    """h f_x - d(h T_xy)/dy and h f_y - d(h T_xy)/dx at cell centres [m2/s2], (nx, ny, m) each."""
    nx, ny, m = depth.shape
    along, across = np.zeros((nx, ny, m)), np.zeros((nx, ny, m))
    for i in range(nx):
        before, after = max(i - 1, 0), min(i + 1, nx - 1)
        for j in range(ny):
            stretch = at_cell(bend, i, j + 0.5)
            lift_s, lift_n = at_cell(bend, i, j - 0.5) / stretch, at_cell(bend, i, j + 1.5) / stretch
            lift_s, lift_n = lift_s * lift_s, lift_n * lift_n
            for k in range(m):
                if x.size:
                    along[i, j, k] = depth[i, j, k] * x[i, j, k]
                if y.size:
                    across[i, j, k] = depth[i, j, k] * y[i, j, k]
                if xy.size:
                    north = lift_n * xy[i, j + 1, k] if j + 1 < ny else -xy[i, j, k]  # none through the side
                    south = lift_s * xy[i, j - 1, k] if j > 0 else -xy[i, j, k]
                    along[i, j, k] -= (north - south) / (2.0 * dy)
                    if nx > 1:
                        across[i, j, k] -= (xy[after, j, k] - xy[before, j, k]) / ((after - before) * dx * stretch)
                if bend is not None and xx.size:
                    across[i, j, k] -= bend.at_cells[i] / stretch * xx[i, j, k]
    return along, across


@compiled
def velocities(state, first, stop, cell, west, south, north):
    """u on faces first .. stop and v on the south and north faces of columns first .. stop - 1, boundaries included.

    west (ny, m), south and north (nx, m): fluxes [m2/s] through the sides, positive into the domain; cell: their depth.
    """
    _, _, ny, m = state.shape
    u, v = np.empty((stop - first + 1, ny, m)), np.empty((stop - first, ny + 1, m))
    for i in range(first, stop):
        for j in range(ny):
            for k in range(m):
                u[i - first + 1, j, k] = state[i, 2, j, k]
                if j > 0:
                    v[i - first, j, k] = state[i, 1, j, k]
        for k in range(m):
            v[i - first, 0, k] = south[i, k] / cell[i - first, 0, k]
            v[i - first, ny, k] = -north[i, k] / cell[i - first, ny - 1, k]
    for j in range(ny):
        for k in range(m):
            u[0, j, k] = state[first - 1, 2, j, k] if first > 0 else west[j, k] / cell[0, j, k]
    return u, v


@compiled
def rates(
    state,
    bed,
    rise,
    half_range,
    film,
    smallest,
    drag,
    viscosity,
    west,
    south,
    north,
    outlet,
    outlet_level,
    dx,
    dy,
    bend,
):
    """R(state), (nx, 3, ny, m), strip by strip so that what lies between fits the cache."""
    nx = state.shape[0]
    out = np.empty_like(state)
    for first in range(0, nx, STRIP):
        stop = min(first + STRIP, nx)
        a, b = max(first - HALO, 0), min(stop + HALO, nx)
        level = state[a:b, 0].copy()
        cell, face_x, face_y, corner = depths(level, bed[a:b], rise[a:b], half_range[a:b], film, smallest, outlet_level)
        u, v = velocities(state, a, b, cell, west, south, north)
        wet = (cell, face_x, face_y, corner, face_x * u, face_y * v)
        lo, hi, here, law = first - a, stop - a, columns_of(bend, a, b), (drag[a:b], viscosity[a:b])
        continuity(out, first, lo, hi, wet[4], wet[5], dx, dy, here)
        momentum_y(out, first, lo, hi, level, u, v, wet, *law, film, dx, dy, here)
        momentum_x(out, first, lo, hi, level, u, v, wet, *law, outlet, outlet_level, film, dx, dy, here)
        out[first:stop, 1, 0] = state[first:stop, 1, 0]
    return out
