"""Target reports as the figures of sensors use them, whatever the form of the recording."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.aircraft_data.quantities import joined as concatenated
from multiradar_converters.aircraft_data.quantities import without

Numbers = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Reports:
    """Target reports, a row per report.

    Attributes
    ----------
    time_s, range_m, azimuth_deg, latitude_deg, longitude_deg, height_m : float64[n]
        NaN where absent.
    code, address : int64[n]
        Mode 3/A code and Mode S address; -1 where absent.
    on_ground : bool[n]
        Whether the report says so.
    aircraft_data : float64[n, 10] or float64[n, 0]
        Aircraft-derived data, see `quantities`.
    dropped : int64[n]
        Reasons for which some of them were dropped, bits.
    """

    time_s: Numbers
    range_m: Numbers
    azimuth_deg: Numbers
    latitude_deg: Numbers
    longitude_deg: Numbers
    height_m: Numbers
    code: Integers
    address: Integers
    on_ground: Flags
    aircraft_data: Numbers
    dropped: Integers

    def __len__(self) -> int:
        return len(self.time_s)

    def select(self, own: Flags | Integers) -> "Reports":
        """Return some of the reports."""
        return Reports(**{one.name: getattr(self, one.name)[own] for one in fields(Reports)})


def joined(parts: list[Reports]) -> Reports:
    """Return the reports of all parts."""
    if not parts:
        number, whole = np.empty(0), np.empty(0, np.int64)
        return Reports(
            *(number, number, number, number, number, number),
            *(whole, whole),
            np.empty(0, np.bool_),
            without(0),
            whole,
        )
    return Reports(
        **{
            one.name: concatenated([getattr(part, one.name) for part in parts])
            for one in fields(Reports)
        }
    )
