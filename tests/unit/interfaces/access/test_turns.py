"""Large messages wait for their turn, in the order of their arrival; small ones never do."""

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from multiradar.access.turns import Turns


class _Messages:
    """Messages that have their turn, and their ends."""

    def __init__(self, turns: Turns) -> None:
        self._turns = turns
        self.admitted: list[int] = []
        self._ends: dict[int, asyncio.Event] = {}
        self._tasks: dict[int, asyncio.Task[None]] = {}

    async def send(self, *sizes: int) -> None:
        for octets in sizes:
            self._ends[octets] = asyncio.Event()
            self._tasks[octets] = asyncio.create_task(self._work(octets))
        await _all_that_can_run()

    async def end(self, octets: int) -> None:
        self._ends[octets].set()
        await self._tasks[octets]
        await _all_that_can_run()

    async def cancel(self, octets: int) -> None:
        self._tasks[octets].cancel()
        await asyncio.wait({self._tasks[octets]})
        await _all_that_can_run()

    async def _work(self, octets: int) -> None:
        async with self._turns.of(octets):
            self.admitted.append(octets)
            await self._ends[octets].wait()


async def _all_that_can_run() -> None:
    for _ in range(20):
        await asyncio.sleep(0)


def run(scene: Callable[[_Messages], Awaitable[None]]) -> None:
    async def whole() -> None:
        await scene(_Messages(Turns(10, 100)))

    asyncio.run(whole())


def test_large_messages_together_have_at_most_the_bound() -> None:
    async def scene(messages: _Messages) -> None:
        await messages.send(60, 40, 30)
        assert messages.admitted == [60, 40]
        await messages.end(40)
        assert messages.admitted == [60, 40, 30]

    run(scene)


def test_a_message_waits_behind_those_that_came_before_it() -> None:
    async def scene(messages: _Messages) -> None:
        await messages.send(60, 50, 20)
        assert messages.admitted == [60]
        await messages.end(60)
        assert messages.admitted == [60, 50, 20]

    run(scene)


def test_small_messages_never_wait() -> None:
    async def scene(messages: _Messages) -> None:
        await messages.send(100, 99, 9, 8)
        assert messages.admitted == [100, 9, 8]

    run(scene)


def test_a_message_above_the_bound_has_its_turn_alone() -> None:
    async def scene(messages: _Messages) -> None:
        await messages.send(10, 500, 11)
        assert messages.admitted == [10]
        await messages.end(10)
        assert messages.admitted == [10, 500]
        await messages.end(500)
        assert messages.admitted == [10, 500, 11]

    run(scene)


@pytest.mark.parametrize("cancelled", [90, 80])
def test_a_cancelled_message_leaves_its_turn_to_the_next(cancelled: int) -> None:
    async def scene(messages: _Messages) -> None:
        await messages.send(90, 80, 70)
        await messages.cancel(cancelled)
        if cancelled == 80:
            await messages.end(90)
            assert messages.admitted == [90, 70]
        else:
            assert messages.admitted == [90, 80]

    run(scene)
