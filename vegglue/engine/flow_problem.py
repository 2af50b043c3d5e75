"""The flow problem of a model at points of its prior, for engines that solve the shallow-water equations themselves."""

from vegglue.arrays import Array
from vegglue.case.parameter_space import theta_at
from vegglue.engine.interface import Model
from vegglue.flow.problem import Problem
from vegglue.flow.problem_setup import build_problem


def problem_at(model: Model, experiment: str, z: Array) -> Problem:
    """The flow problem of one experiment at z, (p,) or (m, p)."""
    return build_problem(model.case, model.site, experiment, theta_at(model.case, z))
