"""The model's own error: a smooth random field of friction and bed, and errors of the site."""

from dataclasses import replace

import numpy as np
import pytest
from coarse_twin import CASE, coarse_twin
from linear_baseline import at_best, stations_of

from vegglue.arrays import Array
from vegglue.calibration.baseline import with_own_error
from vegglue.calibration.candidates import effect_entry, place_candidate, with_effect
from vegglue.calibration.model_error import (
    CellResponses,
    beside_walls,
    cell_responses,
    field_columns,
    gaussian_basis,
    model_error_columns,
    responses_to_basis,
    site_error_columns,
)
from vegglue.calibration.noise import covariance_of, noise_of, with_model_error
from vegglue.case.grid import Grid
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import z_of
from vegglue.case.schema import Case, EffectEntry, ModelError, Parameter
from vegglue.case.site_schema import FrictionClass, Inflow
from vegglue.effects.library import library
from vegglue.engine.interface import Model, Point, linearise

CASE_ALLOWS = ModelError(friction=0.05, bed=0.01)
NX, NY = 40, 24
GRID = Grid(0.5 * np.arange(NX), 0.25 * np.arange(NY) - 3.0, 0.5, 0.25)


def seen_directly(cells: list[tuple[int, int]]) -> CellResponses:
    """Predictions that are the field in some cells."""
    of = np.zeros((len(cells), NX, NY), dtype=np.float32)
    for station, (i, j) in enumerate(cells):
        of[station, i, j] = 1.0
    return CellResponses(GRID, {"friction": of})


@pytest.mark.parametrize(("length", "width"), [(2.0, 1.0), (1.0, 1.0), (4.0, 0.5)])
def test_the_field_has_its_standard_deviation_and_dies_out(length: float, width: float) -> None:
    """In the middle of the grid, on basis functions and between them; far apart it is independent."""
    cells = [(i, j) for i in (16, 18, 19, 21) for j in (10, 12, 13)]
    columns = field_columns(seen_directly([*cells, (1, 1)]), "friction", gaussian_basis(GRID, length, width))
    covariance = columns @ columns.T
    assert np.diag(covariance)[: len(cells)] == pytest.approx(1.0, rel=0.05)
    near = covariance[0, 1]
    assert 0.0 < near < 1.0
    assert np.abs(covariance[-1, :-1]).max() < 0.01
    assert np.linalg.eigvalsh(covariance).min() > -1e-9


def test_a_field_is_as_smooth_as_its_basis() -> None:
    """exp(-d^2 / 2 l^2), as of functions exp(-d^2 / l^2) that stand close."""
    row = [(i, 12) for i in range(14, 26)]
    columns = field_columns(seen_directly(row), "friction", gaussian_basis(GRID, 2.0, 1.0))
    found = columns @ columns[0]
    d = GRID.x[14:26] - GRID.x[14]
    assert found == pytest.approx(np.exp(-(d**2) / (2.0 * 2.0**2)), abs=0.06)


def test_basis_functions_are_no_smaller_than_cells() -> None:
    small = gaussian_basis(GRID, 0.01, 0.01)
    assert (small.length, small.width) == pytest.approx((1.5 * 0.5, 1.5 * 0.25))
    assert small.x[[0, -1]] == pytest.approx(GRID.x[[0, -1]])


def test_responses_to_the_basis_are_sums_over_cells() -> None:
    random = np.random.default_rng(1)
    some = CellResponses(GRID, {"bed": random.standard_normal((2, NX, NY)).astype(np.float32)})
    over = gaussian_basis(GRID, 3.0, 1.0)
    found = responses_to_basis(some, "bed", over)
    k, m = 2, 3
    shape = np.exp(-(((GRID.x[:, None] - over.x[k]) / 3.0) ** 2) - ((GRID.y[None] - over.y[m]) / 1.0) ** 2)
    assert found[1, k, m] == pytest.approx(float(np.sum(some.of["bed"][1] * shape)), rel=1e-4)


@pytest.fixture(scope="module")
def flowing() -> tuple[Model, Point]:
    return coarse_twin()


def test_the_error_of_predictions_is_that_of_friction_and_of_bed(flowing: tuple[Model, Point]) -> None:
    both, friction, bed = (
        (columns := model_error_columns(*flowing, ModelError(friction=f, bed=b))) @ columns.T
        for f, b in ((0.05, 0.01), (0.1, 0.0), (0.0, 0.02))
    )
    assert both == pytest.approx(0.25 * (friction + bed))
    assert (np.diag(friction) > 0.0).all()
    assert (np.diag(bed) > 0.0).all()
    assert model_error_columns(*flowing, ModelError()).shape == (len(flowing[0].station), 0)


def test_what_one_experiment_sees_another_sees_too(flowing: tuple[Model, Point]) -> None:
    """The bed is the same at low and at high water: errors of neighbours in different experiments are correlated."""
    model, point = flowing
    columns = model_error_columns(model, point, ModelError(bed=0.01))
    station = model.station.reset_index(drop=True)
    velocity = station[station["kind"] == "velocity"]
    low, high = (velocity[velocity["experiment"] == name].index.to_numpy() for name in list(CASE.experiments)[:2])
    same = [(a, b) for a in low for b in high if (station.loc[a, ["x", "y"]] == station.loc[b, ["x", "y"]]).all()]
    assert len(same) > 5
    unit = columns / np.linalg.norm(columns, axis=1, keepdims=True)
    assert np.median([unit[a] @ unit[b] for a, b in same]) > 0.5


@pytest.mark.slow
def test_responses_of_all_experiments_stand_in_the_rows_of_their_stations(flowing: tuple[Model, Point]) -> None:
    model, point = flowing
    found = cell_responses(model, point, ("friction",)).of["friction"]
    for experiment in CASE.experiments:
        for rows, alone in model.engine.responses_to_cells(model, point, experiment, ["friction"]):
            assert (model.station["experiment"].to_numpy()[rows] == experiment).all()
            assert found[rows] == pytest.approx(alone["friction"], rel=1e-5, abs=1e-9)


def test_the_error_stands_in_the_covariance() -> None:
    noise = noise_of(stations_of(CASE, ("A",), 4).assign(value=0.5))
    columns = 0.02 * np.random.default_rng(3).standard_normal((noise.rows.size, 5))
    after = with_model_error(noise, columns)
    assert covariance_of(after) == pytest.approx(covariance_of(noise) + columns @ columns.T)
    assert after.lower @ after.lower.T == pytest.approx(covariance_of(after))
    assert np.linalg.eigvalsh(after.model_error).min() > -1e-12


def test_something_unlisted_in_the_model_may_differ_from_its_spot(flowing: tuple[Model, Point]) -> None:
    """In proportion to its size, and around it alone; what is off may not."""
    model, point = flowing
    place = {"x": 15.0, "y": 0.2, "length": 0.6, "width": 0.5}

    def columns(drag: float) -> Array:
        entry = effect_entry(place_candidate(library()["unlisted_object"], place), drag, place)
        changed = replace(model, case=CASE.model_copy(update={"effects": {"thing": entry}}))
        return model_error_columns(changed, point, CASE_ALLOWS)

    without = model_error_columns(model, point, CASE_ALLOWS)
    own, twice, off = (columns(drag)[:, without.shape[1] :] for drag in (0.2, 0.4, 0.0))
    assert twice == pytest.approx(2.0 * own)
    assert not off.any()
    assert 1 < own.shape[1] < 60, "functions around the place, not all over the channel"


def test_something_unlisted_differs_from_its_spot_only_where_it_acts(flowing: tuple[Model, Point]) -> None:
    """Predictions of experiments that the config keeps it out of were allowed to be wrong by its shape."""
    model, point = flowing
    entry = EffectEntry(effect="unlisted_object", values={"drag": 0.2, "x": 15.0, "y": 0.2})
    low = model.rows["low"]

    def columns(*experiments: str) -> Array:
        limited = entry.model_copy(update={"experiments": experiments or None})
        there = replace(model, case=CASE.model_copy(update={"effects": {"thing": limited}}))
        return model_error_columns(there, point, CASE_ALLOWS)[:, without.shape[1] :]

    without = model_error_columns(model, point, CASE_ALLOWS)
    assert columns(*CASE.experiments) == pytest.approx(columns())
    own = columns("low")
    assert own[low].any()
    assert not np.delete(own, low, axis=0).any()


def test_a_place_that_is_calibrated_errs_where_it_lies(flowing: tuple[Model, Point]) -> None:
    model, point = flowing
    prior = Parameter(distribution="uniform", low=5.0, high=25.0, unit="m")
    known = replace(point, z=np.append(point.z, 0.0), slope=np.pad(point.slope, ((0, 0), (0, 1))))

    def columns(x: float | str) -> Array:
        entry = EffectEntry(effect="unlisted_object", values={"drag": 0.2, "x": x, "y": 0.2})
        parameters = {**CASE.parameters, "x_of_thing": prior}
        case = CASE.model_copy(update={"effects": {"thing": entry}, "parameters": parameters})
        return model_error_columns(replace(model, case=case), known, CASE_ALLOWS)

    assert columns("x_of_thing") == pytest.approx(columns(15.0))


@pytest.mark.parametrize(("name", "amplitude"), [("unlisted_object", 0.2), ("unlisted_inflow", 0.05)])
def test_an_error_of_shape_does_not_look_like_another_size(
    flowing: tuple[Model, Point], name: str, amplitude: float
) -> None:
    """Else the size that was calibrated is lost in it: water that enters at a place was all error of shape."""
    model, point = flowing
    there, size, shape = with_a_place(model, point, name, amplitude)
    trace, weight = there.slope[:, -1], model.station["standard_error"].to_numpy(float) ** -2.0
    together = (weight * trace) @ shape / (weight @ trace**2)
    spread = float(np.sqrt(together @ together))
    assert spread < 0.1 * abs(size), "of the size"
    # Basis functions larger than the spot held many times its water, and left nothing to be identified.
    assert 0.0 < np.linalg.norm(shape) < np.linalg.norm(there.slope[:, -1] * size)


def test_stations_that_are_not_in_use_change_no_error_of_shape(flowing: tuple[Model, Point]) -> None:
    model, point = flowing
    used = np.arange(len(model.station)) % 3 > 0
    fewer = replace(model, station=model.station[used].reset_index(drop=True))
    aside = replace(model, station=model.station.assign(used=used))
    alone, told = (with_a_place(one, point, "unlisted_object", 0.2)[2] for one in (fewer, aside))
    np.testing.assert_allclose(told[used], alone, rtol=0.0, atol=1e-6 * np.abs(alone).max())


def with_a_place(model: Model, point: Point, name: str, amplitude: float) -> tuple[Point, float, Array]:
    """A model with something at a place: its point, the size of that as z, and the columns of its error of shape."""
    place = {"x": 15.0, "y": 0.2, "length": 0.6, "width": 0.5}
    candidate = place_candidate(library()[name], place)
    case = with_effect(model.case, candidate, place)
    size = z_of(case.parameters[candidate.parameter], amplitude)
    there, without = linearise(replace(model, case=case), np.append(point.z, size)), linearise(model, point.z)
    assert there is not None
    assert without is not None
    columns = model_error_columns(replace(model, case=case), there, CASE_ALLOWS)
    return there, size, columns[:, model_error_columns(model, without, CASE_ALLOWS).shape[1] :]


def linear(case: Case) -> tuple[Array, Array]:
    random = np.random.default_rng(5)
    station = stations_of(case, ("A", "B"), 4)
    return 0.02 * random.standard_normal(len(station)), 0.05 * random.standard_normal((len(station), 4))


def test_no_allowance_gives_the_numbers_without_it_bit_by_bit() -> None:
    values, slope = linear(CASE)
    base = at_best(CASE, stations_of(CASE, ("A", "B"), 4), values, slope)
    case = CASE.model_copy(update={"model_error": ModelError()})
    after = with_own_error(replace(base, model=replace(base.model, case=case)))
    assert CASE.model_error == ModelError(), "none is allowed unless a config says so"
    assert after.noise is base.noise
    assert after.fitted is base.fitted
    assert not base.noise.model_error.any()
    zero = with_model_error(base.noise, np.zeros((base.noise.rows.size, 0)))
    assert np.array_equal(zero.lower, base.noise.lower)


PARTS = ("stems", "edges", "probes", "discharge")


@pytest.fixture(scope="module")
def cells(flowing: tuple[Model, Point]) -> CellResponses:
    return cell_responses(*flowing, ("friction", "drag"))


@pytest.fixture(scope="module")
def columns(flowing: tuple[Model, Point], cells: CellResponses) -> dict[str, Array]:
    """Of each part alone, with an error of 1."""
    return {part: site_error_columns(*flowing, ModelError(**{part: 1.0}), cells) for part in PARTS}


def change(flowing: tuple[Model, Point], case: Case) -> Array:
    """Of the predictions when the case is this one."""
    model, point = flowing
    there = linearise(replace(model, case=case, site=build_site(case)), point.z, point)
    assert there is not None
    return there.prediction - point.prediction


def test_a_probe_beside_its_place_sees_the_slope_of_the_flow(
    flowing: tuple[Model, Point], columns: dict[str, Array]
) -> None:
    """Central differences of the flow 1 cm to either side; gauges do not move."""
    model, point = flowing
    moved = [
        linearise(replace(model, station=model.station.assign(y=model.station["y"] + step)), point.z, point)
        for step in (0.01, -0.01)
    ]
    assert all(one is not None for one in moved)
    slope = (moved[0].prediction - moved[1].prediction) / 0.02
    velocity = (model.station["kind"] == "velocity").to_numpy()
    found = columns["probes"] @ columns["probes"].T
    assert np.abs(found - np.diag(np.diag(found))).max() == 0.0, "each probe errs by itself"
    assert not np.diag(found)[~velocity].any()
    size, true = np.sqrt(np.diag(found))[velocity], np.abs(slope[velocity])
    # coarse cells: a slope over two of them is not that at a place
    assert np.corrcoef(size, true)[0, 1] > 0.8
    assert size.sum() == pytest.approx(true.sum(), rel=0.15)


def test_a_wrong_discharge_is_that_of_one_experiment(flowing: tuple[Model, Point], columns: dict[str, Array]) -> None:
    mid = CASE.experiments["mid"]
    more = mid.model_copy(update={"discharge": {name: 1.01 * float(value) for name, value in mid.discharge.items()}})
    case = flowing[0].case.model_copy(update={"experiments": {**CASE.experiments, "mid": more}})
    found = columns["discharge"][:, list(CASE.experiments).index("mid")]
    assert 0.01 * found == pytest.approx(change(flowing, case), abs=2e-4)


def test_what_an_effect_changes_has_no_error_beside_it(
    flowing: tuple[Model, Point], cells: CellResponses, columns: dict[str, Array]
) -> None:
    model, point = flowing
    known = {
        "discharge_error": EffectEntry(values={"relative_error": 0.0}, experiments=("mid",)),
        "patch_density": EffectEntry(values={"excess": 0.0, "patch": 1.0}),
    }
    with_them = replace(model, case=model.case.model_copy(update={"effects": known}))
    for part, position in (("discharge", list(CASE.experiments).index("mid")), ("stems", 0)):
        found = site_error_columns(with_them, point, ModelError(**{part: 1.0}), cells)
        assert found == pytest.approx(np.delete(columns[part], position, axis=1), rel=1e-3, abs=1e-5)


def test_stems_are_the_friction_of_each_patch(cells: CellResponses, columns: dict[str, Array]) -> None:
    planted = coarse_twin()[0].site.patch >= 0
    everywhere = cells.of["friction"][:, planted].sum(axis=1)
    assert columns["stems"].shape[1] == len(CASE.plants.patches)
    assert columns["stems"].sum(axis=1) == pytest.approx(everywhere, rel=1e-3, abs=1e-5)


@pytest.mark.parametrize(("sign", "alike"), [(1.0, 0.7), (-1.0, 0.9)])
def test_a_side_further_out_is_a_larger_patch(
    sign: float, alike: float, flowing: tuple[Model, Point], columns: dict[str, Array]
) -> None:
    """The first patch, which ends at y = 0, one cell wider or narrower there: the same pattern, to first order."""
    model, _ = flowing
    first, *others = model.case.plants.patches
    cell = sign * model.site.grid.dy
    moved = first.model_copy(update={"y": (first.y[0], first.y[1] + cell)})
    plants = model.case.plants.model_copy(update={"patches": (moved, *others)})
    true = change(flowing, model.case.model_copy(update={"plants": plants}))
    outwards, inwards = columns["edges"][:, 0::2].T, columns["edges"][:, 1::2].T
    sides = cell * np.sqrt(2.0) * (outwards if sign > 0.0 else inwards)
    found = max(sides, key=lambda one: float(one @ true))
    assert found @ true > alike * np.linalg.norm(found) * np.linalg.norm(true)
    assert 0.4 < np.linalg.norm(found) / np.linalg.norm(true) < 2.5


def test_errors_add_up_and_none_is_none(
    flowing: tuple[Model, Point], cells: CellResponses, columns: dict[str, Array]
) -> None:
    sizes = dict(zip(PARTS, (0.1, 0.05, 0.02, 0.01), strict=True))
    both = site_error_columns(*flowing, ModelError(**sizes), cells)
    apart = sum(sizes[part] ** 2 * columns[part] @ columns[part].T for part in PARTS)
    assert both @ both.T == pytest.approx(apart, rel=1e-6, abs=1e-12)
    assert not site_error_columns(*flowing, ModelError(friction=0.05), cells).any()


def test_a_probe_within_a_cell_of_a_wall_errs_by_the_profile_over_it() -> None:
    """By g^(1/2) n b^(-1/6) |u| / kappa, b the width of the cell; of the model without walls none does."""
    model, point = coarse_twin()
    (south, _), width = model.case.grid.y, model.case.grid.cell[1]
    walls = FrictionClass(law="manning", n=0.01)
    between = model.case.model_copy(update={"friction": model.case.friction.model_copy(update={"walls": walls})})
    beside_it = np.arange(len(model.station)) == 3
    station = model.station.assign(y=np.where(beside_it, south + 0.4 * width, model.station["y"]))
    cells = cell_responses(model, point, ("friction",))
    here = float(station["x"][3])
    brook = Inflow(side="south", range=(here - 1.0, here + 1.0))
    with_brook = between.model_copy(update={"inflows": {**between.inflows, "brook": brook}})
    assert not beside_walls(replace(model, case=with_brook, station=station)).any(), "no wall where water enters"
    for case, beside in ((between, [3]), (model.case, [])):
        there = replace(model, case=case, station=station)
        assert np.flatnonzero(beside_walls(there)).tolist() == beside
        columns = site_error_columns(there, point, ModelError(friction=0.05), cells)
        assert columns.shape[1] == len(beside)
        speed = np.abs(point.prediction[beside])
        expected = np.sqrt(9.81) * 0.01 * width ** (-1.0 / 6.0) / 0.41 * speed
        assert columns[beside].sum(axis=1) == pytest.approx(expected, rel=1e-6)


def test_a_profile_varies_over_a_cell_by_its_shear_velocity() -> None:
    """The standard deviation of ln(y) between the wall and the end of a cell is 1, however wide it is."""
    y = (np.arange(100_000) + 0.5) / 100_000
    assert np.log(0.05 * y).std() == pytest.approx(1.0, abs=1e-3)
