"""Figures of measurements: residuals, verticals, canopy profiles, discharges."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.special import ndtri

from vegglue.arrays import Array
from vegglue.inference.glue import fit_members, member_weights
from vegglue.inference.statements import measurement_error
from vegglue.inference.weighted_statistics import weighted_quantile
from vegglue.measurements.kinds import kind_of
from vegglue.measurements.observations import fitted_curve
from vegglue.normal_range import NORMAL95
from vegglue.pages.run import Run, published_picture, station_zones
from vegglue.pages.style import HEIGHT, SMALL, WIDTH, Picture, canvas, formula_labels, label, styled
from vegglue.pages.svg import COLOUR
from vegglue.wording.numbers import as_given, plus_minus, unit_math
from vegglue.wording.sentences import phrase


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
        z, own = vertical.bed + vertical.height, {"color": COLOUR["measured"], "markeredgewidth": 0.7}
        axes.plot([vertical.y] * 2, [vertical.bed, vertical.bed + vertical.depth], color=COLOUR["rule"], linewidth=0.7)
        curve = vertical.y + stretch * vertical.curve_velocity, vertical.bed + vertical.curve_height
        axes.plot(*curve, color=COLOUR["model"], linewidth=0.9)
        for chosen, face in ((vertical.used, COLOUR["measured"]), (~vertical.used, COLOUR["paper"])):
            place = vertical.y + stretch * vertical.velocity[chosen]
            axes.plot(place, z[chosen], "o", markersize=2.6, markerfacecolor=face, **own)
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
    axes.set_xlabel(phrase("label", "vertical"))
    axes.set_ylabel("z [m]")
    return figure


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
    axes.set(xlabel="velocity [m/s]", ylabel=phrase("label", "height"), ylim=(0, depth * 1.12))
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
    used, zone = table["used"].to_numpy(), np.array(station_zones(run))
    several = table["experiment"].nunique() > 1
    for kind in map(kind_of, posterior.fit.sigma):
        rows = np.flatnonzero(used & (table["kind"] == kind.name).to_numpy())
        residual, where = posterior.fit.residual[rows], zone[rows]
        means = {str(name): residual[where == name] for name in dict.fromkeys(where)}
        zones = [(name, float(part.mean()), float(part.std())) for name, part in means.items()]
        axis = "y" if kind.velocity else "x"
        figure = draw_residuals(table[axis].to_numpy()[rows], axis, residual, list(where), unit_math(kind.unit))
        yield published_picture(run, figure, f"residuals-{kind.name}", "caption_residuals", kind, zones)
        score = residual / posterior.fit.noise[rows]
        groups = []
        for row in rows:
            experiment, section = str(table["experiment"][row]), str(table["section"][row])
            groups.append(f"{experiment} {section}".strip() if several else section or experiment)
        places = table[axis].to_numpy()[rows]
        names = [f"{group}, {axis} = {as_given(place)} m" for group, place in zip(groups, places, strict=True)]
        worst, known = int(np.argmax(np.abs(score))), measurement_error(posterior, kind.name)
        stated = known if np.isfinite(known) and posterior.settings.sigma_rule != "known" else None
        yield published_picture(
            run, draw_quantiles(score, names), f"quantiles-{kind.name}", "caption_quantiles", kind,
            posterior.fit.sigma[kind.name], score[worst], groups[worst], axis, places[worst], stated,
        )  # fmt: skip


@dataclass(frozen=True)
class SurveyedSection:
    """The verticals of one section of one experiment; canopy: height and standard error [m], if known."""

    experiment: str
    section: str
    verticals: list[Vertical]
    points: int
    canopy: tuple[float, float] | None


def surveyed_sections(run: Run) -> Iterator[SurveyedSection]:
    """All ADV sections with their verticals."""
    observations = run.observations
    if observations.profiles.empty:
        return
    for key, rows in observations.profiles.groupby(["experiment", "section"], sort=False):
        experiment, section = map(str, key)
        points, drawn = observations.points, []
        here = points[(points["experiment"] == experiment) & (points["section"] == section)]
        for _, profile in rows.iterrows():
            own, fit = here[here["y"] == profile["y"]], fitted_curve(profile)
            height, velocity, used = own["height"].to_numpy(), own["u"].to_numpy(), own["used"].to_numpy()
            curve = np.linspace(0.0, profile["depth"], 60) if fit is not None else height
            at = profile["y"], profile["bed"], profile["depth"], bool(profile["plants"])
            drawn.append(Vertical(*at, height, velocity, used, curve, velocity if fit is None else fit.velocity(curve)))
        found = observations.canopy_height.get((experiment, section))
        canopy = (found.value, found.standard_error) if found is not None and np.isfinite(found.value) else None
        yield SurveyedSection(experiment, section, drawn, len(here), canopy)


def verticals(run: Run) -> Iterator[Picture]:
    """All verticals of each ADV section, as wide as the page: the fastest point reaches 1.5 distances between them."""
    for one in surveyed_sections(run):
        y = np.unique([vertical.y for vertical in one.verticals])
        spacing = float(np.median(np.diff(y))) if len(y) > 1 else 1.0
        fastest = max(float(np.abs(vertical.velocity).max()) for vertical in one.verticals)
        stretch = 1.5 * spacing / fastest if fastest > 0.0 else 1.5 * spacing
        figure, name = draw_verticals(one.verticals, one.canopy, stretch), f"verticals-{one.experiment}-{one.section}"
        counts = one.points, len(one.verticals)
        yield published_picture(run, figure, name, "caption_verticals", one.section, one.experiment, *counts)


def canopy_profiles(run: Run) -> Iterator[Picture]:
    """The verticals of each ADV section that stand inside plants, with the canopy height."""
    for one in surveyed_sections(run):
        inside = [vertical for vertical in one.verticals if vertical.planted]
        if inside:
            places = [f"{vertical.y:g}" for vertical in inside]
            name = f"canopy-{one.experiment}-{one.section}"
            figure = draw_canopy_profiles(inside, one.canopy)
            where = one.section, one.experiment, places
            yield published_picture(run, figure, name, "caption_canopy", *where, one.canopy)


def discharges(run: Run) -> Iterator[Picture]:
    """Discharge by each rule beside that of the model, for each ADV section; none without an ensemble of our own."""
    ensemble, posterior = run.ensemble, run.posterior
    if ensemble is None or ensemble.by_command:  # a command gives no discharge through a section
        return
    weights = posterior.sample.weights
    if posterior.settings.method != "glue":  # of the members that were simulated, as the posterior has its own draws
        fit = fit_members(ensemble.prediction, posterior.station, posterior.settings.sigma_rule)
        weights = member_weights(fit, "gaussian", -np.inf)
    sections = [name for name, _ in ensemble.sections]
    for (experiment, section), rules in run.observations.discharge.items():
        if section not in sections:
            continue
        through = ensemble.section_flow[:, ensemble.experiments.index(experiment), sections.index(section)]
        low, middle, high = map(float, weighted_quantile(through, weights, [0.025, 0.5, 0.975]))
        names = {"paper": "linear interpolation", "profile": "profile fit"}
        rows = [(names.get(rule, rule), found.value, found.standard_error) for rule, found in rules.items()]
        figure, name = draw_discharge(rows, (low, middle, high)), f"discharge-{experiment}-{section}"
        yield published_picture(run, figure, name, "caption_discharge", section, experiment, rows, middle)
