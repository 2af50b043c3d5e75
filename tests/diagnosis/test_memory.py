"""Cores and factors within the memory that a diagnosis may use."""

import pytest
from coarse_twin import coarse_twin

from vegglue.diagnosis.diagnose import GIGABYTE, jobs_in_memory
from vegglue.errors import InputError
from vegglue.flow import nested_dissection


def test_as_many_cores_as_the_memory_has_room_for() -> None:
    model, _ = coarse_twin()
    assert jobs_in_memory(model, 4, 16.0 * GIGABYTE) == 4
    fewer = [jobs_in_memory(model, 1000, allowed * GIGABYTE) for allowed in (0.6, 1.0, 3.0)]
    assert 1 <= fewer[0] < fewer[1] < fewer[2] <= 1000
    assert nested_dissection.MOST_BYTES >= nested_dissection._most_bytes >= 0.0


def test_too_little_memory_is_refused_with_what_it_needs() -> None:
    model, _ = coarse_twin()
    nx, ny = model.site.bed.shape
    with pytest.raises(InputError, match=rf"{nx} x {ny} cells .* GB"):
        jobs_in_memory(model, 1, 0.3 * GIGABYTE)
