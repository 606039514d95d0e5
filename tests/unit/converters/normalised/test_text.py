"""JSON and NDJSON bodies: good rows pass, each bad one is named, nothing else happens."""

import json
import tracemalloc
from collections.abc import Callable

import pytest

from multiradar_converters.normalised import json_columns
from multiradar_converters.normalised import text as text_module
from multiradar_converters.normalised.parsed import PARSED_SCHEMA, Parsed
from multiradar_converters.normalised.text import HINTS_MAX, parse_json, parse_ndjson
from multiradar_schemas.errors import BodyError
from multiradar_schemas.reject import RejectCode
from support.inputs.messages import adsb, array, radar, without

GOOD = json.dumps(radar())

BAD_ROWS = [
    pytest.param(radar(time_s=True), "WRONG_TYPE", "time_s", id="true-is-no-number"),
    pytest.param(radar(range_m="9"), "NOT_A_NUMBER", "range_m", id="text-is-no-number"),
    pytest.param(radar(range_m=None), "MISSING_FIELD", "range_m", id="null-where-needed"),
    pytest.param(without(radar(), "azimuth_deg"), "MISSING_FIELD", "azimuth_deg", id="absent"),
    pytest.param(without(radar(), "kind"), "MISSING_FIELD", "kind", id="no-kind"),
    pytest.param(without(radar(), "time_s"), "MISSING_FIELD", "time", id="no-time"),
    pytest.param(radar(time_ns=3), "UNKNOWN_FIELD", "time", id="two-times"),
    pytest.param(radar(time=None, time_s=None), "MISSING_FIELD", "time", id="null-times"),
    pytest.param(radar(kind="sonar"), "UNKNOWN_KIND", "kind", id="unknown-kind"),
    pytest.param(
        radar(hight_m=3), "UNKNOWN_FIELD", "'hight_m' (did you mean 'height_m'?)", id="hight"
    ),
    pytest.param(radar(colour=3), "UNKNOWN_FIELD", "unknown field 'colour'", id="unknown-field"),
    pytest.param(radar(time_s=1_533_110_400_123), "OUT_OF_RANGE", "123 (milliseconds?)", id="ms"),
    pytest.param(radar(time_s=1.5331104e15), "OUT_OF_RANGE", "(microseconds?)", id="us"),
    pytest.param(radar(azimuth_deg=360), "OUT_OF_RANGE", "azimuth_deg", id="azimuth-360"),
    pytest.param(radar(range_m=0), "OUT_OF_RANGE", "range_m", id="range-0"),
    pytest.param(radar(range_m=1e6 + 1), "OUT_OF_RANGE", "range_m", id="range-too-large"),
    pytest.param(adsb(latitude_deg=90.001), "OUT_OF_RANGE", "latitude_deg", id="latitude"),
    pytest.param(adsb(longitude_deg=-181), "OUT_OF_RANGE", "longitude_deg", id="longitude"),
    pytest.param(radar(height_m=40_001), "OUT_OF_RANGE", "height_m", id="height"),
    pytest.param(radar(time_s=1e11), "OUT_OF_RANGE", "time_s", id="time"),
    pytest.param(radar(track_number=-1), "OUT_OF_RANGE", "track_number", id="track-number"),
    pytest.param(radar(track_number=2**63), "OUT_OF_RANGE", "track_number", id="64-bits"),
    pytest.param(radar(track_number=1.0), "WRONG_TYPE", "track_number", id="float-is-no-integer"),
    pytest.param(radar(mode_3a="7018"), "OUT_OF_RANGE", "mode_3a", id="code-not-octal"),
    pytest.param(radar(mode_3a=7012), "WRONG_TYPE", "mode_3a", id="code-as-number"),
    pytest.param(adsb(callsign="AB-1"), "OUT_OF_RANGE", "callsign", id="callsign"),
    pytest.param(adsb(mode_s_address="4b1a2"), "OUT_OF_RANGE", "mode_s_address", id="address"),
    pytest.param(radar(sensor_id="a/b"), "OUT_OF_RANGE", "sensor_id", id="sensor-id"),
    pytest.param(radar(sensor_id="\ud800"), "ENCODING", "sensor_id", id="lone-surrogate"),
    pytest.param(radar(**{"\udfff": 1}), "UNKNOWN_FIELD", "udfff", id="lone-surrogate-key"),
    pytest.param(GOOD.replace("90000.0", "NaN"), "NON_FINITE", "range_m", id="nan-literal"),
    pytest.param(
        GOOD.replace("90000.0", "-Infinity"), "NON_FINITE", "range_m", id="infinity-literal"
    ),
    pytest.param(GOOD.replace("90000.0", "1e999"), "NON_FINITE", "range_m", id="overflow"),
    pytest.param(
        GOOD.replace("90000.0", "9" * 5000), "NON_FINITE", "range_m", id="5000-digit-integer"
    ),
    pytest.param(GOOD[:-1] + ',"range_m":5}', "DUPLICATE_KEY", "range_m", id="duplicate-key"),
    pytest.param(
        GOOD[:-1] + ',"rang\\u0065_m":5}', "DUPLICATE_KEY", "range_m", id="duplicate-key-escaped"
    ),
    pytest.param(
        GOOD[:-1] + ',"mode_3a":null}', "DUPLICATE_KEY", "mode_3a", id="duplicate-key-null"
    ),
    pytest.param("[]", "WRONG_TYPE", "object", id="array-is-no-row"),
    pytest.param("null", "WRONG_TYPE", "object", id="null-is-no-row"),
    pytest.param(
        without(radar(time="2026-02-30T00:00:00Z"), "time_s"), "OUT_OF_RANGE", "time", id="no-date"
    ),
    pytest.param(
        without(radar(time="2026-02-03T00:00:00"), "time_s"), "OUT_OF_RANGE", "time", id="no-zone"
    ),
    pytest.param(
        without(radar(time="1700000000"), "time_s"), "OUT_OF_RANGE", "time", id="number-as-time"
    ),
]


@pytest.mark.parametrize(("row", "code", "named"), BAD_ROWS)
def test_a_bad_row_of_an_array_is_named_and_its_neighbours_pass(
    row: object, code: str, named: str
) -> None:
    parsed = parse_json(array(radar(), row, adsb()))
    assert parsed.frame["index"].to_list() == [0, 2]
    assert [(reject.index, reject.code) for reject in parsed.rejected] == [(1, code)]
    assert named in parsed.rejected[0].reason
    assert parsed.rejected[0].raw == (row if isinstance(row, str) else json.dumps(row))
    assert parsed.rejected[0].reason.isprintable()


@pytest.mark.parametrize(("row", "code", "named"), BAD_ROWS)
def test_a_bad_line_is_named_by_its_number(row: object, code: str, named: str) -> None:
    line = row if isinstance(row, str) else json.dumps(row)
    parsed = parse_ndjson(f"{GOOD}\r\n\n{line}\n{GOOD}".encode())
    assert parsed.frame["index"].to_list() == [0, 3]
    assert [(reject.index, reject.code) for reject in parsed.rejected] == [(2, code)]
    assert parsed.rejected[0].raw == line


@pytest.mark.parametrize(
    ("line", "code"),
    [
        (GOOD[:-1].encode(), "MALFORMED_JSON"),
        (GOOD.replace("90000.0", "90_000").encode(), "MALFORMED_JSON"),
        (GOOD.encode() + b"," + GOOD.encode(), "MALFORMED_JSON"),
        (b'{"\xff": 1}', "ENCODING"),
        (b"\xef\xbb\xbf" + GOOD.encode(), "MALFORMED_JSON"),
        (b"[" * 100_000, "MALFORMED_JSON"),
        (b'{"a":' * 100_000, "MALFORMED_JSON"),
        (GOOD.replace("7012", "70\x0012").encode(), "MALFORMED_JSON"),
    ],
)
@pytest.mark.fault(37)
def test_a_line_that_is_no_json_spoils_only_itself(line: bytes, code: str) -> None:
    parsed = parse_ndjson(GOOD.encode() + b"\n" + line + b"\n" + GOOD.encode())
    assert parsed.frame["index"].to_list() == [0, 2]
    assert [(reject.index, reject.code) for reject in parsed.rejected] == [(1, code)]


def test_few_unknown_names_of_a_message_are_searched_for_similar_ones() -> None:
    names = [f"hight_{number}_m" for number in range(2 * HINTS_MAX)]
    parsed = parse_json(array(*(radar(**{name: 1}) for name in names)))
    hinted = ["did you mean 'height_m'" in one.reason for one in parsed.rejected]
    assert hinted == [True] * HINTS_MAX + [False] * HINTS_MAX
    (long,) = parse_json(array(radar(**{"height_m" * 20: 1}))).rejected
    assert "did you mean" not in long.reason


def test_lines_cannot_mend_each_other() -> None:
    # Joined by commas these three lines would be valid JSON of three objects.
    body = f'{GOOD},{GOOD}\n{GOOD[:-1]}\n"height_m":5}}\n'.encode()
    parsed = parse_ndjson(body)
    assert len(parsed.frame) == 0
    assert [reject.index for reject in parsed.rejected] == [0, 1, 2]


@pytest.mark.parametrize(
    ("body", "code"),
    [
        (b"", "MALFORMED_JSON"),
        (b"{}", "MALFORMED_JSON"),
        (b"nonsense", "MALFORMED_JSON"),
        (b"[", "MALFORMED_JSON"),
        (b"[,]", "MALFORMED_JSON"),
        (b"[1,]", "MALFORMED_JSON"),
        (b"[]]", "MALFORMED_JSON"),
        (b"[1 2]", "MALFORMED_JSON"),
        (array(radar())[:-1], "MALFORMED_JSON"),
        (array(GOOD.replace("90000.0", "90_000")), "MALFORMED_JSON"),
        (b"[" * 200_000, "MALFORMED_JSON"),
        (b"\xff[]", "ENCODING"),
        ("[]".encode("utf-16"), "ENCODING"),
        (b"\xef\xbb\xbf[]", "MALFORMED_JSON"),
    ],
)
def test_a_body_that_is_no_array_is_rejected_whole(body: bytes, code: str) -> None:
    with pytest.raises(BodyError) as rejection:
        parse_json(body)
    assert rejection.value.code == code


@pytest.mark.parametrize("good", [True, False])
def test_the_limit_of_rows_holds_at_the_limit_and_one_above(good: bool) -> None:
    row = radar() if good else 3
    assert parse_json(array(*[row] * 4), rows_max=4) is not None
    lines = b"\n".join([json.dumps(row).encode()] * 4)
    assert parse_ndjson(lines, rows_max=4) is not None
    for parse, body in ((parse_json, array(*[row] * 5)), (parse_ndjson, lines + b"\n3")):
        with pytest.raises(BodyError) as rejection:
            parse(body, rows_max=4)
        assert rejection.value.code is RejectCode.TOO_LARGE


def test_the_three_forms_of_time_agree() -> None:
    rows = [
        radar(time_s=1767225600.25),
        without(radar(time_ns=1767225600250000000), "time_s"),
        without(radar(time="2026-01-01T00:00:00.25Z"), "time_s"),
        without(radar(time="2026-01-01T05:30:00.250+05:30"), "time_s"),
    ]
    for body in (array(*rows), array(*rows, 3)):
        assert parse_json(body).frame["time_s"].to_list() == [1767225600.25] * 4


def test_null_and_absent_are_the_same_and_integers_serve_as_numbers() -> None:
    rows = array(radar(height_m=None, track_number=None, range_m=90), without(radar(), "height_m"))
    frame = parse_json(rows).frame
    assert frame.schema == PARSED_SCHEMA
    assert frame["height_m"].to_list() == [None, None]
    assert frame["range_m"].to_list() == [90.0, 90_000.0]


def test_an_address_is_lower_case_afterwards() -> None:
    assert parse_json(array(adsb(mode_s_address="4B1A2C"))).frame["mode_s_address"][0] == "4b1a2c"


def test_no_rows_are_no_fault() -> None:
    assert parse_json(b" [ ] ").frame.schema == PARSED_SCHEMA
    assert parse_ndjson(b"\r\n \n").frame.schema == PARSED_SCHEMA


HOSTILE = {
    "keys": "{" + ",".join(f'"key{number}":{number}' for number in range(200_000)) + "}",
    "nested": '{"a":[' + ",".join(["[{}]"] * 100_000) + "]}",
    "brackets in a text": '{"a":"' + ']}\\"' * 50_000 + '"}',
    "text": '"' + "x" * 500_000 + '"',
}


@pytest.mark.parametrize("row", HOSTILE.values(), ids=HOSTILE)
@pytest.mark.parametrize("parse", [parse_json, parse_ndjson])
@pytest.mark.fault(37)
def test_a_very_long_row_is_not_parsed_and_affects_no_other(
    row: str, parse: Callable[[bytes], Parsed], monkeypatch: pytest.MonkeyPatch
) -> None:
    # The interpreter stands still while a value is parsed, and so does the event loop.
    parsed_lengths = []

    class _Watched(json.JSONDecoder):
        def raw_decode(self, text: str, place: int = 0) -> tuple[object, int]:
            parsed_lengths.append(len(text) - place)
            return super().raw_decode(text, place)

    monkeypatch.setattr(text_module, "_DECODER", _Watched(object_pairs_hook=text_module._object))
    rows = [GOOD, row, GOOD]
    body = array(*rows) if parse is parse_json else "\n".join(rows).encode()
    found = parse(body)
    assert len(found.frame) == 2
    (rejected,) = found.rejected
    assert (rejected.index, rejected.code, rejected.raw) == (1, RejectCode.TOO_LARGE, row)
    assert rejected.reason == f"expected a row of at most 65536 characters, found {len(row)}"
    assert max(parsed_lengths) <= text_module.ROW_CHARACTERS_MAX


@pytest.mark.parametrize(
    ("more", "code"), [(0, RejectCode.UNKNOWN_FIELD), (1, RejectCode.TOO_LARGE)]
)
def test_a_row_is_parsed_up_to_its_limit(more: int, code: RejectCode) -> None:
    row = '{"a":"' + "x" * (text_module.ROW_CHARACTERS_MAX - len('{"a":""}') + more) + '"}'
    found = parse_json(array(GOOD, row, GOOD))
    assert [reject.code for reject in found.rejected] == [code]
    assert len(found.frame) == 2


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (b"", "expected a JSON array, found the end"),
        (b" \t7", "expected a JSON array, found '7' at character 2"),
        (b"[{}, {}  7]", "expected a comma or the end of the array, found '7]' at character 9"),
        (b"[{} \n", "expected a comma or the end of the array, found the end"),
        (b"[ {} ]  x", "expected nothing after the array, found 'x' at character 8"),
    ],
)
def test_what_is_no_array_is_shown_with_its_place(body: bytes, reason: str) -> None:
    with pytest.raises(BodyError) as rejection:
        parse_json(body)
    assert rejection.value.reason == reason


def test_what_follows_the_object_of_a_line_is_shown_with_its_place() -> None:
    reasons = [one.reason for one in parse_ndjson(b"{}  7").rejected]
    assert reasons == ["expected one object per line, found '7' at character 4 after it"]


@pytest.mark.parametrize("body", [b"[]", b" [ ] ", b"\n[\n]\t\r\n"])
def test_an_empty_array_has_no_rows(body: bytes) -> None:
    assert len(parse_json(body).frame) == len(parse_json(body).rejected) == 0


@pytest.mark.parametrize("cut", [1, 1023, 1024, 1025, 65_535, 65_536, 65_537, 100_000])
def test_a_long_row_that_does_not_end_is_malformed(cut: int) -> None:
    body = array(HOSTILE["keys"])[:cut]
    with pytest.raises(BodyError) as rejection:
        parse_json(body)
    assert rejection.value.code is RejectCode.MALFORMED_JSON


@pytest.mark.fault(37)
def test_a_text_of_many_escapes_takes_no_more_memory_than_its_length() -> None:
    body = b'["' + b'\\"' * 500_000 + b'"]'
    tracemalloc.start()
    try:
        parsed = parse_json(body)
        _, peak_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert [one.code for one in parsed.rejected] == [RejectCode.TOO_LARGE]
    # The search for the end of the text took 64 octets for each escape.
    assert peak_bytes < 6 * len(body)


def test_a_large_message_is_read_as_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [radar(time_s=float(number)) for number in range(300)]
    lines = "".join(f"{json.dumps(row)}\n" for row in rows).encode()
    # Neither of the others is called.
    monkeypatch.setattr(text_module, "_fast", None)
    monkeypatch.setattr(text_module, "_slow_array", None)
    for parsed in (parse_json(array(*rows)), parse_ndjson(lines)):
        assert parsed.frame["time_s"].to_list() == [row["time_s"] for row in rows]
        assert parsed.frame["index"].to_list() == list(range(300))
        assert parsed.rejected == []


@pytest.mark.parametrize("row", ["{}", "{:}", '{"time_s":}'])
def test_large_messages_without_fields_are_rejected(row: str) -> None:
    body = f"[{','.join([row] * 300)}]".encode()
    if row == "{}":
        assert len(parse_json(body).rejected) == 300
    else:
        with pytest.raises(BodyError, match="not valid JSON"):
            parse_json(body)
    assert len(parse_ndjson("\n".join([row] * 300).encode()).rejected) == 300


def test_a_message_of_many_megabytes_is_read_row_by_row(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [radar(time_s=float(number)) for number in range(300)]
    monkeypatch.setattr(json_columns, "OCTETS_MAX", len(array(*rows)) - 1)
    assert json_columns.parse_array(array(*rows), 300, 10_000) is None
    assert len(parse_json(array(*rows)).frame) == 300


def test_one_invalid_row_of_a_large_message_is_named() -> None:
    rows = [radar(time_s=float(number)) for number in range(300)]
    rows[299]["azimuth_deg"] = 360.0
    parsed = parse_json(array(*rows))
    assert len(parsed.frame) == 299
    assert [(one.index, one.code) for one in parsed.rejected] == [(299, RejectCode.OUT_OF_RANGE)]


def large(**last: object) -> list[dict[str, object]]:
    return [*[radar(time_s=float(number)) for number in range(300)], radar(**last)]


@pytest.mark.parametrize("indent", [None, 0, 1])
def test_large_arrays_are_columns_in_any_layout(indent: int | None) -> None:
    body = json.dumps(large(callsign="DLH1"), indent=indent).encode()
    parsed = json_columns.parse_array(body, 301, 10_000)
    assert parsed is not None
    assert parsed.frame["callsign"].to_list() == [*[None] * 300, "DLH1"]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"101.0", b"101.0, "),
        (b'"radar"', b"radar"),
        (b'"range_m"', b'"range_m" "range_m"'),
        (b"271.25", b'"271.25"'),
        (b"271.25", b"[271.25]"),
        (b'"7012"', b"7012"),
        (b'"7012"', b"nul"),
        (b'"7012"', b'"70\\u00312"'),
        (b'"7012"', b'"7012'),
        (b"}", b'","callsign":{}}'),
    ],
)
def test_a_large_message_with_one_odd_row_has_no_columns(old: bytes, new: bytes) -> None:
    lines = [json.dumps(row).encode() for row in large(time_s=101.0)]
    lines[-1] = lines[-1].replace(old, new)
    assert json_columns.parse_array(b"[%s]" % b",".join(lines), 301, 10_000) is None
    assert json_columns.parse_lines(b"\n".join(lines), 301, 10_000) is None


@pytest.mark.parametrize("end", [b"\n\n", b",\n", b"\n,", b"\n{"])
def test_lines_with_more_between_them_have_no_columns(end: bytes) -> None:
    lines = [json.dumps(row).encode() for row in large()]
    assert json_columns.parse_lines(b"\n".join(lines), 301, 10_000) is not None
    assert json_columns.parse_lines(end.join(lines), 301, 10_000) is None
    broken = b"\n".join(lines).replace(b", ", b",\n")
    assert json_columns.parse_lines(broken, 2000, 10_000) is None
