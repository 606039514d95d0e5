"""Replay to a service over Zenoh, by queries, which are answered when the rows are on disk."""

import json
from collections.abc import Mapping
from typing import Any

import polars as pl
import zenoh

from multiradar.errors import PeerError, StreamGoesOnError, UnavailableError
from multiradar.ingest.replay.http import MEDIA_TYPES, Encoding, encode
from multiradar.ingest.replay.replaying import NOT_RUNNING, Answer
from multiradar.ingest.zenoh.keys import MEASUREMENTS, STATUS
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import first_line, zenoh_config

#: Longer than the service waits for its journal.
ANSWER_TIMEOUT_S = 60.0
#: A batch has rows of several sensors, so the key names none.
_KEY = f"{MEASUREMENTS}/*"
_FLUSH = "multiradar/v1/flush"
#: Temporary errors of the service.
_RETRY_LATER = frozenset({"QUEUE_FULL", "JOURNAL_FULL", "NOT_READY", "BUSY"})


_UNREACHABLE = "Unable to connect"


class ZenohDestination:
    """A service that answers queries on the measurement keys.

    Parameters
    ----------
    endpoint : str
        Address of the service or its router, such as `tcp/127.0.0.1:7447`.
    encoding : str
        Encoding of batches: arrow, json or ndjson.

    Raises
    ------
    ConfigurationError
        If the endpoint is not valid.
    PeerError
        If there is no connection.
    """

    def __init__(self, endpoint: str, encoding: str) -> None:
        self._encoding = Encoding(encoding)
        self._endpoint = endpoint
        config = zenoh_config(ZenohOptions(mode="client", listen=(), connect=(endpoint,)))
        try:
            self._session = zenoh.open(config)
        except zenoh.ZError as error:
            # The text of a failed attempt is about threads and locators of Zenoh.
            line = first_line(error)
            why = "" if _UNREACHABLE in line else f" ({line})"
            msg = f"zenoh:{endpoint}: no connection{why}; {NOT_RUNNING}"
            raise PeerError(msg) from error

    def send(self, frame: pl.DataFrame, key: str) -> Answer:
        """Send a query with a batch and its key; return the counts of the answer."""
        document = self._ask(
            _KEY,
            payload=encode(frame, self._encoding),
            encoding=MEDIA_TYPES[self._encoding],
            attachment=key.encode(),
        )
        try:
            return Answer.of_document(document)
        except (KeyError, TypeError, ValueError) as error:
            msg = f"{self._endpoint}: expected the counts of the batch, was {str(document)[:200]}"
            raise PeerError(msg) from error

    def flush(self, key: str) -> None:
        """Mark the end of the stream."""
        self._ask(_FLUSH, attachment=key.encode())

    def starting(self) -> str | None:
        """Return None: a service that is starting answers no queries."""
        return None

    def configured(self) -> tuple[str, ...]:
        """Return no sensors: no query lists them."""
        return ()

    def status(self) -> Mapping[str, Any]:
        """Query the status; empty if it may not be read."""
        try:
            return self._ask(STATUS)
        except PeerError:
            return {}

    def close(self) -> None:
        """Close the session."""
        self._session.close()  # type: ignore[no-untyped-call]  # so in its stubs

    def _ask(self, selector: str, **content: Any) -> Mapping[str, Any]:
        replies = self._session.get(
            selector,
            target=zenoh.QueryTarget.BEST_MATCHING,
            timeout=ANSWER_TIMEOUT_S,
            **content,
        )
        for reply in replies:
            if reply.ok is not None:
                return _document(reply.ok.payload)
            if reply.err is not None:
                raise self._rejection(_document(reply.err.payload))
        raise UnavailableError(f"zenoh:{self._endpoint}: no service responds on {_KEY}")

    def _rejection(self, document: Mapping[str, Any]) -> PeerError:
        code, reason = str(document.get("code")), str(document.get("reason"))
        if code == "STREAM_IS_LIVE":
            return StreamGoesOnError(f"the stream was not ended: {reason}")
        msg = f"{self._endpoint}: {code}: {reason}"
        if code not in _RETRY_LATER:
            # A query that Zenoh gave up has no code of the service: the answer was lost.
            return PeerError(msg) if "code" in document else UnavailableError(msg)
        after_s = document.get("retry_after_s")
        pause_s = float(after_s) if isinstance(after_s, (int, float)) else None
        return UnavailableError(msg, pause_s, answered=True)


def _document(payload: zenoh.ZBytes) -> Mapping[str, Any]:
    try:
        document = json.loads(payload.to_bytes())
    except (ValueError, RecursionError):
        return {"reason": payload.to_bytes()[:200].decode(errors="replace")}
    return document if isinstance(document, dict) else {"reason": str(document)[:200]}
