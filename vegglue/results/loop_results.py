"""What the loop leaves beside a diagnosis: what models miss, one by one and side by side, the baseline first; and what
is still to be separated, with the measurements that could.

They are kept as JSON in the folder of a run: rung.json, comparison.json and questions.json, each with the config hash.
What belongs to another state of the case, or cannot be read, counts as not there.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, get_args

import numpy as np
from pydantic import BeforeValidator, PlainValidator

from vegglue.arrays import Array
from vegglue.case.text_files import LARGEST_JSON, read_text, write_text
from vegglue.measurements.kinds import KINDS
from vegglue.plain_json import plain
from vegglue.results.type_adapters import type_adapter
from vegglue.wording.numbers import in_short, in_short_html, so_many
from vegglue.wording.remedies import MAKE_ROOM
from vegglue.wording.sentences import phrase, sentence, tag_of, tagged

# Numbers of JSON, which has null for what is none.
KeptNumber = Annotated[float, BeforeValidator(lambda kept: math.nan if kept is None else kept)]
KeptErrors = Annotated[
    Array, PlainValidator(lambda kept: np.array(type_adapter(list[KeptNumber]).validate_python(kept)))
]
KeptFlags = Annotated[np.ndarray, PlainValidator(lambda kept: np.array(type_adapter(list[bool]).validate_python(kept)))]


@dataclass(frozen=True)
class InSample:
    """Errors at what the calibration used.

    Attributes
    ----------
    rmse : dict of float
        Root mean square error by kind [its unit], NaN if not measured.
    chi2 : float
        Of independent errors [-].
    stations : int
        Over how many.
    noise_floor : float
        Root mean square measurement error of a velocity [m/s].
    """

    rmse: dict[str, KeptNumber]
    chi2: KeptNumber
    stations: int
    noise_floor: KeptNumber

    @property
    def velocity(self) -> float:
        """That of velocities along x, else of the first other direction that was measured [m/s]; NaN without any."""
        of_kinds = (self.rmse.get(kind.name, math.nan) for kind in KINDS.values() if kind.velocity)
        return next((error for error in of_kinds if np.isfinite(error)), math.nan)


@dataclass(frozen=True)
class HeldOut:
    """Errors of each used station when its section, or its experiment, is left out of the calibration.

    Attributes
    ----------
    sections, experiments : ndarray (n,)
        [unit of the kind], NaN if nothing could be left out.
    velocity : ndarray of bool (n,)
        Which are velocities along x, or of any direction if there is none along x.
    clusters : tuple of (str, str)
        Experiment and section of each.
    """

    sections: KeptErrors
    experiments: KeptErrors
    velocity: KeptFlags
    clusters: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class PredictiveScores:
    """How well held-out velocities are predicted with their spread; NaN if nothing could be left out.

    Attributes
    ----------
    log_score : float
        Mean log predictive density by sections [-].
    inside50, inside95 : float
        Share within the 50 % and the 95 % band [-].
    """

    log_score: KeptNumber
    inside50: KeptNumber
    inside95: KeptNumber


@dataclass(frozen=True)
class ModelScore:
    """The errors of one model of a comparison.

    Attributes
    ----------
    name, title : str
        Of the case.
    effects : tuple of str
        Of the case.
    values : dict of (float, float, float)
        Parameters with their 95 % intervals.
    homogeneity : dict of float
        Chance that a parameter is the same in all experiments, by name [-].
    validation : float
        Root mean square error of velocities that no calibration used [m/s], NaN without them.
    validation_inside95 : float
        Share of them within the 95 % band, of a bed whose survey states its error [-]; else NaN.
    """

    name: str
    title: str
    effects: tuple[str, ...]
    values: dict[str, tuple[KeptNumber, KeptNumber, KeptNumber]]
    in_sample: InSample
    held_out: HeldOut
    predictive: PredictiveScores
    homogeneity: dict[str, KeptNumber]
    validation: KeptNumber
    validation_inside95: KeptNumber = math.nan


@dataclass(frozen=True)
class ComparedModel:
    """One model of a stored comparison.

    Attributes
    ----------
    name, config, config_hash : str
        Of the case.
    added : tuple of str
        Effects that the model before has not.
    parameters : int
        Their number.
    in_sample, held_out_sections, held_out_experiments, unseen : float
        Root mean square errors of velocities along x [m/s], NaN if there are none.
    noise_floor : float
        Measurement error [m/s].
    """

    name: str
    config: str
    config_hash: str
    added: tuple[str, ...]
    parameters: int
    in_sample: KeptNumber
    held_out_sections: KeptNumber
    held_out_experiments: KeptNumber
    unseen: KeptNumber
    noise_floor: KeptNumber


@dataclass(frozen=True)
class ModelComparison:
    """Models side by side.

    Attributes
    ----------
    left_out
        Number of readings excluded for all.
    reason
        Why it ends; empty unless models were searched.
    verdict
        Digest of the verdict that named what was added; empty unless models were searched.
    unclear
        Names of what was added although the fall of held-out errors may be chance.
    """

    steps: tuple[ComparedModel, ...]
    left_out: int
    reason: str
    verdict: str = ""
    unclear: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return in_short(
            f"Comparison of {so_many(len(self.steps), 'model')}",
            [
                f"{one.name}: RMSE {one.in_sample:.3g} m/s, sections left out {one.held_out_sections:.3g} m/s"
                for one in self.steps
            ],
        )

    def _repr_html_(self) -> str:
        headings = ("model", "parameters", "RMSE [m/s]", "sections left out", "experiments left out", "validation")
        rows = [
            (
                one.name,
                f"{one.parameters}",
                *(
                    "" if np.isnan(error) else f"{error:.3g}"
                    for error in (one.in_sample, one.held_out_sections, one.held_out_experiments, one.unseen)
                ),
            )
            for one in self.steps
        ]
        return in_short_html(repr(self).split("\n")[0], headings, rows)


# Below this D^2 a measurement does not separate anything.
SEPARATES = 4.0
# Measurements shown of each question: more than these cannot be planned in one season.
SHOWN = 4
# A measurement that raises D^2 by less than a tenth adds nothing.
ADDS = 1.1


@dataclass(frozen=True)
class RivalEffects:
    """Effects, laws or places to separate from each other."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class OneOfRivals:
    """One of several rivals to separate from all others."""

    name: str
    others: tuple[str, ...]


@dataclass(frozen=True)
class HiddenEffect:
    """An effect to separate from a change of the parameter that leaves its trace."""

    name: str
    parameter: str


@dataclass(frozen=True)
class HiddenLaw:
    """A law to separate from what calibration absorbs."""

    name: str


Subject = RivalEffects | OneOfRivals | HiddenEffect | HiddenLaw
SUBJECTS: dict[str, type] = {tag_of(one): one for one in get_args(Subject)}
KeptSubject = PlainValidator(lambda kept: type_adapter(SUBJECTS[kept["kind"]]).validate_python(kept))


@dataclass(frozen=True)
class ProposedMeasurement:
    """A measurement that could separate rivals.

    Attributes
    ----------
    name : str
        In words.
    x : float
        [m]
    stations : int
        How many.
    hours : float
        Field work [h].
    now, then : float
        Squared standard errors D^2 between the nearest rivals, now and with it [-].
    """

    name: str
    experiment: str
    x: float
    stations: int
    hours: float
    now: float
    then: float

    @property
    def per_hour(self) -> float:
        """What it adds to D^2 for each hour of field work [1/h]."""
        return (self.then - self.now) / self.hours


@dataclass(frozen=True)
class Question:
    """What to separate, and the measurements that could.

    Attributes
    ----------
    about : Subject
        The rivals.
    measurements : tuple of ProposedMeasurement
        By what they add in an hour.
    seen_from : float
        D^2 from which a diagnosis detects it 19 times of 20 [-]; infinite if that depends on no size.
    """

    about: Annotated[Subject, KeptSubject]
    measurements: tuple[ProposedMeasurement, ...]
    seen_from: Annotated[float, BeforeValidator(lambda kept: math.inf if kept is None else kept)] = math.inf

    @property
    def tells_apart(self) -> str:
        """What is to be separated, in words."""
        return sentence(self.about)

    @property
    def answered(self) -> bool:
        """Whether the data at hand would have shown it."""
        return any(one.now >= self.seen_from for one in self.measurements)

    @property
    def useful(self) -> tuple[ProposedMeasurement, ...]:
        """Those that would separate it by themselves, the few best ones; none if it is answered."""
        if self.answered:
            return ()
        enough = (one for one in self.measurements if one.then >= SEPARATES and one.then > ADDS * one.now)
        return tuple(enough)[:SHOWN]

    @property
    def nearest(self) -> ProposedMeasurement | None:
        """The measurement that comes nearest to it, if there is any."""
        return max(self.measurements, key=lambda one: one.then, default=None)

    def __repr__(self) -> str:
        return "\n".join([sentence(self), *(f"- {phrase('proposed_measurement', one)}" for one in self.useful)])


SCORE_FORMAT, COMPARISON_FORMAT, QUESTIONS_FORMAT = "vegglue rung 1", "vegglue comparison 3", "vegglue questions 4"
SCORE_FILE, COMPARISON_FILE, QUESTIONS_FILE = "rung.json", "comparison.json", "questions.json"
# A measurement that is left out: where it stands, and its value.
MeasurementRow = Sequence[str | float]


@dataclass(frozen=True)
class KeptScore:
    """A score, and the measurements that were left out."""

    left_out: list[Any]
    rung: ModelScore


def write_model_score(folder: Path, score: ModelScore, left_out: Sequence[MeasurementRow], config_hash: str) -> None:
    """Keep what a model misses, calibrated without some measurements. Errors: StorageError."""
    _write(folder / SCORE_FILE, SCORE_FORMAT, config_hash, asdict(KeptScore([*map(list, left_out)], score)))


def model_score_that_fits(folder: Path, left_out: Sequence[MeasurementRow], config_hash: str) -> ModelScore | None:
    """What the model of exactly this config misses, without exactly these measurements; None where it is not kept."""
    kept = _read_if_it_fits(folder / SCORE_FILE, SCORE_FORMAT, config_hash, KeptScore)
    return kept.rung if kept is not None and kept.left_out == [*map(list, left_out)] else None


def write_comparison(folder: Path, comparison: ModelComparison, config_hash: str) -> None:
    """Keep a comparison in the folder of one of its models, whose config hash is given. Errors: StorageError."""
    _write(folder / COMPARISON_FILE, COMPARISON_FORMAT, config_hash, asdict(comparison))


def comparison_that_fits(folder: Path, config_hash: str) -> ModelComparison | None:
    """The comparison kept there for exactly this config, None without."""
    return _read_if_it_fits(folder / COMPARISON_FILE, COMPARISON_FORMAT, config_hash, ModelComparison)


def write_questions(folder: Path, questions: Sequence[Question], config_hash: str) -> None:
    """Keep what to measure next, which may be nothing. Errors: StorageError."""
    _write(folder / QUESTIONS_FILE, QUESTIONS_FORMAT, config_hash, tagged(tuple(questions)))


def questions_that_fit(folder: Path, config_hash: str) -> tuple[Question, ...] | None:
    """The questions kept there for exactly this config; None if none were asked, empty if nothing is left to ask."""
    return _read_if_it_fits(folder / QUESTIONS_FILE, QUESTIONS_FORMAT, config_hash, tuple[Question, ...])


def _write(path: Path, file_format: str, config_hash: str, told: Any) -> None:
    tree = {"format": file_format, "config_hash": config_hash, "told": told}
    write_text(path, json.dumps(plain(tree), ensure_ascii=False, indent=1, allow_nan=False) + "\n", MAKE_ROOM)


def _read_if_it_fits(path: Path, file_format: str, config_hash: str, kind: Any) -> Any:
    """A value of this kind, None where there is none of this format and config."""
    try:
        tree = json.loads(read_text(path, LARGEST_JSON))
        if (tree["format"], tree["config_hash"]) != (file_format, config_hash):
            return None
        return type_adapter(kind).validate_python(tree["told"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        return None
