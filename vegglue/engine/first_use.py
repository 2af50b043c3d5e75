"""What a command says where the loops of the solver are yet to be compiled: once for a machine and a version."""

from vegglue.compilation import is_kept
from vegglue.flow.block_elimination import solve


def with_compilation(phase: str) -> str:
    """The phase of a command that solves flows, and that it compiles first where no earlier process did.

    25 s of a core for a diagnosis were measured, 64 s on a busy machine; then nothing seems to move.
    """
    if solve.signatures or is_kept(solve):
        return phase
    return f"{phase} (compiling the solver for this machine first, once: up to a minute)"
