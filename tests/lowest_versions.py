"""The lowest versions that pyproject.toml allows of what vegglue needs, as constraints for pip.

    python tests/lowest_versions.py > lowest.txt
    pip install --constraint lowest.txt --editable '.[test]'

Tools of the tests themselves are left as they come.
"""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
# What these versions need in turn, before it warned of names that they use: matplotlib 3.9 and typer 0.19 do.
OF_THEIR_TIME = ("click<8.3", "pyparsing<3.3")


def lowest_versions() -> list[str]:
    """name==version of all dependencies and of the extra `arviz`."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    stated = [*project["dependencies"], *project["optional-dependencies"]["arviz"]]
    found = [re.fullmatch(r"([\w.-]+)>=([\w.]+)(,.*)?", requirement) for requirement in stated]
    assert all(found), f"expected name>=version of each, got {stated}"
    return [f"{one[1]}=={one[2]}" for one in found if one]


if __name__ == "__main__":
    print("\n".join([*lowest_versions(), *OF_THEIR_TIME]))
