"""OziExplorer track files, version 2.1: what `.plt` files hold.

Latin-1 text, lines end in CR LF::

    OziExplorer Track Point File Version 2.1
    WGS 84
    Altitude is in Feet
    Reserved 3
    0,width,colour (BGR integer),name without commas,skip,type,fill style,fill colour
    number of points
    latitude,longitude,code,altitude,days, date, time       (a line for each point)

Code 1 starts a new segment, 0 goes on. Altitude in feet, -777 where there is none. Days are
counted from 1899-12-30 (25569 = 1970-01-01). Date and time texts are for people: `01-Aug-18`,
`08:00:00`, English whatever the locale.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar_converters import _kernels

#: No point line is longer: two padded degrees, code, altitude, days, date, time, separators.
LINE_BYTES_MAX = 112

#: A pause longer than this starts a new segment.
SEGMENT_GAP_S = 600.0

#: Colours of lines, as BGR integers: red, blue, green.
COLOURS = {"ads": 0x0000FF, "mr": 0xFF0000, "r": 0x008000}


def format_header(name: str, points: int, colour: int = 0x0000FF) -> bytes:
    """Write the six lines before the points.

    Parameters
    ----------
    name : str
        Name of the track; commas become blanks, what Latin-1 lacks a question mark.
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
    """Write points as lines.

    Parameters
    ----------
    points : float64[n, 4]
        Time (s), latitude and longitude (degrees WGS 84), height (m, NaN where there is none);
        further columns are ignored.
    unix_start_s : float
        What added to a time makes it Unix time, s.
    before_s : float
        Unix time of the point before the first of these; NaN when there is none, which starts a
        segment.

    Returns
    -------
    bytes
        `n` lines.
    """
    out = np.empty(len(points) * LINE_BYTES_MAX, dtype=np.uint8)
    size = _kernels.plt_lines(points, unix_start_s, before_s, SEGMENT_GAP_S, out)
    return out[:size].tobytes()
