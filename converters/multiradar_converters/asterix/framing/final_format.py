"""Final format (`.ff`, `.astfin`): each datagram in an envelope with its time of reception.

=======  =======================================================================================
0, 1     octets of the envelope, with this header and the footer (big-endian)
2        number of the board, or type
3        number of the line
4        day of the recording; mostly 0
5..7     time of day of the reception, 10 ms (big-endian)
8…       one or more data blocks
last 4   0xA5 each
=======  =======================================================================================

Day and time are often read as one number of four octets; the time of day needs only three. After a
damaged envelope, reading resumes at the next one that has no footer inside.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.framing.datagrams import Datagrams

_HEAD, _DAY = 8, 4
_FOOTER = b"\xa5" * 4
_TICKS_PER_S = 100.0
_DAY_S = 86_400.0
# A recording may begin inside an envelope; the largest has 65 535 octets.
_SEARCHED_MAX = 1 << 17
_DAMAGED = "there is no Final format envelope at this position"
_CUT = "a Final format envelope is truncated"


def is_final_format(data: NDArray[np.uint8]) -> bool:
    """Return whether two envelopes follow each other at the start of a file, or one is all."""
    raw = data[: 2 * _SEARCHED_MAX].tobytes()
    at = 0
    while 0 <= at < _SEARCHED_MAX:
        end = _envelope_end(raw, at)
        if end and (end == len(raw) or _envelope_end(raw, end)):
            return True
        at = _next_envelope(raw, at + 1)
    return False


def read_final_format(
    data: NDArray[np.uint8],
) -> tuple[Datagrams, list[tuple[int, int, str]], int, int]:
    """Read the datagrams.

    Returns
    -------
    datagrams : Datagrams
        The datagrams, with their times of day.
    gaps : list of (offset, octets, reason)
        Octets outside envelopes.
    framing : int
        Octets of headers and footers.
    cut : int
        Length of the truncated envelope at the end of the file, of which the last gap is the
        present part; 0 for none.
    """
    raw = data.tobytes()
    begins: list[int] = []
    ends: list[int] = []
    times: list[float] = []
    gaps: list[tuple[int, int, str]] = []
    at = 0
    while at < len(raw):
        end = _envelope_end(raw, at)
        if not end:
            found = _next_envelope(raw, at + 1)
            end = found if found >= 0 else len(raw)
            gaps.append((at, end - at, _DAMAGED))
        else:
            begins.append(at + _HEAD)
            ends.append(end - len(_FOOTER))
            time_s = int.from_bytes(raw[at + _DAY + 1 : at + _HEAD], "big") / _TICKS_PER_S
            times.append(time_s if time_s < _DAY_S else np.nan)
        at = end
    cut = _cut(raw, gaps)
    if cut:
        gaps[-1] = (*gaps[-1][:2], _CUT)
    datagrams = Datagrams(
        data,
        np.array(begins, dtype=np.int64),
        np.array(ends, dtype=np.int64),
        np.array(times, dtype=np.float64),
    )
    return datagrams, gaps, (_HEAD + len(_FOOTER)) * len(begins), cut


def _envelope_end(raw: bytes, at: int) -> int:
    """Return the end of the envelope that begins here, 0 for none."""
    octets = int.from_bytes(raw[at : at + 2], "big")
    end = at + octets
    if octets < _HEAD + len(_FOOTER) or raw[end - len(_FOOTER) : end] != _FOOTER:
        return 0
    # A wrong length may reach a later footer: then there are envelopes inside.
    inner = raw.find(_FOOTER, at + _HEAD, end - len(_FOOTER))
    while inner >= 0:
        after = inner + len(_FOOTER)
        following = int.from_bytes(raw[after : after + 2], "big")
        if (
            _HEAD + len(_FOOTER) <= following <= end - after
            and raw[after + following - len(_FOOTER) : after + following] == _FOOTER
        ):
            return 0
        inner = raw.find(_FOOTER, inner + 1, end - len(_FOOTER))
    return end


def _next_envelope(raw: bytes, at: int) -> int:
    """Return the start of the next envelope without a footer inside, -1 for none."""
    footer = raw.find(_FOOTER, at)
    while footer >= 0:
        end = footer + len(_FOOTER)
        # The last octets of a block may be equal to those of the footer.
        while raw[end : end + 1] == _FOOTER[:1]:
            end += 1
        for place in range(at, end - len(_FOOTER) - _HEAD + 1):
            if int.from_bytes(raw[place : place + 2], "big") == end - place:
                return place
        at = max(at, end - len(_FOOTER) + 1)
        footer = raw.find(_FOOTER, end)
    return -1


def _cut(raw: bytes, gaps: list[tuple[int, int, str]]) -> int:
    """Return the length of the truncated envelope at the end of a file, 0 for none."""
    if not gaps or sum(gaps[-1][:2]) < len(raw):
        return 0
    at, there, _ = gaps[-1]
    if there == 1:
        return _HEAD
    octets = int.from_bytes(raw[at : at + 2], "big")
    return octets if octets > max(there, _HEAD) else 0
