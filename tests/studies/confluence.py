"""The published confluence set through the whole loop, from a plane and from the surveyed bed: docs/measured.md.

`make confluence DATA=folder`, the folder as R.B. Canelas published it. Nothing of it is kept but errors of the models.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vegglue.calibration.candidates import candidates_in_case
from vegglue.case.config import load_case
from vegglue.case.resolved_config import as_yaml
from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import excluded_by, held_out_rmse, model_score
from vegglue.engine.interface import Model, linearise
from vegglue.importers.confluence import case_from_confluence, flat_bed, holds_confluence
from vegglue.workflow.case_run import CaseRun, calibrated
from vegglue.workflow.diagnose import diagnose
from vegglue.workflow.extend import extend_stepwise

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "measured.md"
BEGIN, END = "<!-- numbers by make confluence -->", "<!-- end of numbers -->"


@dataclass(frozen=True)
class Row:
    """One model: its title, RMSE along [m/s] in and out of sample, other numbers by their column, and the kind of the
    verdict of its diagnosis, or -.
    """

    title: str
    numbers: dict[str, float]
    verdict: str = "-"


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def error(model: Model, prediction: np.ndarray, kind: str) -> float:
    """Root mean square error of all readings of a kind."""
    chosen = (model.station["kind"] == kind).to_numpy()
    return rms((model.station["value"].to_numpy(float) - prediction)[chosen])


def row_of(title: str, case: Case, runs: Path) -> Row:
    run = CaseRun(case, runs)
    base, unseen = calibrated(run, excluded_by()), run.validation_model
    assert unseen is not None
    there = linearise(unseen, base.fitted.point.z)
    found = model_score(base)
    seen, along, across = base.fitted.point.prediction, "velocity", "velocity_across"
    return Row(
        title,
        {
            "u in": error(base.model, seen, along),
            "u out": np.nan if there is None else error(unseen, there.prediction, along),
            "v in": error(base.model, seen, across),
            "v out": np.nan if there is None else error(unseen, there.prediction, across),
            "levels in": found.in_sample.rmse["level"],
            "u, section left out": held_out_rmse(found),
            "chi2": found.in_sample.chi2,
        },
    )


def climb(path: Path, title: str, runs: Path, jobs: int, again: int = 1) -> list[Row]:
    """Rows of a case and of all that its diagnosis adds; if it found a place, the last model is diagnosed in turn."""
    case = load_case(path)
    found = diagnose(case, runs=runs, jobs=jobs, watch=print)
    grown = extend_stepwise(case, runs=runs, jobs=jobs, watch=print)
    titles = [", ".join([title, *_added(case, one)]) for one in grown.cases]
    rows = [row_of(name, one, runs) for name, one in zip(titles, grown.cases, strict=True)]
    rows[0] = replace(rows[0], verdict=found.verdict.kind)
    if not found.places or len(grown.cases) == 1 or again == 0:
        return rows
    return rows[:-1] + climb(grown.cases[-1].source, titles[-1], runs, jobs, again - 1)


def _added(parent: Case, child: Case) -> list[str]:
    """Names of the effects that a child has and its parent has not."""
    return [one.name for key, one in candidates_in_case(child).items() if key not in parent.effects]


def page(rows: list[Row]) -> str:
    """The table of the page: one row for each model."""
    columns = list(rows[0].numbers)
    lines = [f"| model | verdict | {' | '.join(columns)} |", f"|---|---|{'---:|' * len(columns)}"]
    digits = {"levels in": ".4f", "chi2": ".0f"}
    for row in rows:
        numbers = " | ".join(format(row.numbers[name], digits.get(name, ".3f")) for name in columns)
        lines.append(f"| {row.title} | {row.verdict} | {numbers} |")
    return "\n".join(lines)


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("data", type=Path)
    ask.add_argument("--runs", type=Path, default=ROOT / "runs" / "confluence")
    ask.add_argument("--jobs", type=int, default=1)
    given = ask.parse_args()
    if not holds_confluence(given.data):
        ask.error(f"{given.data} has no depth_averaged.csv; give the folder of the set, DATA=folder")
    surveyed, plane = given.runs / "confluence.yaml", given.runs / "confluence-flat.yaml"
    tree = case_from_confluence(given.data, surveyed)
    surveyed.write_text(as_yaml(tree), encoding="utf-8")
    plane.write_text(as_yaml(flat_bed(given.data, surveyed)), encoding="utf-8")
    rows = climb(plane, "a plane", given.runs, given.jobs)
    rows += climb(surveyed, "the surveyed bed", given.runs, given.jobs)
    text = PAGE.read_text(encoding="utf-8")
    begin = text.index(BEGIN) + len(BEGIN)
    before, after = text[:begin], text[text.index(END, begin) :]
    PAGE.write_text(f"{before}\n\n{page(rows)}\n\n{after}", encoding="utf-8")
    print(f"Written to {PAGE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
