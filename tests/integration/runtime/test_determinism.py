"""The same measurements give the same bytes, however they come, and again after a restart."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from multiradar.runtime.live.service import Service
from multiradar.runtime.stream.events import Event
from support.processes.live_process import live_service
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import cut, recording

ROWS = 1200
FRAME = recording(ROWS, step_s=0.05)


def _play(service: Service, pieces: list[pl.DataFrame]) -> tuple[list[Event], str]:
    service.start()
    futures = [service.submit(piece, source="test") for piece in pieces]
    futures.append(service.flush(source="test"))
    for future in futures:
        future.result(WAIT_TIMEOUT_S)
    service.settled().result(WAIT_TIMEOUT_S)
    return _said(service)


def _said(service: Service) -> tuple[list[Event], str]:
    subscription = service.view.subscribe(0, 10**6)
    events: list[Event] = []
    while part := subscription.poll(1000):
        events += part
    return events, service.view.status()["output_sha256"]


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Event], str]:
    service = live_service(tmp_path_factory.mktemp("whole") / "journal.db")
    said = _play(service, [FRAME])
    service.stop()
    return said


@pytest.mark.parametrize(("size", "workers"), [(1, 1), (7, 2), (500, 4), (500, 1), (ROWS, 2)])
def test_batches_and_workers_leave_no_trace(
    tmp_path: Path, expected: tuple[list[Event], str], size: int, workers: int
) -> None:
    # The intake is bounded to 1024 messages; the rest is sent in one.
    pieces = cut(FRAME, [size] * (len(FRAME) // size - 1))
    if size == 1:
        pieces = cut(FRAME, [1] * 400)
    service = live_service(tmp_path / "journal.db", workers)
    assert _play(service, pieces) == expected
    service.stop()

    again = live_service(tmp_path / "journal.db", 5 - workers)
    again.start()
    assert _said(again) == expected
    again.stop()


def test_events_are_numbered_without_gap_and_contain_every_update(
    expected: tuple[list[Event], str],
) -> None:
    events, _ = expected
    assert [event.sequence for event in events] == list(range(1, len(events) + 1))
    kinds = {
        kind: sum(event.kind == kind for event in events) for kind in ("track", "bias", "status")
    }
    assert kinds["track"] == len(FRAME)
    assert kinds["bias"] == 4 * int(np.ceil(ROWS * 0.05 / 4.0))
    assert kinds["status"] == int(ROWS * 0.05 / 10.0) - 1


@pytest.mark.fault(28, 29)
def test_numbers_go_on_over_a_restart_in_the_middle(
    tmp_path: Path, expected: tuple[list[Event], str]
) -> None:
    path = tmp_path / "journal.db"
    first = live_service(path)
    first.start()
    first.submit(FRAME[:500], source="test").result(WAIT_TIMEOUT_S)
    first.settled().result(WAIT_TIMEOUT_S)
    started, _ = _said(first)
    first.stop()
    assert started == expected[0][: len(started)]
    assert len(started) > 400

    second = live_service(path)
    assert _play(second, [FRAME[500:]]) == expected
    resumed = second.view.subscribe(started[-1].sequence, 10**6)
    assert resumed.poll(5) == expected[0][len(started) : len(started) + 5]
    second.stop()


def test_the_output_is_a_function_of_the_journal(tmp_path: Path) -> None:
    """Late, future, duplicate and broken rows included."""
    random = np.random.default_rng(11)
    rows = np.sort(np.r_[np.arange(ROWS), random.integers(0, ROWS, 120)])
    step_s = random.choice([0.0, 1e6, -500.0], len(rows), p=[0.98, 0.01, 0.01])
    frame = FRAME[rows].with_columns(pl.col("time_s") + pl.Series(step_s))
    said = []
    for number, sizes in enumerate(([], [13] * 80, [300] * 4)):
        service = live_service(tmp_path / f"{number}.db", 1 + number)
        said.append(_play(service, cut(frame, sizes)))
        status = service.view.status()
        assert status["rejected"] > 10
        assert status["engine"]["DUPLICATE"] > 80
        service.stop()
    assert said[1:] == said[:1] * 2
