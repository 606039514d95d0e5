"""The files that hold ASTERIX: what is a block in them, and what is framing.

==================  =============================================================================
`.ast` `.raw` …     blocks one after another
`.gps`              a header of 2 200 octets (0xCD), then blocks, each followed by ten octets, of
                    which the 7th to the 9th are the time of day of its reception in 1/128 s
`.pcap` `.pcapng`   packets; see `capture`
==================  =============================================================================

The first octets of a file tell which it is. A block is a category (one octet), its length with
these three octets (two octets, high one first) and records.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix import _kernels, capture
from multiradar_converters.asterix.program import catalogue
from multiradar_converters.errors import LayoutError

_HEADER = 2200
_HEADER_OCTET = 0xCD
_TRAILER = 10
_RECEPTION = slice(6, 9)
_TICKS_PER_S = 128.0
_BLOCKS_AT_ONCE = 1 << 12


@dataclass(frozen=True)
class Blocks:
    """The blocks of a file.

    Attributes
    ----------
    file : str
        Its name.
    size : int
        Its size, octets.
    form : str
        blocks, gps or capture.
    data : uint8[b]
        The octets; after those of the file, payloads put together from fragments.
    begins, ends : int64[n]
        Where each block begins and ends in `data`.
    offsets : int64[n]
        Where it begins in the file.
    received_s : float64[n]
        When it was received, s of day or Unix time; NaN if that is not recorded.
    gaps : list of (offset, octets, reason)
        Octets that are no block.
    framing : int
        Octets that belong to the form of the file.
    """

    file: str
    size: int
    form: str
    data: NDArray[np.uint8]
    begins: NDArray[np.int64]
    ends: NDArray[np.int64]
    offsets: NDArray[np.int64]
    received_s: NDArray[np.float64]
    gaps: list[tuple[int, int, str]]
    framing: int


def read_blocks(path: Path) -> Blocks:
    """Cut a file into blocks.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    Blocks
        Its blocks, and what is none.

    Raises
    ------
    LayoutError
        The file cannot be read, or is a capture of a kind that is not known.
    """
    try:
        data = np.fromfile(path, dtype=np.uint8)
    except OSError as error:
        msg = f"{path}: cannot be read: {error.strerror}"
        raise LayoutError(msg) from error
    if capture.is_capture(data):
        return _from_capture(path, data)
    if _is_gps(path, data):
        begins, ends, gaps = split(data, _HEADER, _TRAILER)
        trailers = ends[:, None] + np.arange(_TRAILER)[_RECEPTION]
        received = data[trailers].astype(np.int64) @ np.array([1 << 16, 1 << 8, 1]) / _TICKS_PER_S
        framing = _HEADER + _TRAILER * len(begins)
        return Blocks(
            path.name, len(data), "gps", data, begins, ends, begins, received, gaps, framing
        )
    begins, ends, gaps = split(data, 0, 0)
    received = np.full(len(begins), np.nan)
    return Blocks(path.name, len(data), "blocks", data, begins, ends, begins, received, gaps, 0)


def _is_gps(path: Path, data: NDArray[np.uint8]) -> bool:
    """Tell whether a file has the header; if only its name says so, whether that explains more."""
    if len(data) < _HEADER:
        return False
    if bool((data[:_HEADER] == _HEADER_OCTET).all()):
        return True
    if path.suffix.lower() != ".gps":
        return False
    as_gps, as_blocks = (split(data, *form)[2] for form in ((_HEADER, _TRAILER), (0, 0)))
    return sum(octets for _, octets, _ in as_gps) < sum(octets for _, octets, _ in as_blocks)


def split(
    data: NDArray[np.uint8], at: int, trailer: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], list[tuple[int, int, str]]]:
    """Cut octets into blocks.

    Parameters
    ----------
    data : uint8[b]
        The octets.
    at : int
        Where the first block begins.
    trailer : int
        Octets after each block that do not belong to it.

    Returns
    -------
    begins, ends : int64[n]
        The blocks.
    gaps : list of (offset, octets, reason)
        Octets that are no block.
    """
    blocks = np.empty((_BLOCKS_AT_ONCE, 2), dtype=np.int64)
    holes = np.empty((_BLOCKS_AT_ONCE, 2), dtype=np.int64)
    known = catalogue()
    starts = np.empty(known.nodes_max, dtype=np.int32)
    found, gaps = [], []
    while at < len(data):
        count, gap_count, at = _kernels.split_blocks(
            data,
            at,
            trailer,
            known.nodes,
            known.profiles,
            known.layouts,
            known.categories,
            starts,
            blocks,
            holes,
        )
        found.append(blocks[:count].copy())
        gaps += [(int(a), int(b - a), "no block begins here") for a, b in holes[:gap_count]]
    cut = np.concatenate(found) if found else np.empty((0, 2), dtype=np.int64)
    return np.ascontiguousarray(cut[:, 0]), np.ascontiguousarray(cut[:, 1]), gaps


def _from_capture(path: Path, data: NDArray[np.uint8]) -> Blocks:
    payloads, gaps, framing = capture.payloads(data, path.name)
    extra = b"".join(payload.joined for payload in payloads)
    whole = np.concatenate([data, np.frombuffer(extra, dtype=np.uint8)]) if extra else data
    begins, ends, offsets, received = [], [], [], []
    appended = len(data)
    for payload in payloads:
        at = appended if payload.joined else payload.offset
        appended += len(payload.joined)
        part_begins, part_ends, part_gaps = split(whole[at : at + payload.octets], 0, 0)
        begins.append(part_begins + at)
        ends.append(part_ends + at)
        offsets.append(part_begins + payload.offset)
        received.append(np.full(len(part_begins), payload.received_s))
        gaps += [(payload.offset + a, n, reason) for a, n, reason in part_gaps]
    empty = [np.empty(0, dtype=np.int64)]
    return Blocks(
        file=path.name,
        size=len(data),
        form="capture",
        data=whole,
        begins=np.concatenate(begins or empty),
        ends=np.concatenate(ends or empty),
        offsets=np.concatenate(offsets or empty),
        received_s=np.concatenate(received) if received else np.empty(0),
        gaps=gaps,
        framing=framing,
    )
