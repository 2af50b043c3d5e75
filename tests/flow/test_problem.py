"""What a problem is given, and problems side by side: each member has the residual that it has alone."""

import re
from dataclasses import MISSING, fields
from pathlib import Path

import numpy as np
import pytest
from house import FILES
from marching_engine import joined
from reach import COARSE, write_reach

from vegglue.calibration.candidates import candidates_of, cause_of
from vegglue.case.channel_geometry import expected_depth
from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import sample_prior
from vegglue.case.schema import Numerics
from vegglue.flow.equations import residual
from vegglue.flow.problem import BedFriction, Problem
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.starts import backwater
from vegglue.measurements.observations import read_observations


def test_choices_of_the_solver_have_their_defaults_in_the_schema() -> None:
    default = {item.name: item.default for kind in (Problem, BedFriction) for item in fields(kind)}
    assert default["film"] is default["bank_argument_minimum"] is MISSING
    assert (Numerics().film_depth, Numerics().bank_argument_minimum) == (0.01, 1.3)


def test_what_stays_on_dry_land_is_written_once() -> None:
    again = re.compile(r"(0\.1|1e-1) \* (\w+\.)?film|film(_depth)? / 10")
    assert [str(path) for path in FILES if again.search(path.read_text(encoding="utf-8"))] == []


def test_what_enters_all_along_does_so_where_there_is_water(tmp_path: Path) -> None:
    """Sides flatter than a bank are floor: in a V half of the inflow went over land, and was lost."""
    flat = ("top_width: 9, bank_slope: 0.5", "top_width: 30, bank_slope: 0.15")
    seeping = ("observations:\n", "effects:\n  lateral_inflow: {values: {share: 0.3}}\nobservations:\n")
    low = ("level: 0.95", "level: 0.3")
    case = load_case(write_reach(tmp_path, COARSE, flat, seeping, low, ("bottom_width: 3", "bottom_width: 0.5")))
    site = build_site(case)
    problem = build_problem(case, site, "June", sample_prior(case.parameters, 1, 1))
    entering = problem.boundaries.lateral_inflow[..., 0]
    assert entering.sum() * problem.dx * problem.dy == pytest.approx(0.3 * 2.0)
    land = expected_depth(case, site, case.experiments["June"]) <= 0.0
    assert land.any()
    assert entering[land].max() == 0.0


def with_each_cause(folder: Path) -> list[Problem]:
    """The brook, of two members, with each cause that could act in it, and without any in the end."""
    case = load_case(write_reach(folder, COARSE))
    site, theta = build_site(case), sample_prior(case.parameters, 2, 1)
    found = []
    for one in candidates_of(case, read_observations(case).table):
        for shapes in one.settings():
            cause = cause_of(case, one, shapes)
            size = cause.amplitude.off + cause.amplitude.small
            found.append(build_problem(cause.case, site, "June", theta | {cause.parameter: np.full(2, size)}))
    return [*found, build_problem(case, site, "June", theta)]


def test_each_member_keeps_its_residual(tmp_path: Path) -> None:
    problems = with_each_cause(tmp_path)
    together = joined(problems)
    assert len(problems) > 30
    assert together.members == 2 * len(problems)
    states = [backwater(one) for one in problems]
    alone = [residual(one, state) for one, state in zip(problems, states, strict=True)]
    found = residual(together, np.concatenate(states, axis=3))
    assert np.abs(found - np.concatenate(alone, axis=3)).max() < 1e-12 * np.abs(found).max()
