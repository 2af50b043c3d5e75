"""What models miss, one by one and side by side: the error ladder, the baseline first."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.measurements.kinds import KINDS
from vegglue.plain_json import number_kept
from vegglue.wording.numbers import in_short, in_short_html, so_many


@dataclass(frozen=True)
class InSample:
    """Errors at what the calibration used.

    Attributes
    ----------
    rmse
        Root mean square error by kind [its unit], NaN if not measured.
    chi2, stations
        Of independent errors [-], over so many stations.
    noise_floor
        Root mean square measurement error of a velocity [m/s].
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
    """Errors of each used station when its section, or its experiment, is left out of the calibration.

    Attributes
    ----------
    sections, experiments
        (n,) [unit of the kind], NaN if nothing could be left out.
    velocity
        Which are velocities along x, or of any direction if there is none along x (n,).
    clusters
        Experiment and section of each.
    """

    sections: Array
    experiments: Array
    velocity: np.ndarray
    clusters: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class PredictiveScores:
    """How well held-out velocities are predicted with their spread; NaN if nothing could be left out.

    Attributes
    ----------
    log_score
        Mean log predictive density by sections [-].
    inside50, inside95
        Share within the 50 % and the 95 % band [-].
    """

    log_score: float
    inside50: float
    inside95: float


@dataclass(frozen=True)
class ModelScore:
    """The errors of one model of a comparison.

    Attributes
    ----------
    name, title, effects
        Of the case.
    values
        Parameters with their 95 % intervals.
    in_sample : InSample
    held_out : HeldOut
    predictive : PredictiveScores
    homogeneity
        Chance that a parameter is the same in all experiments, by name [-].
    validation
        Root mean square error of velocities that no calibration used [m/s], NaN without them.
    validation_inside95
        Share of them within the 95 % band, of a bed whose survey states its error [-]; else NaN.
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
    validation_inside95: float = float("nan")


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
        validation_inside95=number_kept(tree.get("validation_inside95")),
    )


# Errors of a step, which may be unknown.
ERRORS = ("in_sample", "held_out_sections", "held_out_experiments", "unseen", "noise_floor")


@dataclass(frozen=True)
class ComparedModel:
    """One model of a stored comparison.

    Attributes
    ----------
    name, config, config_hash
        Of the case.
    added
        Effects that the model before has not.
    parameters
        Their number.
    in_sample, held_out_sections, held_out_experiments, unseen
        Root mean square errors of velocities along x [m/s], NaN if there are none.
    noise_floor
        Measurement error [m/s].
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
    """Models side by side.

    Attributes
    ----------
    steps : tuple of ComparedModel
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
