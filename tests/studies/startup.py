"""Measured start of the commands: `python tests/studies/startup.py`, a part of `make bench`. Asserts nothing.

What the first diagnosis on a machine takes longer: `python tests/studies/beside.py CHECKOUT --only first`.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

CONFIG = Path(__file__).parents[2] / "configs" / "d3a.yaml"
# Fresh interpreters for each figure: the middle one of them hangs on none that was disturbed.
TIMES = 7


def main() -> None:
    """Seconds until each of a few commands has ended, and those of the processor, which neighbours hardly change."""
    with tempfile.TemporaryDirectory() as folder:
        refused, ready = Path(folder) / "refused.yaml", Path(folder) / "ready.yaml"
        refused.write_text(f"extends: {CONFIG}\ntitel: misspelt\n", encoding="utf-8")
        ready.write_text(f"extends: {CONFIG}\nname: ready\nsimulate: {{members: 1}}\n", encoding="utf-8")
        commands = {
            "import vegglue": ["-c", "import vegglue"],
            "vegglue --help": ["-m", "vegglue", "--help"],
            "vegglue infer --help": ["-m", "vegglue", "infer", "--help"],
            "vegglue version": ["-m", "vegglue", "version"],
            "a refused config": ["-m", "vegglue", "diagnose", str(refused)],
            "everything of diagnose imported": ["-c", "import vegglue; vegglue.diagnose"],
            "one member solved, loops from their cache": ["-c", ONE_MEMBER, str(ready)],
        }
        for words, arguments in commands.items():
            began, spent = zip(*(timed_start(arguments, folder) for _ in range(TIMES)), strict=True)
            print(f"{words}: {median(began):.2f} s, {median(spent):.2f} s of the processor")


# The start of a diagnosis, up to its first flow.
ONE_MEMBER = """
import sys, vegglue
case = vegglue.load_case(sys.argv[1])
from vegglue.inference.solve_ensemble import solve_flow
from vegglue.case.parameter_space import middle_value
vegglue.diagnose
solve_flow(case, {name: middle_value(case, name) for name in case.parameters})
"""


def timed_start(arguments: list[str], folder: str) -> tuple[float, float]:
    """Seconds, and seconds of the processor, of a fresh interpreter with these arguments, in a folder."""
    package = {"PYTHONPATH": os.pathsep.join(filter(None, [str(CONFIG.parents[1]), os.environ.get("PYTHONPATH")]))}
    before, began = _processor(), time.perf_counter()
    subprocess.run([sys.executable, *arguments], cwd=folder, env=os.environ | package, capture_output=True, check=False)
    return time.perf_counter() - began, _processor() - before


def _processor() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
