"""The files of measurements in a folder: named as they are, or brought into the form that a case can name.

What is brought into another form is written into a folder beside the config, which states what was taken from where.
"""

import csv
import hashlib
import io
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.case.resolved_config import Tree
from vegglue.case.text_files import unused as unused_name
from vegglue.errors import InputError, path_from, shown_path
from vegglue.importers.column_names import words_of
from vegglue.importers.column_roles import OF_FLAGS
from vegglue.importers.config_parts import observed
from vegglue.importers.file_options import FileOptions, read_file_options
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.instruments import BINARY_ENDINGS, reader_of
from vegglue.importers.library_files import readable_text
from vegglue.importers.measured_rows import (
    MeasuredRows,
    Placement,
    in_the_channel,
    joined_rows,
    refuse_far_places,
    refuse_other_bank,
    with_experiments,
)
from vegglue.importers.site_file import HELD_OUT, FieldSite, held_out_files, site_file
from vegglue.importers.stations import EXPERIMENTS, KnownExperiments, StationTable, errors_of_rows, station_tables
from vegglue.importers.table_parser import WORKBOOKS
from vegglue.measurements.csv_table import read_table
from vegglue.measurements.kinds import KINDS, STREAMWISE, kind_of
from vegglue.measurements.plausibility import is_mark

# Endings of files that may hold measurements; others need an entry in `files`.
TEXT_ENDINGS = (".csv", ".txt", ".tsv", ".dat", ".dis")
TABLE_ENDINGS = (*TEXT_ENDINGS, *WORKBOOKS, *BINARY_ENDINGS)
# Files of a folder that are none of its measurements.
OTHERS = ("answer.json", "readme.txt")
# How names of files begin that programs leave beside a table: locks of workbooks, and what a Mac keeps of every file.
OF_PROGRAMS = (".", "~$")
# Kinds of which 0 may mark no value.
DOUBTED_KINDS = (STREAMWISE, "speed")
# A number as Fortran writes it, 3.7D-01.
OF_FORTRAN = re.compile(r"\d[dD][-+]?\d")
# Values of another file at places so near are the same measurements, if there are so many of them [m], [-].
SAME_PLACE, FEWEST_COPIED = 0.5, 4
MEASURED_COLUMNS = {kind.column for kind in KINDS.values()}
# Level of the bed [m] at places along and across the channel (n,) [m].
BedLevel = Callable[[Array, Array], Array]
# What the columns of a table hold by the name of its file; what is held out is only for judging a finished model.
KIND_OF_FILE = {kind.file: kind for kind in KINDS.values()} | {"holdout.csv": kind_of(STREAMWISE)}


@dataclass(frozen=True)
class MeasuredFiles:
    """The measurements of a folder.

    Attributes
    ----------
    observations : list of Tree
        Entries of a case.
    imported : list of Tree
        What was taken, for each file that was brought into another form.
    tables : list of StationTable
        To be written into the folder of data.
    """

    observations: list[Tree]
    imported: list[Tree]
    tables: list[StationTable]


def measured_files(
    folder: Path, target: Path, site: FieldSite, place: Placement, used: Sequence[str], bed: BedLevel
) -> MeasuredFiles:
    """All measurements of a folder.

    Parameters
    ----------
    folder, target : Path
        The folder, and the config to be written.
    used : sequence of str
        Files that the site file names elsewhere, such as that of the bed.
    bed : callable
        Its level, for measured depths: x, y (n,) -> z (n,) in the channel [m].

    Raises
    ------
    InputError
        If there are none, or one cannot be read.
    """
    options = _stated_options(folder, site)
    known = KnownExperiments(tuple(site.experiments), site_file(folder).name, EXPERIMENTS, tuple(site.holdout))
    free = [
        path
        for path in folder.iterdir()
        if path.is_file() and path.name not in used and (path in options or not path.name.startswith(OF_PROGRAMS))
    ]
    texts = [path.stem for path in free if path.suffix.lower() in TEXT_ENDINGS]

    def is_read(path: Path) -> bool:
        """No raw record whose export lies beside it."""
        if path.stem.lower() == HELD_OUT or path in options:
            return path.stem.lower() != HELD_OUT
        if path.suffix.lower() not in TABLE_ENDINGS or path.name.lower() in OTHERS:
            return False
        exported = re.compile(rf"{re.escape(path.stem)}([^0-9A-Za-z]|$)")  # `mill_000_ASC` of `mill_000`
        return path.suffix.lower() not in BINARY_ENDINGS or not any(map(exported.match, texts))

    # Files of every kind in their order, then others by name, then those within folders that have options of their own.
    order = {kind.file: number for number, kind in enumerate(KINDS.values())}
    paths = sorted(filter(is_read, free), key=lambda path: (order.get(path.name, len(order)), path.name))
    named = {folder / name for name in used}
    paths += sorted(path for path in options if path.parent != folder and path not in named)
    found = _read_group(paths, options, target, place, known, bed)
    if not found.observations:
        raise _nothing_measured(found, shown_path(folder))
    return found


def held_out_measurements(
    folder: Path, target: Path, site: FieldSite, place: Placement, bed: BedLevel
) -> MeasuredFiles:
    """What a folder holds out, read as all measurements are.

    Parameters
    ----------
    folder, target : Path
        The folder, and the config to be written.
    bed : callable
        As of `measured_files`.

    Returns
    -------
    MeasuredFiles
        Empty if no experiment is held out.

    Raises
    ------
    InputError
        If the file cannot be read, or nothing in it is a measurement.
    """
    paths = held_out_files(folder)[:1] if site.holdout else []
    known = KnownExperiments(tuple(site.holdout), site_file(folder).name, HELD_OUT, tuple(site.experiments))
    found = _read_group(paths, _stated_options(folder, site), target, place, known, bed)
    if paths and not found.observations:
        raise _nothing_measured(found, f"{shown_path(folder)}, held out")
    return found


def _nothing_measured(found: MeasuredFiles, where: str) -> InputError:
    """An error about a folder without measurements: what its tables hold, if there are any."""
    if not found.imported:
        return InputError("no_measurements", where=where, files=[kind.file for kind in KINDS.values()])
    return InputError("no_value_measured", where=where, tables=found.imported)


def texts_of_tables(target: Path, tables: Sequence[StationTable]) -> dict[Path, str]:
    """What is to be written beside the config of the tables, by its path."""
    texts = {}
    for table in tables:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([table.heading, *table.rows])
        texts[data_folder(target) / table.file] = text.getvalue()
    return texts


def data_folder(target: Path) -> Path:
    """Where what a config needs is written: <config>-data beside it."""
    return target.with_name(f"{target.stem}-data")


def record(path: Path, taken: MeasuredRows | None, summary: str) -> Tree:
    """What a config keeps of a file that it was made from."""
    with path.open("rb") as file:
        tree: Tree = {"name": path.name, "sha256": hashlib.file_digest(file, "sha256").hexdigest(), "taken": summary}
    if taken is not None:
        tree |= {"columns": dict(taken.columns), "units": dict(taken.units)}
    return tree


def _stated_options(folder: Path, site: FieldSite) -> dict[Path, FileOptions]:
    """What the site file states about single files, by their paths, which may lead into folders of the folder."""
    found = {}
    for name, given in site.files.items():
        if not (folder / name).is_file():
            raise InputError("not_there", folder=folder, key="files", name=name)
        if not (folder / name).resolve().is_relative_to(folder.resolve()):
            raise InputError(
                f"{shown_path(folder)}: `files` names {name}, which leads out of the folder; copy the file into it."
            )
        found[folder / name] = read_file_options(given or {}, f"{shown_path(folder)}: `files.{name}`")
    return found


def _read_group(
    paths: Sequence[Path],
    options: Mapping[Path, FileOptions],
    target: Path,
    place: Placement,
    known: KnownExperiments,
    bed: BedLevel,
) -> MeasuredFiles:
    """Tables that a case can name stay where they are; others are brought into that form beside the config."""
    found = MeasuredFiles([], [], [])
    stations: list[tuple[Path, str, list[list[str]]]] = []  # file, kind and rows, to find what stands there twice
    # Each file for itself, but records of one point together if they belong to one section.
    groups: dict[object, list[tuple[Path, FileOptions]]] = {}
    for path in paths:
        plain = _plain_rows(path, known) if path not in options and not place.turned else None
        if plain is not None:
            named = path_from(target.resolve().parent, path)
            found.observations.append(observed(KIND_OF_FILE[path.name].name, named))
            _refuse_same_stations(path, KIND_OF_FILE[path.name].name, plain, stations)
            continue
        own = options.get(path, FileOptions())
        key = path if own.position is None else (own.experiment, own.section, own.floor, own.surface)
        groups.setdefault(key, []).append((path, own))
    for group in groups.values():
        tables, records = _converted(group, place, known, bed)
        for table in tables:
            kind = str(table.observations[0]["kind"])
            if kind in KINDS:
                _refuse_same_stations(group[0][0], kind, [[row[0], *row[2:5]] for row in table.rows], stations)
            # If gauge.csv and gauge.txt are both there, `gauge-level.csv` and `gauge-level-2.csv`; also of Gauge.txt.
            names = [one.file.removesuffix(".csv") for one in found.tables]
            name = f"{unused_name(table.file.removesuffix('.csv'), names)}.csv"
            found.tables.append(replace(table, file=name))
            found.observations.extend(
                one | {"file": f"{data_folder(target).name}/{name}"} for one in table.observations
            )
        found.imported.extend(records)
    return found


def _refuse_same_stations(
    path: Path, kind: str, rows: list[list[str]], before: list[tuple[Path, str, list[list[str]]]]
) -> None:
    """InputError if a file holds the values of another one again, at the same places to SAME_PLACE: a copy, which may
    be rounded, is no second measurement. rows: experiment, x, y and value; these join those before.
    """

    def decimals(values: Sequence[str]) -> int:
        return max((len(text.partition(".")[2]) for text in values), default=0)

    for other, of_kind, others in before:
        if of_kind != kind or other == path or min(len(rows), len(others)) < FEWEST_COPIED:
            continue
        few, many = sorted((rows, others), key=len)
        off = 0.5 * 10.0 ** -min(decimals([row[3] for row in few]), decimals([row[3] for row in many])) + 1e-9
        numbers = np.array([[float(text) for text in row[1:]] for row in many])
        names = np.array([row[0] for row in many])
        again = [
            bool(
                (
                    (names == name)
                    & (np.abs(numbers[:, :2] - [float(x), float(y)]).max(axis=1) <= SAME_PLACE)
                    & (np.abs(numbers[:, 2] - float(value)) <= off)
                ).any()
            )
            for name, x, y, value in few
        ]
        if len({row[3] for row in few}) > 1 and all(again):
            raise InputError(
                f"{shown_path(path)}: expected measurements of its own, got the {len(few)} values of {other.name} "
                "again; move one of both out of the folder."
            )
    before.append((path, kind, rows))


def _plain_rows(path: Path, known: KnownExperiments) -> list[list[str]] | None:
    """Experiment, x, y and value of a table that a case names as it is: commas, all columns by their own names, one
    kind, no flags, marks or velocities of 0, no D in exponents; None for another table.

    InputError if such a table lacks a value, or is of another experiment.
    """
    if (kind := KIND_OF_FILE.get(path.name)) is None:
        return None
    text = readable_text(path)
    lines = text.splitlines()
    heading = {name.strip() for name in lines[0].split(",")} if lines else set()
    names = ("experiment", *(["section"] if kind.velocity else []))
    place = ("x", *(["y"] if kind.at_point else []))
    of_others = {other.column for other in KINDS.values()} - {kind.column}
    flagged = any(OF_FLAGS.fullmatch(words_of(name)) for name in heading)
    if not {kind.column, *names, *place} <= heading or of_others & heading or flagged or OF_FORTRAN.search(text):
        return None
    rows = read_table(path, names, (*place, kind.column), (kind.error_column,))
    known.refuse_unknown(shown_path(path), rows.index.tolist(), rows["experiment"].tolist())
    y = rows["y"] if "y" in rows.columns else np.zeros(len(rows))
    values = rows[kind.column]
    if any(map(is_mark, values)) or (kind.name in DOUBTED_KINDS and (values == 0.0).any()):  # may be none: converted
        return None
    columns = (rows["experiment"], rows["x"], y, values)
    return [[str(one) for one in row] for row in zip(*columns, strict=True)]


def _converted(
    group: Sequence[tuple[Path, FileOptions]], place: Placement, known: KnownExperiments, bed: BedLevel
) -> tuple[list[StationTable], list[Tree]]:
    """The tables of the files of a group, and what the config keeps of each file."""
    for path, options in group:
        if options.flip and place.line is not None and options.coordinates != "channel":
            raise InputError(
                f"{shown_path(path)}: expected no `flip` of places on the map of a centreline, got one; take it out. "
                "If velocities run upstream, reverse the centreline: `reverse: true`, or its points upstream first."
            )
    read = [with_experiments(reader_of(path)(path, options), known.names) for path, options in group]
    for one, (path, options) in zip(read, group, strict=True):
        refuse_other_bank(path, one, place, options)
        if {"x", "y"} <= one.numbers.keys():
            on_map = Placement() if options.coordinates == "channel" else place
            refuse_far_places(shown_path(path), one.numbers["x"], one.numbers["y"], on_map)
    placed = [in_the_channel(one, place, options) for one, (_, options) in zip(read, group, strict=True)]
    for number, one in enumerate(placed):  # depths h alone are levels z_b + h, z_b of their table, else of the case
        numbers = one.numbers
        if {"x", "depth"} <= numbers.keys() and not (MEASURED_COLUMNS | {"below"}) & numbers.keys():
            floor, of = numbers.get("z_bed"), "in the table"
            if floor is None:
                floor, of = bed(numbers["x"], numbers.get("y", np.zeros(one.size))), "of the case"
            note = ImportNote(Noted.LEVELS_FROM_DEPTHS, names=(of,))
            placed[number] = one.having({"level": floor + numbers["depth"]}, note)
    path, options = group[0]
    if len(group) > 1:  # each file keeps standard errors of its own, NaN if neither it nor the site file has one
        options = replace(options, standard_error={})
        for number, (_, own) in enumerate(group):
            kinds = [kind for kind in KINDS.values() if kind.column in placed[number].numbers]
            errors = {kind.error_column: errors_of_rows(placed[number], kind, own) for kind in kinds}
            placed[number] = placed[number].having(errors)
    made = station_tables(joined_rows(placed), path.stem, options, known, place, shown_path(path))
    records = []
    for number, ((file, _), one) in enumerate(zip(group, placed, strict=True)):
        # A depth of the water of which no height was made is not used: levels and the bed of the case are the depth.
        of_height = "height" in one.numbers and "height" not in one.columns
        of_level = "level" in one.numbers and "level" not in one.columns
        unused = ("z_bed",) if of_height or of_level else ("z_bed", "depth")
        used = one.not_reading(*unused)
        records.append(record(file, used, f"{'with the above' if number else made.taken}: {used.summary}"))
    return made.tables, records
