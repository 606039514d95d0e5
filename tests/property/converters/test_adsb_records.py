"""The compiled reading of trajectories equals the plain one, however the text is cut."""

import json
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from multiradar_converters.adsb.reading import _kernels, cells
from multiradar_converters.adsb.reading.batches import Batch, batch_of, read_columns, read_objects
from multiradar_converters.adsb.reading.layout import Layout
from multiradar_converters.adsb.reading.roles import choose_columns
from multiradar_converters.adsb.reading.splitting import Elements, Lines, Piece
from multiradar_converters.adsb.reading.time_forms import TimeForm
from support.kernels import plain

NAMES = ["timestamp", "icao24", "latitude", "longitude", "altitude", "track", "groundspeed",
         "callsign", "squawk", "onground", "last_position"]  # fmt: skip
FORMS: tuple[TimeForm, ...] = ("unix-ms", "unix-s", "iso8601", "clock", "seconds-of-day")

numbers = st.one_of(
    st.floats(-200.0, 200.0).map(repr),
    st.floats(allow_nan=True, allow_infinity=True).map(repr),
    st.integers(-(10**20), 10**20).map(str),
    st.from_regex(r"[+-]?[0-9]{0,20}\.?[0-9]{0,12}", fullmatch=True),
)
words = st.one_of(
    st.sampled_from(
        [
            "",
            "null",
            "None",
            "NaN",
            "Nan",
            "none",
            "nul",
            "TRUE",
            "true1",
            "nan",
            "NA",
            "true",
            "False",
            "1",
            "0",
            "ground",
            "3C64ab",
            "3c6444 ",
            "000000",
            "ffffff",
            "~3c644",
            "0021",
            "21",
            "21.0",
            "7800",
            "4720.0",
            " KLM1 ",
            "DLH8JW12",
            "DLH8JW123",
            "a/b",
            "2018-08-01T08:00:00Z",
            "2018-08-01 08:00:00.125+00:00",
            "2018-02-30 08:00:00",
            "2018-12-31 23:59:59.999999",
            "2018-08-01 08:00:00.1+02:00",
            "08:00:00.5",
            "25:00:00",
            "08",
            "1e5",
            "1.5e-3",
            "1533101250000",
            "1533101250.125",
            "-0.0",
            "-0",
            "+0",
            "-00.00",
            "1e-400",
            "-1e-400",
            "-1e-320",
            "000000001533101250125",
            ".5",
            "5.",
            "+7",
        ]
    ),
    st.text(max_size=9),
)
values = st.one_of(numbers, words)

PLAIN = {
    "unix-ms": "1533101250125",
    "unix-s": "1533101250.125",
    "iso8601": "2018-08-01 05:27:30.125",
    "clock": "05:27:30.125",
    "seconds-of-day": "19650.125",
}


Table = list[list[str]]


@st.composite
def tables(draw: st.DrawFn) -> tuple[TimeForm, Table]:
    """Draw records of which up to two values are anything."""
    time = draw(st.sampled_from(FORMS))
    table = []
    for _ in range(draw(st.integers(1, 5))):
        latitude, longitude = draw(st.floats(-90.0, 90.0)), draw(st.floats(-180.0, 180.0))
        row = [PLAIN[time], f"{draw(st.integers(1, 0xFFFFFE)):06x}", repr(latitude)]
        row += [repr(longitude), "35000.0", "12.5", "450", "DLH8JW", "7421", "false", PLAIN[time]]
        for place in draw(st.sets(st.integers(0, len(NAMES) - 1), max_size=2)):
            row[place] = draw(values)
        table.append(row)
    return time, table


def records_with(time: TimeForm, text: str) -> tuple[TimeForm, Table]:
    """Return plain records, one with the text in place of each number."""
    plain = [PLAIN[time], "3c6444", "50.1", "14.2", "35000.0", "12.5", "450", "DLH8JW", "7421",
             "false", PLAIN[time]]  # fmt: skip
    places = [
        NAMES.index(name)
        for name in (
            "timestamp",
            "latitude",
            "longitude",
            "altitude",
            "track",
            "groundspeed",
            "last_position",
        )
    ]
    return time, [[*plain[:k], text, *plain[k + 1 :]] for k in places]


plausible = st.fixed_dictionaries(
    {
        "timestamp": st.integers(10**12, 2 * 10**12),
        "icao24": st.from_regex(r"[0-9a-fA-F]{6}", fullmatch=True),
        "latitude": st.floats(-90.0, 90.0),
        "longitude": st.floats(-180.0, 180.0),
        "altitude": st.one_of(st.none(), st.floats(-2000.0, 50_000.0)),
        "callsign": st.one_of(st.none(), st.text(max_size=9)),
        "onground": st.booleans(),
        "squawk": st.one_of(st.none(), st.integers(0, 0o7777).map(lambda n: int(f"{n:o}"))),
    }
)


def layout(time: TimeForm, position: TimeForm, separator: bytes | None = None) -> Layout:
    chosen = choose_columns("x", NAMES)
    if separator is None:
        return Layout(chosen, time, position)
    places = {name: role for role, name in chosen.names.items()}
    return Layout(chosen, time, position, tuple(places.get(n, -1) for n in NAMES), separator)


def said(batch: Batch) -> list[Any]:
    # Bits, so that NaN equals NaN and 0 is not -0.
    return [
        batch.numbers.view(np.int64).tolist(),
        batch.words.tolist(),
        batch.places.tolist(),
        [(one.place, one.code, one.reason, one.raw) for one in batch.rejected],
    ]


def assert_both_forms_agree(pieces: list[Piece], found: Layout, fast: Any, plain: Any) -> None:
    for piece in pieces:
        cells_of = partial(plain, layout=found)
        compiled, by_hand = (batch_of(piece, found, cells_of, way) for way in (fast, None))
        assert sorted(map(repr, said(compiled)[3])) == sorted(map(repr, said(by_hand)[3]))
        assert said(compiled)[:3] == said(by_hand)[:3]


def literal(text: str, quoted: bool) -> str:
    return json.dumps(text) if quoted else text


@given(
    st.lists(st.booleans(), min_size=11, max_size=11),
    tables(),
    st.permutations(range(len(NAMES))),
    st.sets(st.integers(0, len(NAMES) - 1), max_size=2),
    st.sampled_from(["", " ", "\n\t "]),
)
@example([True] * 11, records_with("unix-ms", "-0"), list(range(11)), set(), "")
@settings(max_examples=80)
def test_objects_read_the_same_both_ways(
    quoted: list[bool],
    records: tuple[TimeForm, Table],
    order: list[int],
    left_out: set[int],
    blank: str,
) -> None:
    time, table = records
    objects = []
    for row in table:
        pairs = [
            f"{blank}{json.dumps(NAMES[k])}{blank}:{blank}{literal(row[k], quoted[k])}{blank}"
            for k in order
            if k not in left_out
        ]
        objects.append("{" + ",".join(pairs) + "}")
    elements = Elements(0)
    pieces = elements.push("\n".join(objects).encode("utf-8", "replace"))
    assert_both_forms_agree(pieces, layout(time, time), read_objects, cells.object_cells)


@given(tables(), st.sampled_from([b",", b";", b"\t"]))
@example(records_with("unix-ms", "-0"), b",")
@example(records_with("seconds-of-day", "-0.0"), b",")
@settings(max_examples=80)
def test_lines_read_the_same_both_ways(records: tuple[TimeForm, Table], separator: bytes) -> None:
    time, table = records
    text = "\n".join(separator.decode().join(row) for row in table).encode("utf-8", "replace")
    lines = Lines()
    pieces = [*lines.push(text), *lines.push(b"", at_end=True)]
    found = layout(time, time, separator)
    assert_both_forms_agree(pieces, found, read_columns, cells.line_cells)


@given(st.lists(plausible, min_size=1, max_size=20))
@settings(max_examples=60)
def test_plain_records_are_read_by_the_compiled_form_alone(records: list[dict[str, Any]]) -> None:
    """What is plainly right is not left to the plain form: that is what makes it fast."""
    for record in records:
        record["latitude"] = round(record["latitude"], 9)
        record["longitude"] = round(record["longitude"], 9)
        record["altitude"] = record["altitude"] and round(record["altitude"], 2)
        record["callsign"] = None
    (piece,) = Elements(0).push("\n".join(map(json.dumps, records)).encode())

    def reject(_: bytes) -> dict[int, str]:
        pytest.fail("left to the plain form")

    exponents = [k for k in range(len(records)) if b"e-" in piece.raw(k)]
    if not exponents and not any(r["icao24"].lower() in ("000000", "ffffff") for r in records):
        batch = batch_of(piece, layout("unix-ms", "unix-ms"), reject, read_objects)
        assert batch.numbers[1].tolist() == [record["latitude"] for record in records]


def test_an_object_may_have_more_members_than_there_are_guesses(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Uncompiled, where an index out of bounds is an error."""
    monkeypatch.setattr(_kernels, "read_objects", plain(_kernels.read_objects))
    made = layout("unix-ms", "unix-ms")
    record = {f"other {k}": k for k in range(len(made.hints) + 2)} | {
        "timestamp": 1_533_101_250_000, "icao24": "3003ae", "latitude": 47.5, "longitude": 8.0,
        "altitude": 30_000,
    }  # fmt: skip
    (piece,) = Elements(0).push(f"{json.dumps(record)}\n{json.dumps(record)}".encode())
    numbers, words = np.zeros((16, 2)), np.zeros((5, 2), np.int64)
    odd = np.ones(2, np.bool_)
    read_objects(piece, made, numbers, words, odd)
    assert not odd.any()
    assert numbers[1].tolist() == [47.5, 47.5]


def cut(text: bytes, places: list[int]) -> list[bytes]:
    ends = sorted({place % (len(text) + 1) for place in places})
    return [text[a:b] for a, b in zip([0, *ends], [*ends, len(text)], strict=True) if b > a]


@given(
    st.lists(
        st.one_of(plausible, st.lists(st.integers(), max_size=3), st.integers(0, 9)), max_size=9
    ),
    st.lists(st.integers(0, 10**6), max_size=8),
)
@settings(max_examples=60)
def test_elements_are_those_of_the_list_however_it_is_cut(
    records: list[Any], places: list[int]
) -> None:
    text = json.dumps(records).encode()
    elements = Elements(1)
    found = []
    for block in cut(text[1:], places):
        for piece in elements.push(block):
            assert not piece.faults
            for k in range(len(piece.begins)):
                raw = piece.raw(k)
                place = int(piece.places[k])
                assert text[place : place + len(raw)] == raw
                found.append(json.loads(raw))
    assert found == records
    assert elements.ended
    assert elements.finish("") is None


@given(st.binary(max_size=400), st.lists(st.integers(0, 10**6), max_size=8))
@settings(max_examples=80)
def test_any_bytes_are_cut_the_same_however_they_come(text: bytes, places: list[int]) -> None:
    def reported(blocks: list[bytes]) -> list[Any]:
        elements, lines = Elements(0), Lines()
        pieces = [piece for block in blocks for piece in elements.push(block)]
        left = elements.finish("end")
        rows = [piece for block in blocks for piece in lines.push(block)]
        rows += lines.push(b"", at_end=True)
        return [
            [
                (int(piece.places[k]), piece.raw(k))
                for piece in each
                for k in range(len(piece.begins))
            ]
            for each in (pieces, rows)
        ] + [left, elements.rest, lines.lines, lines.blank]

    assert reported(cut(text, places)) == reported([text] if text else [])
