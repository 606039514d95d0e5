"""Recordings that were written or transferred as text."""

import base64

import numpy as np
import pytest

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
