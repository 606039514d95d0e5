"""For any bytes, each row is accepted or rejected, and both paths agree."""

import json
import random
from collections.abc import Callable
from typing import Any
from unittest import mock

import polars as pl
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from polars.testing import assert_frame_equal

from multiradar_converters.normalised import json_columns, text
from multiradar_converters.normalised.arrow import parse_arrow
from multiradar_converters.normalised.parsed import Parsed, rows_frame
from multiradar_converters.normalised.text import parse_json, parse_ndjson
from multiradar_schemas.errors import BodyError
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from support.inputs.messages import adsb, array, radar, stream

#: Characters that mean something in JSON, and some that cannot be written.
TEXTS = st.text(list('ab0é{}[]":,\\\n\x00\ud800'), max_size=8)
SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-(2**70), 2**70)
    | st.floats()
    | TEXTS
    | st.sampled_from(["radar", "adsb", "41-10", "7012", "4b1a2c", "2026-01-01T00:00:00Z"])
)
VALUES = SCALARS | st.lists(SCALARS, max_size=2) | st.dictionaries(TEXTS, SCALARS, max_size=2)
FIELDS = st.sampled_from([*MEASUREMENT_SCHEMA, "time", "time_ns", "altitude"])


@st.composite
def rows(draw: st.DrawFn) -> dict[str, Any]:
    row = draw(st.sampled_from([radar(), adsb(), radar(kind="bearing"), adsb(kind="mlat")]))
    changes = draw(st.dictionaries(FIELDS, VALUES, max_size=2))
    removed = draw(st.sets(FIELDS, max_size=1))
    return {name: value for name, value in {**row, **changes}.items() if name not in removed}


GOOD_ROWS = st.builds(
    lambda seconds, metres, degrees, code, number: radar(
        time_s=seconds, range_m=metres, azimuth_deg=degrees, mode_3a=code, track_number=number
    ),
    st.floats(-1e10, 1e10, allow_nan=False),
    st.floats(1e-3, 1e6, allow_nan=False),
    st.floats(0.0, 360.0, exclude_max=True, allow_nan=False),
    st.none() | st.from_regex(r"[0-7]{4}", fullmatch=True),
    st.none() | st.integers(0, 2**63 - 1),
)


def places(parsed: Parsed) -> list[int]:
    return sorted([*parsed.frame["index"], *[reject.index for reject in parsed.rejected]])


@given(st.lists(rows(), max_size=6))
@pytest.mark.fault(1)
def test_every_row_is_taken_or_rejected(messages: list[dict[str, Any]]) -> None:
    parsed = parse_json(array(*messages))
    assert places(parsed) == list(range(len(messages)))
    lines = "\n".join(json.dumps(message) for message in messages).encode()
    by_lines = parse_ndjson(lines)
    assert_frame_equal(by_lines.frame, parsed.frame)
    assert [(r.index, r.code) for r in by_lines.rejected] == [
        (r.index, r.code) for r in parsed.rejected
    ]


@given(rows(), rows())
@example(radar(), radar())
def test_the_fast_path_takes_only_what_the_slow_path_takes(
    first: dict[str, Any], second: dict[str, Any]
) -> None:
    body = array(first, second)
    fast = text._fast(body, 10)
    slow = text._slow_array(body.decode(), 10)
    if fast is None:
        assert slow.rejected
    else:
        assert slow.rejected == []
        assert_frame_equal(rows_frame(fast), slow.frame)


def as_columns(body: bytes) -> Parsed | None:
    with mock.patch.object(json_columns, "ROWS_MIN", 1):
        return json_columns.parse_array(body, 10, text.ROW_CHARACTERS_MAX)


#: Forms of a value that a compiled parser might take for another.
FORMS = st.sampled_from(
    ["5.0", "1e2", "-0", "-0.0", "0.1e-7", '"5"', "7012", "true", "null", '"\\u0041"',
     '"\\ud800"', '":"', '"},{"', "[7]", "{}", "9223372036854775808",
     "123456789.12345678901234567890", "01", "NaN"]
)  # fmt: skip


@settings(max_examples=400)
@given(
    st.lists(rows(), min_size=2, max_size=3),
    st.sampled_from([",", ", ", " ,\n "]),
    st.sampled_from([":", ": ", " :"]),
    st.lists(st.tuples(FIELDS, FORMS), max_size=2),
    st.booleans(),
)
@example([radar(), radar()], ",", ":", [("track_number", "5.0")], False)
@example([radar(mode_3a="7012"), radar()], ",", ":", [("mode_3a", "7012")], False)
@example(
    [radar(mode_3a="7012"), radar()], ",", ":", [("mode_3a", "7012"), ("altitude", "7")], False
)
@example([radar(), radar()], ",", ":", [("height_m", "null"), ("height_m", "9.0")], True)
def test_columns_are_what_the_rows_are_one_by_one(
    messages: list[dict[str, Any]],
    comma: str,
    colon: str,
    more: list[tuple[str, str]],
    is_first: bool,
) -> None:
    # The last row has these values in place of its own, or beside them.
    if not is_first:
        messages = [*messages[:-1], {k: v for k, v in messages[-1].items() if k not in dict(more)}]
    texts = [json.dumps(one, separators=(comma, colon)) for one in messages]
    added = comma.join(f'"{name}"{colon}{form}' for name, form in more)
    if added:
        inner = texts[-1][1:-1]
        texts[-1] = f"{{{added}{comma}{inner}}}" if is_first else f"{{{inner}{comma}{added}}}"
    body = f"[{comma.join(texts)}]".encode()
    columns = as_columns(body)
    if columns is not None:
        slow = text._slow_array(body.decode(), 10)
        assert slow.rejected == []
        assert_frame_equal(columns.frame, slow.frame, check_exact=True)


def test_valid_rows_are_columns() -> None:
    for message in (radar(), adsb(), radar(kind="bearing"), radar(callsign="AB 12", mode_3a=None)):
        for comma, colon in ((",", ":"), (", ", ": ")):
            row = json.dumps(message, separators=(comma, colon))
            assert as_columns(f"[{row}{comma}{row}]".encode()) is not None


@given(st.lists(st.sampled_from([*radar(), "time_ns"]), min_size=1, max_size=3), st.data())
def test_a_key_named_twice_is_always_noticed(names: list[str], data: st.DataObject) -> None:
    pairs = [*radar().items(), *[(name, data.draw(SCALARS)) for name in names]]
    order = data.draw(st.permutations(pairs))
    inner = ",".join(f"{json.dumps(name)}:{json.dumps(value)}" for name, value in order)
    columns = as_columns(b"[{" + inner.encode() + b"}," + json.dumps(radar()).encode() + b"]")
    assert columns is None or len({name for name, _ in pairs}) == len(pairs)
    parsed = parse_json(b"[{" + inner.encode() + b"}]")
    assert len(parsed.frame) == 0 or len({name for name, _ in pairs}) == len(pairs)


@given(st.lists(GOOD_ROWS, max_size=5))
def test_json_and_arrow_give_the_values_that_were_sent(messages: list[dict[str, Any]]) -> None:
    sent = pl.DataFrame(messages, schema=MEASUREMENT_SCHEMA)
    for parsed in (parse_json(array(*messages)), parse_arrow(stream(sent))):
        assert parsed.rejected == []
        assert_frame_equal(parsed.frame.drop("index"), sent, check_exact=True)


def outcome(parse: Callable[[bytes], Parsed], body: bytes) -> str:
    try:
        parsed = parse(body)
    except BodyError as rejection:
        return f"rejected: {rejection}"
    found = places(parsed)
    return "taken" if found == sorted(set(found)) else "lost"


@given(st.binary(max_size=200))
@pytest.mark.fault(3, 37)
def test_any_bytes_are_rows_or_a_coded_rejection(body: bytes) -> None:
    for parse in (parse_json, parse_ndjson, parse_arrow):
        said = outcome(parse, body)
        assert said.startswith(("taken", "rejected"))
        assert said.isprintable()


@settings(max_examples=200)
@given(st.integers(0, 2**32), st.integers(1, 4))
def test_damaged_json_is_rows_or_a_coded_rejection(seed: int, damages: int) -> None:
    generator = random.Random(seed)
    body = bytearray(array(radar(), adsb(), radar(time_s=7)))
    for _ in range(damages):
        body[generator.randrange(len(body))] = generator.choice(b'{}[]",:\\0x\xff\x00 ')
    for parse in (parse_json, parse_ndjson):
        said = outcome(parse, bytes(body))
        assert said.startswith(("taken", "rejected"))
        assert said.isprintable()
