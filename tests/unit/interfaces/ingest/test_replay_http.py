"""Answers of a service over HTTP become counts, a retry, or an error message."""

import io
import json
import re

import httpx
import polars as pl
import pytest

from multiradar.errors import ConfigurationError, PeerError, StreamGoesOnError, UnavailableError
from multiradar.ingest.replay.alternatives import Alternatives
from multiradar.ingest.replay.http import Encoding, HttpDestination, encode
from multiradar.ingest.replay.replaying import Answer
from multiradar.settings.variables import KEY_VARIABLE
from multiradar_schemas.measurements.directions import PLAIN_SCHEMA


def _batch() -> pl.DataFrame:
    return pl.DataFrame(
        {
            "time_s": [1533110400.1912345, 0.1 + 0.2],
            "sensor_id": ["41-10", "adsb"],
            "kind": ["radar", "adsb"],
            "range_m": [57014.600000000006, None],
            "mode_3a": ["0123", None],
            "track_number": [7, None],
        }
    ).select(
        pl.col(name).cast(dtype)
        if name in ("time_s", "sensor_id", "kind", "range_m", "mode_3a", "track_number")
        else pl.lit(None, dtype).alias(name)
        for name, dtype in PLAIN_SCHEMA.items()
    )


def _service(answer: httpx.Response, seen: list[httpx.Request] | None = None) -> HttpDestination:
    def handle(request: httpx.Request) -> httpx.Response:
        if seen is not None:
            seen.append(request)
        return answer

    return HttpDestination("http://service", Encoding.JSON, httpx.MockTransport(handle))


ACKNOWLEDGEMENT = {"accepted": 1, "rejected": [{"index": 1}], "duplicate": False}


def test_a_batch_is_posted_under_its_key_and_its_answer_counted() -> None:
    seen: list[httpx.Request] = []
    destination = _service(httpx.Response(200, json=ACKNOWLEDGEMENT), seen)
    assert destination.send(_batch(), "run-0-1") == Answer(1, 1, False)
    destination.flush("run-end")
    assert [request.url.path for request in seen] == ["/v1/measurements", "/v1/flush"]
    assert [request.headers["idempotency-key"] for request in seen] == ["run-0-1", "run-end"]
    assert seen[0].headers["content-type"] == "application/json"


def test_a_feed_that_may_not_end_the_stream_has_sent_everything() -> None:
    document = {"code": "ROLE_NOT_ALLOWED", "detail": "this request requires the role operate"}
    destination = _service(httpx.Response(403, json=document))
    with pytest.raises(StreamGoesOnError, match=r"requires the role operate; use --no-flush"):
        destination.flush("run-end")
    with pytest.raises(PeerError, match="rejected with 403") as caught:
        destination.send(_batch(), "k")
    assert not isinstance(caught.value, StreamGoesOnError)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (httpx.Response(404, html="<html></html>"),
         "another web server than multiradar responded (404 Not Found, text/html); specify the"),
        (httpx.Response(405, json={"detail": "Method Not Allowed"}), "(405 Method Not Allowed, "),
        (httpx.Response(501), "(501 Not Implemented, no content type)"),
        (httpx.Response(200, html="<html></html>"), "responded (200 OK, text/html)"),
        (httpx.Response(301, headers={"location": "https://service/"}), "redirects to https://serv"),
        (httpx.Response(404, json={"code": "NOT_FOUND", "detail": "no such"}), "rejected with 404"),
        (httpx.Response(413, html="<html></html>"), "rejected with 413"),
    ],
)  # fmt: skip
def test_another_web_server_is_named(answer: httpx.Response, words: str) -> None:
    with pytest.raises(PeerError, match=re.escape(words)):
        _service(answer).send(_batch(), "k")


@pytest.mark.parametrize("status", [429, 502, 503, 504, 507])
def test_come_back_later_is_a_retry_after_the_time_asked_for(status: int) -> None:
    answer = httpx.Response(status, headers={"retry-after": "3"})
    with pytest.raises(UnavailableError) as caught:
        _service(answer).send(_batch(), "k")
    assert caught.value.retry_after_s == 3.0
    assert caught.value.answered
    with pytest.raises(UnavailableError):
        _service(answer).flush("k")


def test_a_date_in_retry_after_leaves_the_pause_to_the_back_off() -> None:
    answer = httpx.Response(503, headers={"retry-after": "Wed, 21 Oct 2026 07:28:00 GMT"})
    with pytest.raises(UnavailableError) as caught:
        _service(answer).send(_batch(), "k")
    assert caught.value.retry_after_s is None


@pytest.mark.parametrize(
    "error", [httpx.ConnectError("rejected"), httpx.ReadError("reset"), httpx.ReadTimeout("slow")]
)
def test_a_lost_connection_is_a_retry(error: httpx.TransportError) -> None:
    def handle(_request: httpx.Request) -> httpx.Response:
        raise error

    destination = HttpDestination("http://service", Encoding.ARROW, httpx.MockTransport(handle))
    with pytest.raises(UnavailableError, match="no response") as caught:
        destination.send(_batch(), "k")
    assert not caught.value.answered
    assert destination.starting() is None


@pytest.mark.parametrize(
    ("status", "document", "starting"),
    [
        (503, {"code": "NOT_READY", "detail": "compiling kernels: 3 of 31"}, "compiling kernels: 3 "
         "of 31"),
        (503, {"code": "NOT_READY", "detail": "the service is starting: loading"}, "loading"),
        (503, {"code": "NOT_READY"}, "not ready yet"),
        (503, {"code": "NOT_READY", "detail": "the service is not running: failed"}, None),
        (503, {"code": "JOURNAL_FULL", "detail": "full"}, None),
        (503, {}, None),
        (200, {"ready": True}, None),
    ],
)  # fmt: skip
def test_a_service_says_what_it_does_before_it_is_ready(
    status: int, document: dict[str, object], starting: str | None
) -> None:
    seen: list[httpx.Request] = []
    assert _service(httpx.Response(status, json=document), seen).starting() == starting
    assert [request.url.path for request in seen] == ["/readyz"]


def test_the_cause_of_a_lost_connection_is_reported_without_its_number() -> None:
    def handle(_request: httpx.Request) -> httpx.Response:
        raise httpx.ConnectError("[Errno 111] Connection refused")

    destination = HttpDestination("http://service", Encoding.ARROW, httpx.MockTransport(handle))
    with pytest.raises(UnavailableError) as caught:
        destination.flush("k")
    assert str(caught.value) == "http://service: no response (Connection refused)"


def test_a_batch_of_which_no_row_was_taken_is_an_answer_all_the_same() -> None:
    problem = {
        "title": "none",
        "accepted": 0,
        "rejected": [
            {"code": "OUT_OF_RANGE", "reason": "time_s: expected seconds (milliseconds?)"},
            {"code": "OUT_OF_RANGE", "reason": "time_s: another"},
        ],
        "duplicate": False,
    }
    answer = _service(httpx.Response(422, json=problem)).send(_batch(), "k")
    assert answer == Answer(0, 2, False, {"OUT_OF_RANGE": 2})
    assert answer.reasons == {"OUT_OF_RANGE": "time_s: expected seconds (milliseconds?)"}


@pytest.mark.parametrize("status", [400, 409, 413, 415, 422])
def test_a_rejection_reports_the_reason_of_the_service(status: int) -> None:
    answer = httpx.Response(status, json={"title": "No", "detail": "the key names another batch"})
    with pytest.raises(PeerError, match=f"rejected with {status}, the key names another") as caught:
        _service(answer).send(_batch(), "k")
    assert not isinstance(caught.value, UnavailableError)


@pytest.mark.parametrize("body", [b"", b"<html>", b"[]", b'{"accepted": "x"}'])
def test_an_answer_that_is_not_of_this_service_is_rejected(body: bytes) -> None:
    with pytest.raises(PeerError, match=r"expected the counts|another web server"):
        _service(httpx.Response(200, content=body)).send(_batch(), "k")


def test_numbers_keep_all_their_digits_in_every_encoding() -> None:
    batch = _batch()
    arrow = pl.read_ipc_stream(io.BytesIO(encode(batch, Encoding.ARROW)))
    assert arrow.equals(batch)
    for rows in (
        json.loads(encode(batch, Encoding.JSON)),
        [json.loads(line) for line in encode(batch, Encoding.NDJSON).splitlines()],
    ):
        assert [row["time_s"] for row in rows] == batch["time_s"].to_list()
        assert rows[0]["range_m"] == batch["range_m"][0]
        assert rows[0]["mode_3a"] == "0123"
        assert rows[1].get("range_m") is None


@pytest.mark.parametrize("url", ["http://", "http://a b", "http://127.0.0.1:port"])
def test_an_invalid_address_is_rejected_before_anything_is_sent(url: str) -> None:
    with pytest.raises(ConfigurationError, match="expected an address such as http://"):
        HttpDestination(url, Encoding.ARROW)


def test_rows_of_unknown_sensors_and_the_sensors_of_the_service_are_read() -> None:
    rejected = [{"index": 0, "code": "NON_FINITE"}, {"index": 1, "code": "UNKNOWN_SENSOR"}]
    answer = {"accepted": 0, "rejected": rejected, "duplicate": False}
    assert _service(httpx.Response(200, json=answer)).send(_batch(), "k").unknown == (1,)
    sensors = {"count": 2, "sensors": [{"id": "26-10"}, {"id": "35-10"}]}
    assert _service(httpx.Response(200, json=sensors)).configured() == ("26-10", "35-10")
    assert _service(httpx.Response(404, json={})).configured() == ()


@pytest.mark.parametrize(("key", "sent"), [("mr_1", "Bearer mr_1"), ("", None), (None, None)])
def test_the_key_of_the_environment_is_sent(
    monkeypatch: pytest.MonkeyPatch, key: str | None, sent: str | None
) -> None:
    monkeypatch.delenv(KEY_VARIABLE, raising=False)
    if key is not None:
        monkeypatch.setenv(KEY_VARIABLE, key)
    received: list[str | None] = []

    def answer(request: httpx.Request) -> httpx.Response:
        received.append(request.headers.get("authorization"))
        return httpx.Response(200, json={})

    destination = HttpDestination("http://127.0.0.1:1", Encoding.JSON, httpx.MockTransport(answer))
    destination.flush("end")
    destination.close()
    assert received == [sent]


# ---------------------------------------------------------------- two addresses


class _Pair:
    """Two services that answer with a status each; who was asked with which key, in order."""

    def __init__(self, **statuses: int) -> None:
        self.statuses = statuses
        self.asked: list[tuple[str, str]] = []
        transport = httpx.MockTransport(self._handle)
        self.destination = Alternatives(
            [HttpDestination(f"http://{one}", Encoding.JSON, transport) for one in statuses]
        )

    def _handle(self, request: httpx.Request) -> httpx.Response:
        host = request.url.host
        self.asked.append((host, request.headers.get("idempotency-key", "")))
        status = self.statuses[host]
        if status == 0:
            raise httpx.ConnectError("[Errno 111] Connection refused")
        if request.url.path == "/v1/sensors":
            return httpx.Response(status, json={"sensors": [{"id": "41-10"}]})
        headers = {"retry-after": "1"} if status == 503 else {}
        return httpx.Response(status, json=ACKNOWLEDGEMENT, headers=headers)


def test_the_service_that_took_over_gets_the_batch_under_its_key_and_then_the_next_first() -> None:
    pair = _Pair(a=200, b=503)
    pair.destination.send(_batch(), "k1")
    pair.statuses |= {"a": 0, "b": 200}
    assert pair.destination.send(_batch(), "k2") == Answer(1, 1, False)
    pair.destination.flush("end")
    assert pair.asked == [("a", "k1"), ("a", "k2"), ("b", "k2"), ("b", "end")]


def test_neither_of_two_services_is_a_retry_after_the_time_asked_for() -> None:
    pair = _Pair(a=0, b=503)
    with pytest.raises(UnavailableError) as caught:
        pair.destination.send(_batch(), "k")
    assert (caught.value.retry_after_s, caught.value.answered) == (1.0, True)
    assert str(caught.value) == (
        "http://a: no response (Connection refused); "
        "http://b/v1/measurements: responded with 503 Service Unavailable"
    )
    assert pair.destination.starting() is None


def test_a_service_that_is_there_reports_the_sensors_of_both() -> None:
    assert _Pair(a=200, b=200).destination.configured() == ("41-10",)
    pair = _Pair(a=0, b=200)
    assert pair.destination.configured() == ("41-10",)
    pair.destination.close()


def test_a_service_without_tls_is_named() -> None:
    def handle(_request: httpx.Request) -> httpx.Response:
        raise httpx.ConnectError("[SSL: WRONG_VERSION_NUMBER] wrong version number (_ssl.c:1006)")

    destination = HttpDestination("https://service", Encoding.ARROW, httpx.MockTransport(handle))
    with pytest.raises(UnavailableError, match="does not use TLS; use http:// instead of https"):
        destination.flush("k")
