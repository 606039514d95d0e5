"""Compiled comparison of what aircraft report with what radars and multilateration measure.

Symbols: e = plot minus what the reports make it to be, ē = its fading mean, f = variance of that
mean in terms of one plot's, S = covariance of the random errors, B = that of what all plots of a
sensor share.

A sensor contradicts when ēᵀ (f S + B)⁻¹ ē is above `CONTRADICTED`, and agrees below `AGREED`. A
single plot far from the mean counts only when the next one is so too. Sensors on one site have one
vote, and so has the aircraft; and places that agree with each other on one offset of the reports
outvote it together, long before each of them does.

References
----------
The project's own. The test is that of a mean of Gaussian differences: Bar-Shalom, Y., Li, X. R. and
Kirubarajan, T., "Estimation with Applications to Tracking and Navigation" (2001), section 5.4.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import CONE_RATIO, choose_height, inverse, squared_norm
from multiradar.estimation.filters.arrays import Model
from multiradar.estimation.measurement._kernels import (
    KIND_RADAR,
    Slope,
    bias_column,
    bias_spread,
    expected_measurement,
    measures_azimuth,
)
from multiradar.geodesy._kernels import wrap_angle
from multiradar.tracking.plausibility.trust import (
    EAST,
    EAST_RATE,
    MEAN_0,
    MEAN_1,
    MEAN_FACTOR,
    NORTH,
    NORTH_RATE,
    PLOT_HEIGHT,
    PLOT_TIME,
    PLOT_Z0,
    PLOT_Z1,
    SAID_E,
    SAID_EE,
    SAID_EN,
    SAID_N,
    SAID_NN,
    SAID_SQUARE,
    TIME,
    Trust,
    Watch,
)
from multiradar_compiled.kernels import in_loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# What aircraft do between two reports, m/s²: so many times what the rates have changed by, and this
# more, but no more than that.
BETWEEN_FACTOR = 1.5
BETWEEN_LEAST = 1.0
BETWEEN_MOST = 12.0
# Errors that all plots of an aircraft by a sensor share: of time stamps, s, of places, m, of
# heights, m. All one sigma.
LATENCY_S = 0.4
COMMON_M = 40.0
COMMON_HEIGHT_M = 60.0
# Least weight of the newest comparison in the mean.
MEAN_GAIN = 0.5
# Normalised squares with two degrees of freedom: exp(−x / 2) of them are larger by chance.
CONTRADICTED = 20.0
AGREED = 9.0
# That of one offset that all places agree on; what they share makes up most of it.
ELSEWHERE = 16.0
ELSEWHERE_TESTS = 2
FAR_FROM_MEAN = 30.0
# What is left of the differences of all sensors when one offset explains them: at most this.
CONSISTENT = 30.0
# A verdict holds for so many turns of its sensor.
FRESH_TURNS = 3.5
# Contradicting turns after which a single place that others bear out outvotes an aircraft.
LONE_RUNS = 3
# Aircraft that a place must agree with to be borne out.
CREDIT_MIN = 2


@in_loop
def compare_all(
    k: int, time: float, east: float, north: float, height: float, sigma: float, base: Floats,
    model: Model, bias: Floats, bias_covariance: Floats, watch: Watch, trust: Trust,
) -> tuple[int, float]:  # fmt: skip
    """Compare the plots between two reports; return how many, and the largest offset, m."""
    compared = 0
    offset = 0.0
    trust.bent[k] = max(0.5 * trust.bent[k], way_beside(k, time, east, north, base, trust))
    for s in range(watch.kind.shape[0]):
        for i in range(trust.waiting[k, s]):
            if base[k, TIME] <= trust.plot[k, s, i, PLOT_TIME] <= time:
                done, off = compare(
                    k, s, i, time, east, north, height, sigma, base, model, bias, bias_covariance,
                    watch.kind[s], trust,
                )  # fmt: skip
                compared += done
                offset = max(offset, off)
    return compared, offset


@in_loop
def way_beside(k: int, time: float, east: float, north: float, base: Floats, trust: Trust) -> float:
    """Return how far, m, the way between two reports may be from a straight line."""
    elapsed = time - base[k, TIME]
    acceleration = BETWEEN_MOST
    if not np.isnan(base[k, EAST_RATE]):
        d0 = (east - base[k, EAST]) / elapsed - base[k, EAST_RATE]
        d1 = (north - base[k, NORTH]) / elapsed - base[k, NORTH_RATE]
        turned = BETWEEN_FACTOR * math.sqrt(d0 * d0 + d1 * d1) / elapsed
        acceleration = min(turned + BETWEEN_LEAST, BETWEEN_MOST)
    away: float = 0.125 * acceleration * elapsed * elapsed
    return away


@in_loop
def compare(
    k: int, s: int, i: int, time: float, east: float, north: float, height: float, sigma: float,
    base: Floats, model: Model, bias: Floats, bias_covariance: Floats, kind: int, trust: Trust,
) -> tuple[int, float]:  # fmt: skip
    """Compare a plot with the way between two reports; return 1 if that could be done, and ē, m."""
    plot_time = trust.plot[k, s, i, PLOT_TIME]
    elapsed = time - base[k, TIME]
    share = (plot_time - base[k, TIME]) / elapsed
    v0 = (east - base[k, EAST]) / elapsed
    v1 = (north - base[k, NORTH]) / elapsed
    x0 = base[k, EAST] + share * (east - base[k, EAST])
    x1 = base[k, NORTH] + share * (north - base[k, NORTH])
    random = sigma * sigma * (share * share + (1.0 - share) * (1.0 - share))
    tall, variance = choose_height(trust.plot[k, s, i, PLOT_HEIGHT], height, model.options)
    variance += COMMON_HEIGHT_M * COMMON_HEIGHT_M
    site, noise = model.sites[s], model.noises[s]
    p0, p1, ground, h, w = expected_measurement(
        kind, model.plane, site, noise, x0, x1, tall, variance
    )
    e0 = trust.plot[k, s, i, PLOT_Z0] - p0
    e1 = trust.plot[k, s, i, PLOT_Z1] - p1
    if measures_azimuth(kind):
        e1 = wrap_angle(e1)
    r0 = h[0] * v0 + h[1] * v1
    r1 = h[2] * v0 + h[3] * v1
    # Kept apart: what is known of the biases changes faster than the mean, at first.
    d0, d1 = 0.0, 0.0
    first, last = model.starts[s], model.starts[s + 1]
    for c in range(first, last):
        j0, j1 = bias_column(kind, model.parameters[c], site, p0, p1, r0, r1)
        d0 += j0 * bias[c]
        d1 += j1 * bias[c]
    b = bias_spread(kind, site, first, last, model.parameters, bias_covariance, p0, p1, r0, r1)
    m00, m01, m11 = h[0] * h[0] + h[1] * h[1], h[0] * h[2] + h[1] * h[3], h[2] * h[2] + h[3] * h[3]
    late = LATENCY_S * LATENCY_S
    common = COMMON_M * COMMON_M + trust.bent[k] * trust.bent[k]
    c00 = b[0] + common * m00 + late * r0 * r0
    c01 = b[1] + common * m01 + late * r0 * r1
    c11 = b[2] + common * m11 + late * r1 * r1
    s00, s01, s11 = w[0] + random * m00, w[1] + random * m01, w[2] + random * m11
    usable = not ground < model.options[CONE_RATIO] * (tall - noise[3])
    usable = usable and math.isfinite(e0) and math.isfinite(e1)
    offset = 0.0
    if usable:
        note_comparison(k, s, e0, e1, d0, d1, s00, s01, s11, c00, c01, c11, trust)
        f = trust.mean[k, s, MEAN_FACTOR]
        d0, d1 = trust.mean[k, s, MEAN_0] - d0, trust.mean[k, s, MEAN_1] - d1
        note_offset(k, s, h, d0, d1, f * s00 + b[0], f * s01 + b[1], f * s11 + b[2], trust)
        trust.judged[k, s] = plot_time
        if trust.verdict[k, s] < 0:
            across = p0 if kind == KIND_RADAR else 1.0
            offset = math.hypot(d0, across * d1)
    return int(usable), offset


@in_loop
def note_comparison(
    k: int, s: int, e0: float, e1: float, d0: float, d1: float, s00: float, s01: float, s11: float,
    b00: float, b01: float, b11: float, trust: Trust,
) -> None:  # fmt: skip
    """Take a difference into the mean of its sensor, unless it is a single one far from it.

    ``d0`` and ``d1`` are what the biases make of it.
    """
    mean = trust.mean
    if trust.tests[k, s] > 0:
        g = 1.0 + mean[k, s, MEAN_FACTOR]
        a0, a1 = e0 - mean[k, s, MEAN_0], e1 - mean[k, s, MEAN_1]
        far = squared_norm(g * s00, g * s01, g * s11, a0, a1) > FAR_FROM_MEAN
    else:
        far = squared_norm(s00 + b00, s01 + b01, s11 + b11, e0 - d0, e1 - d1) > CONTRADICTED
    if far and trust.odd[k, s] == 0:
        trust.odd[k, s] = 1
        return
    if far:
        trust.tests[k, s] = 0
    trust.runs[k, s] += trust.odd[k, s]
    trust.odd[k, s] = 0
    trust.tests[k, s] += 1
    gain = max(1.0 / trust.tests[k, s], MEAN_GAIN)
    if trust.tests[k, s] == 1:
        mean[k, s, MEAN_0], mean[k, s, MEAN_1], mean[k, s, MEAN_FACTOR] = 0.0, 0.0, 0.0
    mean[k, s, MEAN_0] += gain * (e0 - mean[k, s, MEAN_0])
    mean[k, s, MEAN_1] += gain * (e1 - mean[k, s, MEAN_1])
    f = (1.0 - gain) * (1.0 - gain) * mean[k, s, MEAN_FACTOR] + gain * gain
    mean[k, s, MEAN_FACTOR] = f
    a0, a1 = mean[k, s, MEAN_0] - d0, mean[k, s, MEAN_1] - d1
    off = squared_norm(f * s00 + b00, f * s01 + b01, f * s11 + b11, a0, a1)
    if off > CONTRADICTED:
        trust.verdict[k, s] = -1
        trust.runs[k, s] += 1
    elif off < AGREED:
        trust.verdict[k, s] = 1
        trust.runs[k, s] = 0
        trust.hits[k] += 1


@in_loop
def note_offset(
    k: int, s: int, h: Slope, e0: float, e1: float, r00: float, r01: float, r11: float,
    trust: Trust,
) -> None:  # fmt: skip
    """Keep what the mean ē of a sensor, of covariance R, says of an offset o with ē = H o."""
    i00, i01, i11 = inverse(r00, r01, r11)
    y0, y1 = i00 * e0 + i01 * e1, i01 * e0 + i11 * e1
    a0, a1 = i00 * h[0] + i01 * h[2], i01 * h[0] + i11 * h[2]
    b0, b1 = i00 * h[1] + i01 * h[3], i01 * h[1] + i11 * h[3]
    said = trust.said
    said[k, s, SAID_EE] = h[0] * a0 + h[2] * a1
    said[k, s, SAID_EN] = h[0] * b0 + h[2] * b1
    said[k, s, SAID_NN] = h[1] * b0 + h[3] * b1
    said[k, s, SAID_E] = h[0] * y0 + h[2] * y1
    said[k, s, SAID_N] = h[1] * y0 + h[3] * y1
    said[k, s, SAID_SQUARE] = e0 * y0 + e1 * y1


@in_loop
def common_offset(
    k: int, time: float, places: Integers, watch: Watch, trust: Trust
) -> tuple[bool, float]:
    """Return whether places that agree with each other measure the aircraft elsewhere, and by what.

    One offset o for all sensors, by least squares; what all of them share is added to its
    covariance.
    """
    ee, en, nn, e, n, square = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    first = -1
    several = False
    for s in range(places.shape[0]):
        if (
            watch.own[s] == 0
            and trust.tests[k, s] >= ELSEWHERE_TESTS
            and time - trust.judged[k, s] <= FRESH_TURNS * watch.period[s]
        ):
            ee += trust.said[k, s, SAID_EE]
            en += trust.said[k, s, SAID_EN]
            nn += trust.said[k, s, SAID_NN]
            e += trust.said[k, s, SAID_E]
            n += trust.said[k, s, SAID_N]
            square += trust.said[k, s, SAID_SQUARE]
            several = several or (first >= 0 and places[s] != first)
            first = places[s]
    p00, p01, p11 = inverse(ee, en, nn)
    o0, o1 = p00 * e + p01 * n, p01 * e + p11 * n
    left = square - (o0 * e + o1 * n)
    v0, v1 = trust.report[k, EAST_RATE], trust.report[k, NORTH_RATE]
    if np.isnan(v0):
        v0, v1 = 0.0, 0.0
    late = LATENCY_S * LATENCY_S
    common = COMMON_M * COMMON_M + trust.bent[k] * trust.bent[k]
    p00 += common + late * v0 * v0
    p01 += late * v0 * v1
    p11 += common + late * v1 * v1
    off = squared_norm(p00, p01, p11, o0, o1)
    contradicted = several and left <= CONSISTENT and ELSEWHERE < off < np.inf
    return contradicted, math.sqrt(o0 * o0 + o1 * o1)


@in_loop
def stands(k: int, place: int, time: float, places: Integers, watch: Watch, trust: Trust) -> int:
    """Return what the sensors at a place say of an aircraft: their verdicts that hold, summed."""
    total = 0
    for s in range(places.shape[0]):
        if (
            places[s] == place
            and watch.own[s] == 0
            and time - trust.judged[k, s] <= FRESH_TURNS * watch.period[s]
        ):
            total += trust.verdict[k, s]
    return total


@in_loop
def vote(k: int, time: float, places: Integers, watch: Watch, trust: Trust) -> tuple[bool, bool]:
    """Return whether the majority is against the reports of an aircraft, and whether for them.

    The aircraft has one vote, and so has each place. Where this leaves it open, the places that
    contradict win if each of them has done so for some turns and bears out most other aircraft.
    """
    against = 0
    agreeing = 0
    for place in range(places.shape[0]):
        says = stands(k, place, time, places, watch, trust)
        agreeing += says > 0
        against += says < 0
    lost = against > agreeing + 1
    if against == agreeing + 1:
        lost = True
        for place in range(places.shape[0]):
            if lost and stands(k, place, time, places, watch, trust) < 0:
                lost = is_borne_out(k, place, time, places, watch, trust)
    return lost, agreeing > against


@in_loop
def is_borne_out(
    k: int, place: int, time: float, places: Integers, watch: Watch, trust: Trust
) -> bool:
    """Return whether a place that contradicts an aircraft for long agrees with most others."""
    runs = 0
    for s in range(places.shape[0]):
        if places[s] == place:
            runs = max(runs, trust.runs[k, s])
    for_it = 0
    against_it = 0
    if runs >= LONE_RUNS:
        for other in range(trust.owner.shape[0]):
            if other != k and trust.owner[other] >= 0:
                says = stands(other, place, time, places, watch, trust)
                odd = 0
                for s in range(places.shape[0]):
                    if places[s] == place:
                        odd += trust.odd[other, s]
                for_it += says > 0 and odd == 0
                against_it += says < 0 or odd > 0
    return for_it >= CREDIT_MIN and for_it > against_it
