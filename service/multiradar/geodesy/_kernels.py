"""Compiled geodesy of the system plane; arguments are checked in `system_plane`.

Symbols (all in the frame of the plane's centre O: east, north, up; its origin on the ellipsoid)::

    e, n        plane coordinates of the foot, m
    u           up coordinate of the foot, m: the ellipsoid seen as a function of e and n
    m_ee, m_nn, m_uu, m_nu
                the quadric m_ee e² + m_nn n² + m_uu u² + 2 m_nu n u + 2 u = 0 of the surface, 1/m
    g_e, g_n, g_u
                half the gradient of the quadric at the foot; the normal is g / |g|
    u_e, u_n    slopes du/de and du/dn
    X, Z        coordinates of O from the axis and from the equator, m

A foot whose normal is inclined by more than 60° to the normal at O is outside the plane: results
there are NaN (or ok = False), and gates of callers must reject NaN.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.geodesy.wgs84 import (
    ECCENTRICITY_SQUARED,
    SEMI_MAJOR_AXIS_M,
    SEMI_MINOR_AXIS_M,
    curvatures,
    enu_rotation,
    geodetic_to_ecef,
    rotated,
)
from multiradar_compiled.kernels import in_both, in_loop, kernel
from multiradar_compiled.lane_kernels import Numbers, chosen, root

#: Cosine of the largest angle between the normals at the foot and at O (60°). Beyond it one metre
#: in the plane is more than two metres on the ground; at 90° the plane ends.
COSINE_MIN = 0.5

# Indices of the array of `plane_parameters`.
SIN, COS, LON, M_EE, M_NN, M_UU, M_NU, X, Z = range(9)
# Indices of the array of `site_parameters`: position, rows of the rotation, height, curvatures.
PE, PN, PU, EE, EN, EU, NE, NN, NU, UE, UN, UU, HEIGHT, C_NORTH, C_EAST = range(15)

# Newton converges quadratically from an error of metres to kilometres: 3 iterations are usual.
_ROUNDS_MAX = 12
_RANGE_TOLERANCE_M = 1e-6
_ACROSS_TOLERANCE_M = 1e-4
# Rounding may leave the sine of a vertical line of sight this much above one.
_SINE_SLACK = 1e-12


def plane_parameters(latitude: float, longitude: float) -> NDArray[np.float64]:
    """Return the parameters of a plane for the kernels, from its centre (rad).

    The quadric is x' M x' = 1 with M = diag(1/a², 1/a², 1/b²), transformed to the frame of O
    and divided by the length of its gradient there, so that the linear term is 2 u.
    """
    sine, cosine = math.sin(latitude), math.cos(latitude)
    root = math.sqrt(1.0 - ECCENTRICITY_SQUARED * sine * sine)
    x = SEMI_MAJOR_AXIS_M / root * cosine
    z = SEMI_MAJOR_AXIS_M / root * (1.0 - ECCENTRICITY_SQUARED) * sine
    equatorial, polar = SEMI_MAJOR_AXIS_M**-2, SEMI_MINOR_AXIS_M**-2
    gradient = math.hypot(equatorial * x, polar * z)
    result = np.empty(9)
    result[SIN], result[COS], result[LON], result[X], result[Z] = sine, cosine, longitude, x, z
    result[M_EE] = equatorial / gradient
    result[M_NN] = (sine * sine * equatorial + cosine * cosine * polar) / gradient
    result[M_UU] = (cosine * cosine * equatorial + sine * sine * polar) / gradient
    result[M_NU] = sine * cosine * (polar - equatorial) / gradient
    return result


def site_parameters(
    plane: NDArray[np.float64], latitude: float, longitude: float, height: float
) -> NDArray[np.float64]:
    """Return the parameters of a radar site for the kernels (rad, m above the ellipsoid)."""
    centre_latitude = math.atan2(plane[SIN], plane[COS])
    rotation = enu_rotation(centre_latitude, plane[LON])
    centre = geodetic_to_ecef(centre_latitude, plane[LON], 0.0)
    result = np.empty(15)
    line = geodetic_to_ecef(latitude, longitude, height) - centre
    result[PE : PU + 1] = rotated(rotation, line)
    result[EE : UU + 1] = rotated(rotation, enu_rotation(latitude, longitude)).ravel()
    result[HEIGHT] = height
    result[C_NORTH], result[C_EAST] = curvatures(latitude)
    return result


@in_loop
def wrap_angle(angle: float) -> float:
    """Return the angle (rad) wrapped to [−π, π); NaN for NaN and infinity."""
    if -math.pi <= angle < math.pi:
        return angle
    if not abs(angle) < math.inf:
        return math.nan
    # Not math.floor, which makes an integer: that of a large number would overflow.
    wrapped = angle - 2.0 * math.pi * np.floor((angle + math.pi) / (2.0 * math.pi))
    # Rounding may reach π itself; π and −π are the same direction.
    return wrapped if wrapped < math.pi else -math.pi


@in_loop
def predict_polar(
    plane: NDArray[np.float64], site: NDArray[np.float64], e: float, n: float, h: float
) -> tuple[float, float, float, float, float, float, float]:
    """Return slant range, azimuth, dr/de, dr/dn, da/de, da/dn and ground range.

    The point is `h` metres above the foot (e, n) along the ellipsoid's normal: exact WGS 84. The
    azimuth is that of the line of sight at the radar, clockwise from true north, in (−π, π]; the
    ground range is the length of the line of sight on the radar's horizon. Straight above the
    radar azimuth and its derivatives are zero.
    """
    slant, x, y, r_e, r_n, a_e, a_n, ground = line_of_sight(plane, site, e, n, h)
    return slant, math.atan2(x, y), r_e, r_n, a_e, a_n, ground


@in_both
def line_of_sight(
    plane: NDArray[np.float64], site: NDArray[np.float64], e: Numbers, n: Numbers, h: float
) -> tuple[Numbers, Numbers, Numbers, Numbers, Numbers, Numbers, Numbers, Numbers]:
    """Return what `predict_polar` does, for one foot or lanes, with x, y in place of the azimuth.

    x and y are the east and north components of the line of sight on the radar's horizon.
    """
    m_ee, m_nn, m_uu, m_nu = plane[M_EE], plane[M_NN], plane[M_UU], plane[M_NU]
    b = 1.0 + m_nu * n
    c = m_ee * e * e + m_nn * n * n
    discriminant = b * b - m_uu * c
    g_u = root(chosen(discriminant, 0.0, discriminant, math.nan))
    u = -c / (b + g_u)
    g_e = m_ee * e
    g_n = m_nn * n + m_nu * u
    g = root(g_e * g_e + g_n * g_n + g_u * g_u)
    g = chosen(COSINE_MIN * g, g_u, math.nan, g)
    u_e = -g_e / g_u
    u_n = -g_n / g_u
    f = h / g
    # The line of sight, in the frame of O.
    d_e = e + f * g_e - site[PE]
    d_n = n + f * g_n - site[PN]
    d_u = u + f * g_u - site[PU]
    # Derivative of the gradient; its part along the normal (t, over |g|²) is subtracted below.
    k_ne, k_ue = m_nu * u_e, m_uu * u_e
    k_nn, k_un = m_nn + m_nu * u_n, m_nu + m_uu * u_n
    t_e = (g_e * m_ee + g_n * k_ne + g_u * k_ue) / (g * g)
    t_n = (g_n * k_nn + g_u * k_un) / (g * g)
    # Derivatives of the point with respect to e and to n: (a_*) and (b_*).
    a_e = 1.0 + f * (m_ee - t_e * g_e)
    a_n = f * (k_ne - t_e * g_n)
    a_u = u_e + f * (k_ue - t_e * g_u)
    b_e = -f * t_n * g_e
    b_n = 1.0 + f * (k_nn - t_n * g_n)
    b_u = u_n + f * (k_un - t_n * g_u)
    slant = root(d_e * d_e + d_n * d_n + d_u * d_u)
    x = site[EE] * d_e + site[EN] * d_n + site[EU] * d_u
    y = site[NE] * d_e + site[NN] * d_n + site[NU] * d_u
    x_e = site[EE] * a_e + site[EN] * a_n + site[EU] * a_u
    y_e = site[NE] * a_e + site[NN] * a_n + site[NU] * a_u
    x_n = site[EE] * b_e + site[EN] * b_n + site[EU] * b_u
    y_n = site[NE] * b_e + site[NN] * b_n + site[NU] * b_u
    ground_squared = x * x + y * y
    # Straight above the radar, and not for NaN.
    nothing = 0.0 * ground_squared
    squared = chosen(ground_squared, 0.0, ground_squared, 1.0)
    length = chosen(ground_squared, 0.0, slant, 1.0)
    return (
        slant,
        x,
        y,
        chosen(ground_squared, 0.0, (d_e * a_e + d_n * a_n + d_u * a_u) / length, nothing),
        chosen(ground_squared, 0.0, (d_e * b_e + d_n * b_n + d_u * b_u) / length, nothing),
        chosen(ground_squared, 0.0, (y * x_e - x * y_e) / squared, nothing),
        chosen(ground_squared, 0.0, (y * x_n - x * y_n) / squared, nothing),
        root(ground_squared),
    )


@kernel
def locate_polar(
    plane: NDArray[np.float64],
    site: NDArray[np.float64],
    slant: float,
    azimuth: float,
    height: float,
) -> tuple[bool, float, float]:
    """Return (ok, e, n): the foot of the point seen at this slant range and azimuth.

    `height` is that of the point above the ellipsoid. The initial value is the closed form on the
    sphere that touches the ellipsoid at the radar in the direction of the azimuth; Newton removes
    the remaining error. Not ok: a range shorter than the difference of heights, a range not above
    0, a number not finite, a foot outside the plane, or no convergence.
    """
    if not (slant > 0.0 and math.isfinite(slant + azimuth + height)):
        return False, math.nan, math.nan
    sine_azimuth, cosine_azimuth = math.sin(azimuth), math.cos(azimuth)
    radius = 1.0 / (  # Euler's formula for the curvature of a normal section.
        site[C_NORTH] * cosine_azimuth * cosine_azimuth + site[C_EAST] * sine_azimuth * sine_azimuth
    )
    rise = height - site[HEIGHT]
    own = radius + site[HEIGHT]
    # Law of cosines in the triangle centre, radar, aircraft.
    sine = (rise * (2.0 * own + rise) - slant * slant) / (2.0 * slant * own)
    if not abs(sine) <= 1.0 + _SINE_SLACK:
        return False, math.nan, math.nan
    across = slant * math.sqrt(max(0.0, 1.0 - sine * sine))
    x, y, z = across * sine_azimuth, across * cosine_azimuth, slant * min(1.0, max(-1.0, sine))
    p_e = site[PE] + site[EE] * x + site[NE] * y + site[UE] * z
    p_n = site[PN] + site[EN] * x + site[NN] * y + site[UN] * z
    p_u = site[PU] + site[EU] * x + site[NU] * y + site[UU] * z
    # Down to the foot along the gradient at the point, then along that at the foot found; each
    # iteration gains three digits, all needed above the radar, where the azimuth is inaccurate.
    e, n, u = p_e, p_n, p_u
    for _ in range(3):
        g_e = plane[M_EE] * e
        g_n = plane[M_NN] * n + plane[M_NU] * u
        g_u = 1.0 + plane[M_NU] * n + plane[M_UU] * u
        down = height / math.sqrt(g_e * g_e + g_n * g_n + g_u * g_u)
        e, n, u = p_e - down * g_e, p_n - down * g_n, p_u - down * g_u
    return _refine(plane, site, slant, azimuth, height, e, n)


# Newton on (range, azimuth) from a close initial value.
@kernel
def _refine(
    plane: NDArray[np.float64],
    site: NDArray[np.float64],
    slant: float,
    azimuth: float,
    height: float,
    e: float,
    n: float,
) -> tuple[bool, float, float]:
    for _ in range(_ROUNDS_MAX):
        r, a, r_e, r_n, a_e, a_n, ground = predict_polar(plane, site, e, n, height)
        miss_r = slant - r
        miss_a = wrap_angle(azimuth - a)
        if not abs(miss_r) < math.inf:
            return False, math.nan, math.nan
        if abs(miss_r) < _RANGE_TOLERANCE_M and abs(miss_a) * ground < _ACROSS_TOLERANCE_M:
            return True, e, n
        determinant = r_e * a_n - r_n * a_e
        if determinant == 0.0:
            return False, math.nan, math.nan
        e += (a_n * miss_r - r_n * miss_a) / determinant
        n += (r_e * miss_a - a_e * miss_r) / determinant
    return False, math.nan, math.nan


@kernel
def geodetic_to_plane(
    plane: NDArray[np.float64], latitude: float, longitude: float
) -> tuple[float, float]:
    """Return (e, n) of a geodetic position (rad); NaN outside the plane."""
    sine, cosine = math.sin(latitude), math.cos(latitude)
    difference = longitude - plane[LON]
    cosine_difference = math.cos(difference)
    if not plane[COS] * cosine * cosine_difference + plane[SIN] * sine >= COSINE_MIN:
        return math.nan, math.nan
    radius = SEMI_MAJOR_AXIS_M / math.sqrt(1.0 - ECCENTRICITY_SQUARED * sine * sine)
    x = radius * cosine * cosine_difference - plane[X]
    z = radius * (1.0 - ECCENTRICITY_SQUARED) * sine - plane[Z]
    return radius * cosine * math.sin(difference), plane[COS] * z - plane[SIN] * x


@kernel
def plane_to_geodetic(plane: NDArray[np.float64], e: float, n: float) -> tuple[float, float]:
    """Return latitude and longitude (rad, longitude in [−π, π)) of a foot; NaN outside."""
    inside, _, g_e, g_n, g_u = _normal(plane, e, n)
    if not inside:
        return math.nan, math.nan
    x = plane[COS] * g_u - plane[SIN] * g_n
    z = plane[SIN] * g_u + plane[COS] * g_n
    longitude = plane[LON] + math.atan2(g_e, x)
    return math.atan2(z, math.hypot(g_e, x)), wrap_angle(longitude)


@kernel
def local_matrix(
    plane: NDArray[np.float64], e: float, n: float, h: float
) -> tuple[float, float, float, float]:
    """Return d(true east, true north)/d(e, n) at a point `h` metres above the foot, row by row.

    (east by e, east by n, north by e, north by n), true metres at the height of the point along the
    local directions east and north; NaN outside the plane. A velocity in the plane times this
    matrix is the true ground velocity of the aircraft.
    """
    inside, _, g_e, g_n, g_u = _normal(plane, e, n)
    if not inside:
        return math.nan, math.nan, math.nan, math.nan
    g = math.sqrt(g_e * g_e + g_n * g_n + g_u * g_u)
    # Directions at the point, first in the meridian frame (x from the axis, y east, z north pole).
    x, z = plane[COS] * g_u - plane[SIN] * g_n, plane[SIN] * g_u + plane[COS] * g_n
    level = math.hypot(g_e, x)
    s, c = (g_e / level, x / level) if level > 0.0 else (0.0, 1.0)
    north_x, north_y, north_z = -z / g * c, -z / g * s, level / g
    i_e, i_n, i_u = c, plane[SIN] * s, -plane[COS] * s
    j_e = north_y
    j_n = plane[COS] * north_z - plane[SIN] * north_x
    j_u = plane[SIN] * north_z + plane[COS] * north_x
    # Derivatives of the point; the part along the normal is along up and cancels below.
    u_e, u_n = -g_e / g_u, -g_n / g_u
    f = h / g
    a_e, a_n, a_u = 1.0 + f * plane[M_EE], f * plane[M_NU] * u_e, u_e + f * plane[M_UU] * u_e
    b_n = 1.0 + f * (plane[M_NN] + plane[M_NU] * u_n)
    b_u = u_n + f * (plane[M_NU] + plane[M_UU] * u_n)
    return (
        i_e * a_e + i_n * a_n + i_u * a_u,
        i_n * b_n + i_u * b_u,
        j_e * a_e + j_n * a_n + j_u * a_u,
        j_n * b_n + j_u * b_u,
    )


# (inside, u, g_e, g_n, g_u) of a foot.
@kernel
def _normal(
    plane: NDArray[np.float64], e: float, n: float
) -> tuple[bool, float, float, float, float]:
    b = 1.0 + plane[M_NU] * n
    c = plane[M_EE] * e * e + plane[M_NN] * n * n
    discriminant = b * b - plane[M_UU] * c
    if not discriminant > 0.0:
        return False, math.nan, math.nan, math.nan, math.nan
    g_u = math.sqrt(discriminant)
    u = -c / (b + g_u)
    g_e = plane[M_EE] * e
    g_n = plane[M_NN] * n + plane[M_NU] * u
    inside = g_u >= COSINE_MIN * math.sqrt(g_e * g_e + g_n * g_n + g_u * g_u)
    return inside, u, g_e, g_n, g_u
