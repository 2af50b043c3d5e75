"""Several readings of one place: their mean, the error of their scatter, and columns that they are confounded with."""

from pathlib import Path

import numpy as np
import pytest
from field_folders import CHANNEL, JUNE, Imported, import_of, refusal_of

from vegglue.arrays import Array


def brook(tmp_path: Path, rows: str, more: str = "") -> Imported:
    """Places with repeats."""
    return import_of(tmp_path, CHANNEL + JUNE + more, runs__csv=f"section,x,y,vel\n{rows}")


def errors_of(found: Imported) -> Array:
    return found.table["standard_error"].to_numpy(float)


def test_repeats_give_their_mean_and_their_pooled_error(tmp_path: Path) -> None:
    """Also of a place with a single value; and three that agree by chance weigh no more than three that do not."""
    scatters = (0.02, 0.0, 0.01, 0.0, 0.03)
    rows = "".join(f"A,9,{place},{0.4 + part * s}\n" for place, s in enumerate(scatters) for part in (-1, 0, 1))
    found = brook(tmp_path, rows + "A,12,0.5,0.41\n")
    variance = sum(2 * s**2 for s in scatters) / 10
    assert found.values() == pytest.approx([0.4] * 5 + [0.41])
    assert errors_of(found) == pytest.approx([(variance / 3) ** 0.5] * 5 + [variance**0.5], rel=1e-3)
    assert "10 repeats" in found.taken["runs.csv"]


def test_sections_with_many_repeats_have_scatters_of_their_own(tmp_path: Path) -> None:
    rows = "".join(
        f"{section},{x},{place / 10},{0.4 + part * s:.3f}\n"
        for section, x, s, places in (("A", 9, 0.02, 15), ("B", 12, 0.04, 15), ("C", 15, 0.03, 2))
        for place in range(places)
        for part in (-1, 0, 1)
    )
    found = brook(tmp_path, rows).table.groupby("section")["standard_error"].agg(["min", "max"])
    variance = (30 * 0.02**2 + 30 * 0.04**2 + 4 * 0.03**2) / 64
    for section, s in (("A", 0.02), ("B", 0.04), ("C", variance**0.5)):
        assert found.loc[section].tolist() == pytest.approx([s / 3**0.5] * 2, rel=1e-3), section


def test_too_few_repeats_give_no_error(tmp_path: Path) -> None:
    """Three of one place may agree by chance; an error that is stated is taken."""
    rows = "".join(f"A,9,0.5,{u}\n" for u in (0.40, 0.42, 0.44)) + "A,12,0.5,0.41\n"
    found = brook(tmp_path, rows)
    assert found.values() == pytest.approx([0.42, 0.41])
    assert np.isnan(errors_of(found)).all()
    assert "2 repeats" in found.taken["runs.csv"]
    stated = brook(tmp_path, rows, "files: {runs.csv: {standard_error: 3 cm/s}}\n")
    assert errors_of(stated) == pytest.approx([0.03 / 3**0.5, 0.03], rel=1e-3)


def test_an_error_of_0_among_repeats_is_unknown(tmp_path: Path) -> None:
    rows = "x,y,u,u_se\n8,0,0.40,0.01\n8,0,0.42,0\n8,1,0.40,0.01\n8,1,0.42,0.01\n"
    found = errors_of(import_of(tmp_path, a__csv=rows))
    assert found.tolist() == pytest.approx([np.nan, 0.01 / 2**0.5], nan_ok=True)


def test_small_errors_are_kept(tmp_path: Path) -> None:
    """0.4 ml/s were rounded to 0 m3/s, which is unknown."""
    files = "files: {q.csv: {units: {discharge: ml/s}, standard_error: 0.4 ml/s}}\n"
    found = import_of(tmp_path, CHANNEL + JUNE + files, q__csv="x,Q\n8,250.4\n").table
    assert found[["value", "standard_error"]].to_numpy()[0] == pytest.approx([250.4e-6, 0.4e-6], rel=1e-6)


def logged(persistence: float, places: int, samples: int) -> Array:
    """u' at each place (places, samples): u'_i = a u'_(i-1) + sqrt(1 - a^2) e_i, of standard deviation 5 cm/s [m/s]."""
    chance = np.random.default_rng(3).normal(0.0, 0.05, (places, samples))
    for i in range(1, samples):
        chance[:, i] = persistence * chance[:, i - 1] + np.sqrt(1.0 - persistence**2) * chance[:, i]
    return chance


def test_the_mean_of_a_logged_record_has_the_error_of_its_eddies(tmp_path: Path) -> None:
    """400 samples at 25 Hz were as good as 400 measurements: errors were five times too small."""
    record = logged(0.9, places=40, samples=400)
    rows = "".join(f"A,{9 + n // 20},{n % 20 / 20},{0.4 + u:.5f}\n" for n, one in enumerate(record) for u in one)
    found = brook(tmp_path, rows)
    assert "rows are alike" in found.taken["runs.csv"]
    truth = 0.05 * np.sqrt((1.9 / 0.1) / 400)  # tau = (1 + a) / (1 - a)
    assert errors_of(found) == pytest.approx(np.full(40, truth), rel=0.3)
    assert np.std(np.array(found.values()) - 0.4) == pytest.approx(errors_of(found).mean(), rel=0.3)


def test_a_gauge_through_a_flood_is_known_by_its_range(tmp_path: Path) -> None:
    rows = "".join(f"A,9,0,{0.9 + 0.1 * np.sin(hour / 6):.4f}\n" for hour in range(48))
    assert 0.02 < errors_of(brook(tmp_path, rows)).item() < 0.08


def test_repeats_by_chance_count_each(tmp_path: Path) -> None:
    rows = "".join(f"A,9,{n / 40},{0.4 + u:.5f}\n" for n, one in enumerate(logged(0.0, 40, 40)) for u in one)
    found = brook(tmp_path, rows)
    assert "rows are alike" not in found.taken["runs.csv"]
    assert errors_of(found) == pytest.approx(np.full(40, 0.05 / 40**0.5), rel=0.5)


@pytest.mark.parametrize(
    ("values", "times", "copied"),
    [((0.4, 0.9, 0.1), "20 times", False), ((0.4, 0.43, 0.38), None, False), ((0.4, 0.4), None, True),
    ((0.4, 0.43), None, False)],
)  # fmt: skip
def test_repeats_beyond_their_errors_or_written_twice_are_reported(
    tmp_path: Path, values: tuple[float, ...], times: str | None, copied: bool
) -> None:
    """0.9 and 0.1 m/s beside 0.4, each known to 2 cm/s, were one mean known to 1 cm/s, and nothing was reported."""
    site = CHANNEL + JUNE + "files: {a.csv: {standard_error: 2 cm/s}}\n"
    table = "x,y,u\n" + "".join(f"8,1,{u}\n" for u in values) + "20,1,0.5\n"
    taken = import_of(tmp_path, site, a__csv=table).taken["a.csv"]
    assert f"{len(values) - 1} repeat" in taken
    assert (times in taken and "x = 8, y = 1 m" in taken) if times else "times their" not in taken
    assert ("same value" in taken) == copied


PLACES = [(x, y) for x in (6, 12, 18, 24) for y in (-1.0, 0.0, 1.0)]
SCATTER = np.random.default_rng(5).normal(0.0, 0.01, (len(PLACES), 3))


def survey(heading: str, factors: dict[str, float], places: str = "x;y", z: str = "") -> str:
    """One velocity for each name at each place: 0.4 m/s times the factor of the name, and chance."""
    rows = [
        ";".join(map(str, (x, y, *z.split(), name, f"{0.4 * factor + SCATTER[row, column]:.3f}")))
        for row, (x, y) in enumerate(PLACES)
        for column, (name, factor) in enumerate(factors.items())
    ]
    return "\n".join([f"{places};{heading};u", *rows])


@pytest.mark.parametrize(
    ("heading", "factors"),
    [
        ("reach", {"A": 1.0, "B": 0.5}), ("date", {"3/6/2024": 1.0, "9/7/2024": 1.3}), ("Q", {"1.8": 1.0, "2.4": 1.2}),
        ("Syvyys", {"0.1": 1.2, "0.3": 1.0, "0.6": 0.7}), ("position", {"20 %": 1.15, "80 %": 0.85}),
    ],
)  # fmt: skip
def test_two_surveys_at_the_same_places_are_no_repeats(tmp_path: Path, heading: str, factors: dict[str, float]) -> None:
    """Two reaches, two discharges, or the heights of a vertical were averaged."""
    error = refusal_of(tmp_path, a__csv=survey(heading, factors))
    assert repr(heading) in error
    assert all(name in error for name in factors)


def test_points_of_two_verticals_at_one_place_are_no_repeats(tmp_path: Path) -> None:
    upper, lower = (survey("reach", {"A": 1.0, "B": 0.5}, "x;y;z", z).split("\n") for z in ("0.2", "0.6"))
    assert "'reach'" in refusal_of(tmp_path, a__csv="\n".join([*upper, *lower[1:]]))


@pytest.mark.parametrize("factors", [{"1": 1.0, "2": 1.0, "3": 1.0}, {"Ann": 1.01, "Bob": 0.99}])
def test_repeats_of_one_flow_are_averaged(tmp_path: Path, factors: dict[str, float]) -> None:
    """Two persons read 2 % apart, always the same way."""
    found = import_of(tmp_path, a__csv=survey("by", factors))
    assert found.values() == pytest.approx([0.4] * len(PLACES), abs=0.03)


SQUARE, OBLIQUE = "[[12, 1.5], [12, -1.5]]", "[[12, 1.5], [15, -1.5]]"


@pytest.mark.parametrize(
    ("line", "section", "discharges", "kept"),
    [
        (SQUARE, "x12.00", ["0.12", "0.25", "0.25", "0.12"], []),
        (OBLIQUE, "x13.06", ["0.12", "0.25", "0.25", "0.12"], []),
        (SQUARE, "x12.00", ["1.8"] * 4, [1.8]),
    ],
)
def test_a_discharge_beside_verticals_is_that_of_the_section_or_a_share(
    tmp_path: Path, line: str, section: str, discharges: list[str], kept: list[float]
) -> None:
    rows = zip(("0.3", "1.0", "2.0", "2.7"), ("0.3", "0.5", "0.5", "0.3"), discharges, strict=True)
    table = "\n".join(["Dist (m);Velocity (m/s);Q (m3/s)", *(";".join(one) for one in rows)])
    found = import_of(tmp_path, CHANNEL + JUNE + f"files: {{a.csv: {{line: {line}}}}}\n", a__csv=table)
    assert set(found.table["section"].astype(str)) == {section}
    assert found.values() == [0.3, 0.5, 0.5, 0.3]
    assert found.values("discharge") == kept
    assert ("4 discharges" in found.taken["a.csv"]) == (not kept)


@pytest.mark.parametrize(
    ("levels", "kept"),
    [
        (["0.97", "0.97", "0.97"], [0.97]), (["0.97", "0.98", "0.97"], [0.97, 0.98, 0.97]),
        (["0.97", "", "0.97"], [0.97, 0.97]),
    ],
)  # fmt: skip
def test_a_level_that_every_vertical_repeats_counts_once(tmp_path: Path, levels: list[str], kept: list[float]) -> None:
    """One reading of a gauge weighed as many as there were verticals."""
    rows = (f"8,{y},0.4,{level}" for y, level in zip((-1, 0, 1), levels, strict=True))
    found = import_of(tmp_path, a__csv="\n".join(["x,y,u,WSE (m)", *rows]))
    assert found.values("level") == kept
    assert ("1 section taken once" in found.taken["a.csv"]) == (len(kept) == 1)
