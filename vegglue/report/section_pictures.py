"""Measured against modelled across all sections, before and after what was missing was added: pictures, and their
numbers for the pointer.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.gridded_site import in_experiment
from vegglue.case.text_files import unused
from vegglue.measurements.kinds import STREAMWISE, Kind, kind_of, velocity_rows
from vegglue.measurements.sections import section_in_words
from vegglue.normal_range import NORMAL95
from vegglue.report.cause_words import accepted_causes
from vegglue.report.run import Run, file_name, planted_cells, published_svg, stamp
from vegglue.report.section_panels import DrawnPanel, Edges, PanelGround, SectionPanel, draw_panel, value_range
from vegglue.report.style import Picture
from vegglue.report.typography import as_given, short
from vegglue.wording.numbers import so_many

# What makes two rows of two tables one station.
STATION_KEY = ["experiment", "kind", "section", "x", "y"]
CENTIMETRES = 2  # decimals of places [m]: no tape tells more, and places turned from a map have more
# Edges of the bands of a posterior: 95 %, 50 %, and 95 % with the residual error.
EDGES = ["low", "high", "low50", "high50", "total_low", "total_high"]
# What HTML would take for markup, as JSON writes it too.
ESCAPED = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028", "\u2029": "\\u2029"}


@dataclass(frozen=True)
class ExperimentPanels:
    """The sections of one experiment; name: of the experiment; worst: root mean square of what was missed at first."""

    name: str
    pictures: list[Picture]
    worst: float


@dataclass(frozen=True)
class SectionPanels:
    """All sections, the experiment that was missed most first. added: what stands between before and after, '' for
    nothing; banded, any_aside: whether a posterior and stations that were set aside are shown; data: numbers of all
    stations as JSON that is safe in a page.
    """

    experiments: list[ExperimentPanels]
    added: str
    banded: bool
    any_aside: bool
    data: str

    @property
    def choices(self) -> list[tuple[int, str]]:
        """Place and name of each experiment."""
        return [(place, one.name) for place, one in enumerate(self.experiments)]


def section_panels(run: Run) -> SectionPanels:
    """Every section at which velocities were measured, drawn and written to run.folder/figures."""
    stations = _stations(run)
    stations = stations[velocity_rows(stations) & np.isfinite(stations["value"].to_numpy(float))]
    added = accepted_causes(run.behind) if run.behind else ""
    taken: set[str] = set()
    experiments, data = [], []
    for (experiment, kind), rows in stations.groupby(["experiment", "kind"], sort=False):
        drawn = list(_drawn(run, str(experiment), kind_of(str(kind)), rows, bool(added), taken))
        data += [numbers for _, numbers in drawn]
        name = str(experiment) if kind == STREAMWISE else f"{experiment}, {kind_of(str(kind)).words}"
        experiments.append(ExperimentPanels(name, [picture for picture, _ in drawn], _missed(rows)))
    experiments.sort(key=lambda one: -one.worst)
    banded, aside = (bool(column.any()) for column in (stations["low"].notna(), stations["aside"]))
    return SectionPanels(experiments, added, banded, aside, safe_json(data))


def safe_json(tree: Any) -> str:
    """The tree as JSON that ends no script element, whatever users wrote."""
    text = json.dumps(tree, ensure_ascii=False, allow_nan=False)
    return "".join(ESCAPED.get(letter, letter) for letter in text)


def _stations(run: Run) -> pd.DataFrame:
    """Stations with columns before, after, low and high: of the diagnosis where there is one, else of the posterior."""
    band, total = run.posterior.predicted.model_band, run.posterior.predicted.total_band
    levels = {"low": band[0], "low50": band[1], "middle": band[2], "high50": band[3], "high": band[4]}
    own = run.observations.table.assign(**levels, total_low=total[0], total_high=total[-1])
    if run.behind is None:
        return own.assign(before=own["middle"], after=own["middle"], aside=~own["used"].astype(bool))
    told = run.behind.predictions.table.rename(columns={"prediction_first": "before", "prediction": "after"})
    aside = ~told["used"].astype(bool)
    aside.iloc[list(run.behind.errors.flagged)] = True
    edges = own.drop_duplicates(STATION_KEY)[[*STATION_KEY, *EDGES]]
    return told.assign(aside=aside).merge(edges, on=STATION_KEY, how="left")


def _missed(rows: pd.DataFrame) -> float:
    left = (rows["value"] - rows["before"])[~rows["aside"]]
    return float(np.sqrt(np.mean(left**2))) if len(left) else 0.0


def _drawn(
    run: Run, experiment: str, kind: Kind, rows: pd.DataFrame, added: bool, taken: set[str]
) -> Iterator[tuple[Picture, dict[str, Any]]]:
    """Each section of one experiment as a picture, and its numbers; taken: names of files in use, added to."""
    places = rows.groupby("section")["x"].mean().sort_values()
    panels = [_panel(run, experiment, rows[rows["section"] == section], added) for section in places.index]
    values = value_range(panels)
    for section, panel in zip(places.index, panels, strict=True):
        words = f"{'section' if kind.name == STREAMWISE else kind.name}-{experiment}-{section}"
        name = unused(file_name(words), taken)
        taken.add(name)
        drawn = draw_panel(panel, values, f"{kind.column} [{kind.unit}]", stamp(run.case))
        alt = f"{kind.words.capitalize()} across {panel.title}, experiment {experiment}: {panel_words(panel)}."
        reasons = rows[rows["section"] == section].sort_values("y")["reason"].astype(str).tolist()
        picture = published_svg(run, drawn.svg, name, panel_words(panel), alt)
        yield picture, _numbers(picture.name, kind, panel, drawn) | {"reason": reasons}


def _panel(run: Run, experiment: str, rows: pd.DataFrame, added: bool) -> SectionPanel:
    rows = rows.sort_values("y")
    x = float(rows["x"].mean())
    values = {name: rows[name].to_numpy(float) for name in ("y", "value", "before", "after", *EDGES)}
    band, core, total = (
        None if np.isnan(values[low]).all() else (values[low], values[high])
        for low, high in zip(EDGES[::2], EDGES[1::2], strict=True)
    )
    return SectionPanel(
        title=section_in_words(str(rows["section"].iloc[0]), x),
        y=values["y"],
        measured=values["value"],
        error=NORMAL95 * rows["standard_error"].to_numpy(float),
        aside=rows["aside"].to_numpy(bool),
        before=values["before"] if added else None,
        after=values["after"],
        band=band,
        core=None if added else core,
        total=None if added else total,
        ground=_ground_at(run, experiment, x),
    )


def _ground_at(run: Run, experiment: str, x: float) -> PanelGround:
    grid = run.site.grid
    column = int(np.argmin(np.abs(grid.x - x)))
    return PanelGround(grid.y, in_experiment(run.site, experiment).bed[column], planted_cells(run, experiment)[column])


def panel_words(panel: SectionPanel) -> str:
    """Where a section was missed most, by how much before and after, and how many stations errors explain (text)."""
    counted = ~panel.aside
    if not counted.any():
        return "no measurement counts here"
    left = np.where(counted, np.abs(panel.measured - panel.after), -1.0)
    first = left if panel.before is None else np.where(counted, np.abs(panel.measured - panel.before), -1.0)
    worst = int(np.argmax(first))
    after = "" if panel.before is None else f", with it by {short(float(left[worst]), 2)}"
    y = as_given(round(float(panel.y[worst]), CENTIMETRES))
    missed = "misses most" if panel.before is None else "missed most"
    held = "" if panel.total is None else f"; {_held(panel, panel.total)}"
    return f"{missed} at y = {y} m: by {short(float(first[worst]), 2)}{after} m/s{held}"


def _held(panel: SectionPanel, total: Edges) -> str:
    inside = int(np.sum(~panel.aside & (panel.measured >= total[0]) & (panel.measured <= total[1])))
    return f"{inside} of {so_many(int(np.sum(~panel.aside)), 'station')} lie within the dotted lines"


def _numbers(name: str, kind: Kind, panel: SectionPanel, drawn: DrawnPanel) -> dict[str, Any]:
    """What the page shows of each station under the pointer, and where it is in the picture [px]."""
    lines = {"measured": panel.measured, "after": panel.after, "error": panel.error}
    if panel.before is not None:
        lines["before"] = panel.before
    return {
        "id": name,
        "unit": kind.unit,
        "y": _plain_numbers(panel.y),
        "across": _plain_numbers(drawn.across),
        "aside": panel.aside.tolist(),
        **{line: _plain_numbers(values) for line, values in lines.items()},
        "down": {line: _plain_numbers(values) for line, values in drawn.down.items()},
    }


def _plain_numbers(values: Array | Iterable[float]) -> list[float | None]:
    return [round(float(value), 4) if np.isfinite(value) else None for value in values]
