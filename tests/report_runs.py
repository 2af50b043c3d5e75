"""Runs of a report, with posteriors made by hand on the synthetic record and on a toy case."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.case.config import load_case
from vegglue.case.gridded_site import Site, build_site
from vegglue.case.parameter_space import sample_prior
from vegglue.case.schema import Case
from vegglue.flow.sensor import FlowFields
from vegglue.flow.status import FAILED, SOLVED_BY_MARCHING
from vegglue.inference.glue import glue
from vegglue.measurements.observations import Observations, read_observations
from vegglue.measurements.plant_survey import read_survey, rigid_cylinder
from vegglue.pages.page import write_report
from vegglue.pages.run import Run
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.ensemble import Ensemble

CONFIGS = Path(__file__).parents[1] / "configs"
MEMBERS = 2048


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
    path = write_report(run)
    assert path == run.folder / "report.html"
    return path.read_text(encoding="utf-8")


def kict(folder: Path, name: str) -> Run:
    case = load_case(CONFIGS / f"{name}.yaml")
    assert case.reference is not None
    return a_run(folder, case, read_observations(case), dict(case.reference.made_with))


def told_of(run: Run, found: Diagnosis) -> Diagnosis:
    """A diagnosis made by hand as one of this run: its stations stand in the channel, in experiments there are."""
    station = found.predictions.station
    names = dict(zip(dict.fromkeys(station["experiment"]), run.case.experiments, strict=True))
    middle = sum(run.case.grid.y) / 2
    moved = station.assign(experiment=station["experiment"].map(names), y=station["y"] + middle)
    return replace(found, predictions=replace(found.predictions, station=moved))


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
