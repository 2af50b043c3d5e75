"""Fields on a model that is linear in everything, where evidence and field are known in closed form."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.stats
from linear_baseline import CASE_OF_TWINS, at_best, linear_engine, measured_linearly, stations_of

from vegglue.arrays import Array
from vegglue.calibration.baseline import SearchModel, search_model
from vegglue.calibration.model_error import CellResponses, field_columns, gaussian_basis
from vegglue.calibration.noise import covariance_of
from vegglue.case.channel_geometry import site_scales
from vegglue.case.gridded_site import build_site
from vegglue.case.site_schema import FrictionClass
from vegglue.diagnosis.field_scan import (
    FIELD_SIZES,
    FieldHypothesis,
    field_sizes,
    fields_by_evidence,
    map_of_field,
    scanned_fields,
)
from vegglue.flow.local_changes import Term

SECTIONS, POINTS, PARAMETERS = ("A", "B"), 6, 3
GRID = build_site(CASE_OF_TWINS).grid
COUNT = len(stations_of(CASE_OF_TWINS, SECTIONS, POINTS))
# Each station sees the field in the middle of the channel in one cell, ever further down.
SEEN = [(8 + station, 12 + 3 * (station % 6)) for station in range(COUNT)]


def responses() -> CellResponses:
    """Predictions that are the field of friction in a cell each; to all else they answer in unordered ways."""
    random, shape = np.random.default_rng(2), (COUNT, GRID.x.size, GRID.y.size)
    of: dict[Term, Array] = {term: 0.002 * random.standard_normal(shape).astype(np.float32) for term in FIELD_SIZES}
    of["friction"] = np.zeros(shape, dtype=np.float32)
    for station, (i, j) in enumerate(SEEN):
        of["friction"][station, i, j] = 0.1
    return CellResponses(GRID, of)


def searched(missing: Array | float = 0.0) -> SearchModel:
    slope, values = measured_linearly(SECTIONS, POINTS, PARAMETERS)
    engine = linear_engine(lambda _: (np.zeros(COUNT), slope), of_cells=responses().of)
    station = stations_of(CASE_OF_TWINS, SECTIONS, POINTS)
    return search_model(at_best(CASE_OF_TWINS, station, values + missing, slope, engine))


def smooth_field() -> Array:
    """Of friction (nx, ny) [-], a wave of 20 m along the channel."""
    return 0.6 * np.sin(2.0 * np.pi * GRID.x / 20.0)[:, None] * np.ones(GRID.y.size)


def seen_in(field: Array) -> Array:
    return 0.1 * np.array([field[cell] for cell in SEEN])


def parts(search: SearchModel) -> tuple[Array, Array]:
    """C + J J' and the measured values, which are the residual at the middle of the prior."""
    slope = search.point.slope
    return covariance_of(search.noise) + slope @ slope.T, search.noise.value


def test_the_evidence_of_a_field_is_that_of_its_gaussian() -> None:
    search = searched(seen_in(smooth_field()))
    whole, values = parts(search)
    found, _ = scanned_fields(search, 1.5)
    assert [one.log_factor for one in found] == sorted((one.log_factor for one in found), reverse=True)
    for one in (found[0], found[len(found) // 2], found[-1]):
        columns = field_columns(responses(), one.term, one.over)
        densities = [
            scipy.stats.multivariate_normal(np.zeros(COUNT), covariance).logpdf(values)
            for covariance in (whole + one.size**2 * columns @ columns.T, whole)
        ]
        assert one.log_factor == pytest.approx(densities[0] - densities[1], abs=1e-6)


def test_a_field_that_is_there_is_found_by_its_term() -> None:
    (best, *_), _ = fields_by_evidence(searched(seen_in(smooth_field())), 1.5)
    assert best.term == "friction"
    assert best.log_factor > 10.0
    assert best.over.length > 2.0, "a smooth field, and no bumps of half a metre"


def test_where_nothing_is_missing_no_field_has_evidence() -> None:
    assert fields_by_evidence(searched(), 1.5)[0][0].log_factor < 0.0


def test_all_fields_of_a_term_share_its_prior() -> None:
    """A field is charged for all that were tried: less than the best of them alone, more than its share of it."""
    search = searched(seen_in(smooth_field()))
    fields, _ = scanned_fields(search, 1.5)
    (best, *_), _ = fields_by_evidence(search, 1.5)
    of_term = [one.log_factor for one in fields if one.term == best.term]
    assert max(of_term) - np.log(4 * 4 * len(of_term)) <= best.log_factor < max(of_term)


def hypothesis() -> FieldHypothesis:
    return FieldHypothesis("friction", gaussian_basis(GRID, 3.0, 1.5), 0.5, 0.0)


def test_the_map_is_the_mean_of_the_field_after_the_data() -> None:
    """K_c r-wise: s^2 F_c F' (C + J J' + s^2 F F')^-1 y in every cell that is seen."""
    search = searched(seen_in(smooth_field()))
    whole, values = parts(search)
    one = hypothesis()
    columns = one.size * field_columns(responses(), one.term, one.over)
    mean = columns @ columns.T @ np.linalg.solve(whole + columns @ columns.T, values) / 0.1
    mapped = map_of_field(search, responses(), one)
    assert [mapped.value[cell] for cell in SEEN] == pytest.approx(mean, rel=1e-4, abs=1e-5)
    assert mapped.value.shape == mapped.error.shape == (GRID.x.size, GRID.y.size)
    truth = smooth_field()
    assert np.median([abs(mapped.value[cell] - truth[cell]) for cell in SEEN]) < 0.15


def test_the_total_is_the_integral_of_the_map_and_as_uncertain_as_its_bumps() -> None:
    """c' (1 + F' (C + J J')^-1 F)^-1 c, c the areas of the bumps."""
    search, one = searched(seen_in(smooth_field())), hypothesis()
    mapped = map_of_field(search, responses(), one)
    assert mapped.total[0] == pytest.approx(float(mapped.value.sum()) * GRID.dx * GRID.dy)
    columns = one.size * field_columns(responses(), one.term, one.over)
    known = np.linalg.inv(np.eye(columns.shape[1]) + columns.T @ np.linalg.solve(parts(search)[0], columns))
    variance = (one.over.along**2).sum(axis=0).mean() * (one.over.across**2).sum(axis=0).mean()
    areas = one.size / np.sqrt(variance) * one.over.areas(GRID).ravel()
    assert mapped.total[1] == pytest.approx(np.sqrt(areas @ known @ areas), rel=1e-4)


def test_a_field_is_charged_for_those_alone_that_compete() -> None:
    """Between walls water that enters was counted, too: all other fields were less likely by a quarter."""
    search = searched(seen_in(smooth_field()))
    walls = CASE_OF_TWINS.friction.model_copy(update={"walls": FrictionClass(law="manning", n=0.01)})
    case = search.model.case.model_copy(update={"friction": walls})
    within = replace(search, model=replace(search.model, case=case))
    (open_air, *_), (between, *_) = (fields_by_evidence(one, 1.5)[0] for one in (search, within))
    assert open_air.term == between.term == "friction"
    assert between.log_factor - open_air.log_factor == pytest.approx(np.log(4 / 3))


def test_the_field_is_known_better_where_it_is_seen() -> None:
    search = searched(seen_in(smooth_field()))
    one = hypothesis()
    error = map_of_field(search, responses(), one).error
    seen = np.mean([error[cell] for cell in SEEN[12:24]])
    assert 0.0 < seen < 0.8 * error[-6, 20], "there nothing is seen"
    assert error[-6, 20] == pytest.approx(one.size, rel=0.3)
    noisy = replace(search, noise=replace(search.noise, scale=30.0))
    assert np.mean([map_of_field(noisy, responses(), one).error[cell] for cell in SEEN[12:24]]) > seen


def test_no_water_passes_the_walls_of_a_flume() -> None:
    """Water that enters at a place was no hypothesis between walls, but water that enters over a field was."""
    search, walls = (
        searched(),
        CASE_OF_TWINS.friction.model_copy(update={"walls": FrictionClass(law="manning", n=0.01)}),
    )
    case = search.model.case.model_copy(update={"friction": walls})
    fields, _ = scanned_fields(replace(search, model=replace(search.model, case=case)), 1.5)
    assert {one.term for one in fields} == set(FIELD_SIZES) - {"inflow"}


def test_fields_are_as_large_as_the_site() -> None:
    """In a flume of 15 cm one of viscosity took 0.011 m2/s away, where the model had 0.0008."""
    model = searched().model
    scales = site_scales(model.case, model.site)
    sizes = field_sizes(model)
    assert sizes["friction"] == FIELD_SIZES["friction"]
    assert sizes["bed"] == pytest.approx([0.03 * scales.depth, 0.06 * scales.depth, 0.12 * scales.depth])
    shallow = model.case.model_copy(update={"experiments": {
        name: one.model_copy(update={"discharge": {key: 0.1 * float(q) for key, q in one.discharge.items()}})
        for name, one in list(model.case.experiments.items())[2:]
    }})  # fmt: skip
    slower = field_sizes(replace(model, case=shallow))
    assert slower["inflow"][0] < 0.3 * sizes["inflow"][0]
