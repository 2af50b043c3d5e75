"""Remarks on patches, bed, friction classes, canopies, parameters and the ensemble."""

import numpy as np
import pytest
from sound_case import ROWS, SOUND, found_in, odd, read_case

from vegglue.case.channel_geometry import expected_depth
from vegglue.case.zones import distance_to_outline
from vegglue.diagnosis.channel_check import (
    BankLawHeld,
    BeyondGrid,
    CanopyEmergent,
    ErrorsRefused,
    ExperimentUnmeasured,
    FewerObservationsThanParameters,
    FewMembers,
    FloorRises,
    FrictionClassUnused,
    MembersNoPowerOfTwo,
    NoObservations,
    NoParameters,
    ParameterIdle,
    PatchAreaMissed,
    PatchHidden,
    PatchInPartialCells,
    PatchWithoutCells,
    StandDry,
    StandUnused,
    UnitOfPrior,
)

ONE_MORE = "stems: 22}\n    - {name: p2, stand: reed, x: [13, 20], y: [0, 1], stems: 1}\ninflows"
PARTLY = BeyondGrid("y", (4.0, 9.0), (-5.0, 5.0), False)
CANOPY = {"stand": "reed", "height": (1.3, 1.3), "experiments": ("low",), "always": True, "emergent": "constant"}
OBSERVED = "observations:\n  - {kind: velocity, file: velocities.csv}\n"


@pytest.mark.parametrize(
    ("old", "new", "remark", "expected"),
    [
        ("members: 1024", "members: 64}\ninfer: {method: glue", FewMembers, {"members": 64}),
        ("members: 1024", "members: 1000", MembersNoPowerOfTwo, {"members": 1000, "nearest": 1024}),
        ("y: [0, 1.5], stems", "y: [0.1, 0.2], stems", PatchInPartialCells, {"patch": "p1"}),
        (
            "y: [0, 1.5], stems", "y: [4, 9], stems", PatchAreaMissed,
            {"patch": "p1", "area": 20.0, "covered": 4.0, "beyond": PARTLY},
        ),
        ("stems: 22}\ninflows", ONE_MORE, PatchHidden, {"patch": "p1", "cells": 2}),
        ("reed: {phi", "sedge: {phi: 1, canopy_height: 0.5}\n    reed: {phi", StandUnused, {"stand": "sedge"}),
        ("beyond_slope_break: 0.2", "beyond_slope_break: 2", FrictionClassUnused, {"friction_class": "bank"}),
        ("level: 1.0}", "level: 1.0, plants: false}", ParameterIdle, {"parameter": "phi", "in_engine": False}),
        ("n: n_b}", "n: n_b}\n    mud: {law: manning, n: 0.1}", FrictionClassUnused, {"friction_class": "mud"}),
        ("canopy_height: 0.8", "canopy_height: 1.3", CanopyEmergent, CANOPY),
        ("canopy_height: 0.8", "canopy_height: h_d", CanopyEmergent, {"height": (0.7175, 1.3825), "always": False}),
        ("y: [0, 1.5], stems", "y: [4, 4.9], stems", StandDry, {"stand": "reed", "experiment": "low"}),
        (
            "k_s: 0.5", "k_s: 5", BankLawHeld,
            {"friction_class": "bank", "k_s": 5.0, "up_to": False, "depth": 0.545, "shares": (("low", 0.5),)},
        ),
        ("bed_slope: 0.001", "bed_slope: -0.001", FloorRises, {"rise": 0.04, "slope": -0.001}),
        (
            "discharge: 2.0, level: 1.0}", "discharge: 2.0, level: 1.0}\n  high: {discharge: 2, level: 1.1}",
            ExperimentUnmeasured, {"experiment": "high"},
        ),
        (OBSERVED, "", NoObservations, {}),
    ],
)  # fmt: skip
def test_an_oddity_is_a_remark(tmp_path, old, new, remark, expected):
    assert old in SOUND
    text = SOUND.replace(old, new)
    if "h_d" in new:
        text = text.replace(
            "parameters:\n", "parameters:\n  h_d: {distribution: uniform, low: 0.7, high: 1.4, unit: m}\n"
        )
    found = odd(tmp_path, text)
    assert len(found_in(found, remark, **expected)) == 1, found


def test_a_case_without_priors_is_one_that_no_command_takes(tmp_path):
    text = SOUND.partition("parameters:")[0].replace("n: n_b", "n: 0.03").replace("phi: phi", "phi: 1")
    assert found_in(odd(tmp_path, f"{text}{OBSERVED}simulate: {{members: 1024}}\n"), NoParameters)


def test_a_patch_on_the_map_is_one_without_cells(tmp_path):
    patch = SOUND.index("x: [", SOUND.index("patches"))
    west, east = SOUND[patch:].split("[")[1].split("]")[0].split(",")
    on_map = SOUND[:patch] + SOUND[patch:].replace(
        f"x: [{west},{east}]", f"x: [{1000 + int(west)}, {1000 + int(east)}]", 1
    )
    on_map = on_map.replace("y: [0, 1.5], stems", "y: [2000, 2001.5], stems")
    framed = on_map + "frame: {origin: [1000, 2000], angle: 0}\n"
    assert found_in(odd(tmp_path, framed), PatchWithoutCells, patch="p1", on_map=True)
    beyond = BeyondGrid("x", (1010.0, 1014.0), (0.0, 40.0), True)
    assert found_in(odd(tmp_path, on_map), PatchWithoutCells, patch="p1", on_map=False, beyond=beyond)


@pytest.mark.parametrize(
    ("high", "experiments", "depths"), [("1.1", ("low", "high"), (1.03, 1.13)), ("1.5", ("low",), (1.03,))]
)
def test_a_canopy_above_the_water_is_one_remark(tmp_path, high, experiments, depths):
    text = SOUND.replace("level: 1.0}", f"level: 1.0}}\n  high: {{discharge: 2.0, level: {high}}}")
    (one,) = found_in(odd(tmp_path, text.replace("height: 0.8", "height: 1.3")), CanopyEmergent)
    assert one.experiments == experiments
    assert one.depths == pytest.approx(depths, abs=0.02)


def test_a_prior_in_another_unit_than_its_effect(tmp_path):
    prior = "  d: {distribution: uniform, low: -0.1, high: 0.1, unit: cm/s}\n"
    text = SOUND.replace("observations:", prior + "effects:\n  zero_offset: {values: {offset: d}}\nobservations:")
    assert found_in(odd(tmp_path, text), UnitOfPrior) == [UnitOfPrior("d", "cm/s", "zero_offset", "offset", "m/s")]
    assert odd(tmp_path, text.replace("cm/s", "m/s")) == []


def test_stations_without_error_cannot_be_weighed_by_it(tmp_path):
    text = SOUND.replace("members: 1024}", "members: 1024}\ninfer: {sigma: known}")
    assert odd(tmp_path, text) == []
    (one,) = odd(tmp_path, text, ROWS.replace(",u_se", "").replace(",0.01\n", "\n"))
    assert found_in([one], ErrorsRefused, commands=("infer", "diagnose", "run"))
    assert one.unstated.counts == (("velocity", 3),)


def test_too_few_observations(tmp_path):
    assert odd(tmp_path, rows="\n".join(ROWS.splitlines()[:2]) + "\n") == [FewerObservationsThanParameters(1, 2)]


def test_the_expected_water_is_parallel_to_the_floor_and_nowhere_below_the_outlet(tmp_path):
    case, site, _ = read_case(tmp_path)
    depth = expected_depth(case, site, case.experiments["low"])
    # z_out = 1 m over a floor at -0.0395 m in the last cell.
    assert depth.max(axis=1) == pytest.approx(1.0395)
    rising = site.__class__(site.grid, site.bed[::-1], site.friction_class, site.class_names, site.patch, site.cover)
    assert (rising.bed + expected_depth(case, rising, case.experiments["low"])).min() == pytest.approx(1.0)


@pytest.mark.parametrize(("x", "y", "expected"), [(1, 0.2, 0.2), (3, 2, 0.0), (-3, 4, 3.6055512754639896), (5, 1, 2.0)])
def test_distance_to_an_outline_whose_corners_may_coincide(x, y, expected):
    for outline in ([[0, 0], [3, 0], [3, 2], [0, 2]], [[0, 0], [3, 0], [3, 0], [3, 2], [0, 2], [0, 0]]):
        assert distance_to_outline(np.array(outline, dtype=float), x, y) == pytest.approx(expected)
