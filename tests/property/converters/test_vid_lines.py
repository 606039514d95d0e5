"""The compiled and the reference parser agree for any line."""

from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from multiradar_converters.vid import fields
from multiradar_converters.vid.accounting import Account, RejectsFile
from multiradar_converters.vid.profile import Profile
from multiradar_converters.vid.text import _kernels
from multiradar_converters.vid.text.detection import detect
from multiradar_converters.vid.text.lines import Line, RejectedError, parse_line
from multiradar_converters.vid.text.reading import _HINTS, read_rows
from support.inputs import dumps
from support.kernels import plain

FIELDS = st.sampled_from(
    [
        "", " ", "0", "-0", "+5", "00012", "12.5", ".5", "5.", ".", "-", "1e3", "1E400", "1_0",
        "1,5", "nan", "-inf", "Infinity", "0x10", "٣", "true", "123.4567", "-91", "90", "360",
        "359.9999999999999", "99999999999", "4294967296", "2147483647", "12345678901234567890",
        "0.1234567890123456789", "179.99999999999997", "7777", "8000", "777", "07777", "3c09df",
        "3C09DF", "3c09d", "3c09dg", "2018-08-01T08:00:00Z", "2018-02-30T08:00:00", "1e-320",
        "9007199254740993", "x", "\x00", "é", "=", "lat=1", "time=5", " 7", "7 ", "1 2",
    ]
)  # fmt: skip
_LINES = {
    "plots.txt": "28800.191 26 10 61928 57014.6 13.8440 46.9128223 6.2769624 11582.4 6430",
    "tracks.txt": "28800.199 26 10 30002 61927 46.7063649 6.1791294 11277.6 6121",
    "plots_ads.txt": "28800.000 29860 3c09df 47.2418161 8.3530602 10363.2",
}
PLAIN = {name: text.split() for name, text in _LINES.items()}
ENCODERS = {
    "tabs": (dumps.columns("\t", "\n"), "\t"),
    "CRLF": (dumps.columns("\t", "\r\n"), "\t"),
    "semicolons": (dumps.columns(";", "\n"), ";"),
    "blanks": (dumps.columns("  ", "\n"), " "),
    "pairs": (dumps.pairs(" ", "\n"), " "),
}
TABLES = {"plots.txt": fields.PLOTS, "tracks.txt": fields.TRACKS, "plots_ads.txt": fields.REPORTS}

mutations = st.lists(
    st.tuples(
        st.sampled_from(["replace", "delete", "insert", "cut", "byte"]), st.integers(0, 200), FIELDS
    ),
    max_size=3,
)


def mutate(line: str, separator: str, changes: list[tuple[str, int, str]]) -> bytes:
    """Change a line that was right."""
    for what, place, field in changes:
        parts = line.split(separator)
        k = place % len(parts)
        if what == "replace":
            name, equals, _ = parts[k].partition("=")
            parts[k] = f"{name}={field}" if equals else field
        elif what == "delete":
            del parts[k]
        elif what == "insert":
            parts.insert(k, field)
        line = separator.join(parts)
        if what == "cut":
            line = line[: place % (len(line) + 1)]
        elif what == "byte" and line:
            at = place % len(line)
            line = line[:at] + field[:1] + line[at + 1 :]
    return line.encode("utf-8")


def read_both(folder: Path, name: str, encoder: str, lines: list[bytes]) -> tuple[Any, Any]:
    """Read lines with the converter, and one by one in the plain form."""
    encode, _ = ENCODERS[encoder]
    end = b"\r\n" if encoder == "CRLF" else b"\n"
    head = encode(name, [PLAIN[name]])
    path = folder / name
    path.write_bytes(head + b"".join(line + end for line in lines))
    layout = detect(path, TABLES[name], Profile())
    account = Account(name, path.stat().st_size)
    with ThreadPoolExecutor(1) as pool, RejectsFile(folder / "rejects.ndjson") as rejects:
        blocks = list(
            read_rows(
                path, layout, pool=pool, account=account, rejects=rejects,
                progress=lambda _: None, block_bytes=256,
            )
        )  # fmt: skip
    found_rows = [
        (tuple(numbers), tuple(integers))
        for block in blocks
        for numbers, integers in zip(
            block.numbers.T.tolist(), block.integers.T.tolist(), strict=True
        )
    ]
    plain_rows, plain_rejects = [], []
    header = 0 if layout.header is None else 1
    for number, line in enumerate(path.read_bytes().split(b"\n")[header:-1], start=header + 1):
        try:
            row = parse_line(line, layout)
        except RejectedError as rejected:
            plain_rejects.append((number, str(rejected.code), rejected.reason))
            continue
        if not isinstance(row, Line):
            plain_rows.append((row.numbers, row.integers))
    found_rejects = [
        (reject["line"], reject["code"], reject["reason"]) for reject in dumps.rejects(folder)
    ]
    roles = list(layout.table.roles)
    return (
        (_used(found_rows, roles), found_rejects),
        (_used(plain_rows, roles), plain_rejects),
    )


def _used(rows: list[Any], roles: list[int]) -> list[list[str]]:
    """Keep the roles of a table; text reports NaN and -0.0 apart as numbers do not."""
    return [
        [
            repr(numbers[role]) if role < fields.FIRST_INTEGER else repr(integers[role - 6])
            for role in roles
        ]
        for numbers, integers in rows
    ]


@pytest.mark.parametrize("encoder", sorted(ENCODERS))
@pytest.mark.parametrize("name", dumps.FILES)
@settings(max_examples=60)
@given(changes=st.lists(mutations, min_size=1, max_size=6))
@example(changes=[[("replace", 0, "5.")], [("replace", 0, ".5")], [("cut", 0, "")]])
@example(changes=[[("replace", 8, "")], [("replace", 9, "")], [("delete", 9, "")]])
def test_compiled_and_plain_reading_agree_on_broken_lines(
    tmp_path: Path, name: str, encoder: str, changes: list[list[tuple[str, int, str]]]
) -> None:
    encode, separator = ENCODERS[encoder]
    whole = encode(name, [PLAIN[name]]).decode().split("\n")[-2].rstrip("\r")
    lines = [mutate(whole, separator, change).replace(b"\n", b" ") for change in changes]
    found, expected = read_both(tmp_path, name, encoder, lines)
    assert found == expected


def test_a_line_may_have_more_pairs_than_there_are_guesses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Uncompiled, where an index out of bounds is an error."""
    monkeypatch.setattr(_kernels, "parse_pairs", plain(_kernels.parse_pairs))
    name = "plots_ads.txt"
    line = b"x=0 " * _HINTS + dumps.pairs()(name, [PLAIN[name]]).rstrip()
    found, expected = read_both(tmp_path, name, "pairs", [line, line])
    assert found == expected
    assert (len(found[0]), found[1]) == (3, [])


@settings(max_examples=150)
@given(
    st.lists(
        st.tuples(
            st.decimals(0, 99999, places=3),
            st.integers(-(10**18), 10**18),
            st.integers(0, 17),
        ),
        min_size=1,
    )
)
# Quotients of rounded mantissas, rounded again, would differ from these.
@example([(0, 250367245457070922, 17), (0, -640988058361946025, 17)])
def test_decimals_are_read_as_python_reads_them(tmp_path: Path, values: list[Any]) -> None:
    lines = []
    for time, latitude, places in values:
        row = list(PLAIN["plots_ads.txt"])
        sign, digits = "-" if latitude < 0 else "", f"{abs(latitude):018d}"
        places = max(places, len(digits) - 1)
        row[0], row[3] = str(time), f"{sign}{digits[:-places]}.{digits[-places:]}"
        lines.append("\t".join(row).encode())
    (rows, rejected), _ = read_both(tmp_path, "plots_ads.txt", "tabs", lines)
    assert not rejected
    roles = list(fields.REPORTS.roles)
    for line, row in zip(lines, rows[1:], strict=True):
        texts = line.decode().split("\t")
        assert float(row[roles.index(fields.TIME)]) == float(texts[0])
        assert float(row[roles.index(fields.LATITUDE)]) == float(texts[3])


@settings(max_examples=25)
@given(data=st.data())
@pytest.mark.fault(1)
def test_a_broken_line_leaves_its_neighbours_alone(
    tmp_path_factory: pytest.TempPathFactory, data: Any
) -> None:
    folder = tmp_path_factory.mktemp("neighbours")
    part = dumps.part_of_sample(40)
    place = data.draw(st.sampled_from([0, 1, 17, 38, 39]))
    dump = dumps.write_dump(folder / "dump", part, dumps.columns("\t", "\n"))
    path = dump / "plots_ads.txt"
    lines = path.read_bytes().split(b"\n")
    lines[1 + place] = (
        data.draw(st.binary(max_size=60)).replace(b"\n", b"").replace(b"\r", b"") + b"!"
    )
    path.write_bytes(b"\n".join(lines))
    report = dumps.run(dump, folder / "out", kinds=("ads",))
    assert [(r["file"], r["line"]) for r in dumps.rejects(folder / "out")] == [
        ("plots_ads.txt", 2 + place)
    ]
    assert report["counts"]["accepted"] == 119
    found = dumps.contents(folder / "out")
    del found["rejects.ndjson"]
    assert found == _without_line(place)


@cache
def _without_line(place: int) -> dict[str, bytes]:
    part = dumps.part_of_sample(40)
    rest = {"plots_ads.txt": [row for k, row in enumerate(part["plots_ads.txt"]) if k != place]}
    with TemporaryDirectory() as folder:
        clean = dumps.write_dump(
            Path(folder) / "clean", {**part, **rest}, dumps.columns("\t", "\n")
        )
        dumps.run(clean, Path(folder) / "expected", kinds=("ads",))
        expected = dumps.contents(Path(folder) / "expected")
    del expected["rejects.ndjson"]
    return expected
