"""How verdicts of the open cases change with each constant that decides: a diagnosis with half and with twice of it.

    python tests/studies/sensitivity.py [--cases open-a ...] [--constants field_odds ...]
    python tests/studies/sensitivity.py --page

The first diagnoses each case that is not recorded yet, and may be stopped at any time. Until a constant is read, its
value changes nothing: when a diagnosis reads one for the first time, the process forks, and each child goes on with
another value of it. So half and twice cost only what follows, they share nothing that was computed with the constant,
and one that is never read needs no run. The second writes the table of docs/sensitivity.md from the records, as the
first does at its end. A share near 1 is halved and doubled in its distance from 1.
Cells are twice as long and as wide as those that `import` proposes, see `tests/open_cases.py`.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from textwrap import fill
from typing import Any, cast

from vegglue.decision_constants import DecisionConstants, using
from vegglue.diagnosis.diagnose import diagnose_model
from vegglue.errors import InputError
from vegglue.parallel import at_most, one_thread
from vegglue.workflow.case_run import case_run

sys.path.insert(0, str(Path(__file__).parents[1]))
from described_constants import Described, described
from open_cases import OPEN_CASES, on_larger_cells

ROOT = Path(__file__).parents[2]
RECORDS, PAGE = ROOT / "data/sensitivity/records.jsonl", ROOT / "docs/sensitivity.md"
BEGIN, END = "<!-- numbers by sensitivity.py -->", "<!-- end of numbers -->"
FACTORS = (0.5, 2.0)
# Those that matter most: every stated probability depends on the first, all sizes of effects on the last.
FIRST = (
    "fingerprint_error", "grid_error_share", "grid_error_correlation", "shape_error", "spot_drag", "spot_rise",
    "spot_inflow", "spot_viscosity", "known_first_odds", "field_odds", "instrument_errors", "mostly_elsewhere",
    "held_out_ratio", "effect_sizes",
)  # fmt: skip
AS_IS = "as it is"
Record = dict[str, Any]


def varied(one: Described, factor: float) -> float:
    """The constant times a factor; of one near 1 the distance from it. A correlation is 0.99 at most."""
    found = 1.0 - factor * (1.0 - one.value) if one.near_one else factor * one.value
    return min(found, 0.99) if "correlation" in one.name else found


@dataclass
class Forking:
    """Constants that fork this process when one of `wanted` is read for the first time, once for each factor: the child
    goes on with the constant times that factor, and forks no more.
    """

    values: DecisionConstants
    wanted: dict[str, tuple[float, ...]]
    constant: str = AS_IS
    factor: float = 1.0
    read: set[str] = field(default_factory=lambda: {AS_IS})

    def __getattr__(self, name: str) -> float:
        self.read.add(name)
        for factor in self.wanted.pop(name, ()):
            child = os.fork()
            if child:
                os.waitpid(child, 0)
                continue
            self.constant, self.factor, self.wanted = name, factor, {}
            one = next(one for one in described(self.values) if one.name == name)
            self.values = replace(self.values, **{name: varied(one, factor)})
            break
        return cast(float, getattr(self.values, name))


def diagnose_all(case: str, wanted: Mapping[str, tuple[float, ...]], commit: str) -> None:
    """Record the verdict of one open case as it is and with each wanted constant times each of its factors."""
    of, parent = Forking(DecisionConstants(), dict(wanted)), os.getpid()
    answered: Record = {"kind": "refused", "set": [], "places": [], "instruments": []}
    with tempfile.TemporaryDirectory() as place:
        run = case_run(on_larger_cells(case, Path(place)), Path(place) / "runs")
        try:
            with using(cast(DecisionConstants, of)), at_most(1), one_thread():  # a fork keeps one thread
                found = diagnose_model(run.commanded_model, held_out=run.validation_model)
                answered = {
                    "kind": found.verdict.kind, "set": sorted(found.set),
                    "places": [one.effect for one in found.places],
                    "instruments": [one.kind for one in found.instruments],
                }  # fmt: skip
        except InputError as error:
            print(f"{case}, {of.constant} x {of.factor:g}: {error}", flush=True)
        except BaseException:
            if os.getpid() == parent:
                raise
            traceback.print_exc()
            os._exit(1)
        record({"case": case, "constant": of.constant, "factor": of.factor, **answered, "read": True,
                "seconds": round(time.process_time(), 1), "commit": commit})  # fmt: skip
        if os.getpid() != parent:
            os._exit(0)  # the folder and all else belong to the parent
    for name in wanted.keys() - of.read:
        for factor in wanted[name]:
            record({"case": case, "constant": name, "factor": factor, **answered, "read": False, "seconds": 0.0,
                    "commit": commit})  # fmt: skip


def record(one: Record) -> None:
    """Add it to the records."""
    with RECORDS.open("a", encoding="utf-8") as file:
        file.write(json.dumps(one) + "\n")
    if one["read"]:
        print(f"{one['case']}, {one['constant']} x {one['factor']:g}: {one['kind']}, {one['seconds']} s", flush=True)


def missing(case: str, constants: Sequence[str], records: Sequence[Record]) -> dict[str, tuple[float, ...]]:
    """The factors of each constant that are not recorded for a case, and the case as it is."""
    known = {(one["constant"], one["factor"]) for one in records if one["case"] == case}
    left = {name: tuple(one for one in FACTORS if (name, one) not in known) for name in constants}
    left |= {AS_IS: () if (AS_IS, 1.0) in known else (1.0,)}
    return {name: factors for name, factors in left.items() if factors}


def read_records() -> list[Record]:
    """All records; a last line that was cut off when the study was stopped is dropped."""
    lines = RECORDS.read_text(encoding="utf-8").splitlines(keepends=True) if RECORDS.exists() else []
    return [json.loads(line) for line in lines if line.endswith("\n")]


def answer(record: Record) -> tuple[Any, ...]:
    """What has to be the same for a verdict to be: its kind, the set, kinds of places and of instruments."""
    return tuple(json.dumps(record[name]) for name in ("kind", "set", "places", "instruments"))


def table(records: Sequence[Record]) -> str:
    """One row for each constant with the cases whose verdict is another at half or twice of it; then the others."""
    of = {(one["case"], one["constant"], one["factor"]): one for one in records}
    as_is = {case: one for (case, constant, _), one in of.items() if constant == AS_IS}

    def changes(name: str, factor: float) -> str:
        found = {case: of[case, name, factor] for case in as_is if (case, name, factor) in of}
        if not found:
            return "not run"
        other = [
            f"{case.removeprefix('open-')} ({as_is[case]['kind']} → {one['kind']})"
            if one["kind"] != as_is[case]["kind"] else f"{case.removeprefix('open-')} (another set)"
            for case, one in sorted(found.items()) if answer(one) != answer(as_is[case])
        ]  # fmt: skip
        return f"{len(other)} of {len(found)}" + (f": {', '.join(other)}" if other else "")

    rows = ["| constant | value | provenance | other verdicts at half | at twice |", "|---|---|---|---|---|"]
    run, alike, left = {constant for _, constant, _ in of}, [], []
    for one in _in_order(described()):
        unit = "" if one.unit == "-" else f" {one.unit}"
        half, twice = (changes(one.name, factor) for factor in FACTORS)
        name = f"**`{one.name}`**" if one.name in FIRST else f"`{one.name}`"
        if one.name not in run:
            left.append(name)
        elif half == twice == f"0 of {len(as_is)}":
            alike.append(f"{name} {one.value:g}{unit} ({one.provenance.value})")
        else:
            rows.append(f"| {name} | {one.value:g}{unit} | {one.provenance.value} | {half} | {twice} |")
    same = (
        f"At half and at twice of {len(alike)} others no verdict of {len(as_is)} differs: "
        f"{', '.join([one for one in alike if '**' in one]) or 'none that matters most'}, and more."
    )
    return "\n".join([*rows, "", fill(same, 120), "", fill(f"Not run: {', '.join(left) or 'none'}.", 120)])


def _in_order(constants: Sequence[Described]) -> list[Described]:
    return sorted(constants, key=lambda one: (FIRST.index(one.name) if one.name in FIRST else len(FIRST), one.name))


def write_page(records: Sequence[Record]) -> None:
    """The part of the page between the marks."""
    text = PAGE.read_text(encoding="utf-8")
    before, after = text[: text.index(BEGIN) + len(BEGIN)], text[text.index(END) :]
    PAGE.write_text(f"{before}\n\n{table(records)}\n\n{after}", encoding="utf-8")


def main() -> None:
    """Parse the command line, and diagnose or write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="*", default=sorted(path.name for path in OPEN_CASES.glob("open-*")))
    parser.add_argument("--constants", nargs="*", default=[one.name for one in _in_order(described())])
    parser.add_argument("--page", action="store_true", help="only write the table")
    given = parser.parse_args()
    RECORDS.parent.mkdir(exist_ok=True)
    kept = "".join(json.dumps(one) + "\n" for one in read_records())
    RECORDS.write_text(kept, encoding="utf-8")
    commit = subprocess.run(
        ["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.strip()
    for case in [] if given.page else given.cases:
        wanted = missing(case, given.constants, read_records())
        if wanted and not (child := os.fork()):  # a process for each case: what one keeps in memory, no other sees
            diagnose_all(case, wanted, commit)
            os._exit(0)
        elif wanted:
            os.waitpid(child, 0)
    write_page(read_records())


if __name__ == "__main__":
    main()
