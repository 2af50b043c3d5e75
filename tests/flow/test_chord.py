"""Members that pass through a few lanes: who ends how, and that company does not matter."""

import numpy as np
import pytest
from channels import family, river, solved

from vegglue.flow.chord import LONGEST_CORRECTION, ChordSolution, IterationLimits, chord, is_near_enough, stream
from vegglue.flow.jacobian import Factors, factors
from vegglue.flow.newton import finish
from vegglue.flow.problem import Problem, take


def neighbours(seed: int, members: int) -> tuple[Problem, np.ndarray, Factors]:
    """Members at random places, the state of the first, and its factors."""
    batch = family(np.random.default_rng(seed).random((members, 2)))
    first = take(batch, np.array([0]))
    centre = solved(first)
    return batch, centre, factors(first, centre)


def test_members_pass_through_few_lanes_as_they_would_all_at_once():
    batch, centre, shared = neighbours(8, 11)
    together = chord(batch, np.repeat(centre, 11, axis=3), shared, 1e-9)
    found: dict[int, tuple[bool, np.ndarray]] = {}
    entered: list[int] = []

    def starts_of(members: np.ndarray) -> np.ndarray:
        entered.append(members.size)
        return np.repeat(centre, members.size, axis=3)

    def note(members: np.ndarray, ended: ChordSolution) -> None:
        for lane, member in enumerate(members):
            assert member not in found
            found[int(member)] = bool(ended.converged[lane]), ended.state[..., lane]

    stream(batch, np.arange(11)[::-1], starts_of, shared, 1e-9, IterationLimits(25), 4, note)
    assert sorted(found) == list(range(11))
    assert sum(entered) == 11
    assert max(entered) <= 4
    assert together.converged.all()
    for member, (converged, state) in found.items():
        assert converged
        assert np.abs(state - together.state[..., member]).max() < 1e-7


def test_a_member_that_strays_ends_and_spoils_no_other():
    batch, centre, shared = neighbours(9, 4)
    start = np.repeat(centre, 4, axis=3)
    start[..., 2] = np.nan
    end = chord(batch, start, shared, 1e-8)
    assert end.converged.tolist() == [True, True, False, True]
    assert np.isfinite(end.state[..., [0, 1, 3]]).all()


def test_who_enters_the_lane_of_one_that_strayed_is_not_spoilt():
    batch, centre, shared = neighbours(10, 6)
    start = np.repeat(centre, 6, axis=3)
    start[..., :2] = np.nan
    found: dict[int, bool] = {}

    def note(members: np.ndarray, ended: ChordSolution) -> None:
        found.update(zip(members.tolist(), ended.converged.tolist(), strict=True))

    stream(batch, np.arange(6), lambda some: start[..., some], shared, 1e-8, IterationLimits(25), 3, note)
    assert found == {0: False, 1: False, 2: True, 3: True, 4: True, 5: True}


def test_one_that_strayed_is_not_taken_up_again():
    """Its state may be anything: no factors are made there, and its correction says so."""
    problem = river()
    near = solved(problem)
    far = near + 0.3 * np.random.default_rng(0).standard_normal(near.shape)
    shared = factors(problem, near)
    end = chord(problem, far, shared, 1e-8)
    assert not end.converged[0]
    assert np.isinf(end.correction[0])
    _, kept = finish(problem, far, 1e-8)
    assert kept is None


def test_who_ends_a_step_early_is_as_near_as_asked_for():
    """Some end with a correction above the tolerance, and are within it after the step all the same."""
    batch, centre, shared = neighbours(13, 16)
    exact = chord(batch, np.repeat(centre, 16, axis=3), shared, 1e-11)
    early = chord(batch, np.repeat(centre, 16, axis=3), shared, 1e-5)
    assert early.converged.all()
    assert (early.correction > 1e-5).any()
    assert np.abs(early.state - exact.state)[:-1].max() < 1e-5


def test_one_lane_serves_all():
    batch, centre, shared = neighbours(11, 3)
    ends: list[int] = []
    stream(
        batch,
        np.arange(3),
        lambda some: np.repeat(centre, len(some), axis=3),
        shared,
        1e-8,
        IterationLimits(40),
        1,
        lambda members, end: ends.extend(members[end.converged]),
    )
    assert ends == [0, 1, 2]


def test_who_waits_alone_enters_while_others_are_at_work():
    """Two of four lanes are free at once, and a single member waits: it does not wait for all."""
    batch, centre, shared = neighbours(12, 5)
    together = chord(batch, np.repeat(centre, 5, axis=3), shared, 1e-9)
    asked: list[tuple[int, int]] = []
    done: list[int] = []

    def starts_of(some: np.ndarray) -> np.ndarray:
        asked.append((len(some), len(done)))
        return np.repeat(centre, len(some), axis=3)

    stream(
        batch, np.arange(5), starts_of, shared, 1e-9, IterationLimits(60), 4, lambda members, end: done.extend(members)
    )
    assert len(set(together.iterations)) > 1, "else all end at once"
    assert asked[1][0] == 1
    assert asked[1][1] < 4


def test_who_falls_behind_is_not_waited_for():
    """It ends where it is, before the most steps, and other members get there as without it."""
    batch, centre, shared = neighbours(8, 11)
    ends: dict[float, dict[int, tuple[bool, int, float]]] = {}
    for pace in (1.0, 0.12):
        found = ends.setdefault(pace, {})

        def note(members: np.ndarray, ended: ChordSolution, found: dict[int, tuple[bool, int, float]] = found) -> None:
            told = zip(ended.converged.tolist(), ended.iterations.tolist(), ended.correction.tolist(), strict=True)
            found.update(zip(members.tolist(), told, strict=True))

        start = np.repeat(centre, 11, axis=3)
        stream(
            batch,
            np.arange(11),
            lambda some, start=start: start[..., some],
            shared,
            1e-9,
            IterationLimits(60, pace),
            4,
            note,
        )
    behind = [member for member, (there, _, _) in ends[0.12].items() if not there]
    assert all(there for there, _, _ in ends[1.0].values())
    assert 0 < len(behind) < 11
    for member in behind:
        _, steps, correction = ends[0.12][member]
        assert steps < ends[1.0][member][1]
        assert np.isfinite(correction)
        assert correction >= 4.0 * LONGEST_CORRECTION * 0.12 ** ends[1.0][member][1]


def test_the_last_ones_wait_with_others_for_another_reference():
    """Half as many as `few` did not get there: the others at work end where they are; without them they go on."""
    batch, centre, shared = neighbours(8, 11)
    start = np.repeat(centre, 11, axis=3)
    for astray, given_up in ((2, True), (1, False)):
        begin = start.copy()
        begin[..., :astray] = np.nan
        ends: dict[int, tuple[bool, int]] = {}

        def note(members: np.ndarray, ended: ChordSolution, ends: dict[int, tuple[bool, int]] = ends) -> None:
            assert np.isfinite(ended.state).all()
            told = zip(ended.converged.tolist(), ended.iterations.tolist(), strict=True)
            ends.update(zip(members.tolist(), told, strict=True))

        stream(
            batch,
            np.arange(11),
            lambda some, begin=begin: begin[..., some],
            shared,
            1e-9,
            IterationLimits(60, few=4),
            11,
            note,
        )
        assert sorted(ends) == list(range(11))
        left = [member for member, (there, _) in ends.items() if not there and member >= astray]
        assert (0 < len(left) <= 4) == given_up
        assert all(ends[member][1] == max(steps for _, steps in ends.values()) for member in left)


@pytest.mark.parametrize(
    ("before", "last", "size", "near"),
    [
        (1.1e-6, 1.0e-6, 0.9e-6, False),  # below the tolerance, but nine more like it may come
        (4.0e-6, 2.0e-6, 0.9e-6, True),
        (3.0e-4, 3.0e-5, 3.0e-6, True),  # the step that is made takes it far below
        (4.0e-5, 3.0e-5, 3.0e-6, False),  # one lucky step
        (np.inf, np.inf, 0.5e-6, False),  # a first step tells nothing
        (np.inf, np.inf, 0.1e-6, True),
    ],
)
def test_a_member_is_near_enough_by_all_that_may_come(before: float, last: float, size: float, near: bool) -> None:
    found = is_near_enough(np.array([size]), np.array([last]), np.array([before]), 1e-6)
    assert found.tolist() == [near]
