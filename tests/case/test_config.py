"""A case file is understood, or refused in one sentence with the file and the key."""

from pathlib import Path

import pytest
from reach import write_reach
from small_case import SMALL, changed, write

from vegglue.case.config import load_case, read_tree
from vegglue.case.messages import nearest_effect
from vegglue.case.resolved_config import case_hash, digest_of, resolved_yaml, simulation_hash
from vegglue.case.schema import Case
from vegglue.effects.library import library
from vegglue.errors import InputError
from vegglue.wording.numbers import nearest

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


PRIOR = "uniform, low: 0.01, high: 0.15"
BED, PATCH = "low: 0.01, high: 0.15", "y: [0, 1.5], "
# What is changed in the small case, the key that is blamed, and words of the message besides: values and other keys.
REFUSED = [
    (BED, "low: 0.01, high: 0.01000000000001", "parameters.n_b", ()),
    (BED, "low: 1e-300, high: 1.7e308", "parameters.n_b", ("1e-30", "1e+30")),
    (PRIOR, "normal, mean: 0.05, sd: 1e-15", "parameters.n_b", ("`sd`",)),
    (PRIOR, "normal, mean: 0.05, sd: 1e-300", "parameters.n_b", ("1e-30", "1e+30")),
    (PRIOR, "normal, mean: 0.05, sd: 0.001, low: 5, high: 6", "parameters.n_b", ("7 `sd`",)),
    (PRIOR, "normal, mean: 1, sd: 1e20, low: 0.02, high: 0.1", "parameters.n_b", ("uniform",)),
    (PRIOR, "lognormal, median: 0.05, log_sd: 1e+10", "parameters.n_b", ("`log_sd`", "1e-09", "20")),
    (BED, "low: 0.15, high: 0.01", "parameters.n_b", ("`low`", "`high`", "low: 0.15, high: 0.01")),
    (BED, "low: -0.1, high: 0.15", "parameters.n_b", ("`friction.classes.bed.n`",)),
    (BED, "low: 0.01", "parameters.n_b", ("`high`",)),
    (BED, "low: 0.01, high: 0.15, sd: 1", "parameters.n_b", ("`sd`",)),
    ("low: 0.01, high: 100", "low: 0, high: 100", "parameters.phi", ("`low`", "loguniform")),
    ("n: n_b", "n: 0.03", "parameters.n_b", ()),
    ("n: n_b", "n: n_bed", "friction.classes.bed.n", ("`n_bed`", "`n_b`")),
    ("[1.0, 0.5]", "[1e-5, 1e-3]", "grid", ("1,000,000",)),
    ("[1.0, 0.5]", "[1e-308, 1e-308]", "grid", ("1,000,000", "inf")),
    ("x: [0, 40]", "x: [-1e308, 1e308]", "grid", ("1,000,000", "inf")),
    ("[1.0, 0.5]", "[1.0, 0.3]", "grid", (" y ", "26.6667")),
    ("[1.0, 0.5]", "[1.0, 0]", "grid.cell[1]", ("got 0",)),
    ("[1.0, 0.5]", "[1.0]", "grid.cell[1]", ()),
    ("x: [0, 40]", "x: [40, 0]", "grid.x", ("[m]",)),
    ("name: small", "name: small\nsimulate: {members: 1073741824}", "simulate.members", ("1048576", "1073741824")),
    ("name: small", "name: small\nsimulate: {members: 0}", "simulate.members", ("got 0",)),
    ("name: small", "name: small\nsimulate: {members: 1.5}", "simulate.members", ("got 1.5",)),
    ("name: small", "name: small\nsimulate: {seed: 99999999999999999999999}", "simulate.seed", ("9223372036",)),
    ("name: small", "name: small\nsimulate: {membrs: }", "simulate.membrs", ("`members`",)),
    ("bottom_width", "botom_width", "bed[0].trapezoid.botom_width", ("`bottom_width`",)),
    ("bank_slope: 0.6667", "bank_slope: true", "bed[0].trapezoid.bank_slope", ("[-]", "true")),
    ("bank_slope: 0.6667", "bank_slope: '0.6'", "bed[0].trapezoid.bank_slope", ("'0.6'", "quotes")),
    ("bank_slope: 0.6667", "bank_slope: '0,6'", "bed[0].trapezoid.bank_slope", ("'0,6'", "point")),
    ("bank_slope: 0.6667", "bank_slope: 0.6667 m/m", "bed[0].trapezoid.bank_slope", ("'0.6667 m/m'", "SI")),
    ("name: small", "name: Größe {1}", "name", ("'Größe {1}'", "grosse-1")),
    ("name: small", "name: Small Case", "name", ("'Small Case'",)),
    ("name: small\n", "", "name", ()),
    ("name: small", "name: small\ntitle: 5", "title", ("got 5", "quotes")),
    ("level: 0.9", "plants: true", "experiments.low.level", ()),
    ("level: 0.9", "level: 0.9, plnts: ", "experiments.low.plnts", ("`plants`",)),
    ("level: 0.9", "level: 0.9 m", "experiments.low.level", ("[m]", "0.9 m")),
    ("level: 0.9", "level: .nan", "experiments.low.level", ("`parameters`", "nan")),
    ("level: 0.9}", "level: 0.9, bed: [{points: no.csv}]}", "experiments.low.bed[0].points", ("no.csv",)),
    ("discharge: 2.66", "discharge: -1", "experiments.low.discharge.upstream", ("-1",)),
    ("discharge: 2.66", "discharge: {west: 1}", "experiments.low.discharge", ("`west`", "upstream")),
    ("discharge: 2.66", "discharge: {}", "experiments.low.discharge", ("`upstream`",)),
    ("steeper_than: 0.2", "slope: 0.2", "friction.zones[0].slope", ("class",)),
    ("steeper_than: 0.2", "steeper_than: 0.2, x: [0, 3]", "friction.zones[0]", ("`steeper_than`",)),
    ("class: bank", "class: bnak", "friction.zones[0]", ("`bnak`", "`bank`")),
    ("law: manning", "law: maning", "friction.classes.bed.law", ()),
    ("k_s: 1.0", "n: 1.0", "friction.classes.bank", ("`k_s`", "keulegan")),
    ("k_s: 1.0", "k_s: 1.0, n: 0.1", "friction.classes.bank", ("`n`", "keulegan")),
    ("k_s: 1.0", "k_s: 0", "friction.classes.bank.k_s", ("got 0",)),
    ("default: bed", "default: bed\n  walls: {law: manning}", "friction.walls", ("`n`", "manning")),
    ("default: bed", "default: bed\n  walls: {law: manning, n: 0}", "friction.walls.n", ("got 0",)),
    ("default: bed", "default: bed\n  walls: {law: manning, n: n_w}", "friction.walls.n", ("`n_w`", "`n_b`")),
    ("default: bed", "default: sand", "friction.default", ("`sand`",)),
    ("stand: reed", "stand: willow", "plants.patches[0].stand", ("`willow`",)),
    ("stand: reed", "stand: true", "plants.patches[0].stand", ("true", "quotes")),
    (PATCH, "", "plants.patches[0]", ("`x`", "`y`", "`polygon`")),
    (PATCH, "polygon: [[10, 0], [20, 0]], ", "plants.patches[0].polygon", ("expected 3 entries or more",)),
    ("{side: west}", "{side: east}", "inflows.upstream.side", ()),
    ("{side: west}", "{side: west, range: [-9, 4]}", "inflows.upstream.range", ("-4 to 4 m", "-9 to 4 m")),
    ("name: small", "name: small\noutlet: {range: [0, 5]}", "outlet.range", ("-4 to 4 m", "0 to 5 m")),
    ("name: small", "name: small\ninfer: {behavioural: 0.3}", "infer.behavioural", ()),
    ("name: small", "name: small\nexclude: {gale: indoors}", "exclude.gale", ("`gale`",)),
    ("name: small", "name: small\nexclude: {wind: ''}", "exclude.wind", ()),
    ("name: small", "name: small\nexclude: {wind: indoors}\neffects: {wind: {values: {speed: 1}}}", "exclude.wind",
     ("`effects`",)),
    ("name: small", "name: small\nsurvey: {file: no.csv}", "survey.file", ("no.csv",)),
    ("name: small", "name: small\nname: smaller", "name", ("line",)),
    ("name: small", "nmae: small", "nmae", ("`name`",)),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "key", "words"), REFUSED)
def test_what_is_wrong_is_refused_with_its_key(old, new, key, words):
    """In one sentence. A misspelt key is named before what it leaves missing."""
    said = sentence(changed(old, new))
    assert f"`{key}`" in said
    assert all(word in said for word in words)
    assert said.startswith("small.yaml")
    assert said.endswith((".", "?"))
    assert "\n" not in said


@pytest.mark.parametrize(
    ("flow", "observation", "key", "word"),
    [
        ("discharge: 2, level: nosuch", "", "experiments.high.level", "`nosuch`"),
        ("discharge: -2, level: 1", "", "experiments.high.discharge.upstream", "-2"),
        ("discharge: {west: 2}, level: 1", "", "experiments.high.discharge", "`west`"),
        ("discharge: 2, level: 1, plants: [p9]", "", "experiments.high.plants", "`p9`"),
        ("discharge: 2, level: 1, stands: {rush: {phi: 1}}", "", "experiments.high.stands", "`rush`"),
        ("discharge: 2, level: 1, stands: {reed: {phi: 0}}", "", "experiments.high.stands.reed.phi", "0"),
        ("discharge: 2, level: 1", ", experiment: low", "observations[0].experiment", "`low`"),
    ],
)
def test_what_is_wrong_in_the_validation_is_refused_too(flow: str, observation: str, key: str, word: str) -> None:
    """It passed `check` and ended `compare` in a KeyError."""
    write("x,y,level\n10,0,1\n", "unseen.csv")
    seen = f"observations: [{{kind: level, file: unseen.csv{observation}}}]"
    said = sentence(changed("name: small", f"name: small\nvalidation: {{experiments: {{high: {{{flow}}}}}, {seen}}}"))
    assert f"`validation.{key}`" in said
    assert word in said


def test_a_parameter_of_the_validation_alone_is_used() -> None:
    write("x,y,level\n10,0,1\n", "unseen.csv")
    unseen = "{experiments: {high: {discharge: 2, level: h}}, observations: [{kind: level, file: unseen.csv}]}"
    text = SMALL.replace("name: small", f"name: small\nvalidation: {unseen}")
    assert "h" in load_case(write(f"{text}  h: {{distribution: uniform, low: 0.9, high: 1.1, unit: m}}\n")).parameters


def test_numbers_of_yaml_1_2_are_numbers():
    case = load_case(changed("name: small", "name: small\nnumerics: {tolerance: 1e-7, film_depth: 2E-3}"))
    assert (case.numerics.tolerance, case.numerics.film_depth) == (1e-7, 2e-3)


@pytest.mark.parametrize(
    ("text", "words"),
    [("- a\n- b\n", "a list"), ("", "an empty file"), ("7", "value"), ("a:\n\tb: 1\n", "line 2, column 1"),
     ("a: [1", "line 1"), ("a: \x00", "line 1")],
)  # fmt: skip
def test_what_is_no_mapping_is_refused(text, words):
    assert words in sentence(write(text))


def test_a_folder_of_measurements_has_to_be_imported():
    Path("brook").mkdir()
    assert "vegglue import" not in sentence(Path("brook"))
    site = write("channel: {length_m: 30}\nexperiments: {low: {discharge_m3_s: 1}}\n", "brook/site.yaml")
    assert "`vegglue import brook`" in sentence(Path("brook"))
    assert "`vegglue import brook`" in sentence(site)


def test_missing_and_unreadable_files_are_named():
    assert sentence(Path("none.yaml")).startswith("none.yaml")
    parent = sentence(write("extends: base.yaml\n"))
    assert "base.yaml" in parent
    assert "small.yaml" in parent
    Path("latin.yaml").write_bytes("title: Gew\u00e4sser".encode("latin-1"))
    assert "UTF-8" in sentence(Path("latin.yaml"))


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
    assert "`experiments.low.discharge`" in sentence(write(text))
    both = load_case(write(text.replace("discharge: 2.66", "discharge: {upstream: 2, side: 0.5}")))
    assert both.experiments["low"].discharge == {"upstream": 2.0, "side": 0.5}


def test_a_word_that_begins_like_a_number_is_a_word(tmp_path):
    path = tmp_path / "words.yaml"
    path.write_text("sum: 9e6da5\nsmall: 1e-7\n", encoding="utf-8")
    assert read_tree(path) == {"sum": "9e6da5", "small": 1e-7}


def test_few_of_many_known_words_are_listed():
    said = nearest("x", [f"word{number}" for number in range(100)])
    assert "word29" in said
    assert "word30" not in said
    assert "70" in said


def test_an_unknown_effect_is_not_answered_with_hundreds_of_names():
    known = [*library()]
    assert "`streamlining`" in nearest_effect("streamlinin", known)
    assert len(nearest_effect("gravel_bar", known)) < 60


ENGINE = 'engine: {command: "{python} {model} --speed 2", files: {model: model.py}}'


def with_engine(folder: Path, engine: str = ENGINE, *changes: tuple[str, str]) -> Case:
    """The brook of the docs with an engine, read with --trust."""
    if not (folder / "model.py").exists():
        (folder / "model.py").write_text("print(1)\n", encoding="utf-8")
    return load_case(write_reach(folder, ("name: brook", f"name: brook\n{engine}"), *changes), trust=True)


def test_files_of_an_engine_are_named_from_the_config(tmp_path: Path) -> None:
    engine = with_engine(tmp_path).engine
    assert engine is not None
    assert engine.words("py") == ("py", str(tmp_path / "model.py"), "--speed", "2")


def test_a_child_in_another_folder_keeps_the_files_of_its_parent(tmp_path: Path) -> None:
    with_engine(tmp_path)
    (tmp_path / "below").mkdir()
    child = tmp_path / "below" / "child.yaml"
    child.write_text("extends: ../brook.yaml\nname: child\n", encoding="utf-8")
    case = load_case(child, trust=True)
    assert case.engine is not None
    assert case.engine.files == {"model": tmp_path / "model.py"}
    with pytest.raises(InputError, match=r"`engine` .*--trust"):
        load_case(child)


def test_a_resolved_config_has_the_same_engine(tmp_path: Path) -> None:
    case = with_engine(tmp_path)
    (tmp_path / "resolved.yaml").write_text(resolved_yaml(case), encoding="utf-8")
    again = load_case(tmp_path / "resolved.yaml", trust=True)
    assert again.engine == case.engine
    assert case_hash(again) == case_hash(case)


def test_the_hash_of_an_ensemble_covers_the_command_and_its_files(tmp_path: Path) -> None:
    own = simulation_hash(with_engine(tmp_path))
    assert own != simulation_hash(with_engine(tmp_path, ENGINE.replace("speed 2", "speed 3")))
    assert own == simulation_hash(with_engine(tmp_path, ENGINE.replace("{command", "{keep: all, step: 0.2, command")))
    (tmp_path / "model.py").write_text("print(2)\n", encoding="utf-8")
    assert own != simulation_hash(with_engine(tmp_path))


def test_a_folder_has_one_digest_until_a_file_in_it_changes(tmp_path: Path) -> None:
    template = tmp_path / "template"
    (template / "deep").mkdir(parents=True)
    (template / "deep" / "grid.txt").write_text("1", encoding="utf-8")
    before = digest_of(template)
    (template / "deep" / "__pycache__").mkdir()
    (template / "deep" / "__pycache__" / "model.cpython-312.pyc").write_bytes(b"left by the first run")
    assert digest_of(template) == before
    (template / "deep" / "grid.txt").rename(template / "grid.txt")
    assert digest_of(template) != before
    assert with_engine(tmp_path, ENGINE.replace("model.py", "template"))


def test_a_command_may_have_parameters_that_the_built_in_solver_lacks(tmp_path: Path) -> None:
    unknown = ("parameters:  ", "parameters:\n  salt: {distribution: uniform, low: 0, high: 1, unit: '-'}\n  #")
    assert "salt" in with_engine(tmp_path, ENGINE, unknown).parameters
    with pytest.raises(InputError, match=r"`parameters\.salt`"):
        load_case(write_reach(tmp_path, unknown))


@pytest.mark.parametrize(
    ("engine", "words"),
    [
        ("{command: ''}", ("`engine`", "`command`")),
        ("{command: 'run \"it'}", ("`engine`", "`command`", "quot")),
        ("{command: 'run it | tee log'}", ("`engine`", "'|'", "`files`")),
        ("{command: 'run {modl}', files: {model: model.py}}", ("`engine`", "{modl}", "model, python")),
        ("{command: 'run', files: {python: model.py}}", ("`engine`", "`python`")),
        ("{command: 'run', files: {model: no.py}}", ("`engine.files.model`", "no.py")),
        ("{command: 'run', timeout: 0}", ("`engine.timeout`",)),
        ("{command: 'run', step: 2}", ("`engine.step`",)),
        ("{command: 'run', keep: none}", ("`engine.keep`",)),
        ("{program: 'run'}", ("`engine.program`",)),
    ],
)
def test_a_wrong_engine_is_refused_with_its_key(tmp_path: Path, engine: str, words: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as refused:
        with_engine(tmp_path, f"engine: {engine}")
    assert all(word in str(refused.value) for word in words)
    assert "\n" not in str(refused.value)


def test_no_fields_are_kept_of_a_command(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"`simulate\.fields`"):
        with_engine(tmp_path, ENGINE, ("members: 1024", "members: 8, fields: {x: [0, 10]}"))


def test_a_child_may_have_the_built_in_engine_again(tmp_path: Path) -> None:
    """To be compared with its parent; nothing of it is code."""
    with_engine(tmp_path)
    (tmp_path / "child.yaml").write_text("extends: brook.yaml\nname: child\nengine: null\n", encoding="utf-8")
    assert load_case(tmp_path / "child.yaml").engine is None
