"""The work of reading JSON is bounded by its octets and rows, whatever they are."""

import json
import random
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import pytest

from multiradar_converters.normalised import text as text_module
from multiradar_converters.normalised.parsed import Parsed
from multiradar_converters.normalised.text import parse_json, parse_ndjson
from multiradar_schemas.errors import BodyError
from support.inputs.messages import radar

Parse = Callable[[bytes], Parsed]
GOOD = json.dumps(radar())
#: Calls of functions for each invalid row, and for each kilobyte of what is no row: a call takes
#: some 0.1 µs. Before, each bracket of a row too long took three, and each blank line two.
ROW_CALLS_MAX, KILOBYTE_CALLS_MAX = 120, 60
OCTETS = 400_000

ROWS = {
    "a number": "1",
    "a field out of range": '{"range_m": -5}',
    "a time out of range": '{"time_s": -1, "sensor_id": "%s"}' % ("y" * 120),
    "an unknown field": '{"hight_m": 5}',
    "a key twice": '{"time_s": 1, "time_s": 2}',
    "no azimuth": '{"time_s": 5.5, "sensor_id": "R1", "kind": "radar", "range_m": 1e300}',
    "brackets": "[[[[[[]]]]]]",
}
ONE_ROW = {
    "brackets": "[" + "[]," * (OCTETS // 3) + "1]",
    "objects": '{"a":[' + "[{}]," * (OCTETS // 5) + "1]}",
    "texts": "[" + '"x",' * (OCTETS // 4) + "1]",
    "keys": "{" + ",".join(f'"{number:07}":1' for number in range(OCTETS // 12)) + "}",
    "brackets in texts": '{"a":"' + ']}\\"' * (OCTETS // 4) + '"}',
    "escapes": '["' + "\\u00e9" * (OCTETS // 6) + '"]',
    "digits": "9" * OCTETS,
    "blanks": " " * OCTETS + "1",
    "commas": "," * OCTETS,
    "quotes": '"' * OCTETS,
    "a text without end": '{"a":"' + "x" * OCTETS,
    "lines without end": "\n".join(['{"a":"' + "x" * 60_000] * (OCTETS // 60_000)),
    "blank lines": "\n" * OCTETS + "1",
    "lines of blanks": " \t\r\n" * (OCTETS // 4) + "1",
}


def body_of(parse: Parse, rows: list[str]) -> bytes:
    """Return rows as an array, or as lines."""
    return f"[{','.join(rows)}]".encode() if parse is parse_json else "\n".join(rows).encode()


def calls(parse: Parse, body: bytes) -> int:
    """Return the number of functions called, of Python and of C."""
    count = 0

    def note(_frame: Any, event: str, _argument: Any) -> None:
        nonlocal count
        count += event in {"call", "c_call"}

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        with suppress(BodyError):
            parse(body)
    finally:
        sys.setprofile(before)
    return count


@pytest.mark.parametrize("row", ROWS.values(), ids=ROWS)
@pytest.mark.parametrize("parse", [parse_json, parse_ndjson])
def test_each_of_many_invalid_rows_costs_the_same(row: str, parse: Parse) -> None:
    parse(body_of(parse, [GOOD, row]))
    few, many = (calls(parse, body_of(parse, [GOOD, *[row] * rows])) for rows in (400, 800))
    assert many - few <= 400 * ROW_CALLS_MAX


@pytest.mark.parametrize("row", ONE_ROW.values(), ids=ONE_ROW)
@pytest.mark.parametrize("parse", [parse_json, parse_ndjson])
def test_a_long_row_costs_few_calls(
    row: str, parse: Parse, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = 0

    class _Watched(json.JSONDecoder):
        def raw_decode(self, text: str, place: int = 0) -> tuple[Any, int]:
            nonlocal read
            read += len(text) - place
            value, end = super().raw_decode(text, place)
            read += end - len(text)
            return value, end

    watched = _Watched(object_pairs_hook=text_module._object, parse_int=text_module._integer)
    monkeypatch.setattr(text_module, "_DECODER", watched)
    body = body_of(parse, [GOOD, row])
    # Three for each object in what is parsed of it.
    beginning = text_module.ROW_CHARACTERS_MAX
    assert calls(parse, body) <= 0.7 * beginning + KILOBYTE_CALLS_MAX * len(body) / 1000
    # Once in short, once in long pieces.
    assert read <= 2.5 * len(body)


def _end_by_brackets(text: str, place: int) -> int:
    """Return the end of an array or object, one character after the other."""
    depth, quoted, escaped = 0, False, False
    for number in range(place, len(text)):
        letter = text[number]
        if quoted:
            quoted = escaped or letter != '"'
            escaped = letter == "\\" and not escaped
            continue
        quoted = letter == '"'
        depth += (letter in "[{") - (letter in "]}")
        if depth == 0:
            return number + 1
    return len(text)


def _value(chance: random.Random, depth: int) -> Any:
    def text() -> str:
        return "".join(chance.choices('a"\\[]{}é\N{AIRPLANE}\n,', k=chance.randrange(9)))

    kind = chance.randrange(6) if depth else 5
    if kind < 3:
        return [_value(chance, depth - 1) for _ in range(chance.randrange(4))]
    if kind < 5:
        return {text(): _value(chance, depth - 1) for _ in range(chance.randrange(4))}
    return text()


@pytest.mark.parametrize("characters", [2, 7, 1 << 16])
def test_the_end_of_a_long_row_is_found_across_pieces(
    characters: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(text_module, "_COUNTED", characters)
    chance = random.Random(characters)
    for _ in range(60):
        value = [_value(chance, 4)]
        row = json.dumps(value, ensure_ascii=chance.random() < 0.5)
        text = "  " + row + chance.choice(["", ",1]", "]", '"'])
        assert text_module._end_of_value(text, 2) == 2 + len(row)
        cut = text[: 2 + chance.randrange(1, len(row))]
        assert text_module._end_of_value(cut, 2) == _end_by_brackets(cut, 2)


def test_lines_are_numbered_with_the_blank_ones() -> None:
    body = f"\r\n \t\n{GOOD}\r\n\n1 \n  {GOOD}  \n\n\n\r{GOOD}".encode()
    parsed = parse_ndjson(body)
    assert parsed.frame["index"].to_list() == [2, 5, 8]
    assert [(one.index, one.raw) for one in parsed.rejected] == [(4, "1")]
