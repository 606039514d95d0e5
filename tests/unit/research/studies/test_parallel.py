"""Parallel work: everything is done, or pending work is dropped."""

from concurrent.futures import Future, wait
from threading import Event

import pytest

from multiradar.research.studies.parallel import finish, processors, workers
from support.processes.waiting import WAIT_TIMEOUT_S

TASKS = 100


def test_all_work_is_done_and_reported() -> None:
    reported: list[tuple[int, int]] = []
    with workers() as executor:
        futures = [executor.submit(pow, number, 2) for number in range(TASKS)]
        finish(futures, lambda done, total: reported.append((done, total)))
    assert [future.result() for future in futures] == [number**2 for number in range(TASKS)]
    assert reported == [(done, TASKS) for done in range(TASKS + 1)]


def test_pending_work_is_dropped_when_interrupted() -> None:
    """Running work is not waited for: the block is left while it still runs."""
    release = Event()
    started: list[int] = []

    def busy(number: int) -> None:
        started.append(number)
        release.wait(WAIT_TIMEOUT_S)

    def stop(_done: int, _total: int) -> None:
        raise KeyboardInterrupt

    def work() -> None:
        with workers() as executor:
            futures.extend(executor.submit(busy, number) for number in range(TASKS))
            finish(futures, stop)

    futures: list[Future[None]] = []
    with pytest.raises(KeyboardInterrupt):
        work()
    at_work = [future for future in futures if not future.cancelled()]
    assert not any(future.done() for future in at_work)
    release.set()
    wait(at_work)
    assert len(started) == len(at_work) <= processors()


def test_the_first_error_ends_the_work() -> None:
    release = Event()

    def fail() -> None:
        raise ZeroDivisionError

    def idle() -> None:
        release.wait(WAIT_TIMEOUT_S)

    def work() -> None:
        with workers() as executor:
            futures.append(executor.submit(fail))
            futures.extend(executor.submit(idle) for _ in range(TASKS))
            finish(futures, lambda _done, _total: None)

    futures: list[Future[None]] = []
    with pytest.raises(ZeroDivisionError):
        work()
    release.set()
    assert sum(not future.cancelled() for future in futures) <= processors() + 1
