"""Errors of a data set at sections that nobody measured: of the model as it was, as the diagnosis names what it lacks,
and as `vegglue extend --auto` keeps it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from blind_sets import DataSet

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline
from vegglue.calibration.candidates import start_amplitude
from vegglue.case.parameter_space import z_at
from vegglue.case.schema import Case
from vegglue.diagnosis.child_config import candidate_named, with_additions
from vegglue.diagnosis.comparison import excluded_by
from vegglue.diagnosis.stepwise_choice import (
    Addition,
    Names,
    choice_among,
    found_additions,
    tried_additions,
    values_found,
    values_tried,
)
from vegglue.engine.interface import linearise
from vegglue.errors import InputError
from vegglue.inference.weighted_statistics import root_mean_square
from vegglue.results.diagnosis import Diagnosis
from vegglue.workflow.case_run import calibrated_anew

Errors = dict[str, Any]


def held_out(data: DataSet, found: Diagnosis, looked_into: bool) -> Errors:
    """Errors [m/s] with those of a probe added in quadrature, None where there is nothing to say.

    before, after: without and with all that was named; parent, kept: before and after what `extend --auto` keeps, whose
    names are in kept_names; oracle: with the true effect, where that was looked into; noise: of a probe.
    """
    case, added = data.model.case, found_additions(data.model.case, found)
    last = values_found(case, found)
    errors: Errors = {"noise": float(data.unseen["standard_error"].median())}
    errors["before"] = _error(data, case, found.parameters.first)
    errors["after"] = _error(data, with_additions(case, added), last) if added else None
    errors |= {"parent": None, "kept": None, "kept_names": [], "oracle": None}
    aside = excluded_by(found)
    if added:
        errors |= _as_kept(data, found, aside)
    listed = [one for one in data.hidden if one["kind"] == "listed"]
    if added and listed and looked_into:
        truth = [(candidate_named(case, data.model.station, one["name"]), one["shapes"]) for one in listed]
        base = _calibrated(data, truth, None, aside)
        errors["oracle"] = None if base is None else _error_of(data, base)
    return errors


def _as_kept(data: DataSet, found: Diagnosis, aside: pd.DataFrame) -> Errors:
    """What `extend --auto` does, by the same calibrations and the same choice, without its files."""
    parent = _calibrated(data, (), found.parameters.first, aside)
    if parent is None:
        return {}
    case = data.model.case
    named = {candidate.name: (candidate, shapes) for candidate, shapes in tried_additions(case, found)}
    last = values_tried(case, found)
    tried: dict[Names, Baseline | None] = {(): parent}

    def base_with(names: Names) -> Baseline | None:
        if names not in tried:
            tried[names] = _calibrated(data, [named[name] for name in names], last, aside)
        return tried[names]

    names = choice_among(case, found, base_with).stages[-1]
    base = tried[names]
    errors: Errors = {"parent": _error_of(data, parent), "kept_names": list(names)}
    return errors | ({"kept": _error_of(data, base)} if names and base is not None else {})


def _calibrated(
    data: DataSet, added: Sequence[Addition], known: Mapping[str, float] | None, aside: pd.DataFrame
) -> Baseline | None:
    """The model with additions, calibrated from the prior and from a known place; None without a flow."""
    child = with_additions(data.model.case, added)
    z = None
    if known is not None:
        starts = {one.parameter: start_amplitude(one.amplitude, one.amplitude.plausible_gain) for one, _ in added}
        theta = {**starts, **known}
        if not set(child.parameters) - set(theta):
            z = z_at(child, {name: np.array([theta[name]]) for name in child.parameters})[0]
    try:
        return calibrated_anew(replace(data.model, case=child), z, aside)
    except InputError:
        return None


def _error(data: DataSet, case: Case, theta: Mapping[str, float]) -> float | None:
    if set(theta) != set(case.parameters):  # something was set by hand on the way
        return None
    return _error_at(data, case, z_at(case, {name: np.array([theta[name]]) for name in case.parameters})[0])


def _error_of(data: DataSet, base: Baseline) -> float | None:
    return _error_at(data, base.model.case, base.fitted.point.z)


def _error_at(data: DataSet, case: Case, z: Array) -> float | None:
    point = linearise(replace(data.model, case=case, station=data.unseen), z)
    if point is None:
        return None
    error = data.unseen["value"].to_numpy(float) - point.prediction
    known = np.isfinite(error)
    return float(np.hypot(root_mean_square(error[known]), data.unseen["standard_error"].median()))
