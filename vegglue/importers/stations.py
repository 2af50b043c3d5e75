"""Measured rows as tables that a case names: points in the vertical, or stations of each kind."""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array, Mask
from vegglue.case.resolved_config import Tree
from vegglue.errors import InputError
from vegglue.importers.column_names import ROLES, is_in_degrees, unit_stated, words_of
from vegglue.importers.config_parts import observed
from vegglue.importers.file_options import FileOptions
from vegglue.importers.import_notes import FileNote, ImportNote, Noted
from vegglue.importers.measured_rows import MeasuredRows, Placement, vertical_role
from vegglue.importers.repeats import (
    PlaceKey,
    RepeatedValue,
    means_of_repeats,
    note_on_repeats,
    refuse_confounded_replicates,
    without_repeats,
)
from vegglue.importers.table_parser import numbers_of
from vegglue.measurements.kinds import KINDS, STREAMWISE, Kind
from vegglue.wording.numbers import listed, so_many
from vegglue.wording.sentences import sentences

EXPERIMENTS = "experiments"
# Headings that a message lists of each kind of measurement: the commonest stand first.
HEADINGS_SHOWN = 4
HEADINGS_OF_NONE = 8  # that a message lists where none is the one wanted
VELOCITIES = ("u", "v", "speed")
# Share of places with several heights from which a table is of verticals [-]. Chosen, not measured: less may be places
# that were read again, with another level of the bed or of the probe beside it.
VERTICALS = 0.2
# Height of a point over the depth at which a log law has its average [-], the rule of 0.6 below the surface; and how
# near that is near enough: it moves the velocity of a log law by 2 %.
OF_AVERAGE, NEAR_AVERAGE = 0.4, 0.05
# By how much verticals are moved to the line of their section before a note says so [m].
NEAR_LINE = 0.01
OTHER_NAMES_SHOWN = 4  # names of a column that a message lists
# Places nearer than this are one [m]; what is measured by tape is known to a centimetre.
ONE_PLACE = 0.001
# Number of x over that of places, up to which places stand on lines across the channel [-]. Chosen, not measured.
ON_LINES = 2.0 / 3.0
# Stations of one section lie within so much of one another along the channel [m].
SECTION_GAP = 0.25
# Values of one discharge are alike to so much [-]: those of one are copied, not measured again.
COPIED = 1e-6
# Words of headings that mean how high or deep: `rel. depth`, `z/h`, `Messtiefe`; or where from: `dist. to bed`.
HEIGHT_WORDS = {
    "z", "depth", "height", "below", "above", "surface", "hohe", "tiefe", "profondeur", "hauteur", "profundidad",
    "diepte", "profondita", "profundidade", "altura", "hoogte", "altezza", "hoehe", "messhohe", "bed", "bottom",
    "sohle", "grund", "fond", "lecho", "fondo", "bodem",
}  # fmt: skip
# A velocity of 0 is doubted between neighbours of so much of the median [-]: chosen.
OF_THE_USUAL = 0.5
# Heights at one place differ by such a factor [-]; depths of the water that were read again do not.
APART = 1.5


@dataclass(frozen=True)
class KnownExperiments:
    """The experiments that the rows of a file may name.

    Attributes
    ----------
    site, key : str
        The site file, and where in it they stand.
    others : tuple of str
        Those under its other key.
    """

    names: tuple[str, ...]
    site: str
    key: str
    others: tuple[str, ...]

    def refuse_unknown(self, file: str, rows: Sequence[int], names: Sequence[str]) -> None:
        """InputError for the first of the names (rows,) that is not known, with the file and its row."""
        for row, name in zip(rows, names, strict=True):
            if name not in self.names:
                raise self.refusal(file, name, row)

    def refusal(self, file: str, name: str, row: int = 0) -> InputError:
        """The error about a name that is not known; row: 0 for that of the options of the file."""
        elsewhere = name in self.others
        return InputError(
            "unknown_experiment", where=f"{file}, row {row}" if row else file, name=name, known=self.names,
            site=self.site, key=self.key, elsewhere=elsewhere, option=not row,
        )  # fmt: skip


@dataclass(frozen=True)
class StationTable:
    """One table to be written.

    Attributes
    ----------
    file : str
        Its name.
    heading : tuple of str
        Columns.
    observations : tuple of Tree
        That name it.
    taken : str
        What was taken.
    """

    file: str
    heading: tuple[str, ...]
    rows: list[list[str]]
    observations: tuple[Tree, ...]
    taken: str


@dataclass(frozen=True)
class StationTables:
    """The tables of one file.

    Attributes
    ----------
    left_out : tuple of FileNote
        What they lack, and how many of its rows are in none of them and why.
    """

    tables: list[StationTable]
    left_out: tuple[FileNote, ...]

    @property
    def taken(self) -> str:
        """What was made of the rows."""
        made = [table.taken for table in self.tables]
        nothing = [] if made else [ImportNote(Noted.NOTHING)]
        return ", ".join(sentences([*made, *nothing, *self.left_out]))


def station_tables(
    taken: MeasuredRows, stem: str, options: FileOptions, known: KnownExperiments, place: Placement, file: str
) -> StationTables:
    """The tables of what was taken from one file.

    Parameters
    ----------
    stem : str
        Of its name.
    file : str
        How the message begins.

    Returns
    -------
    StationTables
        One table for each kind of measurement, or one of points of verticals.

    Raises
    ------
    InputError
        If nothing is a measurement, an experiment is unknown, or repeats differ by more than chance with another
        column.
    """
    at = [role for role in ("x", "y") if role in taken.numbers]
    without_place = _lacking(taken, at, np.all)
    names = taken.texts.get("section", ()) if options.section is None else ()
    unnamed = sum(not name for name in names)
    if 0 < unnamed < len(names):  # below a merged cell, say
        without_place = (*without_place, ImportNote(Noted.UNNAMED_SECTIONS, unnamed))
    named = _with_experiment_and_section(taken, options, known.names, f"{file}:")
    taken, once = _once_in_a_section(named)
    kinds = [kind for kind in KINDS.values() if kind.column in taken.numbers]
    lacks_y = "y" not in at and any(kind.at_point for kind in kinds)
    on_axis = (ImportNote(Noted.ON_AXIS, _lacking_y(options)),) if lacks_y else ()
    if options.experiment is not None and options.experiment not in known.names:
        raise known.refusal(file, options.experiment)
    if not kinds:
        raise InputError("no_measurement_in_file", where=file, got=taken.summary, usual=usual_headings())
    has_velocity = any(ROLES[role].quantity == "velocity" for role in taken.numbers)
    unnamed_velocities = [heading for heading in taken.others if unit_stated(heading, "velocity")]
    if not has_velocity and unnamed_velocities:
        raise InputError(
            f"{file}: expected a column of velocities by a usual name, got {listed(unnamed_velocities)}; name them by "
            "`columns: {u: ...}` of this file in `files` (with `v`, or `speed` and `direction`), or take them out."
        )
    if kinds and taken.lines:
        measured = taken.only(np.any([np.isfinite(taken.numbers[kind.column]) for kind in kinds], axis=0))
        known.refuse_unknown(file, measured.lines, measured.texts["experiment"])
    if _in_verticals(taken):
        refuse_confounded_replicates(named, _heights(named), file)
        beside = tuple(ImportNote(Noted.BESIDE_POINTS, names=(kind.words,)) for kind in kinds if not kind.velocity)
        _refuse_zeros(taken, options, file, vertical_role(taken))
        lacking_points = _lacking(taken, ["u", str(vertical_role(taken))], np.all)
        return StationTables(
            [_points_of_verticals(taken, stem, options)], (*on_axis, *without_place, *lacking_points, *beside)
        )
    _refuse_zeros(taken, options, file, None)
    _refuse_lost_heights(taken, _places(taken), file)
    refuse_confounded_replicates(named, _places(named), file)
    found = [_stations_of_kind(taken, stem, options, kind, place) for kind in kinds]
    without_value = _lacking(taken, [kind.column for kind in kinds], np.any)
    role = vertical_role(taken)
    at_height: tuple[FileNote, ...] = ()
    if role is not None and "u" in taken.numbers and np.isfinite(taken.numbers[role]).any():
        share = taken.numbers[role] / taken.numbers["depth"] if {"height", "depth"} <= taken.numbers.keys() else None
        if share is not None and (np.abs(share[np.isfinite(share)] - OF_AVERAGE) < NEAR_AVERAGE).all():
            at_height = (ImportNote(Noted.NEAR_AVERAGE, OF_AVERAGE),)
        else:
            at_height = (ImportNote(Noted.HEIGHTS_UNUSED, names=(role,)),)
    left_out = (*on_axis, *without_place, *without_value, *once, *at_height)
    return StationTables([table for table in found if table.rows], left_out)


def usual_headings() -> list[tuple[str, tuple[str, ...]]]:
    """Of each kind of measurement its words, and the commonest headings of its column."""
    return [(kind.words, ROLES[kind.column].names[:HEADINGS_SHOWN]) for kind in KINDS.values()]


def _lacking(taken: MeasuredRows, roles: Sequence[str], needed: Callable[..., Mask]) -> tuple[FileNote, ...]:
    """How many rows are left out for want of a role, if all or any of the roles are needed; nothing if no row is."""
    if not roles:
        return ()
    lacking = int((~needed([np.isfinite(taken.numbers[role]) for role in roles], axis=0)).sum())
    return (ImportNote(Noted.LACKING, lacking, tuple(roles)),) if lacking else ()


def _with_experiment_and_section(
    taken: MeasuredRows, options: FileOptions, experiments: Sequence[str], where: str
) -> MeasuredRows:
    """Every row with an experiment and a section, and with a place; rows without a place are left out."""
    place = [role for role in ("x", "y") if role in taken.numbers]
    # Headings that hold the name of an experiment: `12 mei`, `level low`, `12 mei [m+NAP]`.
    words = [name for one in experiments if (name := words_of(one))]
    wide = [heading for heading in taken.others if any(f" {name} " in f" {words_of(heading)} " for name in words)]
    written_long = InputError("wide_table", where=where, experiments=experiments, got=wide)
    if "x" not in place:
        more = [f"{len(taken.headings) - HEADINGS_OF_NONE} more"] if len(taken.headings) > HEADINGS_OF_NONE else []
        headings = listed([*taken.headings[:HEADINGS_OF_NONE], *more])
        if any(map(is_in_degrees, taken.others)):
            raise InputError("places_in_degrees", where=where.removesuffix(":"), role="x")
        if [kind.column for kind in KINDS.values() if kind.column in taken.numbers] == ["discharge"]:
            raise InputError(
                f"{where} expected a column of x beside the discharges, got none in {headings}; add it, or `x: 12 m` "
                f"of this file in `files`, or write `discharge` of {experiments[0]} into the site file."
            )
        if "level" not in taken.numbers and wide:
            raise written_long
        if "tape" in taken.numbers:
            raise InputError(
                f"{where} expected where the tape of {taken.columns['tape']!r} lay, got none; add `line: [[x, y], [x, "
                "y]]` to this file in `files`, first the end where it reads 0, or name it x by `columns`."
            )
        raise InputError(
            f"{where} expected a column of x, got none in {headings}; name it by `columns: {{x: ...}}` of this file in "
            "`files`, or give there `x: 12 m`, `line` or `position`."
        )
    taken = taken.only(np.all([np.isfinite(taken.numbers[role]) for role in place], axis=0))
    if options.experiment is not None:
        names = [options.experiment] * taken.size
    elif "experiment" in taken.texts:
        names = list(taken.texts["experiment"])
    elif len(experiments) == 1:
        names = [experiments[0]] * taken.size
    elif wide:
        raise written_long
    else:
        file = where.removesuffix(":").rpartition("/")[2]
        # An unread column of repeated words may hold the experiments by other names.
        distinct = {heading: list(dict.fromkeys(filter(None, texts))) for heading, texts in taken.others.items()}
        alike = [
            (heading, words[:OTHER_NAMES_SHOWN], len(words) > OTHER_NAMES_SHOWN)
            for heading, words in distinct.items()
            if 1 < len(words) < taken.size and numbers_of(taken.others[heading]) is None
        ]
        raise InputError("no_column_of_experiments", where=where, file=file, known=experiments, alike=alike[:1])
    sections = [options.section] * taken.size if options.section is not None else taken.texts.get("section")
    if sections is None or "" in sections:
        x, y = taken.numbers["x"], taken.numbers.get("y", np.full(taken.size, _lacking_y(options)))
        of_one_tape = "tape" in taken.columns and "tape" not in taken.numbers
        sections = [_section_at(x)] * taken.size if of_one_tape else _sections_by_place(x, y)
    named = replace(taken, texts={**taken.texts, "experiment": names, "section": sections})
    _refuse_lost_places(named, where.removesuffix(":"))
    return named if "y" in place else named.having({"y": np.full(named.size, _lacking_y(options))})


def _lacking_y(options: FileOptions) -> float:
    """y of rows without a column of it, which lie where y of the file is 0 [m]."""
    return 0.0 if options.zero is None else options.zero[1]


def _section_at(x: Array) -> str:
    """x12.50, the name of a section of stations at x (n,) [m]."""
    return f"x{np.median(x):.2f}"


def _sections_by_place(x: Array, y: Array) -> list[str]:
    """x12.50 for each of the stations (n,) that stand together there, from their places x and y (n,) [m].

    Sections begin where stations are further apart than SECTION_GAP; what reaches further along the channel than across
    it is no section, and stands as it is.
    """

    def groups_along(gap: float) -> NDArray[np.int_]:
        """A number for each station (n,), the same as long as no gap along the channel is wider [m]."""
        order = np.argsort(x, kind="stable")
        group = np.zeros(x.size, dtype=int)
        group[order] = np.concatenate([[0], np.cumsum(np.diff(x[order]) > gap)])
        return group

    places = np.unique(np.round(np.column_stack([x, y]), 3), axis=0)
    # Equal x of many places are sections as they are, however near; scattered ones are joined.
    scattered = np.unique(places[:, 0]).size > ON_LINES * len(places)
    apart, group = groups_along(ONE_PLACE), groups_along(SECTION_GAP if scattered else ONE_PLACE)
    for one in np.unique(group):
        here = group == one
        if np.ptp(x[here]) > np.ptp(y[here]):
            group[here] = x.size + apart[here]
    names = {number: _section_at(x[group == number]) for number in np.unique(group)}
    return [names[number] for number in group]


def _refuse_lost_places(taken: MeasuredRows, file: str) -> None:
    """InputError if velocities of one x differ by a length without a role: they are no repeats on the axis.

    Lengths are readings along a tape, depths of a stated unit, and columns without a role headed by a unit of length
    or, as `y/B`, by y. What differs by no length, such as the time, may be repeats.
    """
    if "y" in taken.numbers or not taken.numbers.keys() & set(VELOCITIES):
        return
    lengths = {taken.columns["tape"]: taken.numbers["tape"]} if "tape" in taken.numbers else {}
    depth = taken.columns.get("depth", "")
    lengths |= {depth: taken.numbers["depth"]} if unit_stated(depth, "length") else {}
    for heading, texts in taken.others.items():
        if unit_stated(heading, "length") or "y" in words_of(heading).split():
            lengths |= {heading: numbers} if (numbers := numbers_of(texts)) is not None else {}
    for heading, values in lengths.items():
        seen: dict[tuple[str, str, float], float] = {}
        places = zip(taken.texts["experiment"], taken.texts["section"], taken.numbers["x"].tolist(), strict=True)
        for place, length in zip(places, values.tolist(), strict=True):
            if np.isfinite(length) and seen.setdefault(place, length) != length:
                raise InputError(
                    f"{file}: expected a column of y, got velocities at x = {place[2]:g} m that differ in {heading!r}; "
                    "name it by `columns: {y: ...}` (with `flip: y`, `zero: [0, 2.5]` from a left bank), or take it "
                    "out if they are repeats."
                )


def _refuse_lost_heights(taken: MeasuredRows, places: Sequence[Hashable], file: str) -> None:
    """InputError if velocities of one place differ in a depth or a height without a role: they are no repeats.

    places (rows,): what is one if they are equal.
    """
    if "u" not in taken.numbers:
        return
    unread = {taken.columns[role]: taken.numbers[role] for role in ("below", "depth") if role in taken.numbers}
    for heading, texts in taken.others.items():
        if HEIGHT_WORDS & set(words_of(heading).split()):
            unread |= {heading: numbers} if (numbers := numbers_of(texts)) is not None else {}
    for heading, heights in unread.items():
        seen: dict[Hashable, float] = {}
        for place, height, u in zip(places, np.abs(heights).tolist(), taken.numbers["u"].tolist(), strict=True):
            if not np.isfinite([height, u]).all():
                continue
            low, high = sorted((seen.setdefault(place, height), height))
            if high > APART * low:
                raise InputError(
                    f"{file}: expected one velocity at a place, or its height, got several that differ in {heading!r}; "
                    "name it in `columns` as `z`, `height` (above the bed) or `below` (the surface), or take it out."
                )


def _refuse_zeros(taken: MeasuredRows, options: FileOptions, file: str, upward: str | None) -> None:
    """InputError if a velocity is exactly 0 between neighbours of half the usual one or more: it was not measured.

    Neighbours stand across in one section, or above one another if there is a role `upward`. Both components have to be
    0. `missing`, which may be empty, decides: it holds 0 or not.
    """
    column = next((role for role in ("u", "speed") if role in taken.numbers), None)
    if options.missing is not None or column is None:
        return
    u, order = taken.numbers[column], taken.numbers[upward or "y"]
    zero = (u == 0.0) & (np.nan_to_num(taken.numbers.get("v", np.zeros(taken.size))) == 0.0)
    moving = np.abs(u[np.isfinite(u) & ~zero])
    if not zero.any() or not moving.size:
        return
    usual = OF_THE_USUAL * float(np.median(moving))
    places = _places(taken)
    groups: dict[object, list[int]] = {}
    for row in np.flatnonzero(np.isfinite(u) & np.isfinite(order)).tolist():
        groups.setdefault(places[row] if upward else places[row][:2], []).append(row)
    for rows in groups.values():
        ordered = sorted(rows, key=order.__getitem__)
        flows = [place for place, row in enumerate(ordered) if not zero[row]]
        for left, right in pairwise(flows):
            between = ordered[left + 1 : right]
            one, other = u[ordered[left]], u[ordered[right]]
            if between and min(abs(one), abs(other)) >= usual:
                where = f", row {taken.lines[min(between)]}" if taken.lines else ""
                raise InputError(
                    f"{file}{where}: expected a velocity, got 0 between {one:.3g} and {other:.3g} m/s; write `missing: "
                    "[0]` of this file if it was not measured, `missing: []` if the water stood there."
                )


def _rows_of_sections(taken: MeasuredRows, role: str) -> list[list[int]]:
    """The rows with a number of that role of each section of each experiment."""
    rows: dict[tuple[str, str], list[int]] = {}
    for row in np.flatnonzero(np.isfinite(taken.numbers[role])).tolist():
        rows.setdefault((taken.texts["experiment"][row], taken.texts["section"][row]), []).append(row)
    return list(rows.values())


def _once_in_a_section(taken: MeasuredRows) -> tuple[MeasuredRows, tuple[FileNote, ...]]:
    """The rows with the discharge of a section once, without shares of it by verticals, and with a level that all
    verticals repeat once; and notes on these.

    Several discharges at one y are repeats, and stay; gauges on both banks are two readings, even if they agree.
    """
    notes: list[FileNote] = []
    across = taken.numbers.get("y", np.zeros(taken.size))
    if {"y", "discharge"} <= taken.numbers.keys():
        found, shares = taken.numbers["discharge"].copy(), 0
        for rows in _rows_of_sections(taken, "discharge"):
            if np.ptp(across[rows]) == 0.0:
                continue
            alike = np.allclose(found[rows], found[rows[0]], rtol=COPIED, atol=0.0)
            found[rows[1:] if alike else rows] = np.nan
            shares += 0 if alike else len(rows)
        taken = taken.having({"discharge": found})
        notes += [ImportNote(Noted.SHARES, shares)] if shares else []
    if {"y", "level"} <= taken.numbers.keys() and taken.numbers.keys() & set(VELOCITIES):
        found = taken.numbers["level"].copy()
        sections = [rows for rows in _rows_of_sections(taken, "level") if len(set(across[rows])) > 2]
        repeated = [rows for rows in sections if np.ptp(found[rows]) == 0.0]
        for rows in repeated:
            found[rows[1:]] = np.nan
        taken = taken.having({"level": found})
        notes += [ImportNote(Noted.LEVEL_ONCE, len(repeated))] if repeated else []
    return taken, tuple(notes)


def _in_verticals(taken: MeasuredRows) -> bool:
    """Whether VERTICALS of the places have velocities at several heights: shallow ones are often measured at one."""
    role = vertical_role(taken)
    if role is None or "u" not in taken.numbers:
        return False
    there = np.isfinite(taken.numbers["u"]) & np.isfinite(taken.numbers[role])
    heights: dict[PlaceKey, set[float]] = {}
    for place, z, kept in zip(_places(taken), np.round(taken.numbers[role], 2).tolist(), there, strict=True):
        if kept:
            heights.setdefault(place, set()).add(z)
    several = sum(len(some) > 1 for some in heights.values())
    return several > 0 and several >= VERTICALS * len(heights)


def _places(taken: MeasuredRows) -> list[PlaceKey]:
    x, y = (np.round(taken.numbers[role] / ONE_PLACE) * ONE_PLACE for role in ("x", "y"))
    return list(zip(taken.texts["experiment"], taken.texts["section"], x.tolist(), y.tolist(), strict=True))


def _heights(taken: MeasuredRows) -> list[tuple[object, ...]]:
    """Each place with the height of its point."""
    z = np.round(taken.numbers[str(vertical_role(taken))] / ONE_PLACE).tolist()
    return [(*place, height) for place, height in zip(_places(taken), z, strict=True)]


def errors_of_rows(taken: MeasuredRows, kind: Kind, options: FileOptions) -> Array:
    """Standard errors (rows,): of their column, else the one of the site file; NaN if neither has one, or 0."""
    stated = np.full(taken.size, options.standard_error.get(kind.unit, np.nan))
    column = taken.numbers.get(kind.error_column, stated)
    errors = np.where(np.isfinite(column) & (column != 0.0), column, stated)
    return np.where(errors == 0.0, np.nan, errors)


def _points_of_verticals(taken: MeasuredRows, stem: str, options: FileOptions) -> StationTable:
    """Points in the vertical; a section is a case of the file, at the middle of its x, each height of a place once."""
    upward = str(vertical_role(taken))
    kept = taken.only(np.isfinite(taken.numbers["u"]) & np.isfinite(taken.numbers[upward]))
    sections = list(zip(kept.texts["experiment"], kept.texts["section"], strict=True))
    x = kept.numbers["x"].copy()
    for one in set(sections):
        here = np.array([section == one for section in sections])
        x[here] = np.median(x[here])
    moved = float(np.abs(x - kept.numbers["x"]).max(initial=0.0))
    kept = kept.having({"x": x})
    kept, repeats = without_repeats(kept, _heights(kept), errors_of_rows(kept, KINDS[STREAMWISE], options))
    notes = [repeats, *([ImportNote(Noted.MOVED, moved)] if moved > NEAR_LINE else [])]
    # Beside u: v and w if any has it, standard errors with 0 for unknown, and what all have.
    numbers = kept.numbers
    optional = {role: numbers[role] for role in ("v", "w") if role in numbers and np.isfinite(numbers[role]).any()}
    errors = np.nan_to_num(errors_of_rows(kept, KINDS[STREAMWISE], options))
    optional |= {"u_se": errors} if errors.any() else {}
    optional |= {
        role: numbers[role] for role in ("u_std", "duration_s") if role in numbers and np.isfinite(numbers[role]).all()
    }
    names = [f"{one}/{other}" for one, other in zip(kept.texts["experiment"], kept.texts["section"], strict=True)]
    devices = kept.texts.get("device", ["ADV"] * kept.size)
    places = [map(_written_place, numbers[role]) for role in ("x", "y", upward)]
    values = [map(_written_value, one) for one in (numbers["u"], *optional.values())]
    rows = [
        [name, device or "ADV", *texts]
        for name, device, texts in zip(names, devices, zip(*places, *values, strict=True), strict=True)
    ]
    v = optional.get("v", np.full(kept.size, np.nan))
    across = {name for name, value in zip(names, v.tolist(), strict=True) if np.isfinite(value)}
    file = f"{stem}.csv"
    levels = {key: level for key in ("floor", "surface") if (level := getattr(options, key)) is not None}
    observations = []
    for name in dict.fromkeys(names):
        experiment, section = name.split("/", 1)
        tree = {"kind": "adv", "file": file, "experiment": experiment, "section": section, "case": name}
        observations.append({**tree, "average": "profile", **levels, **({"across": True} if name in across else {})})
    heading = ("case", "device", "x", "y", upward, "u", *optional)
    points = f"{len(rows)} points of {so_many(len(observations), 'section')}"
    return StationTable(file, heading, rows, tuple(observations), ", ".join([points, *sentences(notes)]))


def _stations_of_kind(
    taken: MeasuredRows, stem: str, options: FileOptions, kind: Kind, channel: Placement
) -> StationTable:
    """Stations of one kind; values at one place are averaged, and their scatter gives errors if none is stated.

    What was measured at a point stands on the map of its centreline, as a case reads it.
    """
    kept = taken.only(np.isfinite(taken.numbers[kind.column]))
    errors = errors_of_rows(kept, kind, options)
    gathered: dict[PlaceKey, list[RepeatedValue]] = {}
    for place, value, error in zip(_places(kept), kept.numbers[kind.column].tolist(), errors.tolist(), strict=True):
        gathered.setdefault(place, []).append((value, error))
    x, y = np.array([place[2:] for place in gathered]).reshape(-1, 2).T
    x, y = channel.to_case(x, y) if kind.at_point else (x, y)
    rows = [
        [*place[:2], *map(_written_place, at), *map(_written_value, mean)]
        for place, mean, *at in zip(gathered, means_of_repeats(gathered), x.tolist(), y.tolist(), strict=True)
    ]
    file = f"{stem}-{kind.name}.csv"
    heading = ("experiment", "section", "x", "y", kind.column, kind.error_column)
    made = ", ".join([f"{len(rows)} of {kind.words}", *sentences([note_on_repeats(gathered)])])
    return StationTable(file, heading, rows, (observed(kind.name, file),), made)


def _written_place(length: float) -> str:
    """As in a table, to a thousandth of a millimetre."""
    return f"{round(float(length), 6):.12g}"


def _written_value(value: float) -> str:
    """As in a table, to nine digits, as a flume's discharge may be in millilitres; nothing for none.

    Of a component that is none only the error of its rounding is left, which is written as 0.
    """
    return "" if np.isnan(value) else f"{round(float(value), 12):.9g}"
