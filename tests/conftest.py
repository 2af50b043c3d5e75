"""What all tests share."""

from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_limits


@pytest.fixture(scope="session", autouse=True)
def _one_thread_of_linear_algebra() -> Iterator[None]:
    """Blocks are small: threads of linear algebra would only wait for each other, here as in `simulate`."""
    with threadpool_limits(1):
        yield
