"""Readers of bundles get the lock between two rounds of plots."""

import threading

from multiradar.runtime.trajectories.fair_lock import FairLock
from support.processes.waiting import join, wait_until


def test_a_waiting_thread_gets_the_lock_before_its_last_holder_again() -> None:
    """A `threading.Lock` is acquired again before the other thread wakes up."""
    lock, order = FairLock(), []

    def read() -> None:
        with lock:
            order.append("reader")

    reader = threading.Thread(target=read, daemon=True)
    with lock:
        assert not lock.is_wanted
        reader.start()
        wait_until(lambda: lock.is_wanted, "a reader")
    with lock:
        order.append("owner")
    join(reader)
    assert order == ["reader", "owner"]
    assert not lock.is_wanted
