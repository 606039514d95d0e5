"""Results of mlat-server (`--write-csv`): lines of comma-separated values without names.

::

    1700000000.123,4CA8D1,RYR1AB,1234,41.3000,2.1000,34000,45,5,5,"a,b,c,d,e",2,-64

The releases write lines of different length:

======= ================================================================== =============
fields  content                                                            altitude
======= ================================================================== =============
11      `t`, address, callsign, code, latitude, longitude, altitude (ft),  of the
        error (m), receivers, distinct receivers, their names              solution
12      and the degrees of freedom                                         of the
                                                                           solution
13      and the rate of climb (ft/min)                                     barometric
18      the first 11, then of a filter: latitude, longitude, altitude,     of the
        heading, speed (kt), rate of climb, error                          solution
19      the first 12, then of a filter: the same                           barometric
======= ================================================================== =============

The positions are those of the solution, not of the filter: the tracker filters. The error is the
square root of the trace of the covariance in three dimensions, -1 if unknown. With the whole of it
in the horizontal it bounds the standard deviation on each axis.
"""

import csv
import math
import re

from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.time_forms import DECIMAL
from multiradar_converters.feeds import layouts
from multiradar_converters.vid.text.lines import RejectedError
from multiradar_schemas.bounds import POSITION_SIGMA_M
from multiradar_schemas.reject import RejectCode

#: The beginning of a line: Unix time and address.
BEGIN = re.compile(rb"[0-9]{9,10}\.[0-9]{1,6},[0-9A-Fa-f]{6},")

_BAROMETRIC = (13, 19)
_ERROR_AT = 7
#: Place of the speed of the filter by number of fields; None without one.
_SPEED_AT: dict[int, int | None] = {11: None, 12: None, 13: None, 18: 15, 19: 16}


def cells(line: bytes) -> dict[int, str]:
    """Read a line.

    Parameters
    ----------
    line : bytes
        The line without its end.

    Returns
    -------
    dict of int to str
        Text by role.

    Raises
    ------
    RejectedError
        It is malformed.
    """
    try:
        fields = next(csv.reader([line.decode("latin-1")], strict=True), [])
    except csv.Error as error:
        raise RejectedError(RejectCode.MALFORMED_LINE, f"not valid CSV: {error}") from error
    if len(fields) not in _SPEED_AT:
        *most, last = map(str, _SPEED_AT)
        reason = f"expected {', '.join(most)} or {last} fields, found {len(fields)}"
        raise RejectedError(RejectCode.WRONG_FIELD_COUNT, reason)
    values = [field.strip(" ") for field in fields]
    found = {
        roles.TIME: values[0],
        roles.ADDRESS: values[1],
        roles.CALLSIGN: values[2],
        roles.CODE: values[3],
        roles.LATITUDE: values[4],
        roles.LONGITUDE: values[5],
        roles.HEIGHT if len(fields) in _BAROMETRIC else roles.GEOMETRIC: values[6],
        roles.KIND: "mlat",
    }
    sigma_m = _sigma_m(values[_ERROR_AT])
    if sigma_m is not None:
        found[layouts.SIGMA] = repr(sigma_m)
    speed_at = _SPEED_AT[len(fields)]
    if speed_at is not None:
        found[roles.SPEED] = values[speed_at]
    return found


def _sigma_m(error: str) -> float | None:
    if DECIMAL.fullmatch(error) is None or not float(error) > 0.0:
        return None
    least, most = POSITION_SIGMA_M
    return min(max(float(error) / math.sqrt(2.0), least), most)
