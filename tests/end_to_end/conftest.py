"""What tests of the open cases share."""

from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One folder for all tests of a file: what one has diagnosed there, the next one reads."""
    return tmp_path_factory.mktemp("campaigns")
