"""Scales of a site, and an effect whose sizes are made of them: numbers of the library are multiples of these, so that
one entry holds for a flume of 2 cm of water and for a river of 10 m.
"""

from dataclasses import dataclass, replace

from vegglue.effects.definition import Amplitude, Effect, Shape

# Significant digits of a size in its unit: a person reads it, and coarser cells of a case give the same.
SIZE_DIGITS = 2
# Diameter of a stem over the height of its plant [-]: shrubs and reeds of 1 to 2 m have stems of some centimetre.
SLENDER = 0.01
# Error of the slope of a bed that is stated by its numbers, over the slope of the flow [-]. Chosen, not measured.
SLOPE_ERROR = 0.2
# Half width of a spot over that of the floor [-].
SPOT_WIDTH = 0.3


@dataclass(frozen=True)
class SiteScales:
    """Sizes of a site and of its flow, as means over the experiments.

    Parameters
    ----------
    depth
        Depth on the floor h [m].
    mean_depth
        Area over width of the wet cross-section A / B [m].
    half_width
        Half width of the floor b [m].
    speed
        U = Q / A [m/s].
    shear_velocity
        u* = (g h S)^(1/2) [m/s].
    slope
        S [-]: that of the bed where the friction of the prior can balance it, else that of its middle.
    slope_error
        Standard error of the slope of the bed [-]: SLOPE_ERROR of a stated slope; of a surveyed bed, one end of the
        reach a standard error of a point higher than the other.
    discharge
        Q [m3/s].
    viscosity
        Eddy viscosity of the case, its number or the middle of its prior [m2/s].
    canopy
        Height of the plants [m], half the depth without any.
    patch_length, patch_width
        Of the patches along and across [m], the medians; of the floor without any.
    banks
        Whether cells lie beyond the toe of banks.
    two_streams
        Whether even ground under water is of two kinds: floor and floodplain, or two surfaces.
    """

    depth: float
    mean_depth: float
    half_width: float
    speed: float
    shear_velocity: float
    slope: float
    slope_error: float
    discharge: float
    viscosity: float
    canopy: float
    patch_length: float
    patch_width: float
    banks: bool = True
    two_streams: bool = False

    def of(self, name: str) -> float:
        """A scale by the name that `of` of an amplitude or a shape gives, in its unit; those that are made of others:

        eddy h u* [m2/s]; friction (u*/U)^2 / h [1/m]; slowness 1/U [s/m]; tilt h/b [-]; stem, its diameter [m]; object
        1/(2 l) [1/m], the drag per length of a cylinder of C_D = 1 as long as a spot of half length l = SPOT_WIDTH b.
        """
        made = {
            "eddy": self.depth * self.shear_velocity,
            "friction": (self.shear_velocity / self.speed) ** 2 / self.depth,
            "slowness": 1.0 / self.speed,
            "tilt": self.depth / self.half_width,
            "stem": SLENDER * self.canopy,
            "object": 1.0 / (2.0 * SPOT_WIDTH * self.half_width),
        }
        return made[name] if name in made else float(getattr(self, name))


def rounded(value: float) -> float:
    """To SIZE_DIGITS significant digits."""
    return float(f"{value:.{SIZE_DIGITS}g}")


def has_scales(effect: Effect) -> bool:
    """Whether any of its numbers is a multiple of a scale."""
    return bool(effect.amplitude.of or effect.amplitude.low_of or any(shape.of for shape in effect.shapes))


def at_site(effect: Effect, scales: SiteScales) -> Effect:
    """The effect with its numbers in their units: multiples of the scales that `of` names are multiplied by these.

    Parameters
    ----------
    effect : Effect
        Of the library.
    scales : SiteScales
        Of the site.
    """
    if not has_scales(effect):
        return effect

    def of_amplitude(one: Amplitude) -> Amplitude:
        unit = scales.of(one.of) if one.of else 1.0
        lowest = scales.of(one.low_of) if one.low_of else unit
        return replace(
            one, scale=rounded(unit * one.scale), low=rounded(lowest * one.low), high=rounded(unit * one.high),
            off=unit * one.off, of="", low_of="",
        )  # fmt: skip

    def of_shape(one: Shape) -> Shape:
        if not one.of:
            return one
        unit, grid = scales.of(one.of), one.grid
        tried = tuple(rounded(unit * value) for value in grid)
        return replace(
            one, default=rounded(unit * one.default), low=rounded(unit * one.low), high=rounded(unit * one.high),
            grid=tried, of="",
        )  # fmt: skip

    return replace(effect, amplitude=of_amplitude(effect.amplitude), shapes=tuple(map(of_shape, effect.shapes)))
