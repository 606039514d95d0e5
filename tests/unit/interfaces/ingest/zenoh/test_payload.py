"""Payloads on the measurement keys: encodings, sizes, and the sensor of the key."""

import io
import json
from typing import Any

import polars as pl
import pytest

from multiradar.errors import PayloadError
from multiradar.ingest.zenoh.payload import PayloadBounds, read_payload
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA

BOUNDS = PayloadBounds(bytes_max=10_000, rows_max=100)
KEY = "multiradar/v1/measurements/41-10"
ARROW = "application/vnd.apache.arrow.stream"


def plot(**changes: Any) -> dict[str, Any]:
    row = {"time_s": 1.0, "sensor_id": "41-10", "kind": "radar", "range_m": 5e4, "azimuth_deg": 1.0}
    return {name: value for name, value in {**row, **changes}.items() if value is not ...}


def array(*rows: dict[str, Any]) -> bytes:
    return json.dumps(rows).encode()


def lines(*rows: dict[str, Any]) -> bytes:
    return b"\n".join(json.dumps(row).encode() for row in rows)


def arrow(*rows: dict[str, Any]) -> bytes:
    schema = {name: kind for name, kind in MEASUREMENT_SCHEMA.items() if name in rows[0]}
    buffer = io.BytesIO()
    pl.DataFrame(rows, schema=schema).write_ipc_stream(buffer)
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("media_type", "payload"),
    [
        ("application/json", array(plot(), plot(time_s=2.0))),
        ("text/json", array(plot(), plot(time_s=2.0))),
        ("application/json;measurements", array(plot(), plot(time_s=2.0))),
        ("application/x-ndjson", lines(plot(), plot(time_s=2.0))),
        ("application/jsonl", lines(plot(), plot(time_s=2.0))),
        (ARROW, arrow(plot(), plot(time_s=2.0))),
        ("zenoh/bytes", array(plot(), plot(time_s=2.0))),
        ("zenoh/bytes", lines(plot(), plot(time_s=2.0))),
        ("zenoh/bytes", arrow(plot(), plot(time_s=2.0))),
    ],
)
def test_every_form_of_measurements_is_read(media_type: str, payload: bytes) -> None:
    decoded = read_payload(KEY, media_type, payload, BOUNDS)
    assert decoded.frame["time_s"].to_list() == [1.0, 2.0]
    assert decoded.rejected == ()


def test_one_object_is_one_measurement() -> None:
    payload = json.dumps(plot()).encode()
    assert read_payload(KEY, "application/json", payload, BOUNDS).frame.height == 1


@pytest.mark.parametrize(
    ("media_type", "payload"),
    [
        ("application/json", array(plot(sensor_id=...), plot(), plot(sensor_id=...))),
        ("application/x-ndjson", lines(plot(sensor_id=...), plot(), plot(sensor_id=...))),
        (ARROW, arrow(plot(sensor_id=...), plot(sensor_id=...), plot(sensor_id=...))),
        (ARROW, arrow(plot(sensor_id=None), plot(), plot(sensor_id=None))),
    ],
)
def test_a_row_without_a_sensor_has_that_of_the_key(media_type: str, payload: bytes) -> None:
    decoded = read_payload(KEY, media_type, payload, BOUNDS)
    assert decoded.rejected == ()
    assert decoded.frame["sensor_id"].to_list() == ["41-10"] * 3
    assert decoded.frame["index"].to_list() == [0, 1, 2]


def test_a_row_without_a_sensor_is_still_held_to_all_other_rules() -> None:
    payload = array(plot(), plot(sensor_id=..., range_m=-1.0), plot(sensor_id=..., kind=...))
    decoded = read_payload(KEY, "application/json", payload, BOUNDS)
    assert [(row.index, row.code) for row in decoded.rejected] == [
        (1, "OUT_OF_RANGE"),
        (2, "MISSING_FIELD"),
    ]
    assert decoded.frame["index"].to_list() == [0]


def test_a_nested_row_loses_no_other() -> None:
    nested = b"[" * 1500 + b"]" * 1500
    payload = lines(plot(sensor_id=...)) + b"\n" + nested + b"\n" + lines(plot(sensor_id=...))
    decoded = read_payload(KEY, "application/x-ndjson", payload, BOUNDS)
    assert decoded.frame["index"].to_list() == [0, 2]
    assert [(row.index, row.code) for row in decoded.rejected] == [(1, "MALFORMED_JSON")]


def test_a_row_of_another_sensor_is_rejected_and_its_neighbours_are_not() -> None:
    payload = array(plot(), plot(sensor_id="26-10"), plot())
    decoded = read_payload(KEY, "application/json", payload, BOUNDS)
    assert decoded.frame["index"].to_list() == [0, 2]
    assert [(row.index, row.code) for row in decoded.rejected] == [(1, "UNKNOWN_SENSOR")]
    assert "41-10" in decoded.rejected[0].reason
    assert json.loads(decoded.rejected[0].raw)["sensor_id"] == "26-10"


def test_a_key_without_a_sensor_takes_rows_of_all_sensors() -> None:
    payload = array(plot(), plot(sensor_id="26-10"))
    decoded = read_payload("multiradar/v1/measurements/*", "", payload, BOUNDS)
    assert decoded.frame["sensor_id"].to_list() == ["41-10", "26-10"]


@pytest.mark.parametrize(
    ("key", "media_type", "payload", "code"),
    [
        (KEY, "application/json", b"[{", "MALFORMED_JSON"),
        (KEY, "application/json", b"", "MALFORMED_JSON"),
        (KEY, ARROW, b"\xff\xff\xff\xff rest", "MALFORMED_ARROW"),
        (KEY, ARROW, arrow(plot(sensor_id=...))[:-20], "MALFORMED_ARROW"),
        (KEY, "application/json", b"[\xff]", "ENCODING"),
        (KEY, "image/png", b"[]", "ENCODING"),
        (KEY, "application/json", b" " * 10_001, "TOO_LARGE"),
        (KEY, "application/json", b"[" + b"1," * 100 + b"1]", "TOO_LARGE"),
        ("multiradar/v1/measurements/a b", "application/json", array(plot()), "UNKNOWN_SENSOR"),
        ("multiradar/v1/measurements/" + "a" * 65, "", array(plot()), "UNKNOWN_SENSOR"),
    ],
)
def test_what_cannot_be_read_has_a_code(
    key: str, media_type: str, payload: bytes, code: str
) -> None:
    with pytest.raises(PayloadError) as caught:
        read_payload(key, media_type, payload, BOUNDS)
    assert caught.value.code == code


def test_the_largest_content_is_still_read() -> None:
    payload = array(plot())
    bounds = PayloadBounds(bytes_max=len(payload), rows_max=1)
    assert read_payload(KEY, "application/json", payload, bounds).frame.height == 1
