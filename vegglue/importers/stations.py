"""Measured rows as tables that a case names: points in the vertical, or stations of each kind."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array, Mask
from vegglue.case.resolved_config import Tree
from vegglue.errors import InputError
from vegglue.importers.column_names import is_in_degrees, words_of
from vegglue.importers.columns_of_table import NO_DEGREES
from vegglue.importers.config_parts import observed
from vegglue.importers.file_words import FileWords
from vegglue.importers.gauged_discharges import levels_once, whole_discharges
from vegglue.importers.known_experiments import KnownExperiments
from vegglue.importers.lost_places import numbers_of, refuse_lost_places
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.nameless_sections import ONE_PLACE, section_at, sections_by_place
from vegglue.importers.placement import Placement
from vegglue.importers.point_heights import refuse_lost_heights, vertical_role
from vegglue.importers.repeats import PlaceKey, RepeatedValue, means_of_repeats, said_of_repeats, without_repeats
from vegglue.importers.told_apart_repeats import refuse_told_apart
from vegglue.measurements.kinds import KINDS, STREAMWISE, Kind
from vegglue.wording.numbers import listed, so_many

# Share of places with several heights from which a table is of verticals [-]. Chosen, not measured: less may be places
# that were read again, with another level of the bed or of the probe beside it.
VERTICALS = 0.2
# Height of a point over the depth at which a log law has its average [-], the rule of 0.6 below the surface; and how
# near that is near enough: it moves the velocity of a log law by 2 %.
OF_AVERAGE, NEAR_AVERAGE = 0.4, 0.05
NOT_AVERAGES = (
    "they are that about 0.4 of the depth above the bed only, and not among plants; correct others, or state errors "
    "that hold the difference"
)
# By how much verticals are moved to the line of their section before it is said [m].
NEAR_LINE = 0.01
# Names of a column that a message lists.
OTHER_NAMES_SHOWN = 4
Row = list[str]


@dataclass(frozen=True)
class StationTable:
    """One table to be written: name of its file, columns, rows; the observations that name it; what is said of it."""

    file: str
    heading: tuple[str, ...]
    rows: list[Row]
    observations: tuple[Tree, ...]
    said: str


@dataclass(frozen=True)
class StationTables:
    """The tables of one file; left_out: what they lack, how many of its rows are in none of them and why, in words."""

    tables: list[StationTable]
    left_out: tuple[str, ...]

    @property
    def said(self) -> str:
        """What was made of the rows."""
        made = [table.said for table in self.tables] or ["no measurement, left out"]
        return ", ".join([*made, *self.left_out])


def station_tables(
    taken: MeasuredRows, stem: str, words: FileWords, known: KnownExperiments, place: Placement, file: str
) -> StationTables:
    """The tables of what was taken from one file. Errors: InputError, which begins with `file`."""
    at = [role for role in ("x", "y") if role in taken.numbers]
    no_place = (*_lacking(taken, at, np.all), *_without_section(taken, words))
    named = _named(taken, words, known.names, f"{file}:")
    taken, shares = whole_discharges(named)
    taken, once = levels_once(taken)
    kinds = [kind for kind in KINDS.values() if kind.column in taken.numbers]
    on_axis = () if "y" in at or not any(kind.at_point for kind in kinds) else ("y = 0 for want of a column",)
    _refuse_unknown(taken, [kind.column for kind in kinds], words, known, file)
    if _in_verticals(taken):
        refuse_told_apart(named, _heights(named), file)
        beside = tuple(f"{kind.words} beside points left out" for kind in kinds if not kind.velocity)
        lacking = (*on_axis, *no_place, *_lacking(taken, ["u", str(vertical_role(taken))], np.all), *beside)
        return StationTables([_points(taken, stem, words)], lacking)
    refuse_lost_heights(taken, _places(taken), file)
    refuse_told_apart(named, _places(named), file)
    found = [_stations(taken, stem, words, kind, place) for kind in kinds]
    no_value = _lacking(taken, [kind.column for kind in kinds], np.any)
    left_out = (*on_axis, *no_place, *no_value, *shares, *once, *_at_one_height(taken))
    return StationTables([table for table in found if table.rows], left_out)


def _refuse_unknown(
    taken: MeasuredRows, columns: Sequence[str], words: FileWords, known: KnownExperiments, file: str
) -> None:
    """Errors: InputError where a row that holds a value, or the entry of its file, names another experiment."""
    if words.experiment is not None and words.experiment not in known.names:
        raise InputError(f"{file}: {known.remedy(words.experiment)}; or correct `experiment` of this file.")
    if columns and taken.lines:
        measured = taken.only(np.any([np.isfinite(taken.numbers[column]) for column in columns], axis=0))
        known.refuse_unknown(file, measured.lines, measured.texts["experiment"])


def _lacking(taken: MeasuredRows, roles: Sequence[str], needed: Callable[..., Mask]) -> tuple[str, ...]:
    """`2 rows left out for want of x or y`, where all or any of the roles are needed; nothing where no row is."""
    if not roles:
        return ()
    lacking = int((~needed([np.isfinite(taken.numbers[role]) for role in roles], axis=0)).sum())
    return (f"{so_many(lacking, 'row')} left out for want of {' or '.join(roles)}",) if lacking else ()


def _without_section(taken: MeasuredRows, words: FileWords) -> tuple[str, ...]:
    """That names of sections are not used, where some rows have none: below a merged cell, say."""
    names = taken.texts.get("section", ()) if words.section is None else ()
    unnamed = sum(not name for name in names)
    lacking = "1 row lacks its name" if unnamed == 1 else f"{unnamed:,} rows lack their names"
    return (f"sections told by x, as {lacking}",) if 0 < unnamed < len(names) else ()


def _named(taken: MeasuredRows, words: FileWords, experiments: Sequence[str], where: str) -> MeasuredRows:
    """Every row with an experiment and a section, and with a place; rows without a place are left out."""
    place = [role for role in ("x", "y") if role in taken.numbers]
    if "x" not in place:
        headings = ", ".join([*taken.columns.values(), *taken.others])
        if any(map(is_in_degrees, taken.others)):
            raise InputError(f"{where} expected a column of x in metres, got places in {NO_DEGREES}")
        if [kind.column for kind in KINDS.values() if kind.column in taken.numbers] == ["discharge"]:
            raise InputError(_discharge_of_no_place(where, headings, experiments))
        if "level" not in taken.numbers and (wide := _side_by_side(taken, experiments)):
            raise InputError(_written_long(where, experiments, wide))
        raise InputError(
            f"{where} expected a column of x, got none in {headings}; name it by `columns: {{x: ...}}` of this file in "
            "`files` of the site file, or give there `x: 12 m` of all rows, `line` of a tape or `position` of a probe."
        )
    taken = taken.only(np.all([np.isfinite(taken.numbers[role]) for role in place], axis=0))
    names = _experiments(taken, words, experiments, where)
    sections = [words.section] * taken.size if words.section is not None else taken.texts.get("section")
    if sections is None or "" in sections:
        x, y = taken.numbers["x"], taken.numbers.get("y", np.zeros(taken.size))
        of_one_tape = "tape" in taken.columns and "tape" not in taken.numbers
        sections = [section_at(x)] * taken.size if of_one_tape else sections_by_place(x, y)
    named = replace(taken, texts={**taken.texts, "experiment": names, "section": sections})
    refuse_lost_places(named, where.removesuffix(":"))
    return named if "y" in place else named.having({"y": np.zeros(named.size)})


def _experiments(taken: MeasuredRows, words: FileWords, experiments: Sequence[str], where: str) -> list[str]:
    """The experiment of each row."""
    if words.experiment is not None:
        return [words.experiment] * taken.size
    if "experiment" in taken.texts:
        return list(taken.texts["experiment"])
    if len(experiments) == 1:
        return [experiments[0]] * taken.size
    file = where.removesuffix(":").rpartition("/")[2]
    if side_by_side := _side_by_side(taken, experiments):
        raise InputError(_written_long(where, experiments, side_by_side))
    raise InputError(
        f"{where} expected a column with the experiment of each row ({', '.join(experiments)}), got none{_alike(taken)}"
        f"; add one, or say in the site file, under `files`, `{file}: {{experiment: {experiments[0]}}}` of all rows."
    )


def _side_by_side(taken: MeasuredRows, experiments: Sequence[str]) -> list[str]:
    """Headings that hold the name of an experiment: `12 mei`, `level low`, `12 mei [m+NAP]`."""
    names = [name for one in experiments if (name := words_of(one))]
    return [heading for heading in taken.others if any(f" {name} " in f" {words_of(heading)} " for name in names)]


def _written_long(where: str, experiments: Sequence[str], side_by_side: Sequence[str]) -> str:
    return (
        f"{where} expected a row for each place and experiment, with the name of the experiment ("
        f"{', '.join(experiments)}) in one column and the value in another, got a column of values for each, "
        f"{listed(side_by_side)}; write them one below the other, levels of gauges in the columns gauge, x, y, "
        "experiment and level."
    )


def _discharge_of_no_place(where: str, headings: str, experiments: Sequence[str]) -> str:
    return (
        f"{where} expected a column of x beside the discharges, got none in {headings}; write the discharge of each "
        f"experiment into the site file, `experiments: {{{experiments[0]}: {{discharge: 620 l/s, level: ...}}}}`, and "
        "move this file out of the folder; only discharges measured at sections have x, in a column, or as `x: 12 m` "
        "of this file in `files`."
    )


def _alike(taken: MeasuredRows) -> str:
    """What an unread column of repeated words holds, which may be experiments by other names; else nothing."""
    for heading, texts in taken.others.items():
        names = list(dict.fromkeys(text for text in texts if text))
        if 1 < len(names) < len(texts) and numbers_of(texts) is None:
            shown = ", ".join([*names[:OTHER_NAMES_SHOWN], *(["..."] if len(names) > OTHER_NAMES_SHOWN else [])])
            return f", but {heading!r} with {shown} (write the names of the site file there)"
    return ""


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


def _at_one_height(taken: MeasuredRows) -> tuple[str, ...]:
    """That heights of velocities are not used, where few places have several; and what that asks of them."""
    role = vertical_role(taken)
    if role is None or "u" not in taken.numbers or not np.isfinite(taken.numbers[role]).any():
        return ()
    if role == "height" and "depth" in taken.numbers:
        share = taken.numbers[role] / taken.numbers["depth"]
        if (np.abs(share[np.isfinite(share)] - OF_AVERAGE) < NEAR_AVERAGE).all():
            return (f"at about {OF_AVERAGE:g} of the depth above the bed, and so taken for averages over the depth",)
    return (f"taken for averages over the depth, as few places have several heights ({role} not used): {NOT_AVERAGES}",)


def _places(taken: MeasuredRows) -> list[PlaceKey]:
    x, y = (np.round(taken.numbers[role] / ONE_PLACE) * ONE_PLACE for role in ("x", "y"))
    return list(zip(taken.texts["experiment"], taken.texts["section"], x.tolist(), y.tolist(), strict=True))


def _heights(taken: MeasuredRows) -> list[tuple[object, ...]]:
    """Each place with the height of its point."""
    z = np.round(taken.numbers[str(vertical_role(taken))] / ONE_PLACE).tolist()
    return [(*place, height) for place, height in zip(_places(taken), z, strict=True)]


def _points(taken: MeasuredRows, stem: str, words: FileWords) -> StationTable:
    """Points in the vertical; a section is a case of the file, at the middle of its x."""
    kept, said = _at_their_heights(taken, words)
    optional = _beside_u(kept, words)
    names = [
        f"{experiment}/{section}"
        for experiment, section in zip(kept.texts["experiment"], kept.texts["section"], strict=True)
    ]
    devices = kept.texts.get("device", ["ADV"] * kept.size)
    upward = str(vertical_role(kept))
    places = [kept.numbers[role] for role in ("x", "y", upward)]
    columns = [
        *(map(_place, one) for one in places),
        *(map(_value, one) for one in (kept.numbers["u"], *optional.values())),
    ]
    rows = [
        [name, device or "ADV", *texts]
        for name, device, texts in zip(names, devices, zip(*columns, strict=True), strict=True)
    ]
    v = optional.get("v", np.full(kept.size, np.nan))
    across = {name for name, value in zip(names, v.tolist(), strict=True) if np.isfinite(value)}
    observations = tuple(
        _section_observation(f"{stem}.csv", name, words, name in across) for name in dict.fromkeys(names)
    )
    heading = ("case", "device", "x", "y", upward, "u", *optional)
    return StationTable(
        f"{stem}.csv",
        heading,
        rows,
        observations,
        f"{len(rows)} points of {so_many(len(observations), 'section')}{said}",
    )


def _at_their_heights(taken: MeasuredRows, words: FileWords) -> tuple[MeasuredRows, str]:
    """The points with their sections at the middle of their x, each height of a place once, and what is said of it."""
    upward = str(vertical_role(taken))
    kept = taken.only(np.isfinite(taken.numbers["u"]) & np.isfinite(taken.numbers[upward]))
    sections = list(zip(kept.texts["experiment"], kept.texts["section"], strict=True))
    x = kept.numbers["x"].copy()
    for one in set(sections):
        here = np.array([section == one for section in sections])
        x[here] = np.median(x[here])
    moved = float(np.abs(x - kept.numbers["x"]).max(initial=0.0))
    kept = kept.having({"x": x})
    kept, said = without_repeats(kept, _heights(kept), errors_of_rows(kept, KINDS[STREAMWISE], words))
    return kept, f"{said}, moved to the middle x of their section by up to {moved:.2g} m" if moved > NEAR_LINE else said


def _beside_u(points: MeasuredRows, words: FileWords) -> dict[str, Array]:
    """What else is known of points: v and w where any has it, standard errors with 0 for unknown, and what all have."""
    numbers = points.numbers
    found = {role: numbers[role] for role in ("v", "w") if role in numbers and np.isfinite(numbers[role]).any()}
    errors = np.nan_to_num(errors_of_rows(points, KINDS[STREAMWISE], words))
    found |= {"u_se": errors} if errors.any() else {}
    return found | {
        role: numbers[role] for role in ("u_std", "duration_s") if role in numbers and np.isfinite(numbers[role]).all()
    }


def errors_of_rows(taken: MeasuredRows, kind: Kind, words: FileWords) -> Array:
    """Standard errors (rows,): of their column, else the one of the site file; NaN where neither says one, or 0."""
    stated = np.full(taken.size, words.standard_error.get(kind.unit, np.nan))
    column = taken.numbers.get(kind.error_column, stated)
    errors = np.where(np.isfinite(column) & (column != 0.0), column, stated)
    return np.where(errors == 0.0, np.nan, errors)


def _section_observation(file: str, name: str, words: FileWords, across: bool) -> Tree:
    experiment, section = name.split("/", 1)
    levels = {key: value for key, value in (("floor", words.floor), ("surface", words.surface)) if value is not None}
    tree = {
        "kind": "adv",
        "file": file,
        "experiment": experiment,
        "section": section,
        "case": name,
        "average": "profile",
    }
    return tree | levels | ({"across": True} if across else {})


def _stations(taken: MeasuredRows, stem: str, words: FileWords, kind: Kind, channel: Placement) -> StationTable:
    """Stations of one kind; values at one place are averaged, and their scatter gives errors where none is stated.

    What was measured at a point stands on the map of its centreline, as a case reads it.
    """
    kept = taken.only(np.isfinite(taken.numbers[kind.column]))
    errors = errors_of_rows(kept, kind, words)
    gathered: dict[PlaceKey, list[RepeatedValue]] = {}
    for place, value, error in zip(_places(kept), kept.numbers[kind.column].tolist(), errors.tolist(), strict=True):
        gathered.setdefault(place, []).append((value, error))
    x, y = np.array([place[2:] for place in gathered]).reshape(-1, 2).T
    x, y = channel.to_case(x, y) if kind.at_point else (x, y)
    rows = [
        [*place[:2], *map(_place, at), *map(_value, mean)]
        for place, mean, *at in zip(gathered, means_of_repeats(gathered), x.tolist(), y.tolist(), strict=True)
    ]
    file = f"{stem}-{kind.name}.csv"
    said = f"{len(rows)} of {kind.words}{said_of_repeats(gathered)}"
    heading = ("experiment", "section", "x", "y", kind.column, kind.error_column)
    return StationTable(file, heading, rows, (observed(kind.name, file),), said)


def _place(length: float) -> str:
    """As in a table, to a thousandth of a millimetre."""
    return f"{round(float(length), 6):.12g}"


def _value(value: float) -> str:
    """As in a table, to nine digits, as a flume's discharge may be in millilitres; nothing for none.

    Of a component that is none only the error of its rounding is left, which is written as 0.
    """
    return "" if np.isnan(value) else f"{round(float(value), 12):.9g}"
