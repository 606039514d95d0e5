"""OziExplorer track files (`.plt`), version 2.1.

Latin-1 text with CR LF line ends::

    OziExplorer Track Point File Version 2.1
    WGS 84
    Altitude is in Feet
    Reserved 3
    0,width,colour (BGR integer),name without commas,skip,type,fill style,fill colour
    number of points
    latitude,longitude,code,altitude,days, date, time       (a line for each point)

Code 1 starts a new segment, 0 continues it. Altitude in feet, -777 if absent. Days are counted from
1899-12-30 (25569 = 1970-01-01). Date and time are also written as text, in English: `01-Aug-18`,
`08:00:00`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar_converters import _kernels

#: Maximum length of a point line: two padded degrees, code, altitude, days, date, time, separators.
LINE_BYTES_MAX = 112

#: A gap longer than this starts a new segment, s.
SEGMENT_GAP_S = 600.0

#: Colours of lines, as BGR integers: red, blue, green.
COLOURS = {"ads": 0x0000FF, "mr": 0xFF0000, "r": 0x008000}


def format_header(name: str, points: int, colour: int = 0x0000FF) -> bytes:
    """Format the six header lines.

    Parameters
    ----------
    name : str
        Name of the track; commas become blanks, characters not in Latin-1 question marks.
    points : int
        Number of points.
    colour : int
        Colour of the line, BGR.

    Returns
    -------
    bytes
        The lines.
    """
    lines = (
        "OziExplorer Track Point File Version 2.1",
        "WGS 84",
        "Altitude is in Feet",
        "Reserved 3",
        f"0,2,{colour},{' '.join(name.replace(',', ' ').split())},0,0,2,8421376",
        f"{points}",
        "",
    )
    return "\r\n".join(lines).encode("latin-1", errors="replace")


def format_points(
    points: NDArray[np.float64], unix_start_s: float = 0.0, before_s: float = math.nan
) -> bytes:
    """Format points as lines.

    Parameters
    ----------
    points : float64[n, 4]
        Time (s), latitude and longitude (degrees WGS 84), height (m, NaN if absent);
        further columns are ignored.
    unix_start_s : float
        Added to times to give Unix time, s.
    before_s : float
        Unix time of the previous point; NaN if there is none, which starts a segment.

    Returns
    -------
    bytes
        `n` lines.
    """
    out = np.empty(len(points) * LINE_BYTES_MAX, dtype=np.uint8)
    size = _kernels.plt_lines(points, unix_start_s, before_s, SEGMENT_GAP_S, out)
    return out[:size].tobytes()
