"""Figures of measurements: residuals, verticals, canopy profiles, discharges."""

import html
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.special import ndtri

from vegglue.arrays import Array
from vegglue.inference.glue import fit_members, member_weights
from vegglue.inference.weighted_statistics import weighted_quantile
from vegglue.measurements.kinds import kind_of
from vegglue.measurements.observations import fitted_curve
from vegglue.normal_range import NORMAL95
from vegglue.pages.posterior_words import measurement_error
from vegglue.pages.run import Run, published_picture, station_zones
from vegglue.pages.style import COLOUR, HEIGHT, SMALL, WIDTH, Picture, canvas, formula_labels, label, styled
from vegglue.pages.typography import as_given, fixed, plus_minus, short, unit_html, unit_math
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior
from vegglue.wording.numbers import so_many


@dataclass(frozen=True)
class Vertical:
    """One vertical: where it stands, its points above the bed, and the curve drawn through them; [m], [m/s]."""

    y: float
    bed: float
    depth: float
    planted: bool
    height: Array
    velocity: Array
    used: NDArray[np.bool_]
    curve_height: Array
    curve_velocity: Array


@styled
def draw_verticals(verticals: Sequence[Vertical], canopy: tuple[float, float] | None, stretch: float) -> Figure:
    """Point velocities over the height in the section: each vertical drawn where it stands, 1 m/s as `stretch` m.

    canopy: height above the bed and its standard error [m], drawn where given.
    """
    figure, axes = canvas(2 * WIDTH, HEIGHT + 0.5)
    verticals = sorted(verticals, key=lambda vertical: vertical.y)
    bed = np.array([[vertical.y, vertical.bed] for vertical in verticals])
    bottom = bed[:, 1].min()
    surface = float(np.median([vertical.bed + vertical.depth for vertical in verticals]))
    axes.fill_between(bed[:, 0], bottom - 0.06, bed[:, 1], color=COLOUR["earth"], linewidth=0)
    axes.axhline(surface, color=COLOUR["model"], linewidth=0.8)
    label(axes, bed[0, 0], surface, "water surface", "model", xytext=(0, 3))
    for vertical in verticals:
        _draw_vertical(axes, vertical, stretch)
    among = np.array([[vertical.y, vertical.bed] for vertical in verticals if vertical.planted])
    if canopy is not None and among.size:
        place, top = among[:, 0], among[:, 1] + canopy[0]  # of plants on the bed that they stand on
        ends = np.r_[place[0] - 0.1, place, place[-1] + 0.4 * stretch], np.r_[top[0], top, top[-1]]
        axes.plot(*ends, color=COLOUR["stems"], linewidth=1.2)
        text = f"canopy {plus_minus(*canopy)} m"
        label(axes, float(place.mean()), float(top.mean()), text, "stems", ha="center", xytext=(0, -11))
    foot = axes.get_ylim()[0]
    start = float(bed[:, 0].min())
    axes.annotate(
        "", (start + 0.5 * stretch, foot), (start, foot), arrowprops={"arrowstyle": "|-|,widthA=.2,widthB=.2"}
    )
    label(axes, start + 0.25 * stretch, foot, "0.5 m/s", "ink", ha="center", xytext=(0, 4))
    axes.set_xlabel("y of the vertical [m], velocity to the right of it")
    axes.set_ylabel("z [m]")
    return figure


def _draw_vertical(axes: Axes, vertical: Vertical, stretch: float) -> None:
    z = vertical.bed + vertical.height
    axes.plot([vertical.y] * 2, [vertical.bed, vertical.bed + vertical.depth], color=COLOUR["rule"], linewidth=0.7)
    curve = vertical.y + stretch * vertical.curve_velocity
    axes.plot(curve, vertical.bed + vertical.curve_height, color=COLOUR["model"], linewidth=0.9)
    for chosen, face in ((vertical.used, COLOUR["measured"]), (~vertical.used, COLOUR["paper"])):
        axes.plot(
            vertical.y + stretch * vertical.velocity[chosen],
            z[chosen],
            "o",
            markersize=2.6,
            color=COLOUR["measured"],
            markerfacecolor=face,
            markeredgewidth=0.7,
        )


@styled
def draw_canopy_profiles(inside: Sequence[Vertical], canopy: tuple[float, float] | None) -> Figure:
    """Velocity against height above the bed for the verticals inside plants, with the canopy height."""
    figure, axes = canvas(WIDTH, HEIGHT + 0.3)
    for vertical in inside:
        axes.plot(vertical.curve_velocity, vertical.curve_height, color=COLOUR["model"], linewidth=0.9)
        axes.plot(vertical.velocity, vertical.height, "o", markersize=3, color=COLOUR["measured"])
    depth = max(vertical.depth for vertical in inside)
    slowest, fastest = (pick(np.concatenate([vertical.velocity for vertical in inside])) for pick in (np.min, np.max))
    axes.set_xlim(min(0.0, 1.12 * slowest), max(0.1, 1.12 * fastest))
    right = axes.get_xlim()[1]
    if canopy is not None:
        height, error = canopy
        axes.axhspan(height - error, height + error, color=COLOUR["plants"], linewidth=0, zorder=0)
        axes.axhline(height, color=COLOUR["stems"], linewidth=0.9, zorder=0)
        text = f"canopy\n{plus_minus(height, error)} m"
        label(axes, right, height, text, "stems", ha="right", va="top", xytext=(0, -7))
    axes.axhline(depth, color=COLOUR["model"], linewidth=0.8)
    label(axes, right, depth, "water surface", "model", ha="right", xytext=(0, 3))
    axes.set(xlabel="velocity [m/s]", ylabel="height above the bed [m]", ylim=(0, depth * 1.12))
    return figure


@styled
def draw_residuals(place: Array, axis: str, residual: Array, zone: Sequence[str], unit: str) -> Figure:
    """Measured minus modelled of each station against its place on an axis, x or y; a marker for each zone."""
    figure, axes = canvas()
    axes.axhline(0, color=COLOUR["muted"], linewidth=0.8)
    axes.vlines(place, 0, residual, color=COLOUR["measured"], linewidth=0.8)
    names = list(dict.fromkeys(zone))
    for marker, name in zip(cycle("osD^vP"), names, strict=False):
        chosen = np.array([other == name for other in zone])
        axes.plot(place[chosen], residual[chosen], marker, markersize=4.4, color=COLOUR["measured"])
        last = int(np.argmax(np.where(chosen, np.abs(residual), -1)))
        side = 7 if residual[last] >= 0 else -12
        label(axes, place[last], residual[last], name, "measured", ha="center", xytext=(0, side))
    axes.margins(y=0.18)
    formula_labels(axes, f"{axis} [m]", f"measured − modelled [{unit}]")
    return figure


@styled
def draw_quantiles(standardised: Array, names: Sequence[str]) -> Figure:
    """Ordered residuals over their error against normal quantiles; off the line means not the error assumed."""
    figure, axes = canvas()
    order = np.argsort(standardised)
    expected = ndtri((np.arange(len(order)) + 0.5) / len(order))
    reach = 1.1 * max(np.abs(expected).max(), np.abs(standardised).max())
    axes.plot([-reach, reach], [-reach, reach], color=COLOUR["model"], linewidth=1)
    axes.plot(expected, standardised[order], "o", markersize=4.2, color=COLOUR["measured"])
    for place, side, offset in ((0, "left", (5, -11)), (len(order) - 1, "right", (-5, 6))):
        text = names[order[place]]
        label(axes, expected[place], standardised[order[place]], text, "measured", ha=side, xytext=offset)
    label(axes, 0.45 * reach, 0.45 * reach, "as assumed", "model", xytext=(7, -9))
    axes.set(xlabel="normal quantile [–]", ylabel="residual / error [–]")
    return figure


@styled
def draw_discharge(rows: Sequence[tuple[str, float, float]], spread: tuple[float, float, float]) -> Figure:
    """Measured discharges (name, value, standard error) beside that of the model (quantiles 2.5, 50, 97.5 %)."""
    figure, axes = canvas(WIDTH, 0.9 + 0.34 * (len(rows) + 1))
    low, middle, high = spread
    axes.axvspan(low, high, color=COLOUR["wide"], linewidth=0)
    axes.axvline(middle, color=COLOUR["model"], linewidth=1.3)
    for place, (_, value, error) in enumerate(rows):
        axes.errorbar(
            value, place, xerr=NORMAL95 * error, fmt="o", markersize=4.2, color=COLOUR["measured"], elinewidth=0.9
        )
    label(axes, middle, -0.6, "model", "model", xytext=(4, -8))
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set(xlabel="discharge [m³/s], bars 95 %", ylim=(len(rows) - 0.5, -0.6))
    axes.tick_params(labelsize=SMALL + 0.5)
    return figure


def residuals(run: Run) -> Iterator[Picture]:
    """Residuals of each kind by zone, velocities across and others along the channel, and against normal quantiles."""
    table, posterior = run.observations.table, run.posterior
    used = table["used"].to_numpy()
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
    used = points["used"].to_numpy()
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
