"""Data sets with hidden effects, as the open cases have them, made with the second solver.

    python tests/studies/sites.py FOLDER SEED HIDDEN [--nature] [--set KEY=JSON ...]

`site_reach.SETTINGS` says what may be hidden. A finished flow is kept beside its set, and is not computed again.
"""

import argparse
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
from second_channel import PAPER
from second_solver import Flow
from site_reach import BED_ERROR, BED_LENGTHS, EDDY_VISCOSITY, FINE, SETTINGS, Truth, at, centres, reach_of, steady_flow

EXPERIMENTS = {"low": (1.4, 0.75), "mid": (2.66, 1.0), "high": (4.0, 1.25)}
HOLDOUT = {"hold": (3.3, 1.12)}
SECTIONS = {"D0": 36.0, "D3": 42.0, "D5": 46.0, "D7": 50.0}
HELD = {"D0": 36.0, "D3": 42.0, "D6": 47.5, "D7": 50.0, "D11": 66.0}
GAUGES = (10.0, 30.0, 45.0, 60.0, 80.0)
# As counted [1/m2].
STEMS = (22.0, 22.0, 22.0, 22.0, 7.3, 7.3, 7.3)
STATIONS = tuple(round(0.3 * n, 1) for n in range(-13, 14))
# Probes need so much water [m]: the open cases have none in less.
WADED = 0.164
VELOCITY_ERROR, LEVEL_ERROR = 0.012, 0.002
# Ranges about those of the answers of the open cases; reconfiguring plants are taller there, and weaker.
RANGES = {"nb": (0.028, 0.049), "ks": (0.3, 0.9), "phi": (2.0, 6.0), "hd": (0.7, 0.94)}
TALL = {"phi": (1.0, 2.6), "hd": (1.1, 1.25)}
# Small imperfections: stems and discharges [share], probes [m], eddy viscosity [times].
STEMS_ERROR, DISCHARGE_ERROR, PROBE_ERROR, VISCOSITIES = 0.12, 0.01, 0.02, (0.5, 2.5)


def truth_of(seed: int, settings: dict[str, Any], nature: bool) -> Truth:
    """Parameters drawn for a site, and its imperfections if it has any."""
    rng = np.random.default_rng([seed, 1])
    ranges = {**RANGES, **TALL} if "chi" in settings else RANGES
    drawn = {name: float(rng.uniform(*ranges[name])) for name in ("nb", "ks", "phi", "hd")}
    if not nature:
        return Truth(**drawn, settings=settings)
    return Truth(
        **drawn,
        settings=settings,
        nu=EDDY_VISCOSITY * float(np.exp(rng.uniform(*np.log(VISCOSITIES)))),
        stems=tuple(float(value) for value in 1.0 + STEMS_ERROR * rng.standard_normal(len(PAPER.patches))),
        discharges=tuple(float(value) for value in 1.0 + DISCHARGE_ERROR * rng.standard_normal(4)),
        bed_seed=seed,
    )


def make_set(folder: Path, seed: int, hidden: str, settings: dict[str, Any], nature: bool = False) -> None:
    """Write site.json, velocities.csv, levels.csv, holdout.csv and answer.json of one site into a folder.

    The flows are kept in a folder of the same name with `-flows` behind. ValueError for a setting that is not known.
    """
    unknown = settings.keys() - SETTINGS.keys()
    if unknown:
        raise ValueError(f"settings {sorted(unknown)}: expected some of {sorted(SETTINGS)}")
    truth = truth_of(seed, settings, nature)
    folder.mkdir(parents=True, exist_ok=True)
    kept = folder.with_name(folder.name + "-flows")
    rng = np.random.default_rng([seed, 2])
    velocities, levels, held = ["experiment,section,x,y,u,u_se"], ["experiment,x,y,level,level_se"], []
    for number, (name, (discharge, level)) in enumerate({**EXPERIMENTS, **HOLDOUT}.items()):
        real = discharge * truth.discharges[number]
        if settings.get("exp") == name:
            real *= settings["factor"]
        flow = _kept_flow(kept, truth, real, level)
        if name in HOLDOUT:
            held = _velocities(name, flow, truth, level, HELD, None)
        else:
            velocities += _velocities(name, flow, truth, level, SECTIONS, (rng, nature))
            levels += _levels(name, flow, truth, level, rng)
    _write(folder / "velocities.csv", velocities)
    _write(folder / "levels.csv", levels)
    _write(folder / "holdout.csv", [velocities[0], *held])
    _write(folder / "site.json", [json.dumps(_site(truth, rng), indent=1)])
    _write(folder / "answer.json", [json.dumps(_answer(folder.name, hidden, truth, nature), indent=1)])


def _write(path: Path, lines: list[str]) -> None:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _kept_flow(kept: Path, truth: Truth, discharge: float, level: float) -> Flow:
    name = hashlib.sha256(repr((truth, discharge, level, FINE)).encode()).hexdigest()[:16]
    path = kept / f"{name}.npz"
    if path.is_file():
        with np.load(path) as stored:
            return Flow(stored["h"], stored["u"], stored["v"])
    flow = steady_flow(truth, discharge, level)
    kept.mkdir(exist_ok=True)
    np.savez(path, h=flow.h, u=flow.u, v=flow.v)
    return flow


def _velocities(
    name: str, flow: Flow, truth: Truth, level: float, sections: dict[str, float],
    errors: tuple[np.random.Generator, bool] | None,
) -> list[str]:  # fmt: skip
    """Rows of an experiment at the stations in deep enough water; with errors they are measured, else as they are."""
    rows, x = [], centres(FINE, level)[0]
    depth = flow.h[:, [flow.h.shape[1] // 2 - 1, flow.h.shape[1] // 2]].mean(axis=1)
    for section, place in sections.items():
        deep = np.interp(place, x[:, 0], depth)
        stations = np.array([at_y for at_y in STATIONS if deep - max(abs(at_y) - PAPER.half, 0.0) * PAPER.rise > WADED])
        probed, error, standard_error = stations, 0.0, 0.0
        if errors is not None:
            rng, nature = errors
            probed = stations + PROBE_ERROR * rng.standard_normal(stations.size) * nature
            error, standard_error = VELOCITY_ERROR * rng.standard_normal(stations.size), VELOCITY_ERROR
            biased = np.isclose(stations, truth.settings.get("station", np.inf))
            error = error + biased * truth.settings.get("bias", 0.0)
        read = at(flow.u, FINE, level, np.full(stations.size, place), probed) + error
        rows += [f"{name},{section},{place},{s},{u:.4f},{standard_error}" for s, u in zip(stations, read, strict=True)]
    return rows


def _levels(name: str, flow: Flow, truth: Truth, level: float, rng: np.random.Generator) -> list[str]:
    """Rows of an experiment: the mean of the two cells beside the axis, with errors."""
    x, middle = centres(FINE, level)[0][:, 0], flow.h.shape[1] // 2
    surface = (flow.h + reach_of(truth, FINE, level).z)[:, middle - 1 : middle + 1].mean(axis=1)
    read = np.interp(GAUGES, x, surface) + LEVEL_ERROR * rng.standard_normal(len(GAUGES))
    read += np.isclose(GAUGES, truth.settings.get("gauge", np.inf)) * truth.settings.get("shift", 0.0)
    return [f"{name},{place},0.0,{value:.4f},{LEVEL_ERROR}" for place, value in zip(GAUGES, read, strict=True)]


def _site(truth: Truth, rng: np.random.Generator) -> dict[str, Any]:
    """What a field team knows."""
    channel = {
        "length_m": PAPER.length, "bottom_width_m": 2 * PAPER.half,
        "bank_slope_v_per_h": PAPER.rise, "bed_slope": PAPER.slope,
        "bed_level": "z = -0.001 x on the channel floor",
        "axis": "y = 0, y positive to the left looking downstream",
    }  # fmt: skip
    places = zip(PAPER.patches, STEMS, strict=True)
    noise = {"velocity_m_s": VELOCITY_ERROR, "level_m": LEVEL_ERROR}
    return {
        "channel": channel,
        "patches": [{"x": list(x), "y": list(y), "stems_per_m2": stems} for (x, y), stems in places],
        "patch_note": "same plants in every patch: phi is proportional to stems per m2",
        "canopy_height_guess_m": round(truth.hd * (1.0 + float(rng.uniform(-0.1, 0.1))), 2),
        "eddy_viscosity_m2_s": EDDY_VISCOSITY,
        "experiments": _stated(EXPERIMENTS),
        "noise": {**noise, "note": "standard error of each value, from repeats"},
        "holdout": _stated(HOLDOUT),
    }


def _stated(experiments: dict[str, tuple[float, float]]) -> dict[str, dict[str, float]]:
    return {name: {"discharge_m3_s": q, "downstream_level_m": level} for name, (q, level) in experiments.items()}


def _answer(name: str, hidden: str, truth: Truth, nature: bool) -> dict[str, Any]:
    answer: dict[str, Any] = {
        "id": name, "hidden": hidden, "settings": truth.settings,
        "truth": {"nb": truth.nb, "ks": truth.ks, "phi": truth.phi, "hd": truth.hd, "nu": EDDY_VISCOSITY},
        "noise": {"su": VELOCITY_ERROR, "sw": LEVEL_ERROR, "rho": 0.0},
        "holdout": _stated(HOLDOUT),
        "law": "; ".join(f"{key}: {SETTINGS[key]}" for key in truth.settings),
    }  # fmt: skip
    if nature:
        answer["small imperfections"] = {
            "note": f"bed surveyed with {BED_ERROR} m over {BED_LENGTHS} m, probes {PROBE_ERROR} m beside their y",
            "eddy_viscosity": truth.nu,
            "discharge": dict(zip([*EXPERIMENTS, *HOLDOUT], [value - 1 for value in truth.discharges], strict=True)),
            "stems": list(truth.stems),
        }
    return answer


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("seed", type=int)
    parser.add_argument("hidden")
    parser.add_argument("--nature", action="store_true")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=JSON", help='as --set "pier=[27, 0.7, 2.5]"')
    given = parser.parse_args()
    settings = {key: json.loads(value) for key, value in (pair.split("=", 1) for pair in given.set)}
    make_set(given.folder, given.seed, given.hidden, settings, given.nature)


if __name__ == "__main__":
    main()
