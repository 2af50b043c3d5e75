"""The wheel in an empty environment: the loop of the demonstration, then a folder imported, diagnosed and reported.

    python tests/installed.py dist/vegglue-0.3.0-py3-none-any.whl python3.13 FOLDER
    python tests/installed.py dist/vegglue-0.3.0-py3-none-any.whl python3.11 FOLDER --lowest

Prints versions and outcomes, for docs/limits.md. What an earlier call in FOLDER has done is not done
again. pip needs an index of packages.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

from lowest_versions import OF_THEIR_TIME, lowest_versions

SAMPLE = Path(__file__).parents[1] / "data" / "samples" / "flume"
SHOWN = ("numpy", "scipy", "numba", "pandas", "pydantic", "typer")
VERSIONS = "import importlib.metadata as m, sys; print(sys.version.split()[0], *[m.version(n) for n in sys.argv[1:]])"
CALLS = (
    ("demo", "tour", "--short", "--jobs", "1"),
    ("import", "flume"),
    ("diagnose", "flume.yaml", "--jobs", "1"),
    ("infer", "flume.yaml", "--jobs", "1"),
    ("report", "flume.yaml"),
)


def install(wheel: Path, python: str, folder: Path, lowest: bool) -> Path:
    """The Python of a new environment that has the wheel and what it needs."""
    own = folder.resolve() / "own" / ("Scripts" if os.name == "nt" else "bin") / "python"
    if not (folder / "installed").exists():
        subprocess.run([python, "-m", "venv", "--clear", folder / "own"], check=True)
        (folder / "versions.txt").write_text("\n".join([*lowest_versions(), *OF_THEIR_TIME] if lowest else []))
        words = ["install", "--quiet", "--disable-pip-version-check", "-c", folder / "versions.txt", wheel.resolve()]
        subprocess.run([own, "-m", "pip", *words], check=True, stderr=subprocess.DEVNULL)
        shutil.copytree(SAMPLE, folder / "flume")
        (folder / "installed").touch()
    return own


def main(wheel: Path, python: str, folder: Path, lowest: bool) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    own, seconds, told = install(wheel, python, folder, lowest), list[float](), list[dict[str, object]]()
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    for number, call in enumerate(CALLS):
        kept = folder / f"call-{number}.json"
        if not kept.exists():
            began = time.monotonic()
            command = [own, "-m", "vegglue", *call, "--json"]
            done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
            assert done.returncode == 0, f"vegglue {' '.join(call)}\n{done.stdout}\n{done.stderr}"
            kept.write_text(json.dumps([time.monotonic() - began, json.loads(done.stdout)]), encoding="utf-8")
        took, found = json.loads(kept.read_text(encoding="utf-8"))
        seconds.append(took)
        told.append(found)
    demo, _, flume, _, page = told
    assert Path(str(demo["overview"])).is_file()
    assert Path(str(page["report"])).is_file()
    own_python, *versions = subprocess.check_output([own, "-c", VERSIONS, *SHOWN], text=True).split()
    verdict = demo["diagnosis"]["verdict"], *demo["diagnosis"]["set"]  # type: ignore[index]
    row = [own_python, "lowest" if lowest else "newest", ", ".join(versions), " ".join(verdict), str(flume["verdict"])]
    print(f"| {' | '.join([*row, *(f'{one:.0f} s' for one in (seconds[0], sum(seconds)))])} |")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]), "--lowest" in sys.argv[4:])
