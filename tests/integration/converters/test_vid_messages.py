"""Error messages: folder, key, reason."""

import errno
import os
from pathlib import Path
from typing import Any

import pytest

from multiradar_converters.errors import ConversionError, LayoutError, ProfileError
from multiradar_converters.vid import spool
from multiradar_converters.vid.profile import load_profile
from support.inputs import dumps


@pytest.fixture
def dump(tmp_path: Path) -> Path:
    return dumps.write_dump(tmp_path / "dump", dumps.part_of_sample(30), dumps.columns())


def test_a_missing_parent_folder_is_named(tmp_path: Path, dump: Path) -> None:
    with pytest.raises(ConversionError, match=f"no such folder {tmp_path / 'c'}; create it first"):
        dumps.run(dump, tmp_path / "c" / "base")


def test_a_full_disk_is_reported_with_the_output(
    tmp_path: Path, dump: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(spool, "write_all", full)
    with pytest.raises(ConversionError, match=f"{tmp_path / 'out'}: cannot be written: No space"):
        dumps.run(dump, tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["dump"]


@pytest.mark.parametrize(
    ("make", "was"), [(Path.mkdir, "folder"), (os.mkfifo, "special file")], ids=["folder", "FIFO"]
)
def test_a_path_that_is_not_a_file_is_reported(
    tmp_path: Path, dump: Path, make: Any, was: str
) -> None:
    (dump / "plots.txt").unlink()
    make(dump / "plots.txt")
    with pytest.raises(LayoutError, match=rf"plots\.txt: expected a file, was a {was}"):
        dumps.run(dump, tmp_path / "out")


def test_a_missing_optional_file_is_reported_with_the_option(tmp_path: Path, dump: Path) -> None:
    (dump / "plots_ads.txt").unlink()
    with pytest.raises(LayoutError, match="--allow-missing"):
        dumps.run(dump, tmp_path / "out")


def test_the_skeleton_speaks_of_sensors_without_plots_and_of_one_plot(tmp_path: Path) -> None:
    plot = ["10", "5", "57014.6", "13.8440", "46.9128223", "6.2769624", "11582.4", "6430"]
    track = ["10", "7", "0", "46.7", "6.1", "11277.6", "6121"]
    rows = {
        "plots.txt": [["1000.0", "26", *plot]],
        "tracks.txt": [["1000.3", "41", *track]],
        "plots_ads.txt": [["999.0", "7", "3c09df", "47.2", "8.3", ""]],
    }
    dumps.run(dumps.write_dump(tmp_path / "dump", rows, dumps.columns()), tmp_path / "out")
    text = (tmp_path / "out" / "sensors.toml").read_text()
    assert "# 1 plot, not referenced by tracks\n" in text
    assert "# no plots; referenced by tracks only\n" in text
    assert "# 1 report\n" in text


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "unit = 1",
            r"line 1: unknown key 'unit' \(did you mean 'units'\?\); known: encoding, form, ",
        ),
        (
            "[units]\nspeed = 'm'",
            r"line 2: units: unknown key 'speed'; known: range, height, azimuth$",
        ),
        ("form = 'rows'", "line 1: form: unknown name 'rows'; known: auto, columns, pairs"),
        ("naming_tolerance_s = 0.0", "naming_tolerance_s: expected a number above 0, was 0.0"),
        ("multiradar_source = -1", "multiradar_source: expected"),
        ("multiradar_source = 'x'", "multiradar_source: expected a whole number, was 'x'"),
        ("units = 'm'", "units: expected a table, was 'm'"),
        ("[headers]\nplots = 'time'", r"headers\.plots: expected a list, was 'time'"),
    ],
)
def test_a_wrong_key_of_a_profile_is_reported_with_expected_and_actual_value(
    tmp_path: Path, text: str, said: str
) -> None:
    path = tmp_path / "profile.toml"
    path.write_text(text)
    with pytest.raises(ProfileError, match=said):
        load_profile(path)


@pytest.mark.parametrize("form", ["columns", "pairs"])
def test_rubbish_before_the_first_row_is_rejected_and_the_rest_read(
    tmp_path: Path, form: str
) -> None:
    encode = dumps.columns() if form == "columns" else dumps.pairs()
    dump = dumps.write_dump(tmp_path / "dump", dumps.part_of_sample(30), encode)
    path = dump / "plots.txt"
    end = b"\r\n" if form == "columns" else b"\n"
    path.write_bytes(end.join([b"# recorded=2018", b"", b"\xffrubbish", path.read_bytes()]))
    report = dumps.run(dump, tmp_path / "out")
    assert [(r["line"], r["code"]) for r in dumps.rejects(tmp_path / "out")] == [
        (1, "MALFORMED_LINE"), (3, "MALFORMED_LINE"),
    ]  # fmt: skip
    assert (report["counts"]["accepted"], report["counts"]["blank"]) == (90, 1)


def test_a_header_in_capitals_is_read(tmp_path: Path, dump: Path) -> None:
    path = dump / "plots.txt"
    header, rest = path.read_bytes().split(b"\r\n", 1)
    path.write_bytes(header.upper() + b"\r\n" + rest)
    assert dumps.run(dump, tmp_path / "out")["counts"]["accepted"] == 90


def test_nul_bytes_are_not_called_utf_16(tmp_path: Path, dump: Path) -> None:
    path = dump / "plots.txt"
    path.write_bytes(bytes(300_000) + path.read_bytes())
    with pytest.raises(LayoutError, match="found mostly NUL bytes"):
        dumps.run(dump, tmp_path / "out")


def test_the_columns_of_a_binary_file_are_cut_and_printable(tmp_path: Path, dump: Path) -> None:
    (dump / "plots.txt").write_bytes(bytes(range(1, 256)) * 100)
    with pytest.raises(LayoutError) as reported:
        dumps.run(dump, tmp_path / "out")
    assert len(str(reported.value)) < 350
    assert str(reported.value).isprintable()
