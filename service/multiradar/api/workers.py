"""Threads of their own for expensive queries, with a bound for each client and a deadline."""

import asyncio
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from multiradar.access.shares import CLIENT, Shares
from multiradar.access.workers import Workers
from multiradar.errors import DeadlineError, RequestError
from multiradar.runtime.queries.deadline import deadline
from multiradar.settings.limits import HttpLimits

P = ParamSpec("P")
T = TypeVar("T")


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

    async def _within(self, key: tuple[str, str], function: Callable[[], T]) -> T:
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
