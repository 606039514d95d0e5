"""Octets before or after the blocks of each datagram: framing of a network, not data.

Some networks precede the blocks of every datagram by a header, or append a footer: counters, times,
checks. Their lengths are learnt from the datagrams themselves: those of which the blocks of known
categories, chained by their lengths, leave the same number of octets at the start and the end.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.framing import _datagram_kernels
from multiradar_converters.asterix.layout.program import catalogue

#: Maximum octets of a header and of a footer.
HEADER_MAX, FOOTER_MAX = 32, 32
#: A header and footer are accepted from so many datagrams on ...
AGREED_MIN = 5
#: ... that are at least this fraction of those that are not blocks alone: damaged ones differ.
AGREED_FRACTION = 0.2
# Votes are halved beyond this number, so that a change is recognised.
_VOTES_MAX = 4096
_NONE = -1

Lengths = NDArray[np.int64]


@dataclass(frozen=True)
class Framing:
    """Octets of header and footer of each datagram, int64[n]; 0 for none."""

    header: Lengths
    footer: Lengths

    @property
    def octets(self) -> Lengths:
        """Octets of both of each datagram, int64[n]."""
        return self.header + self.footer


class LearntFraming:
    """Headers and footers of datagrams so far; owned by one thread.

    Parameters
    ----------
    skipped : tuple of int
        Categories without a layout whose blocks are known, too.
    """

    def __init__(self, skipped: tuple[int, ...]) -> None:
        self._known = catalogue().categories[:, 1] > 0
        self._known[list(skipped)] = True
        self._votes: Counter[tuple[int, int]] = Counter()

    def next(self, data: NDArray[np.uint8], begins: Lengths, ends: Lengths) -> Framing:
        """Return the framing of the next datagrams, each by those up to it alone.

        Parameters
        ----------
        data : uint8[b]
            The octets.
        begins, ends : int64[n]
            The datagrams.

        Returns
        -------
        Framing
            Nothing of datagrams that consist of blocks alone, or whose rest is of no known length.
        """
        return self._framing(data, begins, ends, ahead=False)

    def of_all(self, data: NDArray[np.uint8], begins: Lengths, ends: Lengths) -> Framing:
        """Return the framing of the datagrams of a recording, each by all of them."""
        self._framing(data, begins, ends, ahead=False)
        return self._framing(data, begins, ends, ahead=True)

    def _framing(
        self, data: NDArray[np.uint8], begins: Lengths, ends: Lengths, *, ahead: bool
    ) -> Framing:
        found = np.zeros((len(begins), 2), dtype=np.int64)
        _datagram_kernels.find_framing(
            data, begins, ends, self._known, HEADER_MAX, FOOTER_MAX, found
        )
        for place in np.flatnonzero(found.any(axis=1)).tolist():
            header, footer = found[place].tolist()
            if not ahead:
                self._votes[header, footer] += 1
                if self._votes.total() > _VOTES_MAX:
                    self._votes = Counter({pair: n // 2 for pair, n in self._votes.items()})
            # Not only its own: the first octets of a footer may look like those of a block.
            found[place] = next(
                (
                    pair
                    for pair in self._agreed()
                    if _datagram_kernels.has_framing(
                        data, begins[place], ends[place], self._known, *pair
                    )
                ),
                (0, 0),
            )
        return Framing(found[:, 0], found[:, 1])

    def _agreed(self) -> list[tuple[int, int]]:
        least = max(AGREED_MIN, AGREED_FRACTION * self._votes.total())
        return [
            pair for pair, votes in self._votes.most_common() if votes >= least and pair[0] != _NONE
        ]
