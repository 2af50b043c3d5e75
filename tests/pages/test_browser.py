"""The page in a browser: it fits any width, and its script reads values off sections by pointer and keyboard."""

from dataclasses import replace
from pathlib import Path

import pytest
from browser import found_in_page
from diagnoses import a_diagnosis
from report_runs import a_toy, told_of, written

from vegglue.pages.run import LoopResults
from vegglue.results.loop_results import ComparedModel, ModelComparison

pytestmark = pytest.mark.slow  # a browser is started

WIDE = "(page, document) => [document.scrollingElement.scrollWidth, page.innerWidth]"
POINTED = """(page, document) => {
  const figure = document.querySelector("figure[data-panel]"), output = figure.querySelector("output");
  const box = figure.querySelector(".drawing"), seen = box.querySelector("svg").getBoundingClientRect();
  const rest = output.textContent;
  const at = { clientX: seen.left + 0.95 * seen.width, clientY: seen.top + 50, bubbles: true };
  box.dispatchEvent(new page.PointerEvent("pointermove", at));
  const pointed = output.textContent;
  const shown = figure.querySelector(".cursor").getAttribute("visibility");
  box.dispatchEvent(new page.PointerEvent("pointerleave"));
  const left = output.textContent;
  box.dispatchEvent(new page.FocusEvent("focus"));
  const focused = output.textContent;
  const press = (key) => box.dispatchEvent(new page.KeyboardEvent("keydown", { key, cancelable: true }));
  press("ArrowLeft");
  const before = output.textContent;
  press("End");
  return { rest, pointed, shown, left, focused, before, end: output.textContent };
}"""
CHOSEN = """(page, document) => {
  const seen = () => [...document.querySelectorAll(".experiment")].map((one) => one.offsetHeight > 0);
  const line = (name) => page.getComputedStyle(document.querySelector(`path.${name}`)).display;
  const choose = (name, value) => {
    const input = document.querySelector(`input[name$=${name}][value="${value}"]`);
    input.checked = true;
    input.dispatchEvent(new page.Event("change"));
  };
  const first = seen();
  choose("experiment", 1);
  const second = seen();
  choose("view", "before");
  const before = [line("before"), line("after")];
  choose("view", "after");
  return { first, second, before, after: [line("before"), line("after")] };
}"""


# A child as `extend` names it: its command ran off the page, which got a scroll bar at 1,200 pixels.
CHILD = "toy+unlisted_inflow_x27_22_y2_04+flank_scour+panel_current"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page with everything on it: a diagnosis, a ladder, words that look like markup."""
    folder = tmp_path_factory.mktemp("page")
    table = a_diagnosis().predictions.station
    found = a_diagnosis(predictions={"station": table.assign(section=table["section"].replace("D3", "</script><b>D3"))})
    steps = [ComparedModel(name, f"{name}.yaml", name, (), 4, *[0.02] * 4, 0.01) for name in ("toy", CHILD)]
    loop = LoopResults(
        ladder=ModelComparison((steps[0], replace(steps[1], added=("eddies",), unseen=0.005)), 0, "Added: eddies.")
    )
    toy = a_toy(folder)
    toy = replace(toy, case=toy.case.model_copy(update={"title": "A brook, with unlisted_inflow[x27.22,y2.04]"}))
    written(replace(toy, diagnosis=told_of(toy, found), loop=loop))
    return folder / "report.html"


@pytest.mark.parametrize("width", [400, 1200, 1600])
def test_nothing_runs_off_the_page(page: Path, width: int) -> None:
    needed, there = found_in_page(page, width, WIDE)
    assert there == width
    assert needed <= there


def test_the_pointer_and_the_keyboard_read_values(page: Path) -> None:
    said = found_in_page(page, 1200, POINTED)
    assert said["pointed"].startswith("y = 6 m: measured ")
    assert ", before " in said["pointed"]
    assert ", with it " in said["pointed"]
    assert said["pointed"].endswith(" m/s")
    assert said["shown"] == "visible"
    assert said["left"] == said["rest"]
    assert said["rest"]
    assert said["before"].startswith("y = 4 m: measured ")
    assert said["focused"] == said["end"] == said["pointed"]


def test_experiments_and_models_are_switched(page: Path) -> None:
    said = found_in_page(page, 1200, CHOSEN)
    assert said["first"] == [True, False]
    assert said["second"] == [False, True]
    assert said["before"] == ["inline", "none"]
    assert said["after"] == ["none", "inline"]


def test_paper_gets_what_is_folded_and_every_experiment(page: Path) -> None:
    script = """(page, document) => {
      const open = () => [...document.querySelectorAll("details")].map((one) => one.open);
      const rest = open();
      page.dispatchEvent(new page.Event("beforeprint"));
      const printed = open();
      page.dispatchEvent(new page.Event("afterprint"));
      const rules = [...document.styleSheets[0].cssRules].filter((one) => one.conditionText === "print");
      const told = rules.flatMap((one) => [...one.cssRules].map((rule) => rule.cssText)).join(" ");
      return { rest, printed, after: open(), told };
    }"""
    said = found_in_page(page, 1200, script)
    assert said["rest"]
    assert not any(said["rest"])
    assert all(said["printed"])
    assert said["after"] == said["rest"]
    assert ".controls { display: none; }" in said["told"]


def test_without_the_script_every_experiment_stands_in_the_page(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    silent = page.with_name("silent.html")
    start = text.rindex("<script>")
    silent.write_text(text[:start] + text[text.index("</script>", start) + len("</script>") :], encoding="utf-8")
    seen = "(page, document) => [...document.querySelectorAll('.experiment')].map((one) => one.offsetHeight > 0)"
    assert found_in_page(silent, 1200, seen) == [True, True]
