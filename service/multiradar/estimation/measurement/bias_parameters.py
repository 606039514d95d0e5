"""Effect of the bias parameters of a sensor on its measurements.

A bias is *measured minus true*. A plot is (slant range r, azimuth α), a reported position is (east,
north); each kind of parameter adds a fixed multiple of itself, so that measured = true + J ς +
noise with one column of J a parameter::

    kind             unit    column of J (range, azimuth)          of a position (east, north)
    range offset     m       (1, 0)
    azimuth offset   rad     (0, 1)
    range gain       1       (r, 0)
    time offset      s       (−range rate, −azimuth rate)          (−east rate, −north rate)
    azimuth sine     rad     (0, sin α)
    azimuth cosine   rad     (0, cos α)
    frame east       m       (sin α, cos α / r)                    (1, 0)
    frame north      m       (cos α, −sin α / r)                   (0, 1)
    frame rotation   rad                                           (north − n₀, e₀ − east)

Azimuth sine and cosine are the eccentricity of an antenna: an axis, or an encoder, that is not at
the centre of the rotation makes an error with the period of one revolution. A local frame is that
in which multilateration computes positions: it is displaced, and turned clockwise about its
reference point (e₀, n₀), the position of the sensor. A radar whose frame is turned has an azimuth
offset.

Sign of the time offset: a plot whose time stamp is late by τ shows the aircraft at the time of the
stamp minus τ, so it lags by τ times the rates.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import UnknownParameterError
from multiradar.estimation.array_checks import require_numbers
from multiradar.estimation.measurement.sensors import (
    PARAMETER_NAMES,
)


def known_kinds(kinds: ArrayLike) -> NDArray[np.int64]:
    """Return kinds of bias parameters if all of them are defined.

    Parameters
    ----------
    kinds : (...) array_like of int
        Kinds, as in `SensorTable.parameter_kind`.

    Returns
    -------
    (c,) int64
        The same kinds, in one dimension.

    Raises
    ------
    UnknownParameterError
        If one is not an index of `PARAMETER_NAMES`.
    ShapeError
        If they are not numeric, or rows of unequal length.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.5) and (1.7), for the offsets; the other kinds are the
    project's own.
    """
    numbers = require_numbers(kinds, "kinds of the bias parameters")
    for kind in numbers.ravel().tolist():
        if kind not in range(len(PARAMETER_NAMES)):
            raise UnknownParameterError(kind, PARAMETER_NAMES)
    return numbers.astype(np.int64).ravel()
