"""case -> twin: measurements with a hidden effect and the encoded truth; and how well a diagnosis found it."""

import base64
import json
import os
import re
import zlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.case.centreline import on_map
from vegglue.case.config import load_case
from vegglue.case.grid import centreline_in
from vegglue.case.made_files import write_made
from vegglue.case.parameter_space import refuse_without_parameters
from vegglue.case.resolved_config import as_yaml, case_hash
from vegglue.case.schema import Case
from vegglue.case.text_files import LARGEST_JSON, case_name, read_text
from vegglue.effects.grammar import LAWS, Law
from vegglue.errors import InputError, shown_command, shown_path
from vegglue.measurements.kinds import KINDS, Kind, kind_of
from vegglue.parallel import one_thread
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.result_files import diagnosis_that_fits
from vegglue.wording.numbers import listed, so_many
from vegglue.workflow.case_run import case_run
from vegglue.workflow.command_model import refuse_command
from vegglue.workflow.hidden_effect import BAD_PROBE, Answer, Hidden, measured_twin, true_place, twin_base


def sealed_answer(answer: Answer) -> str:
    """The answer as text that nobody reads at a glance."""
    packed = base64.b64encode(zlib.compress(json.dumps(asdict(answer)).encode())).decode()
    return "\n".join(["# Sealed by `vegglue twin`; `vegglue reveal` opens it.", *re.findall(r".{1,76}", packed), ""])


def opened_answer(path: Path) -> Answer:
    """The answer in a file. Errors: InputError when there is no seal, or it is broken."""
    lines = read_text(path, LARGEST_JSON, "`vegglue twin` writes it").splitlines()
    try:
        # What is packed may claim to be of any size.
        unpacked = zlib.decompressobj().decompress(base64.b64decode("".join(lines[1:])), LARGEST_JSON)
        told = json.loads(unpacked)
        return Answer(**told | {"hidden": tuple(Hidden(**one) for one in told["hidden"])})
    except (ValueError, KeyError, TypeError, RecursionError, zlib.error):
        raise InputError(f"{path}: the seal is broken, make it again by `vegglue twin`.") from None


SEAL = "answer.sealed"


def write_twin(case: Case, folder: Path, station: pd.DataFrame, seal: str, force: bool = False) -> Path:
    """Write all files and return the config. force: replace what vegglue did not write, too.

    Errors: InputError when such files are there; StorageError when the folder cannot be written.
    """
    name = case_name(folder.resolve().name, "twin")
    used = _on_the_map(case, station[station["used"]])
    kinds = [kind for kind in KINDS.values() if (used["kind"] == kind.name).any()]
    tree = {
        "extends": Path(os.path.relpath(case.source, folder.resolve())).as_posix(),
        "name": name,
        "title": f"Twin of {case.name}, something may be hidden (synthetic)",
        "observations": [{"kind": kind.name, "file": kind.file, "synthetic": True} for kind in kinds],
        **{key: None for key in ("validation", "reference") if getattr(case, key) is not None},
    }
    note = f"# Made by `vegglue twin` from {case.name}; the answer is sealed in {SEAL}.\n"
    texts = {kind.file: _stations(used, kind) for kind in kinds}
    target = folder / f"{name}.yaml"
    if target.resolve() == case.source:
        raise InputError(f"--to {shown_path(folder)}: holds the config that the twin is made of; give another folder.")
    named = texts | {SEAL: seal, target.name: note + as_yaml(tree)}
    write_made({folder / file: text for file, text in named.items()}, "give another folder by --to", force)
    return target


def in_rows_of_twin(answer: Answer, station: pd.DataFrame) -> Answer:
    """The answer with bad probes by their rows in what the files of the twin hold: used stations alone, by kind.

    station: that of the case, in which they were chosen.
    """
    used, kinds = station["used"].to_numpy(), station["kind"].to_numpy()
    order = [int(row) for kind in KINDS.values() for row in np.flatnonzero(used & (kinds == kind.name))]
    hidden = [replace(one, station=order.index(one.station)) if one.station >= 0 else one for one in answer.hidden]
    return replace(answer, hidden=tuple(hidden))


def _on_the_map(case: Case, station: pd.DataFrame) -> pd.DataFrame:
    """Points of the grid on the map, as files of stations have them; as they are without a centreline."""
    line, at_point = centreline_in(case), [kind_of(name).at_point for name in station["kind"]]
    if line is None:
        return station
    x, y = on_map(line, station["x"].to_numpy(float), station["y"].to_numpy(float))
    return station.assign(x=station["x"].where(~np.array(at_point), x), y=station["y"].where(~np.array(at_point), y))


def _stations(used: pd.DataFrame, kind: Kind) -> str:
    """The stations of a kind as a table."""
    names = {"value": kind.column, "standard_error": kind.error_column}
    named = used[used["kind"] == kind.name].rename(columns=names)
    columns = ["experiment", *(["section"] if kind.velocity else []), "x", "y", *names.values()]
    return str(named[columns].to_csv(index=False, float_format="%.5f"))


def config_in(folder: Path) -> Path:
    """The config that `write_twin` left there, beside its children maybe. Errors: InputError when it cannot be told."""
    own = folder / f"{case_name(folder.resolve().name, 'twin')}.yaml"
    found = [own] if own.is_file() else sorted(folder.glob("*.yaml"))
    if len(found) != 1:
        raise InputError(f"{folder}: expected one config, got {len(found)}; `vegglue twin --to {folder}` writes it.")
    return found[0]


@one_thread()
def make_twin(
    case: Case,
    to: Path | str,
    *,
    hide: Sequence[str] = ("?",),
    snr: float = 6.0,
    noise: str = "white",
    seed: int = 1,
    force: bool = False,
) -> Case:
    """Make measurements at the stations of a case from a truth that hides something; config, tables and the sealed
    answer are written into a folder.

    hide: `EFFECT`, `EFFECT=SIZE`, `unlisted:NAME`, `bad_probe`, `nothing`, or `?` for any; snr: how visible an effect
    without a size is made [standard errors]; noise: `white`, `ar1:0.5` or `understated:1.5`; force: replace
    files there that vegglue did not write, too. Errors: InputError.
    """
    refuse_command(case, "twin")
    model = case_run(case, "runs").model
    refuse_without_parameters(case)
    station, answer = measured_twin(twin_base(model, true_place(len(model.names), seed)), hide, snr, noise, seed)
    seal = sealed_answer(in_rows_of_twin(answer, station))
    # The twin names the effect file of its case, which was trusted when that was read.
    return load_case(write_twin(case, Path(to), station, seal, force), case.effect_file is not None)


def reveal(folder: Path | str, *, runs: Path | str = "runs", trust: bool = False) -> list[str]:
    """Open the seal of a twin: what is true and, where there is a diagnosis of it, how well that guessed; one sentence
    each. trust: as for `load_case`. Errors: InputError when there is no seal, or it is broken.
    """
    folder = Path(folder)
    answer = opened_answer(folder / SEAL)
    case = load_case(config_in(folder), trust)
    there = Path(runs) / case.name
    diagnosis = diagnosis_that_fits(there / "diagnosis.h5", case_hash(case))
    lines = guess_in_words(answer, diagnosis)
    if diagnosis is None:
        lines.append(f"No diagnosis of it in {there}: {shown_command('diagnose', config_in(folder))} makes one.")
    return lines


@dataclass(frozen=True)
class Mark:
    """One hidden thing against a diagnosis. named: the verdict is this effect alone; inside: it is in the set; open:
    nothing stands out, and it is among what is not excluded.

    amplitude: whether the 95 % interval holds the true one, None when it is not in the set; away: distance [m] of the
    place that is pointed at from the true one, NaN without either; found: what counts as success for its kind.
    """

    hidden: Hidden
    named: bool
    inside: bool
    open: bool
    amplitude: bool | None
    away: float
    found: bool


def marks(answer: Answer, diagnosis: Diagnosis) -> list[Mark]:
    """One for each thing that is hidden."""
    return [_mark(hidden, diagnosis) for hidden in answer.hidden]


def _mark(hidden: Hidden, diagnosis: Diagnosis) -> Mark:
    if hidden.name == BAD_PROBE:
        there = hidden.station in diagnosis.errors.flagged
        return Mark(hidden, False, there, False, None, float("nan"), there)
    if not hidden.listed:
        away = _away(hidden, diagnosis)
        found = diagnosis.verdict.kind == "none-of-these"
        return Mark(hidden, False, False, False, None, away, found)
    if hidden.name in LAWS:
        told = _tells_of(LAWS[hidden.name], diagnosis)
        return Mark(hidden, False, told, False, None, float("nan"), told)
    inside = hidden.name in diagnosis.set
    named = diagnosis.verdict.kind == "identified" and [step.accepted for step in diagnosis.steps] == [hidden.name]
    still = hidden.name in [name for group in diagnosis.verdict.not_excluded for name in group]
    amplitude = None
    if inside:
        low, high = diagnosis.candidate_effect(hidden.name).amplitude.interval95
        amplitude = bool(low <= hidden.amplitude <= high)
    return Mark(hidden, named, inside, still, amplitude, float("nan"), inside)


def _tells_of(law: Law, diagnosis: Diagnosis) -> bool:
    """Whether a law of the same quantity in the same term is among those that a diagnosis tells."""
    laws = () if diagnosis.laws is None else diagnosis.laws.laws
    return any((one.term, one.quantity) == (law.term.words, law.quantity.words) for one in laws)


def _away(hidden: Hidden, diagnosis: Diagnosis) -> float:
    """Distance of the nearest place that is pointed at [m], NaN where there is none."""
    x, y = hidden.shapes["x"], hidden.shapes["y"]
    return float(min((np.hypot(one.x - x, one.y - y) for one in diagnosis.places), default=np.nan))


def groups_of(diagnosis: Diagnosis) -> list[int]:
    """Groups that the data cannot tell apart, counted for each step."""
    return [len(step.groups) for step in diagnosis.steps]


def _groups_in_words(diagnosis: Diagnosis) -> str:
    """`3 groups`, and with more than one step of how many each."""
    counts = [so_many(number, "group") for number in groups_of(diagnosis)]
    return counts[0] if len(counts) == 1 else f"{listed(counts)}, step by step"


def guess_in_words(answer: Answer, diagnosis: Diagnosis | None) -> list[str]:
    """The truth, and what the diagnosis made of it, one line each."""
    errors = "errors as stated" if answer.scale == 1.0 else f"errors {answer.scale:g} times those stated"
    if answer.correlation:
        errors += f", neighbours correlated by {answer.correlation:g}"
    parameters = ", ".join(f"{name} = {value:.4g}" for name, value in answer.parameters.items())
    lines = [f"True parameters: {parameters}; {errors}."]
    if not answer.hidden:
        lines.append("Nothing was hidden.")
        if diagnosis is not None:
            right = {"nothing-missing": "right", "cannot-tell": "too shy"}.get(diagnosis.verdict.kind, "a false alarm")
            lines.append(f"The diagnosis said {diagnosis.verdict.kind}: {right}.")
        return lines
    if diagnosis is None:
        return lines + [f"Hidden: {_truth(one)}." for one in answer.hidden]
    return lines + [_told(mark, diagnosis) for mark in marks(answer, diagnosis)]


def _truth(hidden: Hidden) -> str:
    if hidden.name == BAD_PROBE:
        return f"a bad probe at station {hidden.station}, {hidden.amplitude:+.3g} standard errors off"
    shapes = "".join(f", {name} = {value:.3g}" for name, value in hidden.shapes.items())
    return f"{hidden.name} of {hidden.amplitude:.4g}{shapes} (signal over noise {hidden.signal:.1f})"


def _told(mark: Mark, diagnosis: Diagnosis) -> str:
    truth = f"Hidden: {_truth(mark.hidden)}. "
    if mark.hidden.name == BAD_PROBE:
        alone = " The verdict was instrument." if diagnosis.verdict.kind == "instrument" else ""
        return truth + ("It was set aside." + alone if mark.found else "It was not noticed.")
    if not mark.hidden.listed:
        told = f"The verdict was {diagnosis.verdict.kind}"
        return truth + told + (f", {mark.away:.1f} m from it." if np.isfinite(mark.away) else ".")
    if mark.hidden.name in LAWS:
        which = "tells of a law of that quantity in that term" if mark.found else "tells of no such law"
        return f"{truth}The diagnosis said {diagnosis.verdict.kind}; it {which}."
    if mark.open:
        return truth + f"The diagnosis said {diagnosis.verdict.kind}, and lists it among what is not excluded."
    if not mark.inside:
        said = f"{diagnosis.verdict.kind} {', '.join(diagnosis.set)}".rstrip()
        return f"{truth}The diagnosis missed it; it said {said}."
    alone = "It was named alone" if mark.named else f"It is in the set, which holds {_groups_in_words(diagnosis)}"
    told = f"{truth}{alone}; the interval {'holds' if mark.amplitude else 'misses'} the true size."
    others = _other_shapes(mark.hidden, diagnosis)
    return f"{told} It was found with {others}, on which sizes depend." if others else told


def _other_shapes(hidden: Hidden, diagnosis: Diagnosis) -> str:
    """Settings of shape the effect was found with, where they differ from those of the truth by a twentieth or more."""
    found = diagnosis.candidate_effect(hidden.name).shapes
    others = [name for name, true in hidden.shapes.items() if not np.isclose(found.get(name, true), true, rtol=0.05)]
    return " and ".join(f"{name} = {found[name]:.3g} instead of {hidden.shapes[name]:.3g}" for name in others)
