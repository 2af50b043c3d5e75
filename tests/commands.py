"""Commands for tests: small programs in place of another code, which start in a few hundredths of a second."""

import sys
from pathlib import Path

from reach import write_reach

from vegglue.case.config import load_case
from vegglue.case.schema import Case

# Python without site packages: nothing of vegglue is loaded, as in another code.
BARE = f"{sys.executable} -I -S"
# u = (n_b phi^0.1 + x / 1000) of the station: smooth in both parameters, and no flow at all.
SMOOTH = """
import csv, json
given = json.load(open("parameters.json"))["parameters"]
n, phi = given["n_b"]["value"], given["phi"]["value"]
with open("stations.csv") as file:
    rows = list(csv.DictReader(file))
with open("predictions.csv", "w") as file:
    file.write("station,prediction\\n")
    for row in rows:
        file.write(f"{row['station']},{0.2 / n**0.5 - 0.05 * phi**0.2 + float(row['x']) / 1000!r}\\n")
"""


def commanded(folder: Path, program: str = SMOOTH, engine: str = "", *changes: tuple[str, str]) -> Case:
    """The brook of the docs with a program as its engine; engine: further keys of it."""
    (folder / "model.py").write_text(program, encoding="utf-8")
    told = f'engine: {{command: "{BARE} {{model}}", files: {{model: model.py}}{engine}}}'
    return load_case(write_reach(folder, ("name: brook", f"name: brook\n{told}"), *changes), trust=True)
