"""Arrow bodies: many encodings of the same table, bad rows one by one, forged lengths."""

import contextlib
import random
import struct
import sys

import polars as pl
import pyarrow as pa
import pytest
from polars.testing import assert_frame_equal

from multiradar_converters.normalised import arrow_layout
from multiradar_converters.normalised.arrow import parse_arrow
from multiradar_converters.normalised.arrow_layout import ArrowLayoutError, check_layout
from multiradar_converters.normalised.flatbuffer import Table
from multiradar_converters.normalised.parsed import PARSED_SCHEMA
from multiradar_schemas.errors import BodyError
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.reject import RejectCode
from support.inputs.messages import adsb, radar, stream
from support.processes.waiting import run_to_end

FRAME = pl.DataFrame([radar(), adsb()], schema=MEASUREMENT_SCHEMA)


def pyarrow_stream(table: pa.Table) -> bytes:
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as writer:
        writer.write_table(table)
    return bytes(sink.getvalue().to_pybytes())


@pytest.mark.parametrize(
    "body",
    [
        pytest.param(stream(FRAME), id="views"),
        pytest.param(stream(FRAME, compat_level=pl.CompatLevel.oldest()), id="large-utf8"),
        pytest.param(
            stream(FRAME.with_columns(pl.col("sensor_id", "kind").cast(pl.Categorical))),
            id="categories",
        ),
        pytest.param(stream(FRAME.select(sorted(FRAME.columns))), id="other-order"),
        pytest.param(
            pyarrow_stream(
                FRAME.to_arrow().set_column(
                    1, "sensor_id", pa.array(["41-10", "adsb"]).dictionary_encode()
                )
            ),
            id="dictionary",
        ),
        pytest.param(
            pyarrow_stream(FRAME.to_arrow().set_column(2, "kind", pa.array(["radar", "adsb"]))),
            id="utf8",
        ),
        pytest.param(
            pyarrow_stream(pa.concat_tables([FRAME[:1].to_arrow(), FRAME[1:].to_arrow()])),
            id="two-batches",
        ),
    ],
)
def test_the_same_table_in_any_encoding_gives_the_same_rows(body: bytes) -> None:
    parsed = parse_arrow(body)
    assert parsed.rejected == []
    assert parsed.frame.schema == PARSED_SCHEMA
    assert_frame_equal(parsed.frame.drop("index"), FRAME)
    assert parsed.frame["index"].to_list() == [0, 1]


# Of a short message the texts are compared, of a long one by loops.
@pytest.mark.parametrize("copies", [1, 200])
@pytest.mark.parametrize(
    ("address", "callsign"),
    [("4B00FE", "DLH1"), ("4b00fe", "dlh1"), ("4b00fe", " DLH1 "), ("4b00fe", "DLH1")],
)
def test_texts_are_stored_in_one_form(copies: int, address: str, callsign: str) -> None:
    named = radar(mode_s_address=address, callsign=callsign)
    frame = pl.DataFrame([named, radar()] * copies, schema=MEASUREMENT_SCHEMA)
    parsed = parse_arrow(stream(frame))
    assert parsed.rejected == []
    assert set(parsed.frame["mode_s_address"][::2]) == {"4b00fe"}
    assert set(parsed.frame["callsign"][::2]) == {"DLH1"}
    assert_frame_equal(parsed.frame[1::2].drop("index"), frame[1::2])


@pytest.mark.parametrize("kind", [pa.float16(), pa.float32()])
def test_a_time_that_has_lost_its_seconds_is_rejected(kind: pa.DataType) -> None:
    times = pa.array([0.0, 4.0], pa.float64()).cast(kind)
    with pytest.raises(BodyError, match=r"'time_s': expected float64 or integers, was float") as e:
        parse_arrow(pyarrow_stream(FRAME.to_arrow().set_column(0, "time_s", times)))
    assert e.value.code == RejectCode.MALFORMED_ARROW


def test_integers_and_short_floats_serve_as_numbers_and_optional_columns_may_miss() -> None:
    table = pa.table(
        {
            "time_s": pa.array([1, 2], pa.int32()),
            "kind": ["bearing", "bearing"],
            "azimuth_deg": pa.array([0.5, 359.5], pa.float32()),
            "sensor_id": ["finder", "finder"],
            "track_number": pa.array([1, None], pa.uint8()),
            "height_m": pa.nulls(2),
        }
    )
    frame = parse_arrow(pyarrow_stream(table)).frame
    assert frame["time_s"].to_list() == [1.0, 2.0]
    assert frame["azimuth_deg"].to_list() == [0.5, 359.5]
    assert frame["track_number"].to_list() == [1, None]
    assert frame["range_m"].null_count() == 2


@pytest.mark.parametrize(
    "times",
    [
        {"time_ns": pa.array([1_500_000_000], pa.int64())},
        {"time": pa.array([1_500_000_000], pa.timestamp("ns", "Europe/Paris"))},
    ],
)
def test_the_time_may_be_nanoseconds_or_a_time_stamp(times: dict[str, pa.Array]) -> None:
    table = pa.table({**times, "kind": ["bearing"], "sensor_id": ["finder"], "azimuth_deg": [1.0]})
    assert parse_arrow(pyarrow_stream(table)).frame["time_s"].to_list() == [1.5]


def test_each_bad_row_is_named_and_the_others_pass() -> None:
    rows = pl.concat([FRAME[:1]] * 7)
    bad = rows.with_columns(
        range_m=pl.Series([1.0, float("nan"), float("inf"), None, 0.0, 1.0, 1.0]),
        kind=pl.Series(["radar"] * 5 + ["sonar", None]),
    )
    parsed = parse_arrow(stream(bad))
    assert parsed.frame["index"].to_list() == [0]
    assert [(reject.index, str(reject.code)) for reject in parsed.rejected] == [
        (1, "NON_FINITE"),
        (2, "NON_FINITE"),
        (3, "MISSING_FIELD"),
        (4, "OUT_OF_RANGE"),
        (5, "UNKNOWN_KIND"),
        (6, "MISSING_FIELD"),
    ]
    assert '"sensor_id": "41-10"' in parsed.rejected[0].raw


def test_an_integer_too_large_for_its_column_is_rejected_not_dropped() -> None:
    table = FRAME.to_arrow().set_column(10, "track_number", pa.array([2**64 - 1, 3], pa.uint64()))
    parsed = parse_arrow(pyarrow_stream(table))
    assert [(reject.index, reject.code) for reject in parsed.rejected] == [
        (0, RejectCode.OUT_OF_RANGE)
    ]
    assert str(2**64 - 1) in parsed.rejected[0].raw


def test_a_message_of_such_integers_alone_is_rejected() -> None:
    found = pa.array([2**64 - 1, 2**63], pa.uint64())
    parsed = parse_arrow(pyarrow_stream(FRAME.to_arrow().set_column(10, "track_number", found)))
    assert [reject.code for reject in parsed.rejected] == [RejectCode.OUT_OF_RANGE] * 2
    assert not len(parsed.frame)


@pytest.mark.parametrize(
    ("body", "code", "named"),
    [
        pytest.param(b"", "MALFORMED_ARROW", "schema", id="empty"),
        pytest.param(b"[]", "MALFORMED_ARROW", "byte 0", id="json"),
        pytest.param(b"ARROW1\0\0", "MALFORMED_ARROW", "file", id="arrow-file"),
        pytest.param(b"PAR1\0\0", "MALFORMED_ARROW", "Parquet", id="parquet"),
        pytest.param(stream(FRAME)[:-100], "MALFORMED_ARROW", "bytes", id="cut"),
        pytest.param(stream(FRAME) + b"\0" * 8, "MALFORMED_ARROW", "after", id="trailing"),
        pytest.param(
            stream(FRAME, compression="zstd"), "MALFORMED_ARROW", "compress", id="compressed"
        ),
        pytest.param(stream(FRAME.drop("kind")), "MISSING_FIELD", "kind", id="missing"),
        pytest.param(
            stream(FRAME.with_columns(hight_m=1.0)),
            "UNKNOWN_FIELD",
            "did you mean 'height_m'",
            id="unknown",
        ),
        pytest.param(
            stream(FRAME.with_columns(time_ns=1)), "UNKNOWN_FIELD", "time_ns", id="two-times"
        ),
        pytest.param(
            stream(FRAME.with_columns(time_s=pl.lit("1"))), "MALFORMED_ARROW", "time_s", id="text"
        ),
        pytest.param(
            stream(FRAME.with_columns(range_m=pl.lit(value=True))),
            "MALFORMED_ARROW",
            "Boolean",
            id="true-is-no-number",
        ),
        pytest.param(
            stream(FRAME.with_columns(mode_3a=7012)), "MALFORMED_ARROW", "mode_3a", id="code-number"
        ),
        pytest.param(
            stream(FRAME.with_columns(track_number=1.0)), "MALFORMED_ARROW", "integers", id="float"
        ),
        pytest.param(
            stream(FRAME.with_columns(range_m=pl.concat_list("range_m"))),
            "MALFORMED_ARROW",
            "range_m",
            id="nested",
        ),
        pytest.param(
            pyarrow_stream(pa.Table.from_arrays([pa.array([1.0])] * 2, names=["time_s"] * 2)),
            "MALFORMED_ARROW",
            "twice",
            id="twice",
        ),
        pytest.param(
            pyarrow_stream(
                pa.table(
                    {
                        "time": pa.array([1], pa.timestamp("ns")),
                        "kind": ["radar"],
                        "sensor_id": ["a"],
                    }
                )
            ),
            "MALFORMED_ARROW",
            "zone",
            id="no-zone",
        ),
    ],
)
def test_a_body_that_cannot_be_used_is_rejected_whole(body: bytes, code: str, named: str) -> None:
    with pytest.raises(BodyError) as rejection:
        parse_arrow(body)
    assert rejection.value.code == code
    assert named in str(rejection.value)


@pytest.mark.parametrize("rows", [0, 1, 2])
def test_a_message_without_any_text_has_its_rows_rejected(rows: int) -> None:
    texts = [
        pl.lit(None, kind).alias(name)
        for name, kind in MEASUREMENT_SCHEMA.items()
        if kind == pl.String()
    ]
    parsed = parse_arrow(stream(FRAME.head(rows).with_columns(texts)))
    assert len(parsed.frame) == 0
    assert [row.code for row in parsed.rejected] == [RejectCode.MISSING_FIELD] * rows


def test_the_limit_of_rows_holds_at_the_limit_and_one_above() -> None:
    assert len(parse_arrow(stream(FRAME), rows_max=2).frame) == 2
    with pytest.raises(BodyError) as rejection:
        parse_arrow(stream(FRAME), rows_max=1)
    assert rejection.value.code is RejectCode.TOO_LARGE


def test_one_long_text_named_by_every_row_is_rejected() -> None:
    indices = pa.array([0] * 5000, pa.int32())
    text = pa.DictionaryArray.from_arrays(indices, pa.array(["x" * 50_000]))
    table = pa.table({"time_s": [1.0] * 5000, "kind": text, "sensor_id": text})
    with pytest.raises(BodyError) as rejection:
        parse_arrow(pyarrow_stream(table))
    assert rejection.value.code is RejectCode.TOO_LARGE


FORGERIES = """
import contextlib, random, sys
from multiradar_converters.normalised.arrow import parse_arrow
from multiradar_schemas.errors import BodyError
bases = [bytes.fromhex(line) for line in sys.stdin]
generator = random.Random(20260101)
for _ in range(1000):
    body = bytearray(generator.choice(bases))
    for _ in range(generator.choice([1, 1, 2, 4])):
        body[generator.randrange(len(body))] = generator.choice([0, 1, 127, 128, 255])
    with contextlib.suppress(BodyError):
        parse_arrow(bytes(body))
print("alive")
"""


@pytest.mark.slow
def test_the_schema_of_a_sender_is_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[list[str]] = []
    original = arrow_layout._schema

    def counted(header: Table) -> list[arrow_layout.Column]:
        columns = original(header)
        read.append([column.name for column in columns])
        return columns

    monkeypatch.setattr(arrow_layout, "_schema", counted)
    arrow_layout._known_columns.cache_clear()
    plots, more = pl.DataFrame([radar()]), pl.DataFrame([radar(mach=0.5), radar(mach=0.6)])
    for _ in range(2):
        assert [check_layout(stream(one), 10) for one in (plots, more)] == [1, 2]
    assert read == [plots.columns, more.columns]
    # Longer ones are not kept.
    monkeypatch.setattr(arrow_layout, "_KNOWN_BYTES_MAX", 0)
    for _ in range(2):
        assert check_layout(stream(plots), 10) == 1
    assert read[2:] == [plots.columns, plots.columns]


def test_forged_streams_never_end_the_process() -> None:
    """A forged length once made the reader allocate 2^61 bytes, which aborts the whole process."""
    bases = [stream(FRAME), stream(FRAME, compat_level=pl.CompatLevel.oldest())]
    bases.append(stream(FRAME.with_columns(pl.col("kind").cast(pl.Categorical))))
    run = run_to_end(
        [sys.executable, "-c", FORGERIES], input="\n".join(base.hex() for base in bases)
    )
    assert run.stdout == "alive\n", run.stderr[-2000:]


def test_any_forged_length_is_rejected_before_anything_is_read() -> None:
    """The rows of the batch and the values of each column, also of one without a buffer."""
    body = stream(pl.concat([FRAME] * 21).with_columns(height_m=pl.lit(None, pl.Null())))
    rows = struct.pack("<q", 42)
    places = [place for place in range(len(body)) if body.startswith(rows, place)]
    assert len(places) >= 1 + len(FRAME.columns)
    for place in places:
        forged = body[:place] + struct.pack("<q", 2**61) + body[place + 8 :]
        with pytest.raises(ArrowLayoutError):
            check_layout(forged, 2**31)


def test_every_cut_of_a_stream_is_rejected_or_falls_between_messages() -> None:
    body = stream(FRAME)
    accepted = set()
    for length in random.Random(7).sample(range(len(body)), 200):
        with contextlib.suppress(BodyError):
            accepted.add(len(parse_arrow(body[:length]).frame))
    assert accepted <= {0, 2}
