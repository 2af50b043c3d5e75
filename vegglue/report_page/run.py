"""What one report is about: everything known of a run, and where in its channel things stand."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from vegglue.case.schema import Case
from vegglue.figures.style import Picture, publish
from vegglue.flow.problem import VegetatedCells
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.sensor import FlowFields
from vegglue.measurements.kinds import kind_of
from vegglue.measurements.observations import Observations
from vegglue.measurements.plant_survey import RigidCylinder
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior
from vegglue.site.channel_geometry import patches_present
from vegglue.site.gridded_site import Site

SYNTHETIC = "synthetic record"  # stamped on every figure of one


@dataclass(frozen=True)
class Run:
    """Everything a report may show. flow: the flow of the median parameters, by experiment; cylinder: if surveyed;
    diagnosis: if there is one of this case."""

    folder: Path
    case: Case
    site: Site
    observations: Observations
    ensemble: Ensemble
    posterior: Posterior
    flow: dict[str, FlowFields]
    cylinder: RigidCylinder | None
    diagnosis: Diagnosis | None


def is_synthetic(case: Case) -> bool:
    """Whether a record was computed: an observation says so, or the case knows what it was made with."""
    made_with = case.reference is not None and bool(case.reference.made_with)
    return made_with or any(observation.synthetic for observation in case.observations)


def published_picture(run: Run, figure: Figure, name: str, caption: str, alt: str) -> Picture:
    """The figure as a file of the run and as a part of its page."""
    file = re.sub(r"[^A-Za-z0-9_.-]+", "-", name)  # experiments and sections are named by their user
    return publish(figure, run.folder / "figures", file, caption, alt, SYNTHETIC if is_synthetic(run.case) else "")


def median_plants(run: Run, experiment: str) -> VegetatedCells:
    """The plants present in an experiment, at the medians of the parameters."""
    medians = {name: np.array([value]) for name, value in run.posterior.marginals.median.items()}
    return build_problem(run.case, run.site, experiment, medians).plants


def planted_cells(run: Run, experiment: str) -> np.ndarray:
    """Whether each cell (nx, ny) bears plants in an experiment."""
    return np.isin(run.site.patch, patches_present(run.case, experiment))


def station_zones(run: Run) -> list[str]:
    """Where each station stands: 'plants' in a patch that is present, else its friction class; 'section' where a whole
    cross-section is measured.
    """
    table, grid = run.observations.table, run.site.grid
    column = np.clip(np.searchsorted(grid.x + 0.5 * grid.dx, table["x"]), 0, len(grid.x) - 1)
    row = np.clip(np.searchsorted(grid.y + 0.5 * grid.dy, table["y"]), 0, len(grid.y) - 1)
    names = np.array(run.site.class_names)[run.site.friction_class[column, row]]
    cells = {experiment: planted_cells(run, experiment) for experiment in table["experiment"].unique()}
    among = [cells[experiment][i, j] for experiment, i, j in zip(table["experiment"], column, row, strict=True)]
    whole = [not kind_of(name).at_point for name in table["kind"]]
    return [str(name) for name in np.where(whole, "section", np.where(among, "plants", names))]
