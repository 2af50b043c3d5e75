"""Rows of measurements in SI and in the frame of the model, and a line that says what was taken from which column."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from vegglue.arrays import Array, Mask
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import ROLES
from vegglue.importers.column_numbers import doubted_nines, marks_of_role, numbers_of_column, refuse_negative
from vegglue.importers.columns_of_table import columns_of_table, taken_as_si, unit_of_column
from vegglue.importers.copied_rows import without_copies
from vegglue.importers.file_words import FileWords
from vegglue.importers.loose_table import LooseTable, read_loosely
from vegglue.importers.placement import Placement
from vegglue.importers.unit_words import si_factor
from vegglue.wording.numbers import listed, so_many

MOST_UNREAD = 12  # columns that are named of those that were not read: more are a list that nobody reads
# What an entry of `files` may say of other files, and does nothing to a table.
OF_RECORDS = {
    "start": "transects of a boat",
    "line": "tables along a tape",
    "position": "records of a probe",
    "draft": "raw records of a boat",
    "declination": "raw records of a boat",
}
# Pairs of components, those that are named after the map first.
COMPONENTS = (("east_velocity", "north_velocity"), ("u", "v"))


@dataclass(frozen=True)
class MeasuredRows:
    """Rows of one file.

    numbers: by role (rows,) in SI, NaN where missing; texts: by role, one a row; columns: the heading that each role
    came from; units: the unit of each; said: what was done, in short clauses; others: texts of the columns that no role
    was found for, by heading; lines: the row of the file that each row stands in, none where it has none; of_probe:
    whether u and v are along the axes of a probe, which is set up in the channel and knows no map.
    """

    numbers: Mapping[str, Array]
    texts: Mapping[str, Sequence[str]]
    columns: Mapping[str, str]
    units: Mapping[str, str]
    said: tuple[str, ...]
    others: Mapping[str, Sequence[str]] = field(default_factory=dict)
    lines: Sequence[int] = ()
    of_probe: bool = False

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(next(iter(self.numbers.values())))

    def only(self, rows: Mask) -> "MeasuredRows":
        """The rows (rows,) that are true."""
        numbers = {role: values[rows] for role, values in self.numbers.items()}
        texts, others = (
            {name: [one for one, kept in zip(column, rows, strict=True) if kept] for name, column in of.items()}
            for of in (self.texts, self.others)
        )
        lines = [line for line, kept in zip(self.lines, rows, strict=bool(self.lines)) if kept]
        return replace(self, numbers=numbers, texts=texts, others=others, lines=lines)

    def having(self, numbers: Mapping[str, Array], *said: str) -> "MeasuredRows":
        """The rows with these numbers (rows,) in SI, in place of those of the same role, and what is said of it."""
        return replace(self, numbers={**self.numbers, **numbers}, said=(*self.said, *said))

    def without(self, *roles: str) -> "MeasuredRows":
        """The rows without some roles."""
        return replace(self, numbers={role: values for role, values in self.numbers.items() if role not in roles})

    def leaving(self, *roles: str) -> "MeasuredRows":
        """The rows, columns in some roles counted among those that are not read: who asked for them has no use for
        them. Of their texts the numbers in SI are left.
        """
        columns, units = (
            {role: one for role, one in of.items() if role not in roles} for of in (self.columns, self.units)
        )
        written = {role: [f"{value:g}" for value in values] for role, values in self.numbers.items()} | dict(self.texts)
        unread = {heading: written.get(role, []) for role, heading in self.columns.items() if role in roles}
        texts = {role: one for role, one in self.texts.items() if role not in roles}
        return replace(
            self.without(*roles), texts=texts, columns=columns, units=units, others={**self.others, **unread}
        )


def read_rows(path: Path, words: FileWords) -> MeasuredRows:
    """What a file of columns holds, in SI. Errors: InputError, naming file, row and column, and for words of others."""
    idle = next((key for key, what in OF_RECORDS.items() if getattr(words, key) not in (None, 0.0)), None)
    if idle is not None:
        raise InputError(
            f"{shown_path(path)}: expected no `{idle}` in its entry of `files`, which is for {OF_RECORDS[idle]}, got a "
            "table that says its own places and directions; take it out."
        )
    table = without_copies(read_loosely(path, words.sheet))
    taken = rows_of_table(path, table, words)
    if (of_none := next((role for role in words.units if role not in taken.numbers), None)) is not None:
        raise InputError(
            f"{shown_path(path)}: expected in `units` what its columns hold, {', '.join(taken.numbers)}, got "
            f"`{of_none}`; correct it, or name that column by `columns`."
        )
    return taken


def rows_of_table(path: Path, table: LooseTable, words: FileWords) -> MeasuredRows:
    """What a table holds, in SI: columns by `words`, else by their usual names; units likewise."""
    columns = columns_of_table(path, table, words)
    numbers: dict[str, Array] = {}
    texts: dict[str, list[str]] = {}
    units: dict[str, str] = {}
    assumed = taken_as_si(table, columns, words)
    said = [*([f"no unit given of {listed(assumed)}, taken as SI"] if assumed else []), table.form]
    for role, place in columns.items():
        fields = [row[place] for _, row in table.rows]
        if not ROLES[role].quantity:
            texts[role] = fields
            continue
        units[role] = unit_of_column(path, table, columns, role, words)
        factor = si_factor(units[role], ROLES[role].quantity, shown_path(path))
        values, absent = numbers_of_column(path, table, place, [*words.missing, *marks_of_role(ROLES[role], factor)])
        numbers[role] = values * factor
        if role.endswith(("_se", "_std")):
            refuse_negative(path, table, place, values)
        if ROLES[role].quantity == "velocity":
            said += doubted_nines(values, table.headings[place])
        said += [f"{many} in {table.headings[place]}" for many in absent]
    if not numbers:
        known = ", ".join(sorted(ROLES))
        raise InputError(
            f"{shown_path(path)}: expected columns that can be told by their names, got {', '.join(table.headings)}; "
            f"name them by `columns` of this file, by what they hold: {known}; or move a file without measurements out "
            "of the folder."
        )
    named = {role: table.headings[place] for role, place in columns.items()}
    unread = [place for place in range(len(table.headings)) if place not in columns.values()]
    others = {table.headings[place]: [row[place] for _, row in table.rows] for place in unread}
    return MeasuredRows(numbers, texts, named, units, tuple(said), others, [line for line, _ in table.rows])


def in_the_channel(taken: MeasuredRows, place: Placement, words: FileWords) -> MeasuredRows:
    """The rows along and across the channel: turned, shifted and flipped; a speed with its direction as components."""
    taken = _without_speed_again(_components(taken))
    if place.turned and words.coordinates != "channel" and {"x", "y"} <= taken.numbers.keys():
        x, y = place.to_channel(taken.numbers["x"], taken.numbers["y"])
        taken = taken.having({"x": x, "y": y}, f"places turned from the map into {place.words}")
    return _from_zero(_flipped(_along_and_across(taken, place, words), words.flip), words.zero)


def _from_zero(taken: MeasuredRows, zero: tuple[float, float] | None) -> MeasuredRows:
    """The places counted from those of the channel."""
    if zero is None:
        return taken
    moved = {axis: taken.numbers[axis] + at for axis, at in zip("xy", zero, strict=True) if axis in taken.numbers}
    return taken.having(moved, f"zero at x = {zero[0]:g}, y = {zero[1]:g} m")


def _along_and_across(taken: MeasuredRows, place: Placement, words: FileWords) -> MeasuredRows:
    """u and v of components east and north; a velocity without a second component is one along the channel."""
    pair = next((pair for pair in COMPONENTS if set(pair) <= taken.numbers.keys()), None)
    if pair is None:
        return taken
    first, second = (taken.numbers[role] for role in pair)
    of_map = words.directions == "map" or (words.directions is None and not taken.of_probe)
    turn = place.turned and of_map and (pair != ("u", "v") or words.coordinates != "channel")
    if turn:
        along = taken.numbers.get("x", np.zeros(taken.size))
        first, second = place.turned_to_channel(along, first, second)
        taken = _errors_turned(taken, place, along)
    said = ("velocities turned with them, as components east and north",) if turn else ()
    if place.turned and taken.of_probe and not turn:
        said = ("x and y of the probe along and across the channel (else say `directions: map`)",)
    return taken.without(*pair).having({"u": first, "v": second}, *said)


def _errors_turned(taken: MeasuredRows, place: Placement, along: Array) -> MeasuredRows:
    """se_u^2 = (cos a se_E)^2 + (sin a se_N)^2, and se_v likewise, where both are given, errors independent."""
    if not {"u_se", "v_se"} <= taken.numbers.keys():
        return taken
    east, north = taken.numbers["u_se"], taken.numbers["v_se"]
    one, none = np.ones(taken.size), np.zeros(taken.size)
    (ee, en), (ne, nn) = place.turned_to_channel(along, one, none), place.turned_to_channel(along, none, one)
    return taken.having({"u_se": np.hypot(ee * east, ne * north), "v_se": np.hypot(en * east, nn * north)})


def with_experiments(taken: MeasuredRows, experiments: Sequence[str]) -> MeasuredRows:
    """The rows, their experiments read from a column, under any heading, of names of experiments and nothing else."""
    heading = next((name for name, texts in taken.others.items() if texts and set(texts) <= set(experiments)), None)
    if heading is None or "experiment" in taken.texts:
        return taken
    others = {name: texts for name, texts in taken.others.items() if name != heading}
    texts = {**taken.texts, "experiment": taken.others[heading]}
    return replace(taken, texts=texts, columns={"experiment": heading, **taken.columns}, others=others)


def joined_rows(parts: Sequence[MeasuredRows]) -> MeasuredRows:
    """The rows of several files one below the other, as far as all of them have a role."""
    first = parts[0]
    numbers = {r: np.concatenate([one.numbers[r] for one in parts]) for r in first.numbers if _in_all(r, parts)}
    texts = {role: [text for one in parts for text in one.texts[role]] for role in first.texts}
    shared = [name for name in first.others if all(name in one.others for one in parts)]
    others = {name: [text for one in parts for text in one.others[name]] for name in shared}
    return replace(first, numbers=numbers, texts=texts, others=others, lines=first.lines if len(parts) == 1 else ())


def _in_all(role: str, parts: Sequence[MeasuredRows]) -> bool:
    return all(role in one.numbers for one in parts)


def taken_in_words(taken: MeasuredRows) -> str:
    """`x from Easting [m], u from Ve [cm/s]; semicolons, decimal comma; 12 rows; not read: Pt, Remarks`."""
    units = {role: f" [{unit}]" for role, unit in taken.units.items()}
    roles = [
        f"{role} from {_without(heading, taken.units.get(role))}{units.get(role, '')}"
        for role, heading in taken.columns.items()
    ]
    unread = [heading for heading in taken.others if heading.strip()]
    more = [f"{len(unread) - MOST_UNREAD} more"] if len(unread) > MOST_UNREAD else []
    said = f"; not read: {listed([*unread[:MOST_UNREAD], *more])}" if unread else ""
    return f"{', '.join(roles)}; {', '.join(taken.said)}; {so_many(taken.size, 'row')}{said}"


def _without(heading: str, unit: str | None) -> str:
    """`U` for `U [cm/s]` and `U (cm/s)`."""
    return heading.removesuffix(f"[{unit}]").removesuffix(f"({unit})").rstrip()


def _components(taken: MeasuredRows) -> MeasuredRows:
    """u_E = s sin d and u_N = s cos d, with the direction d from north, clockwise, that the water flows to.

    One error for a velocity is that of both components.
    """
    numbers = taken.numbers
    if not {"speed", "direction"} <= numbers.keys() or "u" in numbers or "east_velocity" in numbers:
        return taken
    to = np.radians(numbers["direction"])
    parts = {"east_velocity": numbers["speed"] * np.sin(to), "north_velocity": numbers["speed"] * np.cos(to)}
    if (error := numbers.get("speed_se")) is not None:
        parts |= {"u_se": error, "v_se": error}
    return taken.having(parts, "components from speed and direction").without("speed", "direction", "speed_se")


def _without_speed_again(taken: MeasuredRows) -> MeasuredRows:
    """The speed only where no component is: beside one it is the same reading, and would count twice."""
    numbers = taken.numbers
    known = [roles for roles in (("east_velocity", "north_velocity"), ("u",)) if set(roles) <= numbers.keys()]
    if "speed" not in numbers or not known:
        return taken
    again = np.any([np.isfinite([numbers[role] for role in roles]).all(axis=0) for roles in known], axis=0)
    left = np.where(again, np.nan, numbers["speed"])
    return taken.having({"speed": left}, "speed not taken again beside its components") if again.any() else taken


def _flipped(taken: MeasuredRows, axes: Sequence[str]) -> MeasuredRows:
    turned = {"x": ("x", "u"), "y": ("y", "v")}
    numbers = {name: -taken.numbers[name] for axis in axes for name in turned[axis] if name in taken.numbers}
    return taken.having(numbers, *(f"{axis} reversed" for axis in axes))
