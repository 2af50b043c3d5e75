"""How verdicts of the open cases change with each constant that decides: a diagnosis with half and with twice of it.

    python tests/studies/sensitivity.py [--cases open-a ...] [--constants field_odds ...]
    python tests/studies/sensitivity.py --page

The first diagnoses what is not recorded yet, the constants that matter most first, and may be stopped at any time. The
second writes the table of docs/sensitivity.md from the records, as the first does at its end. A share near 1 is halved
and doubled in its distance from 1.
"""

import argparse
import json
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import Any

import vegglue
from vegglue.decision_constants import DecisionConstants, Described, described, using
from vegglue.errors import InputError

ROOT = Path(__file__).parents[2]
CASES, RECORDS, PAGE = ROOT / "data/open_cases", ROOT / "data/sensitivity/records.jsonl", ROOT / "docs/sensitivity.md"
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


def diagnosed(case: str, constant: str, factor: float) -> Record:
    """The verdict of one open case, with one constant varied or with all as they are."""
    by_name = {one.name: one for one in described()}
    values = DecisionConstants()
    if constant != AS_IS:
        values = replace(values, **{constant: varied(by_name[constant], factor)})
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as place, using(values):
        imported = vegglue.import_folder(CASES / case, Path(place) / f"{case}.yaml")
        found = vegglue.diagnose(imported, runs=Path(place) / "runs")
    return {
        "case": case, "constant": constant, "factor": factor, "kind": found.verdict.kind,
        "set": sorted(found.set),
        "places": [one.effect for one in found.places], "instruments": [one.kind for one in found.instruments],
        "seconds": round(time.perf_counter() - began, 1),
    }  # fmt: skip


def missing(
    cases: Sequence[str], constants: Sequence[str], records: Sequence[Record]
) -> Iterator[tuple[str, str, float]]:
    """What is not recorded yet: each case as it is, then the constants in their order."""
    known = {(one["case"], one["constant"], one["factor"]) for one in records}
    wanted = [(case, AS_IS, 1.0) for case in cases]
    wanted += [(case, constant, factor) for constant in constants for factor in FACTORS for case in cases]
    return (one for one in wanted if one not in known)


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
    parser.add_argument("--cases", nargs="*", default=sorted(path.name for path in CASES.glob("open-*")))
    parser.add_argument("--constants", nargs="*", default=[one.name for one in _in_order(described())])
    parser.add_argument("--page", action="store_true", help="only write the table")
    given = parser.parse_args()
    RECORDS.parent.mkdir(exist_ok=True)
    kept = "".join(json.dumps(one) + "\n" for one in read_records())
    RECORDS.write_text(kept, encoding="utf-8")
    for case, constant, factor in [] if given.page else missing(given.cases, given.constants, read_records()):
        try:
            record = diagnosed(case, constant, factor)
        except InputError as error:
            print(f"{case}, {constant} x {factor:g}: {error}", flush=True)
            continue
        with RECORDS.open("a", encoding="utf-8") as file:
            file.write(json.dumps(record) + "\n")
        print(f"{case}, {constant} x {factor:g}: {record['kind']}, {record['seconds']} s", flush=True)
    write_page(read_records())


if __name__ == "__main__":
    main()
