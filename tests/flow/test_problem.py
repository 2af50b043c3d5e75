"""What a problem is given."""

import re
from dataclasses import MISSING, fields
from pathlib import Path

import pytest
from house import FILES
from reach import COARSE, write_reach

from vegglue.case.channel_geometry import expected_depth
from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import sample_prior
from vegglue.case.schema import Numerics
from vegglue.flow.problem import BedFriction, Problem
from vegglue.flow.problem_setup import build_problem


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
