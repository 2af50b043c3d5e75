"""Problems side by side: each member has the residual that it has alone, whatever acts in the others."""

from pathlib import Path

import numpy as np
from reach import COARSE, write_reach

from vegglue.calibration.candidates import candidates_of, cause_of
from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import sample_prior
from vegglue.flow.equations import residual
from vegglue.flow.problem import Problem, joined
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.starts import backwater
from vegglue.measurements.observations import read_observations


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
