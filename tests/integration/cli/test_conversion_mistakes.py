"""Conversions of recordings that are cut short, given twice, or with options for other sources."""

import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from multiradar.cli.main import run
from support.asterix.octets import block, plot_048

PLOTS = 40


def blocks() -> list[bytes]:
    """Return blocks of category 048, a plot each."""
    return [
        block(48, plot_048(30_000.0 + 0.1 * number, azimuth_deg=9.0 * number))
        for number in range(PLOTS)
    ]


def gps(parts: list[bytes]) -> bytes:
    """Return a recording with a header and a trailer after each block."""
    trailers = [
        bytes(6) + struct.pack(">I", round(128 * (30_000.1 + 0.1 * number)))[1:] + bytes(1)
        for number in range(len(parts))
    ]
    both = zip(parts, trailers, strict=True)
    return b"\xcd" * 2200 + b"".join(one + trailer for one, trailer in both)


def pcap(parts: list[bytes]) -> bytes:
    """Return a capture of raw IPv4 packets."""
    packets = []
    for number, one in enumerate(parts):
        udp = struct.pack(">4H", 8600, 8600, 8 + len(one), 0) + one
        ip = struct.pack(">2B3H2BH2I", 0x45, 0, 20 + len(udp), number, 0, 64, 17, 0, 1, 2)
        packet = ip + udp
        packets.append(struct.pack("<4I", 30_000 + number, 0, len(packet), len(packet)) + packet)
    return struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65_535, 101) + b"".join(packets)


def converted(folder: Path, data: bytes, name: str, *options: str) -> int:
    """Convert a recording; return the status."""
    file = folder / name
    file.write_bytes(data)
    return run(["convert", "asterix", str(file), "--out", str(folder / "out"), *options])


@pytest.mark.parametrize(
    ("make", "name", "words"),
    [
        (gps, "a.gps", "the file ends inside a block"),
        (pcap, "a.pcap", "the file ends inside a packet"),
    ],
)
def test_a_truncated_recording_is_named(
    make: Callable[[list[bytes]], bytes],
    name: str,
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    whole = make(blocks())
    (tmp_path / "whole").mkdir()
    assert converted(tmp_path / "whole", whole, name) == 0
    assert capsys.readouterr().err == ""
    assert converted(tmp_path, whole[:-6], name) == 1
    said = capsys.readouterr().err
    assert words in said
    assert "probably cut while copying" in said


@pytest.mark.parametrize(
    "option",
    [("--edition", "021=0.26"), ("--edition", "9-9/048=1.32"), ("--reference", "9-9=43,6")],
)
def test_an_option_for_a_source_that_is_not_recorded_is_named(
    option: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert converted(tmp_path, b"".join(blocks()), "a.ast", *option) == 1
    assert "not in the recording, which has 048 of" in capsys.readouterr().err
    assert (tmp_path / "out" / "measurements.parquet").is_file()


def test_a_file_given_twice_is_a_usage_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.ast"
    file.write_bytes(b"".join(blocks()))
    assert run(["convert", "asterix", str(file), str(file), "--out", str(tmp_path / "out")]) == 2
    assert "a.ast: given twice" in capsys.readouterr().err


def test_a_folder_is_named_as_such(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["convert", "asterix", str(tmp_path), "--out", str(tmp_path / "out")]) == 1
    assert "was a folder; give the files in it" in capsys.readouterr().err
