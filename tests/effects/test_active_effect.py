"""What an effect from a file returns is checked: whether it is one stands in the value."""

from pathlib import Path

import numpy as np
import pytest

from vegglue.effects.active_effect import ActiveEffect, applied
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


class Surroundings:
    discharge = np.ones((1, 1))


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
