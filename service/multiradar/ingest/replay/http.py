"""Replay to a service over HTTP."""

import io
import os
import re
from enum import StrEnum
from typing import Any

import httpx
import polars as pl

from multiradar.errors import (
    ConfigurationError,
    PeerError,
    StreamGoesOnError,
    UnavailableError,
)
from multiradar.ingest.replay.replaying import Answer
from multiradar.settings.variables import KEY_VARIABLE
from multiradar_schemas.measurements.directions import without_empty_columns

CONNECT_TIMEOUT_S = 5.0
#: Longer than the service waits for its journal.
ANSWER_TIMEOUT_S = 60.0

#: The service, or a proxy, asks to retry later.
_RETRY_LATER = frozenset({408, 429, 502, 503, 504, 507})
_FLUSH = "/v1/flush"
_ACCEPTED = 200
#: Before the step of its start, in the reason of a service.
_IS_STARTING = "the service is starting: "
_NOT_READY = 503
#: No row could be read; the answer has the counts all the same.
_NONE_ACCEPTED = 422
#: A web server without these addresses or methods; a proxy answers with other codes.
_OTHER_SERVERS = frozenset({404, 405, 501})


class Encoding(StrEnum):
    """Encoding of a batch."""

    ARROW = "arrow"
    JSON = "json"
    NDJSON = "ndjson"


MEDIA_TYPES = {
    Encoding.ARROW: "application/vnd.apache.arrow.stream",
    Encoding.JSON: "application/json",
    Encoding.NDJSON: "application/x-ndjson",
}


class HttpDestination:
    """A service with `POST /v1/measurements`.

    Parameters
    ----------
    url : str
        Its address, such as `http://127.0.0.1:8321`.
    encoding : Encoding
        Encoding of batches.
    transport : httpx.BaseTransport, optional
        Replaces the network in tests.

    Raises
    ------
    ConfigurationError
        If the address is not valid.
    """

    def __init__(
        self, url: str, encoding: Encoding, transport: httpx.BaseTransport | None = None
    ) -> None:
        self._encoding = encoding
        _check_address(url)
        timeout = httpx.Timeout(ANSWER_TIMEOUT_S, connect=CONNECT_TIMEOUT_S)
        # A proxy from the environment is for the internet, not for a local service.
        key = os.environ.get(KEY_VARIABLE, "")
        self._client = httpx.Client(
            base_url=url,
            timeout=timeout,
            trust_env=False,
            transport=transport,
            headers={"authorization": f"Bearer {key}"} if key else {},
        )

    def send(self, frame: pl.DataFrame, key: str) -> Answer:
        """Post a batch under its key; return the counts of the answer."""
        headers = {"content-type": MEDIA_TYPES[self._encoding], "idempotency-key": key}
        response = self._post("/v1/measurements", encode(frame, self._encoding), headers)
        document = _document(response)
        if response.status_code == _NONE_ACCEPTED and "accepted" not in document:
            raise _rejection(response, document)
        try:
            return Answer.of_document(document)
        except (KeyError, TypeError, ValueError) as error:
            if not document:
                raise _another_server(response) from error
            msg = f"{response.url}: expected the counts of the batch, was {response.text[:200]!r}"
            raise PeerError(msg) from error

    def flush(self, key: str) -> None:
        """Post the end of the stream."""
        response = self._post(_FLUSH, b"", {"idempotency-key": key})
        if response.status_code != _ACCEPTED:
            raise _rejection(response, _document(response))

    def starting(self) -> str | None:
        """Ask `/readyz` for the progress of a service that is starting."""
        try:
            response = self._client.get("/readyz")
        except httpx.TransportError:
            return None
        document = _document(response)
        # A failed service is not ready, too, but accepts nothing any more.
        if response.status_code != _NOT_READY or document.get("code") != "NOT_READY":
            return None
        reason = str(document.get("detail", "not ready yet"))
        return None if "failed" in reason else reason.removeprefix(_IS_STARTING)

    def configured(self) -> tuple[str, ...]:
        """Ask `/v1/sensors` for the configured sensors."""
        try:
            sensors = _document(self._client.get("/v1/sensors")).get("sensors", [])
            return tuple(str(one["id"]) for one in sensors)
        except (httpx.TransportError, KeyError, TypeError):
            return ()

    def status(self) -> dict[str, Any]:
        """Ask for `/v1/status`; empty if it may not be read."""
        try:
            response = self._client.get("/v1/status")
        except httpx.TransportError:
            return {}
        return _document(response) if response.status_code == _ACCEPTED else {}

    def close(self) -> None:
        """Close the connection."""
        self._client.close()

    def _post(self, path: str, body: bytes, headers: dict[str, str]) -> httpx.Response:
        try:
            response = self._client.post(path, content=body, headers=headers)
        except httpx.TransportError as error:
            msg = f"{self._client.base_url}: no response ({_cause(error)})"
            raise UnavailableError(msg) from error
        if response.status_code in _RETRY_LATER:
            msg = f"{response.url}: responded with {response.status_code} {response.reason_phrase}"
            raise UnavailableError(msg, _retry_after_s(response), answered=True)
        if response.status_code not in (_ACCEPTED, _NONE_ACCEPTED):
            raise _rejection(response, _document(response))
        return response


def encode(frame: pl.DataFrame, encoding: Encoding) -> bytes:
    """Return measurements as the body of a request.

    Parameters
    ----------
    frame : DataFrame
        Columns of `MEASUREMENT_SCHEMA`.
    encoding : Encoding
        The encoding.

    Returns
    -------
    bytes
        Arrow IPC stream, JSON array or NDJSON; numbers keep all their digits.
    """
    frame = without_empty_columns(frame)
    if encoding is Encoding.JSON:
        return frame.write_json().encode()
    if encoding is Encoding.NDJSON:
        return frame.write_ndjson().encode()
    buffer = io.BytesIO()
    frame.rechunk().write_ipc_stream(buffer)
    return buffer.getvalue()


def _check_address(url: str) -> None:
    try:
        host = httpx.URL(url).host
    except httpx.InvalidURL as error:
        msg = f"expected an address such as http://127.0.0.1:8321, was {url!r} ({error})"
        raise ConfigurationError(msg) from error
    if not host or any(character.isspace() for character in url):
        msg = f"expected an address such as http://127.0.0.1:8321, was {url!r}"
        raise ConfigurationError(msg)


def _cause(error: httpx.TransportError) -> str:
    # The system's message without the error number.
    if "WRONG_VERSION_NUMBER" in str(error):
        return "the service does not use TLS; use http:// instead of https://"
    return re.sub(r"^\[Errno -?\d+\] ", "", str(error)) or type(error).__name__


def _retry_after_s(response: httpx.Response) -> float | None:
    # Seconds only, as this service answers. A date, as a proxy may answer, means the back-off.
    text = response.headers.get("retry-after", "")
    return float(text) if text.isascii() and text.isdigit() else None


def _document(response: httpx.Response) -> dict[str, Any]:
    try:
        document = response.json()
    except (ValueError, RecursionError):
        return {}
    return document if isinstance(document, dict) else {}


def _another_server(response: httpx.Response) -> PeerError:
    kind = response.headers.get("content-type", "no content type").partition(";")[0]
    return PeerError(
        f"{response.url}: another web server than multiradar responded ({response.status_code} "
        f"{response.reason_phrase}, {kind}); specify the address of the service with --to"
    )


def _rejection(response: httpx.Response, problem: dict[str, Any]) -> PeerError:
    if response.has_redirect_location:
        where = response.headers["location"]
        return PeerError(f"{response.url}: redirects to {where}; specify the address with --to")
    if response.status_code in _OTHER_SERVERS and "code" not in problem:
        return _another_server(response)
    reason = problem.get("detail") or problem.get("title") or response.reason_phrase
    if problem.get("code") == "STREAM_IS_LIVE":
        return StreamGoesOnError(f"the stream was not ended: {reason}")
    if problem.get("code") == "ROLE_NOT_ALLOWED" and response.url.path == _FLUSH:
        # All measurements were accepted: the key of a feed is enough for them.
        return StreamGoesOnError(f"the stream was not ended: {reason}; use --no-flush")
    return PeerError(f"{response.url}: rejected with {response.status_code}, {reason}")
