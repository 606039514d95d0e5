"""Bounded threads for work that would block the event loop, in turns between clients."""

import asyncio
from collections import Counter, OrderedDict, deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import ParamSpec, TypeVar

from multiradar.access.shares import CLIENT, Shares
from multiradar.errors import DeadlineError, RequestError
from multiradar.runtime.queries.deadline import deadline
from multiradar.settings.limits import HttpLimits

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
    """

    def __init__(self, threads: int, each_max: int | None = None) -> None:
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="multiradar-api")
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


class QueryWorkers:
    """Threads of their own for expensive queries, with a bound for each client and a deadline.

    One kind of query of one client leaves a thread for others.

    Parameters
    ----------
    limits : HttpLimits
        Number of threads, queries of a client, and deadline.
    """

    def __init__(self, limits: HttpLimits) -> None:
        self._workers = Workers(limits.query_threads, max(1, limits.query_threads - 1))
        self._deadline_s = limits.query_deadline_s
        self._shares = Shares(
            "expensive queries in progress", "TOO_MANY_QUERIES", limits.requests_max,
            limits.client_queries_max,
        )  # fmt: skip

    async def run(
        self, kind: str, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs
    ) -> T:
        """Run a query and return its result.

        Raises
        ------
        RequestError
            429 with too many of the client in progress, 503 after the deadline.
        """
        client = CLIENT.get()
        self._shares.add(client)
        try:
            return await self._within((client, kind), lambda: function(*args, **kwargs))
        finally:
            self._shares.remove(client)

    async def _within(self, key: _Key, function: Callable[[], T]) -> T:
        until_s = asyncio.get_running_loop().time() + self._deadline_s
        try:
            async with asyncio.timeout_at(until_s):
                await self._workers.turn(key)
        except TimeoutError as error:
            raise self._late("was still queued") from error
        left_s = until_s - asyncio.get_running_loop().time()

        def bounded() -> T:
            with deadline(left_s):
                return function()

        work = self._workers.start(key, bounded)
        await asyncio.wait({work}, timeout=left_s)
        if not work.done():
            # It ends soon by itself; its thread is not free before.
            work.add_done_callback(_retrieved)
            raise self._late("was still running")
        try:
            return work.result()
        except DeadlineError as error:
            raise self._late("was still running") from error

    def _late(self, state: str) -> RequestError:
        return RequestError(
            503,
            "QUERY_TIMEOUT",
            f"the query {state} after {self._deadline_s:g} s (http.query_deadline_s); use a "
            "shorter horizon or window, or a smaller distance or limit, or try again later",
            {"retry-after": "5"},
        )

    def close(self) -> None:
        """Finish running work and stop the threads."""
        self._workers.close()


def _retrieved(work: "asyncio.Future[T]") -> None:
    # Reading the error keeps asyncio from reporting it as unread.
    if not work.cancelled():
        work.exception()
