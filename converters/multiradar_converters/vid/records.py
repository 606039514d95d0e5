"""Records between passes: rows of int64 words; word 0 has the bits of the time.

======== ===== =====================================================================
record   words content (f: bits of a float64)
======== ===== =====================================================================
plot     7     f time, f range, f azimuth, f lat, f lon, f height, identity
report   6     f time, f lat, f lon, f height, address, aircraft
naming   3     f time, identity (of the plot that a track row references), aircraft
point    5     f time, f lat, f lon, f height, aircraft and file
======== ===== =====================================================================

Identity packs the number of the sensor (16 bits), the plot number (31) and the code + 1 (13).
"Aircraft and file" packs the track number (31 bits) above the number of the file (32).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

PLOT_WORDS, REPORT_WORDS, NAMING_WORDS, POINT_WORDS = 7, 6, 3, 5

Records = NDArray[np.int64]
Column = NDArray[np.float64]

_CODE_BITS = 13
_PLOT_BITS = 31
_FILE_BITS = 32

#: Maximum number of sensors that fits an identity.
SENSORS_MAX = 1 << 15


def times(records: Records) -> Column:
    """Return the times of records, s, as a view."""
    return decimal(records, 0)


def decimal(records: Records, word: int) -> Column:
    """Return a word as float64, as a view."""
    return records.view(np.float64)[:, word]


def pack_identity(
    sensor: NDArray[np.int64], plot: NDArray[np.int64], code: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Pack sensor, plot number and code (-1: none) into one word."""
    return (((sensor << _PLOT_BITS) | plot) << _CODE_BITS) | (code + 1)


def sensor_of(identity: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the number of the sensor."""
    return identity >> (_PLOT_BITS + _CODE_BITS)


def plot_of(identity: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the plot number."""
    return (identity >> _CODE_BITS) & ((1 << _PLOT_BITS) - 1)


def code_of(identity: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the code, -1 for none."""
    return (identity & ((1 << _CODE_BITS) - 1)) - 1


def pack_track(aircraft: NDArray[np.int64], file: NDArray[np.int64] | int) -> NDArray[np.int64]:
    """Pack the track number of an aircraft and the number of a file into one word."""
    return (aircraft << _FILE_BITS) | file


def aircraft_of(track: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the track number of the aircraft."""
    return track >> _FILE_BITS


def split_track(track: int) -> tuple[int, int]:
    """Return the track number of the aircraft and the number of the file."""
    return track >> _FILE_BITS, track & ((1 << _FILE_BITS) - 1)


def points(columns: Sequence[Column], track: NDArray[np.int64]) -> Records:
    """Return records of points.

    Parameters
    ----------
    columns : four float64[n]
        Time (s), latitude, longitude (degrees), height (m, NaN: none).
    track : int64[n]
        Aircraft and file, packed.

    Returns
    -------
    int64[n, 5]
        The records.
    """
    out = np.empty((len(track), POINT_WORDS), dtype=np.int64)
    bits = out.view(np.float64)
    for word, column in enumerate(columns):
        bits[:, word] = column
    out[:, 4] = track
    return out
