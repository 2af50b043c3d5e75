"""case -> twin: measurements with a hidden effect and the encoded truth; and how well a diagnosis found it."""

import base64
import json
import re
import zlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd

from vegglue.case.config import load_case
from vegglue.case.grid import centreline_in, on_map
from vegglue.case.parameter_space import refuse_without_parameters
from vegglue.case.resolved_config import as_yaml, case_hash, write_made
from vegglue.case.schema import Case
from vegglue.case.text_files import LARGEST_JSON, case_name, read_text
from vegglue.effects.grammar import LAWS
from vegglue.errors import InputError, path_from, shown_command, shown_path
from vegglue.measurements.kinds import KINDS, point_rows
from vegglue.parallel import one_thread
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.result_files import diagnosis_that_fits
from vegglue.wording.remedies import ANOTHER_FOLDER
from vegglue.wording.sentences import phrase, sentence
from vegglue.workflow.case_run import case_run
from vegglue.workflow.command_model import refuse_command
from vegglue.workflow.hidden_effect import BAD_PROBE, Answer, Hidden, measured_twin, true_place, twin_base


def sealed_answer(answer: Answer) -> str:
    """The answer as text that is not read at a glance."""
    packed = base64.b64encode(zlib.compress(json.dumps(asdict(answer)).encode())).decode()
    return "\n".join([phrase("sealed"), *re.findall(r".{1,76}", packed), ""])


def opened_answer(path: Path) -> Answer:
    """The answer in a file.

    Raises
    ------
    InputError
        If there is no seal, or it is broken.
    """
    lines = read_text(path, LARGEST_JSON, "twin").splitlines()
    try:
        # What is packed may claim to be of any size.
        unpacked = zlib.decompressobj().decompress(base64.b64decode("".join(lines[1:])), LARGEST_JSON)
        told = json.loads(unpacked)
        return Answer(**told | {"hidden": tuple(Hidden(**one) for one in told["hidden"])})
    except (ValueError, KeyError, TypeError, RecursionError, zlib.error):
        raise InputError(f"{path}: the encoded answer is damaged; make it anew by `vegglue twin`.") from None


SEAL = "answer.sealed"


def write_twin(case: Case, folder: Path, station: pd.DataFrame, seal: str, force: bool = False) -> Path:
    """Write all files and return the config.

    Parameters
    ----------
    force : bool
        Whether to replace what vegglue did not write.

    Raises
    ------
    InputError
        If such files are there.
    StorageError
        If the folder cannot be written.
    """
    name = case_name(folder.resolve().name, "twin")
    used, line = station[station["used"]], centreline_in(case)
    if line is not None:  # files of stations have points on the map
        at_point = point_rows(used)
        x, y = on_map(line, used["x"].to_numpy(float), used["y"].to_numpy(float))
        used = used.assign(x=used["x"].where(~at_point, x), y=used["y"].where(~at_point, y))
    kinds = [kind for kind in KINDS.values() if (used["kind"] == kind.name).any()]
    tree = {
        "extends": path_from(folder.resolve(), case.source),
        "name": name,
        "title": phrase("title_of_case", "twin", case.name),
        "observations": [{"kind": kind.name, "file": kind.file, "synthetic": True} for kind in kinds],
        **{key: None for key in ("validation", "reference") if getattr(case, key) is not None},
    }
    note = phrase("made_by", "twin", {"source": case.name, "seal": SEAL}) + "\n"
    texts = {}
    for kind in kinds:
        names = {"value": kind.column, "standard_error": kind.error_column}
        columns = ["experiment", *(["section"] if kind.velocity else []), "x", "y", *names.values()]
        table = used[used["kind"] == kind.name].rename(columns=names)[columns]
        texts[kind.file] = str(table.to_csv(index=False, float_format="%.5f"))
    target = folder / f"{name}.yaml"
    if target.resolve() == case.source:
        raise InputError(f"--to {shown_path(folder)}: holds the config that the twin is made of; give another folder.")
    named = texts | {SEAL: seal, target.name: note + as_yaml(tree)}
    write_made({folder / file: text for file, text in named.items()}, ANOTHER_FOLDER, force)
    return target


def in_rows_of_twin(answer: Answer, station: pd.DataFrame) -> Answer:
    """The answer with bad probes by their rows in what the files of the twin hold: used stations alone, by kind.

    station: that of the case, in which they were chosen.
    """
    used, kinds = station["used"].to_numpy(), station["kind"].to_numpy()
    order = [int(row) for kind in KINDS.values() for row in np.flatnonzero(used & (kinds == kind.name))]
    hidden = [replace(one, station=order.index(one.station)) if one.station >= 0 else one for one in answer.hidden]
    return replace(answer, hidden=tuple(hidden))


def config_in(folder: Path) -> Path:
    """The config that `write_twin` left in a folder, maybe beside its children.

    Raises
    ------
    InputError
        If it is not clear which it is.
    """
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
    """Make synthetic measurements at the stations of a case, from a truth that hides something.

    Config, tables and the encoded truth are written into a folder.

    Parameters
    ----------
    case : Case
    to : Path or str
        The folder.
    hide : sequence of str
        `EFFECT`, `EFFECT=SIZE`, `unlisted:NAME`, `bad_probe`, `nothing`, or `?` for any.
    snr : float
        How visible an effect without a size is made [standard errors].
    noise : str
        `white`, `ar1:0.5` or `understated:1.5`.
    seed : int
    force : bool
        Whether to replace files that vegglue did not write.

    Returns
    -------
    Case

    Raises
    ------
    InputError
        For an unknown effect or noise, an effect that cannot be seen, or if a file would be replaced.
    """
    refuse_command(case, "twin")
    model = case_run(case, "runs").model
    refuse_without_parameters(case)
    station, answer = measured_twin(twin_base(model, true_place(len(model.names), seed)), hide, snr, noise, seed)
    seal = sealed_answer(in_rows_of_twin(answer, station))
    # The twin names the effect file of its case, which was trusted when that was read.
    return load_case(write_twin(case, Path(to), station, seal, force), case.effect_file is not None)


def reveal(folder: Path | str, *, runs: Path | str = "runs", trust: bool = False) -> list[str]:
    """Report the truth of a twin and, if it was diagnosed, how well the diagnosis found it.

    Parameters
    ----------
    folder : Path or str
    runs : Path or str
        Folder that holds the folders of runs.
    trust : bool
        As for `load_case`.

    Returns
    -------
    list of str
        One sentence each.

    Raises
    ------
    InputError
        If the encoded truth is missing or damaged.
    """
    folder = Path(folder)
    answer = opened_answer(folder / SEAL)
    case = load_case(config_in(folder), trust)
    there = Path(runs) / case.name
    diagnosis = diagnosis_that_fits(there / "diagnosis.h5", case_hash(case))
    lines = [sentence(one) for one in compared_with_truth(answer, diagnosis)]
    if diagnosis is None:
        lines.append(phrase("no_diagnosis_of_twin", there, shown_command("diagnose", config_in(folder))))
    return lines


@dataclass(frozen=True)
class Mark:
    """One hidden cause compared with a diagnosis.

    Attributes
    ----------
    kind : {"probe", "unlisted", "law", "effect"}
    verdict : str
        Kind of the verdict, '' without a diagnosis.
    found : bool
        Whether it counts as found for its kind of cause.
    named : bool
        Whether the verdict is this effect alone.
    inside : bool
        Whether it is in the set.
    open : bool
        Whether it is listed among what is not excluded.
    holds : bool or None
        Whether the 95 % interval holds the true amplitude, None if it is not in the set.
    away : float
        Distance of the nearest place found from the true one [m], NaN without either.
    groups : tuple of int
        Groups of effects that the data cannot separate, for each step.
    said : tuple of str
        The set.
    shapes : tuple of (str, float, float)
        Name, found and true value of shapes that differ by 5 % or more [unit of each].
    """

    hidden: Hidden
    kind: Literal["probe", "unlisted", "law", "effect"]
    verdict: str = ""
    found: bool = False
    named: bool = False
    inside: bool = False
    open: bool = False
    holds: bool | None = None
    away: float = float("nan")
    groups: tuple[int, ...] = ()
    said: tuple[str, ...] = ()
    shapes: tuple[tuple[str, float, float], ...] = ()


@dataclass(frozen=True)
class TrueParameters:
    """The true parameters of a twin, and its errors: true over stated ones [-], correlation of neighbours [-]."""

    theta: dict[str, float]
    scale: float
    correlation: float


@dataclass(frozen=True)
class NothingHidden:
    """A twin in which nothing is hidden; verdict: the kind found, '' without a diagnosis."""

    verdict: str


def marks(answer: Answer, diagnosis: Diagnosis | None) -> list[Mark]:
    """Compare each hidden cause with a diagnosis, if there is one."""
    return [mark(hidden, diagnosis) for hidden in answer.hidden]


def mark(hidden: Hidden, diagnosis: Diagnosis | None) -> Mark:
    """A hidden cause compared with a diagnosis.

    Returns
    -------
    Mark
        Kind of the cause alone, without a diagnosis.
    """
    if hidden.name == BAD_PROBE:
        none = Mark(hidden, "probe")
    elif not hidden.listed:
        none = Mark(hidden, "unlisted")
    else:
        none = Mark(hidden, "law" if hidden.name in LAWS else "effect")
    if diagnosis is None:
        return none
    none = replace(
        none,
        verdict=diagnosis.verdict.kind,
        said=tuple(diagnosis.set),
        groups=tuple(len(step.groups) for step in diagnosis.steps),
    )
    if none.kind == "probe":
        excluded = hidden.station in diagnosis.errors.flagged
        return replace(none, found=excluded, inside=excluded)
    if none.kind == "unlisted":
        x, y = hidden.shapes["x"], hidden.shapes["y"]
        away = float(min((np.hypot(one.x - x, one.y - y) for one in diagnosis.places), default=np.nan))
        return replace(none, found=none.verdict == "none-of-these", away=away)
    if none.kind == "law":
        law, others = LAWS[hidden.name], () if diagnosis.laws is None else diagnosis.laws.laws
        alike = any((one.term, one.quantity) == (law.term.words, law.quantity.words) for one in others)
        return replace(none, found=alike, inside=alike)
    still = hidden.name in [name for group in diagnosis.verdict.not_excluded for name in group]
    if hidden.name not in diagnosis.set:
        return replace(none, open=still)
    named = none.verdict == "identified" and [step.accepted for step in diagnosis.steps] == [hidden.name]
    candidate = diagnosis.candidate_effect(hidden.name)
    low, high = candidate.amplitude.interval95
    differing = tuple(
        (name, candidate.shapes.get(name, true), true)
        for name, true in hidden.shapes.items()
        if not np.isclose(candidate.shapes.get(name, true), true, rtol=0.05)
    )
    holds = bool(low <= hidden.amplitude <= high)
    return replace(none, found=True, named=named, inside=True, open=still, holds=holds, shapes=differing)


def compared_with_truth(answer: Answer, diagnosis: Diagnosis | None) -> list[TrueParameters | NothingHidden | Mark]:
    """The true parameters, and each hidden cause compared with the diagnosis, if there is one."""
    truth = TrueParameters(answer.parameters, answer.scale, answer.correlation)
    if not answer.hidden:
        return [truth, NothingHidden("" if diagnosis is None else diagnosis.verdict.kind)]
    return [truth, *marks(answer, diagnosis)]
