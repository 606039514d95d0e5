"""Bounds of sensor parameters, for sensors files and scenarios.

They include every radar and are narrow enough to keep the filters numerically sound. The core,
which is independent of the wire format, has the same bounds in
`multiradar.estimation.measurement.sensor_bounds`; a test compares the two.
"""

from typing import NamedTuple


class Bounds(NamedTuple):
    """Minimum and maximum, inclusive."""

    least: float
    most: float


class ParameterBounds(NamedTuple):
    """Bounds of a bias parameter, in its own unit.

    Attributes
    ----------
    value : float
        Maximum magnitude of the bias and of its prior mean.
    sigma : Bounds
        Bounds of the prior standard deviation.
    drift : float
        Maximum standard deviation of the random walk after one second.
    """

    value: float
    sigma: Bounds
    drift: float


LATITUDE_DEG = Bounds(-90.0, 90.0)
LONGITUDE_DEG = Bounds(-180.0, 180.0)
HEIGHT_M = Bounds(-1000.0, 10_000.0)
RANGE_SIGMA_M = Bounds(0.1, 1e4)
AZIMUTH_SIGMA_DEG = Bounds(1e-4, 10.0)
POSITION_SIGMA_M = Bounds(0.1, 1e4)
#: No radar has a shorter range: a smaller number is in kilometres or nautical miles.
RANGE_MAX_M = Bounds(500.0, 1e6)
ROTATION_PERIOD_S = Bounds(0.1, 3600.0)
#: 4/3 in the mean atmosphere near the ground; ducts are beyond.
EARTH_RADIUS_FACTOR = Bounds(1.0, 4.0)
#: ICAO Annex 10, volume IV, 3.1.1.7.10 and 3.1.2.10: 3 ± 0.5 µs in Mode A/C and 128 ± 0.25 µs in
#: Mode S, 75 and 37 m one way.
TRANSPONDER_DELAY_SIGMA_M = Bounds(0.1, 500.0)
#: Fewer would be below what one sector of a radar delivers at once.
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
