"""Rows of measurements in SI and along the channel, and a line that states what was taken from which column."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from vegglue.arrays import Array, Mask
from vegglue.case.grid import Centreline, along_and_across, heading_at, on_map
from vegglue.case.site_schema import Frame
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import ROLES, UNITS, known_name, unit_in_words, words_of
from vegglue.importers.column_roles import (
    NAMES_OF_BED,
    columns_of_table,
    numbers_of_column,
    taken_as_si,
    unit_of_column,
    without_flagged,
)
from vegglue.importers.file_options import FileOptions
from vegglue.importers.import_notes import FileNote, ImportNote, Noted
from vegglue.importers.table_parser import ParsedTable, parse_table, without_copies
from vegglue.wording.numbers import listed, so_many
from vegglue.wording.sentences import sentences

MOST_UNREAD = 12  # columns without a role that are listed
# Options of other files, which do nothing to a table.
OF_RECORDS = {
    "start": "transects of a boat",
    "line": "tables along a tape",
    "position": "records of a probe",
    "draft": "raw records of a boat",
    "declination": "raw records of a boat",
}
# Places on a map further from a site are none of it, as no reach is so long [m]; digits that maps put in front, such as
# 2 and 1 million of the Swiss ones, come in such steps [m]. How many places are looked at.
FAR, DIGITS_IN_FRONT, PLACES_COMPARED = 2e4, 1e6, 50
# Places of a reach within such a span, below a full turn and finer than a tenth of a millimetre, are degrees.
REACH_IN_DEGREES, FULL_TURN, FINE_DIGITS, FEWEST_PLACES = 0.02, 360.0, 1e-7, 3
# Words of a heading for a bank, and for the one that distances count from.
OF_A_BANK = {"bank", "lb", "rb", "lew", "rew", "ufer", "rive", "orilla", "sponda", "oever"}
BANKS = {
    "left": {"left", "lb", "lew", "linken", "linkes", "links", "linker", "gauche", "izquierda", "sinistra"},
    "right": {"right", "rb", "rew", "rechten", "rechtes", "rechts", "rechter", "droite", "derecha", "destra"},
}
# Pairs of components, those that are named after the map first.
COMPONENTS = (("east_velocity", "north_velocity"), ("u", "v"))


@dataclass(frozen=True)
class Placement:
    """Where a channel lies on the map.

    A place on the map (E, N) is one of the frame (X, Y), and that one lies s along the centreline and n to its left.

    Attributes
    ----------
    frame : Frame or None
        None if the map is that of the model.
    line : Centreline or None
        None of a straight channel.
    """

    frame: Frame | None = None
    line: Centreline | None = None

    @property
    def turned(self) -> bool:
        """Whether the map and the channel have different coordinates."""
        return self.frame is not None or self.line is not None

    def to_channel(self, east: Array, north: Array) -> tuple[Array, Array]:
        """Along and across the channel [m] of places on the map (n,) [m]."""
        x, y = self.frame.to_model(east, north) if self.frame is not None else (east, north)
        return along_and_across(self.line, x, y) if self.line is not None else (x, y)

    def to_case(self, along: Array, across: Array) -> tuple[Array, Array]:
        """x and y as files of a case have them [m]: in the frame, where the centreline is drawn."""
        return on_map(self.line, along, across) if self.line is not None else (along, across)

    def to_map(self, along: Array, across: Array) -> tuple[Array, Array]:
        """East and north [m] of places along and across the channel."""
        x, y = self.to_case(along, across)
        return self.frame.to_map(x, y) if self.frame is not None else (x, y)

    def turned_to_channel(self, along: Array, east: Array, north: Array) -> tuple[Array, Array]:
        """Components along and across, at places so far along the channel, of a vector east and north.

        u = U cos(theta) + V sin(theta), v = V cos(theta) - U sin(theta), theta the direction of the centreline there.
        """
        u, v = self.frame.turned_to_model(east, north) if self.frame is not None else (east, north)
        if self.line is None:
            return u, v
        cosine, sine = (part(heading_at(self.line, along)) for part in (np.cos, np.sin))
        return u * cosine + v * sine, v * cosine - u * sine


@dataclass(frozen=True)
class MeasuredRows:
    """Rows of one file.

    Attributes
    ----------
    numbers : mapping of ndarray (rows,)
        By role, in SI, NaN if missing.
    texts : mapping of sequence of str (rows,)
        By role.
    columns, units : mapping of str
        Heading and unit of each role in the file.
    notes : tuple of FileNote
        What was done, in short clauses.
    others : mapping of sequence of str (rows,)
        Texts of the columns without a role, by heading.
    lines : sequence of int (rows,)
        The row of the file that each row stands in, empty if it has none.
    of_probe : bool
        Whether u and v are along the axes of a probe, which is set up in the channel.
    """

    numbers: Mapping[str, Array]
    texts: Mapping[str, Sequence[str]]
    columns: Mapping[str, str]
    units: Mapping[str, str]
    notes: tuple[FileNote, ...]
    others: Mapping[str, Sequence[str]] = field(default_factory=dict)
    lines: Sequence[int] = ()
    of_probe: bool = False

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(next(iter(self.numbers.values())))

    @property
    def headings(self) -> list[str]:
        """Of all columns of the file."""
        return [*self.columns.values(), *self.others]

    def only(self, rows: Mask) -> "MeasuredRows":
        """The rows (rows,) that are true."""
        kept = np.flatnonzero(rows).tolist()
        texts, others = (
            {name: [one[row] for row in kept] for name, one in of.items()} for of in (self.texts, self.others)
        )
        lines = [self.lines[row] for row in kept] if self.lines else ()
        numbers = {role: values[rows] for role, values in self.numbers.items()}
        return replace(self, numbers=numbers, texts=texts, others=others, lines=lines)

    def having(self, numbers: Mapping[str, Array], *notes: FileNote) -> "MeasuredRows":
        """The rows with these numbers (rows,) in SI, in place of those of the same role, and with further notes."""
        return replace(self, numbers={**self.numbers, **numbers}, notes=(*self.notes, *notes))

    def without(self, *roles: str) -> "MeasuredRows":
        """The rows without some roles."""
        return replace(self, numbers={role: values for role, values in self.numbers.items() if role not in roles})

    def not_reading(self, *roles: str) -> "MeasuredRows":
        """The rows, columns of some roles counted among those without one; their texts are the numbers in SI."""
        columns, units = (
            {role: one for role, one in of.items() if role not in roles} for of in (self.columns, self.units)
        )
        texts = {role: one for role, one in self.texts.items() if role not in roles}
        written = {role: [f"{value:g}" for value in values] for role, values in self.numbers.items()} | dict(self.texts)
        unread = {heading: written.get(role, []) for role, heading in self.columns.items() if role in roles}
        others = {**self.others, **unread}
        return replace(self.without(*roles), texts=texts, columns=columns, units=units, others=others)

    def renamed(self, role: str, new: str) -> "MeasuredRows":
        """The rows with one role called otherwise."""
        names = {name: new if name == role else name for name in self.numbers}
        return replace(
            self,
            numbers={names[name]: values for name, values in self.numbers.items()},
            columns={names.get(name, name): heading for name, heading in self.columns.items()},
            units={names.get(name, name): unit for name, unit in self.units.items()},
        )

    @property
    def summary(self) -> str:
        """`x from Easting [m], u from Ve [cm/s]; semicolons, decimal comma; 12 rows; not read: Pt, Remarks`."""
        roles = []
        for role, heading in self.columns.items():
            unit = self.units.get(role)
            bare = heading.removesuffix(f"[{unit}]").removesuffix(f"({unit})").rstrip()
            roles.append(f"{role} from {bare}" + (f" [{unit}]" if role in self.units else ""))
        unread = [heading for heading in self.others if heading.strip()]
        more = [f"{len(unread) - MOST_UNREAD} more"] if len(unread) > MOST_UNREAD else []
        not_read = f"; not read: {listed([*unread[:MOST_UNREAD], *more])}" if unread else ""
        return f"{', '.join(roles)}; {', '.join(sentences(self.notes))}; {so_many(self.size, 'row')}{not_read}"


def read_rows(path: Path, options: FileOptions) -> MeasuredRows:
    """What a file of columns holds, in SI.

    Parameters
    ----------
    options : FileOptions
        What the site file states about it.

    Returns
    -------
    MeasuredRows
        Without rows that a column of flags marks, or that were pasted twice.

    Raises
    ------
    InputError
        Which names file, row and column; also for options of other files.
    """
    idle = next((key for key in OF_RECORDS if getattr(options, key) not in (None, 0.0)), None)
    if idle is not None:
        records, dat = OF_RECORDS[idle], path.suffix.lower() == ".dat"
        raise InputError("option_of_records", file=path, option=idle, records=records, dat=dat)
    table = parse_table(path, options.sheet)
    table = without_copies(without_flagged(path, table, columns_of_table(path, table, options)))
    taken = rows_of_table(path, table, options)
    if (of_none := next((role for role in options.units if role not in taken.numbers), None)) is not None:
        raise InputError(
            f"{shown_path(path)}: expected in `units` what its columns hold, {', '.join(taken.numbers)}, got "
            f"`{of_none}`; correct it, or name that column by `columns`."
        )
    return taken


def rows_of_table(path: Path, table: ParsedTable, options: FileOptions) -> MeasuredRows:
    """What a table holds, in SI.

    Parameters
    ----------
    path : Path
        For messages.
    options : FileOptions
        Columns and units, else their usual names, and the units that the table states.

    Raises
    ------
    InputError
        If no column has a known name, or a unit is stated elsewhere for what would be taken for SI.
    """
    columns = columns_of_table(path, table, options)
    numbers: dict[str, Array] = {}
    units: dict[str, str] = {}
    assumed = taken_as_si(table, columns, options)
    notes: list[FileNote] = [*([ImportNote(Noted.NO_UNIT, names=tuple(assumed))] if assumed else []), *table.form]
    for role, place in columns.items():
        if ROLES[role].quantity:
            units[role] = unit_of_column(path, table, columns, role, options)
            numbers[role], more = numbers_of_column(path, table, place, role, units[role], options.missing or ())
            notes += more
    if not numbers:
        unheaded = all(map(str.isdigit, table.headings))
        raise InputError(
            f"{shown_path(path)}: expected columns with known names, got {', '.join(table.headings)}; name them by "
            f"`columns` of this file, by what they hold: {', '.join(sorted(ROLES))}"
            f"{' (without headings by their number, `{x: 3, y: 2, z: 4}`)' if unheaded else ''}; or move a file "
            "without measurements out of the folder."
        )
    unread = [place for place in range(len(table.headings)) if place not in columns.values()]
    # A unit in a line above the heading, in a comment or in an unread column, of what is taken for SI.
    words_of = [set(filter(None, table.texts(place))) for place in unread]
    of_columns = [(table.row_numbers[0], next(iter(words))) for words in words_of if len(words) == 1]
    for row, text in (*table.beside, *of_columns):
        unit, quantity = unit_in_words(text) or ("", "")
        if roles := [role for role in assumed if ROLES[role].quantity == quantity]:
            raise InputError("unit_elsewhere", file=path, row=row, roles=roles, unit=unit)
    return MeasuredRows(
        numbers=numbers,
        texts={role: table.texts(place) for role, place in columns.items() if not ROLES[role].quantity},
        columns={role: table.headings[place] for role, place in columns.items()},
        units=units,
        notes=tuple(notes),
        others={table.headings[place]: table.texts(place) for place in unread},
        lines=table.row_numbers,
    )


def read_placed_rows(path: Path, options: FileOptions) -> MeasuredRows:
    """What a table holds, with places by `line` or `x`, and heights above the bed from both depths.

    Raises
    ------
    InputError
        As `read_rows`; also if its columns hold these places already, or none along a tape.
    """
    taken = read_rows(path, replace(options, line=None))
    if {"below", "depth"} <= taken.numbers.keys() and vertical_role(taken) is None:
        height = taken.numbers["depth"] - taken.numbers["below"]
        taken = taken.having({"height": height}, ImportNote(Noted.HEIGHT_FROM_DEPTHS))
    if {"u", "depth"} <= taken.numbers.keys():  # edges of a gauging, where the bank meets the water
        edges = (taken.numbers["u"] == 0.0) & (taken.numbers["depth"] <= 0.0)
        if edges.any():
            u = np.where(edges, np.nan, taken.numbers["u"])
            taken = taken.having({"u": u}, ImportNote(Noted.EDGES, int(edges.sum())))
    if options.line is not None:
        places = [taken.columns[role] for role in ("x", "y") if role in taken.numbers]
        if places:
            raise InputError(
                f"{shown_path(path)}: expected no `line` in its entry of `files`, which is for tables along a tape, "
                f"got a table with places of its own in {' and '.join(places)}; take it out."
            )
        if "tape" not in taken.numbers:
            raise InputError(
                f"{shown_path(path)}: expected a column with readings of the tape for `line`, got "
                f"{', '.join(taken.headings)}; name it by `columns: {{tape: ...}}`."
            )
        return on_the_tape(path, taken, options)
    if options.x is not None:
        if "x" in taken.numbers:
            raise InputError(
                f"{shown_path(path)}: expected no `x` in its entry of `files`, which is for tables without one, got x "
                f"in {taken.columns['x']}; take it out, or name the column by `columns`."
            )
        return taken.having({"x": np.full(taken.size, options.x)}, ImportNote(Noted.SAME_X, options.x))
    return taken


def on_the_tape(path: Path, taken: MeasuredRows, options: FileOptions) -> MeasuredRows:
    """(x, y) = a + t (b - a) / |b - a|: places at the reading t of a tape from a to b.

    The velocity measured is that square to the tape; it is taken as the one along the channel, which a tape that is off
    square by 10 degrees makes 1.5 % too small.

    Parameters
    ----------
    path : Path
        For messages.
    taken : MeasuredRows
        With t, `tape` [m].
    options : FileOptions
        With a and b, `line` [m].

    Returns
    -------
    MeasuredRows
        With x and y in place of t.

    Raises
    ------
    InputError
        Without the ends of the tape.
    """
    if options.line is None:
        raise InputError(
            f"{shown_path(path)}: expected where the tape lay, `line: [[x, y], [x, y]]`, first the end where it reads "
            "0; add it to this file in `files`."
        )
    (x0, y0), (x1, y1) = options.line
    length = math.hypot(x1 - x0, y1 - y0)
    east, north = (x1 - x0) / length, (y1 - y0) / length
    t = taken.numbers["tape"]
    places = {"x": x0 + t * east, "y": y0 + t * north}
    return taken.having(places, ImportNote(Noted.ON_TAPE, length)).without("tape")


def refuse_far_places(where: str, east: Array, north: Array, place: Placement) -> None:
    """Refuse places that belong to another site, or to other coordinates.

    Parameters
    ----------
    where : str
        How the message begins.
    east, north : ndarray (n,) [m]

    Raises
    ------
    InputError
        For places that are rather degrees, and if most lie further than FAR from a site on a map. The cause is what
        would bring them near: degrees, axes exchanged, another unit, digits in front, or that they are those of the
        channel.
    """
    there = np.isfinite(east) & np.isfinite(north)
    at = np.unique(np.column_stack([east, north])[there], axis=0)
    if not len(at):
        return
    span, size = np.ptp(at, axis=0), np.abs(at).max(axis=0)
    finer = bool((np.abs(at - np.round(at, 4)) > FINE_DIGITS).any())
    degrees = len(at) >= FEWEST_PLACES and bool((span < REACH_IN_DEGREES).all() and max(size) <= FULL_TURN)
    if degrees and finer and min(size) > 0.0 and max(size) > 1.0:
        raise InputError("places_in_degrees", where=where, role="x")
    if not place.turned:
        return
    reach = np.zeros((1, 2)) if place.line is None else np.column_stack([place.line.x, place.line.y])

    def apart(places: Array) -> float:
        """Median distance from the site [m]."""
        x, y = place.frame.to_model(*places.T) if place.frame is not None else places.T
        return float(np.median([np.hypot(*(reach - one).T).min() for one in np.column_stack([x, y])[:PLACES_COMPARED]]))

    if apart(at) <= FAR:
        return
    origin = np.array(place.to_map(*np.zeros((2, 1)))).T[0]
    digits = np.round((origin - np.median(at, axis=0)) / DIGITS_IN_FRONT) * DIGITS_IN_FRONT
    in_units = {unit: UNITS["length"][unit] * at for unit in ("ft", "km")}
    tried = {"exchanged": at[:, ::-1], **in_units, "digits": at + digits}
    near = [name for name, places in tried.items() if apart(places) <= FAR]
    cause = near[0] if near else "degrees" if degrees else "channel" if max(size) <= FAR else ""
    raise InputError(
        "far_places", where=where, origin=origin.tolist(), got=at[0].tolist(), apart=apart(at), cause=cause
    )


def refuse_other_bank(path: Path, taken: MeasuredRows, place: Placement, options: FileOptions) -> None:
    """InputError for distances that by their heading count from one bank, and by `line` or `flip` from the other."""
    role = "tape" if options.line is not None else "y"
    heading = words_of(taken.columns.get(role, "")).split()
    banks = [bank for bank, words in BANKS.items() if words & set(heading)]
    on_map = place.turned and options.coordinates != "channel"
    if len(banks) != 1 or not OF_A_BANK & set(heading) or (options.line is None and on_map):
        return
    if options.line is not None:
        east, north = np.array(options.line).T
        _, ends = place.to_channel(east, north) if on_map else (east, north)
        to_the_left = bool(ends[1] > ends[0]) != ("y" in options.flip)
        mend = "exchange the ends of `line`"
    else:
        to_the_left, mend = "y" not in options.flip, "write `flip: y` for a left bank alone"
    if to_the_left != (banks[0] == "right"):
        raise InputError(
            f"{shown_path(path)}: expected places from the {banks[0]} bank, as {taken.columns[role]!r} counts, got "
            f"them from the other one (y is positive to the left, looking downstream); {mend}."
        )


def vertical_role(taken: MeasuredRows) -> str | None:
    """The role of the height of each velocity: above the bed, else z; None if z is that of the bed."""
    if "height" in taken.numbers:
        return "height"
    known = known_name(taken.columns.get("z", ""))
    return "z" if "z" in taken.numbers and (known is None or known[0] not in NAMES_OF_BED) else None


def in_the_channel(taken: MeasuredRows, place: Placement, options: FileOptions) -> MeasuredRows:
    """The rows along and across the channel: turned, flipped and shifted; a speed with its direction as components.

    Returns
    -------
    MeasuredRows
        A speed beside a component is none: it is the same reading.
    """
    if options.factor is not None:
        roles = [role for role in taken.numbers if ROLES[role].quantity == "velocity"]
        scaled = {role: options.factor * taken.numbers[role] for role in roles}
        taken = taken.having(scaled, ImportNote(Noted.FACTOR, options.factor))
    numbers = taken.numbers
    known = [roles for roles in (("east_velocity", "north_velocity"), ("u",)) if set(roles) <= numbers.keys()]
    if {"speed", "direction"} <= numbers.keys() and "u" not in numbers and "east_velocity" not in numbers:
        # u_E = s sin d and u_N = s cos d, with the direction d from north, clockwise, that the water flows to.
        to = np.radians(numbers["direction"])
        parts = {"east_velocity": numbers["speed"] * np.sin(to), "north_velocity": numbers["speed"] * np.cos(to)}
        if (error := numbers.get("speed_se")) is not None:  # one error for a velocity is that of both components
            parts |= {"u_se": error, "v_se": error}
        taken = taken.having(parts, ImportNote(Noted.COMPONENTS)).without("speed", "direction", "speed_se")
    elif "speed" in numbers and known:  # beside a component it is the same reading, and would count twice
        again = np.any([np.isfinite([numbers[role] for role in roles]).all(axis=0) for roles in known], axis=0)
        if again.any():
            left = np.where(again, np.nan, numbers["speed"])
            taken = taken.having({"speed": left}, ImportNote(Noted.SPEED_TWICE))
    if place.turned and options.coordinates != "channel" and {"x", "y"} <= taken.numbers.keys():
        x, y = place.to_channel(taken.numbers["x"], taken.numbers["y"])
        taken = taken.having({"x": x, "y": y}, ImportNote(Noted.INTO_CHANNEL, int(place.line is not None)))
    taken = _along_and_across(taken, place, options)
    turned = {"x": ("x", "u"), "y": ("y", "v")}
    flipped = {name: -taken.numbers[name] for axis in options.flip for name in turned[axis] if name in taken.numbers}
    taken = taken.having(flipped, *(ImportNote(Noted.REVERSED, names=(axis,)) for axis in options.flip))
    if options.zero is None:
        return taken
    x0, y0 = options.zero
    moved = {axis: taken.numbers[axis] + at for axis, at in (("x", x0), ("y", y0)) if axis in taken.numbers}
    return taken.having(moved, ImportNote(Noted.ZERO_AT, names=(f"{x0:g}", f"{y0:g}")))


def _along_and_across(taken: MeasuredRows, place: Placement, options: FileOptions) -> MeasuredRows:
    """u and v of components east and north; a velocity without a second component is one along the channel.

    se_u^2 = (cos a se_E)^2 + (sin a se_N)^2, and se_v likewise, if both are given, errors independent.
    """
    pair = next((pair for pair in COMPONENTS if set(pair) <= taken.numbers.keys()), None)
    if pair is None:
        return taken
    first, second = (taken.numbers[role] for role in pair)
    of_map = options.directions == "map" or (options.directions is None and not taken.of_probe)
    notes: tuple[FileNote, ...] = ()
    if place.turned and of_map and (pair != ("u", "v") or options.coordinates != "channel"):
        along = taken.numbers.get("x", np.zeros(taken.size))
        first, second = place.turned_to_channel(along, first, second)
        if {"u_se", "v_se"} <= taken.numbers.keys():
            east, north = taken.numbers["u_se"], taken.numbers["v_se"]
            one, none = np.ones(taken.size), np.zeros(taken.size)
            (ee, en), (ne, nn) = place.turned_to_channel(along, one, none), place.turned_to_channel(along, none, one)
            taken = taken.having({"u_se": np.hypot(ee * east, ne * north), "v_se": np.hypot(en * east, nn * north)})
        notes = (ImportNote(Noted.VELOCITIES_TURNED),)
    elif place.turned and taken.of_probe:
        notes = (ImportNote(Noted.OF_PROBE),)
    return taken.without(*pair).having({"u": first, "v": second}, *notes)


def with_experiments(taken: MeasuredRows, experiments: Sequence[str]) -> MeasuredRows:
    """The rows, their experiments from a column, under any heading, of names of experiments and nothing else."""
    heading = next((name for name, texts in taken.others.items() if texts and set(texts) <= set(experiments)), None)
    if heading is None or "experiment" in taken.texts:
        return taken
    others = {name: texts for name, texts in taken.others.items() if name != heading}
    texts = {**taken.texts, "experiment": taken.others[heading]}
    return replace(taken, texts=texts, columns={"experiment": heading, **taken.columns}, others=others)


def joined_rows(parts: Sequence[MeasuredRows]) -> MeasuredRows:
    """The rows of several files one below the other, as far as all of them have a role."""
    first = parts[0]
    shared = [role for role in first.numbers if all(role in one.numbers for one in parts)]
    numbers = {role: np.concatenate([one.numbers[role] for one in parts]) for role in shared}
    named = [role for role in first.texts if all(role in one.texts for one in parts)]
    texts = {role: [text for one in parts for text in one.texts[role]] for role in named}
    unread = [name for name in first.others if all(name in one.others for one in parts)]
    others = {name: [text for one in parts for text in one.others[name]] for name in unread}
    return replace(first, numbers=numbers, texts=texts, others=others, lines=first.lines if len(parts) == 1 else ())
