"""The resolved config reads as the same case, its hashes follow what decides a result, and no edit is replaced."""

import os
from pathlib import Path

import pytest
import yaml
from small_case import SMALL, changed, write
from systems import POSIX_ALONE

from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash, resolved_yaml, simulation_hash, write_made
from vegglue.errors import InputError

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_the_resolved_case_reads_as_the_same_case():
    case = load_case(CONFIGS / "d3b_paper.yaml")
    folder = Path(os.path.relpath(CONFIGS))
    resolved = resolved_yaml(case)
    assert "extends" not in resolved
    assert str(Path.home()) not in resolved
    tree = yaml.safe_load(resolved)
    for part in (*tree["observations"], tree["survey"]):
        part["file"] = str(folder / part["file"])
    again = load_case(write(yaml.safe_dump(tree, sort_keys=False), "resolved.yaml"))
    assert case_hash(again) == case_hash(case)


def test_the_hash_follows_contents_and_not_places():
    text = SMALL.replace("name: small", "name: small\nobservations: [{kind: level, file: levels.csv}]")
    for folder in ("one", "two"):
        write("experiment,x,y,level\nlow,1,0,0.9\n", f"{folder}/levels.csv")
    one, two = (load_case(write(text, f"{folder}/small.yaml")) for folder in ("one", "two"))
    assert case_hash(one) == case_hash(two)
    before = case_hash(one)
    write("experiment,x,y,level\nlow,1,0,0.8\n", "one/levels.csv")
    assert case_hash(one) != before


def test_results_of_other_equations_do_not_fit(monkeypatch):
    case = load_case(write(SMALL))
    before = case_hash(case), simulation_hash(case)
    monkeypatch.setattr("vegglue.case.resolved_config.EQUATIONS", 1)
    assert case_hash(case) != before[0]
    assert simulation_hash(case) != before[1]


def test_an_ensemble_outlives_another_likelihood_but_not_another_prior():
    case = load_case(write(SMALL))
    other = load_case(changed("name: small", "name: small\ninfer: {likelihood: nse, behavioural: 0.5}"))
    assert simulation_hash(other) == simulation_hash(case)
    assert case_hash(other) != case_hash(case)
    assert simulation_hash(load_case(changed("high: 0.15", "high: 0.16"))) != simulation_hash(case)
    # The order of the parameters decides which member gets which value.
    first = "  n_b: {distribution: uniform, low: 0.01, high: 0.15, unit: s m^(-1/3)}\n"
    swapped = write(SMALL.replace(first, "") + first)
    assert simulation_hash(load_case(swapped)) != simulation_hash(case)


def test_results_outlive_another_title():
    case = load_case(write(SMALL))
    named = load_case(changed("name: small", "name: small\ntitle: A small brook"))
    assert case_hash(named) == case_hash(case)
    assert "A small brook" in resolved_yaml(named)


def test_an_ensemble_outlives_what_is_said_of_the_record():
    write("experiment,x,y,level\nlow,1,0,0.9\n", "levels.csv")
    text = SMALL + "observations:\n  - {kind: level, file: levels.csv}\n"
    case = load_case(write(text))
    computed = load_case(write(text.replace("levels.csv}", "levels.csv, synthetic: true}")))
    assert [one.synthetic for one in (*case.observations, *computed.observations)] == [False, True]
    assert simulation_hash(computed) == simulation_hash(case)
    assert case_hash(computed) != case_hash(case)


ADVICE = "give another file by --to"
Texts = dict[Path, str]


@pytest.fixture
def texts(tmp_path: Path) -> Texts:
    """A table and the config it comes with."""
    return {tmp_path / "velocities.csv": "x,y,u\n1,2,0.3\n", tmp_path / "brook.yaml": "name: brook\n"}


def edited(texts: Texts) -> Texts:
    return {path: text + text.splitlines()[-1] + "0\n" for path, text in texts.items()}


def test_its_own_files_are_replaced(texts: Texts) -> None:
    for now in (texts, texts, edited(texts), texts):
        write_made(now, ADVICE)
        assert all(path.read_text().startswith(text) for path, text in now.items())


@pytest.mark.parametrize("name", ["velocities.csv", "brook.yaml"])
@pytest.mark.parametrize("by", ["edit", "hand"])
def test_what_was_made_or_edited_by_hand_stays(texts: Texts, tmp_path: Path, name: str, by: str) -> None:
    mine = tmp_path / name
    if by == "edit":
        write_made(texts, ADVICE)
        mine.write_text(mine.read_text().replace("1,2", "1,3").replace("brook", "creek"))
    else:
        mine.write_text("# mine\n")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(InputError, match=f"{name}: .*--force.*{ADVICE}"):
        write_made(edited(texts), ADVICE)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before, "nothing at all is written"
    write_made(edited(texts), ADVICE, force=True)
    assert mine.read_text().startswith(edited(texts)[mine])


@pytest.mark.parametrize("name", ["velocities.csv", "brook.yaml"])
def test_what_a_killed_command_or_an_older_version_wrote_is_no_edit(texts: Texts, tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(texts[tmp_path / name])
    write_made(texts, ADVICE)


def test_a_folder_and_bytes_that_are_no_text_stay(texts: Texts, tmp_path: Path) -> None:
    (tmp_path / "velocities.csv").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=r"velocities\.csv"):
        write_made(texts, ADVICE)
    (tmp_path / "velocities.csv").unlink()
    (tmp_path / "brook.yaml").mkdir()
    with pytest.raises(InputError, match=r"brook\.yaml"):
        write_made(texts, ADVICE)


@POSIX_ALONE
@pytest.mark.parametrize("force", [False, True])
def test_what_is_no_file_is_neither_read_nor_replaced(tmp_path: Path, force: bool) -> None:
    """Reading a pipe would wait for ever; a link that leads nowhere was made by somebody."""
    (tmp_path / "link").symlink_to("nowhere")
    os.mkfifo(tmp_path / "pipe")
    for name in ("link", "pipe"):
        with pytest.raises(InputError, match=f"{name}: .*{ADVICE}"):
            write_made({tmp_path / name: "name: x\n"}, ADVICE, force)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "pipe"]
    assert (tmp_path / "link").is_symlink()
