"""The report: one self-contained page that says what the posterior says, on the synthetic record and on a toy case."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from diagnoses import NOTHING, a_diagnosis
from posteriors import changed

from vegglue.case.config import load_case
from vegglue.case.prior import sample_prior
from vegglue.case.schema import Case
from vegglue.errors import StorageError
from vegglue.flow.sensor import FlowFields
from vegglue.inference.glue import glue
from vegglue.measurements.observations import Observations, read_observations
from vegglue.measurements.plant_survey import read_survey, rigid_cylinder
from vegglue.report_page.findings import findings
from vegglue.report_page.key_numbers import key_numbers, verdict_of
from vegglue.report_page.page import write_report
from vegglue.report_page.run import Run, is_synthetic, station_zones
from vegglue.report_page.tables import parameter_rows
from vegglue.results.ensemble import Ensemble
from vegglue.site.gridded_site import Site, build_site
from vegglue.solver.status import FAILED, SOLVED_BY_MARCHING

pytestmark = pytest.mark.slow  # whole pages
CONFIGS = Path(__file__).parents[2] / "configs"
MEMBERS = 2048
VOID = {"meta", "link", "br", "hr", "img", "input"}


def an_ensemble(case: Case, table: pd.DataFrame, truth: dict[str, float], failed: int = 3) -> Ensemble:
    """Members that predict the measured values, off by a pattern of their own for each parameter away from truth."""
    parameters = sample_prior(case.parameters, MEMBERS, seed=3)
    value = table["value"].where(table["used"].astype(bool), 0.4).to_numpy(float)
    prediction = np.tile(value + 0.01 * np.cos(7.0 * np.arange(len(value))), (MEMBERS, 1))
    for number, (name, values) in enumerate(parameters.items()):
        pattern = np.sin((number + 1) * (np.arange(len(value)) + 1.0))
        prediction += 0.3 * np.outer(np.log10(values / truth[name]), pattern)
    status = np.zeros(MEMBERS, np.int8)
    status[:failed], status[failed] = FAILED, SOLVED_BY_MARCHING
    prediction[status == FAILED] = np.nan
    mass_error = np.where(status == FAILED, np.nan, 2e-6)
    experiments = tuple(case.experiments)
    sections = tuple((str(name), float(x)) for name, x in table.groupby("section")["x"].mean().items())
    return Ensemble(
        parameters=parameters, prediction=prediction, status=status, station=table, sections=sections,
        reason=np.where(status == FAILED, "the water ran <off> the grid", "").astype(object), mass_error=mass_error,
        iterations=np.full(MEMBERS, 9, np.int32), seconds=np.full(MEMBERS, 0.25), experiments=experiments,
        section_flow=np.tile(mass_error[:, None, None] + 2.66, (1, len(experiments), len(sections))),
        config="name: toy\n", config_hash="0123456789abcdef", seed=1, version="0.1.0",
    )  # fmt: skip


def a_flow(site: Site) -> FlowFields:
    """Water 1.2 m deep on the lowest bed of each column, moving at 0.5 m/s."""
    level = site.bed.min(axis=1, keepdims=True) + 1.2 + 0 * site.bed
    depth = np.where(level > site.bed, level - site.bed, np.nan)
    return FlowFields(site.grid.x, site.grid.y, site.bed, depth, level + 0 * depth, 0.5 + 0 * depth, 0 * depth)


def a_run(folder: Path, case: Case, observations: Observations, truth: dict[str, float]) -> Run:
    site = build_site(case)
    ensemble = an_ensemble(case, observations.table, truth)
    posterior = glue(ensemble, case, observations)
    cylinder = rigid_cylinder(read_survey(case.survey.file), case.survey) if case.survey else None
    flow = {experiment: a_flow(site) for experiment in case.experiments}
    return Run(folder, case, site, observations, ensemble, posterior, flow, cylinder, None)


def written(run: Run) -> str:
    path = write_report(
        run.folder, run.case, run.observations, run.ensemble, run.posterior, run.flow, run.cylinder, run.diagnosis
    )
    assert path == run.folder / "report.html"
    return path.read_text(encoding="utf-8")


def kict(folder: Path, name: str) -> Run:
    case = load_case(CONFIGS / f"{name}.yaml")
    assert case.reference is not None
    return a_run(folder, case, read_observations(case), dict(case.reference.made_with))


def a_toy(folder: Path, **keys: object) -> Run:
    """Two experiments, one without plants; velocities and gauges, no ADV, no survey, no values of others."""
    tree = {
        "source": Path("toy.yaml"), "name": "toy", "title": "A field <campaign>",
        "grid": {"x": [0, 40], "y": [0, 10], "cell": [1, 0.5]},
        "bed": [{"trapezoid": {"axis": 5, "bottom_width": 3, "bank_slope": 0.5, "bed_slope": 0.001, "level": 0}}],
        "friction": {
            "classes": {"bed": {"law": "manning", "n": "n_b"}, "bank": {"law": "manning", "n": 0.1}},
            "default": "bed", "zones": [{"class": "bank", "beyond_slope_break": 0.2}],
        },
        "plants": {
            "stands": {"reed": {"phi": "phi", "canopy_height": "h_d"}},
            "patches": [{"name": "p1", "stand": "reed", "polygon": [[10, 4], [14, 4], [14, 5.5], [10, 5.5]]}],
        },
        "inflows": {"upstream": {"side": "west"}},
        "experiments": {
            "with": {"discharge": {"upstream": "q"}, "level": 1.0},
            "without": {"discharge": {"upstream": 2.0}, "level": 1.0, "plants": False},
        },
        "parameters": {
            "n_b": {"distribution": "lognormal", "median": 0.03, "log_sd": 0.4, "unit": "s m^(-1/3)", "symbol": "n_b"},
            "phi": {"distribution": "loguniform", "low": 0.01, "high": 100, "unit": "-", "symbol": "φ"},
            "h_d": {"distribution": "uniform", "low": 0.2, "high": 1.0, "unit": "m", "symbol": "h_d"},
            "q": {"distribution": "normal", "mean": 2.0, "sd": 0.1, "unit": "m3/s", "symbol": "Q"},
        },
    }  # fmt: skip
    y = np.arange(3.0, 7.5, 0.5)
    velocity = pd.DataFrame({"kind": "velocity", "section": "S/1", "x": 12.0, "y": y, "value": 0.5 - 0.02 * y})
    level = pd.DataFrame({"kind": "level", "section": "", "x": [5.0, 35.0], "y": 5.0, "value": [1.05, 1.01]})
    parts = [part.assign(experiment=name) for name in ("with", "without") for part in (velocity, level)]
    table = pd.concat(parts, ignore_index=True)
    table = table.assign(standard_error=np.nan, used=True, reason="", depth=np.nan, device="")
    table.loc[0, ["value", "used", "reason"]] = [np.nan, False, "<script>alert('weeds')</script>"]
    nothing = pd.DataFrame(columns=table.columns)
    observations = Observations(table, nothing, nothing, {}, {}, {})
    return a_run(
        folder, Case.model_validate(tree | keys), observations, {"n_b": 0.03, "phi": 1.0, "h_d": 0.5, "q": 2.0}
    )


class Page(HTMLParser):
    """What a browser would meet: ids, links, resources, alternative texts, and whether all tags close."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.links: list[str] = []
        self.tags: list[str] = []
        self.unlabelled = 0
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.tags.append(tag)
        self.ids += [given["id"] or ""] if "id" in given else []
        self.links += [given[key] or "" for key in ("href", "src", "xlink:href") if key in given]
        self.unlabelled += tag == "svg" and not given.get("aria-label")
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def d3a(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, str]:
    run = kict(tmp_path_factory.mktemp("d3a"), "d3a")
    return run, written(run)


@pytest.fixture(scope="module")
def toy(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, str]:
    run = a_toy(tmp_path_factory.mktemp("toy"))
    return run, written(run)


def test_the_page_is_whole_and_asks_nothing_of_a_network(d3a: tuple[Run, str], toy: tuple[Run, str]) -> None:
    for run, text in (d3a, toy):
        page = Page(text)
        assert page.open == []
        assert len(page.ids) == len(set(page.ids))
        assert not {"script", "link", "img", "iframe"} & set(page.tags)
        for link in page.links:
            anchor = link.startswith("#") and link[1:] in page.ids
            assert anchor or link.startswith("data:image/png;base64,") or (run.folder / link).is_file(), link[:80]
        assert not re.search(r"url\((?!#)|@import", text)
        assert len(text.encode()) < 5e6


def test_every_figure_is_labelled_captioned_and_on_file_twice(d3a: tuple[Run, str]) -> None:
    run, text = d3a
    page = Page(text)
    figures = page.tags.count("figure")
    assert page.unlabelled == 0
    assert page.tags.count("svg") == page.tags.count("figcaption") == figures
    assert (
        len(list((run.folder / "figures").glob("*.svg")))
        == len(list((run.folder / "figures").glob("*.png")))
        == figures
    )
    expected = {"section-D3a-D3", "posterior-phi", "joint-n_b-k_s", "plant-drag", "reach-D3a", "channel-D3a"}
    expected |= {
        "verticals-D3a-D3",
        "canopy-D3a-D3",
        "residuals-velocity",
        "quantiles-velocity",
        "weights",
        "mass-error",
    }
    assert expected <= set(page.ids)


def test_every_section_of_the_contents_exists(d3a: tuple[Run, str]) -> None:
    contents = re.search(r"<nav.*?</nav>", d3a[1], re.DOTALL)
    assert contents is not None
    assert re.findall(r'href="#([a-z]+)"', contents[0]) == re.findall(r'<h2 id="([a-z]+)"', d3a[1])


def test_a_synthetic_record_is_called_so(d3a: tuple[Run, str], toy: tuple[Run, str]) -> None:
    assert "synthetic record" in d3a[1]
    assert "nobody measured it" in d3a[1]
    assert "synthetic" not in toy[1]
    case = d3a[0].case.model_copy(update={"title": ""})
    measured = tuple(one.model_copy(update={"synthetic": False}) for one in case.observations)
    assert is_synthetic(case.model_copy(update={"reference": None}))
    assert is_synthetic(case.model_copy(update={"observations": measured}))
    assert not is_synthetic(case.model_copy(update={"reference": None, "observations": measured}))


def test_a_title_makes_no_record_synthetic(toy: tuple[Run, str]) -> None:
    assert not is_synthetic(toy[0].case.model_copy(update={"title": "A channel of synthetic turf"}))


def test_values_of_others_are_named_by_their_source(d3a: tuple[Run, str], tmp_path: Path) -> None:
    assert "marked: Berends et al. (2020), made with." in d3a[1]
    assert "linear interpolation" in d3a[1]
    for source, name in (("", "reference"), ("A study of a river " + 9 * "long ", "A study of a river long")):
        reference = {"source": source, "table": {"n_b": [0.03, 0.01]}}
        assert f"marked: {name}." in written(a_toy(tmp_path / name, reference=reference))


def test_what_users_wrote_is_text_and_no_markup(toy: tuple[Run, str]) -> None:
    assert "<script>" not in toy[1]
    assert "&lt;script&gt;alert" in toy[1]
    assert "A field &lt;campaign&gt;" in toy[1]


def test_the_flagged_station_is_shown_with_its_reason(d3a: tuple[Run, str]) -> None:
    table = d3a[0].observations.table
    reason = table.loc[~table["used"], "reason"].iloc[0]
    assert f"y = 6.40 m: {reason}" in d3a[1]


def test_failed_members_are_counted_with_their_reasons(d3a: tuple[Run, str]) -> None:
    assert "3 × the water ran &lt;off&gt; the grid" in d3a[1]
    assert f"{MEMBERS - 4:,} members solved by Newton's method, 1 by marching in time, 3 failed" in d3a[1]


def test_table_compares_with_the_study_and_with_known_values(d3a: tuple[Run, str]) -> None:
    run, _ = d3a
    posterior = run.posterior
    row = parameter_rows(run)[0]
    off, sd = posterior.marginals.median["n_b"] - 0.098, posterior.marginals.sd["n_b"]
    assert row.reference.study.replace("\u00a0", " ") == "0.098 ± 0.008"
    assert row.reference.study_difference == f"{off / np.hypot(sd, 0.008):.1f} sd".replace("-", "−").replace(
        "−0.0", "0.0"
    )
    assert row.reference.made_with_difference.startswith(f"{off / sd:.1f} sd".replace("-", "−").replace("−0.0", "0.0"))
    power = parameter_rows(run)[2]
    off = posterior.marginals.log10_median["phi"] - np.log10(39.81)
    assert power.reference.study.replace("\u00a0", " ") == "10<sup>1.6 ± 0.2</sup>"
    assert power.reference.made_with_difference.startswith(
        f"{off / posterior.marginals.log10_sd['phi']:.1f} sd".replace("-", "−").replace("−0.0", "0.0")
    )


def test_a_corrected_phi_is_the_one_compared(tmp_path: Path) -> None:
    run = kict(tmp_path, "d3b_paper")
    rows = parameter_rows(run)
    assert [row.reference.study for row in rows[2:]] == ["–", "10<sup>0.19\u00a0±\u00a00.12</sup>"]
    assert run.posterior.canopy is not None
    assert rows[3].posterior.startswith(f"10<sup>{run.posterior.canopy.log10_median:.3f}".replace("-", "−"))
    assert any("For a canopy of 1.36 m instead of 0.8 m" in finding.text for finding in findings(run))


def test_zones_follow_the_plants_present(toy: tuple[Run, str]) -> None:
    run, _ = toy
    table = run.observations.table.assign(zone=station_zones(run))
    here = table[(table["x"] == 12.0) & (table["y"] == 4.5)].set_index("experiment")["zone"]
    assert dict(here) == {"with": "plants", "without": "bed"}
    assert set(table.loc[table["y"] == 3.0, "zone"]) == {"bank"}


def test_names_of_users_make_safe_file_names(toy: tuple[Run, str]) -> None:
    assert (toy[0].folder / "figures" / "section-with-S-1.svg").is_file()


def test_an_unwritable_folder_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "run").write_text("not a folder")
    run = a_toy(tmp_path / "run")
    with pytest.raises(StorageError, match=r"report\.html: the report cannot be written"):
        written(run)


def test_a_run_without_flow_fields_has_a_page(tmp_path: Path) -> None:
    text = written(replace(a_toy(tmp_path), flow={}))
    assert 'id="flow"' not in text
    assert 'id="sections"' in text


def test_the_report_says_what_is_missing(tmp_path: Path) -> None:
    found = a_diagnosis(verdict={"sentence": "Missing: eddies <b>or so</b>."})
    run = replace(a_toy(tmp_path), diagnosis=found)
    page = Page(text := written(run))
    assert page.open == []
    assert page.unlabelled == 0
    assert len(page.ids) == len(set(page.ids))
    assert "Missing: eddies &lt;b&gt;or so&lt;/b&gt;." in text
    assert found.verdict.remarks[0] in text
    assert all(f"<b>{one.name}</b>" in text for one in found.suspects)
    assert "Stations set aside" in text
    drawn = {path.stem for path in (tmp_path / "figures").glob("missing-*.svg")}
    assert drawn == {
        "missing-suspects", "missing-profiles-1", "missing-places", "missing-zones", "missing-alike", "missing-gauges"
    }  # fmt: skip
    assert drawn <= set(page.ids)


def test_an_empty_diagnosis_is_a_sentence_and_no_figure_breaks(tmp_path: Path) -> None:
    text = written(replace(a_toy(tmp_path), diagnosis=NOTHING))
    assert NOTHING.verdict.sentence in text
    assert "Stations set aside" not in text
    assert 'id="missing-suspects"' not in text


def test_without_a_diagnosis_the_report_says_how_to_get_one(toy: tuple[Run, str]) -> None:
    assert "<code>vegglue diagnose CONFIG</code> would tell" in toy[1]
    assert 'id="missing-' not in toy[1]


def said(run: Run, subject: str, **changes: object) -> tuple[str, bool]:
    other = replace(run, posterior=changed(run.posterior, **changes))
    found = [finding for finding in findings(other) if finding.subject == subject]
    return " ".join(finding.text for finding in found).replace("\u202f", " "), any(finding.doubt for finding in found)


def test_says_what_is_not_identified(d3a: tuple[Run, str]) -> None:
    run, _ = d3a
    known = {"n_b": True, "k_s": True, "phi": False}
    text, doubt = said(run, "parameter", identified=known, width_ratio={"n_b": 0.1, "k_s": 0.1, "phi": 0.96})
    assert "is not identified: its 95 % range" in text
    assert "is still 96 % of the prior's (identified means below 50 %)" in text
    assert doubt
    sentence = re.sub(
        "<[^>]*>", "", verdict_of(run.case, changed(run.posterior, identified=known, effective_size=500.0))
    )
    assert sentence.startswith("nb and ks are identified by these 20 stations; φ is not.")


def test_tells_powers_of_ten_only_over_decades(toy: tuple[Run, str]) -> None:
    manning, drag = (row.posterior for row in parameter_rows(toy[0])[:2])
    assert float(manning.split()[0]) == pytest.approx(toy[0].posterior.marginals.median["n_b"], rel=0.01)
    assert drag.startswith("10<sup>")


def test_says_at_which_bound_a_parameter_presses(d3a: tuple[Run, str]) -> None:
    run, _ = d3a
    hit = run.posterior.marginals.bound_hit | {"phi": np.array([False, True])}
    mass = run.posterior.marginals.bound_mass | {"phi": np.array([0.0, 0.14])}
    text, doubt = said(run, "parameter", bound_hit=hit, bound_mass=mass)
    assert "presses against the upper bound of its prior, 100: 0.14 of the posterior lies within 2 %" in text
    assert "The data bound it from below only" in text
    assert doubt


@pytest.mark.parametrize(("size", "provisional"), [(30.0, True), (3000.0, False)])
def test_says_when_few_members_carry_the_weight(d3a: tuple[Run, str], size: float, provisional: bool) -> None:
    run, _ = d3a
    text, doubt = said(run, "weights", effective_size=size, pareto_k=0.2)
    assert ("no posterior is claimed" in text) == doubt == provisional
    posterior = changed(run.posterior, effective_size=size)
    sentence = verdict_of(run.case, posterior)
    assert sentence.startswith("A first look only") == provisional
    assert ("too few to say what is identified" in sentence) == provisional
    assert key_numbers(run.case, posterior)[0].remark.startswith("too few members to tell") == provisional
    assert parameter_rows(replace(run, posterior=posterior))[0].identified.startswith("too few members") == provisional


@pytest.mark.parametrize(("error", "hides"), [(0.001, True), (0.5, False)])
def test_says_whether_the_residual_exceeds_the_measurement_error(
    d3a: tuple[Run, str], error: float, hides: bool
) -> None:
    run, _ = d3a
    station = run.posterior.station.assign(standard_error=error)
    text, doubt = said(run, "residual", station=station)
    assert ("something the model does not have hides in the residual" in text) == doubt == hides
    assert f"measurement error of {error:g} m/s" in text.replace("0.0010", "0.001").replace("0.50", "0.5")


def test_says_when_nothing_is_known_of_the_measurement_error(toy: tuple[Run, str]) -> None:
    text, doubt = said(toy[0], "residual")
    assert "without standard errors nothing can be said" in text
    assert not doubt


def test_says_when_water_is_lost(d3a: tuple[Run, str]) -> None:
    run, _ = d3a
    leaking = replace(run, ensemble=replace(run.ensemble, mass_error=np.full(MEMBERS, 3e-3)))
    for each, doubt in ((run, False), (leaking, True)):
        mass = next(finding for finding in findings(each) if finding.subject == "mass")
        assert mass.doubt == doubt


def test_doubts_come_first(d3a: tuple[Run, str]) -> None:
    doubts = [finding.doubt for finding in findings(d3a[0])]
    assert doubts == sorted(doubts, reverse=True)


def test_compares_with_rigid_cylinders(d3a: tuple[Run, str]) -> None:
    run, _ = d3a
    assert run.cylinder is not None
    text, _ = said(run, "plants", identified=run.posterior.marginals.identified | {"phi": True})
    ratio = run.posterior.marginals.median["phi"] / run.cylinder.quantile(0.5)
    assert f"the flow asks for {ratio:.0f} times as much" in text
    text, _ = said(run, "plants", identified=run.posterior.marginals.identified | {"phi": False})
    assert "cannot tell whether that is so" in text
