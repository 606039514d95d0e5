"""Interfaces of the running service for HTTP, Zenoh and ASTERIX."""

from collections.abc import Callable, Container, Mapping, Sequence
from concurrent.futures import Future
from typing import Any, Protocol

import polars as pl

from multiradar.runtime.admission.sensors_in_force import SensorPlan
from multiradar.runtime.live.readiness import Reason
from multiradar.runtime.live.receipt import Receipt, RejectedRow
from multiradar.runtime.picture.air_picture import Asked
from multiradar.runtime.picture.past import PastAsked
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
        """One of track, bias, ended, status, sensor and gap."""
        ...

    @property
    def key(self) -> str:
        """Track or sensor identifier; empty where the event is about neither."""
        ...

    @property
    def payload(self) -> bytes:
        """The JSON object, encoded once for all clients."""
        ...


class StreamEvents(Protocol):
    """Events of the stream in columns, one element for each."""

    @property
    def numbers(self) -> Sequence[int]:
        """Their `StreamEvent.sequence`."""
        ...

    @property
    def kinds(self) -> list[str]:
        """Their `StreamEvent.kind`."""
        ...

    @property
    def keys(self) -> list[str]:
        """Their `StreamEvent.key`."""
        ...

    @property
    def payloads(self) -> list[bytes]:
        """Their `StreamEvent.payload`."""
        ...

    def of_kinds(self, kinds: Container[str]) -> "StreamEvents":
        """Return the events of some kinds."""
        ...


class EventSource(Protocol):
    """A position in the stream of events."""

    @property
    def after(self) -> int:
        """Sequence number of the last event polled or reported lost."""
        ...

    @property
    def waiting(self) -> bool:
        """Whether there is no position yet: the journal is replayed, and new events are wanted."""
        ...

    @property
    def edition(self) -> int:
        """Number of the content of the stream: in another one, a number may have another event."""
        ...

    @property
    def lost(self) -> int:
        """Events lost because the reader was too slow or subscribed too late."""
        ...

    @property
    def ended(self) -> bool:
        """Whether no further events come: the service has been drained."""
        ...

    def poll(self, max_events: int) -> Sequence[StreamEvent]:
        """Return the next events, at most so many, without waiting."""
        ...

    def poll_table(self, max_events: int) -> StreamEvents:
        """Return the next events in columns, as `poll`."""
        ...

    def is_idle(self) -> bool:
        """Whether there is nothing to poll; if so, the next event wakes the reader."""
        ...

    def skip(self, first: int, last: int) -> bool:
        """Continue after events that the reader already has; False if others come first."""
        ...

    def set_wakeup(self, callback: Callable[[], None]) -> None:
        """Set a function that is called, from any thread, when events are available."""
        ...

    def close(self) -> None:
        """Leave the stream."""
        ...


class View(Protocol):
    """The read interface; safe to call from any thread."""

    @property
    def page_rows_max(self) -> int:
        """Maximum rows of one page of a history or of the quarantine."""
        ...

    def tracks(self, at_s: float | None = None) -> pl.DataFrame:
        """Return the live tracks, one row each, at a past data time if one is given.

        Raises `RequestError` if nothing is retained of that time.
        """
        ...

    def track(self, track_id: int) -> dict[str, Any] | None:
        """Return one live track."""
        ...

    def aircraft_json(self) -> bytes:
        """Return the live tracks as `aircraft.json` of readsb."""
        ...

    def receiver_json(self) -> dict[str, Any]:
        """Return `receiver.json` of readsb."""
        ...

    def ask(
        self, query: Query, track_id: int | None = None, at_s: float | None = None, /, **given: Any
    ) -> dict[str, Any] | None:
        """Return the answer to a query of `registry.QUERIES`; None for no such live track.

        With `at_s` it is that of a past data time.
        """
        ...

    def rows(
        self,
        history: History,
        subject: int | str,
        since_s: float | None,
        limit: int,
        until_s: float | None = None,
    ) -> pl.DataFrame:
        """Return rows of a track or a sensor, oldest first: the first since a time, or the last."""
        ...

    def sensors(self, at_s: float | None = None) -> list[dict[str, Any]]:
        """Return the sensors, at a past data time if one is given."""
        ...

    def picture(self, asked: Asked) -> bytes:
        """Return a frame of the air picture."""
        ...

    def ready_picture(self, asked: Asked) -> bytes | None:
        """Return a frame that is encoded already, at once; None if there is none."""
        ...

    def past_picture(self, asked: PastAsked) -> bytes:
        """Return a frame of the air picture at a past time."""
        ...

    def status(self) -> dict[str, Any]:
        """Return counts, sequences, data time, hashes and version."""
        ...

    def subscribe(self, after: int | None, depth: int) -> EventSource:
        """Subscribe to the events after a sequence number, or from now on."""
        ...


class MeasurementSink(Protocol):
    """The running service for senders of measurements."""

    def submit(
        self,
        frame: pl.DataFrame,
        *,
        source: str,
        idempotency_key: str | None = None,
        rejected: Sequence[RejectedRow] = (),
    ) -> Future[Receipt]:
        """Submit measurements.

        Parameters
        ----------
        frame : DataFrame
            Columns of `MEASUREMENT_SCHEMA` (optional ones may be missing); a column `index` gives
            the index of each row in its message.
        source : str
            The sender.
        idempotency_key : str, optional
            The sender's key for the message: messages with the same key are accepted once.
        rejected : sequence of RejectedRow
            Rows of the message rejected at the interface; they go to the quarantine.

        Returns
        -------
        Future of Receipt
            Resolved when the message is in the journal, on disk. Fails with `InputError` when the
            columns are wrong, `IdempotencyConflictError` when the key was used for another message,
            `JournalError` when the journal cannot be written.

        Raises
        ------
        QueueFullError
            If the intake is full; try again later.
        PipelineError, JournalError
            If the service is not running, or does not accept measurements any more.
        """
        ...


class HandoverSink(Protocol):
    """The running service for its neighbouring regions."""

    def hand_over(self, message: bytes, *, source: str) -> Future[Receipt]:
        """Submit the message of a neighbouring region, as it is journalled.

        Parameters
        ----------
        message : bytes
            From `multiradar.runtime.memory.regions.messages.packed`.
        source : str
            The neighbour.

        Returns
        -------
        Future of Receipt
            Resolved when the message is in the journal.

        Raises
        ------
        QueueFullError, PipelineError, JournalError
            As `MeasurementSink.submit`.
        """
        ...


class OperatedSink(MeasurementSink, Protocol):
    """The running service for senders, and for those who operate it."""

    def require_source(self, source: str) -> None:
        """Reject the next message of a source, whatever it is, before its rows are read.

        Parameters
        ----------
        source : str
            The sender.

        Raises
        ------
        QuarantineError
            If the source is in quarantine; the message is to be sent later.
        """
        ...

    def note_unreadable(self, source: str, octets: int) -> None:
        """Count a message of which no row could be read: too many lead to a quarantine.

        Parameters
        ----------
        source : str
            The sender.
        octets : int
            Size of the message.
        """
        ...

    def flush(
        self, *, source: str, idempotency_key: str | None = None, force: bool = False
    ) -> Future[Receipt]:
        """Submit the end of a stream: the reorder buffer is emptied.

        Measurements older than the newest so far are late from then on.

        Parameters
        ----------
        source : str
            The sender.
        idempotency_key : str, optional
            The sender's key for the message, as for `submit`.
        force : bool
            Whether it may make measurements of sensors in real time late.

        Returns
        -------
        Future of Receipt
            Resolved when all measurements accepted before are processed. Fails as that of
            `submit`, and with `PipelineError` when the engine stops before.

        Raises
        ------
        LiveStreamError
            If sensors deliver in real time, unless it is forced.
        QueueFullError, PipelineError, JournalError
            As `submit`.
        """
        ...

    def set_clock(
        self, time_s: float, *, source: str, idempotency_key: str | None = None
    ) -> Future[Receipt]:
        """Set the data clock, as an operator says.

        A step back terminates all tracks, and measurements from then on initiate others; biases
        are kept. After a step forward earlier measurements are late.

        Parameters
        ----------
        time_s : float
            The data time, s.
        source, idempotency_key
            As for `flush`.

        Returns
        -------
        Future of Receipt
            As that of `flush`.

        Raises
        ------
        QueueFullError, PipelineError, JournalError
            As `submit`.
        """
        ...

    def has_message(self, idempotency_key: str) -> bool:
        """Return whether the journal has a message with this key; it is then a duplicate.

        Raises
        ------
        PipelineError
            If the service is not running.
        """
        ...

    def describe_sensor(self, sensor_id: str) -> dict[str, Any] | None:
        """Return the given values of a sensor, as in the sensors file; None for no such sensor."""
        ...

    def plan_sensor(
        self, sensor_id: str, values: Mapping[str, Any], *, reset_biases: bool = False
    ) -> SensorPlan:
        """Return what a change of a sensor would do; see `SensorsInForce.plan`.

        Raises
        ------
        ConfigurationError
            If the description is invalid, or something cannot change while the service runs.
        PipelineError
            If the service is not running.
        """
        ...

    def change_sensor(
        self, change: bytes, *, source: str, idempotency_key: str | None = None
    ) -> Future[Receipt]:
        """Change a sensor, for all measurements after the change.

        Parameters
        ----------
        change : bytes
            That of `sensor_change`, after a plan.
        source, idempotency_key
            As for `flush`.

        Returns
        -------
        Future of Receipt
            As that of `flush`; fails with `ConfigurationError` if another change came between.

        Raises
        ------
        QueueFullError, PipelineError, JournalError
            As `submit`.
        """
        ...


class ReadableService(Protocol):
    """The running service for readers."""

    @property
    def view(self) -> View:
        """The read side."""
        ...

    def unready(self) -> Sequence[Reason]:
        """Return why the service does not do what it is for, the most severe reason first."""
        ...

    @property
    def stalled(self) -> str:
        """Why only a restart can help, in words; empty otherwise."""
        ...

    @property
    def start_step(self) -> str:
        """The present step of the start; empty otherwise."""
        ...

    def quarantined(self, after: int, limit: int, code: str | None = None) -> Sequence[Quarantined]:
        """Return rejected rows after a number of the quarantine, or of a code, oldest first."""
        ...
