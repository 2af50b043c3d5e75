"""Figures of a run that show the flow of the median parameters; captions state the finding."""

import html
from collections.abc import Iterator

import numpy as np
import pandas as pd

from vegglue.case.polygons import corners_of
from vegglue.case.text_files import told_apart
from vegglue.flow.sensor import FlowFields
from vegglue.measurements.kinds import WATER_LEVEL
from vegglue.report.plan_view import Gauges, Outline, PlanWindow, draw_plan, draw_reach, stretch_of, wet_window
from vegglue.report.run import Run, file_name, planted_cells, published_svg, stamp
from vegglue.report.style import Picture
from vegglue.report.typography import short

# Drawn upstream and downstream of the outermost patch and station [m]: room for the wake of a patch.
REACH_MARGIN = 8.0


def plans(run: Run, experiment: str) -> Iterator[Picture]:
    """The reach of patches and stations, and the whole channel."""
    flow, table = run.flow[experiment], run.observations.table
    called = told_apart({name: file_name(name) for name in run.case.experiments})[experiment]
    rows = table[table["experiment"] == experiment]
    stations = rows[["x", "y"]].drop_duplicates().to_numpy(float)
    patches = _outlines(run, experiment)
    places = np.concatenate([stations[:, 0], *[outline.corners[:, 0] for outline in patches]])
    if len(places):
        start, end = places.min() - REACH_MARGIN, places.max() + REACH_MARGIN
        reach = max(float(flow.x[0]), start), min(float(flow.x[-1]), end)
        window = wet_window(flow, reach)
        drawn = draw_reach(flow, window, patches, stations, stamp(run.case))
        alt = f"Plan of depth and velocity around the patches, experiment {experiment}."
        yield published_svg(run, drawn, f"reach-{called}", _reach_caption(run, experiment, window), alt)
    gauges = _gauges(run, rows[rows["kind"] == WATER_LEVEL])
    drawn = draw_plan(flow, patches, stations, gauges, stamp(run.case))
    alt = f"Depth, velocity and water level of experiment {experiment} along the whole channel."
    caption = channel_caption(flow, experiment, _of_engine(run))
    yield published_svg(run, drawn, f"channel-{called}", caption, alt)


def _outlines(run: Run, experiment: str) -> list[Outline]:
    present = np.unique(run.site.patch[planted_cells(run, experiment)])
    patches = [run.case.plants.patches[index] for index in present]
    return [Outline(patch.name, corners_of(run.case, patch)) for patch in patches]


def _reach_caption(run: Run, experiment: str, window: PlanWindow) -> str:
    flow, plants = run.flow[experiment], planted_cells(run, experiment)
    speed = np.hypot(flow.u, flow.v)
    inside = ((flow.x >= window[0]) & (flow.x <= window[1]))[:, None] & np.isfinite(speed)
    moves = ""
    ground = np.isin(run.site.friction_class, np.unique(run.site.friction_class[plants]))
    if (plants & inside).any():
        among, beside = speed[plants & inside].mean(), speed[~plants & inside & ground].mean()
        moves = (
            f" The water moves at {short(among, 2)} m/s among the plants and {short(beside, 2)} m/s on the bed beside."
        )
    scale = scale_in_words(stretch_of(window))
    return (
        f"<b>The reach of patches and stations, experiment {html.escape(experiment)}</b>, {scale}, "
        f"median parameters{_of_engine(run)}.{moves} Between two streamlines flows a tenth of the discharge; dots are "
        "stations."
    )


def scale_in_words(stretch: float) -> str:
    """How a plan is drawn that is so many times wider than at true scale [-]."""
    times = f"{stretch:.2g}"
    return "at true scale" if times == "1" else f"y stretched {times} times"


def _of_engine(run: Run) -> str:
    """Whose flow is drawn, where it is not that of the predictions: a command leaves none to draw."""
    return "" if run.case.engine is None else ", by the built-in engine"


def channel_caption(flow: FlowFields, experiment: str, engine: str) -> str:
    wet = np.isfinite(flow.depth).any(axis=1)
    level, depth = np.nanmean(flow.level[wet], axis=1), np.nanmax(flow.depth[wet], axis=1)
    return (
        f"<b>The whole channel, experiment {html.escape(experiment)}</b> (y stretched{engine}): the water level falls "
        f"{short(level[0] - level[-1], 2)} m over {short(np.ptp(flow.x[wet]))} m, the greatest depth goes from "
        f"{short(depth[0])} to {short(depth[-1])} m."
    )


def _gauges(run: Run, levels: pd.DataFrame) -> Gauges | None:
    if levels.empty:
        return None
    low, high = run.posterior.predicted.model_band[[0, -1]][:, levels.index.to_numpy()]
    x, value, error = (levels[column].to_numpy(float) for column in ("x", "value", "standard_error"))
    return Gauges(x, value, error, low, high)
