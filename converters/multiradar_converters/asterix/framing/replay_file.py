"""`.rply` recordings of Asterix Display Analyser: datagrams with the intervals between them.

======  ========================================================================================
0..3    octets of the datagram (signed, little-endian)
4..7    time since the previous datagram, ms (signed, little-endian)
8…      the datagram
======  ========================================================================================

There is no header and no time of day. The layout is that of the reader of the public program.
"""

import struct

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.framing.datagrams import Datagrams

_HEAD = struct.Struct("<2i")
_OCTETS_MAX = 65_507
_PAUSE_MAX_MS = 86_400_000
_BLOCK_HEAD = 3


def is_replay_file(data: NDArray[np.uint8]) -> bool:
    """Return whether a file begins like such a recording: a head, then a block that fits."""
    raw = data[: _HEAD.size + _BLOCK_HEAD].tobytes()
    octets = _datagram_octets(raw, 0)
    if not octets or len(raw) < _HEAD.size + _BLOCK_HEAD:
        return False
    block = int.from_bytes(raw[_HEAD.size + 1 :], "big")
    after = _HEAD.size + octets
    follows = _datagram_octets(data[after : after + _HEAD.size].tobytes(), 0)
    return _BLOCK_HEAD < block <= octets and (after == len(data) or follows > 0)


def read_replay_file(
    data: NDArray[np.uint8],
) -> tuple[Datagrams, list[tuple[int, int, str]], int, int]:
    """Read the datagrams.

    Returns
    -------
    datagrams : Datagrams
        The datagrams; times are since the first.
    gaps : list of (offset, octets, reason)
        Octets after the last readable datagram.
    framing : int
        Octets of lengths and times.
    cut : int
        Length of the truncated datagram at the end of the file, with its head, of which the gap is
        the present part; 0 for none.
    """
    raw = data.tobytes()
    begins: list[int] = []
    ends: list[int] = []
    times: list[float] = []
    at, now_ms = 0, 0
    while octets := _datagram_octets(raw, at):
        begin = at + _HEAD.size
        if begin + octets > len(raw):
            break
        now_ms += _HEAD.unpack_from(raw, at)[1] if begins else 0
        begins.append(begin)
        ends.append(begin + octets)
        times.append(now_ms / 1000.0)
        at = begin + octets
    gaps = [(at, len(raw) - at, "there is no datagram at this position, or it is truncated")]
    within = 0 < len(raw) - at < _HEAD.size
    return (
        Datagrams(
            data,
            np.array(begins, dtype=np.int64),
            np.array(ends, dtype=np.int64),
            np.array(times, dtype=np.float64),
        ),
        gaps if at < len(raw) else [],
        _HEAD.size * len(begins),
        _HEAD.size + octets if octets or within else 0,
    )


def _datagram_octets(raw: bytes, at: int) -> int:
    """Return the length of the datagram whose head is here; 0 for none."""
    if at + _HEAD.size > len(raw):
        return 0
    octets, pause_ms = _HEAD.unpack_from(raw, at)
    return octets if 0 < octets <= _OCTETS_MAX and 0 <= pause_ms <= _PAUSE_MAX_MS else 0
