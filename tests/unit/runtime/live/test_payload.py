"""Measurements in the journal have the columns of the schema, with any columns received."""

import json
import math

import polars as pl
from polars.testing import assert_frame_equal

from multiradar.runtime.live.payload import decode_rows, encode_rows, row_texts
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA, complete
from support.scenarios.live_scene import recording


def test_absent_columns_are_null_other_types_are_cast_and_others_left_out() -> None:
    whole = complete(recording(20))
    assert whole.schema == MEASUREMENT_SCHEMA
    assert complete(whole) is whole
    lacking = whole.drop("height_m").with_columns(pl.col("range_m").cast(pl.Float32), more=1)
    found = complete(lacking)
    assert found.schema == MEASUREMENT_SCHEMA
    assert found["height_m"].null_count() == 20
    assert_frame_equal(complete(whole.with_columns(more=1)), whole)


def test_rows_survive_the_round_trip() -> None:
    frame = recording(20)
    assert_frame_equal(complete(decode_rows(encode_rows(frame))), complete(frame))
    assert encode_rows(frame[:0]) == b""


def test_each_empty_column_of_aircraft_derived_data_is_omitted() -> None:
    frame = recording(20)
    before = decode_rows(encode_rows(frame)).columns
    assert decode_rows(encode_rows(complete(frame))).columns == before
    some = frame.with_columns(roll_deg=pl.lit(None, pl.Float64), mach=pl.int_range(pl.len()) / 100)
    stored = decode_rows(encode_rows(some))
    assert stored.columns == [*before, "mach"]
    assert stored["mach"].to_list() == some["mach"].to_list()


def test_an_empty_ground_status_is_omitted_as_before_there_was_one() -> None:
    frame = recording(20)
    assert "on_ground" not in decode_rows(encode_rows(complete(frame))).columns
    status = frame.with_columns(on_ground=pl.int_range(pl.len()) == 3)
    assert decode_rows(encode_rows(status))["on_ground"].to_list() == status["on_ground"].to_list()


def test_rejected_rows_are_written_as_json_writes_them() -> None:
    frame = pl.DataFrame(
        {
            "time_s": [1.8e9 + 1 / 7, -0.0, 1e-9, 1e300, None, math.nan, math.inf, -math.inf],
            'quoted "%" name': ["a", None, 'x"\\\n', "Zürich ✈", "\x00\x7f", "%s", "", "\u2028"],
            "number": [0, -1, None, 2**63 - 1, 5, 6, 7, 8],
            "small": pl.Series([0, 1, None, 3, 4, 5, 6, 255], dtype=pl.UInt8),
            "single": pl.Series([0.1, None, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0], dtype=pl.Float32),
            "is_true": [True, False, None, True, True, True, True, True],
            "empty": pl.Series([None] * 8, dtype=pl.Float64),
            "null": [None] * 8,
            "list": [[1.5, None], [], None, [2.0], [], [], [], []],
        }
    )
    for part in (frame, frame[:1], frame[:2], frame[4:5], frame[5:]):
        expected = [json.dumps(row, ensure_ascii=False) for row in part.iter_rows(named=True)]
        assert row_texts(part) == expected
    assert row_texts(frame[:0]) == []
    assert row_texts(pl.DataFrame()) == []
