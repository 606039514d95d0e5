"""Compiled measurement model: expected measurement, and derivatives by position and biases.

Symbols: H = derivative of the measurement by east and north, W = covariance of its noise (upper
triangle: 00 01 11), J = derivative by the biases of the sensor, D = derivative of the position by
range and azimuth.

A row of ``noises`` is: variance of range (m²), of azimuth (rad²), of a reported position on each
axis (m²), and the height of the site (m). A row of ``sites`` is that of
`multiradar.geodesy._kernels.site_parameters`; for the flat kinds its first two elements are east
and north of the radar (m), and the plane is not used.

A bearing has an azimuth and no range. Its first component is a placeholder: measured and expected
as 0, with zero derivative and a variance of 1, so that it has no effect. The information of a
bearing is of rank one; no large variance stands for a missing range.

A direction is a bearing with an elevation. Its first component is the sine of the elevation, which
needs no inverse function in lanes: on the sphere that touches the ellipsoid at the source in the
direction of the aircraft (Euler's radius), accurate to 0.001° at 300 km. At a known height it
determines the range along the line of sight. Its row of ``noises`` has the variance of the
elevation first.

References
----------
IMM UrO RAN report (2016), equations (1.5), with the gain of the range named in the text after it,
(1.7), (1.11) and (1.13); Nenartovich, Isakov, equation (11), for bearings. The polar form on WGS 84
and time offsets are the project's own.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import (
    KIND_BEARING,
    KIND_DIRECTION,
    KIND_FLAT_POLAR,
    KIND_FLAT_POSITION,
    KIND_POSITION,
    KIND_RADAR,
)
from multiradar.geodesy._kernels import (
    C_EAST,
    C_NORTH,
    EE,
    EN,
    HEIGHT,
    NE,
    NN,
    PE,
    PN,
    line_of_sight,
    locate_polar,
)
from multiradar_compiled.kernels import in_both, in_loop, kernel
from multiradar_compiled.lane_kernels import Numbers, broadcast_like, chosen, larger, root

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
SlopeOf = tuple[Numbers, Numbers, Numbers, Numbers]
NoiseOf = tuple[Numbers, Numbers, Numbers]
Slope = SlopeOf[float]
Noise = NoiseOf[float]

PARAMETER_RANGE_OFFSET = 0
PARAMETER_AZIMUTH_OFFSET = 1
PARAMETER_RANGE_GAIN = 2
PARAMETER_TIME_OFFSET = 3
PARAMETER_AZIMUTH_SINE = 4
PARAMETER_AZIMUTH_COSINE = 5
PARAMETER_FRAME_EAST = 6
PARAMETER_FRAME_NORTH = 7
PARAMETER_FRAME_ROTATION = 8
# Twice the mean radius of the Earth.
EARTH_DIAMETER_M = 12_742_000.0
# Minimum distance from a radar on a flat plane for a line of sight, m.
LINE_OF_SIGHT_MIN_M = 1e-3


@in_both
def measures_azimuth(kind: int) -> bool:
    """Return whether the second component is an azimuth, whose differences are wrapped."""
    return kind in (KIND_RADAR, KIND_BEARING, KIND_FLAT_POLAR, KIND_DIRECTION)


@in_both
def is_bearing(kind: int) -> bool:
    """Return whether a measurement has an azimuth and no range."""
    return kind in (KIND_BEARING, KIND_DIRECTION)


@kernel
def predict_measurement(
    kind: int,
    plane: Floats,
    site: Floats,
    noise: Floats,
    east: float,
    north: float,
    height: float,
    height_variance: float,
    H: Floats,
    W: Floats,
) -> tuple[float, float, float]:
    """Fill H and W; return both predicted components and the ground range (NaN without a site)."""
    p0, p1, ground, h, w = expected_measurement(
        kind, plane, site, noise, east, north, height, height_variance
    )
    H[0, 0], H[0, 1], H[1, 0], H[1, 1] = h
    W[0], W[1], W[2] = w
    return p0, p1, ground


@in_loop
def expected_measurement(
    kind: int,
    plane: Floats,
    site: Floats,
    noise: Floats,
    east: float,
    north: float,
    height: float,
    height_variance: float,
) -> tuple[float, float, float, Slope, Noise]:
    """Return both predicted components, the ground range (NaN without a site), H and W."""
    p0, x, y, ground, h, w = expected_sight(
        kind, plane, site, noise, east, north, height, height_variance
    )
    p1 = y
    if measures_azimuth(kind):
        p1 = math.atan2(x, y)
    return p0, p1, ground, h, w


@in_both
def expected_sight(
    kind: int, plane: Floats, site: Floats, noise: Floats, east: Numbers, north: Numbers,
    height: float, height_variance: float,
) -> tuple[Numbers, Numbers, Numbers, Numbers, SlopeOf[Numbers], NoiseOf[Numbers]]:  # fmt: skip
    """Return what `expected_measurement` does with x, y in place of the azimuth; scalar or lanes.

    x and y are the east and north components of the line of sight on the ground. Where the second
    component is not an azimuth, it is y.
    """
    none, one = broadcast_like(0.0, east), broadcast_like(1.0, east)
    p0, x, y, ground = east, none, north, broadcast_like(np.nan, east)
    h = (one, none, none, one)
    w = (broadcast_like(noise[2], east), none, broadcast_like(noise[2], east))
    if kind == KIND_RADAR:
        p0, x, y, r_e, r_n, az_e, az_n, ground = line_of_sight(plane, site, east, north, height)
        h = (r_e, r_n, az_e, az_n)
        # Slope of the slant range with the height: sine of the elevation seen from the aircraft.
        slope = (height - noise[3]) / larger(p0, 1.0) + p0 / EARTH_DIAMETER_M
        w = (noise[0] + slope * slope * height_variance, none, broadcast_like(noise[1], east))
    elif kind == KIND_BEARING:
        _, x, y, _, _, az_e, az_n, ground = line_of_sight(plane, site, east, north, height)
        # NaN where there is no line of sight, as for the azimuth.
        p0 = 0.0 * ground
        h = (none, none, az_e, az_n)
        w = (one, none, broadcast_like(noise[1], east))
    elif kind == KIND_DIRECTION:
        slant, x, y, r_e, r_n, az_e, az_n, ground = line_of_sight(plane, site, east, north, height)
        p0, by_range = sine_of_direction(site, x, y, ground, slant, height)
        h = (by_range * r_e, by_range * r_n, az_e, az_n)
        slope = sine_by_height(p0, ground)
        w = (
            (1.0 - p0 * p0) * noise[0] + slope * slope * height_variance,
            none,
            broadcast_like(noise[1], east),
        )
    elif kind != KIND_POSITION:
        dx = east - site[0]
        dy = north - site[1]
        ground = root(dx * dx + dy * dy)
        # At the position of the radar itself the line of sight is undefined (NaN).
        across = chosen(ground, LINE_OF_SIGHT_MIN_M, ground, np.nan)
        ue = dx / across
        un = dy / across
        if kind == KIND_FLAT_POLAR:
            p0, x, y = ground, dx, dy
            h = (ue, un, un / across, -ue / across)
            w = (broadcast_like(noise[0], east), none, broadcast_like(noise[1], east))
        else:
            # D W Dᵀ with D = [line / ground, across], (1.11), (1.13).
            w = (
                ue * ue * noise[0] + dy * dy * noise[1],
                ue * un * noise[0] - dx * dy * noise[1],
                un * un * noise[0] + dx * dx * noise[1],
            )
    return p0, x, y, ground, h, w


@in_both
def sine_of_direction(
    site: Floats, x: Numbers, y: Numbers, ground: Numbers, slant: Numbers, height: float
) -> tuple[Numbers, Numbers]:
    """Return the sine of the elevation of a line of sight, and its derivative by the slant range.

    By the law of cosines in the triangle of centre, source and aircraft.
    """
    across = ground * ground
    curvature = (site[C_NORTH] * y * y + site[C_EAST] * x * x) / across
    own = 1.0 / curvature + site[HEIGHT]
    rise = height - site[HEIGHT]
    lift = rise * (2.0 * own + rise)
    twice = 2.0 * slant * own
    return (lift - slant * slant) / twice, -(lift + slant * slant) / (twice * slant)


@in_both
def sine_by_height(sine: Numbers, ground: Numbers) -> Numbers:
    """Return the derivative of the sine of an elevation by the height of the target.

    At a fixed ground range it is cos²/slant = cos³/ground.
    """
    level = 1.0 - sine * sine
    slope: Numbers = level * root(level) / ground
    return slope


@kernel
def locate_measurement(
    kind: int, plane: Floats, site: Floats, z0: float, z1: float, height: float
) -> tuple[bool, float, float]:
    """Return (ok, east, north): the position for a measurement without errors."""
    if is_bearing(kind):
        return False, np.nan, np.nan
    if kind in (KIND_RADAR, KIND_FLAT_POLAR) and not z0 > LINE_OF_SIGHT_MIN_M:
        return False, np.nan, np.nan
    if kind == KIND_RADAR:
        return locate_polar(plane, site, z0, z1, height)
    if kind == KIND_FLAT_POLAR:
        return True, site[0] + z0 * math.sin(z1), site[1] + z0 * math.cos(z1)
    return True, z0, z1


@in_loop
def bias_column(
    kind: int, parameter: int, site: Floats, p0: float, p1: float, rate0: float, rate1: float
) -> tuple[float, float]:
    """Return one column of J: derivative of the measurement by a bias parameter.

    ``p0``, ``p1`` are the measurement as predicted, the rates its derivative by time.
    """
    x, y = 0.0, p1
    if parameter >= PARAMETER_AZIMUTH_SINE and measures_azimuth(kind):
        x, y = math.sin(p1), math.cos(p1)
    return bias_column_of_sight(kind, parameter, site, p0, x, y, rate0, rate1)


@in_both
def bias_column_of_sight(
    kind: int, parameter: int, site: Floats, p0: Numbers, x: Numbers, y: Numbers, rate0: Numbers,
    rate1: Numbers,
) -> tuple[Numbers, Numbers]:  # fmt: skip
    """Return what `bias_column` does, with x, y of `expected_sight` in place of the azimuth."""
    # Time offset: the stamp is late, so the plot shows the earlier position of the aircraft.
    j0, j1 = -rate0, -rate1
    if parameter >= PARAMETER_AZIMUTH_SINE:
        j0, j1 = directional_column(kind, parameter, site, p0, x, y)
    elif parameter != PARAMETER_TIME_OFFSET:
        j0, j1 = broadcast_like(1.0, p0), broadcast_like(0.0, p0)
        dx, dy = p0, broadcast_like(0.0, p0)
        if kind == KIND_FLAT_POSITION:
            dx, dy = p0 - site[0], y - site[1]
            r = root(dx * dx + dy * dy)
            across = chosen(r, LINE_OF_SIGHT_MIN_M, r, np.nan)
            j0, j1 = dx / across, dy / across
        if parameter == PARAMETER_AZIMUTH_OFFSET:
            j0, j1 = broadcast_like(0.0, p0), broadcast_like(1.0, p0)
            if kind == KIND_FLAT_POSITION:
                j0, j1 = dy, -dx
        elif parameter == PARAMETER_RANGE_GAIN:
            j0, j1 = dx, dy
    if kind == KIND_BEARING or (kind == KIND_DIRECTION and parameter != PARAMETER_TIME_OFFSET):
        j0 = broadcast_like(0.0, p0)
    return j0, j1


@in_both
def directional_column(
    kind: int, parameter: int, site: Floats, p0: Numbers, x: Numbers, y: Numbers
) -> tuple[Numbers, Numbers]:
    """Return a column of J that depends on the direction: eccentricity, or a local frame.

    East and north of the frame are those at the site; the plane is nearly parallel to it. The angle
    by which a shifted frame turns bearings depends on the unknown distance, and is neglected.
    """
    j0, j1 = broadcast_like(0.0, p0), broadcast_like(0.0, p0)
    if kind == KIND_POSITION:
        if parameter == PARAMETER_FRAME_EAST:
            j0, j1 = broadcast_like(site[EE], p0), broadcast_like(site[EN], p0)
        elif parameter == PARAMETER_FRAME_NORTH:
            j0, j1 = broadcast_like(site[NE], p0), broadcast_like(site[NN], p0)
        elif parameter == PARAMETER_FRAME_ROTATION:
            j0, j1 = y - site[PN], site[PE] - p0
    elif measures_azimuth(kind):
        ground = root(x * x + y * y)
        sine, cosine = x / ground, y / ground
        if parameter == PARAMETER_AZIMUTH_SINE:
            j1 = sine
        elif parameter == PARAMETER_AZIMUTH_COSINE:
            j1 = cosine
        elif parameter == PARAMETER_FRAME_EAST:
            j0 = sine
            if not is_bearing(kind):
                j1 = cosine / p0
        elif parameter == PARAMETER_FRAME_NORTH:
            j0 = cosine
            if not is_bearing(kind):
                j1 = -sine / p0
    return j0, j1


@in_loop
def bias_spread(
    kind: int,
    site: Floats,
    first: int,
    last: int,
    parameters: Integers,
    covariance: Floats,
    p0: float,
    p1: float,
    rate0: float,
    rate1: float,
) -> tuple[float, float, float]:
    """Return J P_ς Jᵀ of one sensor."""
    b00 = 0.0
    b01 = 0.0
    b11 = 0.0
    for c in range(first, last):
        j0, j1 = bias_column(kind, parameters[c], site, p0, p1, rate0, rate1)
        for d in range(first, last):
            k0, k1 = bias_column(kind, parameters[d], site, p0, p1, rate0, rate1)
            p = covariance[c, d]
            b00 += j0 * p * k0
            b01 += 0.5 * (j0 * k1 + j1 * k0) * p
            b11 += j1 * p * k1
    return b00, b01, b11
