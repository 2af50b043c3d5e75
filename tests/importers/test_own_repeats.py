"""Several readings of one place in files of users: their mean, and the error that their scatter gives."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from field_folders import CHANNEL, JUNE, folder_of

import vegglue
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
