"""Has the loops of the solver compiled before the tests begin: `python tests/compiled_loops.py`.

Processes that begin side by side would compile them each for itself, for most of a minute of a core.
"""

from dataclasses import replace

from coarse_twin import coarse_twin

from vegglue.compilation import is_kept
from vegglue.diagnosis.diagnose import diagnose_model
from vegglue.flow.block_elimination import solve
from vegglue.parallel import at_most, one_thread


@one_thread()
def compile_loops() -> None:
    """By what needs most of them: a diagnosis."""
    model, point = coarse_twin()
    with at_most(1):
        diagnose_model(replace(model, station=model.station.assign(value=point.prediction)))


if __name__ == "__main__" and not is_kept(solve):
    compile_loops()
