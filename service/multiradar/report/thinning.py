"""Thinning of series to the points that are visible."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from multiradar.report.content import Series

#: Maximum number of points drawn of a cloud, at equal intervals.
POINTS_MAX = 2000


def thin(series: Series, columns: int) -> Series:
    """Return a visually equal series with fewer points.

    Parameters
    ----------
    series : Series
        Of any length; lines and bands must be ascending in x, or they are kept unchanged.
    columns : int
        Columns of a line; each keeps its first, lowest, highest and last point.

    Returns
    -------
    Series
        At most about four points per column; extremes and gaps are kept.
    """
    count = len(series.x)
    if series.style in {"points", "rings"}:
        return _selected(series, np.arange(0, count, -(-count // POINTS_MAX))) if count else series
    if count <= 2 * columns or np.any(np.diff(series.x) < 0.0) or np.isnan(series.x).any():
        return series
    return _selected(series, _kept(series, columns))


def _selected(series: Series, kept: NDArray[np.intp]) -> Series:
    y2 = None if series.y2 is None else np.asarray(series.y2)[kept]
    x, y = np.asarray(series.x)[kept], np.asarray(series.y)[kept]
    return replace(series, x=x, y=y, y2=y2)


def _kept(series: Series, columns: int) -> NDArray[np.intp]:
    edges = np.linspace(series.x[0], series.x[-1], columns + 1)
    starts = np.unique(np.searchsorted(series.x, edges[:-1]))
    kept: set[int] = set()
    values = [series.y] if series.y2 is None else [series.y, series.y2]
    for start, stop in zip(starts, [*starts[1:], len(series.x)], strict=True):
        kept |= {int(start), int(stop) - 1}
        for one in values:
            column = np.asarray(one)[start:stop]
            gaps = np.flatnonzero(np.isnan(column))
            kept |= {int(start + gap) for gap in gaps[:1]}
            if len(gaps) < len(column):
                kept |= {int(start + np.nanargmin(column)), int(start + np.nanargmax(column))}
    return np.array(sorted(kept), dtype=np.intp)
