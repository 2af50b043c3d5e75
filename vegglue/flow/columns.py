"""Compiled loops over one column of cells: what lies between the state and the rates of momentum (`kernels`).

Rows and members are one axis, (ny m,) for cells: one loop runs over all rows of a column, so that SIMD lanes are full
with one member, too. A neighbour across the channel is m further. `bend` is None on a straight grid.
"""

from vegglue.compilation import compiled
from vegglue.flow.stretch import at_cell, at_face

# Factors, not divisors: a processor divides in the time of some ten products.
THIRD, SIXTH = 1.0 / 3.0, 1.0 / 6.0


@compiled
def upwind(flux: float, far_left: float, left: float, right: float, far_right: float) -> float:
    """Third-order upwind-biased value between `left` and `right` (kappa = 1/3; van Leer 1985)."""
    from_left = left + (right - left) * THIRD + (left - far_left) * SIXTH
    from_right = right + (left - right) * THIRD + (right - far_right) * SIXTH
    return from_left if flux > 0.0 else from_right


@compiled
def upwind_downstream(flux: float, far_left: float, left: float, right: float) -> float:
    """The same where the flux runs downstream; first order against it, so that the Jacobian's blocks stay narrow."""
    return left + (right - left) * THIRD + (left - far_left) * SIXTH if flux > 0.0 else right


@compiled
def flat(values):
    """Rows and members of (n, rows, m) as one axis."""
    n, rows, m = values.shape
    return values.reshape((n, rows * m))


@compiled
def end_of_rows(bend, first, size, m):
    """Where in a column what lies along one row, and is as long, ends: at its end, where the grid is straight."""
    return size if bend is None else first + m


@compiled
def straight_on(out, last, before_it):
    """Values (rows m,) one cell beyond the last: second order where a further neighbour is missing."""
    for t in range(out.size):
        out[t] = 2.0 * last[t] - before_it[t]


@compiled
def beyond_outlet(out, last, before_it, carrier):
    """Values (rows m,) one cell beyond the outlet: straight on where water leaves; where it enters, as in the last.

    Straight on, water that enters would be carried from upstream, and whatever disturbs it would grow by |c| / dx.
    """
    for t in range(out.size):
        out[t] = 2.0 * last[t] - before_it[t] if carrier[t] > 0.0 else last[t]


@compiled
def carrying(out, flux, depth, other_flux, other_depth):
    """Velocity [m/s] that carries momentum between two faces: their fluxes over their depths."""
    for t in range(out.size):
        out[t] = (flux[t] + other_flux[t]) / (depth[t] + other_depth[t])


@compiled
def shear_at_corners(out, m, f, u, v, viscosity, corner, per_x, per_y, bend):
    """h nu (du/dy + dv/dx) [m3/s2] at the corners ((ny + 1) m,) of west-east faces f; none at walls and ends."""
    nx, n = viscosity.shape
    a, b = max(f - 1, 0), min(f, nx - 1)
    out[:m], out[n:] = 0.0, 0.0
    nu_a, nu_b, nu_c, nu_d = viscosity[a, m:], viscosity[b, m:], viscosity[a, :-m], viscosity[b, :-m]
    u_n, u_s, v_e, v_w, depth, found = u[f, m:], u[f, :-m], v[b, m:-m], v[a, m:-m], corner[f, m:-m], out[m:-m]
    stop = 0
    while stop < found.size:
        first, stop = stop, end_of_rows(bend, stop, found.size, m)
        stretch = at_face(bend, f, first // m + 1)
        for t in range(first, stop):
            nu = 0.25 * (nu_a[t] + nu_b[t] + nu_c[t] + nu_d[t])
            turn = (u_n[t] - u_s[t]) * per_y + (v_e[t] - v_w[t]) * (per_x / stretch)
            if bend is not None:
                turn += 0.5 * (u_n[t] + u_s[t]) * bend.at_faces[f] / stretch
            found[t] = nu * depth[t] * turn


@compiled
def strain_along(out, m, f, u, v, viscosity, cell, per_x, bend):
    """2 h nu du/dx [m3/s2] of the cells (ny m,) of column f; none beyond the outlet."""
    if f == cell.shape[0]:
        out[:] = 0.0
        return
    nu, h, u_e, u_w, v_s, v_n = viscosity[f], cell[f], u[f + 1], u[f], v[f, :-m], v[f, m:]
    stop = 0
    while stop < out.size:
        first, stop = stop, end_of_rows(bend, stop, out.size, m)
        stretch = at_cell(bend, f, first // m + 0.5)
        for t in range(first, stop):
            out[t] = 2.0 * (nu[t] * h[t] * (u_e[t] - u_w[t])) * (per_x / stretch)
            if bend is not None:
                turned = 0.5 * (v_s[t] + v_n[t]) * bend.at_cells[f] / stretch
                out[t] -= 2.0 * nu[t] * h[t] * turned


@compiled
def beside_x(out, bend, f, m, per_x):
    """1 / (J dx) [1/m] of west-east face f, and (J / that J)^2 at its south and its north end [-], into (3, ny m)."""
    for j in range(out.shape[1] // m):
        stretch = at_face(bend, f, j + 0.5)
        lift_s, lift_n = at_face(bend, f, j) / stretch, at_face(bend, f, j + 1) / stretch
        for t in range(j * m, j * m + m):
            out[0, t], out[1, t], out[2, t] = per_x / stretch, lift_s * lift_s, lift_n * lift_n


@compiled
def beside_y(out, bend, i, m, per_x):
    """What `south_of` says of the rows 1 .. ny - 1 of column i, into (3, (ny - 1) m)."""
    for j in range(out.shape[1] // m):
        per_length, lift_s, lift_n = south_of(bend, i, j + 1, per_x)
        for t in range(j * m, j * m + m):
            out[0, t], out[1, t], out[2, t] = per_length, lift_s, lift_n


@compiled
def south_of(bend, i, j, per_x):
    """1 / (J dx) [1/m] of the south face of a cell, and J / that J in the cells south and north of it [-]."""
    stretch = at_cell(bend, i, j)
    return per_x / stretch, at_cell(bend, i, j - 0.5) / stretch, at_cell(bend, i, j + 0.5) / stretch


@compiled
def with_rows_beyond(out, row, m):
    """Values (rows m,) with the first and the last row twice more at their ends, into out ((rows + 4) m,)."""
    n = row.size
    for t in range(n):
        out[2 * m + t] = row[t]
    for t in range(2 * m):
        out[t], out[n + 2 * m + t] = row[t % m], row[n - m + t % m]


@compiled
def rows_around(wide, m):
    """Of such a column what stands two rows and one south of each row, there, and one and two rows north."""
    return wide[: -4 * m], wide[m : -3 * m], wide[2 * m : -2 * m], wide[3 * m : -m], wide[4 * m :]


@compiled
def level_drop(out, f, level, outlet_level):
    """Rise of the level [m] over the east face f of cells (ny m,), from the last ones twice that to the outlet."""
    m = outlet_level.size
    for t in range(out.size):
        out[t] = level[min(f, level.shape[0] - 1), t] - level[f - 1, t]
    if f == level.shape[0]:
        for first in range(0, out.size, m):
            for k in range(m):
                out[first + k] = 2.0 * (outlet_level[k] - level[f - 1, first + k])
