"""A lock for a thread that needs it nearly all the time, and others that need it rarely."""

import threading


class FairLock:
    """A lock that a waiting thread gets before its last holder gets it again.

    The holder of a `threading.Lock` that releases and acquires it at once does so before a waiting
    thread wakes up, round after round.
    """

    def __init__(self) -> None:
        # Held by the thread that gets the lock next.
        self._turn = threading.Lock()
        self._lock = threading.Lock()

    def __enter__(self) -> None:
        with self._turn:
            self._lock.acquire()

    def __exit__(self, *_: object) -> None:
        self._lock.release()

    @property
    def is_wanted(self) -> bool:
        """Whether a thread waits for the lock."""
        return self._turn.locked()
