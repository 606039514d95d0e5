"""Physical bounds of values, and the records of a layout that cannot be within them."""

import numpy as np

from multiradar_converters.asterix.layout.columns import Columns, Flags

DAY_S = 86_400.0
LATITUDE_MAX_DEG, LONGITUDE_MAX_DEG = 90.0, 180.0
#: Heights of aircraft, m: the standards end at 150 000 ft; no terrain or pressure is so low.
HEIGHT_MIN_M, HEIGHT_MAX_M = -1_500.0, 45_720.0
#: Speed of an aircraft, m/s: twice that of the fastest.
SPEED_MAX_MPS = 2_000.0


def impossible_records(columns: Columns) -> Flags:
    """Return which records have no possible time, latitude or longitude among those they contain.

    One of several is enough: an item that a sender fills with an invalid value does not count
    against the others. Only values that a report cannot do without are considered.

    Parameters
    ----------
    columns : Columns
        The records.

    Returns
    -------
    bool[n]
        Whether the values of a record are impossible.
    """
    impossible = np.zeros(len(columns), dtype=np.bool_)
    for kind, bound in (("time", DAY_S), ("LAT", LATITUDE_MAX_DEG), ("LON", LONGITUDE_MAX_DEG)):
        least = np.full(len(columns), np.inf)
        for node, name in columns.walked.program.bounded[kind]:
            least = np.fmin(least, np.abs(columns.numbers(node, name)))
        # The end of a day is the start of the next.
        beyond = least >= bound if kind == "time" else least > bound
        impossible |= np.isfinite(least) & beyond
    return impossible
