"""The line end to end through the real command line, on the brook of docs/own_case.md; what it says to mistakes."""

import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from reach import COARSE, OWN_CASE, ROOT, Say, block, vegglue, write_reach

from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash, simulation_hash
from vegglue.case.schema import Case
from vegglue.cli.main import app
from vegglue.flow.batch import CLUSTER_SIZE
from vegglue.results.result_files import read_ensemble, read_posterior, stored_hash

pytestmark = pytest.mark.slow  # whole runs through the shell
MEMBERS = 128
STEPS = ("check", "simulate", "infer", "report")
TRUE_N_B = 0.05  # of docs/own_case.md's measurements
Finished = tuple[Path, dict[str, str]]


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """The folder of a user after all four steps, and what each said."""
    folder = tmp_path_factory.mktemp("user")
    config = write_reach(folder, ("members: 1024", f"members: {MEMBERS}"))
    alone = {"simulate": ("--jobs", 1)}
    return folder, {step: vegglue(folder, step, config.name, *alone.get(step, ())).stdout for step in STEPS}


def test_every_step_says_what_it_made(finished: Finished) -> None:
    folder, said = finished
    run = folder / "runs/brook"
    assert re.search(r"540 cells, 15 of 15 ", said["check"])
    assert re.search(rf"^\.\.\. .*: 0 of {MEMBERS} ", said["simulate"])
    assert re.search(rf": {MEMBERS} members, 0 .*, 0 failed", said["simulate"])
    assert re.search(r"^n_b s m\^\(-1/3\) +0\.05", said["infer"], re.MULTILINE)
    assert len([line for line in said["infer"].splitlines() if not line.startswith("...")]) <= 24
    assert str(run / "report.html") in said["report"]
    assert {file.name for file in run.iterdir()} == {
        ".lock", "channel.png", "ensemble.h5", "posterior.h5", "flow.h5", "report.html", "figures",
    }  # fmt: skip
    assert (run / "channel.png").read_bytes().startswith(b"\x89PNG")
    drawn = list((run / "figures").iterdir())
    assert drawn
    assert all(picture.suffix == ".svg" and "<svg" in picture.read_text(encoding="utf-8") for picture in drawn)


def test_the_line_finds_what_the_measurements_were_made_with(finished: Finished) -> None:
    run = finished[0] / "runs/brook"
    ensemble, posterior = read_ensemble(run / "ensemble.h5"), read_posterior(run / "posterior.h5")
    assert len(ensemble.status) == MEMBERS
    assert ensemble.mass_error.max() < 1e-6
    np.testing.assert_allclose(ensemble.section_flow, 2.0, rtol=1e-6)
    assert posterior.marginals.median["n_b"] == pytest.approx(TRUE_N_B, abs=0.01)
    assert 3 < posterior.marginals.median["phi"] < 20
    assert posterior.fit.rmse["velocity"] < 0.02


def test_every_result_carries_the_case_it_was_made_from(finished: Finished, tmp_path: Path) -> None:
    folder, _ = finished
    case = load_case(folder / "brook.yaml")
    ensemble = read_ensemble(folder / "runs/brook/ensemble.h5", simulation_hash(case))
    assert ensemble.seed == case.simulate.seed
    assert stored_hash(folder / "runs/brook/posterior.h5") == case_hash(case)
    again = folder / "again.yaml"
    again.write_text(ensemble.config, encoding="utf-8")
    assert case_hash(load_case(again)) == case_hash(case)


def test_what_is_up_to_date_is_not_made_again(finished: Finished) -> None:
    folder, _ = finished
    path = folder / "runs/brook/ensemble.h5"
    before = path.stat().st_mtime_ns
    assert vegglue(folder, "simulate", "brook.yaml").stdout == "runs/brook/ensemble.h5 is up to date.\n"
    assert path.stat().st_mtime_ns == before


class Fetched(HTMLParser):
    """What a browser would fetch to show a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.places = re.findall(r"url\(['\"]?([^)'\"]*)|@import\s+(\S+)", text)
        self.places = [place for pair in self.places for place in pair if place]
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        wanted = {"src", "srcset", "data", "poster"} | ({"href", "xlink:href"} if tag != "a" else set())
        self.places += [value for name, value in attributes if name in wanted and value]


def test_the_report_needs_no_network(finished: Finished) -> None:
    places = Fetched((finished[0] / "runs/brook/report.html").read_text(encoding="utf-8")).places
    assert places, "a page with figures refers to something"
    assert [place[:60] for place in places if not place.startswith(("#", "data:"))] == []


def test_the_snippet_on_files_runs(
    finished: Finished, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(finished[0])
    monkeypatch.setenv("MPLBACKEND", "agg")
    names: dict[str, object] = {}
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8").partition("## What lies in the folder of a run")[2]
    found = re.search(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    assert found
    exec(compile(found[1], "python.md", "exec"), names)
    said = capsys.readouterr().out
    assert re.search(r"n_b +0\.05", said)
    assert float(re.findall(r"([\d.]+) m/s is expected", said)[0]) == pytest.approx(0.40, abs=0.03)
    assert isinstance(names["weights"], xr.DataArray)


def test_an_ensemble_without_measurements_can_be_simulated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say
) -> None:
    config = write_reach(tmp_path, COARSE, (yaml_part("observations"), ""))
    monkeypatch.chdir(tmp_path)
    several = 4 * CLUSTER_SIZE + 1  # more than one chunk
    assert say("simulate", config, "--members", several, "--jobs", 1) == (0, "")
    ensemble = read_ensemble(tmp_path / "runs/brook/ensemble.h5")
    assert ensemble.prediction.shape == (several, 0)
    assert ensemble.mass_error.max() < 1e-6
    code, error = say("infer", config, "--members", several)
    assert (code, error.count("\n")) == (2, 1), error
    assert "nothing can be inferred" in error


def yaml_part(key: str) -> str:
    """The lines of docs/own_case.md's case that belong to one key."""
    found = re.search(rf"^{key}:.*\n(?:  .*\n)*", block("yaml"), re.MULTILINE)
    assert found
    return found[0]


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("canopy_height:", "canopy_hight:", "`plants.stands.willow.canopy_hight` is not a known key: did you mean"),
        ("level: 0.95", "level: deep", "names the parameter `deep`, which is not declared"),
        ("discharge: 2.0", "discharge: -2.0", "expected a number above 0, got -2"),
        ("file: velocities.csv", "file: elsewhere.csv", "expected an existing file, got elsewhere.csv"),
        ("title: A short", "title: [A short", "expected a comma or the `]` that closes the `[` of line 3"),
    ],
)
def test_a_mistake_in_the_config_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say,
    step: str, old: str, new: str, expected: str,
) -> None:  # fmt: skip
    config = write_reach(tmp_path, (old, new))
    monkeypatch.chdir(tmp_path)
    code, error = say(step, config.name)
    assert (code, error.count("\n")) == (2, 1), error
    assert expected in error
    assert error.startswith("brook.yaml")
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    ("step", "expected"), [("infer --method glue", "run `vegglue simulate {}`"), ("report", "run `vegglue infer {}`")]
)
def test_a_step_out_of_turn_names_the_one_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say, step: str, expected: str
) -> None:
    """It said CONFIG, which is no file of a user."""
    (folder := tmp_path / "my brooks").mkdir()
    write_reach(folder)
    monkeypatch.chdir(tmp_path)
    code, error = say(*step.split(), "my brooks/brook.yaml")
    assert (code, error.count("\n")) == (2, 1), error
    assert expected.format("'my brooks/brook.yaml'") in error


def test_no_message_names_a_config_that_is_none() -> None:
    """Where the config is known `errors.shown_command` names it."""
    sources = [path for path in (ROOT / "vegglue").rglob("*") if path.suffix in (".py", ".j2")]
    assert [path.name for path in sources if re.search(r"vegglue [a-z]+ CONFIG", path.read_text("utf-8"))] == []


@pytest.mark.parametrize("arguments", [("--members", 0), ("--members", -3), ("--members", "many"), ("--jobs", 0)])
def test_an_impossible_option_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say, arguments: tuple[object, ...]
) -> None:
    config = write_reach(tmp_path)
    monkeypatch.chdir(tmp_path)
    code, error = say("simulate", config, *arguments)
    assert code == 2
    assert str(arguments[0]) in error


def test_mistakes_show_no_traceback_in_a_process_of_their_own(tmp_path: Path) -> None:
    done = vegglue(tmp_path, "check", "nowhere.yaml", succeed=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "nowhere.yaml cannot be read: No such file or directory; check the path.\n"


def test_documents_name_commands_and_targets_that_exist() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    pages = "".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs").glob("*.md")) + readme
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    named = set(re.findall(r"`make ([a-z]+)`", pages)) | set(re.findall(r"^make ([a-z]+)", readme, re.MULTILINE))
    assert {"demo", "test", "paper"} <= named <= targets
    listed = set(re.findall(r"^\| `vegglue ([a-z]+)", pages, re.MULTILINE))
    assert listed == {str(command.name) for command in app.registered_commands}


def test_every_key_of_the_table_is_one_of_a_case() -> None:
    known = {field.alias or name for name, field in Case.model_fields.items()} | {"extends"}
    _, _, table = OWN_CASE.partition("| key | choices |")
    rows = re.findall(r"^\| ((?:`[a-z_.: ]+`(?:, )?)+) \|", table, re.MULTILINE)
    keys = {re.split(r"[.:]", key)[0] for row in rows for key in re.findall(r"`([^` ]+)[^`]*`", row)} - {"vegglue"}
    assert keys - known == set()
    assert len(keys) > 10
