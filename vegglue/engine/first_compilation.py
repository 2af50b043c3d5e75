"""How a fresh machine compiles: a second process compiles other loops while the command compiles the residual, which
takes half of all time.

Each process keeps what it compiles and takes from there what is kept. Nothing depends on the second one, which may be
killed or never start.
"""

import os
import subprocess
import sys
import threading
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import vegglue
from vegglue.compilation import compile_for
from vegglue.engine.newton import sum_windows
from vegglue.flow import anderson, batch, block_elimination, kernels, thin_water
from vegglue.parallel import cores_allowed

COMPILER = (
    "import sys; sys.path.append(sys.argv[1]); "
    "from vegglue.engine.first_compilation import compile_others; compile_others()"
)
# Arrays of doubles, singles, integers and truth values by their number of axes, all contiguous.
D2, D3, D4 = "f8[:,::1]", "f8[:,:,::1]", "f8[:,:,:,::1]"
S2, S3, S4, S5 = "f4[:,::1]", "f4[:,:,::1]", "f4[:,:,:,::1]", "f4[:,:,:,:,::1]"
I1, I2, B1, B3 = "i8[::1]", "i8[:,::1]", "b1[::1]", "b1[:,:,::1]"
WETTING = (D2, D3, D2, "f8")
# What a diagnosis on a straight grid gives its loops: the one that it needs just before the residual, then those after
# it, the last one first, so that command and second process meet once and never compile the same loops in step.
COMPILED_BESIDE: tuple[tuple[Any, tuple[str, ...]], ...] = (
    (thin_water.friction_slope, (D4, D3, D3, D2)),
    (kernels.push, (D4, D3, D3, D3, D3, D3, D3, "f8", "f8", "f8", "none")),
    (sum_windows, (S4, S4, S3)),
    (block_elimination.solve_transposed, (S4, S2, S3)),
    (anderson.mix, (D4, S4, S5, D2)),
    (anderson.remember, (S5, S5, "i8", S4, S4, S4)),
    (thin_water.correction, (S4, D4, B3, *WETTING, D3)),
    (thin_water.tilt, (S4, D3)),
    (thin_water.stretch, (D4, D4, B3, *WETTING, D3, "f8", "b1")),
    (thin_water.thin_cells_and_faces, (D4, *WETTING, D3)),
    (thin_water.answers, (D4, *WETTING, D3)),
    (block_elimination.solve, (S4, S2, S3)),
    (thin_water.ease, (D4, D4, D3, D3, D2, D4, "f8", B1)),
    (block_elimination.factor, (S4, S2)),
    (block_elimination.collect, (S4, S2, D3, D4, I2, "f8")),
    (batch.blend, (D4, I1, D2, "i8", "i8")),  # of ensembles only
    (batch.put_rows, (D4, I1, B1, D4, "i8", "i8")),
)


@cache
def compile_beside() -> None:
    """Start the second process, once, if a second core may be used."""
    if cores_allowed() < 2:
        return
    command = [sys.executable, "-P", "-c", COMPILER, str(Path(vegglue.__file__).parents[1])]

    def attend() -> None:  # so that no zombie is left, and its input stays open as long as the command runs
        none = subprocess.DEVNULL
        with suppress(OSError), subprocess.Popen(command, stdin=subprocess.PIPE, stdout=none, stderr=none) as child:
            child.wait()

    threading.Thread(target=attend, daemon=True).start()


def compile_others() -> None:
    """Compile what of COMPILED_BESIDE is not kept, in a process that ends with its parent, however that ends."""

    def follow() -> None:
        os.read(0, 1)  # nothing comes before the end of the parent closes it
        os._exit(0)

    threading.Thread(target=follow, daemon=True).start()
    for loop, types in COMPILED_BESIDE:
        compile_for(loop, *types)
