"""Threads of tasks that are split again: never more at once than allowed, whatever the nesting, and none idle."""

import signal
import threading
import time

import pytest

from vegglue.errors import InputError
from vegglue.parallel import as_finished, at_most, in_threads, submit


def most_at_once(jobs: int) -> int:
    """The largest number of innermost tasks that ran side by side, of three tasks cut into three each."""
    now, most, lock = 0, 0, threading.Lock()

    def work() -> None:
        nonlocal now, most
        with lock:
            now += 1
            most = max(most, now)
        time.sleep(0.02)
        with lock:
            now -= 1

    with at_most(jobs):
        in_threads(lambda: in_threads(work, [()] * 3), [()] * 3)
    return most


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_nested_tasks_keep_to_the_number_of_jobs(jobs: int) -> None:
    assert most_at_once(jobs) == jobs


def test_what_is_found_stands_in_the_order_of_the_tasks() -> None:
    def late(number: int) -> int:
        time.sleep(0.01 * (5 - number))
        return number

    with at_most(3):
        assert in_threads(late, [(number,) for number in range(5)]) == list(range(5))


@pytest.mark.parametrize("jobs", [0, -5])
def test_a_number_of_jobs_that_means_nothing_is_refused(jobs: int) -> None:
    with pytest.raises(InputError, match=f"got {jobs}"), at_most(jobs):
        pass


def test_what_a_task_raises_is_raised() -> None:
    with at_most(2), pytest.raises(ZeroDivisionError):
        in_threads(lambda number: 1 / number, [(1,), (0,), (2,)])


def test_what_waits_is_given_up_when_a_task_fails() -> None:
    """All that waited was done first: Ctrl-C took as long as the whole."""
    done: list[int] = []

    def work(number: int) -> None:
        if number == 0:
            raise ValueError("the first")
        time.sleep(0.05)
        done.append(number)

    with at_most(2), pytest.raises(ValueError, match="the first"):
        in_threads(work, [(number,) for number in range(20)])
    assert len(done) < 5


def hears_ctrl_c(task: int) -> bool:
    return signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


@pytest.mark.slow
def test_ctrl_c_is_never_for_a_worker_not_even_while_it_loads() -> None:
    assert list(as_finished(hears_ctrl_c, [(0,), (1,)], 2)) == [False, False]
    assert hears_ctrl_c(0), "here it is heard again"


@pytest.mark.slow
def test_tasks_that_are_left_are_left_without_a_word(recwarn: pytest.WarningsRecorder) -> None:
    found = as_finished(hears_ctrl_c, [(number,) for number in range(50)], 2)
    next(found)
    found.close()
    assert [str(one.message) for one in recwarn] == []


@pytest.mark.parametrize(("jobs", "beside"), [(1, False), (2, True)])
def test_what_is_begun_is_done_beside_where_a_thread_is_spare(jobs: int, beside: bool) -> None:
    with at_most(jobs):
        assert (submit(threading.get_ident)() != threading.get_ident()) == beside


def test_what_was_begun_takes_one_of_the_threads_until_it_ends() -> None:
    release = threading.Event()
    with at_most(2):
        waiting = submit(release.wait)
        assert submit(threading.get_ident)() == threading.get_ident()
        release.set()
        waiting()
        assert submit(threading.get_ident)() != threading.get_ident()


def test_what_was_begun_raises_where_it_is_asked_for() -> None:
    with at_most(2):
        found = submit(lambda: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            found()
