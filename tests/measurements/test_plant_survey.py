"""The plant survey: read strictly, and to phi as by hand."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from vegglue.case.schema import Survey
from vegglue.errors import InputError
from vegglue.measurements.plant_survey import read_survey, rigid_cylinder

FILE = Path(__file__).parents[2] / "data" / "kict" / "plant_survey.csv"
SURVEY = read_survey(FILE)
CERTAIN = {name: dataclasses.replace(quantity, standard_deviation=0.0) for name, quantity in SURVEY.items()}


def test_means_give_the_sum_by_hand():
    upright = rigid_cylinder(CERTAIN, Survey(file=FILE), draws=10)
    assert upright.mean == pytest.approx(22 * 0.010 * 0.43 + 22 * 15 * 0.003 * (1.06 - 0.43))
    assert upright.parts["stems"] == pytest.approx(0.0946)
    assert upright.standard_deviation == pytest.approx(0.0, abs=1e-12)


def test_bending_at_the_bed_shortens_all_by_one_cosine():
    bent = rigid_cylinder(CERTAIN, Survey(file=FILE, debris=True, deflected_height=0.8), draws=10)
    assert bent.mean == pytest.approx((22 * 0.015 * 0.43 + 22 * 15 * 0.003 * 0.63) * 0.8 / 1.06)


def test_undergrowth_adds_its_own_stems_upright():
    choice = Survey(file=FILE, deflected_height=0.8, undergrowth_density=(400.0, 400.0001))
    assert rigid_cylinder(CERTAIN, choice, draws=10).parts["undergrowth"] == pytest.approx(400 * 0.004 * 0.29, rel=1e-6)
    low = Survey(file=FILE, deflected_height=0.1, undergrowth_density=(400.0, 400.0001))
    assert rigid_cylinder(CERTAIN, low, draws=10).parts["undergrowth"] == pytest.approx(400 * 0.004 * 0.1, rel=1e-6)


def test_cleaned_willows_agree_with_the_paper():
    """0.76 +- 0.20 in Berends et al. (2020)."""
    cleaned = rigid_cylinder(SURVEY, Survey(file=FILE))
    assert cleaned.mean == pytest.approx(0.76, abs=0.06)
    assert cleaned.standard_deviation == pytest.approx(0.20, abs=0.05)


def test_error_of_the_mean_is_far_smaller_than_the_spread_of_plants():
    spread = rigid_cylinder(SURVEY, Survey(file=FILE))
    mean = rigid_cylinder(SURVEY, Survey(file=FILE, spread="mean"))
    assert mean.mean == pytest.approx(spread.mean, rel=0.02)
    # the branches dominate: 50 of them were measured
    assert mean.standard_deviation == pytest.approx(spread.standard_deviation / np.sqrt(50), rel=0.15)


def test_draws_are_positive_keep_mean_and_deviation_and_repeat_with_the_seed():
    choice = Survey(file=FILE, debris=True, deflected_height=0.8, undergrowth_density=(100.0, 1000.0))
    first, again = rigid_cylinder(SURVEY, choice), rigid_cylinder(SURVEY, choice)
    assert (first.draws > 0.0).all()
    assert np.array_equal(first.draws, again.draws)
    assert not np.array_equal(first.draws, rigid_cylinder(SURVEY, choice, seed=2).draws)
    density = 900.0 / np.log(10.0)
    assert first.parts["undergrowth"] == pytest.approx(density * 0.004 * 0.29, rel=0.05)


def test_the_assumed_density_is_kept():
    choice = Survey(file=FILE, undergrowth_density=(100.0, 1000.0))
    assert rigid_cylinder(SURVEY, choice, draws=10).undergrowth_density == (100.0, 1000.0)
    assert rigid_cylinder(SURVEY, Survey(file=FILE), draws=10).undergrowth_density is None


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("stems,twenty,0,1", "mean, .*'twenty'"), ("stems,-22,0,1", "mean"), ("stems,22,-1,1", "deviation"),
        ("stems,22,0,0", "sample"), ("stalks,22,0,1", "plant_height"), ("stem_height,0.4,0.01,66", "row 3"), ("", ""),
    ],
)  # fmt: skip
def test_a_wrong_row_is_refused_by_name(tmp_path, line, words):
    file = tmp_path / "survey.csv"
    file.write_text(FILE.read_text().replace("stems,22,0,1", line))
    with pytest.raises(InputError, match=f"row 9: .*{words}"):
        read_survey(file)


def test_a_missing_quantity_and_a_missing_file_are_refused(tmp_path):
    file = tmp_path / "survey.csv"
    file.write_text(FILE.read_text().replace("stems,22,0,1\n", ""))
    with pytest.raises(InputError, match="stems; add"):
        read_survey(file)
    with pytest.raises(InputError, match=r"nowhere\.csv"):
        read_survey(tmp_path / "nowhere.csv")
