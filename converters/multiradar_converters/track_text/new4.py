"""`.new4` files: a measurement per line, four columns separated by tabs (IMM UrO RAN report, 2.6).

::

    time<TAB>latitude<TAB>longitude<TAB>height<LF>

Time in seconds (of day, continued past midnight, or since the Unix epoch, as in the recording),
latitude and longitude in degrees WGS 84, height in metres, empty if absent. Decimals without
trailing zeros: 3 to 6 in time, 7 to 9 in degrees, 1 to 3 in height.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from multiradar_converters import _kernels
from multiradar_converters.errors import LayoutError

#: Maximum length of a line: sign, digits, point, decimals and separator of each of four columns.
LINE_BYTES_MAX = 112

_COLUMNS = 4


def format_lines(points: NDArray[np.float64]) -> bytes:
    """Format measurements as lines.

    Parameters
    ----------
    points : float64[n, 4]
        Time (s), latitude and longitude (degrees WGS 84), height (m, NaN if absent);
        further columns are ignored.

    Returns
    -------
    bytes
        `n` lines.
    """
    out = np.empty(len(points) * LINE_BYTES_MAX, dtype=np.uint8)
    size = _kernels.new4_lines(points, out)
    return out[:size].tobytes()


def read(path: Path) -> NDArray[np.float64]:
    """Read a `.new4` file.

    Returns
    -------
    float64[n, 4]
        Time (s), latitude, longitude (degrees), height (m, NaN if absent).

    Raises
    ------
    LayoutError
        A line does not have four numbers.
    """
    rows: list[tuple[float, ...]] = []
    for number, line in enumerate(path.read_text(encoding="ascii").splitlines(), start=1):
        fields = line.split("\t")
        try:
            values = tuple(float(field) if field else np.nan for field in fields)
        except ValueError:
            values = ()
        if len(values) != _COLUMNS or not np.isfinite(values[:3]).all():
            msg = f"{path.name}:{number}: expected four numbers separated by tabs, was {line!r}"
            raise LayoutError(msg)
        rows.append(values)
    return np.array(rows, dtype=np.float64).reshape(-1, _COLUMNS)
