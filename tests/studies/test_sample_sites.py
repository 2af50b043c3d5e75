"""The folders in data/samples are what their script makes."""

from pathlib import Path

import pytest
from sample_sites import BEND, FLUME, WRITERS


@pytest.mark.slow
@pytest.mark.parametrize("folder", [BEND, FLUME], ids=lambda folder: folder.name)
def test_a_sample_is_what_its_script_makes(tmp_path: Path, folder: Path) -> None:
    """Word for word but for numbers, whose last digits another machine may have otherwise."""
    WRITERS[folder](tmp_path)
    names = sorted(path.name for path in folder.iterdir())
    assert sorted(path.name for path in tmp_path.iterdir()) == names
    for name in names:
        made, kept = ((where / name).read_text(encoding="utf-8").split() for where in (tmp_path, folder))
        assert len(made) == len(kept), name
        assert sum(one != other for one, other in zip(made, kept, strict=True)) <= 0.001 * len(kept), name
