"""Compiled estimate of the height of an aircraft that reports none, from several radars.

See `_height_kernels` for the method and the symbols. The gain K = P Hᵀ S⁻¹ of a filter with the
same prediction approximates the sensitivity v closely enough for any filter in use; the innovation
e has the covariance H P Hᵀ + W + J P_ς Jᵀ beside the effect of the height.

References
----------
Friedland, B., "Treatment of bias in recursive filtering", IEEE TAC 14 (1969), 359-367, with the
height as the bias; the lower bound of the variance by the persistent errors of radar biases is the
project's own.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    SLOPE_DETERMINANT_MIN,
    covariance_times_transposed,
    gain_of,
    inverse,
    position_part,
)
from multiradar.estimation.filters.arrays import Model
from multiradar.estimation.filters.height._height_kernels import (
    BY_HEIGHT,
    GUESS,
    GUESS_VARIANCE,
    INITIATED,
    NOTHING,
    ON_SURFACE,
    HeightCheck,
    range_slope,
)
from multiradar.estimation.measurement._kernels import (
    bias_column,
    bias_spread,
    expected_measurement,
    is_bearing,
    sine_by_height,
)
from multiradar.estimation.measurement.kinds import (
    KIND_BEARING,
    KIND_DIRECTION,
    KIND_POSITION,
    KIND_RADAR,
)
from multiradar.estimation.motion._kernels import load_covariance, moved_covariance
from multiradar.geodesy._kernels import wrap_angle
from multiradar_compiled.kernels import in_loop, kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Elements of the estimate: change of the height, its variance afterwards, v afterwards.
HEIGHT_ESTIMATE_COUNT = 6

# Maximum derivative of the sine of an elevation by the height, 1/m, for an update.
STEEP_MAX = 0.1

# An innovation beyond four sigmas along u does not update the height.
ASTRAY_SQUARED = 16.0


@kernel
def estimate_height(
    check: HeightCheck, kind: int, z0: float, z1: float, dt: float, density: float, k: int, s: int,
    model: Model, means: Floats, covariances: Floats, sensitivities: Floats, vertical: Floats,
    estimate: Floats,
) -> None:  # fmt: skip
    """Compute the update of the height of aircraft k by a plot, dt after its state.

    ``density`` is that of the acceleration on each axis, m²/s³.
    """
    plane, sites, noises, starts = model.plane, model.sites, model.noises, model.starts
    parameters, bias, bias_covariance = model.parameters, model.bias, model.bias_covariance
    if check[0] != NOTHING or not (is_bearing(kind) or kind in (KIND_RADAR, KIND_POSITION)):
        estimate[:] = 0.0
        estimate[1] = check[2]
        return
    x0, x1, x2, x3 = means[k, 0], means[k, 1], means[k, 2], means[k, 3]
    for c in range(sensitivities.shape[2]):
        x0 += sensitivities[k, 0, c] * bias[c]
        x1 += sensitivities[k, 1, c] * bias[c]
        x2 += sensitivities[k, 2, c] * bias[c]
        x3 += sensitivities[k, 3, c] * bias[c]
    x0 += dt * x2
    x1 += dt * x3
    v2, v3 = vertical[k, BY_HEIGHT + 2], vertical[k, BY_HEIGHT + 3]
    v0, v1 = vertical[k, BY_HEIGHT] + dt * v2, vertical[k, BY_HEIGHT + 1] + dt * v3
    height, variance = check[1], check[2]
    site, noise = sites[s], noises[s]
    p0, p1, ground, h, w = expected_measurement(kind, plane, site, noise, x0, x1, height, 0.0)
    rate0, rate1 = h[0] * x2 + h[1] * x3, h[2] * x2 + h[3] * x3
    e0, e1 = z0 - p0, z1 - p1
    slope = 0.0
    if is_bearing(kind):
        e1 = wrap_angle(e1)
    if kind == KIND_DIRECTION:
        slope = sine_by_height(p0, ground)
        # Written so that NaN fails: an elevation is undefined straight up and at the source.
        if not (abs(e0) <= 2.0 and abs(slope) < STEEP_MAX and azimuth_is_sound(h[2], h[3], w[2])):
            estimate[0], estimate[1] = 0.0, variance
            estimate[2], estimate[3], estimate[4], estimate[5] = v0, v1, v2, v3
            return
    if kind == KIND_RADAR:
        e1 = wrap_angle(e1)
        slope = range_slope(height, p0, noise[3])
    for c in range(starts[s], starts[s + 1]):
        j0, j1 = bias_column(kind, parameters[c], site, p0, p1, rate0, rate1)
        e0 -= j0 * bias[c]
        e1 -= j1 * bias[c]
    b00, b01, b11 = bias_spread(
        kind, site, starts[s], starts[s + 1], parameters, bias_covariance, p0, p1, rate0, rate1
    )
    P = moved_covariance(load_covariance(covariances, k), dt, (density, 0.0, density))
    G = covariance_times_transposed(P, h)
    n00, n01, n11 = position_part(h, G)
    u0 = h[0] * v0 + h[1] * v1 + slope
    u1 = h[2] * v0 + h[3] * v1
    lasting = b00
    if kind == KIND_DIRECTION:
        # Only elevations determine heights (see below for azimuths), as accurately as the position
        # is known, whose error persists.
        lasting = n00 + spread_of_row(k, h[0], h[1], sensitivities, bias_covariance)
        spread = lasting + w[0]
        i00, i01, i11 = 1.0 / spread if spread > 0.0 else 0.0, 0.0, 0.0
    else:
        i00, i01, i11 = inverse(n00 + w[0] + b00, n01 + w[1] + b01, n11 + w[2] + b11)
    r0, r1 = i00 * u0 + i01 * u1, i01 * u0 + i11 * u1
    information = u0 * r0 + u1 * r1
    weighted = r0 * e0 + r1 * e1
    change, remaining = 0.0, variance
    if weighted * weighted <= ASTRAY_SQUARED * information * (
        1.0 + information * variance
    ):  # NaN fails this.
        least = variance / (1.0 + information * variance)
        change = least * weighted
        # The error of a radar's bias is the same at every plot.
        remaining = max(least, min(variance, lasting / max(u0 * u0, TINY_SQUARED)))
    # The filter processes the range at this height with its variance.
    if kind == KIND_BEARING:
        # The bias of an azimuth is indistinguishable from a height.
        change, remaining = 0.0, variance
    i00, i01, i11 = inverse(n00 + w[0] + slope * slope * variance, n01 + w[1], n11 + w[2])
    if kind == KIND_DIRECTION:
        # The filter uses the azimuth alone: `used_as`.
        i00, i01, i11 = 0.0, 0.0, 1.0 / (n11 + w[2])
    K = gain_of(G, i00, i01, i11)
    estimate[0] = change
    estimate[1] = remaining
    estimate[2] = v0 - K[0] * u0 - K[1] * u1
    estimate[3] = v1 - K[2] * u0 - K[3] * u1
    estimate[4] = v2 - K[4] * u0 - K[5] * u1
    estimate[5] = v3 - K[6] * u0 - K[7] * u1


@in_loop
def azimuth_is_sound(h0: float, h1: float, variance: float) -> bool:
    """Return whether an azimuth is defined and has a variance."""
    return variance > 0.0 and h0 * h0 + h1 * h1 < np.inf


@in_loop
def spread_of_row(
    k: int, h0: float, h1: float, sensitivities: Floats, bias_covariance: Floats
) -> float:
    """Return the contribution of the uncertain biases to the variance of h χ of aircraft k."""
    total = 0.0
    n = sensitivities.shape[2]
    for c in range(n):
        one = h0 * sensitivities[k, 0, c] + h1 * sensitivities[k, 1, c]
        for d in range(n):
            other = h0 * sensitivities[k, 0, d] + h1 * sensitivities[k, 1, d]
            total += one * bias_covariance[c, d] * other
    return total


@in_loop
def used_as(kind: int, check: HeightCheck, height: float) -> int:
    """Return the kind as which a filter uses a measurement, given the height (NaN for none).

    The elevation of an aircraft without a reported height determines its height, and is then not
    used for its range again: both would use the same information.
    """
    unheard = check[0] == NOTHING and np.isnan(height)
    return KIND_BEARING if kind == KIND_DIRECTION and unheard else kind


# Square of a negligible derivative of the range by the height.
TINY_SQUARED = 1e-12


@in_loop
def initialise_height_sensitivity(
    check: HeightCheck,
    kind: int,
    z0: float,
    k: int,
    s: int,
    noises: Floats,
    H: Floats,
    vertical: Floats,
) -> None:
    """Set v of an aircraft initiated at a plot with the derivative H: H v = −s."""
    slope = 0.0
    if kind == KIND_RADAR and check[0] == NOTHING:
        slope = range_slope(check[1], z0, noises[s, 3])
    det = H[0, 0] * H[1, 1] - H[0, 1] * H[1, 0]
    if not abs(det) > SLOPE_DETERMINANT_MIN:
        slope, det = 0.0, 1.0
    vertical[k, BY_HEIGHT] = -H[1, 1] * slope / det
    vertical[k, BY_HEIGHT + 1] = H[1, 0] * slope / det
    vertical[k, BY_HEIGHT + 2] = 0.0
    vertical[k, BY_HEIGHT + 3] = 0.0


@in_loop
def first_height_change(check: HeightCheck, k: int, heights: Floats, vertical: Floats) -> float:
    """Return the first reported height minus the estimated one, which it replaces."""
    change = 0.0
    if (
        check[0] in (INITIATED, ON_SURFACE)
        and np.isnan(heights[k])
        and not np.isnan(vertical[k, GUESS])
    ):
        change = check[1] - vertical[k, GUESS]
        vertical[k, GUESS] = check[1]
    return change


@in_loop
def store_height_estimate(estimate: Floats, k: int, vertical: Floats) -> None:
    """Store the estimate of the height; `shift_with_height` moves the position accordingly."""
    vertical[k, GUESS] += estimate[0]
    vertical[k, GUESS_VARIANCE] = estimate[1]
    for i in range(4):
        vertical[k, BY_HEIGHT + i] = estimate[2 + i]


@in_loop
def shift_with_height(change: float, k: int, row: int, vertical: Floats, means: Floats) -> None:
    """Shift the state in a row of means for a change of the height of aircraft k."""
    for i in range(4):
        means[row, i] += change * vertical[k, BY_HEIGHT + i]
