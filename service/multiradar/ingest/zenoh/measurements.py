"""Measurement input: samples, which cannot be rejected, and queries, which are answered.

A sample has no answer: errors in it, or an overload of the service, are counted and published on
the status key, not reported to its sender. A query with the same content is acknowledged when it is
in the journal, on disk.
"""

import json
from collections.abc import Callable
from concurrent.futures import Future

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
    receipt_json,
)
from multiradar.runtime.ports import OperatedSink
from multiradar_schemas.measurements.measurement import Seconds

SOURCE = "zenoh"
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
_PARAMETERS = frozenset({"flush"})
_FLUSH_PARAMETERS = frozenset({"force"})
_CLOCK_PARAMETERS = frozenset({"time_s"})
_TIME_S = TypeAdapter(Seconds)
_KEY_EXPECTED = f"expected an idempotency key as the attachment: {IDEMPOTENCY_KEY_FORM}"


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
        Whether clients have names: an end of a stream then has a key of its own, and idempotency
        keys are those of the feeds of a sensor.
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
    ) -> None:
        self._intake = intake
        self._events = events
        self._named = named
        self._counts = counts
        self._bounds = bounds
        self._later = later

    def on_sample(self, message: Message) -> None:
        """Ingest a sample."""
        self._counts.add(messages_read=1)
        try:
            decoded = self._decoded(message, message.payload)
            future = self._submit(decoded, self._idempotency_key(message))
        except PayloadError as error:
            self._malformed(error, message.key)
        except QueueFullError as error:
            self._counts.add(messages_lost_upstream=1)
            self._counts.alarm(_code(error), str(error), message.key)
        except MultiradarError as error:
            self._rejected(error, message.key)
        else:
            future.add_done_callback(lambda done: self._settled(done, message.key))

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
        try:
            future = submit(request)
        except PayloadError as error:
            self._malformed(error, request.key)
            code, reason = error.code, error.reason
            self._later(lambda: _reject(request, code, reason))
        except MultiradarError as error:
            self._rejected(error, request.key)
            rejection = error
            self._later(lambda: _reject_for(request, rejection))
        else:
            future.add_done_callback(
                lambda done: self._later(lambda: self._answer_settled(done, request))
            )

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
        SECURITY_LOG.info("operated", origin=SOURCE, path=request.key)
        key = self._idempotency_key(request)
        return self._intake.flush(source=SOURCE, idempotency_key=key, force=force == "true")

    def _submit_clock(self, request: Request) -> "Future[Receipt]":
        _require_known(request, _CLOCK_PARAMETERS)
        time_s = _time_s(request.parameters.get("time_s", ""))
        SECURITY_LOG.info("clock_set", origin=SOURCE, time_s=time_s)
        key = self._idempotency_key(request)
        return self._intake.set_clock(time_s, source=SOURCE, idempotency_key=key)

    def _submit_query(self, request: Request) -> "Future[Receipt]":
        idempotency_key = self._idempotency_key(request)
        _require_known(request, _PARAMETERS)
        if "flush" in request.parameters and not request.payload:
            # The key of a sensor is that of its feeds, which do not have the role operate.
            if self._named or last_part(request.key) != "*":
                raise PayloadError(
                    "ROLE_NOT_ALLOWED", f"a stream cannot be ended on this key; use {FLUSH}"
                )
            return self._intake.flush(source=SOURCE, idempotency_key=idempotency_key)
        if request.payload is None:
            raise PayloadError("MISSING_FIELD", "the query contains no measurements")
        return self._submit(self._decoded(request, request.payload), idempotency_key)

    def _decoded(self, message: Message | Request, payload: bytes) -> Decoded:
        # Before its rows are read, which takes a second at the maximum size.
        self._intake.require_source(SOURCE)
        try:
            return read_payload(message.key, message.media_type, payload, self._bounds)
        except PayloadError:
            self._intake.note_unreadable(SOURCE, len(payload))
            raise

    # The session does not learn the name of a client, but admits only its feeds to a sensor's key.
    def _idempotency_key(self, message: Message | Request) -> str | None:
        sender = f"{SOURCE}/{last_part(message.key)}" if self._named else ""
        return key_of_sender(sender, _idempotency_key(message.attachment))

    def _submit(self, decoded: Decoded, idempotency_key: str | None) -> "Future[Receipt]":
        return self._intake.submit(
            decoded.frame,
            source=SOURCE,
            idempotency_key=idempotency_key,
            rejected=decoded.rejected,
        )

    def _settled(self, done: "Future[Receipt]", key: str) -> bool:
        error = done.exception()
        if error is not None:
            self._rejected(error, key)
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
        if self._settled(done, request.key):
            answer = receipt_json(done.result())
            request.reply(_reply_key(request.key), answer, b"")
            request.finish()
        else:
            _reject_for(request, done.exception())

    def _malformed(self, error: PayloadError, key: str) -> None:
        self._counts.add(messages_malformed=1)
        self._events.warn("rejected", SOURCE, code=error.code, path=key[:200])
        self._counts.alarm(error.code, error.reason, key)

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
