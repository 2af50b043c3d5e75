"""A refined posterior of the short reach of docs/own_case.md, made as a user would; no test changes it."""

import pytest
from built_models import model_of
from refined_reach import FEW_MEMBERS, STATED_ERRORS, SolvedReach, solved_reach

from vegglue.calibration.noise import Noise
from vegglue.inference.posterior_modes import members_of, modes_and_errors
from vegglue.inference.refine import refine
from vegglue.parallel import at_most
from vegglue.progress import silent
from vegglue.results.posterior import Posterior


@pytest.fixture(scope="session")
def reach(tmp_path_factory: pytest.TempPathFactory) -> SolvedReach:
    return solved_reach(tmp_path_factory.mktemp("known"), FEW_MEMBERS, STATED_ERRORS)


@pytest.fixture(scope="session")
def refined(reach: SolvedReach) -> Posterior:
    case, observations, ensemble = reach
    with at_most(1):
        return refine(ensemble, model_of(case, observations))


@pytest.fixture(scope="session")
def noise(reach: SolvedReach) -> Noise:
    case, observations, ensemble = reach
    model = model_of(case, observations)
    return modes_and_errors(model, members_of(ensemble, model), "known", watch=silent).noise
