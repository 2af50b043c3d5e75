"""What tests of the report share: a run of the synthetic record and one of a toy case, each with its page."""

import pytest
from report_runs import a_toy, kict, written

from vegglue.pages.run import Run


@pytest.fixture(scope="module")
def d3a(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, str]:
    run = kict(tmp_path_factory.mktemp("d3a"), "d3a")
    return run, written(run)


@pytest.fixture(scope="module")
def toy(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, str]:
    run = a_toy(tmp_path_factory.mktemp("toy"))
    return run, written(run)
