"""Services with a fake engine, and journals that wait or fail on request."""

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import polars as pl

from multiradar.errors import MultiradarError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.tracking_engine import TrackingEngine
from multiradar.runtime.live.receipt import Receipt
from multiradar.runtime.live.service import Service
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.entries import Entry
from multiradar.storage.journal import Journal
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.settings import TrackingSettings
from support.fakes.fake_engine import FakeEngine
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import sensors

TABLE = sensors()
Starter = Callable[..., Service]


@contextmanager
def services() -> Iterator[Starter]:
    """Start services that are stopped at the end."""
    started: list[Service] = []

    def make(
        journal: Journal | None = None,
        engine: Callable[[], TrackingEngine] = FakeEngine,
        table: SensorTable = TABLE,
        **limits: float,
    ) -> Service:
        kept = journal or MemoryJournal()
        service = Service(
            open_journal=lambda: kept,
            open_engine=engine,
            sensors=table,
            tracking=TrackingSettings(),
            limits=RuntimeLimits(**limits),  # type: ignore[arg-type]
        )
        started.append(service)
        service.start()
        return service

    try:
        yield make
    finally:
        for service in started:
            service.stop()


def submit(service: Service, frame: pl.DataFrame, key: str | None = None) -> Receipt:
    """Hand in a message and return its receipt."""
    return service.submit(frame, source="test", idempotency_key=key).result(WAIT_TIMEOUT_S)


def settled(service: Service) -> dict[str, object]:
    """Return the status when everything is processed; nothing may wait, all must be counted."""
    service.settled().result(WAIT_TIMEOUT_S)
    status = service.view.status()
    counts = [status[name] for name in ("accepted", "duplicate", "rejected")]
    assert status["read"] == sum(counts)
    assert status["intake_rows"] == status["intake_batches"] == status["backlog_rows"] == 0
    return status


class GatedJournal(MemoryJournal):
    """The first append waits, so that the messages after it share a transaction."""

    def __init__(self) -> None:
        super().__init__()
        self.entered, self.open = threading.Event(), threading.Event()

    def append(self, entries: Sequence[Entry]) -> list[int]:
        self.entered.set()
        assert self.open.wait(WAIT_TIMEOUT_S)
        return super().append(entries)


class FailingJournal(MemoryJournal):
    """Fails while requested."""

    def __init__(self, error: MultiradarError) -> None:
        super().__init__()
        self.failing = False
        self._error = error

    def append(self, entries: Sequence[Entry]) -> list[int]:
        if self.failing:
            raise self._error
        return super().append(entries)
