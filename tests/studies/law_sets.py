"""Data sets of the study of laws: what is hidden in each, at which size, and the measurements that come of it.

The truth is the second solver's, on a site with small imperfections drawn anew for each set, as in the blind study. One
experiment more is held out. Truths are kept, for they do not change with the search.
"""

import json
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import hidden_laws
import numpy as np
import pandas as pd
from blind_sets import PLACES, hash_of, place_of
from blind_truth import Site, flows_of, perfect_site, site_of_nature, true_values
from second_solver import Flow

from vegglue.arrays import Array
from vegglue.calibration.candidates import Candidate
from vegglue.calibration.noise import noise_of, with_grid_error, with_model_error
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Case, Experiment
from vegglue.engine.interface import Model
from vegglue.errors import InputError
from vegglue.measurements.kinds import velocity_rows
from vegglue.workflow.hidden_effect import Hidden, TwinBase, VisibilityError, chosen_effect

STUDY = "twin"
# Standard errors that are left of what is hidden after calibration; a listed effect that cannot be as visible is hidden
# at the next one.
RATIOS = {"law": (8.0,), "listed": (8.0, 5.0, 3.0)}
# Sets of the edition before were seen when the search was chosen, and their truth lay on cells of 0.5 m.
LAW_EDITION = "second edition of laws: "
# Between the discharges that are measured: what a law says there is no guess. Level as h ~ Q^0.6.
HELD_OUT, LIKE = "held out", "mid"
HELD_OUT_SETTING = Experiment(discharge={"upstream": 2.6}, level=1.0)
# How often each hidden law is drawn anew, and data sets with nothing hidden. With 3 in the place of 4, 108 sets were
# left without those in which the law cannot be seen; 120 are wanted.
TIMES, NOTHING = 4, 25
# Listed effects that change a term of the grammar: hidden, and left out in turn.
LISTED = (
    "streamlining", "depth_dependent_bank", "viscosity", "bed_trend", "canopy_deflection", "bank_vegetation",
    "mixing_length", "debris_screen", "bank_trend", "edge_mixing", "depth_dependent_bed", "undergrowth",
    "bank_difference", "elder", "density_trend", "steep_bank", "smagorinsky", "foliage", "stem_blockage",
    "coherent_structures", "edge_thinning", "wake_mixing",
)  # fmt: skip
# What is not off on a site where it would be of the kind that is hidden, see `site_of_nature`.
SAME_KIND = {"plants": ("patch_density", "emergent_part"), "viscosity": ("viscosity",)}


@dataclass(frozen=True)
class LawTrial:
    """One data set. group: law, listed or nothing; hide: the name of what is hidden, or empty."""

    group: str
    number: int
    hide: str

    @property
    def key(self) -> str:
        return f"{self.group}/{self.number}"


@dataclass(frozen=True)
class LawDataSet:
    """A model with what was measured; hidden: what was hidden, with its size; held_out: stations of the experiment that
    was held out with what is true there; case: that of the model with that experiment; also_true: what may rightly be
    named besides.
    """

    model: Model
    hidden: dict[str, Any] | None
    held_out: pd.DataFrame
    case: Case
    also_true: Mapping[str, float]


def law_trials() -> list[LawTrial]:
    """All data sets, mixed so that a study that is stopped has some of each kind."""
    laws = [law.name for law in hidden_laws.HIDDEN_LAWS]
    hidden = {"law": laws * TIMES, "listed": list(LISTED), "nothing": [""] * NOTHING}
    mixed = [
        ((number + 0.5) / len(names), LawTrial(group, number, name))
        for group, names in hidden.items()
        for number, name in enumerate(names)
    ]
    return [trial for _, trial in sorted(mixed, key=lambda pair: pair[0])]


def knowing_hidden(case: Case) -> Case:
    """The case with the effect file of hidden laws."""
    return case.model_copy(update={"effect_file": Path(hidden_laws.__file__)})


@dataclass(frozen=True)
class LawTruth:
    """What instruments show at the stations (station,) and, without errors, what is true at those held out (k,); hidden
    and also_true as in `LawDataSet`; left_out: why there is none, or empty.
    """

    hidden: dict[str, Any] | None
    value: list[float]
    held_out: list[float]
    also_true: dict[str, float]
    seconds: float
    left_out: str = ""


def law_truth(trial: LawTrial, folder: Path) -> LawTruth:
    """The truth of a trial, from the folder where it is kept there, else made and put there."""
    path, what = folder / f"{trial.key.replace('/', '_')}.json", {"edition": LAW_EDITION, "hide": trial.hide}
    if path.exists():
        kept = json.loads(path.read_text(encoding="utf-8"))
        if {name: kept.pop(name, None) for name in what} == what:
            return LawTruth(**kept)
    folder.mkdir(parents=True, exist_ok=True)
    began = time.process_time()
    try:
        made = replace(_made(trial), seconds=time.process_time() - began)
    except (VisibilityError, InputError, RuntimeError) as error:
        made = LawTruth(None, [], [], {}, time.process_time() - began, str(error))
    path.write_text(json.dumps(what | asdict(made)), encoding="utf-8")
    return made


def law_data_set(trial: LawTrial, truth: LawTruth) -> LawDataSet:
    """The data set of a trial with its truth, which was not left out."""
    base, _ = place_of(STUDY, _place(trial))
    model = replace(base.model, station=base.model.station.assign(value=np.array(truth.value)))
    held_out = held_out_stations(base.model).assign(value=np.array(truth.held_out))
    return LawDataSet(model, truth.hidden, held_out, _with_held_out(base.model.case), truth.also_true)


def _place(trial: LawTrial) -> int:
    return (7 * trial.number + len(trial.group)) % PLACES


def _with_held_out(case: Case) -> Case:
    return case.model_copy(update={"experiments": {**case.experiments, HELD_OUT: HELD_OUT_SETTING}})


def _made(trial: LawTrial) -> LawTruth:
    """Errors: VisibilityError where it cannot be made visible, RuntimeError where the second solver finds no steady
    flow.
    """
    base, columns = place_of(STUDY, _place(trial))
    seed = hash_of(LAW_EDITION + trial.key)
    random = np.random.default_rng((seed, 2))
    errors = noise_of(base.model.station)
    hidden = _hidden_in(base, columns, trial, random) if trial.hide else None
    station, held_out, case = base.model.station, held_out_stations(base.model), _with_held_out(base.model.case)
    of_kind = SAME_KIND.get(hidden_laws.BY_NAME[trial.hide].term, ()) if trial.group == "law" else (trial.hide,)
    site = site_of_nature(_perfect_site(_place(trial)), case, seed % 2**31, of_kind)
    numbers = {hidden["name"]: {hidden["parameter"]: hidden["amplitude"], **hidden["shapes"]}} if hidden else {}
    everywhere = pd.concat([station, held_out], ignore_index=True)
    truly = true_values(site, case, STUDY, everywhere, numbers, starts=_perfect_flows(_place(trial)))
    value = truly[: len(station)].copy()
    value[errors.rows] += errors.lower @ random.standard_normal(errors.rows.size)
    return LawTruth(hidden, value.tolist(), truly[len(station) :].tolist(), dict(site.also_true), 0.0)


def _perfect_site(place: int) -> Site:
    base, _ = place_of(STUDY, place)
    case = _with_held_out(base.model.case)
    theta = {name: float(values[0]) for name, values in theta_at(case, base.here.z).items()}
    return perfect_site(case, STUDY, theta, len(base.model.station))


@lru_cache(maxsize=PLACES)
def _perfect_flows(place: int) -> dict[str, Flow]:
    """Flows where nothing is hidden on a perfect site: those of other sites of this place start from them."""
    base, _ = place_of(STUDY, place)
    return flows_of(_perfect_site(place), _with_held_out(base.model.case), STUDY)


def held_out_stations(model: Model) -> pd.DataFrame:
    """Velocities where they are measured at the next lower discharge, in the experiment that is held out."""
    velocity = model.station[velocity_rows(model.station) & model.station["used"].to_numpy(bool)]
    return velocity[velocity["experiment"] == LIKE].assign(experiment=HELD_OUT)


def _hidden_in(base: TwinBase, columns: Array, trial: LawTrial, random: np.random.Generator) -> dict[str, Any]:
    """What is hidden, at the size that RATIOS ask for."""
    sizing = with_model_error(with_grid_error(noise_of(base.model.station), base.difference), columns)
    if trial.group == "law":
        base = replace(base, model=replace(base.model, case=knowing_hidden(base.model.case)))
    *first, last = RATIOS[trial.group]
    for ratio in first:
        with suppress(VisibilityError):
            return _told(*chosen_effect(base, sizing, trial.hide, None, ratio, random))
    return _told(*chosen_effect(base, sizing, trial.hide, None, last, random))


def _told(candidate: Candidate, one: Hidden) -> dict[str, Any]:
    parameter = candidate.effect.amplitude.name
    return {
        "name": one.name, "parameter": parameter, "amplitude": one.amplitude, "shapes": one.shapes,
        "signal": one.signal,
    }  # fmt: skip
