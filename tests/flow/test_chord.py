"""Members that pass through batch slots: how each ends, and that others do not change it."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from channels import family, river, solved

from vegglue.flow.chord import LONGEST_CORRECTION, ChordSolution, IterationLimits, chord, is_near_enough, stream
from vegglue.flow.jacobian import Factors, factors
from vegglue.flow.newton import finish
from vegglue.flow.problem import Problem, take


def neighbours(seed: int, members: int) -> tuple[Problem, np.ndarray, Factors]:
    """Members at random places, their starts at the state of the first, and its factors."""
    batch = family(np.random.default_rng(seed).random((members, 2)))
    first = take(batch, np.array([0]))
    centre = solved(first)
    return batch, np.repeat(centre, members, axis=3), factors(first, centre)


@dataclass
class Streamed:
    """How members passed through: entered, how many at a time and after how many had ended; how each ended."""

    entered: list[tuple[int, int]] = field(default_factory=list)
    ends: dict[int, tuple[bool, int, float]] = field(default_factory=dict)
    states: dict[int, np.ndarray] = field(default_factory=dict)


def streamed(
    given: tuple[Problem, np.ndarray, Factors], width: int, limits: IterationLimits, tolerance: float = 1e-9
) -> Streamed:
    """All members through so many slots, the last first."""
    batch, start, shared = given
    found = Streamed()

    def starts_of(some: np.ndarray) -> np.ndarray:
        found.entered.append((some.size, len(found.ends)))
        return start[..., some]

    def note(members: np.ndarray, ended: ChordSolution) -> None:
        assert not found.ends.keys() & set(members.tolist())
        for slot, member in enumerate(members.tolist()):
            how = bool(ended.converged[slot]), int(ended.iterations[slot]), float(ended.correction[slot])
            found.ends[member], found.states[member] = how, ended.state[..., slot]

    stream(batch, np.arange(batch.members)[::-1], starts_of, shared, tolerance, limits, width, note)
    assert sorted(found.ends) == list(range(batch.members))
    return found


@pytest.mark.parametrize("width", [1, 4])
def test_members_pass_through_few_slots_as_they_would_all_at_once(width: int) -> None:
    given = neighbours(8, 11)
    together = chord(*given, 1e-9)
    found = streamed(given, width, IterationLimits(40))
    assert sum(some for some, _ in found.entered) == 11
    assert max(some for some, _ in found.entered) <= width
    assert together.converged.all()
    for member, (converged, _, _) in found.ends.items():
        assert converged
        assert np.abs(found.states[member] - together.state[..., member]).max() < 1e-7


@pytest.mark.parametrize(("astray", "width"), [([2], 4), ([4, 5], 3)])
def test_a_member_that_strays_ends_and_spoils_no_other(astray: list[int], width: int) -> None:
    """Nor one that enters its slot."""
    batch, start, shared = neighbours(10, 6)
    start[..., astray] = np.nan
    found = streamed((batch, start, shared), width, IterationLimits(25), 1e-8)
    assert [member for member, (there, _, _) in sorted(found.ends.items()) if not there] == astray
    assert all(np.isfinite(state).all() for member, state in found.states.items() if member not in astray)


def test_one_that_strayed_is_not_taken_up_again() -> None:
    """Its state may be anything: no factors are made there, and its correction says so."""
    problem = river()
    near = solved(problem)
    far = near + 0.3 * np.random.default_rng(0).standard_normal(near.shape)
    shared = factors(problem, near)
    end = chord(problem, far, shared, 1e-8)
    assert not end.converged[0]
    assert np.isinf(end.correction[0])
    _, kept, _ = finish(problem, far, 1e-8)
    assert kept is None


def test_a_member_that_ends_a_step_early_is_within_the_tolerance() -> None:
    """Some end with a correction above the tolerance, and are within it after the step all the same."""
    given = neighbours(13, 16)
    exact, early = chord(*given, 1e-11), chord(*given, 1e-5)
    assert early.converged.all()
    assert (early.correction > 1e-5).any()
    assert np.abs(early.state - exact.state)[:-1].max() < 1e-5


def test_a_single_member_enters_while_others_are_at_work() -> None:
    """Two of four slots are free at once, and one member waits: it does not wait for all."""
    given = neighbours(12, 5)
    assert len(set(chord(*given, 1e-9).iterations)) > 1, "else all end at once"
    _, (entering, ended) = streamed(given, 4, IterationLimits(60)).entered
    assert entering == 1
    assert ended < 4


def test_a_member_that_falls_behind_ends_early() -> None:
    """It ends where it is, before the most steps, and other members converge as without it."""
    given = neighbours(8, 11)
    patient, strict = (streamed(given, 4, IterationLimits(60, pace)).ends for pace in (1.0, 0.12))
    behind = [member for member, (there, _, _) in strict.items() if not there]
    assert all(there for there, _, _ in patient.values())
    assert 0 < len(behind) < 11
    for member in behind:
        _, steps, correction = strict[member]
        assert steps < patient[member][1]
        assert np.isfinite(correction)
        assert correction >= 4.0 * LONGEST_CORRECTION * 0.12 ** patient[member][1]


@pytest.mark.parametrize(("astray", "given_up"), [(2, True), (1, False)])
def test_the_last_ones_end_with_others_that_need_another_reference(astray: int, given_up: bool) -> None:
    """Half as many as `few` did not converge: the others at work end where they are; without them they go on."""
    batch, start, shared = neighbours(8, 11)
    start[..., :astray] = np.nan
    found = streamed((batch, start, shared), 11, IterationLimits(60, few=4))
    assert all(np.isfinite(state).all() for state in found.states.values())
    left = [member for member, (there, _, _) in found.ends.items() if not there and member >= astray]
    assert (0 < len(left) <= 4) == given_up
    assert all(found.ends[member][1] == max(steps for _, steps, _ in found.ends.values()) for member in left)


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
