"""Recordings that are read in windows have the blocks of those that are read as a whole."""

import struct
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from multiradar_converters.asterix.framing.containers import Blocks, read_blocks
from multiradar_converters.asterix.framing.windows import block_windows
from support.asterix.octets import block, datagram, final_format, gps, pcap, pcapng, plot_048, rply

WINDOW = 1 << 18
COUNT = 30_000
FORMS = ("blocks", "damaged", "gps", "final", "rply", "capture", "cut", "next", "joined", "bare")


def blocks() -> list[bytes]:
    return [block(48, plot_048(28_800 + number / 32)) for number in range(COUNT)]


def packet(seconds: float, frame: bytes, per_second: int = 1_000_000) -> bytes:
    high, low = divmod(round((1.6e9 + seconds) * per_second), 1 << 32)
    return struct.pack("<5I", 0, high, low, len(frame), len(frame)) + frame


@cache
def recordings() -> dict[str, bytes]:
    some = blocks()
    times = [28_800 + number / 32 for number in range(COUNT)]
    timed = list(zip(times, some, strict=True))
    halves = timed[: COUNT // 2], timed[COUNT // 2 :]
    damaged = [one if number % 97 else bytes(300) for number, one in enumerate(some)]
    return {
        "blocks": b"".join(some),
        "damaged": b"".join(damaged),
        "gps": gps(zip(times, some, strict=True)),
        "bare": gps(zip(times, some, strict=True))[2200:],
        "final": final_format(zip(times, some, strict=True)),
        "rply": rply((100, one) for one in some),
        "capture": pcap((1.6e9 + t, datagram(one)) for t, one in zip(times, some, strict=True)),
        "next": pcapng(
            # An interface, and a block of another kind without content before it.
            (0x0BAD, b""),
            (1, struct.pack("<HHI", 1, 0, 0)),
            *((6, packet(t, datagram(one))) for t, one in zip(times, some, strict=True)),
        ),
        # Two captures, one after the other: raw IP in microseconds, Ethernet in nanoseconds.
        "joined": pcapng(
            (1, struct.pack("<HHI", 101, 0, 0)),
            *((6, packet(t, datagram(one)[14:])) for t, one in halves[0]),
        )
        + pcapng(
            (1, struct.pack("<HHIHHI", 1, 0, 0, 9, 1, 9)),
            *((6, packet(t, datagram(one), 1_000_000_000)) for t, one in halves[1]),
        ),
        "cut": pcap((1.6e9 + t, datagram(one)) for t, one in zip(times, some, strict=True))[:-7],
    }


def octets(parts: list[Blocks]) -> int:
    return sum(
        int((one.ends - one.begins).sum()) + one.framing + sum(n for _, n, _ in one.gaps)
        for one in parts
    )


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS)
def test_windows_have_the_blocks_of_the_whole(form: str, tmp_path: Path) -> None:
    path = tmp_path / ("recording.gps" if form == "bare" else "recording")
    path.write_bytes(recordings()[form])
    whole, parts = read_blocks(path), list(block_windows(path, WINDOW))
    assert len(parts) > 2
    assert {one.form for one in parts} == {whole.form}
    for name in ("offsets", "received_s"):
        joined = np.concatenate([getattr(one, name) for one in parts])
        np.testing.assert_array_equal(joined, getattr(whole, name))
    assert sum(one.size for one in parts) == whole.size == path.stat().st_size
    assert octets(parts) == whole.size
    assert sum(n for one in parts for _, n, _ in one.gaps) == sum(n for _, n, _ in whole.gaps)


def test_octets_of_no_form_are_gaps(tmp_path: Path) -> None:
    path = tmp_path / "recording"
    path.write_bytes(bytes(2 * WINDOW))
    parts = list(block_windows(path, WINDOW))
    assert sum(n for one in parts for _, n, _ in one.gaps) == 2 * WINDOW
    assert sum(one.size for one in parts) == 2 * WINDOW
