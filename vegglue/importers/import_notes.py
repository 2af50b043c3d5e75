"""What was taken from a file, left out or assumed, as values; their words stand in `wording/templates/imports.j2`."""

from dataclasses import dataclass
from enum import Enum


class Noted(Enum):
    """What a note is about; the comment gives its `number` and `names`."""

    NO_UNIT = "no unit stated"  # roles
    HEIGHT_FROM_DEPTHS = "height above the bed from both depths"
    EDGES = "edges without a depth"  # how many
    ON_TAPE = "places along a tape"  # its length [m]
    SAME_X = "x of all rows"  # [m]
    COMPONENTS = "components from speed and direction"
    SPEED_TWICE = "speed beside its components"
    INTO_CHANNEL = "places turned from the map"  # number: 1 along a centreline
    VELOCITIES_TURNED = "velocities turned with their places"
    OF_PROBE = "x and y of the probe"
    KEPT_NINES = "a number of nines kept"  # the number as written, the heading
    MARKS = "marks for no value"  # how many; the heading
    EMPTY = "empty cells"  # how many; the heading
    LACKING = "rows without a value"  # how many; roles
    UNNAMED_SECTIONS = "rows without a section"  # how many
    ON_AXIS = "no column of y"
    BESIDE_POINTS = "values beside points in the vertical"  # the kind in words
    NEAR_AVERAGE = "heights at which a log law has its average"  # share of the depth [-]
    HEIGHTS_UNUSED = "few places with several heights"  # the role of the heights
    SHARES = "shares of the discharge"  # how many
    LEVEL_ONCE = "a level that all rows of a section repeat"  # sections
    OTHER_WIDTH = "rows of another width"  # how many
    UNMEASURED = "rows without a measurement"  # how many
    ERRORS_UNKNOWN = "errors not stated"  # how many
    LEVELS_FROM_DEPTHS = "levels from depths"  # whose bed


@dataclass(frozen=True)
class ImportNote:
    """One note: its kind, a number in SI or a count, and names."""

    kind: Noted
    number: float = 0
    names: tuple[str, ...] = ()


# A note, or the few words of a reader on the form of its file.
FileNote = ImportNote | str


@dataclass(frozen=True)
class SiteAssumptions:
    """What a site file does not state, and so is assumed, None or False for what it states. file: its name; viscosity:
    the factor to within which it is known [-]; canopy: its height [m]; alike: patches equally dense; bare: no plants.
    """

    file: str
    viscosity: float | None
    canopy: float | None
    alike: bool
    bare: bool


@dataclass(frozen=True)
class UnreadKeys:
    """Keys of a site file that are taken as notes. walled: whether the slope of banks is idle beside walls."""

    file: str
    keys: tuple[str, ...]
    walled: bool = False


@dataclass(frozen=True)
class ThickStems:
    """Diameters of stems, which have no key."""


@dataclass(frozen=True)
class CountedStems:
    """Numbers of stems, which have no key."""


@dataclass(frozen=True)
class UnreadHoldout:
    """A held-out file that is not read: without an experiment, or beside another one."""

    file: str
    site: str
    beside: str = ""
