"""The error ladder as it is kept for the page: what each model of a comparison misses, the baseline first."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from vegglue.plain_json import number_kept

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
    verdict: the sentence of the diagnosis that named what was added. Both are '' where nobody searched. unclear: names
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
    steps = tuple(_step_from(step) for step in tree["steps"])
    return ModelComparison(
        steps, int(tree["left_out"]), str(tree["reason"]), str(tree["verdict"]), tuple(map(str, tree["unclear"]))
    )


def _step_from(step: Mapping[str, Any]) -> ComparedModel:
    errors = {name: number_kept(step[name]) for name in ERRORS}
    return ComparedModel(**{**step, **errors, "added": tuple(step["added"])})
