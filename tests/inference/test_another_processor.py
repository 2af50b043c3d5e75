"""The same members with loops and linear algebra made for another kind of processor: the same to below any error."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from reach import COARSE, ENVIRONMENT, command, write_reach

from vegglue.results.result_files import read_ensemble

# Without the vector units and the fused products of this machine's processor; compiled anew in half a minute of a core,
# and hardly optimised: no flag of the loops lets that round otherwise, predictions are the same to the last bit.
ANOTHER = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_OPT": "1", "OPENBLAS_CORETYPE": "Prescott"}
# Of predictions [m/s, m]. Measured on x86: 3e-11. The solver stops at a relative residual of 1e-8, and another order of
# rounding may stop it one step sooner or later.
FARTHEST = 1e-7
MEMBERS = 32


def simulate(folder: Path, runs: str, processor: dict[str, str]) -> None:
    """The members into a folder of runs. No limit of time: all loops may have to be compiled, on a machine at work."""
    arguments = command("simulate", "brook.yaml", "--members", MEMBERS, "--jobs", 1, "--runs", runs)
    subprocess.run(arguments, cwd=folder, env=ENVIRONMENT | processor, check=True, stdout=subprocess.DEVNULL)


@pytest.mark.slow
def test_another_kind_of_processor_predicts_the_same_to_within_a_bound(tmp_path: Path) -> None:
    write_reach(tmp_path, COARSE)
    simulate(tmp_path, "here", {})
    simulate(tmp_path, "there", ANOTHER | {"NUMBA_CACHE_DIR": str(tmp_path / "loops")})
    assert list((tmp_path / "loops").iterdir()), "loops were compiled anew"
    here, there = (read_ensemble(tmp_path / runs / "brook" / "ensemble.h5") for runs in ("here", "there"))
    np.testing.assert_array_equal(here.status, there.status)
    for one, other in ((here.prediction, there.prediction), (here.section_flow, there.section_flow)):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=FARTHEST)
