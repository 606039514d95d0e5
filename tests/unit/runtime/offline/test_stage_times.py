"""The time of a run is attributed to exactly one stage."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import cast

import pytest
from numba import njit

from multiradar.clock import FixedClock, SystemClock
from multiradar.runtime.offline.stage_times import StageTimes


def test_a_nested_stage_counts_separately() -> None:
    clock = FixedClock(100.0)
    stages = StageTimes(clock, 98.0)
    clock.advance(1.0)
    with stages.measure("writing"):
        clock.advance(10.0)
        with stages.measure("encounters"):
            clock.advance(100.0)
        clock.advance(20.0)
    clock.advance(0.5)
    assert stages.seconds() == {
        "starting": 3.5, "compiling": 0.0, "writing": 30.0, "encounters": 100.0,
    }  # fmt: skip


def test_time_during_compilation_counts_as_compilation() -> None:
    clock = FixedClock()
    stages = StageTimes(clock)
    with stages.measure("tracking"):
        clock.advance(1.0)
        # Two threads compile, or one kernel needs another.
        stages.on_start(None)  # type: ignore[arg-type]  # the event says nothing more
        clock.advance(10.0)
        stages.on_start(None)  # type: ignore[arg-type]
        clock.advance(20.0)
        stages.on_end(None)  # type: ignore[arg-type]
        clock.advance(30.0)
        stages.on_end(None)  # type: ignore[arg-type]
        clock.advance(2.0)
    assert stages.seconds() == {"starting": 0.0, "compiling": 60.0, "tracking": 3.0}


def test_a_stage_ends_with_an_error() -> None:
    clock = FixedClock()
    stages = StageTimes(clock)
    with pytest.raises(ValueError, match="x"), stages.measure("tracking"):
        raise ValueError("x")
    clock.advance(1.0)
    assert stages.seconds()["starting"] == 1.0


def test_producing_calling_and_entering_count_and_their_use_does_not() -> None:
    clock = FixedClock()
    stages = StageTimes(clock)

    def slow_items() -> Iterator[int]:
        for one in (1, 2):
            clock.advance(10.0)
            yield one

    @contextmanager
    def slow() -> Iterator[str]:
        clock.advance(100.0)
        yield "entered"

    with stages.enter("reading", slow()) as entered:
        assert entered == "entered"
        for _ in stages.each("reading", slow_items()):
            clock.advance(1.0)
    stages.timed("ASTERIX", clock.advance)(5.0)
    found = stages.seconds()
    assert (found["reading"], found["starting"], found["ASTERIX"]) == (120.0, 2.0, 5.0)


def test_compilation_is_counted() -> None:
    double = cast(Callable[[float], float], njit(lambda x: 2.0 * x))
    stages = StageTimes(SystemClock())
    with stages.listening():
        assert double(2.0) == 4.0
        compiled_s = stages.seconds()["compiling"]
        assert compiled_s > 0.0
        assert double(3.0) == 6.0
    assert stages.seconds()["compiling"] == compiled_s
