"""The sets of an independent code in data/open_cases, and what `vegglue import` makes of them."""

from pathlib import Path

import yaml

from vegglue.case.config import load_case
from vegglue.case.schema import Case
from vegglue.importers.field_folder import case_from_folder

OPEN_CASES = Path(__file__).parents[1] / "data" / "open_cases"


def imported(name: str, folder: Path) -> Case:
    """An open case as a user has it: its config is written into the folder, and nothing is edited by hand."""
    target = folder / f"{name}.yaml"
    target.write_text(yaml.safe_dump(case_from_folder(OPEN_CASES / name, target)), encoding="utf-8")
    return load_case(target)
