"""Blind sets on natural reaches: a drawn bed, surveyed by cross-sections, imported and diagnosed as a user would.

    python tests/studies/natural.py [--sets N] [--first SEED] [--minutes M] [--runs FOLDER] [--figures]

The truth is that of the second solver. Each seed draws a reach: a wandering thalweg, bars, banks, three oblique
patches, and a spacing of the surveyed lines of a quarter to two channel widths; every other site is stated roughly
(corners, stems, discharges, verticals and eddy viscosity are off). Three sets come of a reach: nothing hidden, an
effect of the library at RATIO standard errors, if that is plausible, and something that no list has. A line of JSON for
each set goes to records.jsonl in the folder of runs; what stands there is not made again, so that the study may be
stopped and go on. --figures prints what the records show.
"""

import argparse
import json
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.ndimage import gaussian_filter
from second_channel import Channel, Lie
from second_kernels import DRY
from second_laws import Ground, closure_of
from second_solver import Ends, Field, Flow, Reach
from second_steady import STEADY, steady

import vegglue
from vegglue.case.gridded_site import build_site
from vegglue.errors import InputError
from vegglue.results.diagnosis import diagnosis_json

RUNS = Path(__file__).parents[2] / "runs" / "natural"
LENGTH, HALF, WIDTH, SLOPE = 84.0, 7.5, 11.0, 0.0015
FINE = (0.5, 0.3)
# Discharge [m3/s] and level at the outlet [m]; the last is held out.
FLOWS = {"May": (2.6, 0.70), "October": (7.6, 1.25), "June": (4.8, 0.98)}
HELD_OUT = "June"
SECTIONS = (16.0, 28.0, 42.0, 53.0, 66.0)
SECTIONS_HELD_OUT = (16.0, 35.0, 42.0, 60.0, 66.0)
PATCHES = ("reeds", "bush", "sedge")
GAUGES = (8.0, 28.0, 45.0, 60.0, 77.0)
VELOCITY_ERROR, LEVEL_ERROR, SURVEY_ERROR = 0.015, 0.003, 0.01
# Of bars [m]: standard deviation, and e-folding lengths along and across; of texture.
BARS, TEXTURE = (0.08, (6.0, 12.0), 2.5), (0.02, 1.0)
# What is off on a site that is stated roughly: corners [m], stems and discharges [-], verticals [m], viscosity [times].
CORNERS, STEMS, DISCHARGES, VERTICALS, VISCOSITIES = 0.1, 0.12, 0.015, 0.03, (0.5, 2.0)
VISCOSITY = 0.02
# How many standard errors long what is hidden is, and the size over a plausible one beyond which it is not hidden.
RATIO, LARGEST = 6.0, 3.0
LISTED = ("streamlining", "canopy_deflection", "mixing_length", "discharge_error[May]", "discharge_error[October]",
          "inflow_skew", "probe_gain[B]", "probe_gain[D]")  # fmt: skip
UNLISTED = ("gauge", "pool", "object", "line", "reeds", "water")
# How near a place has to lie [m], over half the length of what is hidden; from which error the told bed is off [m].
NEAR, BED_OFF = 3.0, 0.03
# A pool lies midway between lines at least so far apart [m], which see less than 2 % of its depth: half its length over
# their distance.
POOLED, POOL_SHARE = 5.0, 0.25


@dataclass(frozen=True)
class NaturalReach:
    """What is so: bed z [m] at the corners of half cells x, y; Manning's n, phi, canopy height, nu; polygons as they
    are, and stems of each over those counted; spacing of the surveyed lines [m]; rough: whether it is stated roughly.
    """

    x: Field
    y: Field
    z: Field
    n: float
    phi: float
    hd: float
    nu: float
    polygons: tuple[Field, ...]
    told: tuple[Field, ...]
    density: tuple[float, ...]
    stems: tuple[float, ...]
    discharges: Mapping[str, float]
    spacing: float
    rough: bool


@dataclass(frozen=True)
class HiddenThing:
    """name, its amplitude, and the place x, y, half length of what has one [m]; NaN without."""

    name: str = "none"
    amplitude: float = 0.0
    x: float = float("nan")
    y: float = float("nan")
    half_length: float = 1.0


def drawn_reach(seed: int) -> NaturalReach:
    """The reach of a seed."""
    rng = np.random.default_rng([seed, 58])
    x, y = np.arange(0.0, LENGTH + 0.1, FINE[0] / 2), np.arange(-HALF, HALF + 0.01, FINE[1] / 2)
    along, across = x[:, None], y[None, :]
    thalweg = sum(
        size * np.sin(2.0 * np.pi * along / wave + rng.uniform(0.0, 2.0 * np.pi))
        for size, wave in ((rng.uniform(0.8, 1.8), rng.uniform(35.0, 60.0)), (0.4, rng.uniform(18.0, 30.0)))
    )
    bed = SLOPE * (LENGTH - along) + 0.3 * (1.0 - np.exp(-(((across - thalweg) / 3.0) ** 2)))
    steep = rng.uniform(0.35, 0.6)
    bed = bed + steep * np.maximum(np.abs(across) - 0.5 * WIDTH + 1.0, 0.0)
    for size, (long, wide) in ((BARS[0], (rng.uniform(*BARS[1]), BARS[2])), (TEXTURE[0], (TEXTURE[1], TEXTURE[1]))):
        cells = (long / (x[1] - x[0]) / 2.0, wide / (y[1] - y[0]) / 2.0)
        # Wrapped: where the outermost value is repeated, bars are three times as high near the ends as between them.
        noise = gaussian_filter(rng.standard_normal(bed.shape), cells, mode="wrap")
        bed = bed + size * noise / noise.std()
    rough = seed % 2 == 1
    polygons = []
    for number, (middle, side) in enumerate(((26.0, -1), (42.0, 1), (60.0, -1))):
        long, wide, inner = rng.uniform(8.0, 16.0), rng.uniform(2.0, 3.5), rng.uniform(1.2, 2.4)
        ends = middle + rng.uniform(-2.0, 2.0) + long * np.array([-0.5, 0.5])
        tilt = rng.uniform(-0.4, 0.4, 4)
        corners = np.array([
            [ends[0] + tilt[0], side * inner + tilt[1]], [ends[1] + tilt[2], side * inner + tilt[3]],
            [ends[1], side * (inner + wide)], [ends[0], side * (inner + wide)],
        ])  # fmt: skip
        polygons.append(corners[:: 1 if number % 2 else -1])
    off = CORNERS * rough
    return NaturalReach(
        x, y, bed,
        n=rng.uniform(0.025, 0.04), phi=rng.uniform(2.5, 6.0), hd=rng.uniform(0.6, 0.9),
        nu=VISCOSITY * (np.exp(rng.uniform(*np.log(VISCOSITIES))) if rough else 1.0),
        polygons=tuple(polygons), told=tuple(one + off * rng.standard_normal(one.shape) for one in polygons),
        density=(1.0, float(rng.uniform(0.4, 0.8)), float(rng.uniform(0.5, 1.0))),
        stems=tuple(1.0 + STEMS * rough * rng.standard_normal(3)),
        discharges={name: float(1.0 + DISCHARGES * rough * rng.standard_normal()) for name in FLOWS},
        spacing=float(WIDTH * np.exp(rng.uniform(*np.log([0.25, 2.0])))), rough=rough,
    )  # fmt: skip


def inside(x: Field, y: Field, corners: Field) -> Field:
    """Whether places lie in a polygon: an odd number of its sides passes to the right."""
    found = np.zeros(np.broadcast(x, y).shape, dtype=bool)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        crosses = (y0 > y) != (y1 > y)
        found ^= crosses & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0 if y1 != y0 else 1e-12))
    return found


def reach_of(site: NaturalReach, hidden: HiddenThing, cells: tuple[float, float]) -> Reach:
    """The reach on cells of this size, with what is hidden; water [m3/s] enters along one side."""
    (dx, dy), step = cells, round(cells[0] / FINE[0])
    i = np.round(np.arange(dx / 2, LENGTH, dx) / (FINE[0] / 2)).astype(int)
    j = np.round((np.arange(-HALF + dy / 2, HALF, dy) + HALF) / (FINE[1] / 2)).astype(int)
    z = bed_with(site, hidden)
    x, y = site.x[i][:, None], site.y[j][None, :]
    faces_i = np.append(i - step, i[-1] + step)
    faces_j = np.append(j - step, j[-1] + step)
    polygons = [*site.polygons, *([reeds_of(hidden)] if hidden.name == "reeds" else [])]
    density, stems = [*site.density], [*site.stems]
    if hidden.name == "reeds":
        density, stems = [*density, hidden.amplitude], [*stems, 1.0]
    cover, patch = np.zeros((i.size, j.size)), np.full((i.size, j.size), -1)
    parts = (np.arange(4) + 0.5) / 4 - 0.5
    for number, corners in enumerate(polygons):
        share = np.mean([inside(x + a * dx, y + b * dy, corners) for a in parts for b in parts], axis=0)
        patch = np.where(share > cover, number, patch)
        cover = np.maximum(cover, share)
    far = np.full(cover.shape, np.inf)
    lie = Lie(x + 0.0 * cover, y + 0.0 * cover, 0.0 * cover, cover, patch, far, far, far, LENGTH)
    channel = Channel(LENGTH, 0.5 * WIDTH, 1.0, SLOPE, ((0.0, 0.0),) * len(polygons), tuple(density), HALF)
    effects = {}
    if hidden.name == "streamlining":
        effects = {hidden.name: {"vogel_exponent": hidden.amplitude, "reference_speed": 0.35}}
    elif hidden.name == "canopy_deflection":
        effects = {hidden.name: {"rate": hidden.amplitude}}
    elif hidden.name == "mixing_length":
        effects = {hidden.name: {"length": hidden.amplitude}}
    extra = np.zeros(cover.shape)
    if hidden.name == "object":
        extra = hidden.amplitude * np.exp(-((x - hidden.x) ** 2) - ((y - hidden.y) / 0.7) ** 2)
    ground = Ground(site.n, 1.0, site.phi, site.hd, site.nu, tuple(stems), effects=effects)
    source = np.zeros(cover.shape)
    if hidden.name == "water":
        at = (np.abs(x - hidden.x) <= hidden.half_length) & (np.abs(y - hidden.y) <= 2 * FINE[1])
        source = hidden.amplitude * at / (at.sum() * dx * dy)
    return Reach(
        dx, dy, z[np.ix_(i, j)], z[np.ix_(faces_i, j)], z[np.ix_(i, faces_j)], source,
        closure_of(ground, channel, lie, cells, extra),
    )  # fmt: skip


def bed_with(site: NaturalReach, hidden: HiddenThing) -> Field:
    """z [m] with a pool, if that is hidden."""
    if hidden.name != "pool":
        return site.z
    along, across = (site.x[:, None] - hidden.x) / hidden.half_length, site.y[None, :] - hidden.y
    return np.asarray(site.z - hidden.amplitude * np.exp(-(along**2) - across**2))


def reeds_of(hidden: HiddenThing) -> Field:
    """Corners of the reeds that no map has [m]."""
    long, wide = hidden.half_length, 1.2
    corners = np.array([[-long, -wide], [long, -0.8 * wide], [0.9 * long, wide], [-long, wide]])
    return np.asarray(corners + np.array([hidden.x, hidden.y]))


def flow_of(site: NaturalReach, hidden: HiddenThing, experiment: str, start: Flow | None) -> Flow:
    """The steady flow of an experiment; start: a flow of a like reach."""
    stated, level = FLOWS[experiment]
    discharge = stated * site.discharges[experiment]
    if hidden.name == f"discharge_error[{experiment}]":
        discharge *= 1.0 + hidden.amplitude
    share = np.ones(round(2 * HALF / FINE[1]))
    if hidden.name == "inflow_skew":
        share = np.maximum(
            1.0 + hidden.amplitude * (np.arange(share.size) + 0.5 - share.size / 2) / (share.size / 2), 0.1
        )
    reach = reach_of(site, hidden, FINE)
    if start is None:
        coarse = reach_of(site, hidden, (2 * FINE[0], 2 * FINE[1]))
        x = (np.arange(coarse.z.shape[0])[:, None] + 0.5) * coarse.dx
        h = np.maximum(level + 1.3 * SLOPE * (LENGTH - x) - coarse.z, 0.0)
        u = h ** (2 / 3)
        u = u * discharge / ((h * u).sum(axis=1, keepdims=True) * coarse.dy)
        near = steady(coarse, Ends(discharge, level, share.reshape(-1, 2).mean(axis=1)), Flow(h, u, 0 * u), 10 * STEADY)
        surface = (near.h + coarse.z).repeat(2, axis=0).repeat(2, axis=1)
        wet = near.h.repeat(2, axis=0).repeat(2, axis=1) > DRY
        h = np.where(wet, np.maximum(surface - reach.z, 0.0), 0.0)
        u, v = (np.where(h > DRY, one.repeat(2, axis=0).repeat(2, axis=1), 0.0) for one in (near.u, near.v))
        start = Flow(h, u, v)
    return steady(reach, Ends(discharge, level, share), start)


def read(field: Field, x: Field, y: Field) -> Field:
    """A field at stations, linear between the centres of cells."""
    s, t = x / FINE[0] - 0.5, (y + HALF) / FINE[1] - 0.5
    i = np.clip(s.astype(int), 0, field.shape[0] - 2)
    j = np.clip(t.astype(int), 0, field.shape[1] - 2)
    s, t = s - i, t - j
    near = field[i, j] * (1 - t) + field[i, j + 1] * t
    return np.asarray(near * (1 - s) + (field[i + 1, j] * (1 - t) + field[i + 1, j + 1] * t) * s)


def surveyed_lines(site: NaturalReach) -> Field:
    """x of the surveyed lines [m]."""
    return np.linspace(0.0, LENGTH, max(round(LENGTH / site.spacing), 4) + 1)


def write_folder(folder: Path, seed: int, site: NaturalReach, hidden: HiddenThing, flows: Mapping[str, Flow]) -> None:
    """What a field team would hand over."""
    rng = np.random.default_rng([seed, 59])
    folder.mkdir(parents=True, exist_ok=True)
    bed = bed_with(site, hidden)[1::2, 1::2]
    velocities, levels, held = ["experiment,section,x,y,u,u_se"], ["experiment,x,y,level,level_se"], []
    for name, flow in flows.items():
        for letter, x in zip("ABCDE", SECTIONS_HELD_OUT if name == HELD_OUT else SECTIONS, strict=True):
            places = np.arange(-6.0, 6.01, 0.75)
            deep = places[read(flow.h, np.full(places.size, x), places) > 0.15]
            truly = deep + (VERTICALS * site.rough * rng.standard_normal(deep.size) if name != HELD_OUT else 0.0)
            u = read(flow.u, np.full(deep.size, x), truly)
            if name == HELD_OUT:
                held += [f"{name},{letter},{x},{y:.2f},{value:.4f}" for y, value in zip(deep, u, strict=True)]
                continue
            u = u * (1.0 + hidden.amplitude * (hidden.name == f"probe_gain[{letter}]"))
            u = u + VELOCITY_ERROR * rng.standard_normal(u.size)
            velocities += [
                f"{name},{letter},{x},{y:.2f},{value:.4f},{VELOCITY_ERROR}" for y, value in zip(deep, u, strict=True)
            ]
        if name != HELD_OUT:
            x, y = np.array(GAUGES), np.zeros(len(GAUGES))
            level = read(flow.h + bed, x, y) + LEVEL_ERROR * rng.standard_normal(x.size)
            level += hidden.amplitude * (hidden.name == "gauge") * np.isclose(x, hidden.x)
            levels += [f"{name},{a},0.0,{value:.4f},{LEVEL_ERROR}" for a, value in zip(GAUGES, level, strict=True)]
    survey = ["section,x,y,z"]
    for x in surveyed_lines(site):
        at = np.arange(-HALF, HALF + 0.01, 0.6)
        i, j = round(x / (FINE[0] / 2)), np.round((at + HALF) / (FINE[1] / 2)).astype(int)
        z = bed_with(site, hidden)[i, j] + SURVEY_ERROR * rng.standard_normal(at.size)
        z = z + hidden.amplitude * (hidden.name == "line" and x == hidden.x)
        survey += [f"P{x:.0f},{x:.2f},{a:.2f},{value:.3f}" for a, value in zip(at, z, strict=True)]
    corners = ["name,x,y,stems"]
    for name, polygon, density in zip(PATCHES, site.told, site.density, strict=True):
        corners += [f"{name},{x:.2f},{y:.2f},{60.0 * density:.1f}" for x, y in polygon]
    stated = {name: {"discharge_m3_s": q, "downstream_level_m": level} for name, (q, level) in FLOWS.items()}
    about = {
        "experiments": {name: one for name, one in stated.items() if name != HELD_OUT},
        "holdout": {HELD_OUT: stated[HELD_OUT]},
        "canopy_height_guess_m": round(float(site.hd * (1.0 + rng.uniform(-0.1, 0.1))), 2),
        "eddy_viscosity_m2_s": VISCOSITY, "eddy_viscosity_factor": 2,
        "bed": {"file": "sections.csv", "sections": True}, "patches": {"file": "patches.csv"},
        "grid": {"x": [0, LENGTH], "y": [-HALF, HALF]},
    }  # fmt: skip
    tables = {
        "velocities": velocities, "levels": levels, "holdout": ["experiment,section,x,y,u", *held], "sections": survey,
        "patches": corners,
    }  # fmt: skip
    for name, rows in tables.items():
        (folder / f"{name}.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    (folder / "site.yaml").write_text(yaml.safe_dump(about, sort_keys=False), encoding="utf-8")


def sized(seed: int, site: NaturalReach, null: Mapping[str, Any]) -> list[HiddenThing]:
    """One listed effect and one thing that no list has, of a reach with nothing hidden and its diagnosis."""
    rng = np.random.default_rng([seed, 60])
    found = []
    of_name = {one["name"]: one for one in null["effects"]}
    for name in rng.permutation(LISTED):
        one = of_name.get(str(name))
        if one is None:
            continue
        # smallest_detectable is RATIO-free: the threshold of the alarm and 1.64 standard errors.
        size = one["smallest_detectable"] * RATIO / (null["threshold"] + 1.64)
        sign = -1.0 if name == "streamlining" else float(rng.choice([-1.0, 1.0])) if one["support"][0] < 0 else 1.0
        if np.isfinite(size) and size <= LARGEST * one["scale"]:
            found.append(HiddenThing(str(name), float(sign * size)))
            break
    lines = surveyed_lines(site)
    apart = float(lines[1])
    kind = str(rng.choice([one for one in UNLISTED if one != "pool" or apart >= POOLED]))
    if kind == "gauge":
        found.append(
            HiddenThing(kind, float(rng.choice([-1, 1]) * RATIO * LEVEL_ERROR), float(rng.choice(GAUGES[1:4])))
        )
    elif kind == "line":
        x = float(rng.choice(lines[(lines >= 18.0) & (lines <= 64.0)]))
        found.append(HiddenThing(kind, float(rng.choice([-1, 1]) * 0.15), x))
    elif kind == "water":
        # 3 to 8 % of the discharges, over 5 m.
        found.append(HiddenThing(kind, 0.2, float(rng.uniform(20.0, 62.0)), float(rng.choice([-3.0, 3.0])), 2.5))
    else:
        x, y = float(rng.uniform(20.0, 62.0)), float(rng.uniform(-2.0, 2.0))
        size, half = {"pool": (0.3, min(2.0, POOL_SHARE * apart)), "object": (1.0, 1.0), "reeds": (0.8, 3.0)}[kind]
        if kind == "pool":
            x = (np.floor(x / apart) + 0.5) * apart
        found.append(HiddenThing(kind, size, x, y, half))
    return found


# From which error a discharge or the stems of a patch count as wrong on a site that is stated roughly [-].
TRULY_OFF = {"discharge_error": 0.01, "patch_density": 0.05}


def told_wrongly(site: NaturalReach) -> set[str]:
    """Names of what the site states wrongly by TRULY_OFF or more: where nothing else is hidden they are right. All
    discharges together are wrong if each is, the same way.
    """
    stems = site.stems / np.mean(site.stems)
    off = {f"discharge_error[{name}]": share - 1.0 for name, share in site.discharges.items() if name != HELD_OUT}
    of_all = np.array(list(off.values()))
    off["discharge_error"] = float(of_all[np.abs(of_all).argmin()]) if np.ptp(np.sign(of_all)) == 0.0 else 0.0
    off |= {f"patch_density[{name}]": share - 1.0 for name, share in zip(PATCHES, stems, strict=True)}
    return {name for name, error in off.items() if abs(error) >= TRULY_OFF[name.split("[")[0]]}


def truly_off(found: Mapping[str, Any]) -> bool:
    """Whether the bed is named at a place and truly off there, the same way."""
    bed_off = found.get("bed_off")
    return bed_off is not None and abs(bed_off) >= BED_OFF and bed_off * found["where"]["amplitude"] > 0.0


def judged(site: NaturalReach, hidden: HiddenThing, found: Mapping[str, Any]) -> dict[str, Any]:
    """What a diagnosis made of it."""
    names, where = set(found["set"]), found["where"]
    near = bool(where) and np.hypot(where["x"] - hidden.x, where["y"] - hidden.y) <= NEAR + hidden.half_length
    gauge = any(one["kind"] == "gauge" and one["x"] == hidden.x for one in found["instruments"])
    hit = hidden.name in names or (hidden.name == "gauge" and gauge)
    if hidden.name in ("pool", "object", "line", "reeds"):
        on_line = bool(where) and abs(where["x"] - hidden.x) <= NEAR + hidden.half_length
        levelled = (one for one in found["instruments"] if one["kind"] == "line")
        reported = any(abs(one["x"] - hidden.x) <= NEAR + hidden.half_length for one in levelled)
        hit = (on_line or reported) if hidden.name == "line" else near
    if hidden.name == "water":
        hit = "lateral_inflow" in names or (near and where["term"] == "inflow")
    if hidden.name in ("pool", "line"):
        hit = hit or truly_off(found)
    listed = hidden.name in found["not_excluded"] or any(hidden.name in group for group in found["not_excluded"])
    named = found["verdict"] in ("identified", "one-of", "none-of-these", "instrument")
    place = where and [where["x"], where["y"], where["term"], where["amplitude"]]
    return {"verdict": found["verdict"], "set": sorted(names), "where": place, "bed_off": found.get("bed_off"),
            "instruments": [[one["kind"], one["x"], one["offset"]] for one in found["instruments"]],
            "hit": bool(hit), "wrongly_told": bool(names & told_wrongly(site)), "listed": bool(listed), "named": named,
            "chi2": found["chi2"]["last"], "freedom": found["chi2"]["freedom"]}  # fmt: skip


def diagnosed(folder: Path, site: NaturalReach, hidden: HiddenThing) -> dict[str, Any]:
    """The JSON of a folder, imported and diagnosed without an edit; bed_off: by how much the bed truly lies higher than
    stated at a place of the bed that is named, on average over it [m].
    """
    case = vegglue.import_folder(folder, folder.with_suffix(".yaml"), force=True)
    found = diagnosis_json(vegglue.diagnose(case, runs=folder.parent / "runs", jobs=1))
    if (where := found["where"]) and where["term"] == "bed":
        stated = build_site(case)
        x, y = stated.grid.x, stated.grid.y
        i, j = (
            np.round((one - first) / (step / 2)).astype(int)
            for one, first, step in zip((x, y), (0, -HALF), FINE, strict=True)
        )
        spot = np.exp(-(((x[:, None] - where["x"]) / where["length"]) ** 2) - ((y - where["y"]) / where["width"]) ** 2)
        found["bed_off"] = float((spot * (bed_with(site, hidden)[np.ix_(i, j)] - stated.bed)).sum() / spot.sum())
    return found


def sets_of(seed: int, runs: Path, done: set[tuple[int, str]]) -> Iterator[dict[str, Any]]:
    """Records of the sets of a reach that are not done."""
    site = drawn_reach(seed)
    about = {"seed": seed, "rough": site.rough, "spacing": round(site.spacing, 2), "version": vegglue.__version__}
    flows: dict[str, Flow] = {}
    for name in FLOWS:
        flows[name] = flow_of(site, HiddenThing(), name, None)
    folder = runs / f"n{seed}"
    write_folder(folder / "none", seed, site, HiddenThing(), flows)
    null = diagnosed(folder / "none", site, HiddenThing())
    if (seed, "none") not in done:
        yield about | {"kind": "none", "hidden": "none", "amplitude": 0.0} | judged(site, HiddenThing(), null)
    for kind, hidden in zip(("listed", "unlisted"), sized(seed, site, null), strict=False):
        if (seed, kind) in done:
            continue
        measured_only = hidden.name == "gauge" or hidden.name == "line" or hidden.name.startswith("probe_gain")
        own = flows if measured_only else {name: flow_of(site, hidden, name, flows[name]) for name in FLOWS}
        write_folder(folder / kind, seed, site, hidden, own)
        found = judged(site, hidden, diagnosed(folder / kind, site, hidden))
        yield about | {"kind": kind, "hidden": hidden.name, "amplitude": hidden.amplitude} | found


def figures(records: list[dict[str, Any]]) -> list[str]:
    """What the records show, as figures and not as ends of intervals."""
    lines = []
    for kind in ("none", "listed", "unlisted"):
        own = [one for one in records if one["kind"] == kind]
        if not own:
            continue
        if kind == "none":
            named = [one for one in own if one["named"]]
            silent = sum(one["verdict"] == "nothing-missing" for one in own)
            true = sum(
                one["bed_off"] is not None and abs(one["bed_off"]) >= BED_OFF and one["bed_off"] * one["where"][3] > 0.0
                for one in named
            )
            told = sum(one["wrongly_told"] for one in named)
            lines.append(
                f"nothing hidden: {len(own)} sets, silent {silent}, something named {len(named)}, of which a bed that "
                f"is truly off by 3 cm or more {true}, what the site states wrongly {told}"
            )
            continue
        hit = sum(one["hit"] for one in own)
        wrong = sum(one["named"] and not (one["hit"] or one["wrongly_told"]) for one in own)
        either = sum(one["hit"] or one["listed"] for one in own)
        lines.append(f"{kind}: {len(own)} sets, named {hit}, named or listed {either}, a wrong name {wrong}")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=50, help="reaches, of three sets each")
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=1e9)
    parser.add_argument("--runs", type=Path, default=RUNS)
    parser.add_argument("--figures", action="store_true")
    given = parser.parse_args()
    given.runs.mkdir(parents=True, exist_ok=True)
    path, begun = given.runs / "records.jsonl", time.monotonic()
    records = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.is_file() else []
    done = {(one["seed"], one["kind"]) for one in records}
    for seed in [] if given.figures else range(given.first, given.first + given.sets):
        if time.monotonic() - begun > 60.0 * given.minutes:
            break
        if {(seed, "none"), (seed, "listed"), (seed, "unlisted")} <= done:
            continue
        try:
            for one in sets_of(seed, given.runs, done):
                records.append(one)
                with path.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(one) + "\n")
                print(json.dumps(one)[:300], flush=True)
        except (RuntimeError, InputError) as error:
            print(f"{seed}: {error}", flush=True)
    print("\n".join(figures(records)))


if __name__ == "__main__":
    main()
