"""What a test needs of the system."""

import os

import pytest

# Windows has neither pipes in folders nor signals, and makes links for administrators only.
POSIX_ALONE = pytest.mark.skipif(not hasattr(os, "fork"), reason="of POSIX alone: links, pipes and signals")
