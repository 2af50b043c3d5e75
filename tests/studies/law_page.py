"""docs/discover_study.md, made from the records of the study of laws."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from blind_lines import interval
from hidden_laws import BY_NAME
from law_sets import law_trials

Record = Mapping[str, Any]
Said = tuple[str, str]  # a term and a quantity
# What listed effects say in the words of the grammar; others say something else.
LISTED_SAYS: dict[str, Said] = {
    "depth_dependent_bank": ("bank", "depth"), "depth_dependent_bed": ("floor", "depth"),
    "bank_trend": ("bank", "along"),
    "bed_trend": ("floor", "along"), "bank_vegetation": ("bank", "depth"), "streamlining": ("plants", "speed"),
    "canopy_deflection": ("plants", "speed"), "canopy_bending": ("plants", "speed"), "foliage": ("plants", "speed"),
    "slow_stems": ("plants", "speed"), "emergent_part": ("plants", "depth"), "undergrowth": ("plants", "depth"),
    "debris_screen": ("plants", "front"), "density_trend": ("plants", "front"), "edge_thinning": ("plants", "edge"),
    "edge_mixing": ("viscosity", "edge"), "mixing_length": ("viscosity", "shear"),
    "coherent_structures": ("viscosity", "shear"), "smagorinsky": ("viscosity", "shear"),
    "elder": ("viscosity", "speed"),
    "stem_blockage": ("plants", ""), "canopy_height_error": ("plants", ""), "patch_density": ("plants", ""),
    "steep_bank": ("bank", ""), "bank_difference": ("bank", ""), "viscosity": ("viscosity", ""),
    "unlisted_viscosity": ("viscosity", ""),
}  # fmt: skip
NEAR = 1.25


def causes(record: Record) -> list[tuple[Said, float, bool]]:
    """What each cause of the set says, its chance, and whether it is a law; the likeliest first."""
    found = [((one["term"], one["quantity"]), one["chance"], True) for one in record["laws"]]
    others = [(LISTED_SAYS.get(name.partition("[")[0], ("", "")), p, False) for name, p in record["others"].items()]
    return sorted([*found, *others], key=lambda one: -one[1])


def says_term(record: Record) -> bool:
    """The likeliest cause changes the term in which a law was hidden."""
    first = causes(record)[:1]
    return bool(first) and first[0][0][0] == BY_NAME[record["hide"]].term


def law_says_term(record: Record) -> bool:
    """The same, and it is a law."""
    return says_term(record) and causes(record)[0][2]


def _is_true(record: Record, said: Said) -> bool:
    law = BY_NAME[record["hide"]]
    return said[0] == law.term and said[1] in law.quantities


def has_quantity(record: Record) -> bool:
    """A cause of the set says the quantity, of the term, that was hidden."""
    return any(_is_true(record, said) for said, _, _ in causes(record))


def quantity_alone(record: Record) -> bool:
    """All causes of the set do."""
    found = causes(record)
    return bool(found) and all(_is_true(record, said) for said, _, _ in found)


def near_truth(record: Record, probe: float = 0.0) -> bool | None:
    """Whether the error in the experiment that was held out is at most NEAR times that with the true law calibrated;
    where no law was written, that of the model as it was. probe: error of a probe, added in quadrature [m/s].
    """
    errors = record["held_out"]
    after = errors["before"] if errors["after"] is None else errors["after"]
    if errors["truth"] is None or after is None:
        return None
    return bool(np.hypot(after, probe) <= NEAR * np.hypot(errors["truth"], probe))


def wrote_a_law(record: Record) -> bool:
    """A law was the likeliest cause, and was written."""
    return bool(record["best"])


def is_silent(record: Record) -> bool:
    """No law was written."""
    return not record["best"]


# What is wanted of each group: words, share, whether it is so.
LINES: tuple[tuple[str, str, str, Callable[[Record], bool | None]], ...] = (
    ("law", "the likeliest cause changes the right term", "at least 80 %", says_term),
    ("law", "the same, and it is a law", "", law_says_term),
    ("law", "the right quantity of the right term is in the set that holds 95 %", "at least 80 %", has_quantity),
    ("law", "nothing else is in it", "at least 50 %", quantity_alone),
    ("law", "held-out error at most 1.25 times that with the true law, without errors of probes", "at least 70 %",
     near_truth),
    ("law", "the same with the error of a probe of 0.01 m/s", "", lambda record: near_truth(record, 0.01)),
    ("law", "the same, where a law was written", "",
     lambda record: near_truth(record, 0.01) if wrote_a_law(record) else None),
    ("nothing", "no law is written", "at least 95 %", is_silent),
    ("listed", "no law in no list is preferred", "at least 95 %", is_silent),
)  # fmt: skip


def write_law_page(records: Sequence[Record], folder: Path) -> None:
    """docs/discover_study.md."""
    made = [record for record in records if "left_out" not in record]
    text = PAGE.format(
        sets=len(made), planned=len(law_trials()), left_out=_left_out(records),
        law=_size(made, "law"), nothing=_size(made, "nothing"), listed=_size(made, "listed"),
        seconds=f"{np.median([record['seconds'] for record in made]):.0f}",
        lines=_lines(made), laws=_by_law(made), without=_without(made),
    )  # fmt: skip
    (folder / "discover_study.md").write_text(text, encoding="utf-8")


def _size(made: Sequence[Record], group: str) -> int:
    return sum(record["group"] == group for record in made)


def _left_out(records: Sequence[Record]) -> str:
    found: dict[str, int] = {}
    for record in records:
        if "left_out" in record:
            why = (
                "visible"
                if "as visible as" in record["left_out"]
                else "flow"
                if "steady" in record["left_out"]
                else "crash"
            )
            found[why] = found.get(why, 0) + 1
    return (
        f"{found.get('visible', 0)} since at no plausible size would the data show what was to be hidden, "
        f"{found.get('flow', 0)} since the second solver found no steady flow, {found.get('crash', 0)} for an error of "
        "the search"
    )


def _lines(made: Sequence[Record]) -> str:
    rows = []
    for group, words, wanted, is_so in LINES:
        answers = [one for record in made if record["group"] == group and (one := is_so(record)) is not None]
        if not answers:
            continue
        low, high = interval(sum(answers), len(answers))
        share, ends = f"{100 * sum(answers) / len(answers):.0f} %", f"{100 * low:.0f} to {100 * high:.0f} %"
        rows.append(f"| {GROUPS[group]} | {words} | {wanted} | {len(answers)} | {share} | {ends} |")
    return "\n".join(rows)


GROUPS = {"law": "a law hidden", "nothing": "nothing hidden", "listed": "a listed effect hidden"}


def _by_law(made: Sequence[Record]) -> str:
    rows = []
    for law in BY_NAME.values():
        of_law = [record for record in made if record["hide"] == law.name]
        if of_law:
            told = [sum(map(is_so, of_law)) for is_so in (says_term, has_quantity, quantity_alone)]
            words = f"{law.form}{f', and evenly with {law.other}' if law.other else ''}"
            rows.append(f"| {law.term} | {law.quantity} | {words} | {len(of_law)} | {' | '.join(map(str, told))} |")
    return "\n".join(rows)


def _without(made: Sequence[Record]) -> str:
    rows = []
    for record in made:
        if record["group"] != "listed":
            continue
        own, without = record["others"].get(record["hide"]), record["without"]
        found = f"{100 * own:.0f} %" if own else "-"
        law = without["laws"][0] if without["best"] else None
        words = f"{law['term']}: {law['quantity']}, {law['form']} ({100 * law['chance']:.0f} %)" if law else "-"
        errors = record["held_out_without"]
        told = " | ".join(
            "-" if errors[name] is None else f"{errors[name]:.4f}" for name in ("before", "after", "truth")
        )
        rows.append(f"| `{record['hide']}` | {record['hidden']['signal']:.0f} | {found} | {words} | {told} |")
    return "\n".join(rows)


PAGE = """# How often discover is right

Laws that are in no list and in no form of the grammar were hidden in the small channel, and searched by a program
that did not know them (`tests/studies/laws.py`; records in `data/blind/laws.jsonl`; this page is made from them). The
truth is the second solver's of [the blind study](blind.md), on a site with the small imperfections told there, drawn
anew in each set: thresholds sharper than the step of the grammar, other exponents, exponentials, humps, waves and
bows along the channel, and products of two quantities (`tests/studies/hidden_laws.py`). What is hidden is as large as
leaves 8 standard errors after calibration, a listed effect that cannot be so large 5 or 3. Velocities at a discharge
between those measured are held out.

{sets} sets: {law} with a law hidden, {nothing} with nothing and {listed} with a listed effect, of {planned}
that are planned (`make laws` goes on from them: some half a minute of a core for each). Left out were
{left_out}. A search took {seconds} s of a core (median). Cells of the truth are 0.5 by 0.1875 m, on which
predictions differ by 0.001 m/s from those on cells of 0.125 m. The sets lie at eight places of the prior, so
that they are not quite as independent as the intervals suppose.

| | | wanted | sets | share | 95 % interval |
|---|---|---|---:|---:|---:|
{lines}

A listed effect counts as right where it says the same: `depth_dependent_bank` where friction of the banks changes
with the depth. Where no law was written, the held-out error is that of the model as it was. Intervals are binomial
(Clopper and Pearson).

## Law by law

| term | quantity | form | sets | right term | right quantity in the set | alone |
|---|---|---|---:|---:|---:|---:|
{laws}

## Listed effects left out

Each was hidden once, searched with the whole library, and again with that effect left out by `--without`. Errors in
the experiment that was held out [m/s], without errors of probes: of the model as it was, with the law that was
written, and with the hidden effect itself.

| hidden | standard errors | its chance | law, where it is left out | as it was | with the law | with the effect |
|---|---:|---:|---|---:|---:|---:|
{without}

"""
