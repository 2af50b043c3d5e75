"""Compiled loops of the shallow-water residual; the innermost axis of every array is the member.

Staggered grid of nx x ny cells: level at cell centres, u on west-east faces, v on south-north faces. Shapes, with m
members: cells (nx, ny, m), west-east faces (nx + 1, ny, m), south-north faces (nx, ny + 1, m), corners (nx + 1, ny +
1, m). `bend` is None on a straight grid, for which each loop is compiled of its own, without a trace of bends.

Within, rows and members of a column are one axis, (nx, ny m) for cells: one loop runs over all rows of a column, so
that SIMD lanes are full with one member, too. A neighbour across the channel is m further.

On a grid along a centreline, s along it and n across, positive to the left, a length ds is J ds off the centreline,
J = 1 - n kappa, kappa its curvature [1/m], positive where it turns left.
"""

import math
from typing import NamedTuple

import numpy as np

from vegglue.arrays import Array
from vegglue.compilation import compiled, compiled_inside, compiled_on_views
from vegglue.effects.physical_constants import GRAVITY
from vegglue.flow.wet_and_dry import afloat, depths


class Bend(NamedTuple):
    """A grid along a curved centreline. A tuple, as compiled loops take it.

    Attributes
    ----------
    at_cells, at_faces
        Curvature kappa in each column of cells (nx,) and at west-east faces (nx + 1,) [1/m].
    south, dy
        n of the south edge of the grid, and width of its rows [m].
    """

    at_cells: Array
    at_faces: Array
    south: float
    dy: float


@compiled_on_views
def _at_cell(bend: Bend | None, column: int, rows: float) -> float:
    """J [-] in a column of cells, so many rows north of the south edge; 1 on a straight grid."""
    if bend is None:
        return 1.0
    return 1.0 - bend.at_cells[column] * (bend.south + rows * bend.dy)


@compiled_on_views
def _at_face(bend: Bend | None, face: int, rows: float) -> float:
    """J [-] at the west-east faces, so many rows north of the south edge; 1 on a straight grid."""
    if bend is None:
        return 1.0
    return 1.0 - bend.at_faces[face] * (bend.south + rows * bend.dy)


@compiled_inside
def _columns_of(bend: Bend | None, first: int, stop: int) -> Bend | None:
    """The bend of the columns first .. stop - 1."""
    if bend is None:
        return None
    return Bend(bend.at_cells[first:stop], bend.at_faces[first : stop + 1], bend.south, bend.dy)


# Factors, not divisors: a processor divides in the time of some ten products.
THIRD, SIXTH = 1.0 / 3.0, 1.0 / 6.0


@compiled_on_views
def _upwind(flux: float, far_left: float, left: float, right: float, far_right: float) -> float:
    """Third-order upwind-biased value between `left` and `right` (kappa = 1/3; van Leer 1985)."""
    from_left = left + (right - left) * THIRD + (left - far_left) * SIXTH
    from_right = right + (left - right) * THIRD + (right - far_right) * SIXTH
    return from_left if flux > 0.0 else from_right


@compiled_on_views
def _upwind_downstream(flux: float, far_left: float, left: float, right: float) -> float:
    """The same where the flux runs downstream; first order against it, so that the Jacobian's blocks stay narrow."""
    return left + (right - left) * THIRD + (left - far_left) * SIXTH if flux > 0.0 else right


@compiled_inside
def _flat(values):
    """Rows and members of (n, rows, m) as one axis."""
    n, rows, m = values.shape
    return values.reshape((n, rows * m))


@compiled_on_views
def _end_of_rows(bend, first: int, size: int, m: int) -> int:
    """Where in a column what lies along one row, and is as long, ends: at its end, where the grid is straight."""
    return size if bend is None else first + m


@compiled_on_views
def _straight_on(out, last, before_it):
    """Values (rows m,) one cell beyond the last: second order where a further neighbour is missing."""
    for t in range(out.size):
        out[t] = 2.0 * last[t] - before_it[t]


@compiled_on_views
def _beyond_outlet(out, last, before_it, carrier):
    """Values (rows m,) one cell beyond the outlet: straight on where water leaves; where it enters, as in the last.

    Straight on, water that enters would be carried from upstream, and whatever disturbs it would grow by |c| / dx.
    """
    for t in range(out.size):
        out[t] = 2.0 * last[t] - before_it[t] if carrier[t] > 0.0 else last[t]


@compiled_on_views
def _carrying(out, flux, depth, other_flux, other_depth):
    """Velocity [m/s] that carries momentum between two faces: their fluxes over their depths."""
    for t in range(out.size):
        out[t] = (flux[t] + other_flux[t]) / (depth[t] + other_depth[t])


@compiled_on_views
def _shear_at_corners(out, m, f, u, v, viscosity, corner, per_x, per_y, bend):
    """h nu (du/dy + dv/dx) [m3/s2] at the corners ((ny + 1) m,) of west-east faces f; none at walls and ends."""
    nx, n = viscosity.shape
    a, b = max(f - 1, 0), min(f, nx - 1)
    out[:m], out[n:] = 0.0, 0.0
    nu_a, nu_b, nu_c, nu_d = viscosity[a, m:], viscosity[b, m:], viscosity[a, :-m], viscosity[b, :-m]
    u_n, u_s, v_e, v_w, depth, found = u[f, m:], u[f, :-m], v[b, m:-m], v[a, m:-m], corner[f, m:-m], out[m:-m]
    stop = 0
    while stop < found.size:
        first, stop = stop, _end_of_rows(bend, stop, found.size, m)
        stretch = _at_face(bend, f, first // m + 1)
        for t in range(first, stop):
            nu = 0.25 * (nu_a[t] + nu_b[t] + nu_c[t] + nu_d[t])
            turn = (u_n[t] - u_s[t]) * per_y + (v_e[t] - v_w[t]) * (per_x / stretch)
            if bend is not None:
                turn += 0.5 * (u_n[t] + u_s[t]) * bend.at_faces[f] / stretch
            found[t] = nu * depth[t] * turn


@compiled_on_views
def _strain_along(out, m, f, u, v, viscosity, cell, per_x, bend):
    """2 h nu du/dx [m3/s2] of the cells (ny m,) of column f; none beyond the outlet."""
    if f == cell.shape[0]:
        out[:] = 0.0
        return
    nu, h, u_e, u_w, v_s, v_n = viscosity[f], cell[f], u[f + 1], u[f], v[f, :-m], v[f, m:]
    stop = 0
    while stop < out.size:
        first, stop = stop, _end_of_rows(bend, stop, out.size, m)
        stretch = _at_cell(bend, f, first // m + 0.5)
        for t in range(first, stop):
            out[t] = 2.0 * (nu[t] * h[t] * (u_e[t] - u_w[t])) * (per_x / stretch)
            if bend is not None:
                turned = 0.5 * (v_s[t] + v_n[t]) * bend.at_cells[f] / stretch
                out[t] -= 2.0 * nu[t] * h[t] * turned


@compiled_on_views
def _beside_x(out, bend, f, m, per_x):
    """1 / (J dx) [1/m] of west-east face f, and (J / that J)^2 at its south and north end [-], into (ny m,) each."""
    per_length, south, north = out
    for j in range(per_length.size // m):
        stretch = _at_face(bend, f, j + 0.5)
        lift_s, lift_n = _at_face(bend, f, j) / stretch, _at_face(bend, f, j + 1) / stretch
        for t in range(j * m, j * m + m):
            per_length[t], south[t], north[t] = per_x / stretch, lift_s * lift_s, lift_n * lift_n


@compiled_on_views
def _beside_y(out, bend, i, m, per_x):
    """The fluxes of `_south_of` for the rows 1 .. ny - 1 of column i, into ((ny - 1) m,) each."""
    per_length, south, north = out
    for j in range(per_length.size // m):
        there, lift_s, lift_n = _south_of(bend, i, j + 1, per_x)
        for t in range(j * m, j * m + m):
            per_length[t], south[t], north[t] = there, lift_s, lift_n


@compiled_on_views
def _south_of(bend, i: int, j: float, per_x: float) -> tuple[float, float, float]:
    """1 / (J dx) [1/m] of the south face of a cell, and J / that J in the cells south and north of it [-]."""
    stretch = _at_cell(bend, i, j)
    return per_x / stretch, _at_cell(bend, i, j - 0.5) / stretch, _at_cell(bend, i, j + 0.5) / stretch


@compiled_on_views
def _with_rows_beyond(out, row, m):
    """Values (rows m,) with the first and the last row twice more at their ends, into out ((rows + 4) m,)."""
    n = row.size
    for t in range(n):
        out[2 * m + t] = row[t]
    for t in range(2 * m):
        out[t], out[n + 2 * m + t] = row[t % m], row[n - m + t % m]


@compiled_on_views
def _rows_around(wide, m):
    """Of such a column what stands two rows and one south of each row, there, and one and two rows north."""
    return wide[: -4 * m], wide[m : -3 * m], wide[2 * m : -2 * m], wide[3 * m : -m], wide[4 * m :]


@compiled_on_views
def _level_drop(out, f, level, outlet_level):
    """Rise of the level [m] over the east face f of cells (ny m,), from the last ones twice that to the outlet."""
    m = outlet_level.size
    for t in range(out.size):
        out[t] = level[min(f, level.shape[0] - 1), t] - level[f - 1, t]
    if f == level.shape[0]:
        for first in range(0, out.size, m):
            for k in range(m):
                out[first + k] = 2.0 * (outlet_level[k] - level[f - 1, first + k])


# Speed [m/s] below which friction becomes linear, so that its derivative exists at rest. Chosen, not measured, below
# what instruments resolve: larger ones add friction to slow water, smaller ones sharpen the bend that Newton meets.
REST_SPEED = 1e-3
# Columns computed together, so that what lies between fits the cache: of 4 to 80, 40 take least for 1 to 16 members. No
# number hangs on it. And those beside them they look at: upwinding looks two columns upstream, and depths of their
# faces one further.
STRIP, HALO = 40, 3


@compiled_on_views
def _neighbours_of_u(far, near, east, f, u, carrier, flux, face, cell):
    """u [m/s] two faces and one west of face f and one east of it, (ny m,) each; where a side is nearer, into what is
    given.

    On the west side the depth is not known, so that the first cell counts by the velocity in its middle: by its flux
    over its depth, at least half of that of its face.
    """
    nx, n = cell.shape
    if f == nx:
        _beyond_outlet(east, u[nx], u[nx - 1], carrier)
    if f == 1:
        for t in range(n):
            # At a waterline no water is as fast as the flux over the depth of a cell far thinner than its face.
            thick = max(cell[0, t], 0.5 * face[1, t])
            near[t] = (flux[0, t] + flux[1, t]) / thick - u[1, t]
    west = u[f - 1] if f > 1 else near
    if f <= 2:
        _straight_on(far, west, u[f])
    return u[f - 2] if f > 2 else far, west, u[f + 1] if f < nx else east


@compiled_on_views
def _turned(out, values):
    for t in range(out.size):
        out[t] = -values[t]


@compiled_on_views
def _neighbours_of_v(far, near, east, m, i, v, carrier):
    """v [m/s] two columns and one west of column i and one east of it, ((ny + 1) m,) each; where a side is nearer, into
    what is given.

    Water enters through the west side with no velocity across: beyond it v has the other sign.
    """
    last = v.shape[0] - 1
    if i == last:
        _beyond_outlet(east[m:-m], v[i, m:-m], v[max(i - 1, 0), m:-m], carrier)
    if i == 0:
        _turned(near, v[0])
        _straight_on(far, near, v[0])
    if i == 1:
        _turned(far, v[0])
    return v[i - 2] if i > 1 else far, v[i - 1] if i > 0 else near, v[i + 1] if i < last else east


@compiled_on_views
def _momentum_x(
    out, offset, first, stop, level, u, v, wet, drag, viscosity, outlet, outlet_level, film, dx, dy, bend, work
):
    """Rate R_u [m/s2] on the east faces of columns first .. stop - 1, into out[offset ..]; wet = depths and fluxes.
    Of `work`, (14, (ny + 5) m), nothing is kept from one call to the next.
    """
    per_x, per_y, half_per_film = 1.0 / dx, 1.0 / dy, 0.5 / film
    cell, face_x, face_y, corner, flux_x, flux_y = wet
    (nx, n), ny, m = level.shape, outlet.size, outlet_level.size
    west, east, before, behind, drop = work[0, :n], work[1, :n], work[2, :n], work[3, :n], work[4, :n]
    side, shear, wide = work[5, : n + m], work[6, : n + m], work[7, : n + 4 * m]
    ends = work[8, :n], work[9, :n], work[10, :n]
    lengths = work[11, :n], work[12, :n], work[13, :n]
    _beside_x(lengths, bend, first + 1, m, per_x)
    _carrying(east, flux_x[first], face_x[first], flux_x[first + 1], face_x[first + 1])
    _strain_along(behind, m, first, u, v, viscosity, cell, per_x, bend)
    for f in range(first + 1, stop + 1):
        a, b, f2 = f - 1, min(f, nx - 1), min(f + 1, nx)
        west, east, before, behind = east, west, behind, before
        _carrying(east, flux_x[f], face_x[f], flux_x[f2], face_x[f2])
        of_u = _neighbours_of_u(ends[0], ends[1], ends[2], f, u, east, flux_x, face_x, cell)
        _strain_along(behind, m, f, u, v, viscosity, cell, per_x, bend)
        _carrying(side, flux_y[a], face_y[a], flux_y[b], face_y[b])
        _shear_at_corners(shear, m, f, u, v, viscosity, corner, per_x, per_y, bend)
        _level_drop(drop, f, level, outlet_level)
        _with_rows_beyond(wide, u[f], m)
        if bend is not None:
            _beside_x(lengths, bend, f, m, per_x)
        _u_of_column(
            out[offset + a - first, 2],
            (*_rows_around(wide, m), *of_u),
            (west, east, side[:-m], side[m:]),
            (v[a, :-m], v[a, m:], v[b, :-m], v[b, m:]),
            (before, behind, shear[:-m], shear[m:], per_y),
            (drag[a], drag[b], cell[a], cell[b], face_x[f], drop, half_per_film),
            lengths,
            bend,
            f,
            dx,
        )
        if f == nx:
            for j in range(ny):
                if not outlet[j]:
                    for t in range(j * m, j * m + m):
                        out[offset + a - first, 2, t] = u[f, t]


@compiled_on_views
def _u_of_column(out, of_u, carriers, of_v, stresses, column, lengths, bend, f, dx):
    """`_momentum_x` of one column; all are (ny m,) but per_y and half_per_film."""
    u_ss, u_s1, u_here, u_n1, u_nn, u_ww, u_w1, u_e1 = of_u
    c_west, c_east, c_south, c_north = carriers
    v_1, v_2, v_3, v_4 = of_v
    before, behind, shear_s, shear_n, per_y = stresses
    drag_a, drag_b, cell_a, cell_b, face, drop, half_per_film = column
    per_length, lift_s, lift_n = lengths
    for t in range(out.size):
        here = u_here[t]
        c_w, c_e, c_s, c_n = c_west[t], c_east[t], c_south[t], c_north[t]
        u_w = _upwind_downstream(c_w, u_ww[t], u_w1[t], here)
        u_e = _upwind_downstream(c_e, u_w1[t], here, u_e1[t])
        u_s = _upwind(c_s, u_ss[t], u_s1[t], here, u_n1[t])
        u_n = _upwind(c_n, u_s1[t], here, u_n1[t], u_nn[t])
        carried = (c_e * (u_e - here) - c_w * (u_w - here)) * per_length[t] + (
            c_n * (u_n - here) - c_s * (u_s - here)
        ) * per_y
        mixed = (behind[t] - before[t]) * per_length[t] + (lift_n[t] * shear_n[t] - lift_s[t] * shear_s[t]) * per_y
        across = 0.25 * (v_1[t] + v_2[t] + v_3[t] + v_4[t])
        if bend is not None:
            carried -= bend.at_faces[f] * dx * per_length[t] * here * across
        speed = math.sqrt(here * here + across * across + REST_SPEED * REST_SPEED)
        stress = drag_a[t] * cell_a[t] + drag_b[t] * cell_b[t]
        moved = carried * afloat(face[t], half_per_film)
        pulled = (stress * speed * here - 2.0 * mixed) / (cell_a[t] + cell_b[t])
        out[t] = moved + GRAVITY * drop[t] * per_length[t] + pulled


@compiled_on_views
def _momentum_y(out, offset, first, stop, m, level, u, v, wet, drag, viscosity, film, dx, dy, bend, work):
    """Rate R_v [m/s2] on the south faces of columns first .. stop - 1, into out[offset ..]; rows 1 .. ny - 1 only;
    work as `_momentum_x`.
    """
    per_x, per_y, half_per_film = 1.0 / dx, 1.0 / dy, 0.5 / film
    cell, face_x, face_y, corner, flux_x, flux_y = wet
    n = level.shape[1]
    west, east, side, strain = work[0, : n - m], work[1, : n - m], work[2, :n], work[3, :n]
    before, behind, wide = work[4, : n + m], work[5, : n + m], work[6, : n + 5 * m]
    ends = work[7, : n + m], work[8, : n + m], work[9, : n + m]
    lengths = work[10, : n - m], work[11, : n - m], work[12, : n - m]
    for t in range(n):
        strain[t] = 0.0
    _beside_y(lengths, bend, first, m, per_x)
    _carrying(east, flux_x[first, :-m], face_x[first, :-m], flux_x[first, m:], face_x[first, m:])
    _shear_at_corners(behind, m, first, u, v, viscosity, corner, per_x, per_y, bend)
    for i in range(first, stop):
        f = i + 1
        west, east, before, behind = east, west, behind, before
        _carrying(east, flux_x[f, :-m], face_x[f, :-m], flux_x[f, m:], face_x[f, m:])
        v1, v2, v3 = _neighbours_of_v(ends[0], ends[1], ends[2], m, i, v, east)
        _shear_at_corners(behind, m, f, u, v, viscosity, corner, per_x, per_y, bend)
        _carrying(side, flux_y[i, :-m], face_y[i, :-m], flux_y[i, m:], face_y[i, m:])
        _with_rows_beyond(wide, v[i], m)
        if bend is not None:
            _strain_along(strain, m, i, u, v, viscosity, cell, per_x, bend)
            _beside_y(lengths, bend, i, m, per_x)
        _v_of_column(
            out[offset + i - first, 1, m:],
            (*_rows_around(wide[m:-m], m), v1[m:-m], v2[m:-m], v3[m:-m]),
            (west, east, side[:-m], side[m:]),
            (u[i, m:], u[f, m:], u[i, :-m], u[f, :-m]),
            (before[m:-m], behind[m:-m], strain[:-m], strain[m:], viscosity[i, :-m], viscosity[i, m:], per_y),
            (drag[i, :-m], drag[i, m:], cell[i, :-m], cell[i, m:], face_y[i, m:-m], half_per_film),
            (level[i, :-m], level[i, m:]),
            lengths,
            bend,
            i,
            dx,
        )


@compiled_on_views
def _v_of_column(out, of_v, carriers, of_u, stresses, column, levels, lengths, bend, i, dx):
    """`_momentum_y` of one column; all are ((ny - 1) m,) but per_y and half_per_film."""
    v_ss, v_s1, v_here, v_n1, v_nn, v_ww, v_w1, v_e1 = of_v
    c_west, c_east, c_south, c_north = carriers
    u_1, u_2, u_3, u_4 = of_u
    before, behind, strain_s, strain_n, nu_s, nu_n, per_y = stresses
    drag_s, drag_n, cell_s, cell_n, face, half_per_film = column
    level_s, level_n = levels
    per_length, lift_s, lift_n = lengths
    for t in range(out.size):
        here = v_here[t]
        c_s, c_n, c_w, c_e = c_south[t], c_north[t], c_west[t], c_east[t]
        v_s = _upwind(c_s, v_ss[t], v_s1[t], here, v_n1[t])
        v_n = _upwind(c_n, v_s1[t], here, v_n1[t], v_nn[t])
        v_w = _upwind_downstream(c_w, v_ww[t], v_w1[t], here)
        v_e = _upwind_downstream(c_e, v_w1[t], here, v_e1[t])
        carried = (c_e * (v_e - here) - c_w * (v_w - here)) * per_length[t] + (
            c_n * (v_n - here) - c_s * (v_s - here)
        ) * per_y
        t_n = nu_n[t] * cell_n[t] * (v_n1[t] - here)
        t_s = nu_s[t] * cell_s[t] * (here - v_s1[t])
        mixed = (behind[t] - before[t]) * per_length[t] + 2.0 * (lift_n[t] * t_n - lift_s[t] * t_s) * per_y * per_y
        along = 0.25 * (u_1[t] + u_2[t] + u_3[t] + u_4[t])
        if bend is not None:
            carried += bend.at_cells[i] * dx * per_length[t] * along * along
            mixed += bend.at_cells[i] * dx * per_length[t] * 0.5 * (strain_n[t] + strain_s[t])
        speed = math.sqrt(here * here + along * along + REST_SPEED * REST_SPEED)
        stress = drag_n[t] * cell_n[t] + drag_s[t] * cell_s[t]
        slope = (level_n[t] - level_s[t]) * per_y
        moved = carried * afloat(face[t], half_per_film)
        pulled = (stress * speed * here - 2.0 * mixed) / (cell_n[t] + cell_s[t])
        out[t] = moved + GRAVITY * slope + pulled


@compiled
def _continuity(out, offset, first, stop, m, flux_x, flux_y, dx, dy, bend):
    """Rate R_level = d(hu)/dx + d(hv)/dy [m/s] of columns first .. stop - 1, into out[offset ..]."""
    per_x, per_y = 1.0 / dx, 1.0 / dy
    for i in range(first, stop):
        west, east, south, north = flux_x[i], flux_x[i + 1], flux_y[i, :-m], flux_y[i, m:]
        found, end = out[offset + i - first, 0], 0
        while end < found.size:
            begin, end = end, _end_of_rows(bend, end, found.size, m)
            j = begin // m
            stretch = _at_cell(bend, i, j + 0.5)
            lift_s, lift_n = _at_cell(bend, i, j) / stretch, _at_cell(bend, i, j + 1) / stretch
            for t in range(begin, end):
                along = (east[t] - west[t]) * (per_x / stretch)
                found[t] = along + (lift_n * north[t] - lift_s * south[t]) * per_y


@compiled
def push(out, depth, x, y, xx, xy, yy, film, dx, dy, bend):
    """R_u -= f_x - (1/h) div(h T) on east faces and R_v alike on south faces, in place.

    h of a face is the mean of its cells. Nothing is carried through the sides of the grid. Faded out in the film on dry
    land like advection.

    Parameters
    ----------
    out, depth : (nx, 3, ny, m) [m/s, m/s2], (nx, ny, m) [m]
        R and h.
    x, y, xx, xy, yy : (nx, ny, m) [m/s2, m3/s2], or empty
        f and h T at cell centres.
    film, dx, dy : [m]
    bend : Bend or None
    """
    nx, ny, m = depth.shape
    half_per_film = 0.5 / film
    along, across = _pushed_at_centres(depth, x, y, xx, xy, dx, dy, bend)
    for i in range(nx):
        for j in range(ny):
            _, lift_s, lift_n = _south_of(bend, i, j, 1.0)
            length = dx * _at_face(bend, i + 1, j + 0.5)
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


@compiled_inside
def _pushed_at_centres(depth, x, y, xx, xy, dx, dy, bend):
    """h f_x - d(h T_xy)/dy and h f_y - d(h T_xy)/dx at cell centres [m2/s2], (nx, ny, m) each."""
    nx, ny, m = depth.shape
    along, across = np.zeros((nx, ny, m)), np.zeros((nx, ny, m))
    for i in range(nx):
        before, after = max(i - 1, 0), min(i + 1, nx - 1)
        for j in range(ny):
            stretch = _at_cell(bend, i, j + 0.5)
            lift_s, lift_n = _at_cell(bend, i, j - 0.5) / stretch, _at_cell(bend, i, j + 1.5) / stretch
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
    """u and v on the faces of columns first .. stop - 1; on the sides q/h of what enters there.

    Parameters
    ----------
    state, cell : (nx, 3, ny, m), (stop - first, ny, m) [m]
        A state, and depths of these columns.
    west, south, north : (ny, m), (nx, m), (nx, m) [m2/s]
        Fluxes q through the sides, positive into the domain.

    Returns
    -------
    u, v : (stop - first + 1, ny, m), (stop - first, ny + 1, m) [m/s]
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
    """R(state), (nx, 3, ny, m) [m/s, m/s2], without rough walls, confluences, lateral inflow and what effects push.

    Strip by strip so that what lies between fits the cache.

    Parameters
    ----------
    state, bed, rise, half_range, film, smallest, outlet_level
        A state (nx, 3, ny, m), and the rest as `wet_and_dry.depths`.
    drag, viscosity : (nx, ny, m) [1/m, m2/s]
        k and nu at cell centres.
    west, south, north
        As `velocities`.
    outlet : (ny,)
        Rows of the east side that are the outlet; R_u is u on the others.
    dx, dy : [m]
    bend : Bend or None
    """
    nx, _, ny, m = state.shape
    out, friction, mixing = np.empty((nx, 3, ny * m)), _flat(drag), _flat(viscosity)
    work = np.empty((14, ny * m + 5 * m))
    for first in range(0, nx, STRIP):
        stop = min(first + STRIP, nx)
        a, b = max(first - HALO, 0), min(stop + HALO, nx)
        level = state[a:b, 0].copy()
        cell, face_x, face_y, corner = depths(level, bed[a:b], rise[a:b], half_range[a:b], film, smallest, outlet_level)
        u, v = velocities(state, a, b, cell, west, south, north)
        flux_x, flux_y, flow = _flat(face_x * u), _flat(face_y * v), (_flat(level), _flat(u), _flat(v))
        wet = (_flat(cell), _flat(face_x), _flat(face_y), _flat(corner), flux_x, flux_y)
        lo, hi, here, law = first - a, stop - a, _columns_of(bend, a, b), (friction[a:b], mixing[a:b])
        _continuity(out, first, lo, hi, m, flux_x, flux_y, dx, dy, here)
        _momentum_y(out, first, lo, hi, m, *flow, wet, *law, film, dx, dy, here, work)
        _momentum_x(out, first, lo, hi, *flow, wet, *law, outlet, outlet_level, film, dx, dy, here, work)
        for i in range(first, stop):  # not by slices: to assign arrays takes seconds to compile
            for k in range(m):
                out[i, 1, k] = state[i, 1, 0, k]
    return out.reshape((nx, 3, ny, m))
