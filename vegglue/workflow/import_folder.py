"""folder of measurements -> case: a config with wide priors that runs without an edit by hand.

A further layout of folders is a file in `importers/` that makes the keys and values of a config, and a line here.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from vegglue.case.config import PATHS, load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.resolved_config import Tree, as_yaml, refuse_not_made, write_made
from vegglue.case.schema import Case
from vegglue.case.text_files import write_text
from vegglue.diagnosis.channel_check import (
    refused_for_errors,
    remarks_on_assumed_errors,
    remarks_on_survey,
    remarks_on_unnamed_banks,
)
from vegglue.errors import InputError, shown_path
from vegglue.importers.confluence import (
    NOT_STATED,
    case_from_confluence,
    flat_bed,
    holds_confluence,
    mat_folder,
    tables_of_mat,
)
from vegglue.importers.field_folder import case_from_folder, case_from_sheet, case_of_sheet
from vegglue.importers.finished_results import holds_result
from vegglue.importers.import_notes import UnreadFiles
from vegglue.importers.measured_files import OF_PROGRAMS, OTHERS
from vegglue.importers.result_site import SiteOfResult, site_of
from vegglue.importers.site_file import HELD_OUT, assumptions_of_site, site_file
from vegglue.measurements.observations import read_observations
from vegglue.wording.remedies import ANOTHER_FILE, ROOM_FOR_TEMPORARY
from vegglue.wording.sentences import phrase, sentence, sentences


def import_folder(folder: Path | str, to: Path | str | None = None, *, force: bool = False) -> Case:
    """Make a case of a folder of measurements: site.yaml or site.json and tables, or a published set.

    The confluence set of R.B. Canelas makes a second config, <to>-flat.yaml, with a plane instead of the surveyed bed.

    Parameters
    ----------
    folder : Path or str
    to : Path or str, optional
        The config to write; configs/<folder>.yaml or <folder>.yaml if not given.
    force : bool
        Whether to replace files that were edited by hand or not written by vegglue.

    Returns
    -------
    Case

    Raises
    ------
    InputError
        For what is missing or cannot be read, or if a file would be replaced; then nothing was written.
    """
    folder = Path(folder)
    name = f"{folder.resolve().name}.yaml"
    target = Path(to) if to is not None else Path("configs") / name if Path("configs").is_dir() else Path(name)
    refuse_not_made({target: ""}, ANOTHER_FILE, force=True)  # a folder, before anything is read into it
    if holds_confluence(folder) or mat_folder(folder) is not None:
        tree, texts, flat = confluence_case(folder, target)
    else:
        planned = case_of_sheet(folder) if folder.is_dir() else None
        made = case_from_folder(folder, target) if planned is None else case_from_sheet(folder, target, planned)
        tree, texts, flat = made.tree, dict(made.texts), None
    refuse_unreadable_import(tree, texts, target, folder)
    made_by = phrase("made_by", "import", {"source": folder.name})
    configs = [{**texts, target: f"{made_by}\n{as_yaml(tree)}"}]
    if flat is not None:
        configs.append({target.with_stem(f"{target.stem}-flat"): f"{made_by}\n{as_yaml(flat)}"})
    for files in configs:
        refuse_not_made(files, ANOTHER_FILE, force)
    for files in configs:
        write_made(files, ANOTHER_FILE, force)
    return load_case(target)


def assumptions_of(folder: Path | str) -> list[str]:
    """What `import` assumes of a folder because it is not stated, and what it does not read."""
    folder = Path(folder)
    if case_of_sheet(folder) is not None:  # of a case that is there
        return []
    if site_file(folder).is_file() or (folder.is_dir() and any(map(holds_result, folder.iterdir()))):
        found = site_of(folder)
        return list(sentences(assumptions_of_site(folder, found.site if isinstance(found, SiteOfResult) else found)))
    return [sentence(NOT_STATED)] if holds_confluence(folder) or mat_folder(folder) is not None else []


def unread_files(case: Case, folder: Path | str) -> list[str]:
    """Which files of a folder with a site file were not read; none that belongs to one by its name, as a .prj does."""
    site = site_file(Path(folder))
    if not site.is_file():
        return []
    named = [one.name for one in case.imported or ()] + [one.file.name for one in case.observations]
    stems = [Path(name).stem for name in (*named, site.name, case.source.name)]
    free = (one.name for one in site.parent.iterdir() if one.is_file() and one.name.lower() not in OTHERS)
    names = tuple(sorted(name for name in free if not name.startswith((*stems, HELD_OUT, *OF_PROGRAMS))))
    return [sentence(UnreadFiles(names))] if names else []


def without_errors(case: Case) -> list[str]:
    """Which measurements state no standard error, and which commands refuse them; nothing if all do."""
    return list(map(sentence, refused_for_errors(case, read_observations(case).table)))


def errors_of_site(case: Case) -> list[str]:
    """What a survey of the bed leaves open, and the errors of its site that are assumed."""
    return list(map(sentence, [*remarks_on_survey(case), *remarks_on_assumed_errors(case)]))


def unnamed_banks(case: Case) -> list[str]:
    """That a bed is steep in many cells, and no class of friction is for them; nothing if not."""
    try:
        return list(map(sentence, remarks_on_unnamed_banks(case, build_site(case))))
    except InputError:  # of a bed or a grid that `check` refuses with the same words; the config is written
        return []


def confluence_case(folder: Path, target: Path) -> tuple[Tree, dict[Path, str], Tree]:
    """The config of the confluence set, its tables as text, to be written when it is known that they may be, and the
    config with a plane for the bed.
    """
    with TemporaryDirectory() as name:
        elsewhere = Path(name) / "made"
        if not holds_confluence(folder) and (of_matlab := mat_folder(folder)) is not None:
            folder = tables_of_mat(of_matlab, Path(name) / "tables")
        tree = case_from_confluence(folder, elsewhere / target.name)
        made = sorted(path for path in elsewhere.rglob("*") if path.is_file())
        texts = {target.parent / path.relative_to(elsewhere): path.read_text(encoding="utf-8") for path in made}
        return tree, texts, flat_bed(folder, target)


def refuse_unreadable_import(tree: Tree, texts: Mapping[Path, str], target: Path, folder: Path) -> None:
    """Raise InputError if the config of `tree` and the texts beside it could not be read, before they are written.

    target: path of the config to write, of the measurements in `folder`.
    """
    made = {path.relative_to(target.parent): text for path, text in texts.items()}
    with TemporaryDirectory() as name:
        elsewhere = Path(os.path.realpath(name))
        for path, text in made.items():
            write_text(elsewhere / path, text, ROOM_FOR_TEMPORARY)
        home = Path(os.path.realpath(target)).parent
        write_text(elsewhere / target.name, as_yaml(with_full_paths(tree, home, made)), ROOM_FOR_TEMPORARY)
        try:
            read_observations(load_case(elsewhere / target.name))
        except InputError as error:
            # The refusal names files by the paths that they would have had.
            here = shown_path(target.parent / target.name).removesuffix(target.name)
            refusal = str(error).replace(f"{shown_path(elsewhere)}{os.sep}", here)
            names = [f"{here}{path}" for path in made if f"{here}{path}" in refusal]
            would = f"; {' and '.join(names)} would be made of {shown_path(folder)}" if names else ""
            raise InputError(f"{refusal} Nothing was written{would}.") from None


def with_full_paths(tree: Any, home: Path, made: Mapping[Path, str]) -> Any:
    """The tree with full paths of files that are there; what is to be made is named as it will be."""
    if isinstance(tree, list):
        return [with_full_paths(one, home, made) for one in tree]
    if not isinstance(tree, dict):
        return tree
    full = {
        key: os.path.realpath(home / value)
        for key, value in tree.items()
        if key in (*PATHS, "extends") and isinstance(value, str) and Path(value) not in made
    }
    return {key: with_full_paths(value, home, made) for key, value in tree.items()} | full
