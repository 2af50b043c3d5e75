"""Several readings of one place in files of users: their mean, and the error that their scatter gives."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from field_folders import CHANNEL, JUNE, folder_of

import vegglue
from vegglue.arrays import Array
from vegglue.measurements.observations import read_observations


def brook_of_repeats(tmp_path: Path, rows: str) -> tuple[pd.DataFrame, str]:
    """What is read of places with repeats, and what is said of their file."""
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, runs__csv=f"section,x,y,vel\n{rows}")
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    assert case.imported is not None
    return read_observations(case).table, case.imported[0].taken


def test_repeats_give_their_mean_and_their_pooled_error(tmp_path: Path) -> None:
    """Also of a place with a single value; and three that agree by chance weigh no more than three that do not."""
    scatters = (0.02, 0.0, 0.01, 0.0, 0.03)
    rows = "".join(f"A,9,{place},{0.4 + part * s}\n" for place, s in enumerate(scatters) for part in (-1, 0, 1))
    table, said = brook_of_repeats(tmp_path, rows + "A,12,0.5,0.41\n")
    variance = sum(2 * s**2 for s in scatters) / 10
    assert table["value"].tolist() == pytest.approx([0.4] * 5 + [0.41])
    assert table["standard_error"][:5].tolist() == pytest.approx([(variance / 3) ** 0.5] * 5, rel=1e-3)
    assert table["standard_error"][5] == pytest.approx(variance**0.5, rel=1e-3)
    assert "10 repeats averaged:" in said


def test_sections_with_many_repeats_have_scatters_of_their_own(tmp_path: Path) -> None:
    rows = "".join(
        f"{section},{x},{place / 10},{0.4 + part * s:.3f}\n"
        for section, x, s, places in (("A", 9, 0.02, 15), ("B", 12, 0.04, 15), ("C", 15, 0.03, 2))
        for place in range(places)
        for part in (-1, 0, 1)
    )
    table, _ = brook_of_repeats(tmp_path, rows)
    found = table.groupby("section")["standard_error"].agg(["min", "max"])
    variance = (30 * 0.02**2 + 30 * 0.04**2 + 4 * 0.03**2) / 64
    for section, s in (("A", 0.02), ("B", 0.04), ("C", variance**0.5)):
        assert found.loc[section].tolist() == pytest.approx([s / 3**0.5] * 2, rel=1e-3), section


def test_too_few_repeats_give_no_error(tmp_path: Path) -> None:
    """Three of one place may agree by chance; the file says so, and an error that is stated is taken."""
    rows = "".join(f"A,9,0.5,{u}\n" for u in (0.40, 0.42, 0.44)) + "A,12,0.5,0.41\n"
    table, said = brook_of_repeats(tmp_path, rows)
    assert table["value"].tolist() == pytest.approx([0.42, 0.41])
    assert np.isnan(table["standard_error"]).all()
    assert "2 repeats averaged, too few for a standard error: 10 are needed" in said
    stated = CHANNEL + JUNE + "files: {runs.csv: {standard_error: 3 cm/s}}\n"
    folder = folder_of(tmp_path / "other", stated, runs__csv=f"section,x,y,vel\n{rows}")
    table = read_observations(vegglue.import_folder(folder, tmp_path / "other.yaml")).table
    assert table["standard_error"].tolist() == pytest.approx([0.03 / 3**0.5, 0.03], rel=1e-3)


def test_an_error_of_0_among_repeats_is_unknown(tmp_path: Path) -> None:
    """It was averaged as 0, and halved that of the other."""
    rows = "x,y,u,u_se\n8,0,0.40,0.01\n8,0,0.42,0\n8,1,0.40,0.01\n8,1,0.42,0.01\n"
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=rows)
    found = read_observations(vegglue.import_folder(folder, tmp_path / "brook.yaml")).table["standard_error"]
    assert found.tolist() == pytest.approx([np.nan, 0.01 / 2**0.5], nan_ok=True)


def test_small_errors_are_kept(tmp_path: Path) -> None:
    """0.4 ml/s were rounded to 0 m3/s, which is unknown."""
    files = "files: {q.csv: {units: {discharge: ml/s}, standard_error: 0.4 ml/s}}\n"
    folder = folder_of(tmp_path / "flume", CHANNEL + JUNE + files, q__csv="x,Q\n8,250.4\n")
    found = read_observations(vegglue.import_folder(folder, tmp_path / "flume.yaml")).table
    assert found[["value", "standard_error"]].to_numpy()[0] == pytest.approx([250.4e-6, 0.4e-6], rel=1e-6)


def logged(persistence: float, places: int, samples: int) -> Array:
    """u' at each place (places, samples): u'_i = a u'_(i-1) + sqrt(1 - a^2) e_i, of standard deviation 5 cm/s [m/s]."""
    chance = np.random.default_rng(3).normal(0.0, 0.05, (places, samples))
    for i in range(1, samples):
        chance[:, i] = persistence * chance[:, i - 1] + np.sqrt(1.0 - persistence**2) * chance[:, i]
    return chance


def test_the_mean_of_a_logged_record_has_the_error_of_its_eddies(tmp_path: Path) -> None:
    """400 samples at 25 Hz were as good as 400 measurements: errors were five times too small, and so is chi2 then."""
    record = logged(0.9, places=40, samples=400)
    rows = "".join(f"A,{9 + n // 20},{n % 20 / 20},{0.4 + u:.5f}\n" for n, one in enumerate(record) for u in one)
    table, said = brook_of_repeats(tmp_path, rows)
    assert " in a row as one" in said
    truth = 0.05 * np.sqrt((1.9 / 0.1) / 400)  # tau = (1 + a) / (1 - a)
    assert table["standard_error"].to_numpy() == pytest.approx(np.full(40, truth), rel=0.3)
    assert np.std(table["value"] - 0.4) == pytest.approx(table["standard_error"].mean(), rel=0.3)


def test_a_gauge_through_a_flood_is_known_by_its_range(tmp_path: Path) -> None:
    rows = "".join(f"A,9,0,{0.9 + 0.1 * np.sin(hour / 6):.4f}\n" for hour in range(48))
    table, _ = brook_of_repeats(tmp_path, rows)
    assert 0.02 < table["standard_error"].item() < 0.08


def test_repeats_by_chance_count_each(tmp_path: Path) -> None:
    rows = "".join(f"A,9,{n / 40},{0.4 + u:.5f}\n" for n, one in enumerate(logged(0.0, 40, 40)) for u in one)
    table, said = brook_of_repeats(tmp_path, rows)
    assert "in a row" not in said
    assert table["standard_error"].to_numpy() == pytest.approx(np.full(40, 0.05 / 40**0.5), rel=0.5)


def test_repeats_far_beyond_their_stated_errors_are_told(tmp_path: Path) -> None:
    """0.9 and 0.1 m/s beside 0.4, each known to 2 cm/s, were one mean known to 1 cm/s, and nothing was said of it."""
    site = CHANNEL + JUNE + "files: {a.csv: {standard_error: 2 cm/s}}\n"
    for name, rows, told in (("odd", (0.4, 0.9, 0.1), True), ("even", (0.4, 0.43, 0.38), False)):
        table = "x,y,u\n" + "".join(f"8,1,{u}\n" for u in rows)
        case = vegglue.import_folder(folder_of(tmp_path / name, site, a__csv=table), tmp_path / f"{name}.yaml")
        assert case.imported is not None
        said = (
            "2 repeats averaged, which differ by 20 times their stated errors at x = 8, y = 1 m: see whether they are"
        )
        assert (said in case.imported[0].taken) == told


@pytest.mark.parametrize(("again", "copied"), [("0.40", True), ("0.43", False)])
def test_a_station_written_twice_is_told_with_its_place(tmp_path: Path, again: str, copied: bool) -> None:
    """`1 repeats averaged` stood in the line, and not where."""
    table = f"x,y,u,u_se\n8,1,0.40,0.02\n20,1,0.5,0.02\n8,1,{again},0.02\n"
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=table), tmp_path / "brook.yaml")
    assert case.imported is not None
    assert "2 of velocity, 1 repeat averaged at x = 8, y = 1 m" in case.imported[0].taken
    assert ("take the row out if it was written twice" in case.imported[0].taken) == copied
