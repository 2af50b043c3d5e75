"""The wheel in an empty environment: the loop of the demonstration, then a folder imported, diagnosed and reported.

    python tests/installed.py dist/vegglue-0.3.0-py3-none-any.whl python3.13
    python tests/installed.py dist/vegglue-0.3.0-py3-none-any.whl python3.11 --lowest

Prints one row of the table of docs/platforms.md. pip needs an index of packages.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from lowest_versions import OF_THEIR_TIME, lowest_versions

SAMPLE = Path(__file__).parents[1] / "data" / "samples" / "flume"
SHOWN = ("numpy", "scipy", "numba", "pandas", "pydantic", "typer")
VERSIONS = "import importlib.metadata as m, sys; print(*[m.version(name) for name in sys.argv[1:]])"


def main(wheel: Path, python: str, lowest: bool) -> None:
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "PIP_CONSTRAINT"))
    }
    with TemporaryDirectory() as name:
        folder = Path(name)
        subprocess.run([python, "-m", "venv", folder / "own"], check=True)
        own = folder / "own" / ("Scripts" if os.name == "nt" else "bin") / "python"
        (folder / "versions.txt").write_text("\n".join([*lowest_versions(), *OF_THEIR_TIME] if lowest else []))
        install = [own, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-c", folder / "versions.txt"]
        subprocess.run([*install, wheel.resolve()], check=True, env=environment, stderr=subprocess.DEVNULL)
        shutil.copytree(SAMPLE, folder / "flume")

        def vegglue(*words: str) -> str:
            done = subprocess.run(
                [own, "-m", "vegglue", *words], cwd=folder, env=environment, capture_output=True, text=True, check=False
            )
            assert done.returncode == 0, f"vegglue {' '.join(words)}\n{done.stdout}\n{done.stderr}"
            return done.stdout

        began = time.monotonic()
        demo = json.loads(vegglue("demo", "tour", "--short", "--jobs", "1", "--json"))
        assert Path(demo["overview"]).is_file()
        toured = time.monotonic() - began
        vegglue("import", "flume")
        found = json.loads(vegglue("diagnose", "flume.yaml", "--jobs", "1", "--json"))
        vegglue("infer", "flume.yaml", "--jobs", "1", "--quiet")
        page = json.loads(vegglue("report", "flume.yaml", "--json"))["report"]
        assert Path(page).is_file()
        versions = subprocess.check_output([own, "-c", VERSIONS, *SHOWN], text=True).split()
        own_version = subprocess.check_output([own, "--version"], text=True).split()[1]
    verdict = " ".join([demo["diagnosis"]["verdict"], *demo["diagnosis"]["set"]])
    seconds = f"{toured:.0f} s", f"{time.monotonic() - began:.0f} s"
    row = [own_version, "lowest" if lowest else "newest", " ".join(versions), verdict, found["verdict"], *seconds]
    print(f"| {' | '.join(row)} |")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], "--lowest" in sys.argv[3:])
