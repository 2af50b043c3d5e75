"""What models miss, one by one and side by side: the error ladder, the baseline first."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.measurements.kinds import KINDS
from vegglue.plain_json import number_kept


@dataclass(frozen=True)
class InSample:
    """Errors at what the calibration has seen: root mean square by kind [its unit], NaN for what was not measured; chi2
    of independent errors [-] over so many stations, and the root mean square error of measuring a velocity [m/s].
    """

    rmse: dict[str, float]
    chi2: float
    stations: int
    noise_floor: float

    @property
    def velocity(self) -> float:
        """That of velocities along x, else of the first other direction that was measured [m/s]; NaN without any."""
        of_kinds = (self.rmse[kind.name] for kind in KINDS.values() if kind.velocity)
        return next((error for error in of_kinds if np.isfinite(error)), float("nan"))


@dataclass(frozen=True)
class HeldOut:
    """Errors of each used station (n,) when its section, or its experiment, is left out of the calibration; NaN where
    nothing could be left out. velocity: which are velocities along x, or in whatever direction where none is [m/s];
    clusters: the experiment and the section of each.
    """

    sections: Array
    experiments: Array
    velocity: np.ndarray
    clusters: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class PredictiveScores:
    """How well held-out velocities are predicted with their spread: mean log predictive density by sections, and the
    share within the 50 % and the 95 % band [-]; NaN where nothing could be left out.
    """

    log_score: float
    inside50: float
    inside95: float


@dataclass(frozen=True)
class ModelScore:
    """One model of the ladder. values: parameters with their 95 % intervals; homogeneity: chance that a parameter is
    the same in all experiments, by name; validation: root mean square error of velocities that no calibration has seen
    [m/s], NaN without them.
    """

    name: str
    title: str
    effects: tuple[str, ...]
    values: dict[str, tuple[float, float, float]]
    in_sample: InSample
    held_out: HeldOut
    predictive: PredictiveScores
    homogeneity: dict[str, float]
    validation: float


def model_score_from(tree: Mapping[str, Any]) -> ModelScore:
    """The score of a model from an object of JSON, which has null for no number.

    Errors: KeyError, TypeError or ValueError where it is none.
    """
    seen, held_out = tree["in_sample"], tree["held_out"]
    return ModelScore(
        name=str(tree["name"]),
        title=str(tree["title"]),
        effects=tuple(tree["effects"]),
        values={name: (number_kept(a), number_kept(b), number_kept(c)) for name, (a, b, c) in tree["values"].items()},
        in_sample=InSample(
            rmse={kind: number_kept(seen["rmse"][kind]) for kind in KINDS},
            chi2=number_kept(seen["chi2"]),
            stations=int(seen["stations"]),
            noise_floor=number_kept(seen["noise_floor"]),
        ),
        held_out=HeldOut(
            sections=np.array([number_kept(error) for error in held_out["sections"]]),
            experiments=np.array([number_kept(error) for error in held_out["experiments"]]),
            velocity=np.array([bool(one) for one in held_out["velocity"]]),
            clusters=tuple((str(experiment), str(section)) for experiment, section in held_out["clusters"]),
        ),
        predictive=PredictiveScores(**{name: number_kept(value) for name, value in tree["predictive"].items()}),
        homogeneity={name: number_kept(p) for name, p in tree["homogeneity"].items()},
        validation=number_kept(tree["validation"]),
    )


# Errors of a step, which may be unknown.
ERRORS = ("in_sample", "held_out_sections", "held_out_experiments", "unseen", "noise_floor")


@dataclass(frozen=True)
class ComparedModel:
    """One model: its case and config hash, the effects it has and the model before has not, how many parameters.

    Root mean square errors of velocities along x [m/s], NaN where there are none: of what the model was calibrated to,
    of sections and of experiments left out in turn, of what no calibration has seen; and the error of measuring.
    """

    name: str
    config: str
    config_hash: str
    added: tuple[str, ...]
    parameters: int
    in_sample: float
    held_out_sections: float
    held_out_experiments: float
    unseen: float
    noise_floor: float


@dataclass(frozen=True)
class ModelComparison:
    """Models side by side; left_out: measurements that none of them uses; reason: why it ends where it does, in words;
    verdict: digest of the verdict that named what was added. Both are '' where nobody searched. unclear: names
    of what was added whose fall of held-out errors cannot be told from none.
    """

    steps: tuple[ComparedModel, ...]
    left_out: int
    reason: str
    verdict: str = ""
    unclear: tuple[str, ...] = ()


def comparison_from(tree: Mapping[str, Any]) -> ModelComparison:
    """The comparison of an object of JSON, which has null for no number.

    Errors: KeyError, TypeError or ValueError where it is none.
    """
    steps = []
    for step in tree["steps"]:
        errors = {name: number_kept(step[name]) for name in ERRORS}
        steps.append(ComparedModel(**{**step, **errors, "added": tuple(step["added"])}))
    reason, verdict, unclear = str(tree["reason"]), str(tree["verdict"]), tuple(map(str, tree["unclear"]))
    return ModelComparison(tuple(steps), int(tree["left_out"]), reason, verdict, unclear)
