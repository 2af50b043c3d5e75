"""The documents are true: commands shown are run, numbers shown are what they print, links lead somewhere."""

import json
import os
import re
import shlex
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest
import typer
import yaml
from open_cases import WANTED, assert_found
from reach import ROOT, block, here, write_reach

import vegglue
from vegglue.calibration.candidates import NOT_SEARCHED
from vegglue.case.resolved_config import case_hash
from vegglue.cli.main import app
from vegglue.effects.library import library
from vegglue.results.loop_results import comparison_that_fits

PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
OWN_FILES = ROOT / "docs" / "own_files.md"
# Pages whose commands are run, in this order, in one folder.
SHOWN = (ROOT / "docs" / "tutorial.md", ROOT / "README.md")
LEFT_OUT = "..."
# Kinds of blocks that hold commands.
SHELL = ("sh", "bash", "console", "")
NUMBER = re.compile(r"-?\d[\d,]*(?:\.\d+)?(?:e[+-]?\d+)?")
# Share by which a number may differ on another machine [-]: arithmetic there is another in the last digits, and what is
# drawn at random follows it. Where one unit of the last digit shown is more, that may be.
ANOTHER_MACHINE = 0.1
# Draws that the posterior is worth at least [-]: pages show no number of it, and its thousand take half a minute.
WORTH = 160


@dataclass(frozen=True)
class Shown:
    """A command of a page, and the lines that the page shows of its output."""

    command: str
    lines: tuple[str, ...]


def shown_in(page: Path) -> list[Shown]:
    """Commands and outputs of the ```console blocks of a page."""
    found = []
    for shell in re.findall(r"^```console\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL):
        for part in re.split(r"^\$ ", shell, flags=re.MULTILINE)[1:]:
            first, *rest = part.splitlines()
            found.append(Shown(first, tuple(line for line in rest if line.strip() not in ("", LEFT_OUT))))
    return found


def numbers_of(line: str) -> list[tuple[float, float]]:
    """Each number of a line, and by how much it may differ."""
    found = []
    for text in NUMBER.findall(line):
        value = float(text.replace(",", ""))
        mantissa, _, power = text.partition("e")
        last_digit = 10.0 ** (float(power or 0) - len(mantissa.partition(".")[2]))
        found.append((value, max(ANOTHER_MACHINE * abs(value), last_digit)))
    return found


def has_numbers(shown: str, printed: str) -> bool:
    """Whether a line begins with the numbers shown, up to another machine's last digits; words may differ."""
    mine, others = numbers_of(shown), numbers_of(printed)
    if len(others) < len(mine) or (len(others) > len(mine) and not shown.rstrip().endswith(LEFT_OUT)):
        return False
    return all(abs(value - other) <= off * (1 + 1e-9) for (value, off), (other, _) in zip(mine, others, strict=False))


def check_shown(shown: Shown, printed_lines: list[str]) -> None:
    """Every line that a page shows has the numbers of a line that the command prints."""
    for line in shown.lines:
        assert any(has_numbers(line, each) for each in printed_lines), "\n".join(
            [f"$ {shown.command}", f"shown: {line}", *printed_lines]
        )


def test_numbers_of_lines_are_compared() -> None:
    assert has_numbers("error 0.0392, then 0.0033", "RMSE  0.0391, then  0.0034")
    assert not has_numbers("error 0.0392", "error 0.0292")
    assert has_numbers("12 stations, some ...", "12 stations, some 7.4 h")
    assert not has_numbers("12 stations, some", "12 stations, some 7.4 h")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for target, anchor in re.findall(r"\]\((?!https?:)([^)#]*)(?:#([^)]*))?\)", text):
        there = (page.parent / target).resolve() if target else page
        assert there.exists(), f"{page.name}: {target}"
        if anchor:
            titles = re.findall(r"^#+ (.*)$", there.read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor in [re.sub(r"[^\w\- ]", "", title).lower().replace(" ", "-") for title in titles]


def test_files_that_the_map_names_exist() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    prose = re.sub(r"^\| `.*$", "", text, flags=re.MULTILINE)  # the table of folders is made of their docstrings
    named = set(re.findall(r"`([\w/]+(?:\.(?:py|md)|/))`", prose))
    assert len(named) > 15
    missing = [name for name in named if not (ROOT / name).exists() and not (ROOT / "vegglue" / name).exists()]
    assert missing == []


def lines_of_shell(page: Path) -> list[str]:
    """Every `vegglue ...` that a page shows: in blocks of shell, and in the middle of its sentences."""
    text = page.read_text(encoding="utf-8")
    blocks = re.findall(r"^```(\w*)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    shown = [line.removeprefix("$ ").strip() for kind, part in blocks if kind in SHELL for line in part.splitlines()]
    spoken = [" ".join(words.split()) for words in re.findall(r"(?<!`)`(vegglue [^`]+)`", text)]
    return [line for line in [*shown, *spoken] if line.startswith("vegglue ")]


def test_all_commands_but_one_print_less_or_json() -> None:
    """As docs/commands.md says."""
    commands = typer.main.get_group(app).commands
    options = {name: {one for each in command.params for one in each.opts} for name, command in commands.items()}
    assert {name for name, own in options.items() if not {"--quiet", "--json"} <= own} == {"version"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_and_options_that_are_shown_exist(page: Path) -> None:
    commands = typer.main.get_group(app).commands
    for line in lines_of_shell(page):
        _, name, *rest = shlex.split(line, comments=True)
        if not name.islower():  # COMMAND, or ...
            continue
        known = {option for parameter in getattr(commands.get(name), "params", []) for option in parameter.opts}
        options = {word.partition("=")[0] for word in rest if re.match("--?[a-z]", word)}
        assert name in commands or name.startswith("--"), line
        assert options <= known | {"--help"}, line


@pytest.mark.parametrize(
    ("page", "key"), [("bends", "grid"), ("diagnosis", "model_error")], ids=lambda argument: argument
)
def test_keys_that_are_shown_make_a_case(tmp_path: Path, page: str, key: str) -> None:
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    found = re.search(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert found
    config = write_reach(tmp_path)
    config.write_text(yaml.safe_dump(yaml.safe_load(config.read_text("utf-8")) | yaml.safe_load(found[1])), "utf-8")
    assert key in yaml.safe_load(found[1])
    vegglue.load_case(config)


def test_the_readme_fits_two_screens() -> None:
    """A screen holds some 45 lines."""
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 2 * 45


def test_the_folder_of_the_page_becomes_a_case(tmp_path: Path) -> None:
    site, folder = block("json"), tmp_path / "my-site"
    folder.mkdir()
    (folder / "site.json").write_text(site, encoding="utf-8")
    (folder / "velocities.csv").write_text("experiment,section,x,y,u,u_se\nlow,A,50,0,0.4,0.01\n", encoding="utf-8")
    case = vegglue.import_folder(folder, tmp_path / "my-site.yaml")
    assert list(case.experiments) == list(json.loads(site)["experiments"])
    assert len(case.plants.patches) == 1


@pytest.mark.skipif(os.name == "nt", reason="the pages show a POSIX shell")
@pytest.mark.parametrize("page", SHOWN, ids=lambda page: page.name)
def test_the_commands_of_a_page_find_the_config_that_import_writes(tmp_path: Path, page: Path) -> None:
    """In a clone, as the lines before them say: beside `configs`, `import` writes into that folder."""
    shell = re.search(r"^```sh\nsource [^\n]*\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert shell
    (tmp_path / "configs").mkdir()
    shutil.copytree(ROOT / "data" / "open_cases" / "open-b", tmp_path / "data" / "open_cases" / "open-b")
    went = subprocess.run(["sh", "-ec", f"{shell[1]}\npwd"], cwd=tmp_path, capture_output=True, text=True, check=True)
    folder = Path(went.stdout.splitlines()[-1])
    first, second, *_ = shown_in(page)
    printed(first.command, folder)
    assert (folder / second.command.split()[-1]).is_file()


def shown_on_first_pages() -> list[Shown]:
    return [one for page in SHOWN for one in shown_in(page)]


@pytest.fixture(scope="module")
def willows(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, list[str]]]:
    """The folder in which all commands of the first pages were run, and the lines that each of them printed."""
    folder = tmp_path_factory.mktemp("first_pages")
    shutil.copytree(ROOT / "data" / "open_cases" / "open-b", folder / "willows")
    lines = dict.fromkeys(one.command for one in shown_on_first_pages())  # each once, where it is shown first
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("vegglue.inference.refine.EFFECTIVE_DRAWS", WORTH)
        return folder, {line: printed(line, folder) for line in lines}


@pytest.mark.slow
def test_commands_print_the_numbers_shown(willows: tuple[Path, dict[str, list[str]]]) -> None:
    _, lines = willows
    assert len(shown_on_first_pages()) > 4
    for one in shown_on_first_pages():
        check_shown(one, lines[one.command])


@pytest.mark.slow
def test_what_the_tutorial_hides_is_found_and_added(willows: tuple[Path, dict[str, list[str]]]) -> None:
    """Of open-b what `test_open_effects` asks of its neighbours, in the files that the commands left."""
    folder, _ = willows
    case, runs = vegglue.load_case(folder / "willows.yaml"), folder / "runs"
    assert (runs / "willows" / "diagnosis.h5").is_file()
    assert_found(vegglue.diagnose(case, runs=runs), "secondary_current", 0.010)
    ladder = comparison_that_fits(runs / "willows", case_hash(case))
    assert ladder is not None
    before, after = ladder.steps
    assert after.unseen < min(before.unseen, WANTED)


@pytest.mark.slow
def test_the_demonstration_goes_the_same_way(willows: tuple[Path, dict[str, list[str]]], tmp_path: Path) -> None:
    """Its site is that of the tutorial, and what lies in its folder is not computed again, nor what was added."""
    shutil.copytree(willows[0] / "runs", tmp_path / "tour")
    shutil.copy(willows[0] / "willows+secondary_current.yaml", tmp_path / "tour")
    results = {path: path.stat().st_mtime_ns for path in (tmp_path / "tour").rglob("*.h5")}
    quiet, told = (here(tmp_path, "demo", "tour", "--short", "--jobs", "1", mode) for mode in ("--quiet", "--json"))
    page = (tmp_path / "tour" / "overview.html").resolve()
    assert (len(quiet.stdout.splitlines()), quiet.stderr, told.stderr) == (1, "", "")
    assert str(page) in quiet.stdout
    found = json.loads(told.stdout)
    assert found["overview"] == str(page)
    assert (page.is_file(), found["diagnosis"]["set"]) == (True, ["secondary_current"])
    assert results == {path: path.stat().st_mtime_ns for path in (tmp_path / "tour").rglob("*.h5")} != {}


@pytest.mark.slow
def test_files_of_the_page_are_read_as_shown(tmp_path: Path) -> None:
    """docs/own_files.md: a table of an office, then the bend and the flume of data/samples, a diagnosis each."""
    text = OWN_FILES.read_text(encoding="utf-8")
    shutil.copytree(ROOT / "data" / "samples", tmp_path, dirs_exist_ok=True)
    site = tmp_path / "mill"
    site.mkdir()
    table = re.search(r"^```text\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert table
    (site / "velocities june.txt").write_text(table[1], encoding="utf-8")
    shown = re.search(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert shown
    (site / "site.yaml").write_text(shown[1], encoding="utf-8")
    for one in shown_in(OWN_FILES):
        check_shown(one, printed(one.command, tmp_path))


@pytest.mark.slow
def test_the_law_of_the_page_is_found(tmp_path: Path) -> None:
    """The commands of docs/discover.md, on the channel of twins."""
    for name in ("configs/twin.yaml", "data/twin"):
        (tmp_path / name).parent.mkdir()
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, tmp_path / name)
    for one in shown_in(ROOT / "docs" / "discover.md"):
        check_shown(one, printed(one.command, tmp_path))


def printed(line: str, folder: Path) -> list[str]:
    """The lines that a command of vegglue prints, in a folder."""
    name, *arguments = line.split()
    assert name == "vegglue", line
    done = here(folder, *arguments, succeed=False)
    assert done.returncode == 0, f"$ {line}\n{done.stderr}"
    return done.stdout.splitlines()


@pytest.mark.parametrize("page", ["README.md", "docs/tutorial.md", "docs/diagnosis.md"])
def test_pages_count_the_effects_that_can_be_named(page: str) -> None:
    nameable = [one for one in library(None).values() if not NOT_SEARCHED & set(one.tags)]
    counted = re.search(r"(?:one of|each of|the) (\d+) effects", (ROOT / page).read_text(encoding="utf-8"))
    assert counted
    assert int(counted[1]) == len(nameable)
