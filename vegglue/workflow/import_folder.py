"""folder of measurements -> case: a config with wide priors that runs without an edit by hand.

A further layout of folders is a file in `importers/` that makes the keys and values of a config, and a line here.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.made_files import refuse_not_made, write_made
from vegglue.case.resolved_config import Tree, as_yaml
from vegglue.case.schema import Case
from vegglue.diagnosis.channel_and_plants import remarks_on_unnamed_banks
from vegglue.diagnosis.ensemble_and_priors import refused_for_errors
from vegglue.errors import InputError
from vegglue.importers.confluence import NOT_STATED, case_from_confluence, flat_bed, holds_confluence
from vegglue.importers.confluence_mat import mat_folder, tables_of_mat
from vegglue.importers.field_folder import case_from_folder
from vegglue.importers.site_file import left_open, site_file
from vegglue.measurements.observations import read_observations
from vegglue.workflow.import_trial import refuse_unreadable_import

ANOTHER_FILE = "give another file by --to"


def import_folder(folder: Path | str, to: Path | str | None = None, *, force: bool = False) -> Case:
    """Make a case of a folder of measurements: site.json or site.yaml and tables, or a published set.

    to: the config to write; configs/<folder>.yaml or <folder>.yaml if not given. The confluence set of R.B. Canelas
    makes a second config, <to>-flat.yaml, with a plane instead of the surveyed bed. force: replace files that were
    edited or not made here, too. Errors: InputError for what is missing or cannot be read, or would be replaced; then
    nothing was written.
    """
    folder = Path(folder)
    target = _default_target(folder) if to is None else Path(to)
    if holds_confluence(folder) or mat_folder(folder) is not None:
        tree, texts, flat = _of_confluence(folder, target)
    else:
        made = case_from_folder(folder, target)
        tree, texts, flat = made.tree, dict(made.texts), None
    refuse_unreadable_import(tree, texts, target, folder)
    configs = [{**texts, target: _config_text(folder, tree)}]
    if flat is not None:
        configs.append({target.with_stem(f"{target.stem}-flat"): _config_text(folder, flat)})
    for files in configs:
        refuse_not_made(files, ANOTHER_FILE, force)
    for files in configs:
        write_made(files, ANOTHER_FILE, force)
    return load_case(target)


def assumptions_of(folder: Path | str) -> list[str]:
    """What `import` assumes of a folder because nobody said it, and what it does not read."""
    folder = Path(folder)
    if site_file(folder).is_file():
        return left_open(folder)
    return list(NOT_STATED) if holds_confluence(folder) or mat_folder(folder) is not None else []


def without_errors(case: Case) -> list[str]:
    """Which measurements state no standard error, and who refuses them; nothing where all do."""
    return list(refused_for_errors(case, read_observations(case).table))


def unnamed_banks(case: Case) -> list[str]:
    """That a bed is steep in many cells, and no class of friction is for them; nothing where it is not so."""
    try:
        return list(remarks_on_unnamed_banks(case, build_site(case)))
    except InputError:  # of a bed or a grid that `check` refuses with the same words; the config is written
        return []


def _config_text(folder: Path, tree: Tree) -> str:
    return f"# Made by `vegglue import` from {folder.name}.\n" + as_yaml(tree)


def _of_confluence(folder: Path, target: Path) -> tuple[Tree, dict[Path, str], Tree]:
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


def _default_target(folder: Path) -> Path:
    name = f"{folder.resolve().name}.yaml"
    return Path("configs") / name if Path("configs").is_dir() else Path(name)
