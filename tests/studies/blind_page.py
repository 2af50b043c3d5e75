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
        data_limits=_data_limits(lengths, limits, ideal), few=FEW_SETS,
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
    """Every line that has data, beside all the field campaign if it has more than a few."""
    campaign = [one for one in records if one["case"] == "campaign"]
    rows = ["| | target | data sets | share (95 % interval); of the field campaign alone |", "|---|---|---:|---:|"]
    for line in LINES:
        good, size = counts(records, line)
        if not size:
            continue
        low, high = interval(good, size)
        reached = is_met(line, good, size)
        answer = "**missed**" if not reached else "met" if size >= FEW_SETS else "too few"
        target = "-" if reached is None else f"{wanted_of(line)}, {answer}"
        there, of = counts(campaign, line)
        beside = f"; {percent(there / of)} of {of}" if of >= FEW_SETS else ""
        share = f"{percent(good / size)} ({100 * low:.0f} to {100 * high:.0f})"
        rows.append(f"| {line.label} | {target} | {size} | {share}{beside} |")
    if told:
        away = distance(told)
        rows.append(
            f"| Stated probabilities: distance from the true share | at most {100 * DISTANCE:.0f} points, "
            f"{'met' if away <= DISTANCE else '**missed**'} | {sum(one.count for one in told)} hypotheses | "
            f"{100 * away:.1f} points ({100 * distance_by_chance(told):.1f} if all were right) |"
        )
    return "\n".join(rows)


def _left_out(records: Sequence[Record]) -> str:
    """How many effects no size makes visible, and other reasons with their counts."""
    names: set[str] = set()
    others: Counter[str] = Counter()
    for record in records:
        if "left_out" in record:
            found = re.match(r"(?:--hide )?(\S+): at no plausible size", record["left_out"])
            names.update(found[1].split(",") if found else ())
            others.update([] if found else [record["left_out"].partition(":")[0]])
    text = f"- **Left out of a channel**: {len(names)} effects that are not visible there at any plausible size"
    text += "".join(f"; {why} ({size})" for why, size in others.items()) + "."
    return fill(text, WIDTH, subsequent_indent="  ", break_on_hyphens=False)


def _kept(records: Sequence[Record]) -> str:
    """The change of held-out errors by what is kept: its median, and those that rise."""
    known = [(error_of(one, "parent"), error_of(one, "kept")) for one in records]
    change = np.array([kept / parent - 1.0 for parent, kept in known if parent is not None and kept is not None])
    rising = change[change >= 0.0]
    if not rising.size:
        return ""
    text = (
        f"- **Held-out errors** change by {percent(float(np.median(change)))} (median of {change.size} data sets) with "
        f"what `extend --auto` keeps. In {rising.size} data sets they rise: by {percent(float(np.median(rising)))} "
        f"(median), {percent(float(rising.max()))} at most."
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
            f"second solver (median {float(np.median(some)):.1f} of {len(some)})."
        )
    if limits:
        parts.append(
            f"In a model that is right but for an object of known kind and width, the most probable place lies within "
            f"1.5 m in {percent(float(np.mean(list(limits.values()))))} of draws of the errors ({len(limits)} objects)."
        )
    groups = {
        group: [one for key, one in ideal.items() if f"/{group}/" in key]
        for group in ("unlisted", "listed6", "listed3")
    }
    if all(groups.values()):

        def mean(name: str, group: str = "unlisted") -> str:
            return percent(float(np.mean([one[name] for one in groups[group]])))

        parts.append(
            f"If the kind is unknown and all hypotheses compete to first order by the rules of a diagnosis, "
            f"`none-of-these` is reported for {mean('told')} of {len(groups['unlisted'])} objects and a local anomaly "
            f"within 1.5 m for {mean('near')}. Reporting an anomaly at even odds would "
            f"give {mean('evenly')}, but also `none-of-these` for {mean('evenly', 'listed6')} of listed effects "
            f"of 6 s.e. and {mean('evenly', 'listed3')} of 3 s.e., instead of {mean('told', 'listed6')} and "
            f"{mean('told', 'listed3')}."
        )
    if not parts:
        return ""
    heading = "- **What the data allow at most** (`blind_lengths.py`, `place_limits.py` and `object_limits.py`). "
    return fill(heading + " ".join(parts), WIDTH, subsequent_indent="  ", break_on_hyphens=False)


PAGE = """# How often the diagnosis is right

{sets} synthetic data sets, most with a hidden cause, were diagnosed. Under the conditions below,
of {lines} targets {met} are met. A target is met only if the share itself reaches it, whatever its 95 % interval
(Clopper and Pearson), in at least {few} data sets.

## Protocol

- **Truth.** A second solver (`tests/studies/second_solver.py`): explicit finite volumes with their own grid, waterline
  and closures, coded from the same formulas without any code of vegglue, on finer cells.
- **Two channels.** The small channel: 32 m, two patches, 93 stations (`configs/twin.yaml`), {twin} data sets. The field
  campaign: 100 m, seven patches, 270 stations (`configs/campaign.yaml`), {campaign} data sets.
- **Errors of measurement**: independent, 1 cm/s for velocities and 3 mm for levels; with nothing hidden also correlated
  between neighbours by 0.5, or 1.5 times as large as stated.
- **Imperfect sites**: floor of the bank law 1.1 to 1.6 (1.3 in the model); the logarithm above plants 0.85 to 1.15
  times Baptist's; bed under plants of 45 to 75 m^(1/2)/s (60 in the model); eddy viscosity 0.5 to 2.5 times the stated
  one; sides of patches up to 0.1 m off; stems 12 %, the bed 1 cm, probes 2 cm and discharges 1 % off. Every cause is
  hidden on such sites; with nothing hidden half of the sites are exact.
- **Errors allowed to the model**: friction 5 %, bed 1 cm, edges of patches 5 cm, probes 2 cm, discharges 1 %, stems
  12 %. The eddy viscosity is calibrated with a prior of a factor of two.
- **Hidden causes**: an effect of the library, an object in no list (a pier, a hole, ...), an instrument that is off,
  or two of these, with a signal of 3 or 6 standard errors (s.e.): the norm of the change of the predictions that
  calibration cannot absorb, in standard errors of data, grid, model and site together.

## Result

- **Name**: a cause in a verdict that names one; causes found before a verdict of `cannot-tell` do not count. **False**:
  neither hidden nor an imperfection of the site (of the right sign); an anomaly over 1.5 m from every object.
- **In the credible set**: among the hypotheses of the verdict or, with nothing false named, among what is not excluded.
  **Groups**: effects that the data cannot distinguish.
- **Not inspected**: without objects that were looked at, or changed, while rules were chosen.
- **Held-out error**: at sections without measurements, with the error of a probe added.

{table}

![Stated probabilities, and the share that is true](blind-chances.svg)

![Held-out errors before and after extend --auto](blind-held-out.svg)

## Limits

- **Chosen on the data.** Some rules for local anomalies, instruments and lists of what is not excluded were chosen
  after parts of these data sets. Only the lines "not inspected" are free of that, and only for objects.
- **Several states of the code.** Data sets that a later change could affect were diagnosed again, as far as time
  allowed; what `extend --auto` keeps is counted by an earlier rule in all but 170.
- **Dependence.** True parameters lie at eight points of the prior, 0.3 to 1 standard deviations from its middle. `own
  equations` in the figures ({own} data sets) have the model's own equations as truth, an easier test.
- **Few data sets** of a campaign with something hidden (shares of fewer than {few} are not shown), of pairs and of bad
  readings; none with water that enters locally, none with the side of a patch within a cell.
{kept}
{data_limits}
{left_out}
"""
