"""One page of several runs: each ladder once, parameters of one prior side by side, nothing claimed of a first look."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from browser import found_in_page
from diagnoses import a_diagnosis
from posteriors import changed
from report_runs import a_toy, kict, told_of

from vegglue.pages.page import DrawnInterval, draw_interval_rows, render_overview, write_overview
from vegglue.pages.run import LoopResults, Run
from vegglue.results.loop_results import ComparedModel, ModelComparison

STEPS = tuple(ComparedModel(name, f"{name}.yaml", name, (), 4, *[0.02] * 4, 0.01) for name in ("toy", "toy-eddies"))
LADDER = ModelComparison((STEPS[0], replace(STEPS[1], added=("eddies",), unseen=0.005)), 0, "Added: eddies.")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Run]:
    """A toy that was taken round the loop, and two of the paper's cases."""
    folder = tmp_path_factory.mktemp("runs")
    toy = a_toy(folder / "toy")
    loop = LoopResults(ladder=LADDER, pages={"toy-eddies": "toy-eddies/report.html"})
    return [
        replace(toy, diagnosis=told_of(toy, a_diagnosis()), loop=loop),
        *(kict(folder / name, name) for name in ("d3a", "d3b")),
    ]


def test_answers_come_first_then_parameters_then_every_run(runs: list[Run], tmp_path: Path) -> None:
    page = render_overview(tmp_path, runs)
    answer, side_by_side, all_runs = (page.index(f'<h2 id="{place}"') for place in ("toy", "side-by-side", "runs"))
    assert answer < side_by_side < all_runs
    for run in runs:
        assert f'href="{run.case.name}/report.html"' in page[all_runs:]
    assert '<a href="toy-eddies/report.html">' in page, "seen from the folder of all runs"
    assert "A field &lt;campaign&gt;" in page


def test_each_ladder_is_drawn_once(runs: list[Run], tmp_path: Path) -> None:
    child = replace(runs[0], case=runs[0].case.model_copy(update={"name": "toy-eddies"}))
    page = render_overview(tmp_path, [runs[0], child])
    assert page.count("-ladder") == 1


def test_only_parameters_of_one_prior_stand_side_by_side(runs: list[Run], tmp_path: Path) -> None:
    render_overview(tmp_path, runs)
    drawn = {path.stem for path in (tmp_path / "figures").iterdir()}
    assert drawn == {f"parameter-{name}" for name in runs[1].posterior.parameters}
    words = (tmp_path / "figures" / "parameter-n_b.svg").read_text(encoding="utf-8")
    assert "Berends et al. (2020), Table 3 (d3a)" in words
    assert "toy" not in words, "its n_b has another prior"


def test_a_first_estimate_has_no_range(runs: list[Run], tmp_path: Path) -> None:
    claimed = [replace(run, posterior=changed(run.posterior, effective_size=900.0)) for run in runs[1:]]
    few = replace(claimed[0], posterior=changed(claimed[0].posterior, effective_size=2.0))
    bars = []
    for shown in (claimed, [few, claimed[1]]):
        render_overview(tmp_path, shown)
        text = (tmp_path / "figures" / "parameter-n_b.svg").read_text(encoding="utf-8")
        bars.append(text.count('stroke-width="3"'))
    assert bars[1] == bars[0] - 1


def test_intervals_share_one_axis_and_their_ends_lie_on_it() -> None:
    rows = {"ours": DrawnInterval(1.0, 10.0, 100.0), "theirs": DrawnInterval(30.0, 30.0, 30.0, others=True)}
    drawn = draw_interval_rows(rows, True, "k")
    assert drawn.count("<circle") == 1
    # 1 to 100 on a logarithmic axis: the dot lies in the middle of its bar.
    bar = next(part for part in drawn.split("<path") if 'stroke-width="3"' in part).split('d="M')[1].split('"')[0]
    start, _, end = bar.replace(",", " ").replace("H", " ").split()
    dot = float(drawn.split('cx="')[1].split('"')[0])
    assert dot == pytest.approx(0.5 * (float(start) + float(end)), abs=0.1)


@pytest.mark.slow  # a browser is started
@pytest.mark.parametrize("width", [400, 1200, 1600])
def test_nothing_of_it_runs_off_the_page(runs: list[Run], tmp_path: Path, width: int) -> None:
    page = write_overview(tmp_path / "overview.html", runs)
    seen = "(page, document) => [document.scrollingElement.scrollWidth, page.innerWidth]"
    needed, there = found_in_page(page, width, seen)
    assert needed <= there == width


@pytest.mark.slow  # a browser is started
@pytest.mark.parametrize("width", [360, 1200])
def test_three_clicks_lead_through_the_loop(runs: list[Run], tmp_path: Path, width: int) -> None:
    page = write_overview(tmp_path / "overview.html", runs)
    shown = """(page, document) => {
      const parts = [".step-before", ".answer .verdict", ".halves", "path.before", "path.after"];
      const seen = () => parts.map((one) => {
        const there = document.querySelector(`.tour ${one}`);
        return there.getClientRects().length > 0 && page.getComputedStyle(there).display !== "none";
      });
      const found = {};
      for (const step of ["all", "before", "missing", "after"]) {
        const label = document.querySelector(`.tour label[for$=tour-${step}]`);
        label.click();
        found[step] = [...seen(), label.getBoundingClientRect().height >= 40];
      }
      return found;
    }"""
    assert found_in_page(page, width, shown) == {
        "all": [False, True, True, True, True, True],
        "before": [True, False, False, True, False, True],
        "missing": [False, True, False, True, True, True],
        "after": [False, False, True, False, True, True],
    }


def test_a_page_needs_nothing_from_outside_its_folder(runs: list[Run], tmp_path: Path) -> None:
    """It is read from a stick or a telephone: links are relative, and nothing is loaded."""
    page = render_overview(tmp_path, runs)
    assert not re.findall(r'(?:src|href|action)="(?:[a-z]+:|/)(?!/doi)', page)
    assert not re.findall(r"@import|url\((?!#)", page)
