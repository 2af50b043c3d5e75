"""Coverage-guided fuzzing of the readers, for as long as it is let: `make fuzz MINUTES=60`.

Needs atheris (`pip install atheris`, Python up to 3.11); without it, files are edited at random and nothing guides.
What fails is kept in runs/fuzz, one file each, beside the seeds; runs/fuzz/tally counts files and failures.
"""

import argparse
import random
import sys
import tempfile
import time
import traceback
from collections import Counter
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


def tried(data: bytes, folder: Path, found: Counter[str]) -> None:
    """One file, its first byte the reader; what it raises is kept once for each place it is raised at."""
    reader, began = READERS[data[0] % len(READERS)], time.process_time()
    try:
        outcome(reader, folder, data[1:])
        failed = "slow" if time.process_time() - began > SLOW else ""
    except Exception as error:  # whatever a reader may raise: that is what is looked for
        last = traceback.extract_tb(error.__traceback__)[-1]
        failed = f"{type(error).__name__}-{Path(last.filename).stem}-{last.lineno}"
    found["files"] += 1
    if found["files"] % TOLD_EVERY == 0:  # libFuzzer ends the process itself
        (KEPT / "tally").write_text(", ".join(f"{number:,} {name}" for name, number in found.items()), encoding="utf-8")
    if failed:
        found[failed] += 1
        if found[failed] == 1:
            (KEPT / f"{reader.name}-{failed}").write_bytes(data[1:])
            print(f"{reader.name}: {failed}", flush=True)


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
    asked = parser.parse_args()
    KEPT.mkdir(parents=True, exist_ok=True)
    found: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        if atheris is None:
            at_random(Path(folder), found, time.monotonic() + 60.0 * asked.minutes, random.Random(asked.seed))
        else:
            guided(Path(folder), found, int(60.0 * asked.minutes))


if __name__ == "__main__":
    main()
