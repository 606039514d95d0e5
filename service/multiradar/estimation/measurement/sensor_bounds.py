"""Bounds of the parameters of a sensor, the same as in `multiradar_schemas.bounds`.

The core is independent of wire formats, so it has its own copy, in degrees where the wire uses
degrees.
"""

from typing import NamedTuple


class Bounds(NamedTuple):
    """The least and the greatest allowed value."""

    least: float
    most: float


class ParameterBounds(NamedTuple):
    """Greatest magnitude, bounds of the prior sigma, and greatest drift of a parameter."""

    value: float
    sigma: Bounds
    drift: float


LATITUDE_DEG = Bounds(-90.0, 90.0)
LONGITUDE_DEG = Bounds(-180.0, 180.0)
HEIGHT_M = Bounds(-1000.0, 10_000.0)
RANGE_SIGMA_M = Bounds(0.1, 1e4)
AZIMUTH_SIGMA_DEG = Bounds(1e-4, 10.0)
POSITION_SIGMA_M = Bounds(0.1, 1e4)
#: A smaller maximum range is probably in kilometres or nautical miles.
RANGE_MAX_M = Bounds(500.0, 1e6)
ROTATION_PERIOD_S = Bounds(0.1, 3600.0)
EARTH_RADIUS_FACTOR = Bounds(1.0, 4.0)
TRANSPONDER_DELAY_SIGMA_M = Bounds(0.1, 500.0)
PLOTS_PER_SCAN_MAX = Bounds(10.0, 1e6)
CLOCK_TOLERANCE_S = Bounds(0.0, 60.0)

RANGE_OFFSET_M = ParameterBounds(2e4, Bounds(1e-9, 1e4), 100.0)
AZIMUTH_OFFSET_DEG = ParameterBounds(90.0, Bounds(1e-9, 10.0), 1.0)
RANGE_GAIN = ParameterBounds(0.1, Bounds(1e-9, 0.05), 0.01)
TIME_OFFSET_S = ParameterBounds(10.0, Bounds(1e-9, 10.0), 1.0)
AZIMUTH_SINE_DEG = ParameterBounds(5.0, Bounds(1e-9, 5.0), 1.0)
AZIMUTH_COSINE_DEG = AZIMUTH_SINE_DEG
FRAME_EAST_M = ParameterBounds(2e4, Bounds(1e-9, 1e4), 100.0)
FRAME_NORTH_M = FRAME_EAST_M
FRAME_ROTATION_DEG = ParameterBounds(10.0, Bounds(1e-9, 10.0), 1.0)

#: By kind of bias parameter.
PARAMETERS = (
    RANGE_OFFSET_M, AZIMUTH_OFFSET_DEG, RANGE_GAIN, TIME_OFFSET_S, AZIMUTH_SINE_DEG,
    AZIMUTH_COSINE_DEG, FRAME_EAST_M, FRAME_NORTH_M, FRAME_ROTATION_DEG,
)  # fmt: skip
