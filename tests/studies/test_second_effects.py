"""Effects of the second solver, coded from the same equations, against those of the library."""

from dataclasses import replace

import numpy as np
import pytest
from blind_sets import OBJECTS, model_of
from blind_truth import perfect_site, true_values

from vegglue.calibration.candidates import candidates_of
from vegglue.case.parameter_space import theta_at
from vegglue.engine.interface import linearise
from vegglue.workflow.hidden_effect import Hidden, candidate_of, case_hiding, true_place

# One of each kind: bed, inflow, plants, drag, mixing, momentum flux, force, instrument, and something in no list.
SOME = (
    "flank_scour", "inflow_skew", "canopy_deflection", "bank_vegetation", "edge_mixing", "elder", "growing_shear_layer",
    "secondary_current", "panel_current", "partial_depth", "unlisted:fallen_tree",
)  # fmt: skip


@pytest.fixture(scope="module")
def short():
    """The model of the short channel in one experiment, its true parameters, and its point there."""
    model = model_of("twin")
    only = model.station["experiment"] == "mid"
    case = model.case.model_copy(update={"experiments": {"mid": model.case.experiments["mid"]}})
    model = replace(model, case=case, station=model.station[only].reset_index(drop=True))
    z = true_place(len(model.names), 0)
    theta = {name: float(values[0]) for name, values in theta_at(case, z).items()}
    point = linearise(model, z)
    assert point is not None
    return model, theta, point


@pytest.fixture(scope="module")
def plain(short):
    return seen(short, {})


def seen(short, hidden):
    model, theta, _ = short
    site = perfect_site(model.case, "twin", theta, len(model.station))
    return true_values(site, model.case, "twin", model.station, hidden)


def numbers_of(model, name):
    """Half a plausible amplitude, and shapes between those that a search tries."""
    candidate = candidate_of(model, name)
    amplitude = candidate.effect.amplitude
    shapes = {one.name: float(np.mean(one.grid)) if one.grid else one.default for one in candidate.effect.shapes}
    shapes |= {"x": 15.0, "y": 0.5} if name.startswith("unlisted") else dict(candidate.fixed)
    return candidate, amplitude.off + 0.5 * amplitude.scale, shapes


@pytest.mark.slow
def test_where_nothing_is_hidden_both_codes_agree(short, plain):
    """0.003 m/s, a third of the error of a probe; no number was fitted to the other."""
    model, _, point = short
    velocity = (model.station["kind"] == "velocity").to_numpy()
    error = (plain - point.prediction)[velocity]
    assert np.sqrt(np.mean(error**2)) < 0.004


@pytest.mark.slow
@pytest.mark.parametrize("name", SOME)
def test_both_codes_change_the_flow_alike(name, short, plain):
    model, _, point = short
    candidate, amplitude, shapes = numbers_of(model, name)
    case = case_hiding(model.case, candidate, Hidden(name, amplitude, shapes, 0.0))
    with_it = linearise(replace(model, case=case), point.z, point)
    assert with_it is not None
    ours = with_it.prediction - point.prediction
    theirs = seen(short, {name: {candidate.effect.amplitude.name: amplitude, **shapes}}) - plain
    assert ours @ theirs > 0.98 * np.linalg.norm(ours) * np.linalg.norm(theirs)
    assert np.linalg.norm(theirs) == pytest.approx(np.linalg.norm(ours), rel=0.15)


@pytest.mark.parametrize("study", ["twin", "campaign"])
def test_no_listed_effect_is_left_out(study, monkeypatch):
    """Each is taken by the second solver, or by what reads its flow; a name that nobody knows is refused."""
    model = model_of(study)
    names = [one.name for one in candidates_of(model.case, model.station)]
    names += [f"unlisted:{name}" for name in OBJECTS]
    called = []

    def flow(truth, discharge, level, cells, change, start=None):
        called.append((truth, discharge, level))
        raise ZeroDivisionError

    monkeypatch.setattr("blind_truth.steady_flow", flow)
    theta = {"n_b": 0.03, "k_s": 0.5, "phi": 2.0, "canopy_height": 0.7, "eddy_viscosity": 0.01}
    site = perfect_site(model.case, study, theta, len(model.station))
    for name in names:
        candidate, amplitude, shapes = numbers_of(model, name)
        with pytest.raises(ZeroDivisionError):
            true_values(
                site, model.case, study, model.station, {name: {candidate.effect.amplitude.name: amplitude, **shapes}}
            )
    with pytest.raises(ValueError, match="no such effect"):
        true_values(site, model.case, study, model.station, {"moonlight": {"strength": 1.0}})
    assert len(called) == len(names)
