"""Measurement input: samples, which cannot be rejected, and queries, which are answered.

A sample has no answer: errors in it, or an overload of the service, are counted and published on
the status key, not reported to its sender. A query with the same content is acknowledged when it is
in the journal, on disk.
"""

import json
import threading
from collections.abc import Callable, Collection
from concurrent.futures import Future
from dataclasses import replace

from pydantic import TypeAdapter

from multiradar.access.parameters import number
from multiradar.access.security_log import SECURITY_LOG, RepeatedEvents
from multiradar.errors import (
    IdempotencyConflictError,
    InputError,
    JournalError,
    JournalFullError,
    LiveStreamError,
    MultiradarError,
    PayloadError,
    PipelineError,
    QuarantineError,
    QueueFullError,
)
from multiradar.ingest.bodies import Decoded
from multiradar.ingest.zenoh.bus import Message, Request, wrong_parameters
from multiradar.ingest.zenoh.counts import ZenohCounts
from multiradar.ingest.zenoh.keys import CLOCK, FLUSH, MEASUREMENTS, last_part
from multiradar.ingest.zenoh.payload import PayloadBounds, read_payload
from multiradar.runtime.live.receipt import (
    IDEMPOTENCY_KEY_FORM,
    Receipt,
    is_idempotency_key,
    key_of_sender,
    once_executed,
    receipt_json,
)
from multiradar.runtime.ports import OperatedSink
from multiradar_schemas.measurements.measurement import Seconds

SOURCE = "zenoh"
#: Queries on measurement keys that are not answered yet, and octets of their content: the session
#: holds a query with its content until its answer is sent.
OPEN_QUERIES_MAX, OPEN_OCTETS_MAX = 1024, 96 << 20
#: After which a query beyond them may be sent again, s.
OPEN_RETRY_S = 1.0
#: Codes of errors of the service; the first match counts. They are those of HTTP.
_CODES: tuple[tuple[type[MultiradarError], str], ...] = (
    (QuarantineError, "SOURCE_QUARANTINED"),
    (QueueFullError, "QUEUE_FULL"),
    (IdempotencyConflictError, "IDEMPOTENCY_KEY_REUSED"),
    (InputError, "MALFORMED_BODY"),
    (LiveStreamError, "STREAM_IS_LIVE"),
    (JournalFullError, "JOURNAL_FULL"),
    (JournalError, "JOURNAL_FAILED"),
    (PipelineError, "NOT_READY"),
)
# Errors of the sender of a message. After others it is lost if its sender is not answered.
_OF_SENDER = (InputError, LiveStreamError)
_PARAMETERS = frozenset({"flush"})
_FLUSH_PARAMETERS = frozenset({"force"})
_CLOCK_PARAMETERS = frozenset({"time_s"})
_TIME_S = TypeAdapter(Seconds)
_KEY_EXPECTED = f"expected an idempotency key as the attachment: {IDEMPOTENCY_KEY_FORM}"


class OpenQueries:
    """Queries without an answer so far, bounded in number and in octets; for any thread.

    Parameters
    ----------
    queries_max, octets_max : int
        Limits; one query alone may have more octets.
    """

    def __init__(self, queries_max: int, octets_max: int) -> None:
        self._queries_max, self._octets_max = queries_max, octets_max
        self._queries = self._octets = 0
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return self._queries

    def enter(self, octets: int) -> bool:
        """Add a query; False if there is no room."""
        with self._lock:
            if self._queries >= self._queries_max or (
                self._queries and self._octets + octets > self._octets_max
            ):
                return False
            self._queries += 1
            self._octets += octets
            return True

    def leave(self, octets: int) -> None:
        """Remove a query."""
        with self._lock:
            self._queries -= 1
            self._octets -= octets

    def leave_after(self, answer: Callable[[], None], octets: int) -> None:
        """Answer a query and remove it."""
        try:
            answer()
        finally:
            self.leave(octets)


class MeasurementInlet:
    """Handlers of the measurement keys.

    Parameters
    ----------
    intake : OperatedSink
        Receives the decoded measurements.
    counts : ZenohCounts
        Counters.
    bounds : PayloadBounds
        Size limits.
    later : callable
        Runs a function in another thread. The answers of queries are sent there, so that a querier
        that does not read cannot block the journal.
    named : bool
        Whether clients have names: idempotency keys are then those of the feeds of a sensor.
    ends_streams : bool
        Whether all may operate: a stream can then also be ended on the key of all sensors.
    bound : collection of str
        Sensors that clients are bound to. What is sent under their keys has a source of its own,
        so that the quarantine of one client is not that of another. Others share one: their
        keys do not identify a client, and any number of keys is possible.
    events : RepeatedEvents
        The security log.
    """

    def __init__(
        self,
        intake: OperatedSink,
        counts: ZenohCounts,
        bounds: PayloadBounds,
        later: Callable[[Callable[[], None]], None],
        *,
        events: RepeatedEvents,
        named: bool = False,
        ends_streams: bool = False,
        bound: Collection[str] = (),
    ) -> None:
        self._intake = intake
        self._events = events
        self._named = named
        self._ends_streams = ends_streams
        self._counts = counts
        self._bounds = bounds
        self._later = later
        self._bound = frozenset(bound)
        self._open = OpenQueries(OPEN_QUERIES_MAX, OPEN_OCTETS_MAX)

    def on_sample(self, message: Message) -> None:
        """Ingest a sample."""
        self._counts.add(messages_read=1)
        try:
            decoded = self._decoded(message, message.payload)
            future = self._submit(decoded, message)
        except PayloadError as error:
            self._malformed(error, message.key)
        except MultiradarError as error:
            self._not_taken(error, message.key)
        else:
            key = message.key
            future.add_done_callback(lambda done: self._settled(done, key, self._not_taken))

    def on_query(self, request: Request) -> None:
        """Ingest a query; it is answered when its content is on disk."""
        self._take(request, self._submit_query)

    def on_flush(self, request: Request) -> None:
        """Mark the end of a stream; it is answered when all earlier measurements are processed."""
        self._operate(request, FLUSH, self._submit_flush)

    def on_clock(self, request: Request) -> None:
        """Set the data clock; it is answered when it counts for all further measurements."""
        self._operate(request, CLOCK, self._submit_clock)

    # ---------------------------------------------------------------- inside

    def _take(self, request: Request, submit: Callable[[Request], "Future[Receipt]"]) -> None:
        self._counts.add(messages_read=1)
        octets = len(request.payload or b"")
        if not self._open.enter(octets):
            full = QueueFullError("answers", len(self._open), OPEN_RETRY_S)
            self._rejected(full, request.key)
            _reject_for(request, full)
            return
        # What waits for its answer does not need its content.
        asked = replace(request, payload=None)

        def later(answer: Callable[[], None]) -> None:
            self._later(lambda: self._open.leave_after(answer, octets))

        try:
            future = submit(request)
        except PayloadError as error:
            self._malformed(error, request.key)
            code, reason = error.code, error.reason
            later(lambda: _reject(asked, code, reason))
        except MultiradarError as error:
            self._rejected(error, request.key)
            rejection = error
            later(lambda: _reject_for(asked, rejection))
        except BaseException:
            # A bug: the session answers.
            self._open.leave(octets)
            raise
        else:
            future.add_done_callback(lambda done: later(lambda: self._answer_settled(done, asked)))

    def _operate(
        self, request: Request, key: str, submit: Callable[[Request], "Future[Receipt]"]
    ) -> None:
        if request.key == key:
            self._take(request, submit)
        else:
            # Wildcards ask for what there is to read.
            request.finish()

    def _submit_flush(self, request: Request) -> "Future[Receipt]":
        _require_known(request, _FLUSH_PARAMETERS)
        force = request.parameters.get("force", "false")
        if force not in ("true", "false"):
            raise PayloadError("INVALID_PARAMETER", "force: expected true or false")
        return self._flush(request, self._idempotency_key(request), force=force == "true")

    def _flush(self, request: Request, key: str | None, *, force: bool) -> "Future[Receipt]":
        future = self._intake.flush(source=SOURCE, idempotency_key=key, force=force)
        path = request.key
        return once_executed(
            future, lambda: SECURITY_LOG.info("operated", origin=SOURCE, path=path)
        )

    def _submit_clock(self, request: Request) -> "Future[Receipt]":
        _require_known(request, _CLOCK_PARAMETERS)
        time_s = _time_s(request.parameters.get("time_s", ""))
        key = self._idempotency_key(request)
        future = self._intake.set_clock(time_s, source=SOURCE, idempotency_key=key)
        return once_executed(
            future, lambda: SECURITY_LOG.info("clock_set", origin=SOURCE, time_s=time_s)
        )

    def _submit_query(self, request: Request) -> "Future[Receipt]":
        # An attachment that is no key is the first error.
        idempotency_key = self._idempotency_key(request)
        _require_known(request, _PARAMETERS)
        if "flush" in request.parameters and not request.payload:
            # The key of a sensor is that of its feeds, which do not have the role operate.
            if not self._ends_streams or last_part(request.key) != "*":
                raise PayloadError(
                    "ROLE_NOT_ALLOWED", f"a stream cannot be ended on this key; use {FLUSH}"
                )
            return self._flush(request, idempotency_key, force=False)
        if request.payload is None:
            raise PayloadError("MISSING_FIELD", "the query contains no measurements")
        return self._submit(self._decoded(request, request.payload), request)

    def _decoded(self, message: Message | Request, payload: bytes) -> Decoded:
        # Before its rows are read, which takes a second at the maximum size.
        source = self._source(message)
        self._intake.require_source(source)
        try:
            return read_payload(message.key, message.media_type, payload, self._bounds)
        except PayloadError:
            self._intake.note_unreadable(source, len(payload))
            raise

    # The session does not learn the name of a client, but admits only its feeds to a sensor's key.
    def _idempotency_key(self, message: Message | Request) -> str | None:
        sender = f"{SOURCE}/{last_part(message.key)}" if self._named else ""
        return key_of_sender(sender, _idempotency_key(message.attachment))

    def _source(self, message: Message | Request) -> str:
        sensor = last_part(message.key)
        return f"{SOURCE}/{sensor}" if sensor in self._bound else SOURCE

    def _submit(self, decoded: Decoded, message: Message | Request) -> "Future[Receipt]":
        return self._intake.submit(
            decoded.frame,
            source=self._source(message),
            idempotency_key=self._idempotency_key(message),
            rejected=decoded.rejected,
        )

    def _settled(
        self, done: "Future[Receipt]", key: str, failed: Callable[[BaseException, str], None]
    ) -> bool:
        error = done.exception()
        if error is not None:
            failed(error, key)
            return False
        receipt = done.result()
        self._counts.add(messages_taken=1)
        if receipt.duplicate:
            self._counts.add(rows_duplicate=receipt.accepted + len(receipt.rejected))
        else:
            self._counts.add(rows_accepted=receipt.accepted, rows_rejected=len(receipt.rejected))
            if self._named:
                accepted, rejected = receipt.accepted, len(receipt.rejected)
                origin = f"{SOURCE}/{last_part(key)}"
                self._events.note("sent", origin, accepted=accepted, rejected=rejected)
        return True

    def _answer_settled(self, done: "Future[Receipt]", request: Request) -> None:
        if self._settled(done, request.key, self._rejected):
            answer = receipt_json(done.result())
            request.reply(_reply_key(request.key), answer, b"")
            request.finish()
        else:
            _reject_for(request, done.exception())

    def _malformed(self, error: PayloadError, key: str) -> None:
        self._counts.add(messages_malformed=1)
        self._events.warn("rejected", SOURCE, code=error.code, path=key[:200])
        self._counts.alarm(error.code, error.reason, key)

    def _not_taken(self, error: BaseException, key: str) -> None:
        if isinstance(error, _OF_SENDER):
            self._rejected(error, key)
            return
        self._counts.add(messages_lost_upstream=1)
        self._counts.alarm(_code(error), _reason(error)[:300], key)

    def _rejected(self, error: BaseException, key: str) -> None:
        self._counts.add(messages_refused=1)
        self._events.warn("rejected", SOURCE, code=_code(error), path=key[:200])
        self._counts.alarm(_code(error), _reason(error)[:300], key)


def _require_known(request: Request, known: frozenset[str]) -> None:
    wrong = wrong_parameters(request, known)
    if wrong is not None:
        raise PayloadError(*wrong)


def _time_s(text: str) -> float:
    try:
        return _TIME_S.validate_python(number(text))
    except ValueError as error:
        raise PayloadError(
            "INVALID_PARAMETER", "time_s: expected a data time in seconds"
        ) from error


def _idempotency_key(attachment: bytes) -> str | None:
    if not attachment:
        return None
    try:
        key = attachment.decode("ascii")
    except UnicodeDecodeError as error:
        raise PayloadError("ENCODING", _KEY_EXPECTED) from error
    if not is_idempotency_key(key):
        raise PayloadError("ENCODING", _KEY_EXPECTED)
    return key


def _reply_key(queried: str) -> str:
    # An answer needs a key without wildcards that matches the query.
    return queried if "*" not in queried else f"{MEASUREMENTS}/receipt"


def _reject_for(request: Request, error: BaseException | None) -> None:
    retry_after_s = None
    if isinstance(error, QueueFullError):
        retry_after_s = error.retry_after_s
    elif isinstance(error, JournalFullError | PipelineError):
        retry_after_s = 1.0
    _reject(request, _code(error), _reason(error), retry_after_s)


def _reason(error: BaseException | None) -> str:
    return error.for_clients if isinstance(error, MultiradarError) else str(error)


def _code(error: BaseException | None) -> str:
    return next((code for kind, code in _CODES if isinstance(error, kind)), "INTERNAL")


def _reject(request: Request, code: str, reason: str, retry_after_s: float | None = None) -> None:
    document: dict[str, object] = {"code": code, "reason": reason[:1000]}
    if retry_after_s is not None:
        document["retry_after_s"] = retry_after_s
    request.reply_error(json.dumps(document).encode())
    request.finish()
