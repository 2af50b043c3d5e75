"""What a stage hands on: an effect acts in its members alone, and what one from a file returns is checked."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from vegglue.effects.active_effect import ActiveEffect, applied
from vegglue.effects.definition import Amplitude, Effect, Stage
from vegglue.effects.library import effects_of, library
from vegglue.errors import InputError

# A function of the package at a stage that does not hand on what it returns: by its module it would pass as shipped.
FILE = """from vegglue.effects.boundary import discharge_error
from vegglue.effects.definition import Amplitude, Effect

EFFECTS = (Effect(
    name="mine", stage="force", title="t", equation="e", act=discharge_error,
    amplitude=Amplitude("relative_error", "-", "m", scale=0.5, low=-0.9, high=5.0),
),)
"""


@dataclass(frozen=True)
class Surroundings:
    discharge: np.ndarray = field(default_factory=lambda: np.ones((1, 1)))
    rate: np.ndarray = field(default_factory=lambda: np.full((2, 3, 2), 0.1))


def test_an_effect_of_a_file_is_checked_whatever_module_its_function_is_of(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(FILE, encoding="utf-8")
    [effect] = effects_of(tmp_path / "mine.py")
    assert effect.from_file
    active = ActiveEffect(effect, {"relative_error": np.array([0.1])})
    with pytest.raises(InputError, match="mine"):
        applied((active,), "force", Surroundings(), {"x": np.zeros(1), "y": np.zeros(1)})


def test_no_effect_of_the_package_is_taken_for_one_of_a_file() -> None:
    """Functions of the laws of the grammar have no module of the package."""
    assert not any(effect.from_file for effect in library().values())


@pytest.mark.parametrize(("stage", "name"), [("exchange", "viscosity"), ("resistance", "rate")])
def test_nothing_of_an_effect_reaches_a_member_in_which_it_is_off(stage: Stage, name: str) -> None:
    """What an effect adds, and what takes the place of what was there: not a number, so that a product would show."""
    effect = Effect(
        name="ill", stage=stage, title="t", equation="e", amplitude=Amplitude("size", "-", "m", 1.0, 0.0, 2.0),
        act=lambda seen, size: {name: np.full((2, 3, 2), np.nan)},
    )  # fmt: skip
    active = ActiveEffect(effect, {"size": np.array([0.0, 0.5])})
    found = applied((active,), stage, Surroundings(), {name: np.full((2, 3, 2), 0.1)})[name]
    assert (found[..., 0] == 0.1).all()
    assert np.isnan(found[..., 1]).all()
