"""Lines of a plot over time, selected from the rows of a study."""

from collections.abc import Mapping, Sequence

import numpy as np

from multiradar.report.content import Series, Value

Row = dict[str, Value]


def series_by_time(
    rows: Sequence[Row], label: str, wanted: Mapping[str, Value], key: str = ""
) -> Series:
    """Return the values of the selected rows that have a time.

    Parameters
    ----------
    rows : sequence of dict
        Rows of a study with `time_s` and `value`.
    label : str
        Name in the legend.
    wanted : mapping
        Required values of columns.
    key : str
        Colour key, see `Series`.

    Returns
    -------
    Series
        In the order of the rows.
    """
    chosen = [
        row
        for row in rows
        if row["time_s"] is not None and all(row[name] == value for name, value in wanted.items())
    ]
    return Series(
        label,
        np.array([row["time_s"] for row in chosen], np.float64),
        np.array([row["value"] for row in chosen], np.float64),
        key=key,
    )
