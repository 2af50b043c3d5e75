"""Data sets of the blind study: what is hidden in each, at which size, and the measurements that come of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from blind_truth import Numbers, Site, flows_of, perfect_site, site_of_nature, true_values
from second_solver import Flow
from site_reach import EDDY_VISCOSITY

from vegglue.arrays import Array
from vegglue.calibration.model_error import model_error_columns
from vegglue.calibration.noise import Noise, noise_of, with_correlation, with_grid_error, with_model_error
from vegglue.case.config import load_case
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Case, ModelError, Parameter
from vegglue.diagnosis.comparison import halfway
from vegglue.engine.interface import Model, linearise
from vegglue.engine.model import coarser
from vegglue.errors import InputError
from vegglue.importers.config_parts import MODEL_ERROR, VISCOSITY, VISCOSITY_FACTOR, viscosity_prior
from vegglue.workflow.case_run import CaseRun
from vegglue.workflow.hidden_effect import (
    BAD_PROBE_EXCESS,
    LARGEST_SIZE,
    UNLISTED,
    Hidden,
    TwinBase,
    VisibilityError,
    candidate_of,
    case_hiding,
    chosen_effect,
    errors_named,
    finer,
    true_place,
    visible_length,
)

CONFIGS = Path(__file__).parents[2] / "configs"
# True places of the prior, each seen by the model once.
PLACES = 8
# Errors of the site as whoever measured there would state them, see `blind_truth` for those that it has.
SITE_ERROR = {"edges": 0.05, "probes": 0.02, "discharge": 0.01, "stems": 0.12}
# Steps and exactness [-] of finding a size in the flow of the second solver, whose steps cost 8 to 90 s each.
SIZING_STEPS, SIZED_IN_TRUTH = 5, 0.05
# Every fifth set without a hidden effect has understated errors, two of five correlated ones.
NULL_NOISE = ("white", "ar1:0.5", "white", "ar1:0.5", "understated:1.5")
OBJECTS = {"pier": "drag", "fallen_tree": "drag", "sink": "drag", "jet": "drag", "scour_hole": "bed"}
INSTRUMENTS = ("position", "gauge", "reading")
# Pairs that leave different traces, so that both could be found.
PAIRS = (
    ("discharge_error[high]", "secondary_current"), ("viscosity", "gauge_datum"), ("inflow_skew", "probe_gain[C]"),
    ("station_shift[B]", "outlet_level_error[low]"), ("bank_difference", "discharge_error[mid]"),
)  # fmt: skip
# Sets of the editions before were seen when errors of a site, the prior of viscosity and rules of the diagnosis were
# chosen.
EDITION = "fifth edition: "


@dataclass(frozen=True)
class Trial:
    """One data set. truth: second or own; hide: names; signal: length of what is hidden [standard errors]; noise: kind
    of errors; imperfect: whether the site is; sized: in whose flow it is as long, that of the model or of the truth.
    """

    truth: str
    case: str
    group: str
    number: int
    hide: tuple[str, ...]
    signal: float
    noise: str
    imperfect: bool
    sized: str = "model"

    @property
    def key(self) -> str:
        return f"{self.truth}/{self.case}/{self.group}/{self.number}"


@dataclass(frozen=True)
class DataSet:
    """A model with what was measured, what was hidden as records say it, names that are true besides with their sizes,
    and stations that nobody measured with what is true there.
    """

    model: Model
    hidden: tuple[dict[str, Any], ...]
    also_true: Mapping[str, float]
    unseen: pd.DataFrame


@lru_cache
def model_of(study: str) -> Model:
    """The model with the error of its own and the prior of viscosity that an imported case has, and errors of its
    site.
    """
    model = CaseRun(load_case(CONFIGS / f"{study}.yaml")).model
    free = Parameter(**viscosity_prior(EDDY_VISCOSITY, VISCOSITY_FACTOR))
    case: Case = model.case.model_copy(
        update={
            "model_error": ModelError(**MODEL_ERROR["model_error"], **SITE_ERROR),
            "eddy_viscosity": VISCOSITY,
            "parameters": {**model.case.parameters, VISCOSITY: free},
        }
    )
    return replace(model, case=case)


@lru_cache(maxsize=PLACES)
def place_of(study: str, number: int) -> tuple[TwinBase, Array]:
    """The model at a true place, and the columns of its own error there. Nothing is seen of a finer grid."""
    model = model_of(study)
    z = true_place(len(model.names), number)
    here, coarse = linearise(model, z), coarser(model)
    on_coarse = None if coarse is None else linearise(coarse, z)
    if here is None or on_coarse is None:
        raise InputError(f"{study}: no steady flow at place {number}")
    base = TwinBase(model, model, here, here, here.prediction - on_coarse.prediction)
    return base, model_error_columns(model, here, model.case.model_error)


def place_number(trial: Trial) -> int:
    """The true place of a trial, 0 to PLACES - 1."""
    # Steps of 7, which shares no factor with PLACES, visit all of them; groups begin at different ones.
    return (trial.number * 7 + len(trial.group)) % PLACES


def data_set(trial: Trial) -> DataSet:
    """The data set of a trial, see `told`."""
    return as_measured(trial.case, told(trial))


def as_measured(study: str, made: Mapping[str, Any]) -> DataSet:
    """The data set of what `told` gives."""
    model = model_of(study)
    value, unseen = (np.array(made[name], dtype=float) for name in ("value", "unseen"))
    station = model.station.assign(value=value)
    there = unseen_stations(model).assign(value=unseen)
    return DataSet(replace(model, station=station), tuple(made["hidden"]), made["also_true"], there)


def told(trial: Trial) -> dict[str, Any]:
    """What is measured and what is true besides, as it lies in a file: no diagnosis has a part in it.

    Errors: VisibilityError where an effect cannot be made visible, RuntimeError where the second solver finds no
    steady flow.
    """
    base, columns = place_of(trial.case, place_number(trial))
    seed = hash_of(EDITION + trial.key)
    random = np.random.default_rng((seed, 2))
    correlation, scale = errors_named(trial.noise)
    errors = with_correlation(noise_of(base.model.station), correlation, scale)
    sizing = sizing_errors(base, errors, columns)
    found = [_hidden(base, sizing, name, trial.signal, random) for name in trial.hide]
    station = base.model.station
    if trial.sized == "truth":
        found = [_as_long_in_truth(trial, base, sizing, one, seed) for one in found]
    flows = [one for one in found if not one["stations"]]
    truly, also_true = _truly(trial, base, _everywhere(base.model), flows, seed)
    value = truly[: len(station)].copy()
    value[errors.rows] += errors.lower @ random.standard_normal(errors.rows.size)
    for one in found:
        value[one["stations"]] += one["amplitude"]
    return {
        "key": trial.key, "edition": EDITION, "hide": list(trial.hide), "hidden": found, "also_true": dict(also_true),
        "value": value.tolist(), "unseen": truly[len(station) :].tolist(),
    }  # fmt: skip


def sizing_errors(base: TwinBase, errors: Noise, columns: Array) -> Noise:
    """Errors in which what is hidden is so many standard errors long: of the data, the grid, and the model's own."""
    return with_model_error(with_grid_error(errors, base.difference), columns)


def length_in_truth(trial: Trial, hidden: Mapping[str, Any], seed: int) -> float:
    """Standard errors by which readings without errors differ with and without what is hidden, both of the second
    solver on the site of a trial, after calibration has done what it can [-]; for white errors.
    """
    base, columns = place_of(trial.case, place_number(trial))
    sizing = sizing_errors(base, noise_of(base.model.station), columns)
    ends = [_truly(trial, base, base.model.station, some, seed)[0] for some in ([hidden], [])]
    return visible_length(base, sizing, ends[0] - ends[1])


def _as_long_in_truth(trial: Trial, base: TwinBase, sizing: Noise, hidden: dict[str, Any], seed: int) -> dict[str, Any]:
    """What is hidden, at the amplitude that makes it as long in the flow of the second solver as was asked.

    Errors: VisibilityError where that would be larger than is plausible.
    """
    amplitude, station = candidate_of(base.model, hidden["name"]).effect.amplitude, base.model.station
    without, _ = _truly(trial, base, station, [], seed)
    one = hidden
    for _ in range(SIZING_STEPS):
        length = visible_length(base, sizing, _truly(trial, base, station, [one], seed)[0] - without)
        one = one | {"signal": length}
        if abs(length / trial.signal - 1.0) < SIZED_IN_TRUTH:
            return one
        grown = (trial.signal / max(length, 1e-300)) ** (1.0 / amplitude.power)
        size = (one["amplitude"] - amplitude.off) * min(grown, 3.0)
        value = amplitude.off + size
        if not amplitude.low <= value <= amplitude.high or abs(size) > LARGEST_SIZE * amplitude.scale:
            break
        one = one | {"amplitude": value}
    raise VisibilityError(f"{hidden['name']}: at no plausible size is it {trial.signal:g} long in the second solver")


def hash_of(text: str) -> int:
    """A number of a text, the same on every machine."""
    return int.from_bytes(text.encode(), "big") % (2**61 - 1)


def unseen_stations(model: Model) -> pd.DataFrame:
    """The stations of velocities moved to sections halfway between those measured, and behind the last."""
    moved = halfway(model.station, model.case.grid.x[1])
    return moved.assign(section=moved["section"].astype(str) + " and next")


def _hidden(base: TwinBase, sizing: Noise, name: str, signal: float, random: np.random.Generator) -> dict[str, Any]:
    """What is hidden, at its size, as the record has it."""
    told = {"shapes": {}, "signal": signal, "x": None, "y": None, "term": None, "stations": []}
    if name in (*INSTRUMENTS, "bad_probe"):
        return told | {"name": name, "kind": "instrument"} | _instrument(base, sizing, name, signal, random)
    candidate, one = chosen_effect(base, sizing, name, None, signal, random)
    told |= {"name": one.name, "amplitude": one.amplitude, "shapes": one.shapes, "signal": one.signal}
    told |= {"parameter": candidate.effect.amplitude.name, "kind": "listed"}
    if one.listed:
        return told
    term = OBJECTS[name.removeprefix(UNLISTED)]
    return told | {"kind": "unlisted", "term": term, "x": one.shapes["x"], "y": one.shapes["y"]}


def _instrument(base: TwinBase, sizing: Noise, kind: str, signal: float, random: np.random.Generator) -> dict[str, Any]:
    """Rows of one instrument, and by how much it is off: as visible as asked, a bad probe by that of a twin."""
    station = base.model.station
    rows = np.flatnonzero((station["kind"] == ("level" if kind == "gauge" else "velocity")).to_numpy())
    one = station.iloc[int(random.choice(rows))]
    same = (station["x"] == one["x"]) & (station["y"] == one["y"]) & (station["kind"] == one["kind"])
    chosen = np.flatnonzero(same.to_numpy()) if kind in ("position", "gauge") else np.array([int(str(one.name))])
    sign, error = float(random.choice([-1.0, 1.0])), float(one["standard_error"])
    if kind == "bad_probe":
        return {"amplitude": sign * BAD_PROBE_EXCESS * error, "stations": chosen.tolist()}
    trace = np.zeros(len(station))
    trace[chosen] = 1.0
    return {"amplitude": sign * signal / visible_length(base, sizing, trace), "stations": chosen.tolist()}


def _truly(
    trial: Trial, base: TwinBase, station: pd.DataFrame, hidden: Sequence[Mapping[str, Any]], seed: int
) -> tuple[Array, Mapping[str, float]]:
    """What is true at stations, and what may rightly be named besides what is hidden."""
    if trial.truth == "own":
        return _own_truth(base, station, hidden), {}
    site, number = _perfect_site(base, trial.case), place_number(trial)
    if trial.imperfect:
        site = site_of_nature(site, base.model.case, seed % 2**31, trial.hide)
    elif not hidden:
        return _perfect_values(trial.case, number), site.also_true
    numbers: dict[str, Numbers] = {one["name"]: {one["parameter"]: one["amplitude"], **one["shapes"]} for one in hidden}
    starts = _perfect_flows(trial.case, number)
    return true_values(site, base.model.case, trial.case, station, numbers, starts=starts), site.also_true


def _perfect_site(base: TwinBase, study: str) -> Site:
    case, theta = base.model.case, theta_at(base.model.case, base.here.z)
    numbers = {name: float(values[0]) for name, values in theta.items()}
    return perfect_site(case, study, numbers, len(base.model.station))


@lru_cache
def _perfect_values(study: str, number: int) -> Array:
    """True values where nothing is hidden on a perfect site: the same in all data sets of one true place."""
    base, _ = place_of(study, number)
    starts = _perfect_flows(study, number)
    return true_values(_perfect_site(base, study), base.model.case, study, _everywhere(base.model), {}, starts=starts)


@lru_cache(maxsize=2 * PLACES)
def _perfect_flows(study: str, number: int) -> dict[str, Flow]:
    """Flows where nothing is hidden on a perfect site: those of other sites of this place start from them."""
    base, _ = place_of(study, number)
    return flows_of(_perfect_site(base, study), base.model.case, study)


def _everywhere(model: Model) -> pd.DataFrame:
    """The stations that are measured, and those that nobody measures."""
    return pd.concat([model.station, unseen_stations(model)], ignore_index=True)


def _own_truth(base: TwinBase, station: pd.DataFrame, hidden: Sequence[Mapping[str, Any]]) -> Array:
    """Predictions of the model itself on cells two thirds as long and wide."""
    fine = replace(finer(base.model), station=station)
    case = fine.case
    for one in hidden:
        what = Hidden(one["name"], one["amplitude"], one["shapes"], one["signal"])
        case = case_hiding(case, candidate_of(base.model, one["name"]), what)
    point = linearise(replace(fine, case=case), base.here.z)
    if point is None:
        raise RuntimeError("no steady flow of the model itself")
    return point.prediction
