"""ASTERIX file formats: blocks and framing.

==================  =============================================================================
`.ast` `.raw` …     concatenated blocks
`.gps`              a header of 2 200 octets (0xCD), then blocks, each followed by ten octets, of
                    which the 7th to the 9th are the time of day of its reception in 1/128 s; some
                    tools remove the header
`.pcap` `.pcapng`   packets; see `capture`
`.rply`             datagrams with the time between them; see `replay_file`
`.ff` `.astfin`     datagrams in envelopes with their time of day; see `final_format`
==================  =============================================================================

The format is detected from the first octets. A block is a category (one octet), its length
including these three octets (two octets, big-endian) and records.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.framing import capture
from multiradar_converters.asterix.framing.damage import damage_of
from multiradar_converters.asterix.framing.datagram_framing import LearntFraming
from multiradar_converters.asterix.framing.datagrams import (
    NO_BLOCK,
    CutDatagrams,
    Datagrams,
    split_datagrams,
)
from multiradar_converters.asterix.framing.final_format import (
    is_final_format,
    read_final_format,
)
from multiradar_converters.asterix.framing.replay_file import is_replay_file, read_replay_file
from multiradar_converters.asterix.layout import _block_kernels
from multiradar_converters.asterix.layout.program import catalogue
from multiradar_converters.errors import LayoutError

#: Octets of the header of a `.gps` recording, and of the trailer of each of its blocks.
GPS_HEADER, GPS_TRAILER = 2200, 10
_HEADER_OCTET = 0xCD
_RECEPTION = slice(6, 9)
_TICKS_PER_S = 128.0
_BLOCKS_AT_ONCE = 1 << 12
#: Octets of the category and length of a block.
HEAD = 3
#: Reason of gaps of so many zeros at most, which some recorders add to blocks; more are damage.
PADDING, PADDING_MAX = "padding", 32


#: Categories of ARTAS user messages (031: sensors) without a table; none contains measurements.
#: Their blocks are counted and skipped.
SKIPPED = (31,)

#: Forms of recordings. The datagrams of `FINAL_FORMAT` are in envelopes, see `final_format`.
BLOCKS, GPS, CAPTURE, REPLAY_FILE, FINAL_FORMAT = "blocks", "gps", "capture", "rply", "final"
GPS_BARE = "gps without header"
#: Octets of the header by form, of files whose blocks have a trailer.
GPS_HEADERS = {GPS: GPS_HEADER, GPS_BARE: 0}


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
        blocks, gps, gps without header, capture, rply or final.
    data : uint8[b]
        The octets of the file, followed by reassembled payloads.
    begins, ends : int64[n]
        Begin and end of each block in `data`.
    offsets : int64[n]
        Offset of each block in the file.
    received_s : float64[n]
        Time of reception, s of day or Unix time; NaN if not recorded.
    gaps : list of (offset, octets, reason)
        Octets outside blocks; `PADDING` counts as framing where they are decoded.
    framing : int
        Octets of the file format.
    cut : int
        Length of the truncated block, or envelope of Final format, at the end of the file, of which
        the gap at the end is the present part; 0 for none. A length of which an octet is missing
        counts as `HEAD`.
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
    cut: int = 0


def read_blocks(path: Path) -> Blocks:
    """Split a file into blocks.

    Returns
    -------
    Blocks
        Its blocks and gaps.

    Raises
    ------
    LayoutError
        The file cannot be read, is compressed, or is a capture of unknown type.
    """
    return _read(path)[0]


def read_datagrams(path: Path) -> tuple[Blocks, Datagrams]:
    """Read a recording, and its datagrams for replay.

    Returns
    -------
    Blocks
        As `read_blocks`.
    Datagrams
        The recorded datagrams; in other recordings each block is one. Times are those of the
        recorder; NaN if absent.

    Raises
    ------
    LayoutError
        The file cannot be read, is compressed, or is a capture of unknown type.
    """
    blocks, datagrams = _read(path)
    if datagrams is None:
        datagrams = Datagrams(blocks.data, blocks.begins, blocks.ends, blocks.received_s)
    return blocks, datagrams


def _read(path: Path) -> tuple[Blocks, Datagrams | None]:
    """Return the blocks, and the recorded datagrams, if any."""
    data = read_octets(path)
    return split_octets(path, data, form_of(path, data))


def form_of(path: Path, data: NDArray[np.uint8]) -> str:
    """Return the form of a file.

    Parameters
    ----------
    path : Path
        The file; only its suffix is used.
    data : uint8[b]
        Its octets, or the first of them.

    Returns
    -------
    str
        As `Blocks.form`.
    """
    if capture.is_capture(data):
        return CAPTURE
    # First: its headers may look like those of a replay file.
    if is_final_format(data):
        return FINAL_FORMAT
    if is_replay_file(data):
        return REPLAY_FILE
    return _form_by_blocks(path, data)


def split_octets(path: Path, data: NDArray[np.uint8], form: str) -> tuple[Blocks, Datagrams | None]:
    """Split octets of a file into blocks.

    Parameters
    ----------
    path : Path
        The file; only its name is used.
    data : uint8[b]
        Its octets.
    form : str
        Its form, see `form_of`.

    Returns
    -------
    Blocks
        Its blocks and gaps.
    Datagrams or None
        The recorded datagrams, if any.
    """
    if form == CAPTURE:
        return _from_capture(path, data)
    if form == FINAL_FORMAT:
        return _from_final_format(path, data)
    if form == REPLAY_FILE:
        return _from_replay_file(path, data)
    return _without_datagrams(path, data, form), None


def _without_datagrams(path: Path, data: NDArray[np.uint8], form: str) -> Blocks:
    if form in GPS_HEADERS:
        begins, ends, gaps = split(data, GPS_HEADERS[form], GPS_TRAILER)
        trailers = ends[:, None] + np.arange(GPS_TRAILER)[_RECEPTION]
        received = data[trailers].astype(np.int64) @ np.array([1 << 16, 1 << 8, 1]) / _TICKS_PER_S
        framing = GPS_HEADERS[form] + GPS_TRAILER * len(begins)
        cut = _cut(data, begins, gaps, GPS_TRAILER)
        return Blocks(
            path.name, len(data), form, data, begins, ends, begins, received, gaps, framing, cut
        )
    begins, ends, gaps = split(data, 0, 0)
    received = np.full(len(begins), np.nan)
    cut = _cut(data, begins, gaps)
    return Blocks(path.name, len(data), form, data, begins, ends, begins, received, gaps, 0, cut)


def _cut(
    data: NDArray[np.uint8],
    begins: NDArray[np.int64],
    gaps: list[tuple[int, int, str]],
    trailer: int = 0,
) -> int:
    """Return the length of the truncated block and trailer at the end of a file, 0 for none."""
    if not gaps or gaps[-1][0] + gaps[-1][1] < len(data):
        return 0
    at, there, _ = gaps[-1]
    # Other octets at the end, such as padding, rarely match a category of the file.
    if data[at] not in data[begins]:
        return 0
    if there < HEAD:
        longest = int(data[begins + 1].max())
        return HEAD if there == 1 or data[at + 1] <= longest else 0
    length = int(data[at + 1]) << 8 | int(data[at + 2])
    whole = length if length > there else length + trailer
    return whole if whole > there else 0


def read_octets(path: Path, offset: int = 0, count: int = -1) -> NDArray[np.uint8]:
    """Read octets of a file.

    Parameters
    ----------
    path : Path
        The file.
    offset : int
        First octet.
    count : int
        Maximum number of octets; -1: all.

    Returns
    -------
    uint8[b]
        The octets.

    Raises
    ------
    LayoutError
        The file cannot be read or is compressed.
    """
    if path.exists() and not path.is_file():
        what = "a folder; specify the files in it" if path.is_dir() else "a special file"
        msg = f"{path}: expected a file, was {what}"
        raise LayoutError(msg)
    try:
        data = np.fromfile(path, dtype=np.uint8, offset=offset, count=count)
    except OSError as error:
        msg = f"{path}: cannot be read: {error.strerror}"
        raise LayoutError(msg) from error
    damage = "" if offset else damage_of(data)
    if damage:
        msg = f"{path}: expected ASTERIX blocks, found {damage}"
        raise LayoutError(msg)
    return data


# GPS by the header, or by the name where that fits better, with a header of other octets or none.
def _form_by_blocks(path: Path, data: NDArray[np.uint8]) -> str:
    if len(data) >= GPS_HEADER and bool((data[:GPS_HEADER] == _HEADER_OCTET).all()):
        return GPS
    if path.suffix.lower() != ".gps":
        return BLOCKS
    forms = {BLOCKS: (0, 0), GPS: (GPS_HEADER, GPS_TRAILER), GPS_BARE: (0, GPS_TRAILER)}
    # A header counts as octets that do not fit: it is one only if the blocks do not begin before.
    unread = {
        form: header + sum(octets for _, octets, _ in split(data, header, trailer)[2])
        for form, (header, trailer) in forms.items()
        if len(data) >= header
    }
    return min(unread, key=lambda form: unread[form])


def split(
    data: NDArray[np.uint8], at: int, trailer: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], list[tuple[int, int, str]]]:
    """Split octets into blocks.

    Parameters
    ----------
    data : uint8[b]
        The octets.
    at : int
        Begin of the first block.
    trailer : int
        Trailer octets after each block.

    Returns
    -------
    begins, ends : int64[n]
        The blocks.
    gaps : list of (offset, octets, reason)
        Octets outside blocks.
    """
    blocks = np.empty((_BLOCKS_AT_ONCE, 2), dtype=np.int64)
    holes = np.empty((_BLOCKS_AT_ONCE, 2), dtype=np.int64)
    known = catalogue()
    starts = np.empty(known.nodes_max, dtype=np.int32)
    found, gaps = [], []
    while at < len(data):
        count, gap_count, at = _block_kernels.split_blocks(
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
        gaps += [(a, b - a, _reason(data[a:b])) for a, b in holes[:gap_count].tolist()]
    cut = np.concatenate(found) if found else np.empty((0, 2), dtype=np.int64)
    return np.ascontiguousarray(cut[:, 0]), np.ascontiguousarray(cut[:, 1]), gaps


def _reason(octets: NDArray[np.uint8]) -> str:
    padding = len(octets) <= PADDING_MAX and not octets.any()
    return PADDING if padding else NO_BLOCK


def blocks_of_datagrams(
    datagrams: Datagrams,
    offsets: NDArray[np.int64],
    file: str = "",
    form: str = "datagrams",
    learnt: LearntFraming | None = None,
) -> tuple[Blocks, CutDatagrams]:
    """Split datagrams into blocks.

    Parameters
    ----------
    datagrams : Datagrams
        The datagrams.
    offsets : int64[n]
        Offset of each in its file.
    file, form : str
        Name and form of that file.
    learnt : LearntFraming, optional
        Headers and footers of earlier datagrams, for live input; updated.

    Returns
    -------
    blocks : Blocks
        Their blocks, as if the datagrams were the whole file.
    cut : CutDatagrams
        The datagram of each block.
    """
    learn = LearntFraming(SKIPPED).of_all if learnt is None else learnt.next
    around = learn(datagrams.data, datagrams.begins, datagrams.ends)
    cut = split_datagrams(
        replace(
            datagrams,
            begins=datagrams.begins + around.header,
            ends=datagrams.ends - around.footer,
        ),
        around.octets,
    )
    moved = offsets - datagrams.begins
    gaps = [
        (begin + int(moved[datagram]), end - begin, NO_BLOCK)
        for begin, end, datagram in cut.gaps.tolist()
    ]
    blocks = Blocks(
        file=file,
        size=int((datagrams.ends - datagrams.begins).sum()),
        form=form,
        data=datagrams.data,
        begins=cut.begins,
        ends=cut.ends,
        offsets=cut.begins + moved[cut.datagram],
        received_s=datagrams.received_s[cut.datagram],
        gaps=gaps,
        framing=int(around.octets.sum()),
    )
    return blocks, cut


def _from_capture(path: Path, data: NDArray[np.uint8]) -> tuple[Blocks, Datagrams]:
    datagrams, offsets, gaps, framing = capture.datagrams(data, path.name)
    blocks, _cut = blocks_of_datagrams(datagrams, offsets, path.name, CAPTURE)
    blocks = replace(
        blocks,
        size=len(data),
        gaps=gaps + blocks.gaps,
        framing=framing + blocks.framing,
    )
    return blocks, datagrams


def _from_replay_file(path: Path, data: NDArray[np.uint8]) -> tuple[Blocks, Datagrams]:
    datagrams, gaps, framing, cut = read_replay_file(data)
    blocks, _cut = blocks_of_datagrams(datagrams, datagrams.begins, path.name, REPLAY_FILE)
    blocks = replace(
        blocks,
        size=len(data),
        # It has the intervals between datagrams, not their times.
        received_s=np.full(len(blocks.begins), np.nan),
        gaps=sorted(gaps + blocks.gaps),
        framing=framing + blocks.framing,
        cut=cut,
    )
    return blocks, datagrams


def _from_final_format(path: Path, data: NDArray[np.uint8]) -> tuple[Blocks, Datagrams]:
    datagrams, gaps, framing, cut = read_final_format(data)
    blocks, _cut = blocks_of_datagrams(datagrams, datagrams.begins, path.name, FINAL_FORMAT)
    blocks = replace(
        blocks,
        size=len(data),
        gaps=sorted(gaps + blocks.gaps),
        framing=framing + blocks.framing,
        cut=cut,
    )
    return blocks, datagrams
