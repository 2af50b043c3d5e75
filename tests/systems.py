"""What a test needs of the system."""

import os

import pytest

# Windows has neither pipes in folders nor signals, and makes links for administrators only.
POSIX_ALONE = pytest.mark.skipif(not hasattr(os, "fork"), reason="of POSIX alone: links, pipes and signals")
# tests/_without_posix imports libraries that look for what it hides.
NOT_SIMULATED = pytest.mark.skipif(
    "_without_posix" in os.environ.get("PYTHONPATH", ""), reason="the simulated Windows imports libraries itself"
)
