"""Calls beside the tracking run in their order, few wait, and their errors end the run."""

import threading

import pytest

from multiradar.clock import SystemClock
from multiradar.runtime.offline.beside_tracking import BesideTracking
from multiradar.runtime.offline.stage_times import StageTimes
from support.processes.waiting import WAIT_TIMEOUT_S


def test_calls_run_in_order_and_at_most_one_waits() -> None:
    stages = StageTimes(SystemClock())
    writing = BesideTracking(stages)
    go, started = threading.Event(), threading.Event()
    done: list[int] = []

    def first() -> None:
        started.set()
        assert go.wait(WAIT_TIMEOUT_S)
        done.append(0)

    writing.put(first)
    writing.put(lambda: done.append(1))
    assert started.wait(WAIT_TIMEOUT_S)
    assert done == []
    threading.Timer(0.0, go.set).start()
    # Waits until the first call has run.
    writing.put(lambda: done.append(2))
    assert done[0] == 0
    writing.finish()
    writing.close()
    assert done == [0, 1, 2]
    assert set(stages.beside_seconds()) == {"writing"}
    assert "waiting" in stages.seconds()


def test_the_error_of_a_call_is_raised_and_later_calls_do_not_run() -> None:
    writing = BesideTracking(StageTimes(SystemClock()))
    done: list[int] = []

    def fail() -> None:
        msg = "disk full"
        raise OSError(msg)

    writing.put(fail)
    with pytest.raises(OSError, match="disk full"):
        writing.finish()
    writing.close()
    with pytest.raises(RuntimeError):
        writing.put(lambda: done.append(1))
    assert done == []
