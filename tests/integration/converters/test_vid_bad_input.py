"""Dumps that are broken, cut, missing or in the way: a clear error, and nothing lost."""

from pathlib import Path
from typing import Any

import pytest

from multiradar_converters.errors import LayoutError, OutputFolderExistsError, ProfileError
from multiradar_converters.vid.profile import load_profile
from multiradar_converters.vid.text import blocks
from support.inputs import dumps


@pytest.fixture
def dump(tmp_path: Path) -> Path:
    return dumps.write_dump(tmp_path / "dump", dumps.part_of_sample(30), dumps.columns())


def nothing_left(folder: Path) -> bool:
    return {path.name for path in folder.iterdir()} <= {"dump"}


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda p: (p / "plots.txt").unlink(), "missing file plots.txt"),
        (lambda p: (p / "tracks.txt").unlink(), "missing file tracks.txt"),
        (lambda p: (p / "plots_ads.txt").write_bytes(b""), "the file is empty"),
        (lambda p: replace(p / "plots.txt", b"azimuth", b"azimut"), "missing column azimuth"),
        (lambda p: replace(p / "plots.txt", b"h\tcode", b"h\th"), "missing column code"),
        (lambda p: replace(p / "tracks.txt", b"code", b"code\tlat"), "repeats lat"),
        *(
            (lambda p, name=name: headless(p / name), f"{name}: the header line is missing: the f")
            for name in ("plots.txt", "tracks.txt", "plots_ads.txt")
        ),
        (lambda p: recode(p / "plots.txt", "utf-16"), "found UTF-16"),
        (lambda p: recode(p / "plots.txt", "utf-16-le"), "found UTF-16"),
        (lambda p: recode(p / "plots.txt", "utf-16-be"), "found UTF-16"),
    ],
)
@pytest.mark.fault(4)
def test_a_dump_that_cannot_be_read_is_named_and_leaves_nothing(
    tmp_path: Path, dump: Path, spoil: Any, said: str
) -> None:
    spoil(dump)
    with pytest.raises(LayoutError, match=said):
        dumps.run(dump, tmp_path / "out")
    assert nothing_left(tmp_path)


def replace(path: Path, old: bytes, new: bytes) -> None:
    path.write_bytes(path.read_bytes().replace(old, new, 1))


def headless(path: Path) -> None:
    path.write_bytes(path.read_bytes().partition(b"\n")[2])


def recode(path: Path, encoding: str) -> None:
    path.write_bytes(path.read_bytes().decode("ascii").encode(encoding))


def test_a_path_that_is_not_a_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(LayoutError, match="no such file or folder"):
        dumps.run(tmp_path / "nowhere", tmp_path / "out")


def test_a_folder_without_any_file_of_a_dump_is_named_as_such(tmp_path: Path) -> None:
    (tmp_path / "dump").mkdir()
    (tmp_path / "dump" / "notes.txt").write_text("none of them")
    with pytest.raises(LayoutError, match=r"text files of a dump.*, was another folder"):
        dumps.run(tmp_path / "dump", tmp_path / "out")


def test_missing_files_may_be_allowed_but_not_plots(tmp_path: Path, dump: Path) -> None:
    (dump / "tracks.txt").unlink()
    (dump / "plots_ads.txt").unlink()
    report = dumps.run(dump, tmp_path / "out", allow_missing=True)
    assert report["counts"]["accepted"] == 30
    assert report["figures"]["plots_named_by_no_track"] == 30
    (dump / "plots.txt").unlink()
    with pytest.raises(LayoutError, match=r"plots\.txt"):
        dumps.run(dump, tmp_path / "again", allow_missing=True)


@pytest.mark.parametrize("kind", ["folder", "file", "dangling link"])
def test_an_output_that_exists_is_rejected_untouched(tmp_path: Path, dump: Path, kind: str) -> None:
    out = tmp_path / "out"
    if kind == "folder":
        out.mkdir()
        (out / "mine").write_text("mine")
    elif kind == "file":
        out.write_text("mine")
    else:
        out.symlink_to(tmp_path / "nowhere")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(OutputFolderExistsError, match="exists"):
        dumps.run(dump, out)
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("name", dumps.FILES)
@pytest.mark.fault(2)
def test_a_file_cut_at_any_byte_gives_its_whole_lines_and_accounts_for_the_rest(
    tmp_path: Path, name: str
) -> None:
    part = dumps.part_of_sample(2)
    dump = dumps.write_dump(tmp_path / "dump", part, dumps.columns())
    whole = (dump / name).read_bytes()
    header = whole.index(b"\n") + 1
    second = whole.index(b"\n", header) + 1
    for cut in range(second, len(whole) + 1):
        (dump / name).write_bytes(whole[:cut])
        report = dumps.run(dump, tmp_path / f"out{cut}", kinds=("ads",))
        account = report["figures"]["files"][name]
        complete = whole[header:cut].count(b"\r\n")
        tail = whole[header:cut].rsplit(b"\n", 1)[-1]
        assert account["bytes"] == cut
        assert account["lines"] == 1 + complete + bool(tail)
        # A tail without its end mark counts only when no character of its line is missing.
        missing = whole[cut:].split(b"\n")[0]
        assert account["accepted"] == complete + bool(tail.strip() and not missing.strip()), cut
        for reject in dumps.rejects(tmp_path / f"out{cut}"):
            assert (reject["line"], reject["raw"].encode()) == (2 + complete, tail.rstrip(b"\r"))
            assert reject["code"] == "TRUNCATED"


@pytest.mark.parametrize(
    ("text", "hint"),
    [(b"13,8", "decimal comma"), (b"08:00:00.5", "time of day"), (b"13;8", "was '13;8'")],
)
@pytest.mark.fault(3)
def test_a_number_in_another_form_is_explained(
    tmp_path: Path, dump: Path, text: bytes, hint: str
) -> None:
    path = dump / "plots.txt"
    lines = path.read_bytes().split(b"\r\n")
    lines[3] = b"\t".join([text, *lines[3].split(b"\t")[1:]])
    path.write_bytes(b"\r\n".join(lines))
    dumps.run(dump, tmp_path / "out")
    (reject,) = dumps.rejects(tmp_path / "out")
    assert hint in reject["reason"]


@pytest.mark.parametrize(
    ("code", "hint"),
    [
        (b"3199", " (a decimal number?)"),
        (b"819", " (a decimal number?)"),
        (b"21", " (leading zeros lost?)"),
        (b"12a9", ""),
    ],
)
def test_a_code_with_a_digit_that_is_not_octal_is_probably_decimal(
    tmp_path: Path, dump: Path, code: bytes, hint: str
) -> None:
    path = dump / "plots.txt"
    lines = path.read_bytes().split(b"\r\n")
    lines[3] = b"\t".join([*lines[3].split(b"\t")[:-1], code])
    path.write_bytes(b"\r\n".join(lines))
    dumps.run(dump, tmp_path / "out")
    (reject,) = dumps.rejects(tmp_path / "out")
    assert reject["reason"] == f"code: expected four octal digits, was '{code.decode()}'{hint}"


def test_a_remark_at_the_end_is_no_truncated_line(tmp_path: Path, dump: Path) -> None:
    path = dump / "plots.txt"
    path.write_bytes(path.read_bytes() + b"(30 rows)")
    dumps.run(dump, tmp_path / "out")
    assert [one["code"] for one in dumps.rejects(tmp_path / "out")] == ["WRONG_FIELD_COUNT"]


def test_pairs_cut_within_the_last_line_are_not_trusted(tmp_path: Path) -> None:
    part = dumps.part_of_sample(2)
    rows = {name: [row, row] for name, (row, _) in part.items()}
    encode = dumps.pairs()
    dump = dumps.write_dump(tmp_path / "dump", rows, encode)
    line = (dump / "plots.txt").read_bytes().split(b"\n")[0]
    for cut in range(1, len(line)):
        (dump / "plots.txt").write_bytes(line + b"\n" + line[:cut])
        report = dumps.run(dump, tmp_path / f"out{cut}", kinds=("ads",))
        assert report["figures"]["files"]["plots.txt"]["accepted"] == 1, line[:cut]


def test_a_line_longer_than_a_block_is_one_reject(tmp_path: Path, dump: Path) -> None:
    path = dump / "plots.txt"
    lines = path.read_bytes().split(b"\r\n")
    lines[4] = b"7" * (3 * blocks.BLOCK_BYTES)
    path.write_bytes(b"\r\n".join(lines))
    report = dumps.run(dump, tmp_path / "out")
    assert [(r["line"], r["code"]) for r in dumps.rejects(tmp_path / "out")] == [(5, "TOO_LARGE")]
    assert report["figures"]["files"]["plots.txt"]["accepted"] == 29


def test_a_file_of_tiny_lines_is_read_in_small_blocks_and_loses_none(
    tmp_path: Path, dump: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(blocks, "BLOCK_LINES_MAX", 100)
    monkeypatch.setattr(blocks, "_SMALL_BLOCK_BYTES", 64)
    path = dump / "plots.txt"
    whole = path.read_bytes()
    path.write_bytes(whole + b"x\n" * 500 + whole.split(b"\r\n")[5] + b"\r\n")
    report = dumps.run(dump, tmp_path / "out")
    assert [reject["line"] for reject in dumps.rejects(tmp_path / "out")] == list(range(32, 532))
    assert report["figures"]["files"]["plots.txt"]["accepted"] == 31


def test_a_header_repeated_within_a_file_is_a_header(tmp_path: Path, dump: Path) -> None:
    path = dump / "plots.txt"
    path.write_bytes(path.read_bytes() * 2)
    account = dumps.run(dump, tmp_path / "out")["figures"]["files"]["plots.txt"]
    assert (account["header"], account["accepted"], account["rejected"]) == (2, 60, 0)


@pytest.mark.parametrize(
    ("field", "text", "code"),
    [
        ("time", "-1", "OUT_OF_RANGE"),
        ("time", "1e999", "NON_FINITE"),
        ("range", "0", "OUT_OF_RANGE"),
        ("range", "1000000.1", "OUT_OF_RANGE"),
        ("azimuth", "360.0", "OUT_OF_RANGE"),
        ("azimuth", "13,8", "NOT_A_NUMBER"),
        ("lat", "١٢", "NOT_A_NUMBER"),
        ("lon", "1_0", "NOT_A_NUMBER"),
        ("lon", "-180.0000001", "OUT_OF_RANGE"),
        ("h", "40000.1", "OUT_OF_RANGE"),
        ("h", "high", "NOT_A_NUMBER"),
        ("code", "8421", "NOT_A_NUMBER"),
        ("source", "26.0", "NOT_A_NUMBER"),
        ("plot", "9999999999", "OUT_OF_RANGE"),
        ("sensor", "", "MISSING_FIELD"),
        ("sensor", "1\x000", "ENCODING"),
    ],
)
@pytest.mark.fault(3, 9, 10)
def test_absurd_values_are_rejected_by_name(
    tmp_path: Path, dump: Path, field: str, text: str, code: str
) -> None:
    path = dump / "plots.txt"
    lines = path.read_bytes().decode().split("\r\n")
    fields = lines[3].split("\t")
    fields[dumps.HEADERS["plots.txt"].index(field)] = text
    lines[3] = "\t".join(fields)
    path.write_bytes("\r\n".join(lines).encode())
    report = dumps.run(dump, tmp_path / "out")
    (reject,) = dumps.rejects(tmp_path / "out")
    assert (reject["file"], reject["line"], reject["code"], reject["raw"]) == (
        "plots.txt", 4, code, lines[3]
    )  # fmt: skip
    assert field in reject["reason"] or code == "ENCODING"
    assert report["counts"]["accepted"] == 89


@pytest.mark.parametrize(
    ("field", "text", "end"),
    [
        ("time", "1533110400123", " s, was '1533110400123' (milliseconds?)"),
        ("time", "-1", " s, was '-1'"),
        ("azimuth", "361", ", was '361'"),
    ],
)
def test_a_unit_is_suggested_for_times_that_are_too_large(
    tmp_path: Path, dump: Path, field: str, text: str, end: str
) -> None:
    path = dump / "plots.txt"
    lines = path.read_bytes().decode().split("\r\n")
    fields = lines[3].split("\t")
    fields[dumps.HEADERS["plots.txt"].index(field)] = text
    lines[3] = "\t".join(fields)
    path.write_bytes("\r\n".join(lines).encode())
    dumps.run(dump, tmp_path / "out")
    (reject,) = dumps.rejects(tmp_path / "out")
    assert reject["reason"].endswith(end)


def test_text_in_windows_1251_is_quoted_unchanged(tmp_path: Path, dump: Path) -> None:
    path = dump / "tracks.txt"
    path.write_bytes(path.read_bytes() + "сбой записи\r\n".encode("cp1251"))
    dumps.run(dump, tmp_path / "out")
    assert [reject["raw"] for reject in dumps.rejects(tmp_path / "out")] == ["сбой записи"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("unit = 1", "unit"),
        ("[units]\nrange = 'mile'", r"units\.range"),
        (
            "[columns.plots]\nspeed = 'v'",
            r"line 2: columns\.plots: unknown field 'speed'; known: time",
        ),
        ("[columns.plots]\nrange = ''", "only h and code may be missing"),
        (
            "[columns.radar]\nrange = 'r'",
            "columns: unknown table 'radar'; known: plots, plots_ads, tracks",
        ),
        ("encoding = 'klingon'", "klingon"),
        ("= 1", "not valid TOML"),
    ],
)
def test_an_invalid_profile_is_rejected_by_key(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "profile.toml"
    path.write_text(text)
    with pytest.raises(ProfileError, match=said):
        load_profile(path)
    with pytest.raises(ProfileError, match="no such file"):
        load_profile(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("encoding", "broken", "raw"),
    [
        # A line in the encoding of the file, which is not UTF-8.
        ("cp866", "борт".encode("cp866"), "борт"),
        ("koi8-r", "борт".encode("koi8-r"), "борт"),
        # An octet that is no UTF-8 in a file of it: most likely it is windows-1251.
        ("utf-8", b"\xcf", "П"),
        ("utf-8", "борт".encode(), "борт"),
    ],
)
def test_a_rejected_line_is_written_in_the_encoding_of_its_file(
    tmp_path: Path, dump: Path, encoding: str, broken: bytes, raw: str
) -> None:
    path = dump / "plots.txt"
    lines = path.read_bytes().split(b"\r\n")
    path.write_bytes(b"\r\n".join([*lines[:5], broken, *lines[5:]]))
    profile = tmp_path / "dump" / "profile.toml"
    profile.write_text(f"encoding = '{encoding}'\n")
    dumps.run(dump, tmp_path / "out", profile=load_profile(profile))
    (reject,) = dumps.rejects(tmp_path / "out")
    assert (reject["file"], reject["line"], reject["raw"]) == ("plots.txt", 6, raw)
