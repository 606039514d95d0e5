"""Bounded threads for work that would block the event loop, in turns between clients."""

import asyncio
from collections import Counter, OrderedDict, deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import ParamSpec, TypeVar

from multiradar.access.shares import CLIENT

P = ParamSpec("P")
T = TypeVar("T")

# A client, and a kind of its work.
_Key = tuple[str, str]


class Workers:
    """A bounded pool of threads. Used on the thread of the event loop.

    Waiting work is started in turns: each client, and each kind of work of it, has the next turn
    before one of them has another.

    Parameters
    ----------
    threads : int
        Number of threads; further work is queued, bounded by the number of requests.
    each_max : int, optional
        Maximum number of threads for one kind of work of one client; by default all.
    name : str
        Beginning of the names of the threads.
    """

    def __init__(
        self, threads: int, each_max: int | None = None, *, name: str = "multiradar-api"
    ) -> None:
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix=name)
        self._free = threads
        self._each_max = each_max or threads
        self._waiting: OrderedDict[_Key, deque[asyncio.Future[None]]] = OrderedDict()
        self._running: Counter[_Key] = Counter()

    async def run(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run a function on one of the threads and return its result."""
        key = (CLIENT.get(), "")
        await self.turn(key)
        return await self.start(key, lambda: function(*args, **kwargs))

    async def turn(self, key: _Key) -> None:
        """Wait for a thread; `start` must follow at once."""
        if self._free and self._running[key] < self._each_max:
            self._hold(key)
            return
        turn = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(key, deque()).append(turn)
        try:
            await turn
        except asyncio.CancelledError:
            if turn.done() and not turn.cancelled():
                self._release(key)
            raise

    def start(self, key: _Key, function: Callable[[], T]) -> "asyncio.Future[T]":
        """Run a function on the thread that was waited for."""
        work = asyncio.get_running_loop().run_in_executor(self._pool, function)
        # Also after the client has its answer: the thread is free when the work has ended.
        work.add_done_callback(lambda _: self._release(key))
        return work

    def close(self) -> None:
        """Finish running work and stop the threads."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _hold(self, key: _Key) -> None:
        self._free -= 1
        self._running[key] += 1

    def _release(self, key: _Key) -> None:
        self._free += 1
        self._running[key] -= 1
        if not self._running[key]:
            del self._running[key]
        while self._free and (following := self._next()) is not None:
            self._hold(following)

    def _next(self) -> _Key | None:
        # Give the turn to the first that may have one, which is the last from then on.
        for key, turns in list(self._waiting.items()):
            if self._running[key] >= self._each_max:
                continue
            # Behind a cancelled turn another one may wait, which nothing else would start.
            while turns and turns[0].done():
                turns.popleft()
            turn = turns.popleft() if turns else None
            if turns:
                self._waiting.move_to_end(key)
            else:
                del self._waiting[key]
            if turn is not None:
                turn.set_result(None)
                return key
        return None
