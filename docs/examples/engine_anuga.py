"""The brook of `own_case.md` in ANUGA, a finite-volume code on triangles: one member, from parameters.json to
predictions.csv.

    python -m venv anuga && anuga/bin/pip install anuga        # its own environment; version 4.1.0 was tried
    engine: {command: "FULL/PATH/anuga/bin/python {model}", files: {model: engine_anuga.py}, step: 0.5}

The program of a command needs its full path, or a name that the shell finds. Friction is Manning's everywhere; n of
banks and plants follows from their laws and the depth of the moment.
"""

import csv
import json
import sys
from pathlib import Path

import anuga
import numpy as np

LENGTH, HALF_FLOOR, HALF_TOP, SLOPE, RISE = 30.0, 1.5, 4.5, 0.001, 0.5
PATCH = (12.0, 16.0, 0.0, 1.5)  # x, then y [m]
BANK_ROUGHNESS, CANOPY_HEIGHT, BARE_CHEZY = 0.8, 0.7, 60.0
GRAVITY, KARMAN = 9.81, 0.41
# Behind dense plants the wake swings and never rests: what is read is the mean of two parts of so many looks, once the
# flow has run in [s], and they must not differ by more than this [m/s].
RUN_IN, LOOK_EVERY, LOOKS, DRIFT = 300.0, 10.0, 10, 5e-3

given = json.loads(Path("parameters.json").read_text(encoding="utf-8"))
n_b, phi = (given["parameters"][name]["value"] for name in ("n_b", "phi"))
with Path("stations.csv").open(newline="", encoding="utf-8") as file:
    stations = list(csv.DictReader(file))


def bed(x, y):
    return np.maximum(np.abs(y) - HALF_FLOOR, 0.0) * RISE - SLOPE * x


def manning(domain):
    """n [s m^(-1/3)] of every triangle, of laws that hold at its depth."""
    x, y = domain.centroid_coordinates.T
    h = np.maximum(domain.quantities["stage"].centroid_values - bed(x, y), 0.02)
    bank = 18.0 * np.log10(np.maximum(12.0 * h / BANK_ROUGHNESS, 1.3))
    bare = (BARE_CHEZY**-2 + phi / (2.0 * GRAVITY)) ** -0.5
    plants = bare + np.sqrt(GRAVITY) / KARMAN * np.log(np.maximum(h / CANOPY_HEIGHT, 1.0))
    inside = (x > PATCH[0]) & (x < PATCH[1]) & (y > PATCH[2]) & (y < PATCH[3])
    chezy = np.where(inside, plants, np.where(np.abs(y) > HALF_FLOOR, bank, np.nan))
    return np.where(np.isnan(chezy), n_b, h ** (1 / 6) / chezy)


def mean_flow(discharge, level):
    """Centres of triangles (n, 2), and u, v [m/s] and level [m] there (3, n), the mean of all looks."""
    domain = anuga.rectangular_cross_domain(30, 18, len1=LENGTH, len2=2 * HALF_TOP, origin=(0.0, -HALF_TOP))
    domain.set_flow_algorithm("DE1")
    domain.set_store(False)
    domain.set_minimum_allowed_height(0.01)
    domain.set_quantity("elevation", bed, location="centroids")
    domain.set_quantity("stage", lambda x, y: np.maximum(level + SLOPE * (LENGTH - x), bed(x, y)), location="centroids")
    wall = anuga.Reflective_boundary(domain)
    outlet = anuga.Transmissive_n_momentum_zero_t_momentum_set_stage_boundary(domain, lambda t: level)
    domain.set_boundary({"left": wall, "right": outlet, "top": wall, "bottom": wall})
    anuga.Inlet_operator(domain, [[0.3, -2.5], [0.3, 2.5]], Q=discharge)
    looks = []
    for time in domain.evolve(yieldstep=LOOK_EVERY, finaltime=RUN_IN + 2 * LOOKS * LOOK_EVERY):
        domain.set_quantity("friction", manning(domain), location="centroids")
        if time > RUN_IN:
            looks.append(flow_now(domain))
    first, second = np.mean(looks[:LOOKS], axis=0), np.mean(looks[LOOKS:], axis=0)
    if (drift := np.abs(second - first).max()) > DRIFT:
        sys.exit(f"the mean flow still drifts by {drift:.1g} m/s")
    return domain.centroid_coordinates, (first + second) / 2


def flow_now(domain):
    """u, v [m/s] and level [m] of all triangles (3, n)."""
    stage = domain.quantities["stage"].centroid_values
    h = np.maximum(stage - domain.quantities["elevation"].centroid_values, 0.02)
    u, v = (domain.quantities[name].centroid_values / h for name in ("xmomentum", "ymomentum"))
    return np.array([u, v, stage])


predictions = {}
for experiment, flow in given["experiments"].items():
    centres, (u, v, level) = mean_flow(sum(flow["discharge"].values()), flow["level"])
    for row in (row for row in stations if row["experiment"] == experiment):
        away = np.hypot(*(centres - (float(row["x"]), float(row["y"]))).T)
        near = np.argsort(away)[:4]  # the triangles around, the nearer the more
        weight = 1.0 / (away[near] + 0.05) ** 2
        read = {"velocity": u, "velocity_across": v, "level": level, "speed": np.hypot(u, v)}[row["kind"]]
        predictions[row["station"]] = float(np.sum(weight * read[near]) / weight.sum())

with Path("predictions.csv").open("w", newline="", encoding="utf-8") as file:
    csv.writer(file).writerows([("station", "prediction"), *predictions.items()])
