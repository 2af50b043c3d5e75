"""Coverage-guided fuzzing of the readers, for as long as it is let: `make fuzz MINUTES=60`.

Needs atheris (`pip install atheris`, Python up to 3.11); without it, files are edited at random and nothing guides.
With --results it is results in HDF5 that are edited at random: their contents behind a right digest, or their bytes.
What fails is kept in runs/fuzz, one file each, beside the seeds; runs/fuzz/tally counts files and failures.
"""

import argparse
import random
import shutil
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

try:
    import atheris

    with atheris.instrument_imports(include=["vegglue", "yaml"]):
        from untrusted import READERS, SNIPPETS, edited, outcome
except ImportError:
    atheris = None
    from untrusted import READERS, SNIPPETS, edited, outcome

KEPT = Path("runs") / "fuzz"
SLOW = 10.0  # [s] of one file: a hang, or nearly
TOLD_EVERY = 500  # files
CONTENTS = 0.8  # share of results that keep a right digest: one without begins a process


def tried(data: bytes, folder: Path, found: Counter[str]) -> None:
    """One file, its first byte the reader; what it raises is kept once for each place it is raised at."""
    reader = READERS[data[0] % len(READERS)]
    failed = failure(lambda: outcome(reader, folder, data[1:]))
    counted(reader.name, failed, data[1:], found)


def failure(read: Callable[[], object]) -> str:
    """What went wrong and where, nothing where a file was read or refused in time."""
    began = time.process_time()
    try:
        read()
    except Exception as error:  # whatever a reader may raise: that is what is looked for
        last = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}-{Path(last.filename).stem}-{last.lineno}"
    return "slow" if time.process_time() - began > SLOW else ""


def counted(name: str, failed: str, content: bytes, found: Counter[str]) -> None:
    found["files"] += 1
    if found["files"] % TOLD_EVERY == 0:  # libFuzzer ends the process itself
        (KEPT / "tally").write_text(", ".join(f"{number:,} {name}" for name, number in found.items()), encoding="utf-8")
    if failed:
        found[failed] += 1
        if found[failed] == 1:
            (KEPT / f"{name}-{failed}").write_bytes(content)
            print(f"{name}: {failed}", flush=True)


def results_at_random(folder: Path, found: Counter[str], until: float, chance: random.Random) -> None:
    """Results with another array or word in one place, or with one to three places of their bytes damaged."""
    from damaged_results import (
        OF_VALUES,
        OF_WORDS,
        RESULTS,
        change_content,
        damaged,
        places_in,
        sentence_of,
        without_digest,
    )

    whole = folder / "whole"
    whole.mkdir()
    for kept in RESULTS:
        kept.write(whole / kept.name)
    warnings.simplefilter("error")  # a user would see them
    while time.monotonic() < until:
        kept = chance.choice(RESULTS)
        path = Path(tempfile.mkdtemp(dir=folder)) / kept.name
        path.write_bytes((whole / kept.name).read_bytes())
        if chance.random() < CONTENTS:
            place, value = chance.choice(places_in(path)), chance.choice(list(OF_VALUES.values()))
            change_content(path, place, value, chance.choice(OF_WORDS))
        else:
            ways = [
                (chance.random(), chance.choice(("bit", "zeros", "ones", "cut"))) for _ in range(chance.randint(1, 3))
            ]
            path.write_bytes(damaged(without_digest(path), ways))
        counted(kept.name, failure(partial(sentence_of, kept, path)), path.read_bytes(), found)
        shutil.rmtree(path.parent)


def at_random(folder: Path, found: Counter[str], until: float, chance: random.Random) -> None:
    """Files edited at random."""
    while time.monotonic() < until:
        number = chance.randrange(len(READERS))
        edits = [
            (chance.randrange(5000), chance.randrange(30), chance.choice([*SNIPPETS, chance.randbytes(4)]))
            for _ in range(chance.randint(1, 6))
        ]
        tried(bytes([number]) + edited(READERS[number].valid, edits), folder, found)


def guided(folder: Path, found: Counter[str], seconds: int) -> None:
    """Files bred by libFuzzer towards lines not yet reached."""
    seeds = KEPT / "seeds"
    seeds.mkdir(exist_ok=True)
    for number, reader in enumerate(READERS):
        (seeds / reader.name).write_bytes(bytes([number]) + reader.valid)

    def one(data: bytes) -> None:
        if data:
            tried(data, folder, found)

    words = KEPT / "words"
    lines = ["".join(rf"\x{byte:02x}" for byte in one) for one in SNIPPETS if one]
    words.write_text("".join(f'"{line}"\n' for line in lines), encoding="ascii")
    limits = [f"-max_total_time={seconds}", "-max_len=6000", f"-dict={words}", "-rss_limit_mb=4096", "-timeout=60"]
    atheris.Setup([sys.argv[0], *limits, str(seeds)], one)
    atheris.Fuzz()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--results", action="store_true")
    asked = parser.parse_args()
    KEPT.mkdir(parents=True, exist_ok=True)
    found: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        until, chance = time.monotonic() + 60.0 * asked.minutes, random.Random(asked.seed)
        if asked.results:
            results_at_random(Path(folder), found, until, chance)
        elif atheris is None:
            at_random(Path(folder), found, until, chance)
        else:
            guided(Path(folder), found, int(60.0 * asked.minutes))


if __name__ == "__main__":
    main()
