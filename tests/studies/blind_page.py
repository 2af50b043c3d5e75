"""docs/blind.md and its figures from the records of the study; `blind_definitions` defines what counts as what."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill

import numpy as np
from blind_definitions import Record, error_of
from blind_figures import draw_chances, draw_held_out
from blind_lines import (
    DISTANCE,
    FEW_SETS,
    LINES,
    Line,
    Told,
    chances_told,
    counts,
    distance,
    distance_by_chance,
    interval,
    is_met,
    made,
    targets_met,
)

from vegglue.pages.style import save

WIDTH = 120  # of the lines of a page


def write_page(
    records: Sequence[Record],
    folder: Path,
    lengths: Mapping[str, float],
    limits: Mapping[str, float],
    ideal: Mapping[str, Mapping[str, float]],
) -> None:
    """blind.md, and blind-*.svg beside it. By the keys of sets with an object: lengths, its signal in the second
    solver's own flow [standard errors]; limits, how often its place can be found in a model that is right but for it
    [-]; ideal, how often it would be reported there, see `object_limits`.
    """
    sets = {truth: made(records, truth) for truth in ("second", "own")}
    told = {truth: chances_told(chosen) for truth, chosen in sets.items()}
    lines, met = targets_met(sets["second"])
    if told["second"]:
        lines, met = lines + 1, met + (distance(told["second"]) <= DISTANCE)
    text = PAGE.format(
        lines=lines, met=met, sets=len(sets["second"]), table=_table(sets["second"], told["second"]),
        twin=len(made(records, "second", "twin")), campaign=len(made(records, "second", "campaign")),
        own=len(sets["own"]), left_out=_left_out(records), kept=_kept(sets["second"]),
        data_limits=_data_limits(lengths, limits, ideal),
    )  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "blind.md").write_text(text, encoding="utf-8")
    for name, figure in (("chances", draw_chances(told)), ("held-out", draw_held_out(sets))):
        save(figure, folder / f"blind-{name}.svg")


def percent(share: float) -> str:
    """A share as a per cent: to a tenth only below one."""
    return f"{100 * share:.1f} %" if 0.0 < share < 0.01 else f"{100 * share:.0f} %"


def wanted_of(line: Line) -> str:
    if line.wanted is None:
        return "-"
    return "never" if line.wanted == 0.0 else f"at {'most' if line.most else 'least'} {100 * line.wanted:.0f} %"


def _table(records: Sequence[Record], told: Sequence[Told]) -> str:
    """Every line that has data, the field campaign beside all."""
    campaign = [one for one in records if one["case"] == "campaign"]
    rows = [
        "| | wanted | sets | share | 95 % interval | met | campaign alone (sets) |",
        "|---|---|---:|---:|---:|---|---:|",
    ]
    for line in LINES:
        good, size = counts(records, line)
        if not size:
            continue
        low, high = interval(good, size)
        reached = is_met(line, good, size)
        answer = "-" if reached is None else "no" if not reached else "yes" if size >= FEW_SETS else "too few sets"
        there, of = counts(campaign, line)
        beside = f"{percent(there / of)} ({of})" if of else "-"
        rows.append(
            f"| {line.label} | {wanted_of(line)} | {size} | {percent(good / size)} "
            f"| {100 * low:.0f} to {percent(high)} | {answer} | {beside} |"
        )
    if told:
        away = distance(told)
        rows.append(
            f"| Stated probabilities: distance from the true share | at most {100 * DISTANCE:.0f} points | "
            f"{sum(one.count for one in told)} hypotheses | {100 * away:.1f} points | "
            f"{100 * distance_by_chance(told):.1f} if all were right | {'yes' if away <= DISTANCE else 'no'} | - |"
        )
    return "\n".join(rows)


def _left_out(records: Sequence[Record]) -> str:
    """Names of effects that no size makes visible, and other reasons with their counts."""
    names: set[str] = set()
    others: Counter[str] = Counter()
    for record in records:
        if "left_out" in record:
            found = re.match(r"(?:--hide )?(\S+): at no plausible size", record["left_out"])
            names.update(found[1].split(",") if found else ())
            others.update([] if found else [record["left_out"].partition(":")[0]])
    listed = ", ".join(sorted(names)) or "none"
    text = f"- **Not visible at any plausible size in at least one of the channels, and left out there:** {listed}."
    if others:
        text += " Left out for other reasons: " + "; ".join(f"{why} ({size})" for why, size in others.items()) + "."
    return fill(text, WIDTH, subsequent_indent="  ", break_on_hyphens=False)


def _kept(records: Sequence[Record]) -> str:
    """The change of held-out errors by what is kept: its median, and those that rise."""
    known = [(error_of(one, "parent"), error_of(one, "kept")) for one in records]
    change = np.array([kept / parent - 1.0 for parent, kept in known if parent is not None and kept is not None])
    rising = change[change >= 0.0]
    if not rising.size:
        return ""
    text = (
        f"- **Held-out errors** change by {percent(float(np.median(change)))} (median of {change.size} sets) with what "
        f"`extend --auto` keeps. In {rising.size} sets they rise: by {percent(float(np.median(rising)))} (median), "
        f"{percent(float(rising.max()))} at most."
    )
    return fill(text, WIDTH, subsequent_indent="  ")


def _data_limits(
    lengths: Mapping[str, float], limits: Mapping[str, float], ideal: Mapping[str, Mapping[str, float]]
) -> str:
    """What the data allow at most of unlisted objects, as far as the studies of limits were made."""
    parts = []
    if lengths:
        some = sorted(lengths.values())
        parts.append(
            f"An object sized to 6 s.e. in the model has a signal of {some[0]:.1f} to {some[-1]:.1f} s.e. in the "
            f"second solver (median {float(np.median(some)):.1f} of {len(some)}; `tests/studies/blind_lengths.py`)."
        )
    if limits:
        parts.append(
            f"In a model that is right but for an object of known kind and width, the most probable place lies within "
            f"1.5 m in {percent(float(np.mean(list(limits.values()))))} of draws of the errors ({len(limits)} objects; "
            "`tests/studies/place_limits.py`)."
        )
    groups = {
        group: [one for key, one in ideal.items() if f"/{group}/" in key]
        for group in ("unlisted", "listed6", "listed3")
    }  # fmt: skip
    if all(groups.values()):

        def mean(name: str, group: str = "unlisted") -> str:
            return percent(float(np.mean([one[name] for one in groups[group]])))

        parts.append(
            f"If the kind is unknown and all hypotheses compete to first order by the rules of a diagnosis, none of "
            f"these is reported of {mean('told')} of {len(groups['unlisted'])} objects and a place within 1.5 m of "
            f"{mean('near')}; always guessing a place reaches {mean('guessed')} (`tests/studies/object_limits.py`). "
            f"Reporting a place at even odds would reach {mean('evenly')}, at the price of {mean('evenly', 'listed6')} "
            f"of listed effects of 6 s.e. and {mean('evenly', 'listed3')} of 3 s.e. being reported as none of these, "
            f"instead of {mean('told', 'listed6')} and {mean('told', 'listed3')}."
        )
    if not parts:
        return ""
    return fill("- **What the data allow at most.** " + " ".join(parts), WIDTH, subsequent_indent="  ")


PAGE = """# How often the diagnosis is right

Causes were hidden in synthetic measurements, and each set was diagnosed once without that knowledge. The
rates below hold under the conditions below and under no others.

## Protocol

- **The truth** is computed by a second solver (`tests/studies/second_solver.py`): explicit finite volumes with a
  grid, a waterline and closures of their own, coded from the same formulas, without any code of vegglue.
- **Two cases.** The small channel: 32 m, two patches, 93 stations (`configs/twin.yaml`), {twin} sets. The field
  campaign: 100 m, seven patches, 270 stations (`configs/campaign.yaml`), {campaign} sets. Standard errors are 1 cm/s
  for velocities and 3 mm for levels. Cells of the truth are 0.25 m x 0.125 m, those of the model 0.5 m x 0.1875 m.
- **Errors of measurement** are new in each set: independent; in sets with nothing hidden also correlated between
  neighbours by 0.5, or 1.5 times as large as stated.
- **An imperfect site** is drawn anew in each set: floor of the bank law 1.1 to 1.6 (1.3 in the model); the logarithm
  above plants 0.85 to 1.15 times Baptist's; bed under plants of 45 to 75 m^(1/2)/s (60 in the model); eddy viscosity
  0.5 to 2.5 times the stated one; sides of patches up to 0.1 m off; stems 12 %, the bed 1 cm, probes 2 cm and
  discharges 1 % off. Everything is hidden on such sites; sets with nothing hidden are half on exact sites.
- **The model** may err as a user would state (`model_error`): friction 5 %, bed 1 cm, edges of patches 5 cm, probes
  2 cm, discharges 1 %, stems 12 %. The eddy viscosity is calibrated with a prior of a factor of two. True parameters
  lie 0.3 to 1 standard deviations from the middle of their priors.
- **What is hidden**: an effect of the library, an object in no list (a pier, a hole, ...), an instrument that is off,
  or two of these. Its size gives a signal of 3 or 6 standard errors (s.e.): the norm of the change of the predictions
  that calibration cannot absorb, in standard errors of data, grid, model and site together.

A **name** is a cause in a verdict that names one; causes found before a verdict of "cannot tell" are no names. It is
**false** if it is neither hidden nor an imperfection of the site (with the right sign); a place is false beyond 1.5 m
of every object. An effect is **in the set** if it is among the hypotheses, or, with nothing false named, among what is
not excluded. **Groups** are effects that the data cannot distinguish. **Not inspected** leaves out objects that were
looked at, or changed, while rules were chosen. **Held-out errors** are at sections without measurements, against the
truth, with the error of a probe added.

## Result

Of {lines} targets {met} are met. A target is met only if the share itself reaches it, whatever its interval (95 %,
Clopper and Pearson), in at least 20 sets. All {sets} sets:

{table}

![Stated probabilities, and the share that is true](blind-chances.svg)

![Held-out errors before and after extend --auto](blind-held-out.svg)

## Limits

- **Chosen on the data.** Some rules for places, instruments and lists of what is not excluded were chosen after parts
  of these sets. Only the lines "not inspected" are free of that, and only for objects.
- **Several states of the code.** Sets that a later change could affect were diagnosed again, as far as time allowed;
  what `extend --auto` keeps is counted by an earlier rule in all but 170 sets. `make blind` computes what is missing.
- **Dependent sets.** True parameters lie at eight places of the prior. `own equations` in the figures ({own} sets) have
  the model's own equations as truth: an easier test.
- **Few sets** of a campaign with something hidden, of pairs and of bad readings; none with water that enters at a
  place, none with the side of a patch within a cell. Laws have [their own study](discover.md#how-often-it-is-right).
{kept}
{data_limits}
{left_out}
- **Natural reaches** have [rates of their own](diagnosis.md#drawn-natural-reaches), of 175 sets of 66 reaches.
"""
