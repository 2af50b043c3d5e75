"""What was taken from a file, left out or assumed, as values; their words stand in `wording/templates/imports.j2`."""

from dataclasses import dataclass
from enum import StrEnum, auto


class Noted(StrEnum):
    """What a note is about; the comment gives its `number` and `names`."""

    NO_UNIT = auto()  # roles
    HEIGHT_FROM_DEPTHS = auto()
    EDGES = auto()  # how many
    ON_TAPE = auto()  # its length [m]
    SAME_X = auto()  # [m]
    COMPONENTS = auto()
    SPEED_TWICE = auto()
    INTO_CHANNEL = auto()  # number: 1 along a centreline
    VELOCITIES_TURNED = auto()
    OF_PROBE = auto()
    KEPT_NINES = auto()  # the number as written, the heading
    MARKS = auto()  # how many; the heading
    EMPTY = auto()  # how many; the heading
    LACKING = auto()  # how many; roles
    UNNAMED_SECTIONS = auto()  # how many
    ON_AXIS = auto()  # y [m]
    BESIDE_POINTS = auto()  # the kind in words
    NEAR_AVERAGE = auto()  # share of the depth [-]
    HEIGHTS_UNUSED = auto()  # the role of the heights
    SHARES = auto()  # how many
    LEVEL_ONCE = auto()  # sections
    OTHER_WIDTH = auto()  # how many
    UNMEASURED = auto()  # how many
    ERRORS_UNKNOWN = auto()  # how many
    LEVELS_FROM_DEPTHS = auto()  # whose bed
    MOVED = auto()  # at most [m]
    # Of a table.
    DECIMAL_COMMA = auto()
    COMMENTS = auto()  # how many
    TYPES = auto()
    UNITS = auto()
    ROW_NAMES = auto()
    UNHEADED = auto()
    LONE_FIELDS = auto()  # how many lines
    SUMMARIES = auto()  # how many rows; the first of them
    FLAGGED = auto()  # how many rows; the column, and the first of them
    COPIES = auto()  # how many rows
    ONE_SHEET = auto()  # that sheet, and the others
    HIDDEN = auto()  # how many rows; the first of them
    # Of places and directions.
    FACTOR = auto()  # of velocities [-]
    REVERSED = auto()  # the axis
    ZERO_AT = auto()  # x and y [m]
    # Of an instrument.
    SAMPLES = auto()  # how many; the instrument, and their rate [Hz]
    SAMPLES_LOST = auto()  # how many
    CELLS_SOUND = auto()  # how many; of how many
    ADCP_AT = auto()  # its draft [m]; its model
    DECLINATION = auto()  # [degrees]
    BY_GPS = auto()  # how fast the bottom drifts against places by GPS, 0 if it stands still [m/s]
    BOTTOM_BRIDGED = auto()  # the longest way of the boat while the bottom was lost [m]
    DAMAGED = auto()  # how many ensembles
    SURFACE_LAYER = auto()
    ENSEMBLES = auto()  # how many
    ENSEMBLES_LACKING = auto()  # how many; what they lack
    TRANSECTS = auto()  # how many
    QREV_SUMMARY = auto()  # standard error [m3/s]
    IMAGES = auto()  # at how many times; "factor" if none is stated
    # Of another model's result.
    PLACES_LOST = auto()  # how many
    PLACES_DRY = auto()  # how many
    GHOSTS = auto()  # how many
    WITHOUT_BED = auto()  # how many cells
    FEET = auto()
    BELOW_BED = auto()  # how many depths
    OFFSETS = auto()  # both [m]
    CUT_FRAME = auto()
    CLOCKWISE = auto()
    NOTHING = auto()
    # Of a map.
    BEYOND_BED = auto()  # share of the grid [-]
    LAST_FIRST = auto()


@dataclass(frozen=True)
class ImportNote:
    """One note: its kind, a number in SI or a count, and names."""

    kind: Noted
    number: float = 0
    names: tuple[str, ...] = ()


# A note, or the name of the format of the file.
FileNote = ImportNote | str


@dataclass(frozen=True)
class RepeatsAveraged:
    """Repeats of one place.

    Attributes
    ----------
    at : (float, float) or None
        x, y of a single one [m].
    copied : bool
        Whether it has the same value.
    together : float
        Neighbours in a row that count as one.
    needed : int
        Repeats for a standard error, 0 if there are enough.
    apart : float
        By how many times their stated errors they differ at `worst`, 0 if by no more than chance [-].
    worst : (float, float)
        x, y [m].
    """

    repeats: int
    at: tuple[float, float] | None = None
    copied: bool = False
    together: float = 1.0
    needed: int = 0
    apart: float = 0.0
    worst: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class BanksOfBed:
    """Cells steeper than half the stated slope are banks.

    Attributes
    ----------
    slope : float
        From which on they are [-].
    floor, stated : float or None
        Mean width of the others, None without banks, and the stated one [m].
    """

    slope: float
    floor: float | None
    stated: float


@dataclass(frozen=True)
class PatchesRead:
    """Patches of a file.

    Attributes
    ----------
    stems : tuple of str
        Columns of their density.
    lengths, densities : tuple of str
        What has no unit.
    unread : tuple of str
        Columns.
    alike : tuple of str
        Of these what may be the density.
    """

    patches: int
    stems: tuple[str, ...]
    lengths: tuple[str, ...]
    densities: tuple[str, ...]
    unread: tuple[str, ...]
    alike: tuple[str, ...]


@dataclass(frozen=True)
class UnitsAssumed:
    """Columns of polygons without a unit: lengths taken as m, densities as 1/m2."""

    lengths: tuple[str, ...]
    densities: tuple[str, ...]


@dataclass(frozen=True)
class CentrelineTaken:
    """A centreline.

    Attributes
    ----------
    length : float
        [m]
    turn : float
        To the left [degrees].
    radius : float or None
        The least [m], None if straight.
    """

    length: float
    turn: float
    radius: float | None


@dataclass(frozen=True)
class FlowTaken:
    """The flow of a finished run.

    Attributes
    ----------
    places, wet : int
        How many, and how many of them are wet.
    discharge, level : float
        [m3/s], and at the outlet [m].
    """

    code: str
    time: str
    places: int
    wet: int
    discharge: float
    level: float


@dataclass(frozen=True)
class ConfluenceAssumptions:
    """What the set of the confluence does not state.

    Attributes
    ----------
    share, velocity : float
        Errors of velocities [-, m/s].
    level : float
        Error of levels [m].
    wall : float
        Manning's n of the walls [s m^(-1/3)].
    width : float
        Of the side channel [m].
    """

    share: float
    velocity: float
    level: float
    wall: float
    width: float


@dataclass(frozen=True)
class SiteAssumptions:
    """What a site file does not state, and so is assumed; None or False for what it states.

    Attributes
    ----------
    file : str
        Its name.
    viscosity : float or None
        The factor to within which it is known [-].
    canopy : float or None
        Its height [m].
    alike : bool
        Whether patches are equally dense.
    bare : bool
        Whether there are no plants.
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


@dataclass(frozen=True)
class UnreadFiles:
    """Files of a folder that nothing was read of: their names."""

    names: tuple[str, ...]
