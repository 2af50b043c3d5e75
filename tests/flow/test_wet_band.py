"""The rows that are solved are those where a member's own bed may be wet, as in the whole problem."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from reach import COARSE, write_reach

from vegglue.case.config import load_case
from vegglue.case.gridded_site import Site, build_site
from vegglue.case.parameter_space import sample_prior
from vegglue.flow.problem import EMPTY, InflowSegment, Problem, crop
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.sensor import flow_fields
from vegglue.flow.wet_band import overflows, wet_band

LEVEL = 0.95


@pytest.fixture(scope="module")
def brook(tmp_path_factory: pytest.TempPathFactory) -> tuple[Site, Problem]:
    folder: Path = tmp_path_factory.mktemp("band")
    case = load_case(write_reach(folder, COARSE))
    site = build_site(case)
    return site, build_problem(case, site, "June", sample_prior(case.parameters, 1, 1))


def still(problem: Problem) -> np.ndarray:
    state = np.zeros((problem.shape[0], 3, problem.shape[1], 1))
    state[:, 0] = LEVEL
    return state


@pytest.mark.parametrize("rise", [-0.4, 0.0, 0.3])
def test_a_bed_that_a_member_has_higher_counts_as_any_other(brook: tuple[Site, Problem], rise: float) -> None:
    site, plain = brook
    risen = replace(plain, bed_rise=np.full((*plain.shape, 1), rise))
    moved = replace(plain, bed=plain.bed + rise, bed_rise=EMPTY)
    band, state = wet_band(moved, still(moved)), still(plain)
    assert wet_band(risen, state) == band
    inner = (band[0] + 3, band[1] - 3)
    of_inner = [
        replace(one, bed=one.bed[:, slice(*inner)], bed_rise=one.bed_rise[:, slice(*inner)]) for one in (risen, moved)
    ]
    found, wanted = (overflows(one, state[:, :, slice(*inner)], inner, plain.shape[1]) for one in of_inner)
    assert found.tolist() == wanted.tolist()
    there, here = (flow_fields(one, state, site.grid) for one in (risen, moved))
    np.testing.assert_allclose(there.bed, here.bed)
    np.testing.assert_array_equal(np.isnan(there.level), np.isnan(here.level))
    assert np.nanmax(np.abs(there.level - there.bed - there.depth)) < 0.25, "a cell on a bank is filled in part"


def test_an_inflow_over_dry_rows_is_in_the_band(brook: tuple[Site, Problem]) -> None:
    """It was a traceback: its rows were cut out."""
    _, plain = brook
    apart = InflowSegment("west", plain.shape[1] - 2, plain.shape[1], np.array([0.1]))
    more = replace(plain, boundaries=replace(plain.boundaries, inflows=(*plain.boundaries.inflows, apart)))
    low = still(plain)
    low[:, 0] -= 0.6
    assert wet_band(plain, low)[1] == plain.shape[1] - 2
    assert wet_band(more, low)[1] == plain.shape[1]


def test_cells_at_the_edge_of_the_band_fill_as_in_the_whole(brook: tuple[Site, Problem]) -> None:
    """Beside a steep wall half of their range was lost, and 5 % of the discharge with it."""
    _, plain = brook
    walled = replace(plain, bed=np.where(np.arange(plain.shape[1]) % 9 == 4, 3.0, plain.bed))
    part = crop(walled, 4, 11)
    np.testing.assert_array_equal(part.bed_half_range, walled.bed_half_range[:, 4:11])
    assert crop(part, 1, 5).bed_half_range.tolist() == walled.bed_half_range[:, 5:9].tolist()
