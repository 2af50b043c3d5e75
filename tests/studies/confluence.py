"""The published confluence set through the whole loop, from a plane and from the surveyed bed: docs/confluence.md.

`make confluence DATA=folder`, the folder as R.B. Canelas published it. Nothing of it is kept but errors of the models.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vegglue.calibration.candidates import candidates_in_case
from vegglue.case.config import load_case
from vegglue.case.resolved_config import as_yaml
from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import held_out_rmse, rung
from vegglue.diagnosis.excluded_stations import excluded_by
from vegglue.engine.interface import Model, linearise
from vegglue.importers.confluence import case_from_confluence, flat_bed, holds_confluence
from vegglue.workflow.diagnose import diagnose
from vegglue.workflow.extend import extend_stepwise
from vegglue.workflow.run_folder import calibrated, folder_of, validation_of

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "confluence.md"
BEGIN, END = "<!-- numbers by make confluence -->", "<!-- end of numbers -->"


@dataclass(frozen=True)
class Row:
    """One model: what it is called, errors by section [m/s] in and out of sample, of levels [m], and its numbers."""

    title: str
    seen: dict[str, float]
    unseen: dict[str, float]
    numbers: dict[str, float]
    values: dict[str, tuple[float, float, float]]


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def across(model: Model, prediction: np.ndarray) -> float:
    """Root mean square error of all velocities across [m/s]."""
    chosen = (model.station["kind"] == "velocity_across").to_numpy()
    return rms((model.station["value"].to_numpy(float) - prediction)[chosen])


def by_section(model: Model, prediction: np.ndarray) -> dict[str, float]:
    """Root mean square error of each section [m/s], and of all velocities along together."""
    velocity = (model.station["kind"] == "velocity").to_numpy()
    left = (model.station["value"].to_numpy(float) - prediction)[velocity]
    section = model.station["section"].to_numpy(str)[velocity]
    each = {str(name): rms(left[section == name]) for name in np.unique(section)}
    return each | {"all": rms(left)}


def row_of(title: str, case: Case, runs: Path) -> Row:
    base = calibrated(case, folder_of(runs, case), excluded_by())
    unseen = validation_of(case)
    assert unseen is not None
    there = linearise(unseen, base.fitted.point.z)
    found = rung(base)
    seen = found.in_sample
    return Row(
        title,
        by_section(base.model, base.fitted.point.prediction),
        {} if there is None else by_section(unseen, there.prediction),
        {
            "levels": seen.rmse["level"],
            "across": across(base.model, base.fitted.point.prediction),
            "across, unseen": np.nan if there is None else across(unseen, there.prediction),
            "left out": held_out_rmse(found),
            "chi2": seen.chi2,
            "stations": seen.stations,
        },
        found.values,
    )


def climb(path: Path, title: str, runs: Path, jobs: int, again: int = 1) -> tuple[list[Row], list[str]]:
    """Rows of a case and of all that its diagnosis adds, and what the diagnosis said; where it found a place, the last
    model is diagnosed in its turn.
    """
    case = load_case(path)
    found = diagnose(case, runs=runs, jobs=jobs, watch=print)
    grown = extend_stepwise(case, runs=runs, jobs=jobs, watch=print)
    titles = [", ".join([title, *_added(case, one)]) for one in grown.cases]
    rows = [row_of(name, one, runs) for name, one in zip(titles, grown.cases, strict=True)]
    said = [f"**{title}** ({found.verdict.kind}): {grown.sentence}", grown.reason]
    if not found.places or len(grown.cases) == 1 or again == 0:
        return rows, said
    more, words = climb(grown.cases[-1].source, titles[-1], runs, jobs, again - 1)
    return rows + more[1:], said + words


def _added(parent: Case, child: Case) -> list[str]:
    """Names of the effects that a child has and its parent has not."""
    return [one.name for key, one in candidates_in_case(child).items() if key not in parent.effects]


def table(rows: list[Row]) -> list[str]:
    """Errors by section, one column for each model, in the order of the sections downstream."""
    lines = ["| section | | " + " | ".join(f"({n})" for n in range(1, len(rows) + 1)) + " |"]
    lines.append("|---|---|" + "---:|" * len(rows))
    places = [(float(name[1:]), name, "seen") for name in rows[0].seen if name != "all"]
    places += [(float(name[1:]), name, "unseen") for name in rows[0].unseen if name != "all"]
    for x, name, which in [*sorted(places), (np.nan, "all", "seen"), (np.nan, "all", "unseen")]:
        words = f"x = {x:.2f} m" if name != "all" else "**all**"
        errors = [f"{getattr(row, which).get(name, np.nan):.3f}" for row in rows]
        lines.append(f"| {words} | {'in' if which == 'seen' else 'out'} | {' | '.join(errors)} |")
    numbers = (
        ("across", "velocity across", "in", ".3f"),
        ("across, unseen", "velocity across", "out", ".3f"),
        ("levels", "levels [m]", "in", ".4f"),
        ("left out", "section left out, linear", "in", ".3f"),
        ("chi2", "chi2", "in", ".0f"),
    )
    for key, words, which, digits in numbers:
        lines.append(f"| {words} | {which} | {' | '.join(format(row.numbers[key], digits) for row in rows)} |")
    return lines


def page(rows: list[Row], said: list[str]) -> str:
    """The part of the page that is made again."""
    models = [f"{n}. {row.title}" for n, row in enumerate(rows, 1)]
    stations = int(rows[0].numbers["stations"])
    caption = (
        "Root mean square errors of depth-averaged velocity [m/s], in sections of that along x; chi2 is of "
        f"{stations} stations, errors as assumed."
    )
    values = []
    for n, row in enumerate(rows, 1):
        words = ", ".join(f"{name} {v:.3g} ({a:.3g} to {b:.3g})" for name, (v, a, b) in row.values.items())
        values.append(f"{n}. {words}")
    parts = (models, [caption], table(rows), ["Calibrated values (95 % range):"], values, ["What the diagnosis said:"],
             [f"- {sentence}" for sentence in said])  # fmt: skip
    return "\n\n".join("\n".join(part) for part in parts)


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
    rows, said = climb(plane, "a plane", given.runs, given.jobs)
    more, words = climb(surveyed, "the surveyed bed", given.runs, given.jobs)
    text = PAGE.read_text(encoding="utf-8")
    before, after = text[: text.index(BEGIN) + len(BEGIN)], text[text.index(END) :]
    PAGE.write_text(f"{before}\n\n{page(rows + more, said + words)}\n\n{after}", encoding="utf-8")
    print(f"Written to {PAGE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
