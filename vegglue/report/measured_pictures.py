"""Figures of a run that show measurements: sections, residuals, verticals, discharge; captions state the finding."""

import html
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.inference.glue import member_weights
from vegglue.inference.likelihood import fit_members
from vegglue.inference.weighted_statistics import weighted_quantile
from vegglue.measurements.kinds import kind_of
from vegglue.measurements.observations import fitted_curve
from vegglue.report.measured import (
    Vertical,
    draw_canopy_profiles,
    draw_discharge,
    draw_quantiles,
    draw_residuals,
    draw_verticals,
)
from vegglue.report.posterior_words import measurement_error
from vegglue.report.run import Run, published_picture, station_zones
from vegglue.report.style import Picture
from vegglue.report.typography import as_given, fixed, plus_minus, short, unit_html, unit_math
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior
from vegglue.wording.numbers import so_many


def residuals(run: Run) -> Iterator[Picture]:
    """Residuals of each kind by zone, velocities across and others along the channel, and against normal quantiles."""
    table, posterior = run.observations.table, run.posterior
    used = table["used"].to_numpy(bool)
    zone = np.array(station_zones(run))
    for kind in map(kind_of, posterior.fit.sigma):
        rows = np.flatnonzero(used & (table["kind"] == kind.name).to_numpy())
        residual, where = posterior.fit.residual[rows], zone[rows]
        means = {str(name): residual[where == name] for name in dict.fromkeys(where)}
        values = "; ".join(
            f"{html.escape(name)} {fixed(part.mean(), 3)} ± {fixed(part.std(), 3)}" for name, part in means.items()
        )
        unit, axis = unit_html(kind.unit), "y" if kind.velocity else "x"
        figure = draw_residuals(table[axis].to_numpy()[rows], axis, residual, list(where), unit_math(kind.unit))
        caption = f"Measured minus median prediction, {kind.words}, by zone (mean ± spread, {unit}): {values}."
        alt = f"Residuals of {kind.words} along {axis}, by zone. {values}"
        yield published_picture(run, figure, f"residuals-{kind.name}", caption, alt)
        score = residual / posterior.fit.noise[rows]
        worst = int(np.argmax(np.abs(score)))
        names = [f"{_station_group(table, int(row))}, {axis} = {as_given(table[axis][row])} m" for row in rows]
        caption = (
            f"Residuals of {kind.words} over the error assumed, σ = {short(posterior.fit.sigma[kind.name], 2)} {unit}: "
            f"the largest is {fixed(score[worst], 1)} at {html.escape(names[worst])}."
        )
        known = measurement_error(posterior, kind.name)
        if np.isfinite(known) and posterior.settings.sigma_rule != "known":
            caption += f" The standard errors of the data are {short(known, 2)} {unit}."
        figure = draw_quantiles(score, names)
        alt = f"Ordered residuals of {kind.words} against normal quantiles."
        yield published_picture(run, figure, f"quantiles-{kind.name}", caption, alt)


def _station_group(table: pd.DataFrame, row: int) -> str:
    """Section of a station, and its experiment where there are several or it has no section."""
    experiment, section = str(table["experiment"][row]), str(table["section"][row])
    return f"{experiment} {section}".strip() if table["experiment"].nunique() > 1 else section or experiment


@dataclass(frozen=True)
class _SurveyedSection:
    """The verticals of one section of one experiment; canopy: height and standard error [m], if known."""

    experiment: str
    section: str
    verticals: list[Vertical]
    points: int
    canopy: tuple[float, float] | None

    @property
    def heading(self) -> str:
        return f"<b>{html.escape(self.section)}, experiment {html.escape(self.experiment)}</b>"


def _surveyed_sections(run: Run) -> Iterator[_SurveyedSection]:
    observations = run.observations
    if observations.profiles.empty:
        return
    for key, rows in observations.profiles.groupby(["experiment", "section"], sort=False):
        experiment, section = map(str, key)
        points = observations.points
        here = points[(points["experiment"] == experiment) & (points["section"] == section)]
        drawn = [_vertical(row, here[here["y"] == row["y"]]) for _, row in rows.iterrows()]
        found = observations.canopy_height.get((experiment, section))
        canopy = (found.value, found.standard_error) if found is not None and np.isfinite(found.value) else None
        yield _SurveyedSection(experiment, section, drawn, len(here), canopy)


def verticals(run: Run) -> Iterator[Picture]:
    """All verticals of each ADV section, as wide as the page."""
    for one in _surveyed_sections(run):
        caption = (
            f"{one.heading}: {so_many(one.points, 'point')} in {so_many(len(one.verticals), 'vertical')}, each drawn "
            "where it stands, with the profile fitted to it; z in the datum of the file."
        )
        figure = draw_verticals(one.verticals, one.canopy, _stretch(one.verticals))
        alt = f"Point velocities over height in the verticals of section {one.section}."
        yield published_picture(run, figure, f"verticals-{one.experiment}-{one.section}", caption, alt)


def canopy_profiles(run: Run) -> Iterator[Picture]:
    """The verticals of each ADV section that stand inside plants, with the canopy height."""
    for one in _surveyed_sections(run):
        inside = [vertical for vertical in one.verticals if vertical.planted]
        if not inside:
            continue
        height = f"The canopy reads {plus_minus(*one.canopy)} m high" if one.canopy else "No canopy top shows"
        places = ", ".join(f"{vertical.y:g}" for vertical in inside)
        caption = f"{one.heading}, inside the plants at y = {places} m. {height}."
        figure = draw_canopy_profiles(inside, one.canopy)
        alt = "Velocity against height inside the plants."
        yield published_picture(run, figure, f"canopy-{one.experiment}-{one.section}", caption, alt)


def _vertical(profile: pd.Series, points: pd.DataFrame) -> Vertical:
    fit = fitted_curve(profile)
    height = points["height"].to_numpy()
    curve = np.linspace(0.0, profile["depth"], 60) if fit is not None else height
    velocity = fit.velocity(curve) if fit is not None else points["u"].to_numpy()
    used = points["used"].to_numpy(bool)
    return Vertical(
        profile["y"],
        profile["bed"],
        profile["depth"],
        bool(profile["plants"]),
        height,
        points["u"].to_numpy(),
        used,
        curve,
        velocity,
    )


def _stretch(verticals: list[Vertical]) -> float:
    """Metres drawn for 1 m/s: the fastest point reaches one and a half distances between verticals."""
    y = np.unique([vertical.y for vertical in verticals])
    spacing = float(np.median(np.diff(y))) if len(y) > 1 else 1.0
    fastest = max(float(np.abs(vertical.velocity).max()) for vertical in verticals)
    return 1.5 * spacing / fastest if fastest > 0.0 else 1.5 * spacing


def weights_of_ensemble(posterior: Posterior, ensemble: Ensemble) -> np.ndarray:
    """Of the members that were simulated, also where the posterior was drawn anew."""
    if posterior.settings.method == "glue":
        return posterior.sample.weights
    fit = fit_members(ensemble.prediction, posterior.station, posterior.settings.sigma_rule)
    return member_weights(fit, "gaussian", -np.inf)


def discharges(run: Run) -> Iterator[Picture]:
    """Discharge by each rule beside what the model let through, for each ADV section; none without an ensemble."""
    ensemble = run.ensemble
    if ensemble is None or ensemble.by_command:  # a command says nothing of what passes a section
        return
    sections = [name for name, _ in ensemble.sections]
    for (experiment, section), rules in run.observations.discharge.items():
        if section not in sections:
            continue
        through = ensemble.section_flow[:, ensemble.experiments.index(experiment), sections.index(section)]
        spread = weighted_quantile(through, weights_of_ensemble(run.posterior, ensemble), [0.025, 0.5, 0.975])
        names = {"paper": "linear interpolation", "profile": "profile fit"}
        rows = [(names.get(rule, rule), found.value, found.standard_error) for rule, found in rules.items()]
        values = ", ".join(f"{plus_minus(value, error)} m³/s by {name}" for name, value, error in rows)
        figure = draw_discharge(rows, (float(spread[0]), float(spread[1]), float(spread[2])))
        caption = (
            f"<b>Discharge through {html.escape(section)}, experiment {html.escape(experiment)}</b>: {values}; "
            f"the model lets {fixed(spread[1], 2)} m³/s through."
        )
        yield published_picture(
            run, figure, f"discharge-{experiment}-{section}", caption, f"Discharge through {section}: {values}."
        )
