"""The published confluence set through the whole loop, from a plane and from the surveyed bed: docs/confluence.md.

`make confluence DATA=folder`, the folder as R.B. Canelas published it. Nothing of it is kept but errors of the models.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vegglue.case.config import load_case
from vegglue.case.resolved_config import as_yaml
from vegglue.case.schema import Case
from vegglue.diagnosis.child_config import candidate_named
from vegglue.diagnosis.comparison import held_out_rmse, rung
from vegglue.diagnosis.excluded_stations import excluded_by
from vegglue.engine.interface import Model, linearise
from vegglue.importers.confluence import case_from_confluence, flat_bed, holds_confluence
from vegglue.results.diagnosis import Diagnosis
from vegglue.screening.spatial_scan import SPOT_RADIUS
from vegglue.site.channel_geometry import half_width
from vegglue.site.gridded_site import build_site
from vegglue.workflow.diagnose import diagnose
from vegglue.workflow.extend import child_path, extend_stepwise, write_child
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


def with_object(case: Case, found: Diagnosis) -> Case:
    """The case with something of unknown kind at the place the diagnosis points at."""
    location = found.verdict.location
    assert location is not None
    site = build_site(case)
    radius = max(SPOT_RADIUS * half_width(site), 1.5 * max(site.grid.dx, site.grid.dy))
    candidate = candidate_named(case, found.predictions.station, "unlisted_object")
    shapes = {"x": round(location.x, 3), "y": round(location.y, 3), "radius": round(radius, 3)}
    return write_child(case, child_path(case.source, [candidate]), [(candidate, shapes)])


def climb(path: Path, title: str, runs: Path, jobs: int, objects: int = 1) -> tuple[list[Row], list[str]]:
    """Rows of a case, of all that its diagnosis adds, and of an object where it points at a place, which is diagnosed
    in its turn; and what each diagnosis said.
    """
    case = load_case(path)
    found = diagnose(case, runs=runs, jobs=jobs, say=print)
    grown = extend_stepwise(case, runs=runs, jobs=jobs, say=print)
    cases, titles = list(grown.cases), [title]
    for step in found.steps[: len(cases) - 1]:
        titles.append(f"{titles[-1]}, {step.accepted}")
    rows = [row_of(name, one, runs) for name, one in zip(titles, cases, strict=True)]
    verdict = found.verdict
    said = [f"**{title}** ({verdict.kind}): {verdict.sentence}"]
    if grown.reason != verdict.sentence:
        said.append(f"Of this, {grown.reason}".replace(verdict.sentence, "").strip())
    if verdict.location is None or objects == 0:
        return rows, said
    name = f"{titles[-1]}, object at x = {verdict.location.x:.2f}, y = {verdict.location.y:.2f} m"
    more, words = climb(with_object(cases[-1], found).source, name, runs, jobs, objects - 1)
    return rows + more, said + words


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
