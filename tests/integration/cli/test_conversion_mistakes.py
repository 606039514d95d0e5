"""Conversions of recordings that are cut short, given twice, or with options for other sources."""

import json
import struct
from collections.abc import Callable
from pathlib import Path

import polars as pl
import pytest

from multiradar.cli.main import run
from support.asterix.octets import block, datagram, final_format, plot_048, rply
from support.asterix.octets import pcap as capture

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


def pcap(parts: list[bytes], start_s: int = 30_000) -> bytes:
    """Return a capture of raw IPv4 packets, one per second."""
    packets = []
    for number, one in enumerate(parts):
        udp = struct.pack(">4H", 8600, 8600, 8 + len(one), 0) + one
        ip = struct.pack(">2B3H2BH2I", 0x45, 0, 20 + len(udp), number, 0, 64, 17, 0, 1, 2)
        packet = ip + udp
        packets.append(struct.pack("<4I", start_s + number, 0, len(packet), len(packet)) + packet)
    return struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65_535, 101) + b"".join(packets)


def final(parts: list[bytes]) -> bytes:
    """Return a recording in Final format."""
    return final_format((30_000.0 + 0.1 * number, one) for number, one in enumerate(parts))


def replayed(parts: list[bytes]) -> bytes:
    """Return a `.rply` recording."""
    return rply((100, one) for one in parts)


def converted(folder: Path, data: bytes, name: str, *options: str) -> int:
    """Convert a recording; return the status."""
    file = folder / name
    file.write_bytes(data)
    return run(["convert", "asterix", str(file), "--out", str(folder / "out"), *options])


@pytest.mark.parametrize(
    ("make", "name", "words"),
    [
        (gps, "a.gps", "the file ends inside the block"),
        (pcap, "a.pcap", "the file ends inside the packet"),
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
    assert "probably truncated during copying" in said


@pytest.mark.parametrize("make", [gps, b"".join, final, replayed])
@pytest.mark.parametrize("left", [1, 2])
def test_a_recording_cut_inside_the_head_of_a_block_is_named(
    make: Callable[[list[bytes]], bytes],
    left: int,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    some = blocks()
    at = len(make(some[:-1]))
    assert converted(tmp_path, make(some)[: at + left], "recording") == 1
    counted = "1 octet" if left == 1 else "2 octets"
    said = capsys.readouterr().err
    assert "recording: the file ends inside the " in said
    assert f" at octet {at}, after {counted}; probably truncated during copying" in said


@pytest.mark.parametrize(
    ("make", "name", "words"),
    [
        (gps, "a.gps", "the file ends inside the block"),
        (b"".join, "a.ast", "the file ends inside the block"),
    ],
)
def test_an_inspection_names_a_truncated_recording(
    make: Callable[[list[bytes]], bytes],
    name: str,
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = tmp_path / name
    file.write_bytes(make(blocks())[:-25])
    assert run(["inspect", str(file)]) == 1
    done = capsys.readouterr()
    assert "Recording: " in done.out
    assert f"multiradar: {name}: {words}" in done.err
    assert "probably truncated during copying" in done.err


@pytest.mark.parametrize("copies", [1, 2, 3])
@pytest.mark.parametrize("command", ["inspect", "convert"])
def test_a_recording_that_was_appended_to_itself_is_named(
    command: str, copies: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = b"".join(blocks()) * copies
    if command == "inspect":
        (tmp_path / "a.ast").write_bytes(data)
        assert run(["inspect", str(tmp_path / "a.ast")]) == 0
    else:
        assert converted(tmp_path, data, "a.ast") == 0
    said = capsys.readouterr().err
    assert (f"contains the same content {copies} times: the file was probably" in said) == (
        copies > 1
    )
    assert bool(said) == (copies > 1)


@pytest.mark.parametrize("option", ["021=0.26", "20-1/048=1.15"])
def test_an_inspection_names_an_edition_that_is_not_recorded(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.ast"
    file.write_bytes(b"".join(blocks()))
    assert run(["inspect", str(file), "--edition", "48=1.15"]) == 0
    capsys.readouterr()
    assert run(["inspect", str(file), "--edition", option]) == 1
    said = capsys.readouterr().err
    assert f"--edition {option}: not in the recording, which contains 048 of " in said


@pytest.mark.parametrize(
    ("date", "words"), [("2998-08-01", "in the future"), ("1918-08-01", "earlier than any")]
)
def test_an_impossible_date_is_named(
    date: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert converted(tmp_path, b"".join(blocks()), "a.ast", "--date", date) == 0
    assert f"multiradar: date {date}: {words}" in capsys.readouterr().err


@pytest.mark.parametrize(
    "option",
    [("--edition", "021=0.26"), ("--edition", "9-9/048=1.32"), ("--reference", "9-9=43,6")],
)
def test_an_option_for_a_source_that_is_not_recorded_is_named(
    option: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert converted(tmp_path, b"".join(blocks()), "a.ast", *option) == 1
    assert "not in the recording, which contains 048 of" in capsys.readouterr().err
    assert (tmp_path / "out" / "measurements.parquet").is_file()


@pytest.mark.parametrize(
    ("reference", "swapped"), [("2.4,48.9", True), ("48.9,2.4", False), ("45.0,8.0", False)]
)
def test_a_reference_point_far_from_the_sites_of_the_sensors_is_named(
    reference: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], *, swapped: bool
) -> None:
    sensors = tmp_path / "sensors.toml"
    sensors.write_text(
        '[[sensor]]\nid = "20-130"\nkind = "radar"\nsac = 20\nsic = 130\n'
        "latitude_deg = 48.9\nlongitude_deg = 2.4\nheight_m = 100.0\n"
    )
    given = ("--sensors", str(sensors), "--reference", f"20-130={reference}")
    assert converted(tmp_path, b"".join(blocks()), "a.ast", *given) == swapped
    said = capsys.readouterr().err
    words = f"--reference 20-130={reference}: latitude and longitude are probably swapped: it is "
    assert (words in said) == swapped


def test_a_file_given_twice_is_a_usage_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.ast"
    file.write_bytes(b"".join(blocks()))
    assert run(["convert", "asterix", str(file), str(file), "--out", str(tmp_path / "out")]) == 2
    assert "a.ast: given twice" in capsys.readouterr().err


@pytest.mark.parametrize("kind", ["asterix", "adsb"])
def test_a_folder_is_named_as_such(
    kind: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def compiled(_purposes: list[str]) -> int:
        pytest.fail("kernels were compiled before the files were checked")

    monkeypatch.setattr("multiradar.toolbox.conversion.convert.compile_kernels", compiled)
    out = ["--out", str(tmp_path / "out")]
    assert run(["convert", kind, str(tmp_path), *out]) == 1
    assert "was a folder; specify the files in it" in capsys.readouterr().err
    assert run(["convert", kind, str(tmp_path / "absent"), *out]) == 1
    assert "absent: no such file" in capsys.readouterr().err


@pytest.mark.parametrize("coasting", [True, False])
def test_system_tracks_that_only_coast_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], *, coasting: bool
) -> None:
    # Items 010, 070, 105, 040 and 080, the last with CST in its fourth octet.
    status = bytes([0x01, 0x01, 0x01, 0x80 if coasting else 0x00])
    records = [
        block(
            62,
            bytes([0b1001_1001, 0b0000_1100, 20, 1])
            + round((30_000 + 4 * number) * 128).to_bytes(3, "big")
            + round((46.5 + 0.01 * number) * 2**25 / 180).to_bytes(4, "big")
            + round(7.0 * 2**25 / 180).to_bytes(4, "big")
            + (5).to_bytes(2, "big")
            + status,
        )
        for number in range(PLOTS)
    ]
    assert converted(tmp_path, b"".join(records), "a.ast") == 0
    said = capsys.readouterr().err
    words = "none of the 40 system track updates is based on a measurement (40 coasting)"
    assert (words in said) == coasting
    assert bool(said) == coasting
    if coasting:
        tracks = tmp_path / "out" / "system_tracks.parquet"
        assert run(["evaluate", str(tracks), "--system-tracks", str(tmp_path / "out")]) == 1
        assert words in capsys.readouterr().err


@pytest.mark.parametrize("options", [("--utc-offset", "2"), ()])
def test_an_offset_of_times_that_are_not_local_is_named(
    options: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.csv"
    rows = [f"{1_533_110_400 + k},3c6444,{47.0 + 0.002 * k},8.5,35000\n" for k in range(3)]
    file.write_text("timestamp,icao24,latitude,longitude,altitude\n" + "".join(rows))
    assert run(["convert", "adsb", str(file), "--out", str(tmp_path / "out"), *options]) == 0
    said = capsys.readouterr().err
    assert ("utc_offset 2: ignored; it applies only to BaseStation messages" in said) == bool(
        options
    )
    assert bool(said) == bool(options)


def _hour(start_s: float) -> bytes:
    """Return plots of one radar, one each 10 s, from a time of day on."""
    return b"".join(
        block(48, plot_048((start_s + 10.0 * number) % 86_400.0, azimuth_deg=9.0 * number))
        for number in range(PLOTS)
    )


def test_files_in_order_continue_past_midnight(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [tmp_path / "a.ast", tmp_path / "b.ast"]
    for file, start_s in zip(files, (86_000.0, 86_400.0), strict=True):
        file.write_bytes(_hour(start_s))
    out = tmp_path / "out"
    assert run(["convert", "asterix", *map(str, files), "--out", str(out)]) == 0
    assert capsys.readouterr().err == ""
    times = pl.read_parquet(out / "measurements.parquet")["time_s"]
    assert times.to_list() == [86_000.0 + 10.0 * number for number in range(2 * PLOTS)]
    assert run(["inspect", *map(str, files), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["first_s"], found["last_s"]) == (times.min(), times.max())


def _day(phase_s: float) -> list[tuple[float, bytes]]:
    """Return plots of one radar, one each half hour, from midnight to midnight, with times."""
    times = [phase_s + 1800.0 * number for number in range(48)]
    return [(one, block(48, plot_048(one, azimuth_deg=one % 360.0))) for one in times]


@pytest.mark.parametrize("dated", [True, False])
def test_files_of_whole_days_follow_one_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], *, dated: bool
) -> None:
    days = [_day(0.5), _day(1.25)]
    files = [tmp_path / "a.ast", tmp_path / "b.ast"]
    for number, (file, day) in enumerate(zip(files, days, strict=True)):
        start_s = 1_533_081_600.0 + 86_400.0 * number
        packets = [(start_s + time_s + 0.25, datagram(one)) for time_s, one in day]
        file.write_bytes(capture(packets) if dated else b"".join(one for _, one in day))
    out = tmp_path / "out"
    assert run(["convert", "asterix", *map(str, files), "--out", str(out)]) == 0
    said = capsys.readouterr().err
    assert ("b.ast: placed on a later day than a.ast" in said) != dated
    assert bool(said) != dated
    times = pl.read_parquet(out / "measurements.parquet")["time_s"]
    expected = [phase_s + 1800.0 * number for phase_s in (0.5, 86_401.25) for number in range(48)]
    assert times.to_list() == expected
    assert run(["inspect", *map(str, files), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["first_s"], found["last_s"]) == (expected[0], expected[-1])
    assert found["date"] == ("2018-08-01" if dated else None)
    assert len(found["moved_files"]) == (0 if dated else 1)


@pytest.mark.parametrize("exchanged", [True, False])
def test_files_in_the_wrong_order_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], *, exchanged: bool
) -> None:
    files = [tmp_path / "a.ast", tmp_path / "b.ast"]
    for file, start_s in zip(files, (30_000.0, 30_400.0), strict=True):
        file.write_bytes(_hour(start_s))
    given = files[::-1] if exchanged else files
    out = tmp_path / "out"
    assert run(["convert", "asterix", *map(str, given), "--out", str(out)]) == 0
    said = capsys.readouterr().err
    assert ("a.ast: ends before b.ast starts, but was specified after" in said) == exchanged
    assert bool(said) == exchanged


@pytest.mark.parametrize(
    ("start_s", "date", "captured"),
    [
        # 2018-08-01 08:20:00 UTC, when the reports are from.
        (1_533_081_600 + 30_000, "2001-01-01", "2018-08-01"),
        (1_533_081_600 + 30_000, "2018-08-02", "2018-08-01"),
        (1_533_081_600 + 30_000, "2018-08-01", ""),
        # Ten minutes of latency at most.
        (1_533_081_600 + 30_600, "2001-01-01", "2018-08-01"),
        (1_533_081_600 + 30_601, "2001-01-01", ""),
        # Replayed and captured at another time of day.
        (1_533_081_600 + 40_000, "2001-01-01", ""),
        # A recorder without a date.
        (30_000, "2001-01-01", ""),
    ],
)
def test_a_date_other_than_that_of_the_packets_is_named(
    start_s: int, date: str, captured: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status = converted(tmp_path, pcap(blocks(), start_s), "a.pcap", "--date", date)
    said = capsys.readouterr().err
    assert status == bool(captured)
    assert (f"--date {date}: the recording was captured on {captured}, according" in said) == status
