"""What a diagnosis concludes beside the verdict: errors, misfit, amplitudes, significant effects, and where it lies."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest
from coarse_twin import coarse_twin
from diagnoses import a_candidate_effect, an_anomaly, candidate_laws_of
from linear_baseline import CASE_OF_TWINS, at_best, linear_engine, stations_of
from verdicts import step

from vegglue.calibration.baseline import Baseline
from vegglue.calibration.candidates import with_effect
from vegglue.calibration.fingerprints import least_depth
from vegglue.calibration.fit import fit
from vegglue.calibration.model_error import gaussian_basis
from vegglue.calibration.noise import noise_of, with_correlation, with_grid_error
from vegglue.calibration.residual_screening import Screening, screen
from vegglue.case.channel_geometry import site_scales
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Case, EffectEntry
from vegglue.case.site_schema import CentrelineShape, Frame
from vegglue.decision_constants import constants
from vegglue.diagnosis import conclusion
from vegglue.diagnosis.candidate_effects import candidate_effects_of
from vegglue.diagnosis.child_config import candidate_at
from vegglue.diagnosis.conclusion import (
    cells_too_coarse,
    estimated_errors,
    inflow_develops,
    mapped_places,
    measured_stretch,
    misfit_of,
    named_places,
    shear_layers,
    significant_effects,
)
from vegglue.diagnosis.field_scan import FieldHypothesis, FieldMap
from vegglue.diagnosis.search_state import SearchState, Undecided
from vegglue.effects.definition import Amplitude
from vegglue.engine.interface import flow_at_centres
from vegglue.measurements.kinds import velocity_rows
from vegglue.progress import silent
from vegglue.results.causes import Rival
from vegglue.results.verdict import MeasuredStretch, NameHangsOnSection, OneSection, PlacesOnMap

WEST, EAST = CASE_OF_TWINS.grid.x


@pytest.mark.parametrize(("kinds", "error"), [(("velocity", "discharge"), 0.001), (("level", "discharge"), np.nan)])
def test_the_error_of_the_grid_is_that_of_velocities(kinds: tuple[str, str], error: float) -> None:
    """With discharges, wrong by 0.02 m3/s, and levels beside them the mean of all was reported as one of mm/s."""
    station = stations_of(CASE_OF_TWINS, ("A",), 4)
    station = station.assign(kind=np.resize(kinds, len(station)))
    base = at_best(CASE_OF_TWINS, station, np.zeros(len(station)), np.zeros((len(station), 2)))
    difference = np.where(station["kind"] == "velocity", 0.001, 0.02) / constants().grid_error_share
    screening: Any = SimpleNamespace(base=replace(base, noise=with_grid_error(base.noise, difference)))
    assert estimated_errors(screening, SearchState()).grid_error == pytest.approx(error, nan_ok=True)


def test_a_place_comes_with_its_amplitude_in_the_last_model() -> None:
    """The sentence held that of its refit, and the table of parameters that of the last calibration."""
    place = an_anomaly()
    one = candidate_at(CASE_OF_TWINS, place)
    case = with_effect(CASE_OF_TWINS, one, place.shapes)
    slopes = np.zeros((12, len(case.parameters)))
    base = at_best(case, stations_of(case, ("A",), 4), np.full(12, 0.1), slopes)
    found = conclusion.as_calibrated(place, base)
    assert found.amplitude == pytest.approx(float(theta_at(case, base.fitted.point.z)[one.parameter][0]))
    assert found.amplitude != place.amplitude
    assert found.interval95[0] < found.amplitude < found.interval95[1]


def test_what_is_significant_in_the_last_model_is_kept_unless_it_is_in_it() -> None:
    """At the rate of the alarm beside what was accepted; what was accepted may be tested again."""
    chances = {"wind": 0.008, "elder": 0.02, "jet": 0.001}
    last: Any = SimpleNamespace(
        fingerprints=SimpleNamespace(candidates=[SimpleNamespace(name=name) for name in chances]),
        best_score=lambda j: [-4.0, 3.5, 5.0][j],
        effects=SimpleNamespace(p_of=lambda score: {4.0: 0.008, 3.5: 0.02, 5.0: 0.001}.get(score, 0.3)),
    )
    assert significant_effects(last, SearchState(steps=(step("jet"),))) == {"wind": 0.008}
    assert significant_effects(last, SearchState(steps=(step("jet"),)), slack=1.0) == {}


@pytest.mark.parametrize(("others", "hangs"), [(0.0, True), (6.0, False)])
def test_a_parameter_that_one_section_alone_strains_is_found(others: float, hangs: bool) -> None:
    """Section C wants it 6 standard deviations off its prior; so do the others, or they want it in the middle."""
    station, parameters = stations_of(CASE_OF_TWINS, ("A", "B", "C"), 4), len(CASE_OF_TWINS.parameters)
    slope = 0.02 * np.random.default_rng(2).standard_normal((len(station), parameters))
    slope[:, 0] = np.where(station["section"] == "C", 0.1, 0.02)
    values = slope[:, 0] * np.where(station["section"] == "C", 6.0, others)
    engine = linear_engine(lambda model: (np.zeros(len(station)), slope))
    base = at_best(CASE_OF_TWINS, station, values, slope, engine)
    name = base.model.names[0]
    assert abs(base.fitted.point.z[0]) > constants().far_off_prior
    found = conclusion.strained_without_a_section(base, name)
    assert found is None if not hangs else (found is not None and found[0] == "C" and found[1] < 0.1)


@pytest.mark.parametrize(
    ("sections", "other", "accepted", "elsewhere", "named"),
    [
        ("AB", 0.1, "wind", 1.2, True),
        ("AB", 0.0, "wind", 1.2, False),
        ("AB", 0.1, "waves", 1.2, False),
        ("AB", 0.1, "wind", 0.0, False),
        ("ABCDEF", 0.1, "wind", 1.2, True),
        ("AB", 0.006, "wind", 1.2, True),
        ("ABCDEF", 0.006, "wind", 1.2, False),
    ],
)
def test_a_name_that_one_section_alone_gives_is_found(
    sections: str, other: float, accepted: str, elsewhere: float, named: bool
) -> None:
    """The first section shows one effect, by 20 standard errors of each reading, and the second another or none; of
    many sections the other has to lead by more without the first. With all of them the first effect leads. It would be
    seen elsewhere, too: what acts in the first section alone is not asked for without it.
    """
    station = stations_of(CASE_OF_TWINS, tuple(sections), 4)
    station = station[station["experiment"] == station["experiment"].iloc[0]].reset_index(drop=True)
    first, second = ((station["section"] == name).to_numpy(float) for name in "AB")
    signs = np.where(np.arange(len(station)) % 2, 1.0, -1.0)  # across what the other does
    traces = np.column_stack([0.2 * first + 0.2 * elsewhere * signs * second, 0.1 * second])
    base = at_best(CASE_OF_TWINS, station, 0.2 * first + other * second, np.zeros((len(station), 2)))
    amplitude = Amplitude("a", "-", "", 1.0, -9.0, 9.0)
    prints: Any = SimpleNamespace(
        candidates=[SimpleNamespace(name="wind"), SimpleNamespace(name="waves")], amplitudes=[amplitude] * 2,
        columns=[np.array([0]), np.array([1])], only_sign=np.zeros(2, int), values=traces,
    )  # fmt: skip
    screening: Any = SimpleNamespace(base=base, fingerprints=prints, best_column=lambda candidate: candidate)
    found = conclusion.name_without_a_section(screening, SearchState(steps=(step(accepted),)))
    assert found == (NameHangsOnSection("wind", "A", "waves") if named else None)


def test_a_second_section_or_experiment_or_gauge_is_no_lone_section() -> None:
    station = stations_of(CASE_OF_TWINS, ("A", "B"), 4)
    alone = station[(station["section"] == "A") & (station["experiment"] == station["experiment"].iloc[0])]
    assert conclusion.only_section(alone) == OneSection("A")
    assert conclusion.only_section(station[station["section"] == "A"]) is None
    assert conclusion.only_section(station[station["experiment"] == station["experiment"].iloc[0]]) is None
    assert conclusion.only_section(alone.assign(kind="level")) is None


def test_a_misfit_is_in_the_errors_of_the_last_model() -> None:
    """In those of the first it stood beside the errors of the last, and was in neither."""
    station = stations_of(CASE_OF_TWINS, ("A",), 4)
    base = at_best(CASE_OF_TWINS, station, np.full(12, 0.1), np.zeros((12, 4)))
    first, last = (
        SimpleNamespace(base=replace(base, noise=with_correlation(base.noise, 0.0, scale))) for scale in (3.0, 2.0)
    )
    zones = misfit_of(cast("Screening", first), cast("Screening", last), ()).zones
    stated = misfit_of(cast("Screening", SimpleNamespace(base=base)), cast("Screening", SimpleNamespace(base=base)), ())
    assert 4.0 * zones["chi2"].to_numpy() == pytest.approx(stated.zones["chi2"].to_numpy())


def on_a_map(frame: Frame | None, centreline: CentrelineShape | None = None) -> Case:
    grid = CASE_OF_TWINS.grid.model_copy(update={"centreline": centreline})
    return CASE_OF_TWINS.model_copy(update={"frame": frame, "grid": grid})


@pytest.mark.parametrize(
    ("frame", "centreline", "on_map"),
    [
        (None, None, None),
        # Ten metres to the north, two to its left, which is west.
        (Frame(origin=(155000.0, 463000.0), angle=90.0), None, (154998.0, 463010.0)),
        (None, CentrelineShape(points=((5.0, 7.0), (25.0, 7.0), (65.0, 7.0))), (15.0, 9.0)),
    ],
)
def test_a_place_lies_on_the_map_if_the_case_knows_one(
    frame: Frame | None, centreline: CentrelineShape | None, on_map: tuple[float, float] | None
) -> None:
    found = list(mapped_places(on_a_map(frame, centreline), [(10.0, 2.0)]))
    assert found == ([] if on_map is None else [PlacesOnMap(((10.0, 2.0, *map(pytest.approx, on_map)),))])
    assert list(mapped_places(on_a_map(frame, centreline), [])) == []


def test_places_named_are_those_found_or_else_those_that_compete() -> None:
    rivals = (
        Rival("a", "bed", 0.5, 1.0, 2.0, 0.1),
        Rival("wind", "effect", 0.3),
        Rival("probe", "probe", 0.1, 5.0, 1.0),
    )
    assert named_places([an_anomaly()], rivals) == [(33.0, -0.6)]
    assert named_places([], rivals) == [(1.0, 2.0)]


@pytest.mark.parametrize(
    ("shares", "effects", "along"),
    [
        ((0.3, 0.5), ("streamlining",), ("streamlining",)),
        ((0.3, 0.5), ("bank_vegetation", "secondary_current"), ("bank_vegetation", "secondary_current")),
        ((0.3, 0.5), ("discharge_error", "streamlining"), ("streamlining",)),
        ((0.3,), ("streamlining",), ("streamlining",)),
        ((0.3, 0.85), ("streamlining",), ()),  # more than half of the channel
        ((0.3, 0.5), ("discharge_error",), ()),  # acts at an end
        ((0.3, 0.5), ("unlisted_object",), ()),  # at a place of its own
        ((0.3, 0.5), (), ()),
        ((), ("streamlining",), ()),
    ],
)
def test_the_measured_stretch_is_noted_if_it_is_a_small_part(
    shares: tuple[float, ...], effects: tuple[str, ...], along: tuple[str, ...]
) -> None:
    case = CASE_OF_TWINS.model_copy(update={"effects": {name: EffectEntry(values={}) for name in effects}})
    x = [WEST + share * (EAST - WEST) for share in shares]
    kinds = ["velocity"] * len(x) + ["level"] * 2
    station = pd.DataFrame({"kind": kinds, "x": [*x, WEST, EAST], "used": True})
    assert list(measured_stretch(case, station)) == (
        [MeasuredStretch(x[0], x[-1], EAST - WEST, along)] if along else []
    )
    unused = station.assign(used=station["kind"] == "level")
    assert list(measured_stretch(case, unused)) == []


@pytest.mark.slow
def test_with_a_law_instead_of_a_place_effects_are_those_of_the_model_without_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """They were those of the model with the place, beside scores, misfit and parameters of the one without."""
    model, point = coarse_twin()
    noise = noise_of(model.station)
    first = screen(Baseline(model, noise, fit(model, noise, point), None, None))
    laws = candidate_laws_of("law_bank_speed_step", chance=0.99)
    monkeypatch.setattr(conclusion, "candidate_laws", lambda *_: laws)
    held = SearchState(places=(an_anomaly(),), undecided=Undecided((), ()))
    with_place = {one: a_candidate_effect(one) for one in candidate_effects_of(first)}
    found = conclusion.assemble_diagnosis(first, first, held, with_place, None, lambda: None, silent)
    assert (found.places, found.verdict.places, found.verdict.undecided) == ((), (), ())
    assert {one.name: one for one in found.candidate_effects} == candidate_effects_of(first)


def test_cells_with_a_larger_error_than_the_readings_are_a_note() -> None:
    model, _ = coarse_twin()
    noise = noise_of(model.station)
    assert list(cells_too_coarse(noise, model.station)) == []
    velocity = velocity_rows(model.station.iloc[noise.rows])
    coarse = replace(noise, grid_error=np.where(velocity, 2.0 * noise.error, 0.0))
    (found,) = cells_too_coarse(coarse, model.station)
    assert found.grid_error == pytest.approx(2.0 * found.data_error)
    # An error of the cells in levels alone is none in velocities.
    assert list(cells_too_coarse(replace(noise, grid_error=np.where(velocity, 0.0, 1.0)), model.station)) == []


def test_more_mixing_where_deep_and_shallow_water_meet_is_a_shear_layer() -> None:
    """On a bank, not in the middle of the floor nor beside land, and no other term nor less mixing."""
    model, point = coarse_twin()
    depth = np.asarray(flow_at_centres(model, point, next(iter(point.flows))).depth)
    grid, column = model.site.grid, depth.shape[0] // 2
    x, (land, edge, middle) = float(grid.x[column]), (float(grid.y[j]) for j in (1, 4, grid.y.size // 2))
    reach = 2.0 * grid.dy
    expected = depth[column, np.abs(grid.y - edge) <= reach]
    mixing = an_anomaly(x=x, y=edge, width=reach, term="viscosity", amplitude=0.02)
    there = (mixing, replace(mixing, amplitude=-0.02), replace(mixing, term="drag"))
    there += tuple(replace(mixing, y=y) for y in (middle, land))
    (found,) = shear_layers(model, point, there)
    assert (found.x, found.y) == (x, edge)
    assert found.deep >= 2.0 * found.shallow
    assert found.deep >= expected.max()
    assert found.shallow > least_depth(model)  # a dry cell is no shallow water


def test_a_fault_of_the_probes_near_the_inflow_may_be_an_inflow_that_develops() -> None:
    """The only section within 76 depths, and no fault of any other kind."""
    model, _ = coarse_twin()
    velocity = model.station[velocity_rows(model.station)]
    first = velocity.groupby("section")["x"].mean()
    depth, near = site_scales(model.case, model.site).depth, str(first.idxmin())
    (found,) = inflow_develops(model, [f"probe_gain[{near}]", "elder"])
    assert found.distance == pytest.approx(first.min() - model.case.grid.x[0])
    assert found.depths == pytest.approx(found.distance / depth)
    far = model.station.assign(x=model.station["x"] + 100.0 * depth)
    assert list(inflow_develops(replace(model, station=far), [f"probe_gain[{near}]"])) == []


@pytest.mark.parametrize(("share", "kept"), [(0.5, "inflow"), (3.0, "bed")])
def test_no_more_water_enters_over_a_field_than_flows(monkeypatch: pytest.MonkeyPatch, share: float, kept: str) -> None:
    """Water that enters, in m/s, was compared with a discharge in m3/s: no field of it was ever impossible."""
    model, point = coarse_twin()
    grid, discharge = model.site.grid, site_scales(model.case, model.site).discharge
    area = grid.dx * grid.x.size * grid.dy * grid.y.size
    value = np.full((grid.x.size, grid.y.size), share * discharge / area)
    over = gaussian_basis(grid, 1.5, 1.5)
    fields = [FieldHypothesis("inflow", over, 1e-3, 50.0), FieldHypothesis("bed", over, 0.05, 50.0)]
    maps = {
        "inflow": FieldMap(value, 0.1 * value, (share * discharge, 0.1 * discharge)),
        "bed": FieldMap(0.1 * np.ones_like(value), 0.01 * np.ones_like(value), (0.1 * area, 0.01 * area)),
    }
    monkeypatch.setattr(conclusion, "fields_by_evidence", lambda *_: (fields, SimpleNamespace(grid=grid)))
    monkeypatch.setattr(conclusion, "map_of_field", lambda _search, _responses, one: maps[one.term])
    search: Any = SimpleNamespace(model=model, point=point)
    screening: Any = SimpleNamespace(search=search, base=SimpleNamespace(model=model))
    misfit: Any = SimpleNamespace(p=0.0)
    found, _ = conclusion.explaining_field(screening, screening, SearchState(), misfit)
    assert found is not None
    assert found.term == kept
