"""What commands say in the end: one object for `--json`, one screen for an inference, and colour only on a terminal."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from posteriors import changed
from reach import COARSE, here, vegglue, write_reach

from vegglue.cli.printed import POSTERIOR_LINES, TERMINAL_WIDTH, posterior_lines
from vegglue.cli.terminal import left_out_of
from vegglue.results.result_files import read_posterior

MEMBERS = 32
SMALL = ("members: 1024", f"members: {MEMBERS}")
WITH_ERROR = ("experiment: June}", "experiment: June, standard_error: 0.02}")
STEPS = (
    ("check",), ("simulate", "--jobs", 1), ("simulate",), ("infer", "--jobs", 1), ("diagnose", "--jobs", 1),
    ("extend", "--add", "streamlining"), ("report",),
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("user")
    write_reach(folder, COARSE, SMALL, WITH_ERROR)
    return folder


@pytest.fixture(scope="module")
def told(folder: Path) -> list[dict[str, Any]]:
    """What each step prints with `--json`, and that it is one line and all there is."""
    objects = []
    for step, *options in STEPS:
        done = here(folder, step, "brook.yaml", *options, "--json")
        assert (done.stderr, done.stdout.count("\n")) == ("", 1), step
        objects.append(json.loads(done.stdout))
    return objects


@pytest.fixture(scope="module")
def quiet(folder: Path, told: list[dict[str, Any]]) -> str:
    """What an inference prints with `--quiet`, once all steps were taken."""
    return here(folder, "infer", "brook.yaml", "--quiet").stdout


@pytest.mark.slow
def test_every_step_tells_an_object(folder: Path, told: list[dict[str, Any]]) -> None:
    checked, simulated, again, inferred, diagnosed, extended, reported = told
    assert (checked["used_stations"], checked["experiments"]) == (15, ["June"])
    assert (simulated["members"], simulated["failed"]) == (MEMBERS, 0)
    assert simulated | {"up_to_date": True} == again
    assert simulated["up_to_date"] is False
    assert inferred["claimed"] is True
    assert inferred["parameters"]["n_b"]["median"] == pytest.approx(0.05, abs=0.01)
    assert diagnosed["verdict"]
    assert extended == {"config": "brook+streamlining.yaml", "case": "brook-streamlining", "added": ["streamlining"]}
    assert reported == {"report": str(folder / "runs/brook/report.html")}


@pytest.mark.slow
def test_an_inference_fits_one_screen_and_says_where_the_rest_is(folder: Path, quiet: str) -> None:
    said = quiet.splitlines()
    assert len(said) <= POSTERIOR_LINES
    assert max(map(len, said)) <= TERMINAL_WIDTH
    assert "runs/brook/posterior.h5" in said[-2]
    assert said[-1].strip() == "vegglue report brook.yaml"
    full = read_posterior(folder / "runs/brook/posterior.h5")
    assert len(posterior_lines(doubtful(full), "runs/brook/posterior.h5", "brook.yaml")) <= POSTERIOR_LINES


def doubtful(posterior: Any) -> Any:
    """The posterior with thirty parameters and every doubt there is."""

    def spread(by_parameter: dict[str, Any]) -> dict[str, Any]:
        return {f"{name}_{k}": value for name, value in by_parameter.items() for k in range(15)}

    marginals = posterior.marginals
    wide = {name: spread(value) for name, value in vars(marginals).items() if isinstance(value, dict)}
    wide["bound_hit"] = {name: np.array([True, True]) for name in wide["bound_hit"]}
    more = replace(posterior, marginals=replace(marginals, **wide, correlation=np.full((30, 30), 0.9)))
    sample = replace(posterior.sample, unit=spread(posterior.sample.unit), theta=spread(posterior.sample.theta))
    every = np.ones(len(posterior.station), dtype=bool)
    surprise = np.full(len(every), 5.0)
    return changed(replace(more, sample=sample), pareto_k=0.9, outlier=every, surprise=surprise)


@pytest.mark.slow
def test_quiet_leaves_out_how_far_a_command_is(folder: Path, quiet: str) -> None:
    assert "... " in here(folder, "infer", "brook.yaml", "--method", "refine").stdout
    assert "... " not in quiet
    assert "Next: " not in here(folder, "extend", "brook.yaml", "--add", "streamlining", "-q").stdout


def test_a_mistake_leaves_standard_output_empty(tmp_path: Path) -> None:
    config = write_reach(tmp_path, ("level: 0.95", "level: deep"))
    done = vegglue(tmp_path, "diagnose", config.name, "--json", succeed=False)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)


@pytest.mark.slow
def test_no_colour_goes_into_a_pipe(tmp_path: Path) -> None:
    for arguments in (("--help",), ("diagnose", "--help"), ("effects",), ("effects", "wind")):
        assert "\x1b" not in vegglue(tmp_path, *arguments).stdout, arguments


def test_help_keeps_what_stands_in_brackets(tmp_path: Path) -> None:
    """Help is marked up by brackets, too."""
    assert "Length of the reach [m]." in vegglue(tmp_path, "new", "--help").stdout
    assert "discharge_error[high]." in vegglue(tmp_path, "extend", "--help").stdout


def test_help_lists_commands_as_they_are_used(tmp_path: Path) -> None:
    said = vegglue(tmp_path, "--help").stdout
    names = re.findall(r"^[│|] ([a-z]+) ", said, re.MULTILINE)  # | on a console that knows no more
    assert names[:6] == ["demo", "new", "plan", "import", "check", "run"]
    assert names.index("diagnose") < names.index("extend") < names.index("compare") < names.index("next")


@pytest.mark.parametrize(
    ("width", "gone"),
    [
        (200, []),
        (27, ["visible"]),
        (19, ["chance", "visible"]),
        (12, ["chance", "score", "visible"]),
        (3, ["chance", "score", "visible"]),
    ],
)
def test_a_narrow_window_loses_columns_and_no_names(width: int, gone: list[str]) -> None:
    headings, rows = ("effect", "chance", "score", "visible"), [("streamlining", "7%", "+3", "0.9")]
    assert left_out_of(headings, rows, ["score"], width) == gone
