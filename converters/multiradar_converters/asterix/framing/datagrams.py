"""Datagrams with several blocks each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.framing import _datagram_kernels
from multiradar_converters.asterix.layout.program import catalogue

#: Capacity for blocks and gaps; the largest datagram (65 507 octets over IPv4) has fewer. A
#: datagram reassembled from a damaged capture may be larger and gets more.
_NOTED = 1 << 15

NO_BLOCK = "there is no block at this position"


@dataclass(frozen=True)
class Datagrams:
    """Datagrams in the order of their reception.

    Attributes
    ----------
    data : uint8[b]
        The octets.
    begins, ends : int64[n]
        Begin and end of each in `data`.
    received_s : float64[n]
        Time of reception, s: Unix time, time of day, or since the first; NaN if unknown.
    """

    data: NDArray[np.uint8]
    begins: NDArray[np.int64]
    ends: NDArray[np.int64]
    received_s: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.begins)


@dataclass(frozen=True)
class CutDatagrams:
    """The blocks of datagrams.

    Attributes
    ----------
    begins, ends, datagram : int64[n]
        Begin and end of each block in the data, and its datagram.
    gaps : int64[m, 3]
        Begin, end and datagram of octets outside blocks.
    framing : int64[k]
        Octets of header and footer of each datagram.
    """

    begins: NDArray[np.int64]
    ends: NDArray[np.int64]
    datagram: NDArray[np.int64]
    gaps: NDArray[np.int64]
    framing: NDArray[np.int64]


def split_datagrams(datagrams: Datagrams, framing: NDArray[np.int64] | None = None) -> CutDatagrams:
    """Split datagrams into blocks, each datagram separately.

    Parameters
    ----------
    datagrams : Datagrams
        The datagrams without headers and footers.
    framing : int64[n], optional
        Octets of these; 0 without it.

    Returns
    -------
    CutDatagrams
        Every octet is in a block or in a gap.
    """
    around = np.zeros(len(datagrams), np.int64) if framing is None else framing
    known = catalogue()
    starts = np.empty(known.nodes_max, dtype=np.int32)
    largest = int((datagrams.ends - datagrams.begins).max(initial=0))
    # A block has at least four octets, and between gaps there are blocks.
    noted = max(_NOTED, largest)
    blocks = np.empty((noted, 3), dtype=np.int64)
    holes = np.empty((noted, 3), dtype=np.int64)
    found, gaps = [np.empty((0, 3), np.int64)], [np.empty((0, 3), np.int64)]
    done = 0
    while done < len(datagrams):
        passed, count, gap_count = _datagram_kernels.split_datagrams(
            datagrams.data,
            datagrams.begins[done:],
            datagrams.ends[done:],
            known.nodes,
            known.profiles,
            known.layouts,
            known.categories,
            starts,
            blocks,
            holes,
        )
        step = np.array([0, 0, done])
        found.append(blocks[:count] + step)
        gaps.append(holes[:gap_count] + step)
        done += passed
    cut = np.concatenate(found)
    begins, ends, datagram = (np.ascontiguousarray(column) for column in cut.T)
    return CutDatagrams(begins, ends, datagram, np.concatenate(gaps), around)
