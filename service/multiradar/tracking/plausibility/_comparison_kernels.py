"""Compiled comparison of ADS-B reports with plots of radars and multilateration.

Symbols: e = plot minus its prediction by the reports, ē = fading mean of e, f = variance of that
mean relative to that of one plot, S = covariance of the random errors, B = covariance of the errors
common to all plots of a sensor.

A sensor contradicts when ēᵀ (f S + B)⁻¹ ē is above `CONTRADICTED`, and agrees below `AGREED`. A
single plot far from the mean counts only when the next one confirms it. Sensors at one site have
one vote, and so has the aircraft. Sites that agree with each other on one offset of the reports
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
    Slope,
    bias_column,
    bias_spread,
    expected_measurement,
    measures_azimuth,
)
from multiradar.estimation.measurement.kinds import KIND_POSITION, KIND_RADAR
from multiradar.geodesy._kernels import wrap_angle
from multiradar.tracking.lifecycle.report_integrity import (
    EAST,
    EAST_RATE,
    EVIDENCE_E,
    EVIDENCE_EE,
    EVIDENCE_EN,
    EVIDENCE_N,
    EVIDENCE_NN,
    EVIDENCE_SQUARE,
    MEAN_0,
    MEAN_1,
    MEAN_FACTOR,
    MEAN_VARIANCE,
    NORTH,
    NORTH_RATE,
    PLOT_HEIGHT,
    PLOT_TIME,
    PLOT_VARIANCE,
    PLOT_Z0,
    PLOT_Z1,
    SIGMA,
    TIME,
    ReportIntegrity,
    Watch,
)
from multiradar_compiled.kernels import in_loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Acceleration of aircraft between two reports, m/s²: this multiple of the observed change of the
# rates, plus a minimum, up to a maximum.
BETWEEN_FACTOR = 1.5
BETWEEN_LEAST = 1.0
BETWEEN_MOST = 12.0
# Errors common to all plots of an aircraft by a sensor: of time stamps, s, of positions, m, of
# heights, m. One sigma each.
LATENCY_S = 0.4
COMMON_M = 40.0
COMMON_HEIGHT_M = 60.0
# Minimum weight of the newest comparison in the mean.
MEAN_GAIN = 0.5
# Bounds of normalised squares with two degrees of freedom: the fraction exp(−x / 2) exceeds x by
# chance.
CONTRADICTED = 20.0
AGREED = 9.0
# Bound for one offset common to all sites, dominated by their common errors, and the minimum number
# of comparisons.
ELSEWHERE = 16.0
ELSEWHERE_TESTS = 2
FAR_FROM_MEAN = 30.0
# Ratio of the variance of reported positions below which a mean of earlier ones starts again.
MORE_ACCURATE = 0.25
# Maximum residual of the differences of all sensors after subtracting the common offset.
CONSISTENT = 30.0
# Number of scans for which a comparison remains valid.
FRESH_SCANS = 3.5
# Number of contradicting scans after which a single credible site outvotes an aircraft.
LONE_CONTRADICTIONS = 3
# Number of other aircraft with which a credible site must agree.
CREDIT_MIN = 2


@in_loop
def compare_all(
    k: int, time: float, east: float, north: float, height: float, sigma: float, base: Floats,
    model: Model, bias: Floats, bias_covariance: Floats, watch: Watch, integrity: ReportIntegrity,
) -> tuple[int, float]:  # fmt: skip
    """Compare the plots between two reports; return how many, and the largest offset, m."""
    compared = 0
    offset = 0.0
    integrity.deviation[k] = max(
        0.5 * integrity.deviation[k], path_deviation(k, time, east, north, base)
    )
    for s in range(watch.kind.shape[0]):
        for i in range(integrity.waiting[k, s]):
            if base[k, TIME] <= integrity.plot[k, s, i, PLOT_TIME] <= time:
                done, off = compare(
                    k, s, i, time, east, north, height, sigma, base, model, bias, bias_covariance,
                    watch.kind[s], integrity,
                )  # fmt: skip
                compared += done
                offset = max(offset, off)
    return compared, offset


@in_loop
def path_deviation(k: int, time: float, east: float, north: float, base: Floats) -> float:
    """Return how far, m, the path between two reports may deviate from a straight line."""
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
    base: Floats, model: Model, bias: Floats, bias_covariance: Floats, kind: int,
    integrity: ReportIntegrity,
) -> tuple[int, float]:  # fmt: skip
    """Compare a plot with the path between two reports; return 1 if possible, and ē, m."""
    plot_time = integrity.plot[k, s, i, PLOT_TIME]
    elapsed = time - base[k, TIME]
    share = (plot_time - base[k, TIME]) / elapsed
    v0 = (east - base[k, EAST]) / elapsed
    v1 = (north - base[k, NORTH]) / elapsed
    x0 = base[k, EAST] + share * (east - base[k, EAST])
    x1 = base[k, NORTH] + share * (north - base[k, NORTH])
    before = base[k, SIGMA] / sigma
    random = sigma * sigma * (share * share + before * before * (1.0 - share) * (1.0 - share))
    tall, variance = choose_height(integrity.plot[k, s, i, PLOT_HEIGHT], height, model.options)
    variance += COMMON_HEIGHT_M * COMMON_HEIGHT_M
    site, noise = model.sites[s], model.noises[s]
    p0, p1, ground, h, w = expected_measurement(
        kind, model.plane, site, noise, x0, x1, tall, variance
    )
    reported = sigma * sigma * max(before * before, 1.0)
    if kind == KIND_POSITION:
        own = integrity.plot[k, s, i, PLOT_VARIANCE]
        w = (own, 0.0, own)
        reported += own
    e0 = integrity.plot[k, s, i, PLOT_Z0] - p0
    e1 = integrity.plot[k, s, i, PLOT_Z1] - p1
    if measures_azimuth(kind):
        e1 = wrap_angle(e1)
    r0 = h[0] * v0 + h[1] * v1
    r1 = h[2] * v0 + h[3] * v1
    # Kept separate: initially the bias estimates change faster than the mean.
    d0, d1 = 0.0, 0.0
    first, last = model.starts[s], model.starts[s + 1]
    for c in range(first, last):
        j0, j1 = bias_column(kind, model.parameters[c], site, p0, p1, r0, r1)
        d0 += j0 * bias[c]
        d1 += j1 * bias[c]
    b = bias_spread(kind, site, first, last, model.parameters, bias_covariance, p0, p1, r0, r1)
    m00, m01, m11 = h[0] * h[0] + h[1] * h[1], h[0] * h[2] + h[1] * h[3], h[2] * h[2] + h[3] * h[3]
    late = LATENCY_S * LATENCY_S
    common = COMMON_M * COMMON_M + integrity.deviation[k] * integrity.deviation[k]
    c00 = b[0] + common * m00 + late * r0 * r0
    c01 = b[1] + common * m01 + late * r0 * r1
    c11 = b[2] + common * m11 + late * r1 * r1
    s00, s01, s11 = w[0] + random * m00, w[1] + random * m01, w[2] + random * m11
    usable = not ground < model.options[CONE_RATIO] * (tall - noise[3])
    usable = usable and math.isfinite(e0) and math.isfinite(e1)
    offset = 0.0
    if usable:
        if reported < MORE_ACCURATE * integrity.mean[k, s, MEAN_VARIANCE]:
            integrity.tests[k, s] = 0
        note_comparison(k, s, e0, e1, d0, d1, s00, s01, s11, c00, c01, c11, integrity)
        if integrity.tests[k, s] <= 1 or reported > integrity.mean[k, s, MEAN_VARIANCE]:
            integrity.mean[k, s, MEAN_VARIANCE] = reported
        f = integrity.mean[k, s, MEAN_FACTOR]
        d0, d1 = integrity.mean[k, s, MEAN_0] - d0, integrity.mean[k, s, MEAN_1] - d1
        note_offset(k, s, h, d0, d1, f * s00 + b[0], f * s01 + b[1], f * s11 + b[2], integrity)
        integrity.compared_at[k, s] = plot_time
        if integrity.agreement[k, s] < 0:
            across = p0 if kind == KIND_RADAR else 1.0
            offset = math.hypot(d0, across * d1)
    return int(usable), offset


@in_loop
def note_comparison(
    k: int, s: int, e0: float, e1: float, d0: float, d1: float, s00: float, s01: float, s11: float,
    b00: float, b01: float, b11: float, integrity: ReportIntegrity,
) -> None:  # fmt: skip
    """Add a difference to the mean of its sensor, unless it is a single outlier.

    ``d0`` and ``d1`` are its parts due to biases.
    """
    mean = integrity.mean
    if integrity.tests[k, s] > 0:
        g = 1.0 + mean[k, s, MEAN_FACTOR]
        a0, a1 = e0 - mean[k, s, MEAN_0], e1 - mean[k, s, MEAN_1]
        far = squared_norm(g * s00, g * s01, g * s11, a0, a1) > FAR_FROM_MEAN
    else:
        far = squared_norm(s00 + b00, s01 + b01, s11 + b11, e0 - d0, e1 - d1) > CONTRADICTED
    if far and integrity.outliers[k, s] == 0:
        integrity.outliers[k, s] = 1
        return
    if far:
        integrity.tests[k, s] = 0
    integrity.contradictions[k, s] += integrity.outliers[k, s]
    integrity.outliers[k, s] = 0
    integrity.tests[k, s] += 1
    gain = max(1.0 / integrity.tests[k, s], MEAN_GAIN)
    if integrity.tests[k, s] == 1:
        mean[k, s, MEAN_0], mean[k, s, MEAN_1], mean[k, s, MEAN_FACTOR] = 0.0, 0.0, 0.0
    mean[k, s, MEAN_0] += gain * (e0 - mean[k, s, MEAN_0])
    mean[k, s, MEAN_1] += gain * (e1 - mean[k, s, MEAN_1])
    f = (1.0 - gain) * (1.0 - gain) * mean[k, s, MEAN_FACTOR] + gain * gain
    mean[k, s, MEAN_FACTOR] = f
    a0, a1 = mean[k, s, MEAN_0] - d0, mean[k, s, MEAN_1] - d1
    off = squared_norm(f * s00 + b00, f * s01 + b01, f * s11 + b11, a0, a1)
    if off > CONTRADICTED:
        integrity.agreement[k, s] = -1
        integrity.contradictions[k, s] += 1
    elif off < AGREED:
        integrity.agreement[k, s] = 1
        integrity.contradictions[k, s] = 0
        integrity.hits[k] += 1


@in_loop
def note_offset(
    k: int, s: int, h: Slope, e0: float, e1: float, r00: float, r01: float, r11: float,
    integrity: ReportIntegrity,
) -> None:  # fmt: skip
    """Store the information of ē, with covariance R, on an offset o with ē = H o."""
    i00, i01, i11 = inverse(r00, r01, r11)
    y0, y1 = i00 * e0 + i01 * e1, i01 * e0 + i11 * e1
    a0, a1 = i00 * h[0] + i01 * h[2], i01 * h[0] + i11 * h[2]
    b0, b1 = i00 * h[1] + i01 * h[3], i01 * h[1] + i11 * h[3]
    evidence = integrity.evidence
    evidence[k, s, EVIDENCE_EE] = h[0] * a0 + h[2] * a1
    evidence[k, s, EVIDENCE_EN] = h[0] * b0 + h[2] * b1
    evidence[k, s, EVIDENCE_NN] = h[1] * b0 + h[3] * b1
    evidence[k, s, EVIDENCE_E] = h[0] * y0 + h[2] * y1
    evidence[k, s, EVIDENCE_N] = h[1] * y0 + h[3] * y1
    evidence[k, s, EVIDENCE_SQUARE] = e0 * y0 + e1 * y1


@in_loop
def common_offset(
    k: int, time: float, site_numbers: Integers, watch: Watch, integrity: ReportIntegrity
) -> tuple[bool, float]:
    """Return whether sites agree on another position of the aircraft, and its distance.

    One offset o for all sensors, by least squares; their common errors are added to its covariance.
    """
    ee, en, nn, e, n, square = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    first = -1
    several = False
    for s in range(site_numbers.shape[0]):
        if (
            watch.self_reported[s] == 0
            and integrity.tests[k, s] >= ELSEWHERE_TESTS
            and time - integrity.compared_at[k, s] <= FRESH_SCANS * watch.period[s]
        ):
            ee += integrity.evidence[k, s, EVIDENCE_EE]
            en += integrity.evidence[k, s, EVIDENCE_EN]
            nn += integrity.evidence[k, s, EVIDENCE_NN]
            e += integrity.evidence[k, s, EVIDENCE_E]
            n += integrity.evidence[k, s, EVIDENCE_N]
            square += integrity.evidence[k, s, EVIDENCE_SQUARE]
            several = several or (first >= 0 and site_numbers[s] != first)
            first = site_numbers[s]
    p00, p01, p11 = inverse(ee, en, nn)
    o0, o1 = p00 * e + p01 * n, p01 * e + p11 * n
    left = square - (o0 * e + o1 * n)
    v0, v1 = integrity.report[k, EAST_RATE], integrity.report[k, NORTH_RATE]
    if np.isnan(v0):
        v0, v1 = 0.0, 0.0
    late = LATENCY_S * LATENCY_S
    common = COMMON_M * COMMON_M + integrity.deviation[k] * integrity.deviation[k]
    p00 += common + late * v0 * v0
    p01 += late * v0 * v1
    p11 += common + late * v1 * v1
    off = squared_norm(p00, p01, p11, o0, o1)
    contradicted = several and left <= CONSISTENT and ELSEWHERE < off < np.inf
    return contradicted, math.sqrt(o0 * o0 + o1 * o1)


@in_loop
def site_agreement(
    k: int,
    site_number: int,
    time: float,
    site_numbers: Integers,
    watch: Watch,
    integrity: ReportIntegrity,
) -> int:
    """Return the sum of the valid comparison results of the sensors at a site."""
    total = 0
    for s in range(site_numbers.shape[0]):
        if site_numbers[s] == site_number and is_valid(k, s, time, watch, integrity):
            total += integrity.agreement[k, s]
    return total


@in_loop
def is_valid(k: int, s: int, time: float, watch: Watch, integrity: ReportIntegrity) -> bool:
    """Return whether the comparison with a sensor is still valid."""
    fresh: bool = time - integrity.compared_at[k, s] <= FRESH_SCANS * watch.period[s]
    return fresh and watch.self_reported[s] == 0


@in_loop
def leads_site(
    k: int, s: int, time: float, site_numbers: Integers, watch: Watch, integrity: ReportIntegrity
) -> bool:
    """Return whether a sensor is the first at its site with a valid comparison.

    Few of many sensors are: a loop over all sites for each of them would cost their square.
    """
    leads = 0 <= site_numbers[s] < site_numbers.shape[0] and is_valid(k, s, time, watch, integrity)
    if leads:
        for other in range(s):
            if site_numbers[other] == site_numbers[s] and is_valid(
                k, other, time, watch, integrity
            ):
                leads = False
    return leads


@in_loop
def vote(
    k: int, time: float, site_numbers: Integers, watch: Watch, integrity: ReportIntegrity
) -> tuple[bool, bool]:
    """Return whether the majority contradicts the reports of an aircraft, and whether it agrees.

    The aircraft has one vote, and so has each site. With equal votes the contradicting sites win if
    each has contradicted for some scans and agrees with most other aircraft.
    """
    against = 0
    agreeing = 0
    for s in range(site_numbers.shape[0]):
        if leads_site(k, s, time, site_numbers, watch, integrity):
            agreement = site_agreement(k, site_numbers[s], time, site_numbers, watch, integrity)
            agreeing += agreement > 0
            against += agreement < 0
    lost = against > agreeing + 1
    if against == agreeing + 1:
        lost = True
        for s in range(site_numbers.shape[0]):
            if lost and leads_site(k, s, time, site_numbers, watch, integrity):
                number = site_numbers[s]
                if site_agreement(k, number, time, site_numbers, watch, integrity) < 0:
                    lost = is_credible(k, number, time, site_numbers, watch, integrity)
    return lost, agreeing > against


@in_loop
def is_credible(
    k: int,
    site_number: int,
    time: float,
    site_numbers: Integers,
    watch: Watch,
    integrity: ReportIntegrity,
) -> bool:
    """Return whether a site that keeps contradicting an aircraft agrees with most others."""
    contradictions = 0
    for s in range(site_numbers.shape[0]):
        if site_numbers[s] == site_number:
            contradictions = max(contradictions, integrity.contradictions[k, s])
    for_it = 0
    against_it = 0
    if contradictions >= LONE_CONTRADICTIONS:
        for other in range(integrity.owner.shape[0]):
            if other != k and integrity.owner[other] >= 0:
                agreement = site_agreement(other, site_number, time, site_numbers, watch, integrity)
                outliers = 0
                for s in range(site_numbers.shape[0]):
                    if site_numbers[s] == site_number:
                        outliers += integrity.outliers[other, s]
                for_it += agreement > 0 and outliers == 0
                against_it += agreement < 0 or outliers > 0
    return for_it >= CREDIT_MIN and for_it > against_it
