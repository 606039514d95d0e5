"""Recordings that were written or transferred as text."""

import base64
from pathlib import Path

import numpy as np
import pytest

from multiradar_converters.asterix.framing.containers import read_octets
from multiradar_converters.asterix.framing.damage import damage_of


def octets(data: bytes) -> np.ndarray:
    """Return octets as an array."""
    return np.frombuffer(bytearray(data), dtype=np.uint8)


#: Blocks of category 048 with random content, of which every eleventh octet is a line feed.
RECORDING = b"".join(
    bytes([48, 0, 33]) + bytes([10, 200]) + np.random.default_rng(seed).bytes(28)
    for seed in range(60)
)


def test_a_recording_is_not_damaged() -> None:
    assert damage_of(octets(RECORDING)) == ""
    assert damage_of(octets(b"")) == ""
    # Short files of printable octets may be a damaged block.
    assert damage_of(octets(b"0" * 20)) == ""


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (RECORDING.hex().encode(), "hexadecimal text"),
        (RECORDING.hex(" ").encode(), "hexadecimal text"),
        (base64.encodebytes(RECORDING), "text"),
        (b"time;range;azimuth\n" * 20, "text"),
        (b"PAR1" + RECORDING, "a Parquet table"),
        (RECORDING.replace(b"\n", b"\r\n"), "transfer in text mode"),
        (RECORDING.decode("latin-1").encode("utf-8"), "it is valid UTF-8"),
    ],
)
def test_damage_is_named(data: bytes, words: str) -> None:
    assert words in damage_of(octets(data))


@pytest.mark.parametrize("text", [b"time;range;azimuth\n" * 250, "é".encode() * 2500])
def test_octets_inside_a_recording_may_look_like_text(tmp_path: Path, text: bytes) -> None:
    path = tmp_path / "recording.ast"
    path.write_bytes(RECORDING[:1000] + text)
    assert read_octets(path, 1000, 4096).tobytes() == text[:4096]
