"""The running service as the edges see it: what they may call, and nothing behind it."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any, Protocol

import polars as pl

from multiradar.runtime.live.receipt import Receipt, RejectedRow
from multiradar.runtime.queries.registry import History, Query
from multiradar.storage.entries import Quarantined


class StreamEvent(Protocol):
    """One event of the stream."""

    @property
    def sequence(self) -> int:
        """Number of the event, 1, 2, 3, …; a function of the journal."""
        ...

    @property
    def kind(self) -> str:
        """One of track, bias, ended, status and gap."""
        ...

    @property
    def key(self) -> str:
        """Track or sensor identifier; empty where the event is about neither."""
        ...

    @property
    def payload(self) -> bytes:
        """The JSON object, encoded once for all clients."""
        ...


class EventSource(Protocol):
    """A place in the stream of events."""

    @property
    def after(self) -> int:
        """Sequence number of the last event that was polled or declared lost."""
        ...

    @property
    def lost(self) -> int:
        """Events that this reader lost because it was too slow or came too late."""
        ...

    def poll(self, max_events: int) -> Sequence[StreamEvent]:
        """Return the next events, at most so many, without waiting."""
        ...

    def set_wakeup(self, callback: Callable[[], None]) -> None:
        """Have a function called, from any thread, whenever there is something to poll."""
        ...

    def close(self) -> None:
        """Leave the stream."""
        ...


class View(Protocol):
    """What can be read; safe to call from any thread."""

    @property
    def page_rows_max(self) -> int:
        """Rows of one page of a history or of the quarantine, at most."""
        ...

    def tracks(self) -> pl.DataFrame:
        """Return the live tracks, one row each."""
        ...

    def track(self, track_id: int) -> dict[str, Any] | None:
        """Return one live track."""
        ...

    def ask(self, query: Query, track_id: int | None = None, **given: Any) -> dict[str, Any] | None:
        """Return the answer to a query of `registry.QUERIES`; None for no such live track."""
        ...

    def rows(
        self, history: History, subject: int | str, since_s: float | None, limit: int
    ) -> pl.DataFrame:
        """Return rows of a track or a sensor, oldest first."""
        ...

    def sensors(self) -> list[dict[str, Any]]:
        """Return the sensors."""
        ...

    def status(self) -> dict[str, Any]:
        """Return counts, sequences, data time, hashes and version."""
        ...

    def subscribe(self, after: int | None, depth: int) -> EventSource:
        """Enter the stream of events after a sequence number, or now."""
        ...


class MeasurementSink(Protocol):
    """The running service as those see it who hand measurements in."""

    def submit(
        self,
        frame: pl.DataFrame,
        *,
        source: str,
        idempotency_key: str | None = None,
        rejected: Sequence[RejectedRow] = (),
    ) -> Future[Receipt]:
        """Hand in measurements; resolved when they are on disk."""
        ...

    def flush(self, *, source: str, idempotency_key: str | None = None) -> Future[Receipt]:
        """Hand in the end of a stream; resolved when what was taken before can be read."""
        ...


class ReadableService(Protocol):
    """The running service as those see it who only read."""

    @property
    def view(self) -> View:
        """The read side."""
        ...

    @property
    def state(self) -> str:
        """One of stopped, recovering, running and failed."""
        ...

    @property
    def start_step(self) -> str:
        """What a service that is starting is doing now, else empty."""
        ...

    def quarantined(self, after: int, limit: int, code: str | None = None) -> Sequence[Quarantined]:
        """Return refused rows behind a number of the quarantine, or of a code, oldest first."""
        ...
