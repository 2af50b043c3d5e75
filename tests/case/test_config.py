"""A case file is understood, or refused with one sentence that says where, what was expected, what came, what to do."""

from pathlib import Path

import pytest
from small_case import SMALL, changed, write

from vegglue.case.config import load_case, read_tree
from vegglue.errors import InputError

CONFIGS = Path(__file__).parents[2] / "configs"
PAPER = ("d0", "d3a", "d3b", "d3b_paper")


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def sentence(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        load_case(path)
    return str(caught.value)


def test_a_small_case_reads_with_its_defaults():
    case = load_case(write(SMALL))
    assert case.experiments["low"].discharge == {"upstream": 2.66}
    assert case.friction.zones[0].friction_class == "bank"
    assert case.friction.classes["bed"].n == "n_b"
    assert case.plants.stands["reed"].bare_chezy == 60
    assert case.numerics.bank_argument_minimum == 1.3
    assert case.source == Path("small.yaml").resolve()


@pytest.mark.parametrize("name", PAPER)
def test_the_shipped_cases_have_the_papers_grid_patches_and_priors(name):
    case = load_case(CONFIGS / f"{name}.yaml")
    assert (case.grid.x, case.grid.y, case.grid.cell) == ((0, 571), (-2, 13), (0.5, 0.375))
    assert [patch.stems for patch in case.plants.patches] == [22] * 4 + [7.3] * 3
    assert [patch.x for patch in case.plants.patches] == [(400 + 8 * i, 404 + 8 * i) for i in range(7)]
    assert [patch.y for patch in case.plants.patches] == [(4, 5.5), (5.5, 7)] * 3 + [(4, 5.5)]
    assert {key: (p.low, p.high) for key, p in case.parameters.items()} == {
        "n_b": (0.01, 0.15),
        "k_s": (0.1, 5),
        "phi": (0.01, 100),
    }
    assert case.simulate.members == 5000
    (experiment,) = case.experiments.values()
    assert (experiment.discharge, experiment.level) == ({"upstream": 2.66}, 0.529)
    assert "synthetic" in case.title


def test_the_shipped_cases_differ_in_canopy_height_only_where_the_paper_does():
    height = {name: load_case(CONFIGS / f"{name}.yaml").plants.stands["willow"].canopy_height for name in PAPER}
    assert height == {"d0": 0.8, "d3a": 0.8, "d3b": 1.06, "d3b_paper": 0.8}
    assert load_case(CONFIGS / "d3b_paper.yaml").canopy_correction.to_height == 1.36


REFUSED = [
    (
        "low: 0.01, high: 0.15",
        "low: 0.01, high: 0.01000000000001",
        "a range wider than the last digits; write a number",
    ),
    ("low: 0.01, high: 0.15", "low: 1e-300, high: 1.7e308", "expected numbers between 1e-30 and 1e+30, got"),
    (
        "uniform, low: 0.01, high: 0.15",
        "normal, mean: 0.05, sd: 1e-15",
        "an `sd` wider than the last digits of the mean",
    ),
    ("uniform, low: 0.01, high: 0.15", "normal, mean: 0.05, sd: 1e-300", "expected numbers between 1e-30 and 1e+30"),
    (
        "uniform, low: 0.01, high: 0.15",
        "normal, mean: 0.05, sd: 0.001, low: 5, high: 6",
        "bounds within 7 `sd` of the mean",
    ),
    (
        "uniform, low: 0.01, high: 0.15",
        "normal, mean: 1, sd: 1e20, low: 0.02, high: 0.1",
        "write a uniform prior instead",
    ),
    ("uniform, low: 0.01, high: 0.15", "lognormal, median: 0.05, log_sd: 1e+10", "a `log_sd` between 1e-09 and 20"),
    (
        "[1.0, 0.5]",
        "[1e-5, 1e-3]",
        "`grid` (regular grid of the model) expected at most 1,000,000 cells, where these make 3",
    ),
    ("[1.0, 0.5]", "[1e-308, 1e-308]", "expected at most 1,000,000 cells, where these make inf"),
    ("x: [0, 40]", "x: [-1e308, 1e308]", "expected at most 1,000,000 cells, where these make inf"),
    (
        "[0, 40], y: [-4, 4], cell: [1.0, 0.5]",
        "[0, 999], y: [0, 999], cell: [1, 1]",
        "expected cells whose factors take at most 16 GB",
    ),
    (
        "name: small",
        "name: small\nsimulate: {members: 1073741824}",
        "a number less than or equal to 1048576, got 1073741824",
    ),
    (
        "name: small",
        "name: small\nsimulate: {seed: 99999999999999999999999}",
        "a number less than 9223372036854775808, got",
    ),
    ("bottom_width", "botom_width", "`bed[0].trapezoid.botom_width` is not a known key: did you mean `bottom_width`?"),
    ("steeper_than: 0.2", "slope: 0.2", "`friction.zones[0].slope` is not a known key: known here are class"),
    (
        "name: small",
        "name: Größe {1}",
        "`name` expected lower-case letters a to z, digits, _ and - alone, got 'Größe {1}'; write grosse-1.",
    ),
    ("name: small\n", "", "`name` is missing (lower-case letters a to z, digits, _ and -): add it"),
    ("level: 0.9", "plants: true", "`experiments.low.level` is missing (water level at the outlet"),
    ("name: small", "name: Small Case", "got 'Small Case'"),
    (
        "[1.0, 0.5]",
        "[1.0, 0.3]",
        "expected a whole number of at least 3 cells along y, where these make 26.6667",
    ),
    ("[1.0, 0.5]", "[1.0, 0]", "`grid.cell[1]` expected a number greater than 0, got 0"),
    ("[1.0, 0.5]", "[1.0]", "`grid.cell"),
    (
        "x: [0, 40]",
        "x: [40, 0]",
        "`grid.x` (from upstream to downstream [m]) expected two numbers, the lower one first",
    ),
    ("bank_slope: 0.6667", "bank_slope: true", "(rise over run of the banks [-]) expected a valid number, got True"),
    ("bank_slope: 0.6667", "bank_slope: '0.6'", "got '0.6'; write numbers without quotes"),
    ("bank_slope: 0.6667", "bank_slope: '0,6'", "got '0,6'; write decimals with a point"),
    ("bank_slope: 0.6667", "bank_slope: 0.6667 m/m", "got '0.6667 m/m'; write the number alone: a case is in SI units"),
    (
        "name: small",
        "name: small\nsimulate: {membrs: }",
        "`simulate.membrs` is not a known key: did you mean `members`?",
    ),
    ("level: 0.9", "level: 0.9, plnts: ", "`experiments.low.plnts` is not a known key: did you mean `plants`?"),
    (
        "level: 0.9",
        "level: 0.9 m",
        "`experiments.low.level` (water level at the outlet, in the datum of the bed [m]) expected",
    ),
    ("level: 0.9", "level: .nan", "expected a number or the name of an entry of `parameters`, got nan"),
    ("discharge: 2.66", "discharge: -1", "`experiments.low.discharge.upstream` expected a number above 0, got -1"),
    (
        "discharge: 2.66",
        "discharge: {west: 1}",
        "names the inflow `west`, which is not declared: known here are upstream.",
    ),
    ("discharge: 2.66", "discharge: {}", "`experiments.low.discharge` lacks the inflow `upstream`"),
    ("law: manning", "law: maning", "`friction.classes.bed.law`"),
    ("k_s: 1.0", "n: 1.0", "`friction.classes.bank` expected the key `k_s`, which keulegan needs"),
    ("k_s: 1.0", "k_s: 1.0, n: 0.1", "expected no key `n` together with keulegan"),
    ("k_s: 1.0", "k_s: 0", "`friction.classes.bank.k_s` expected a number above 0, got 0"),
    (
        "default: bed",
        "default: bed\n  walls: {law: manning}",
        "smooth when left out) expected the key `n`, which manning needs, got law: manning.",
    ),
    (
        "default: bed",
        "default: bed\n  walls: {law: manning, n: 0}",
        "`friction.walls.n` expected a number above 0, got 0",
    ),
    (
        "default: bed",
        "default: bed\n  walls: {law: manning, n: n_w}",
        "`friction.walls.n` names the parameter `n_w`, which is not declared: did you mean `n_b`?",
    ),
    ("default: bed", "default: sand", "`friction.default` names the friction class `sand`, which is not declared"),
    ("class: bank", "class: bnak", "names the friction class `bnak`, which is not declared: did you mean `bank`?"),
    ("steeper_than: 0.2", "steeper_than: 0.2, x: [0, 3]", "`friction.zones[0]` expected one of `steeper_than`"),
    ("stand: reed", "stand: willow", "`plants.patches[0].stand` names the stand `willow`"),
    ("y: [0, 1.5], ", "", "`plants.patches[0]` expected either both `x` and `y`, or a `polygon`"),
    ("n: n_b", "n: n_bed", "names the parameter `n_bed`, which is not declared: did you mean `n_b`?"),
    ("n: n_b", "n: 0.03", "`parameters.n_b` is declared but used nowhere"),
    (
        "low: 0.01, high: 0.15",
        "low: 0.15, high: 0.01",
        "`parameters.n_b` expected a `low` below `high`, got distribution: uniform, low: 0.15, high: 0.01",
    ),
    ("low: 0.01, high: 0.15", "low: -0.1, high: 0.15", "`parameters.n_b` may fall to 0 or below"),
    ("low: 0.01, high: 0.15", "low: 0.01", "expected the key `high`, which uniform needs"),
    ("low: 0.01, high: 0.15", "low: 0.01, high: 0.15, sd: 1", "expected no key `sd` together with uniform"),
    ("low: 0.01, high: 100", "low: 0, high: 100", "expected a `low` above 0 for a loguniform prior, got"),
    ("{side: west}", "{side: east}", "`inflows.upstream.side`"),
    (
        "{side: west}",
        "{side: west, range: [-9, 4]}",
        "`inflows.upstream.range` expected a range within -4 to 4 m, got -9 to 4 m",
    ),
    (
        "name: small",
        "name: small\noutlet: {range: [0, 5]}",
        "`outlet.range` expected a range within -4 to 4 m, got 0 to 5 m",
    ),
    (
        "name: small",
        "name: small\nsimulate: {members: 0}",
        "`simulate.members` (size of the ensemble) expected a number greater than 0",
    ),
    ("name: small", "name: small\nsimulate: {members: 1.5}", "expected a valid integer, got 1.5"),
    ("name: small", "name: small\ninfer: {behavioural: 0.3}", "`infer.behavioural` goes with an informal likelihood"),
    ("name: small", "name: small\nsurvey: {file: no.csv}", "expected an existing file, got no.csv: put it there"),
    (
        "level: 0.9}",
        "level: 0.9, bed: [{points: no.csv}]}",
        "`experiments.low.bed[0].points` expected an existing file, got no.csv",
    ),
    ("name: small", "name: small\ntitle: 5", "expected a text, got 5; write it in quotes"),
    ("stand: reed", "stand: true", "expected a text, got True; write it in quotes"),
    ("name: small", "name: small\nname: smaller", "the key `name` stands twice"),
    ("name: small", "name: small\n\tx: 1", "expected spaces, got a tab; write spaces instead."),
]


@pytest.mark.parametrize(("old", "new", "expected"), REFUSED)
def test_what_is_wrong_is_said_in_one_sentence(old, new, expected):
    said = sentence(changed(old, new))
    assert expected in said
    assert said.startswith("small.yaml")
    assert said.endswith((".", "?"))
    assert "\n" not in said


@pytest.mark.parametrize(
    ("flow", "observation", "expected"),
    [
        ("discharge: 2, level: nosuch", "", "`validation.experiments.high.level` names the parameter `nosuch`"),
        ("discharge: -2, level: 1", "", "`validation.experiments.high.discharge.upstream` expected a number above 0"),
        ("discharge: {west: 2}, level: 1", "", "names the inflow `west`, which is not declared"),
        ("discharge: 2, level: 1, plants: [p9]", "", "names the patch `p9`, which is not declared"),
        ("discharge: 2, level: 1, stands: {rush: {phi: 1}}", "", "names the stand `rush`, which is not declared"),
        (
            "discharge: 2, level: 1, stands: {reed: {phi: 0}}",
            "",
            "`validation.experiments.high.stands.reed.phi` expected",
        ),
        ("discharge: 2, level: 1", ", experiment: low", "`validation.observations[0].experiment` names the experiment"),
    ],
)
def test_what_is_wrong_in_the_validation_is_said_too(flow: str, observation: str, expected: str) -> None:
    """It passed `check` and ended `compare` in a KeyError."""
    write("x,y,level\n10,0,1\n", "unseen.csv")
    seen = f"observations: [{{kind: level, file: unseen.csv{observation}}}]"
    said = sentence(changed("name: small", f"name: small\nvalidation: {{experiments: {{high: {{{flow}}}}}, {seen}}}"))
    assert expected in said


def test_a_parameter_of_the_validation_alone_is_used() -> None:
    write("x,y,level\n10,0,1\n", "unseen.csv")
    unseen = "{experiments: {high: {discharge: 2, level: h}}, observations: [{kind: level, file: unseen.csv}]}"
    text = SMALL.replace("name: small", f"name: small\nvalidation: {unseen}")
    assert "h" in load_case(write(f"{text}  h: {{distribution: uniform, low: 0.9, high: 1.1, unit: m}}\n")).parameters


def test_numbers_of_yaml_1_2_are_numbers():
    case = load_case(changed("name: small", "name: small\nnumerics: {tolerance: 1e-7, film_depth: 2E-3}"))
    assert (case.numerics.tolerance, case.numerics.film_depth) == (1e-7, 2e-3)


def test_a_misspelt_key_is_named_before_what_it_leaves_missing():
    assert "`nmae` is not a known key: did you mean `name`?" in sentence(changed("name: small", "nmae: small"))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("- a\n- b\n", "expected keys and values (`name: ...`), got a list; correct the file."),
        ("", "expected keys and values (`name: ...`), got an empty file; correct the file."),
        ("7", "got a single value"),
        ("a:\n\tb: 1\n", "line 2, column 1: expected spaces, got a tab; write"),
        ("a: [1", "line 1"),
        ("a: \x00", "line 1: expected text, got the sign"),
    ],
)
def test_what_is_no_mapping_is_refused(text, expected):
    assert expected in sentence(write(text))


def test_a_folder_of_measurements_has_to_be_imported():
    """Of a folder it said `check the path`; of its site file, that `discharge_m3_s` is not a known key."""
    Path("brook").mkdir()
    assert sentence(Path("brook")).endswith("it is not a file; check the path.")
    site = write("channel: {length_m: 30}\nexperiments: {low: {discharge_m3_s: 1}}\n", "brook/site.yaml")
    assert sentence(Path("brook")).endswith("it is not a file; `vegglue import brook` makes a config of that folder.")
    assert "got the site file of a folder of measurements: `vegglue import brook` makes a config" in sentence(site)


def test_missing_and_unreadable_files_are_named():
    assert sentence(Path("none.yaml")).startswith("none.yaml cannot be read: No such file")
    assert "named by `extends` in small.yaml" in sentence(write("extends: base.yaml\n"))
    Path("latin.yaml").write_bytes("title: Gew\u00e4sser".encode("latin-1"))
    assert "save it as UTF-8" in sentence(Path("latin.yaml"))


def test_extends_merges_mappings_replaces_lists_and_forgets_nulls():
    write(SMALL, "base/small.yaml")
    child = """
extends: base/small.yaml
name: child
numerics: {film_depth: 0.01}
friction: {zones: null}
plants: {stands: {reed: {canopy_height: 0.5, stems: null}}, patches: []}
"""
    case = load_case(write(child, "child.yaml"))
    assert (case.name, case.friction.zones, case.plants.patches) == ("child", (), ())
    assert case.plants.stands["reed"].canopy_height == 0.5
    assert case.plants.stands["reed"].phi == "phi"
    assert case.plants.stands["reed"].stems == 1.0


def test_a_prior_or_law_given_anew_inherits_nothing():
    write(SMALL, "base.yaml")
    child = "extends: base.yaml\nparameters: {n_b: {distribution: normal, mean: 0.08, sd: 0.01, unit: '-'}}\n"
    prior = load_case(write(child, "child.yaml")).parameters["n_b"]
    assert (prior.low, prior.high, prior.mean) == (None, None, 0.08)


def test_a_circle_of_extends_is_shown():
    write("extends: b.yaml\n", "a.yaml")
    write("extends: a.yaml\n", "b.yaml")
    assert "a.yaml -> b.yaml -> a.yaml" in sentence(Path("a.yaml"))


@pytest.mark.parametrize(
    ("child", "blamed"),
    [
        ("friction: {classes: {bed: {law: chezy, k_s: 1}}}", "child.yaml: `friction.classes.bed`"),
        ("plants: {stands: null}", "base.yaml: `plants.patches[0].stand`"),
    ],
)
def test_the_file_that_says_it_is_blamed(child, blamed):
    write(SMALL, "base.yaml")
    assert sentence(write(f"extends: base.yaml\n{child}\n", "child.yaml")).startswith(blamed)


def test_files_are_found_beside_the_file_that_names_them():
    write("x,y,z\n0,0,0\n", "data/bed.csv")
    base = SMALL.replace("name: small", "name: small\nsurvey: {file: ../data/bed.csv}")
    write(base, "base/small.yaml")
    case = load_case(write("extends: ../../base/small.yaml\n", "far/away/child.yaml"))
    assert case.survey.file == Path("data/bed.csv").resolve()


def test_a_case_cannot_be_changed():
    case = load_case(write(SMALL))
    with pytest.raises(ValueError, match="frozen"):
        case.name = "other"


def test_several_inflows_each_need_their_discharge():
    text = SMALL.replace("{side: west}", "{side: west}\n  side: {side: south, range: [10, 12], spread: uniform}")
    assert "(one value, or one for each inflow [m3/s]) expected" in sentence(write(text))
    both = load_case(write(text.replace("discharge: 2.66", "discharge: {upstream: 2, side: 0.5}")))
    assert both.experiments["low"].discharge == {"upstream": 2.0, "side": 0.5}


def test_a_word_that_begins_like_a_number_is_a_word(tmp_path):
    path = tmp_path / "words.yaml"
    path.write_text("sum: 9e6da5\nsmall: 1e-7\n", encoding="utf-8")
    assert read_tree(path) == {"sum": "9e6da5", "small": 1e-7}
