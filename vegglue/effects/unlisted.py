"""Something of no named kind at one place: what a diagnosis tries where no effect of the library fits.

All but one are a spot exp(-((x - x_0) / l)^2 - ((y - y_0) / w)^2) in one term of the equations; plants that are not on
the map fill a rectangle. A barrier is a spot so wide that it is even across the channel. Parameters are (m,); unit and
meaning of each stand in EFFECTS.
"""

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Act, Amplitude, Effect, Shape, Stage
from vegglue.effects.physical_constants import KARMAN
from vegglue.effects.scales import SPOT_WIDTH
from vegglue.effects.surroundings import Cells, ChannelGeometry


def spot(geometry: ChannelGeometry, x: Array, y: Array, length: Array, width: Array) -> Array:
    """exp(-((x - x_0) / l)^2 - ((y - y_0) / w)^2) (nx, ny, m) [-].

    Parameters
    ----------
    x, y, length, width : (m,) [m]
        x_0, y_0, l and w.
    """
    return np.asarray(np.exp(-(((geometry.x - x) / length) ** 2) - ((geometry.y - y) / width) ** 2))


def unlisted_object(cells: Cells, drag: Array, **place: Array) -> dict[str, Array]:
    """k -> k + c spot [1/m]; below 0 it pushes, as a jet does."""
    return {"rate": cells.rate + drag * spot(cells.geometry, **place)}


def rectangle(geometry: ChannelGeometry, x: Array, y: Array, length: Array, width: Array, angle: Array) -> Array:
    """Share of each cell within a rectangle (nx, ny, m) [-], its edges as wide as a cell.

        P = p(s, l, dx) p(n, w, dy),   p(s, l, d) = (tanh(2 (s + l) / d) - tanh(2 (s - l) / d)) / 2

    s and n are the distances from its middle along and across it: every parameter has a derivative.

    Parameters
    ----------
    x, y, length, width : (m,) [m]
        Its middle, and half of its sides l and w.
    angle : (m,) [degrees]
        Of s to x, positive towards larger y.
    """
    turned, east, north = np.deg2rad(angle), geometry.x - x, geometry.y - y
    along = east * np.cos(turned) + north * np.sin(turned)
    across = north * np.cos(turned) - east * np.sin(turned)
    share = np.ones(1)
    for distance, half, cell in ((along, length, geometry.dx), (across, width, geometry.dy)):
        share = share * 0.5 * (np.tanh(2.0 * (distance + half) / cell) - np.tanh(2.0 * (distance - half) / cell))
    return np.asarray(share)


def unlisted_patch(cells: Cells, drag: Array, height: Array, proportional: Array, **outline: Array) -> dict[str, Array]:
    """k -> k + P (k_v(phi) - k_v(0)), P the share of a cell within a rectangle, by the law of Baptist et al. (2007).

        (h k_v)^(-1/2) = (h k_b + phi/2)^(-1/2) + ln(max(h/H, 1)) / kappa

    phi = C_D m D H, or phi h/H where plants stand out of the water if `proportional` is 1, see `numerics.emergent`.
    """
    depth, of_bed = cells.depth, cells.depth * cells.bed_rate
    emerged = np.minimum(depth / height, 1.0)
    resisted = of_bed + 0.5 * drag * (1.0 - proportional * (1.0 - emerged))
    above = np.log(np.maximum(depth / height, 1.0)) / KARMAN
    planted, bare = (((resistance**-0.5 + above) ** -2.0) / depth for resistance in (resisted, of_bed))
    return {"rate": cells.rate + rectangle(cells.geometry, **outline) * (planted - bare)}


def unlisted_barrier(cells: Cells, loss: Array, **place: Array) -> dict[str, Array]:
    """k -> k + K / (2 pi^(1/2) l) spot [1/m], w far beyond the banks: along x the head falls by K u^2 / 2g in all."""
    over = 2.0 * np.sqrt(np.pi) * place["length"]
    return {"rate": cells.rate + loss / over * spot(cells.geometry, **place)}


def unlisted_bed(geometry: ChannelGeometry, rise: Array, **place: Array) -> dict[str, Array]:
    """z_b -> z_b + dz spot [m]."""
    return {"bed": rise * spot(geometry, **place)}


def unlisted_inflow(geometry: ChannelGeometry, discharge: Array, **place: Array) -> dict[str, Array]:
    """q -> q + Q spot / (pi l w) [m/s], without momentum."""
    area = np.pi * place["length"] * place["width"]
    return {"inflow": discharge * spot(geometry, **place) / (area * geometry.stretch)}


def unlisted_viscosity(cells: Cells, viscosity: Array, **place: Array) -> dict[str, Array]:
    """nu -> max(nu + n spot, 0) [m2/s]."""
    added = viscosity * spot(cells.geometry, **place)
    return {"viscosity": np.maximum(added, -cells.viscosity)}


PLACE = (
    Shape("x", "m", "where along the channel", 0.0, -1e5, 1e5),
    Shape("y", "m", "where across it", 0.0, -1e5, 1e5),
    Shape("length", "m", "its half length l", SPOT_WIDTH, 0.006, 1e4, of="half_width"),
    Shape("width", "m", "its half width w", SPOT_WIDTH, 0.006, 1e4, of="half_width"),
)
# Half length of a barrier over the depth, and half width over that of the grid [-]: within 2 % even across it.
BARRIER_LENGTH, BARRIER_WIDTH = 1.0, 7.0
BARRIER = (
    *PLACE[:2],
    Shape("length", "m", "half length l over which the head falls", BARRIER_LENGTH, 0.006, 1e4, of="depth"),
    Shape("width", "m", "half width w, far beyond the banks", BARRIER_WIDTH, 0.006, 1e6, of="half_width"),
)
OPENINGS = (
    "Borda and Carnot: K = (r - 1)^2, water that passes openings r times as fast as u; r = 5 if a third of the section "
    "is open and contracts to 0.6"
)
SPOT = "exp(-((x - x_0) / l)^2 - ((y - y_0) / w)^2)"


OUTLINE = (
    *PLACE[:2],
    Shape("length", "m", "half its length l", 0.5, 0.006, 1e4, of="patch_length"),
    Shape("width", "m", "half its width w", 0.5, 0.006, 1e4, of="patch_width"),
    Shape("angle", "deg", "by which it turns from x towards y", 0.0, -90.0, 90.0),
    Shape("height", "m", "height H of its plants", 1.0, 0.006, 1e4, of="canopy"),
    Shape("proportional", "-", "1 if phi falls with the depth of plants that stand out of the water", 0.0, 0.0, 1.0),
)


def _at_place(
    name: str, stage: Stage, title: str, equation: str, act: Act, amplitude: Amplitude,
    shapes: tuple[Shape, ...] = PLACE,
) -> Effect:  # fmt: skip
    return Effect(
        name, stage, title, equation, act, amplitude, shapes,
        source="definition", checked=True, mirrored=False, tags=("search",),
    )  # fmt: skip


EFFECTS = (
    _at_place(
        "unlisted_object",
        "resistance",
        "Something holds the flow back (or pushes it on) at one place",
        f"k -> k + c {SPOT}",
        unlisted_object,
        Amplitude("drag", "1/m", "drag c of the object per length of flow through it", 0.5, -5.0, 50.0, of="object"),
    ),
    _at_place(
        "unlisted_patch",
        "resistance",
        "Plants stand that are not on the map",
        "k -> k + P (k_v(phi, H) - k_v(0, H)), P the share within 2l by 2w around x_0, y_0",
        unlisted_patch,
        Amplitude("drag", "-", "drag phi of the plants", 3.0, 0.0, 100.0),
        OUTLINE,
    ),
    _at_place(
        "unlisted_barrier",
        "resistance",
        "An obstacle lies across the whole channel",
        f"k -> k + K/(2 pi^(1/2) l) {SPOT}, w far beyond the banks: a loss of head of K u^2/2g",
        unlisted_barrier,
        Amplitude("loss", "-", "loss coefficient K, by the velocity there", 16.0, 0.0, 1000.0, basis=OPENINGS),
        BARRIER,
    ),
    _at_place(
        "unlisted_bed",
        "site",
        "The bed lies higher (or lower) than surveyed at one place",
        f"z_b -> z_b + dz {SPOT}",
        unlisted_bed,
        Amplitude("rise", "m", "how much higher the bed lies there than surveyed", 0.1, -2.0, 2.0, of="depth"),
    ),
    _at_place(
        "unlisted_inflow",
        "site",
        "Water enters (or leaves) at one place",
        f"q -> q + Q/(pi l w) {SPOT}, without momentum",
        unlisted_inflow,
        Amplitude("discharge", "m3/s", "discharge Q that enters there", 0.05, -20.0, 20.0, of="discharge"),
    ),
    _at_place(
        "unlisted_viscosity",
        "exchange",
        "The water mixes more (or less) at one place",
        f"nu -> nu + n {SPOT}",
        unlisted_viscosity,
        Amplitude("viscosity", "m2/s", "additional viscosity n in the middle of it", 0.3, -5.0, 50.0, of="eddy"),
    ),
)
