"""Measurements over HTTP: accepted, rejected, and the answer to the sender."""

import asyncio
import contextlib
import io
import json
import threading
from concurrent.futures import Future
from typing import Any
from unittest import mock

import httpx
import polars as pl
import pyarrow
import pytest
from structlog.testing import capture_logs

from multiradar.api.factory import create_api
from multiradar.errors import IdempotencyConflictError, JournalFullError
from multiradar.ingest import http
from multiradar.ingest.bodies import Decoded, decode
from multiradar.ingest.http import IntakeBounds, measurement_routes
from multiradar.runtime.live.receipt import Receipt, RejectedRow
from support.fakes.fake_service import FakeService, Submission
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until

_PLOT: dict[str, Any] = {
    "time_s": 100.0,
    "sensor_id": "41-10",
    "kind": "radar",
    "range_m": 1000.0,
    "azimuth_deg": 10.0,
}
_JSON = "application/json"
_NDJSON = "application/x-ndjson"
_ARROW = "application/vnd.apache.arrow.stream"


async def _post(
    client: httpx.AsyncClient, body: bytes, media_type: str = _JSON, **headers: str
) -> httpx.Response:
    return await client.post(
        "/v1/measurements", content=body, headers={"content-type": media_type, **headers}
    )


def _arrow(rows: list[dict[str, Any]]) -> bytes:
    table = pyarrow.Table.from_pylist(rows)
    sink = io.BytesIO()
    with pyarrow.ipc.new_stream(sink, table.schema) as writer:
        writer.write_table(table)
    return sink.getvalue()


@pytest.mark.parametrize(
    ("media_type", "body"),
    [
        (_JSON, json.dumps([_PLOT, _PLOT]).encode()),
        ("application/json; charset=utf-8", json.dumps([_PLOT, _PLOT]).encode()),
        ("Application/JSON", json.dumps([_PLOT, _PLOT]).encode()),
        (_NDJSON, (json.dumps(_PLOT) + "\n" + json.dumps(_PLOT)).encode()),
        (_ARROW, _arrow([_PLOT, _PLOT])),
    ],
)
async def test_each_form_of_the_same_measurements_is_taken(
    client: httpx.AsyncClient, service: FakeService, media_type: str, body: bytes
) -> None:
    answer = await _post(client, body, media_type)
    assert answer.status_code == 200
    assert answer.json() == {
        "accepted": 2,
        "rejected": [],
        "duplicate": False,
        "journal_sequence": 1,
    }
    frame = service.submissions[0].frame
    assert frame["range_m"].to_list() == [1000.0, 1000.0]
    assert frame["index"].to_list() == [0, 1]


async def test_a_single_object_is_taken(client: httpx.AsyncClient, service: FakeService) -> None:
    answer = await _post(client, b"\n " + json.dumps(_PLOT).encode())
    assert answer.json()["accepted"] == 1
    assert service.submissions[0].frame["time_s"].to_list() == [100.0]


async def test_bad_rows_are_listed_and_the_good_ones_taken(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    rows = [_PLOT, {**_PLOT, "azimuth_deg": 360.0}, _PLOT, {**_PLOT, "range_m": True}]
    answer = await _post(client, json.dumps(rows).encode())
    document = answer.json()
    assert answer.status_code == 200
    assert document["accepted"] == 2
    assert [(row["index"], row["code"]) for row in document["rejected"]] == [
        (1, "OUT_OF_RANGE"),
        (3, "WRONG_TYPE"),
    ]
    assert all(row["reason"] for row in document["rejected"])
    # The quarantine gets what stood there; the answer does not repeat it.
    assert '"azimuth_deg": 360.0' in service.submissions[0].rejected[0].raw


async def test_an_empty_array_is_no_error(client: httpx.AsyncClient) -> None:
    answer = await _post(client, b"[]")
    assert (answer.status_code, answer.json()["accepted"]) == (200, 0)


async def test_rows_of_which_none_is_a_measurement_are_422_and_kept(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    answer = await _post(client, b'[{"a": 1}, 7]')
    document = answer.json()
    assert (answer.status_code, document["code"]) == (422, "NO_MEASUREMENTS")
    assert answer.headers["content-type"] == "application/problem+json"
    assert [row["index"] for row in document["rejected"]] == [0, 1]
    assert document["journal_sequence"] == 1
    assert len(service.submissions[0].rejected) == 2


@pytest.mark.parametrize("code", ["TIME_LATE", "RATE_EXCEEDED"])
async def test_measurements_rejected_for_their_time_or_number_only_are_200(
    client: httpx.AsyncClient, service: FakeService, code: str
) -> None:
    def late(_: Submission, future: "Future[Receipt]") -> None:
        future.set_result(Receipt(0, (RejectedRow(0, code, "late"),), False, 5))

    service.answer = late
    answer = await _post(client, json.dumps([_PLOT]).encode())
    assert answer.status_code == 200
    assert answer.json()["rejected"] == [{"index": 0, "code": code, "reason": "late"}]


_DEEP = b"[" * 100_000
_MANY_KEYS = b"[{" + b",".join(b'"k%d":1' % number for number in range(100_000)) + b"}]"


@pytest.mark.parametrize(
    ("body", "status", "code"),
    [
        (b"", 400, "MALFORMED_JSON"),
        (b"nonsense", 400, "MALFORMED_JSON"),
        (b"[" + json.dumps(_PLOT).encode(), 400, "MALFORMED_JSON"),
        (json.dumps([_PLOT]).encode()[:-2], 400, "MALFORMED_JSON"),
        (json.dumps(_PLOT).encode() + b"," + json.dumps(_PLOT).encode(), 400, "MALFORMED_JSON"),
        (b"7", 400, "MALFORMED_JSON"),
        (b"null", 400, "MALFORMED_JSON"),
        (b'"text"', 400, "MALFORMED_JSON"),
        (_DEEP, 400, "MALFORMED_JSON"),
        (b'[{"a":' * 50_000, 400, "MALFORMED_JSON"),
        (b"\xff\xfe[\x00]\x00", 400, "ENCODING"),
        (b"[\xc0\xaf]", 400, "ENCODING"),
        (b'[{"a": "\xed\xa0\x80"}]', 400, "ENCODING"),
        (_MANY_KEYS, 422, "NO_MEASUREMENTS"),
    ],
)
async def test_an_invalid_json_body_is_rejected_as_a_whole(
    client: httpx.AsyncClient, service: FakeService, body: bytes, status: int, code: str
) -> None:
    answer = await _post(client, body)
    assert (answer.status_code, answer.json()["code"]) == (status, code)
    # A body without a valid row is submitted, so that its rejects are counted and retained.
    assert [len(one.rejected) for one in service.submissions] == ([1] if status == 422 else [])
    assert all(one.frame.is_empty() for one in service.submissions)


def _text(**fields: str) -> bytes:
    members = {name: json.dumps(value) for name, value in _PLOT.items()} | fields
    good = json.dumps(_PLOT)
    bad = "{" + ",".join(f'"{name}":{value}' for name, value in members.items()) + "}"
    return f"[{good},{bad}]".encode()


@pytest.mark.parametrize(
    ("body", "code"),
    [
        (_text(range_m="NaN"), "NON_FINITE"),
        (_text(range_m="Infinity"), "NON_FINITE"),
        (_text(range_m="-Infinity"), "NON_FINITE"),
        (_text(range_m="1e999"), "NON_FINITE"),
        (_text(range_m="true"), "WRONG_TYPE"),
        (_text(range_m='"1000"'), "NOT_A_NUMBER"),
        (_text(range_m="[]"), "WRONG_TYPE"),
        (_text(range_m="0"), "OUT_OF_RANGE"),
        (_text(range_m="-1"), "OUT_OF_RANGE"),
        (_text(range_m="1000000.1"), "OUT_OF_RANGE"),
        (_text(range_m="1" * 5000), "NON_FINITE"),
        (_text(azimuth_deg="360"), "OUT_OF_RANGE"),
        (_text(time_s="1e11"), "OUT_OF_RANGE"),
        (_text(track_number="9" * 30), "OUT_OF_RANGE"),
        (_text(track_number="1.5"), "WRONG_TYPE"),
        (_text(mode_3a='"7778"'), "OUT_OF_RANGE"),
        (_text(sensor_id='"../../etc"'), "OUT_OF_RANGE"),
        (_text(sensor_id='"a\\u0000b"'), "OUT_OF_RANGE"),
        (_text(sensor_id='"\\ud800"'), "ENCODING"),
        (_text(kind='"sonar"'), "UNKNOWN_KIND"),
        (_text(extra="1"), "UNKNOWN_FIELD"),
        (_text(extra='{"__proto__": 1}'), "UNKNOWN_FIELD"),
        (_text().replace(b'"range_m":1000.0', b'"range_m":1,"range_m":2'), "DUPLICATE_KEY"),
        (_text().replace(b'"kind":"radar",', b""), "MISSING_FIELD"),
    ],
)
async def test_a_hostile_row_is_coded_and_its_neighbour_taken(
    client: httpx.AsyncClient, body: bytes, code: str
) -> None:
    answer = await _post(client, body)
    assert answer.status_code == 200, answer.text
    document = answer.json()
    assert document["accepted"] == 1
    assert [(row["index"], row["code"]) for row in document["rejected"]] == [(1, code)]


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"nonsense",
        b"ARROW1\0\0",
        _arrow([_PLOT])[:-40],
        _arrow([_PLOT])[:60],
        b"\xff\xff\xff\xff\xff\xff\xff\x7f",
        _arrow([{**_PLOT, "range_m": "text"}]),
    ],
)
async def test_a_damaged_arrow_stream_is_rejected_as_a_whole(
    client: httpx.AsyncClient, service: FakeService, body: bytes
) -> None:
    answer = await _post(client, body, _ARROW)
    assert (answer.status_code, answer.json()["code"]) == (400, "MALFORMED_ARROW")
    assert service.submissions == []


async def test_nan_in_an_arrow_stream_is_rejected_row_by_row(client: httpx.AsyncClient) -> None:
    answer = await _post(client, _arrow([{**_PLOT, "range_m": float("nan")}, _PLOT]), _ARROW)
    document = answer.json()
    assert document["accepted"] == 1
    assert [(row["index"], row["code"]) for row in document["rejected"]] == [(0, "NON_FINITE")]


@pytest.mark.parametrize(
    "media_type", ["text/plain", "", "application/xml", "application/json; charset=utf-16"]
)
async def test_an_unsupported_media_type_is_415_with_the_supported_types(
    client: httpx.AsyncClient, media_type: str
) -> None:
    answer = await _post(client, b"[]", media_type)
    assert (answer.status_code, answer.json()["code"]) == (415, "CONTENT_TYPE_UNSUPPORTED")
    assert answer.headers["accept-post"] == f"{_JSON}, {_NDJSON}, {_ARROW}"


@pytest.mark.parametrize("encoding", ["gzip", "br", "deflate, gzip"])
async def test_a_compressed_body_is_not_decoded(client: httpx.AsyncClient, encoding: str) -> None:
    answer = await _post(client, b"\x1f\x8b", _JSON, **{"content-encoding": encoding})
    assert (answer.status_code, answer.json()["code"]) == (415, "CONTENT_ENCODING_UNSUPPORTED")
    assert answer.headers["accept-encoding"] == "identity"


async def test_a_repeated_message_is_a_duplicate_with_the_same_counts(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    body = json.dumps([_PLOT, {**_PLOT, "range_m": -1}]).encode()
    first = await _post(client, body, **{"idempotency-key": "feed-7/42"})
    second = await _post(client, body, **{"idempotency-key": "feed-7/42"})
    assert first.json()["duplicate"] is False
    assert second.json() == {**first.json(), "duplicate": True}
    assert len(service.submissions) == 1


@pytest.mark.parametrize("key", ["", " ", "a" * 129, "é", "a\x7f"])
async def test_a_key_that_is_not_printable_is_rejected(client: httpx.AsyncClient, key: str) -> None:
    answer = await client.post(
        "/v1/measurements",
        content=b"[]",
        headers={b"content-type": b"application/json", b"idempotency-key": key.encode()},
    )
    assert (answer.status_code, answer.json()["code"]) == (400, "IDEMPOTENCY_KEY_INVALID")


async def test_a_body_of_a_source_in_quarantine_is_not_decoded(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.quarantined_sources = ("http",)
    answer = await _post(client, b"this would be answered 400")
    assert (answer.status_code, answer.json()["code"]) == (429, "SOURCE_QUARANTINED")
    assert int(answer.headers["retry-after"]) >= 1
    service.quarantined_sources = ("zenoh",)
    assert (await _post(client, json.dumps([_PLOT]).encode())).status_code == 200
    assert not service.unreadable


async def test_a_body_that_cannot_be_read_counts_for_the_quarantine_of_its_source(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    assert (await _post(client, b"[{")).status_code == 400
    assert service.unreadable == [("http", 2)]


class _StrictService(FakeService):
    """Puts a source into quarantine for one body that cannot be read."""

    def note_unreadable(self, source: str, octets: int) -> None:
        super().note_unreadable(source, octets)
        self.quarantined_sources = (source,)


async def test_a_body_that_waited_for_one_that_led_to_a_quarantine_is_not_decoded() -> None:
    service = _StrictService()
    routes = measurement_routes(service, IntakeBounds(large_octets=1, large_octets_max=1))
    transport = httpx.ASGITransport(create_api(service, routers=[routes]))
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
        answers = await asyncio.gather(*(_post(client, b"[{") for _ in range(3)))
    assert sorted(answer.status_code for answer in answers) == [400, 429, 429]
    assert service.unreadable == [("http", 2)]


async def test_a_key_of_the_greatest_length_is_taken(client: httpx.AsyncClient) -> None:
    answer = await _post(client, b"[]", **{"idempotency-key": "a" * 128})
    assert answer.status_code == 200


async def test_a_journal_that_does_not_answer_is_503_and_not_cancelled(
    service: FakeService,
) -> None:
    waiting: list[Future[Receipt]] = []
    service.answer = lambda _, future: waiting.append(future)
    routes = measurement_routes(service, IntakeBounds(acknowledge_deadline_s=0.01))
    transport = httpx.ASGITransport(create_api(service, routers=[routes]))
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
        answer = await _post(client, json.dumps([_PLOT]).encode())
    assert (answer.status_code, answer.json()["code"]) == (503, "NOT_ACKNOWLEDGED")
    assert answer.headers["retry-after"] == "5"
    assert not waiting[0].cancelled()
    waiting[0].set_result(Receipt(1, (), False, 1))


async def test_flush_takes_no_body_and_is_acknowledged(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    assert (await client.post("/v1/flush", content=b"x")).json()["code"] == "BODY_NOT_EXPECTED"
    answer = await client.post("/v1/flush")
    assert answer.json()["journal_sequence"] == 1
    assert service.flushes == ["http"]


@pytest.mark.parametrize(
    ("media_type", "body"),
    [
        (_JSON, json.dumps([_PLOT] * 5).encode()),
        (_NDJSON, b"\n".join([json.dumps(_PLOT).encode()] * 5)),
        (_ARROW, _arrow([_PLOT] * 5)),
    ],
)
async def test_a_message_of_too_many_rows_is_413(
    service: FakeService, media_type: str, body: bytes
) -> None:
    for rows_max, status in ((5, 200), (4, 413)):
        routes = measurement_routes(service, IntakeBounds(rows_max=rows_max))
        transport = httpx.ASGITransport(create_api(service, routers=[routes]))
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
            answer = await _post(client, body, media_type)
        assert answer.status_code == status
        assert status == 200 or answer.json()["code"] == "TOO_LARGE"


async def test_query_parameters_are_rejected(client: httpx.AsyncClient) -> None:
    answer = await client.post("/v1/measurements?dry_run=1", content=b"[]")
    assert (answer.status_code, answer.json()["code"]) == (422, "UNKNOWN_PARAMETER")
    assert answer.json()["errors"][0]["parameter"] == "dry_run"


@pytest.mark.parametrize(
    "query",
    [
        "flush?force=false&force=true", "clock?time_s=1&time_s=2", "clock?time_s=1_000",
        "clock?time_s=%201", "clock?time_s=1%20", "clock?time_s=nan",
    ],
)  # fmt: skip
async def test_repeated_parameters_and_unusual_numbers_are_rejected(
    client: httpx.AsyncClient, service: FakeService, query: str
) -> None:
    answer = await client.post(f"/v1/{query}")
    assert (answer.status_code, answer.json()["code"]) == (422, "INVALID_PARAMETER")
    assert (service.flushes, service.clocks) == ([], [])


async def test_an_arrow_table_written_by_polars_is_taken(client: httpx.AsyncClient) -> None:
    sink = io.BytesIO()
    pl.DataFrame([_PLOT]).write_ipc_stream(sink)
    assert (await _post(client, sink.getvalue(), _ARROW)).json()["accepted"] == 1


async def test_two_keys_of_one_message_are_rejected(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    keys = [("content-type", _JSON), ("idempotency-key", "one"), ("idempotency-key", "other")]
    answer = await client.post("/v1/measurements", content=b"[]", headers=keys)
    assert (answer.status_code, answer.json()["code"]) == (400, "IDEMPOTENCY_KEY_INVALID")
    assert service.submissions == []


async def test_one_object_whose_row_is_rejected_is_one_rejected_row(
    client: httpx.AsyncClient,
) -> None:
    answer = await _post(client, json.dumps({**_PLOT, "range_m": "far"}).encode())
    assert (answer.status_code, answer.json()["code"]) == (422, "NO_MEASUREMENTS")
    assert [row["index"] for row in answer.json()["rejected"]] == [0]


async def test_a_live_stream_ends_only_by_force(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.live = ("41-10",)
    answer = await client.post("/v1/flush")
    assert (answer.status_code, answer.json()["code"]) == (409, "STREAM_IS_LIVE")
    assert "41-10" in answer.json()["detail"]
    assert (await client.post("/v1/flush?force=true")).status_code == 200
    assert service.flushes == ["http"]


async def test_an_operator_sets_the_data_clock(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    for wrong in ("", "?time_s=now", "?time_s=nan", "?time_s=1e300", "?time_s=1&force=true"):
        assert (await client.post(f"/v1/clock{wrong}")).status_code == 422, wrong
    assert (await client.post("/v1/clock?time_s=5", content=b"x")).status_code == 400
    assert service.clocks == []
    with capture_logs() as logs:
        assert (await client.post("/v1/clock?time_s=1700000000.5")).status_code == 200
    assert service.clocks == [1_700_000_000.5]
    assert [one["time_s"] for one in logs if one["event"] == "clock_set"] == service.clocks


async def test_small_messages_are_decoded_in_turns_between_clients(
    service: FakeService, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One client could have 64 bodies decoded before the next message of another."""
    decoded: list[int] = []
    gate = threading.Event()

    def counted(media_type: str, body: bytes, rows_max: int) -> Decoded:
        decoded.append(len(body))
        gate.wait(WAIT_TIMEOUT_S)
        return decode(media_type, body, rows_max)

    monkeypatch.setattr(http, "decode", counted)
    application = create_api(
        service, routers=[measurement_routes(service, IntakeBounds(threads=1))]
    )
    large, small = json.dumps([_PLOT] * 10).encode(), json.dumps(_PLOT).encode()
    async with contextlib.AsyncExitStack() as clients:
        many, other = [
            await clients.enter_async_context(
                httpx.AsyncClient(
                    transport=httpx.ASGITransport(application, client=(address, 1)),
                    base_url="http://127.0.0.1",
                )
            )
            for address in ("127.0.0.2", "127.0.0.3")
        ]
        answers = [asyncio.create_task(_post(many, large)) for _ in range(16)]
        await asyncio.to_thread(wait_until, lambda: decoded, "the first message to be decoded")
        # The others of this client have arrived when one after them is answered.
        assert (await many.get("/v1/status")).status_code == 200
        answers.append(asyncio.create_task(_post(other, small)))
        assert (await other.get("/v1/status")).status_code == 200
        gate.set()
        assert {(await answer).status_code for answer in answers} == {200}
    assert len(decoded) == 17
    assert decoded.index(len(small)) <= 2


@pytest.mark.parametrize("path", ["/v1/flush", "/v1/clock?time_s=5"])
@pytest.mark.parametrize(
    ("outcome", "status"),
    [
        (IdempotencyConflictError("key", 1), 422),
        (JournalFullError("journal.sqlite: disk full"), 507),
        (Receipt(0, (), True, 1), 200),
        (Receipt(0, (), False, 1), 200),
    ],
)
async def test_only_what_was_executed_is_in_the_security_log(
    client: httpx.AsyncClient, service: FakeService, path: str,
    outcome: Receipt | Exception, status: int,
) -> None:  # fmt: skip
    """Regression: operations were logged before they were submitted."""
    future: Future[Receipt] = Future()
    executed = isinstance(outcome, Receipt) and not outcome.duplicate
    if isinstance(outcome, Receipt):
        future.set_result(outcome)
    else:
        future.set_exception(outcome)
    with (
        mock.patch.multiple(service, flush=lambda **_: future, set_clock=lambda *_, **__: future),
        capture_logs() as logs,
    ):
        assert (await client.post(path)).status_code == status
        assert (await client.post(path, content=b"x")).status_code == 400
    found = [one["event"] for one in logs if one["event"] in {"operated", "clock_set"}]
    assert found == ["operated", "clock_set"][: executed * (1 + ("clock" in path))]
