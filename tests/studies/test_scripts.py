"""Scripts of make targets find their modules, begun as the Makefile begins them."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

STUDIES = Path(__file__).parent


@pytest.mark.parametrize(
    "name",
    [
        "bench",
        "blind",
        "blind_lengths",
        "confluence",
        "drawn_sites",
        "fuzz",
        "laws",
        "law_alarms",
        "natural",
        "peer",
        "scale",
        "sensitivity",
        "loop",
        "startup",
        "wide",
    ],
)
def test_a_script_is_read_by_itself(name: str) -> None:
    whole = f"import runpy, sys; sys.path[0] = {str(STUDIES)!r}; runpy.run_path({str(STUDIES / name)!r} + '.py')"
    done = subprocess.run([sys.executable, "-c", whole], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
