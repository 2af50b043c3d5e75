"""What docs/python.md and docs/examples say from Python: their code runs as it stands."""

import re
from collections.abc import Iterator
from pathlib import Path

import matplotlib
import matplotlib.pyplot
import pytest
from reach import COARSE, ROOT, write_reach

import vegglue

PAGE = ROOT / "docs" / "python.md"
EXAMPLES = ROOT / "docs" / "examples"
MEMBERS = 64
SMALL = ("members: 1024", f"members: {MEMBERS}, fields: {{x: [0, 30]}}")
WITH_ERROR = ("experiment: June}", "experiment: June, standard_error: 0.02}")
pytestmark = pytest.mark.slow


@pytest.fixture
def user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of a user with the case of the README, on larger cells; pictures are drawn and not shown."""
    write_reach(tmp_path, COARSE, SMALL, WITH_ERROR)
    monkeypatch.chdir(tmp_path)
    matplotlib.use("Agg")
    yield tmp_path
    matplotlib.pyplot.close("all")


def run_code(text: str, name: str) -> dict[str, object]:
    names: dict[str, object] = {}
    exec(compile(text, name, "exec"), names)
    return names


def test_the_page_is_right(user: Path, capsys: pytest.CaptureFixture[str]) -> None:
    blocks = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert len(blocks) == 4
    names = run_code("\n".join(blocks), PAGE.name)
    assert Path(str(names["page"])).exists()
    assert len(names["ensemble"].status) == MEMBERS
    assert names["u"].shape == (MEMBERS, 1)
    said = capsys.readouterr().out
    for part in ("Posterior of n_b, phi", "Diagnosis of brook", "Run in runs/brook", "is the mean of phi"):
        assert part in said


def test_results_are_read(user: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case = vegglue.load_case("brook.yaml")
    vegglue.infer(case, vegglue.simulate(case, jobs=1), method="glue")
    run_code((EXAMPLES / "read_results.py").read_text(encoding="utf-8"), "read_results.py")
    said = capsys.readouterr().out
    assert "over_its_error" in said
    assert "phi: correlation" in said
    assert matplotlib.pyplot.get_fignums()


def test_the_loop_finds_what_is_hidden(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "configs").symlink_to(ROOT / "configs")
    (tmp_path / "data").symlink_to(ROOT / "data")
    monkeypatch.chdir(tmp_path)
    names = run_code((EXAMPLES / "round_the_loop.py").read_text(encoding="utf-8"), "round_the_loop.py")
    before, after = (score.held_out for score in names["comparison"].model_scores)
    assert (after.sections**2).mean() < (before.sections**2).mean()
    assert "secondary_current" in names["diagnosis"].set
    assert "Comparison of 2 models" in capsys.readouterr().out
