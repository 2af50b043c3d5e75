"""The second solver by itself, and against an open case."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from open_cases import OPEN_CASES
from second_channel import Channel, lie_of
from second_kernels import DRY, GRAVITY
from second_laws import Ground, closure_of
from second_solver import Ends, Flow, Reach, march, rates
from second_steady import steady
from site_reach import Truth, at, centres, reach_of, steady_flow

pytestmark = pytest.mark.slow

BAR = {"scour": [47.0, -0.5, -0.22, 1.6, 0.5]}
LARGE = (1.0, 0.375)
SITE = Truth(nb=0.04, ks=0.6, phi=3.0, hd=0.8, settings={})


def strip(slope=0.002, length=60.0, patches=()):
    """A straight strip of 60 m by 1 m between smooth walls."""
    channel = Channel(length, 1.0, 1.0, slope, patches, (1.0,) * len(patches), 1.0)
    ground = Ground(0.03, 1.0, 2.0, 0.6, 0.01, (1.0,) * len(patches))
    x = np.arange(30)[:, None] * 2.0 + 1.0
    y, zeros = np.arange(4)[None, :] * 0.25 - 0.375, np.zeros((30, 4))
    z = -slope * x + zeros
    zx = -slope * np.arange(31)[:, None] * length / 30 + np.zeros((31, 4))
    return Reach(
        dx=2.0, dy=0.25, z=z, zx=zx, zy=-slope * x + np.zeros((30, 5)), source=zeros,
        closure=closure_of(ground, channel, lie_of(channel, x, y, 2.0, 0.25), (2.0, 0.25), zeros),
    )  # fmt: skip


def test_a_lake_stays_at_rest():
    """Over banks, a bar, and a shore that crosses cells: accelerations of rounding only."""
    for level in (0.3, 0.71, 1.0):
        reach = reach_of(replace(SITE, settings=BAR, bed_seed=3), LARGE, 1.0)
        still = np.maximum(level - reach.z, 0.0)
        lake = Flow(still, 0 * still, 0 * still)
        for rate in rates(reach, Ends(0.0, level, np.ones(still.shape[1])), lake, reach.closure(lake)):
            assert np.abs(rate).max() < 1e-12


def test_uniform_flow_is_that_of_manning():
    """q = h^(5/3) S^(1/2) / n, from a start that is 20 % too deep; in the end cells levels have no slope."""
    reach = strip()
    deep, discharge = 0.5, 0.5 ** (5 / 3) * 0.002**0.5 / 0.03
    start = Flow(*(np.full((30, 4), value) for value in (0.6, discharge / 0.6, 0.0)))
    flow = steady(reach, Ends(discharge, deep - 0.002 * 60.0, np.ones(4)), start, change=1e-8)
    np.testing.assert_allclose(flow.h[5:-5], deep, atol=1e-4)
    np.testing.assert_allclose(flow.u[5:-5], discharge / deep, rtol=5e-4)
    assert np.abs(flow.v).max() < 1e-9


def test_drag_of_plants_is_baptists():
    """U = C (h S)^(1/2) in a strip with plants under 1 m of water."""
    reach = strip(patches=(((0.0, 60.0), (-0.5, 0.5)),))
    chezy = (1 / 3600 + 2.0 / (2 * GRAVITY)) ** -0.5 + GRAVITY**0.5 / 0.41 * np.log(1.0 / 0.6)
    speed = chezy * 0.002**0.5
    start = Flow(*(np.full((30, 4), value) for value in (1.0, 0.8 * speed, 0.0)))
    flow = steady(reach, Ends(speed, 1.0 - 0.002 * 60.0, np.ones(4)), start, change=1e-8)
    np.testing.assert_allclose(flow.h[5:-5], 1.0, atol=2e-4)
    np.testing.assert_allclose(flow.u[5:-5], speed, rtol=3e-4)


def test_no_water_is_lost_on_the_way():
    """While it is not yet steady, what is stored is what came in: no water passes the far end, which is dry land."""
    reach = reach_of(replace(SITE, settings={"seep": [12.0, 20.0, 2.0, 2.6, 0.15]}), LARGE, 1.0)
    wall = reach.z.copy()
    wall[-3:] += 5.0
    reach = replace(reach, z=wall, zx=reach.zx + np.r_[np.zeros(98), np.full(3, 5.0)][:, None])
    still = np.maximum(0.8 - reach.z, 0.0)
    flow, seconds = march(reach, Ends(1.4, 0.0, np.ones(still.shape[1])), Flow(still, 0 * still, 0 * still), 100)
    stored = float((flow.h - still).sum()) * reach.dx * reach.dy
    assert stored == pytest.approx((1.4 + 0.15) * seconds, rel=1e-9)
    assert flow.h.min() >= 0.0


def test_every_section_passes_the_discharge():
    flow = steady_flow(SITE, 2.66, 1.0, LARGE)
    wet = flow.h[:, flow.h.max(axis=0) > DRY]
    through = (flow.h * flow.u).sum(axis=1) * LARGE[1]
    assert wet.size
    # what centres say of it is of first order beside the edges of patches
    np.testing.assert_allclose(through, 2.66, rtol=0.01)


def test_the_fourth_flow_of_open_a_is_met():
    """0.0008 m/s root mean square with dx 0.5 m, 0.0012 with 0.25 m; kappa and the depth that shears are from it."""
    truth = json.loads((OPEN_CASES / "open-a" / "answer.json").read_text(encoding="utf-8"))["truth"]
    site = Truth(**{name: truth[name] for name in ("nb", "ks", "phi", "hd")}, settings={})
    there = pd.read_csv(OPEN_CASES / "open-a" / "holdout.csv")
    cells = (0.5, 0.1875)
    flow = steady_flow(site, 3.3, 1.12, cells)
    found = at(flow.u, cells, 1.12, there["x"].to_numpy(), there["y"].to_numpy())
    assert np.sqrt(np.mean((found - there["u"]) ** 2)) < 0.0015
    assert centres(cells, 1.12)[1].size == flow.h.shape[1]


def test_newtons_steps_lead_where_explicit_ones_do(monkeypatch):
    """To within the 5e-4 m/s that explicit steps alone leave, when what changes is as small as in the study."""
    site = replace(SITE, bed_seed=3, settings={"mixk": 0.3})
    by_newton = steady_flow(site, 1.4, 0.75, LARGE, change=1e-5)
    monkeypatch.setattr("second_steady.leapt", lambda reach, ends, flow: flow)
    monkeypatch.setattr("second_steady.SAME", 0.0)
    by_steps = steady_flow(site, 1.4, 0.75, LARGE, change=1e-5)
    deep = by_steps.h > 0.15
    assert np.abs(by_newton.u - by_steps.u)[deep].max() < 5e-4
    assert np.abs(by_newton.h - by_steps.h)[deep].max() < 5e-4


def test_a_like_flow_is_only_a_start():
    site = replace(SITE, settings={"mixk": 0.3})
    afar = steady_flow(site, 1.4, 0.75, LARGE)
    near = steady_flow(site, 1.4, 0.75, LARGE, start=steady_flow(SITE, 1.4, 0.75, LARGE))
    deep = afar.h > 0.15
    assert np.abs(near.u - afar.u)[deep].max() < 2e-4
