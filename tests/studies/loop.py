"""Measured speed of the loop on an imported case: small ensembles, and every step of `vegglue run`.

Also by itself, with other sizes of ensembles: python tests/studies/loop.py 64 256
"""

import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import vegglue

WILLOWS = Path(__file__).parents[2] / "data" / "open_cases" / "open-b"
# Members of the ensembles.
SIZES = (32, 64, 256)


def seconds_of(words: str, work: Callable[[], Any]) -> Any:
    """What the work gives, its wall time and the processor time of this process told."""
    began, used = time.perf_counter(), time.process_time()
    found = work()
    wall, own = time.perf_counter() - began, time.process_time() - used
    print(f"{words}: {wall:.1f} s, {own:.1f} s of this process", flush=True)
    return found


def main(sizes: tuple[int, ...] = SIZES) -> None:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        case = vegglue.import_folder(WILLOWS, folder / "willows.yaml")
        for members in sizes:
            words = f"{members} members x {len(case.experiments)} experiments, all cores"
            seconds_of(words, partial(vegglue.simulate, case, runs=folder / f"of-{members}", members=members))
        alone = folder / "alone"
        seconds_of("diagnose", partial(vegglue.diagnose, case, runs=alone))
        seconds_of("infer to 1,000 effective draws", partial(vegglue.infer, case, runs=alone))
        seconds_of("report", partial(vegglue.report, case, runs=alone))
        seconds_of("run, the whole way", partial(vegglue.run, case, runs=folder / "whole"))


if __name__ == "__main__":
    main(tuple(int(size) for size in sys.argv[1:]) or SIZES)
