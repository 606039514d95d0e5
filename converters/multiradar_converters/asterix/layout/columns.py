"""Fields of many records at once."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.layout import _kernels
from multiradar_converters.asterix.layout.program import Walked

Integers = NDArray[np.int64]
Numbers = NDArray[np.float64]
Flags = NDArray[np.bool_]

_VALUE = "VALUE"


@dataclass(frozen=True)
class Columns:
    """Reads fields of parsed records.

    Attributes
    ----------
    walked : Walked
        The records.
    data : uint8[b]
        Their octets.
    with_aircraft_data : bool
        Whether aircraft-derived data are wanted.
    """

    walked: Walked
    data: NDArray[np.uint8]
    with_aircraft_data: bool = True

    def __len__(self) -> int:
        return len(self.walked.records)

    def has(self, node: str) -> bool:
        """Return whether the edition has an item, part or sub-item."""
        return node in self.walked.program.places

    def present(self, node: str) -> Flags:
        """Return which records have a node, bool[n]."""
        if not self.has(node):
            return np.zeros(len(self), dtype=np.bool_)
        present: Flags = np.zeros(len(self), dtype=np.bool_)
        present[:] = self.walked.starts[:, self.walked.program.places[node]] >= 0
        return present

    def integers(self, node: str, field: str = _VALUE, absent: int = -1) -> Integers:
        """Read a field as raw integers, int64[n]; `absent` if missing."""
        out = np.full(len(self), absent, dtype=np.int64)
        described = self.walked.program.fields.get((node, field))
        if described is None:
            return out
        places = np.ascontiguousarray(self.walked.starts[:, self.walked.program.places[node]])
        _kernels.read_bits(
            self.data,
            places,
            described.begin,
            described.bits,
            described.form == "signed",
            absent,
            out,
        )
        return out

    def flags(self, node: str, field: str) -> Flags:
        """Return where a bit is set, bool[n]."""
        return np.asarray(self.integers(node, field, 0) == 1, dtype=np.bool_)

    def numbers(self, node: str, field: str = _VALUE) -> Numbers:
        """Read a field in its unit, float64[n]; NaN if absent."""
        described = self.walked.program.fields.get((node, field))
        if described is None:
            return np.full(len(self), np.nan)
        values = self.integers(node, field, 0) * described.numerator / described.denominator
        return np.where(self.present(node), values, np.nan)
