"""The running service as the edges see it: what they may call, and nothing behind it."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any, Protocol

import polars as pl

from multiradar.runtime.live.receipt import Receipt, RejectedRow
from multiradar.runtime.queries.encounter_query import EncounterQuery
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

    def history(self, track_id: int, since_s: float | None, limit: int) -> pl.DataFrame:
        """Return updates of a track, oldest first."""
        ...

    def transitions(self, track_id: int, since_s: float | None, limit: int) -> pl.DataFrame:
        """Return the steps in the life of a track, oldest first."""
        ...

    def forecast(
        self, track_id: int, horizon_s: float, step_s: float, probability: float, by: str
    ) -> list[dict[str, Any]] | None:
        """Return the states a track is expected to have; raises ForecastError beyond its bounds."""
        ...

    def encounters(self, query: EncounterQuery) -> dict[str, Any]:
        """Return which live tracks are expected to come near each other."""
        ...

    def manoeuvre_plane(self, track_id: int, window_s: float) -> dict[str, Any] | None:
        """Return the plane of the last plots; raises PlaneError where they determine none."""
        ...

    def observability(self, track_id: int, window_s: float) -> dict[str, Any] | None:
        """Return whether the last measurements of a track say where it is."""
        ...

    def trajectories(self, track_id: int, points: int, step_s: int) -> dict[str, Any] | None:
        """Return how a live track flew; raises TrajectoryError where nothing can be told."""
        ...

    def sensors(self) -> list[dict[str, Any]]:
        """Return the sensors."""
        ...

    def bias(self, sensor_id: str) -> list[dict[str, Any]]:
        """Return the current bias estimates of a sensor."""
        ...

    def bias_history(self, sensor_id: str, since_s: float | None, limit: int) -> pl.DataFrame:
        """Return bias estimates of a sensor by epoch, oldest first."""
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
