"""Compiled statistics of each sensor: scans, innovations, azimuth patterns of innovations.

Every sum runs over rows in canonical order, so that it does not depend on batches.

Symbols: r = e / √S of a component, λ = scale of r (1 for the configured noise), W = configured
noise variance, b = B / S, A = design matrix of offsets, a gain and a site shift.

References
----------
P. J. Huber, "Robust estimation of a location parameter", The Annals of Mathematical Statistics 35
(1964), 73-101: effect of clipping. The project's own: selection of rows, and the count of scans.
"""

from math import cos, hypot, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    INNOVATION_BIASES,
    INNOVATION_COVARIANCE,
    REJECTED,
    RESTARTED,
    UPDATED,
)
from multiradar.estimation.filters.arrays import Aircraft, Result, Rows
from multiradar.estimation.measurement._kernels import is_bearing
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.tracking.health.health_sums import (
    GAIN_SCALE_M,
    LAST_TEST,
    LAST_UPDATE,
    PATTERNS,
    HealthSums,
)
from multiradar.tracking.lifecycle.lifecycle import BY_IDENTITY, CONFIRMED, Lifecycle
from multiradar.tracking.roster import RowIdentities
from multiradar_compiled.kernels import in_loop, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Bound of r² for the scale, and the mean of min(r², clip) of a normal r.
CLIP = 1.0
CLIPPED_MEAN = 0.516058
# Innovations beyond this number of sigmas are down-weighted in patterns, inversely to their size:
# for a large site error nearly all plots are there, and are rejected.
PATTERN_SIGMAS = 3.0
# Number of scans without a plot that count as an absence, not as missed detections.
MISSES_MAX = 8.0
# Number of scans for which a track counts as detected by a sensor, and bound of the evidence of one
# track for a silence: terrain may mask it.
RECENT_SCANS = 5.0
TRACK_EVIDENCE_MAX = 6.9
# Effective Earth radius for radio propagation, m: ITU-R P.834, section 3.
RADIO_RADIUS_M = 4.0 / 3.0 * 6_378_137.0
# Height above the radar assumed for aircraft without one, m.
DEFAULT_HEIGHT_M = 8_000.0


@loop
def gather(
    first: int,
    last: int,
    rows: Rows,
    result: Result,
    identities: RowIdentities,
    life: Lifecycle,
    noises: Floats,
    periods: Floats,
    confirm_updates: int,
    sums: HealthSums,
) -> None:
    """Add rows first…last to the sums."""
    slots, times, sensors, kinds, z = rows.slot, rows.time, rows.sensor, rows.kind, rows.z
    outcomes, innovations = result.outcome, result.innovation
    stages, track_ids = life.stage, identities.track_id
    for row in range(first, last):
        s, time, k = sensors[row], times[row], slots[row]
        if is_bearing(kinds[row]) and sums.last_plot[s] > -np.inf:
            # A radar that sends bearings only is not silent.
            sums.last_plot[s] = max(sums.last_plot[s], time)
        if kinds[row] != KIND_RADAR:
            continue
        sums.last_plot[s] = max(sums.last_plot[s], time)
        outcome = outcomes[row]
        accepted = outcome <= RESTARTED
        if k < 0 or not (accepted or outcome == REJECTED):
            continue
        if sums.owner[k] != track_ids[row]:
            sums.owner[k] = track_ids[row]
            sums.updates[k] = 0
            for sensor in range(sums.seen.shape[1]):
                sums.seen[k, sensor, LAST_UPDATE] = -np.inf
                sums.seen[k, sensor, LAST_TEST] = -np.inf
        known = stages[k] == CONFIRMED
        if stages[k] == BY_IDENTITY:
            known = sums.updates[k] >= confirm_updates
        sums.updates[k] += accepted
        compared = (outcome in (UPDATED, REJECTED)) and not np.isnan(innovations[row, 0])
        if known and compared and sums.seen[k, s, LAST_TEST] < sums.opened[s]:
            keep_innovation(innovations[row], s, sums)
            sums.seen[k, s, LAST_TEST] = time
        if known and outcome == UPDATED and compared:
            weigh_noise(innovations[row], noises[s], s, sums)
        if known and compared:
            weigh_pattern(innovations[row], z[row, 0], z[row, 1], s, sums)
        if accepted:
            if known:
                count_scans((time - sums.seen[k, s, LAST_UPDATE]) / periods[s], s, sums)
            sums.seen[k, s, LAST_UPDATE] = time


@in_loop
def count_scans(scans: float, s: int, sums: HealthSums) -> None:
    """Count the scans from one update of a track to the next by the same sensor."""
    if 0.5 < scans < MISSES_MAX + 0.5:
        sums.hits[s] += 1.0
        sums.scans[s] += np.floor(scans + 0.5)


@in_loop
def keep_innovation(innovation: Floats, s: int, sums: HealthSums) -> None:
    """Store the first innovation of an aircraft in the open window."""
    at = sums.tested[s]
    if at < sums.values.shape[2]:
        sums.values[s, 0, at] = innovation[0] / sqrt(innovation[INNOVATION_COVARIANCE])
        sums.values[s, 1, at] = innovation[1] / sqrt(innovation[INNOVATION_COVARIANCE + 2])
        sums.tested[s] += 1
    if not np.isnan(innovation[INNOVATION_BIASES]):
        sums.common[s, 0] += innovation[INNOVATION_BIASES] / innovation[INNOVATION_COVARIANCE]
        sums.common[s, 1] += (
            innovation[INNOVATION_BIASES + 2] / innovation[INNOVATION_COVARIANCE + 2]
        )
        sums.commons[s] += 1


@in_loop
def weigh_noise(innovation: Floats, noise: Floats, s: int, sums: HealthSums) -> None:
    """Add clipped r²/λ², and the fraction of the configured noise in S."""
    for i in range(2):
        if sums.settled[s, i] == 0:
            continue
        variance = innovation[INNOVATION_COVARIANCE + 2 * i]
        square = innovation[i] * innovation[i] / variance
        sums.clipped[s, i] += min(square / sums.scale[s, i], CLIP)
        sums.noise_share[s, i] += min(noise[i] / variance, 1.0)
        sums.noises[s, i] += 1.0


@in_loop
def weigh_pattern(
    innovation: Floats, range_m: float, azimuth: float, s: int, sums: HealthSums
) -> None:
    """Add Aᵀ S⁻¹ A and Aᵀ S⁻¹ e, component by component.

    A site configured at s − d makes ranges too long by −d · u (u: away from the radar) and rotates
    azimuths by −d · t / ρ (t: to the right of u), for d = true − configured.
    """
    w0 = 1.0 / innovation[INNOVATION_COVARIANCE]
    w1 = 1.0 / innovation[INNOVATION_COVARIANCE + 2]
    e0, e1 = innovation[0], innovation[1]
    settled = sums.settled[s, 0] * sums.settled[s, 1]
    if settled == 0 or not range_m > 0.0:
        return
    far = sqrt(max(e0 * e0 * w0, e1 * e1 * w1))
    weight = min(PATTERN_SIGMAS / max(far, PATTERN_SIGMAS), 1.0)
    w0 *= weight
    w1 *= weight
    east, north = sin(azimuth), cos(azimuth)
    a0 = (1.0, 0.0, range_m / GAIN_SCALE_M, -east, -north)
    a1 = (0.0, 1.0, 0.0, -north / range_m, east / range_m)
    at = 0
    for i in range(PATTERNS):
        sums.pattern_vector[s, i] += w0 * a0[i] * e0 + w1 * a1[i] * e1
        for j in range(i, PATTERNS):
            sums.pattern[s, at] += w0 * a0[i] * a0[j] + w1 * a1[i] * a1[j]
            at += 1


@loop
def count_coverage(
    time_s: float,
    aircraft: Aircraft,
    track_ids: Integers,
    life: Lifecycle,
    confirm_updates: int,
    fresh_s: float,
    sites: Floats,
    reach: Floats,
    periods: Floats,
    cone_ratio: float,
    misses: Floats,
    sums: HealthSums,
    cover: Integers,
    evidence: Floats,
) -> None:
    """Count the tracks in coverage of each sensor and those detected; evaluate its silence.

    ``misses`` is the log odds of a missed detection, ``cover`` receives both counts, ``evidence``
    the sum of these odds over the tracks that a silent sensor detected last.
    """
    for k in range(track_ids.shape[0]):
        if track_ids[k] < 0 or track_ids[k] != sums.owner[k] or np.isnan(aircraft.time[k]):
            continue
        known = life.stage[k] == CONFIRMED
        if life.stage[k] == BY_IDENTITY:
            known = sums.updates[k] >= confirm_updates
        if not known:
            continue
        height = aircraft.height[k]
        for s in range(sites.shape[0]):
            if np.isnan(sites[s, 0]):
                continue
            heard = sums.seen[k, s, LAST_UPDATE]
            if aircraft.updated[k] >= time_s - fresh_s:
                ground = hypot(aircraft.mean[k, 0] - sites[s, 0], aircraft.mean[k, 1] - sites[s, 1])
                if within(ground, height, sites[s, 2], reach[s], cone_ratio):
                    cover[s, 0] += 1
                    cover[s, 1] += heard >= time_s - RECENT_SCANS * periods[s]
            if heard >= sums.last_plot[s] - RECENT_SCANS * periods[s]:
                scans = np.floor((aircraft.updated[k] - heard) / periods[s])
                if scans >= 1.0:
                    evidence[s] += min(scans * misses[s], TRACK_EVIDENCE_MAX)


@in_loop
def within(
    ground: float, height: float, site_height: float, reach: float, cone_ratio: float
) -> bool:
    """Return whether a radar covers a position: in range, above the horizon, not in the cone."""
    top = DEFAULT_HEIGHT_M if np.isnan(height) else height
    horizon = sqrt(2.0 * RADIO_RADIUS_M) * (sqrt(max(top, 0.0)) + sqrt(max(site_height, 0.0)))
    return ground <= min(reach, horizon) and ground >= cone_ratio * (top - site_height)
