"""Copies of rows are no repeats: where a table was pasted twice its errors do not shrink, and honest repeats stay."""

from pathlib import Path

import pytest
from field_folders import field_folder

import vegglue
from vegglue.importers.table_parser import ParsedTable, without_copies
from vegglue.measurements.observations import read_observations

SURVEY = [f"low,A,12,{number / 10},{0.4 + number / 100},0.012" for number in range(12)]
HEADING = "experiment,section,x,y,u,u_se"


def kept_of(rows: list[str]) -> list[str]:
    texts, numbers = tuple([row] for row in rows), tuple(range(2, len(rows) + 2))
    return [fields[0] for fields in without_copies(ParsedTable(("row",), ("",), texts, numbers, False, "")).rows]


@pytest.mark.parametrize("times", [1, 4])
def test_a_table_pasted_four_times_is_as_good_as_once(tmp_path: Path, times: int) -> None:
    """Its 684 copies were averaged as repeats, and its errors halved."""
    folder = field_folder(tmp_path / "brook")
    (folder / "v.csv").write_text("\n".join([HEADING, *SURVEY * times]) + "\n", encoding="utf-8")
    (folder / "velocities.csv").unlink()
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    table = read_observations(case).table
    velocities = table[table["kind"] == "velocity"]
    assert len(velocities) == 12
    assert set(velocities["standard_error"]) == {0.012}
    assert case.imported is not None
    assert ("36 rows are copies of others and count once; 12 rows" in case.imported[0].taken) == (times == 4)
    assert "repeats averaged" not in case.imported[0].taken


@pytest.mark.parametrize(
    ("rows", "kept"),
    [
        ([row for row in SURVEY for _ in range(3)], SURVEY),
        ([*SURVEY, SURVEY[3]] * 2, [*SURVEY, SURVEY[3]]),
        (["a", *SURVEY, "b", *SURVEY[:11]], ["a", *SURVEY, "b"]),
        ([*SURVEY, "b", *SURVEY, *SURVEY], [*SURVEY, "b"]),
    ],
)
def test_tables_and_stretches_that_stand_there_again_are_copies(rows: list[str], kept: list[str]) -> None:
    assert kept_of(rows) == kept


@pytest.mark.parametrize(
    "rows",
    [
        SURVEY,
        SURVEY[:4] * 3,  # four places, where all repeats may agree by chance
        [*SURVEY, *SURVEY[:9]],
        [*SURVEY, "b", *reversed(SURVEY)],
        [SURVEY[0]] * 30,
        [*SURVEY[:6], *SURVEY[:3], "other", *SURVEY[4:6]],  # a second pass, whose fourth reading differs
    ],
)
def test_repeats_that_agree_in_few_digits_stay(rows: list[str]) -> None:
    assert kept_of(rows) == rows
