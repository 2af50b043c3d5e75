"""The report: one self-contained page that says what the posterior says, on the synthetic record and on a toy case."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
from diagnoses import NOTHING, a_diagnosis, an_effect_found
from report_runs import MEMBERS, a_toy, kict, told_of, written

from vegglue.errors import StorageError
from vegglue.measurements.kinds import Unused
from vegglue.pages.findings import run_health
from vegglue.pages.parameters import parameter_rows
from vegglue.pages.run import Run, file_name, is_synthetic, station_zones
from vegglue.pages.sections import section_panels

pytestmark = pytest.mark.slow  # whole pages
VOID = {"meta", "link", "br", "hr", "img", "input"}


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


def test_the_page_is_whole_and_asks_nothing_of_a_network(d3a: tuple[Run, str], toy: tuple[Run, str]) -> None:
    for run, text in (d3a, toy):
        page = Page(text)
        assert page.open == []
        assert len(page.ids) == len(set(page.ids))
        assert not {"link", "img", "iframe"} & set(page.tags)
        for link in page.links:
            anchor = link.startswith("#") and link[1:] in page.ids
            assert anchor or link.startswith("data:image/png;base64,") or (run.folder / link).is_file(), link[:80]
        assert not re.search(r"url\((?!#)|@import", text)
        assert len(text.encode()) < 5e6


def test_every_figure_is_labelled_captioned_and_on_file(d3a: tuple[Run, str]) -> None:
    run, text = d3a
    page = Page(text)
    figures = page.tags.count("figure")
    assert page.unlabelled == 0
    assert page.tags.count("svg") == page.tags.count("figcaption") == figures
    assert len(list((run.folder / "figures").iterdir())) == figures
    expected = {"section-D3a-D3", "posterior-phi", "joint-n_b-k_s", "plant-drag", "reach-D3a", "channel-D3a"}
    expected |= {"verticals-D3a-D3", "canopy-D3a-D3", "residuals-velocity", "quantiles-velocity", "weights"}
    assert expected <= set(page.ids)


def test_every_section_of_the_contents_exists(d3a: tuple[Run, str]) -> None:
    contents = re.search(r"<nav.*?</nav>", d3a[1], re.DOTALL)
    assert contents is not None
    assert re.findall(r'href="#([a-z]+)"', contents[0]) == re.findall(r'<h2 id="([a-z]+)"', d3a[1])


def test_a_synthetic_record_is_called_so(d3a: tuple[Run, str], toy: tuple[Run, str]) -> None:
    assert "synthetic record" in d3a[1]
    assert "synthetic" not in toy[1]
    case = d3a[0].case.model_copy(update={"title": ""})
    measured = tuple(one.model_copy(update={"synthetic": False}) for one in case.observations)
    assert is_synthetic(case.model_copy(update={"reference": None}))
    assert is_synthetic(case.model_copy(update={"observations": measured}))
    assert not is_synthetic(case.model_copy(update={"reference": None, "observations": measured}))


def test_a_title_makes_no_record_synthetic(toy: tuple[Run, str]) -> None:
    assert not is_synthetic(toy[0].case.model_copy(update={"title": "A channel of synthetic turf"}))


def test_values_of_others_are_named_by_their_source(d3a: tuple[Run, str], tmp_path: Path) -> None:
    assert "Berends et al. (2020), made with." in d3a[1]
    for source, name in (("", "reference"), ("A study of a river " + 9 * "long ", "A study of a river long")):
        reference = {"source": source, "table": {"n_b": [0.03, 0.01]}}
        assert f": {name}." in written(a_toy(tmp_path / name, reference=reference))


def test_what_users_wrote_is_text_and_no_markup(toy: tuple[Run, str]) -> None:
    assert "<script>alert" not in toy[1]
    assert "&lt;script&gt;alert" in toy[1]
    assert "A field &lt;campaign&gt;" in toy[1]


def test_the_flagged_station_is_shown_with_its_reason(d3a: tuple[Run, str]) -> None:
    table = d3a[0].observations.table
    reason = table.loc[~table["used"], "reason"].iloc[0]
    assert f"y = 6.40 m: {reason}" in d3a[1]


def test_a_station_that_does_not_count_is_found_by_its_place(tmp_path: Path) -> None:
    toy = a_toy(tmp_path)
    table = toy.observations.table.copy()
    table.loc[9, ["used", "reason"]] = [False, Unused.EXCLUDED]  # a gauge of the first experiment
    text = written(replace(toy, observations=replace(toy.observations, table=table)))
    assert "<p>2 of 22 stations" in text
    assert "<li>with, x = 5.00 m, y = 5.00 m: the diagnosis excludes it.</li>" in text


def test_failed_members_are_counted_with_their_reasons(d3a: tuple[Run, str]) -> None:
    health = run_health(d3a[0])
    assert health.reasons == (("the water ran <off> the grid", 3),)
    assert [number for _, number, _ in health.counts] == [MEMBERS - 4, 1, 3]
    assert "the water ran &lt;off&gt; the grid" in d3a[1]


def test_a_corrected_phi_is_the_one_compared(tmp_path: Path) -> None:
    run = kict(tmp_path, "d3b_paper")
    own, corrected = parameter_rows(run)[2:]
    assert (own.study, corrected.study) == (None, (0.19, 0.12))
    canopy = run.posterior.canopy
    assert canopy is not None
    assert corrected.power == (canopy.log10_median, canopy.log10_sd)
    assert corrected.corrected == (canopy.from_height, canopy.to_height) == (0.8, 1.36)


def test_zones_follow_the_plants_present(toy: tuple[Run, str]) -> None:
    run, _ = toy
    table = run.observations.table.assign(zone=station_zones(run))
    here = table[(table["x"] == 12.0) & (table["y"] == 4.5)].set_index("experiment")["zone"]
    assert dict(here) == {"with": "plants", "without": "bed"}
    assert set(table.loc[table["y"] == 3.0, "zone"]) == {"bank"}


def test_names_of_users_make_safe_file_names(toy: tuple[Run, str]) -> None:
    assert (toy[0].folder / "figures" / "section-with-S-1.svg").is_file()


def test_names_that_differ_in_lost_letters_have_files_of_their_own() -> None:
    assert file_name("verticals-high flow-S 1") == "verticals-high-flow-S-1"
    assert len({file_name(words) for words in ("posterior-φ", "posterior-ψ", "posterior--")}) == 3
    long = [file_name(f"section-{'x' * 130}-{number}") for number in (1, 2)]
    assert long[0] != long[1]
    assert max(map(len, long)) <= 120


def test_panels_of_long_names_are_found_by_their_ids(tmp_path: Path) -> None:
    toy = a_toy(tmp_path)
    table = toy.observations.table
    moved = [f"{'long ' * 30}{number % 2}" if name else "" for number, name in enumerate(table["section"])]
    named = replace(toy, observations=replace(toy.observations, table=table.assign(section=moved)))
    panels = section_panels(named)
    ids = [one["id"] for one in json.loads(panels.data)]
    drawn = [picture.name for one in panels.experiments for picture in one.pictures]
    assert sorted(ids) == sorted(drawn), "a page whose script finds no figure for a panel reads no station"
    assert len(set(ids)) == len(ids)


def test_an_unwritable_folder_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "run").write_text("not a folder")
    run = a_toy(tmp_path / "run")
    with pytest.raises(StorageError, match=r"run/figures/.* cannot be written"):
        written(run)


def test_a_run_without_flow_fields_has_a_page(tmp_path: Path) -> None:
    text = written(replace(a_toy(tmp_path), flow={}))
    assert 'id="flow"' not in text
    assert 'id="sections"' in text


def test_the_report_has_a_whole_diagnosis(tmp_path: Path) -> None:
    found = a_diagnosis(verdict={"effects": (an_effect_found(title="Eddies <b>or so</b>"),)})
    toy = a_toy(tmp_path)
    page = Page(text := written(replace(toy, diagnosis=told_of(toy, found))))
    assert page.open == []
    assert page.unlabelled == 0
    assert len(page.ids) == len(set(page.ids))
    assert "ddies &lt;b&gt;or so&lt;/b&gt;" in text
    assert all(f"<b>{one.name}</b>" in text for one in found.candidate_effects)
    drawn = {path.stem for path in (tmp_path / "figures").glob("missing-*.svg")}
    assert drawn == {"missing-suspects", "missing-places", "missing-zones", "missing-alike", "missing-gauges"}
    assert drawn <= set(page.ids)


def test_an_empty_diagnosis_breaks_no_figure(tmp_path: Path) -> None:
    toy = a_toy(tmp_path)
    text = written(replace(toy, diagnosis=told_of(toy, NOTHING)))
    assert 'id="missing-suspects"' not in text


def test_without_a_diagnosis_the_report_names_the_command(toy: tuple[Run, str]) -> None:
    assert "<code>vegglue diagnose toy.yaml</code>" in toy[1]
    assert 'id="missing-' not in toy[1]
