"""The files of measurements in a folder: named as they are, or brought into the form that a case can name.

What is brought into another form is written into a folder beside the config; the config says what was taken from where.
"""

import csv
import hashlib
import io
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from vegglue.case.resolved_config import Tree
from vegglue.case.text_files import unused
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import ROLES
from vegglue.importers.config_parts import observed
from vegglue.importers.field_site import FieldSite
from vegglue.importers.file_words import FileWords, file_words
from vegglue.importers.instruments import BINARY_ENDINGS, reader_of
from vegglue.importers.known_experiments import EXPERIMENTS, KnownExperiments
from vegglue.importers.loose_table import readable_text
from vegglue.importers.measured_rows import MeasuredRows, in_the_channel, joined_rows, taken_in_words, with_experiments
from vegglue.importers.placement import Placement
from vegglue.importers.point_heights import without_unused_depth
from vegglue.importers.site_file import HELD_OUT, held_out_file, site_file
from vegglue.importers.stations import StationTable, errors_of_rows, station_tables
from vegglue.measurements.csv_table import read_table
from vegglue.measurements.kinds import KINDS, STREAMWISE, Kind, kind_of

# Endings of files that may hold measurements; others need an entry in `files`.
TEXT_ENDINGS = (".csv", ".txt", ".tsv", ".dat", ".dis")
ENDINGS = (*TEXT_ENDINGS, ".xlsx", ".xlsm", *BINARY_ENDINGS)
# Files of a folder that are none of its measurements.
OTHERS = ("answer.json", "readme.txt")
# How names of files begin that programs leave beside a table: locks of workbooks, and what a Mac keeps of every file.
OF_PROGRAMS = (".", "~$")
# Headings that a message lists of each kind of measurement: the commonest stand first.
HEADINGS_SHOWN = 4
# What the columns of a table hold by the name of its file; what is held out is only for judging a finished model.
KIND_OF_FILE = {kind.file: kind for kind in KINDS.values()} | {"holdout.csv": kind_of(STREAMWISE)}


@dataclass(frozen=True)
class MeasuredFiles:
    """observations: entries of a case; imported: for each file that was brought into another form what was taken;
    tables: what is to be written into the folder of data.
    """

    observations: list[Tree]
    imported: list[Tree]
    tables: list[StationTable]


def measured_files(folder: Path, target: Path, site: FieldSite, place: Placement, used: Sequence[str]) -> MeasuredFiles:
    """All measurements of a folder. used: files that the site file names elsewhere, such as that of the bed.

    Errors: InputError where there are none, or one cannot be read.
    """
    said = _entries(folder, site)
    known = KnownExperiments(tuple(site.experiments), site_file(folder).name, EXPERIMENTS, tuple(site.holdout))
    found = _read(_candidates(folder, said, used), said, target, place, known)
    if not found.observations:
        raise InputError(f"{shown_path(folder)}: {_nothing_measured(found)}")
    return found


def _nothing_measured(found: MeasuredFiles) -> str:
    """The end of a sentence about a folder without measurements: what its tables hold, where there are any."""
    if found.imported:
        held = " ".join(f"{one['name']}: {one['taken']}." for one in found.imported)
        kinds = ", ".join(kind.words for kind in KINDS.values())
        headings = "; ".join(
            f"{kind.words} as {', '.join(ROLES[kind.column].names[:HEADINGS_SHOWN])}" for kind in KINDS.values()
        )
        return (
            f"expected columns of {kinds}, got none that is known. {held} Name the column by what it holds, such as "
            "`columns: {u: ...}` of its file in `files` of the site file, or give it a heading that is understood, "
            f"among them {headings}."
        )
    files = ", ".join(kind.file for kind in KINDS.values())
    return f"expected one of {files}, or other tables of measurements, got none; put what was measured there."


def held_out_files(folder: Path, target: Path, site: FieldSite, place: Placement) -> MeasuredFiles:
    """What is held out, read as all measurements are; nothing where no experiment is held out.

    Errors: InputError where the file cannot be read, or nothing in it is a measurement.
    """
    paths = [path for path in (held_out_file(folder),) if path is not None and site.holdout]
    known = KnownExperiments(tuple(site.holdout), site_file(folder).name, HELD_OUT, tuple(site.experiments))
    found = _read(paths, _entries(folder, site), target, place, known)
    if paths and not found.observations:
        raise InputError(f"{shown_path(folder)}: of what is held out, {_nothing_measured(found)}")
    return found


def texts_of_tables(target: Path, tables: Sequence[StationTable]) -> dict[Path, str]:
    """What is to be written beside the config of the tables, by its path."""
    texts = {}
    for table in tables:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([table.heading, *table.rows])
        texts[data_folder(target) / table.file] = text.getvalue()
    return texts


def _read(
    paths: Sequence[Path], said: Mapping[Path, FileWords], target: Path, place: Placement, known: KnownExperiments
) -> MeasuredFiles:
    """Tables that a case can name stay where they are; others are brought into that form beside the config."""
    found: list[Tree] = []
    imported: list[Tree] = []
    written: list[StationTable] = []
    others = []
    for path in paths:
        kind = KIND_OF_FILE.get(path.name)
        if kind is not None and path not in said and not place.turned and _is_plain(path, kind):
            _check_plain(path, kind, known)
            found.append(observed(kind.name, named_from(path, target)))
        else:
            others.append((path, said.get(path, FileWords())))
    for group in _groups(others):
        tables, records = _brought(group, place, known)
        for table in tables:
            name = _free_name(table.file, [one.file for one in written])
            written.append(replace(table, file=name))
            found += [one | {"file": f"{data_folder(target).name}/{name}"} for one in table.observations]
        imported += records
    return MeasuredFiles(found, imported, written)


def _free_name(file: str, taken: Sequence[str]) -> str:
    """Where gauge.csv and gauge.txt are both there, `gauge-level.csv` and `gauge-level-2.csv`; also of Gauge.txt."""
    return f"{unused(file.removesuffix('.csv'), [name.removesuffix('.csv') for name in taken])}.csv"


def data_folder(target: Path) -> Path:
    """Where what a config needs is written: <config>-data beside it."""
    return target.with_name(f"{target.stem}-data")


def named_from(file: Path, target: Path) -> str:
    """The path of a file as a config names it."""
    return Path(os.path.relpath(file, target.resolve().parent)).as_posix()


def record(path: Path, taken: MeasuredRows | None, said: str) -> Tree:
    """What a config keeps of a file that it was made from."""
    tree: Tree = {"name": path.name, "sha256": hashlib.sha256(path.read_bytes()).hexdigest(), "taken": said}
    if taken is not None:
        tree |= {"columns": dict(taken.columns), "units": dict(taken.units)}
    return tree


def _entries(folder: Path, site: FieldSite) -> dict[Path, FileWords]:
    """What the site file says about single files, by their paths, which may lead into folders of the folder."""
    entries = {}
    for name, given in site.files.items():
        if not (folder / name).is_file():
            raise InputError(f"{shown_path(folder)}: `files` names {name}, which is not there; correct it.")
        if not (folder / name).resolve().is_relative_to(folder.resolve()):
            raise InputError(
                f"{shown_path(folder)}: `files` names {name}, which leads out of the folder; copy the file into it."
            )
        entries[folder / name] = file_words(given or {}, f"{shown_path(folder)}: `files.{name}`")
    return entries


def _candidates(folder: Path, said: Mapping[Path, FileWords], used: Sequence[str]) -> list[Path]:
    """Files of every kind in their order, then others by name; no raw record whose export lies beside it.

    Of folders within the folder only those files that have words of their own.
    """
    order = {kind.file: place for place, kind in enumerate(KINDS.values())}
    free = [
        path
        for path in folder.iterdir()
        if path.is_file() and path.name not in used and (path in said or not path.name.startswith(OF_PROGRAMS))
    ]
    texts = [path.stem for path in free if path.suffix.lower() in TEXT_ENDINGS]
    paths = [
        path
        for path in free
        if path.stem.lower() != HELD_OUT
        and (path in said or (path.suffix.lower() in ENDINGS and path.name.lower() not in OTHERS))
        and (path in said or not _is_raw_of(path, texts))
    ]
    within = [path for path in said if path.parent != folder and path not in {folder / name for name in used}]
    return sorted(paths, key=lambda path: (order.get(path.name, len(order)), path.name)) + sorted(within)


def _is_raw_of(path: Path, texts: Sequence[str]) -> bool:
    """Whether a file is the raw record that one of the texts was exported from: `mill_000` of `mill_000_ASC`."""
    of_path = re.compile(rf"{re.escape(path.stem)}([^0-9A-Za-z]|$)")
    return path.suffix.lower() in BINARY_ENDINGS and any(of_path.match(text) for text in texts)


def _is_plain(path: Path, kind: Kind) -> bool:
    """Whether a table is in the form that a case names as it is: commas, all columns by their own names, one kind."""
    lines = readable_text(path).splitlines()
    heading = [name.strip() for name in lines[0].split(",")] if lines else []
    place = ("x", *(["y"] if kind.at_point else []), *(["section"] if kind.velocity else []))
    of_others = {other.column for other in KINDS.values()} - {kind.column}
    return {"experiment", kind.column, *place} <= set(heading) and not of_others & set(heading)


def _check_plain(path: Path, kind: Kind, known: KnownExperiments) -> None:
    """Errors: InputError where a table that stays where it is lacks a value, or is of another experiment."""
    names = ("experiment", *(["section"] if kind.velocity else []))
    place = ("x", *(["y"] if kind.at_point else []))
    rows = read_table(path, names, (*place, kind.column), (kind.error_column,))
    known.refuse_unknown(shown_path(path), rows.index.tolist(), rows["experiment"].tolist())


def _groups(files: Sequence[tuple[Path, FileWords]]) -> list[list[tuple[Path, FileWords]]]:
    """Each file for itself, but records of one point together where they belong to one section."""
    groups: dict[object, list[tuple[Path, FileWords]]] = {}
    for path, words in files:
        key = path if words.position is None else (words.experiment, words.section, words.floor, words.surface)
        groups.setdefault(key, []).append((path, words))
    return list(groups.values())


def _brought(
    group: Sequence[tuple[Path, FileWords]], place: Placement, known: KnownExperiments
) -> tuple[list[StationTable], list[Tree]]:
    """The tables of the files of a group, and what the config keeps of each file."""
    for path, words in group:
        if words.flip and place.line is not None and words.coordinates != "channel":
            raise InputError(
                f"{shown_path(path)}: expected no `flip` of places on the map of a centreline; where velocities run "
                "upstream, draw the line from its other end: `reverse: true`, or its points upstream first."
            )
    read = [with_experiments(reader_of(path)(path, words), known.names) for path, words in group]
    placed = [in_the_channel(one, place, words) for one, (_, words) in zip(read, group, strict=True)]
    path, words = group[0]
    if len(group) > 1:
        placed = [_with_own_errors(one, own) for one, (_, own) in zip(placed, group, strict=True)]
        words = replace(words, standard_error={})
    made = station_tables(joined_rows(placed), path.stem, words, known, place, shown_path(path))
    told = [without_unused_depth(one) for one in placed]
    said = [
        f"{made.said if not number else 'with the above'}: {taken_in_words(one)}" for number, one in enumerate(told)
    ]
    return made.tables, [record(file, one, line) for (file, _), one, line in zip(group, told, said, strict=True)]


def _with_own_errors(taken: MeasuredRows, words: FileWords) -> MeasuredRows:
    """The rows of one file of a group with its own standard errors, NaN where neither it nor the site file has one."""
    kinds = [kind for kind in KINDS.values() if kind.column in taken.numbers]
    return taken.having({kind.error_column: errors_of_rows(taken, kind, words) for kind in kinds})
