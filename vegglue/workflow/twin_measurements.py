"""Data with a hidden effect: measurements of a truth on another grid.

    y = f'(z, a) + e

f' is the model on cells two thirds as long and wide, z lies off the centre of the prior, e are errors of a stated kind,
and a is the size of the effect, chosen in `hidden_effect`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration.noise import noise_of, with_correlation, with_grid_error
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import theta_at
from vegglue.engine.interface import Model, Point, linearise
from vegglue.engine.model import coarser, on_cells
from vegglue.errors import InputError
from vegglue.workflow.hidden_effect import TwinBase, bad_probe, case_hiding, chosen_effect, size_given
from vegglue.workflow.sealed_answer import BAD_PROBE, NOTHING_HIDDEN, Answer, Hidden

# Cells of the truth are so much shorter and narrower than those of the model [-].
FINER = 1.5
# Distance of a true parameter from the centre of its prior [standard deviations].
OFF_CENTRE = (0.3, 1.0)


def errors_named(text: str) -> tuple[float, float]:
    """Correlation of neighbours, and true over stated errors: `white`, `ar1:0.5`, `understated:1.5`."""
    kind, _, number = text.partition(":")
    try:
        value = float(number) if number else 0.0
    except ValueError:
        value = -1.0
    if kind == "white" and not number:
        return 0.0, 1.0
    if kind == "ar1" and 0.0 < value < 1.0:
        return value, 1.0
    if kind == "understated" and value >= 1.0:
        return 0.0, value
    raise InputError(f"--noise: expected white, ar1:0.5 (below 1) or understated:1.5 (1 or more), got {text!r}.")


def true_place(parameters: int, seed: int) -> Array:
    """z (p,), the standard normal coordinates of the prior: on either side of the centre of each, off it."""
    random = np.random.default_rng((seed, 1))
    return np.asarray(random.choice([-1.0, 1.0], parameters) * random.uniform(*OFF_CENTRE, parameters))


def twin_base(model: Model, z: Array) -> TwinBase:
    """The model and a finer one at a true place z (p,). Errors: InputError when no steady flow is found there."""
    fine = finer(model)
    here, there = linearise(model, z), linearise(fine, z)
    if here is None or there is None:
        raise InputError(f"{model.case.name}: no steady flow was found at the true parameters; take another --seed.")
    coarse = coarser(model)
    on_coarse = None if coarse is None else linearise(coarse, z)
    difference = here.prediction - (here if on_coarse is None else on_coarse).prediction
    return TwinBase(model, fine, here, there, difference)


def finer(model: Model) -> Model:
    """The model on cells two thirds as long and wide, of which every third edge is an edge of the model's as well."""
    grid = model.case.grid
    lengths = (grid.x[1] - grid.x[0], grid.y[1] - grid.y[0])
    dx, dy = (length / round(FINER * round(length / size)) for length, size in zip(lengths, grid.cell, strict=True))
    case = on_cells(model.case, (dx, dy))
    return replace(model, case=case, site=build_site(case))


def measured_twin(
    base: TwinBase, wanted: Sequence[str], snr: float, noise: str, seed: int
) -> tuple[pd.DataFrame, Answer]:
    """Stations with the values measured in a truth that hides `wanted`, and the answer.

    wanted: `EFFECT`, `EFFECT=SIZE`, `unlisted:NAME`, `bad_probe`, `?` for any effect, `nothing`. Errors: InputError for
    what is unknown, or cannot be made as visible as asked.
    """
    random = np.random.default_rng((seed, 2))
    correlation, scale = errors_named(noise)
    errors = with_correlation(noise_of(base.model.station), correlation, scale)
    with_grid = with_grid_error(errors, base.difference)
    hidden: list[Hidden] = []
    case = base.fine.case
    for text in wanted:
        name, _, size = text.partition("=")
        if name in (NOTHING_HIDDEN, BAD_PROBE):
            hidden += [bad_probe(errors, size, random)] if name == BAD_PROBE else []
            continue
        candidate, one = chosen_effect(base, with_grid, name, size_given(text, size), snr, random)
        hidden.append(one)
        case = case_hiding(case, candidate, one)
    truth: Point | None = base.there
    if case is not base.fine.case:
        truth = linearise(replace(base.fine, case=case), base.there.z, base.there)
    if truth is None:
        raise InputError(f"{case.name}: no steady flow was found with {', '.join(wanted)} hidden; take another --seed.")
    value = truth.prediction.copy()
    value[errors.rows] += errors.lower @ random.standard_normal(errors.rows.size)
    for one in hidden:
        if one.station >= 0:
            value[one.station] += one.amplitude * float(base.model.station["standard_error"].iloc[one.station])
    theta = {key: float(values[0]) for key, values in theta_at(base.model.case, base.here.z).items()}
    return base.model.station.assign(value=value), Answer(tuple(hidden), theta, correlation, scale, seed)
