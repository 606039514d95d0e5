"""Compiled sums of what the tracker sees of each sensor: looks, innovations, patterns over azimuth.

Every sum runs over rows in their canonical order, one after the other, so that it is the same
however the rows come in batches.

Symbols: r = e / √S of a component, λ = scale of r (1 where the noise is as told), W = variance of
the noise as told, b = B / S, A = how offsets, a gain and a shift of the site enter an innovation.

References
----------
P. J. Huber, "Robust estimation of a location parameter", The Annals of Mathematical Statistics 35
(1964), 73-101: what clipping does. The project's own: which rows count, and the looks.
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
from multiradar.estimation.measurement._kernels import KIND_RADAR, is_bearing
from multiradar.tracking.health.health_sums import GAIN_SCALE_M, HEARD, JUDGED, PATTERNS, HealthSums
from multiradar.tracking.lifecycle.lifecycle import BY_IDENTITY, CONFIRMED, Lifecycle
from multiradar.tracking.roster import RowIdentities
from multiradar_compiled.kernels import in_loop, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Where r² is clipped for the scale, and the mean of min(r², clip) of a normal r.
CLIP = 1.0
CLIPPED_MEAN = 0.516058
# Innovations beyond this many sigmas speak of a pattern with less weight, inversely to their size:
# a site that is far off has nearly all of its plots there, and they are rejected.
PATTERN_SIGMAS = 3.0
# So many turns without a plot are an absence, not misses.
MISSES_MAX = 8.0
# A track counts as heard by a sensor for so many turns, and one track says no more than this about
# a silence: it may have flown behind a hill.
RECENT_TURNS = 5.0
TRACK_EVIDENCE_MAX = 6.9
# Radius of the Earth on which rays of radio are straight, m: ITU-R P.834, section 3.
RADIO_RADIUS_M = 4.0 / 3.0 * 6_378_137.0
# Height above its radar taken for an aircraft of which none was heard, m.
USUAL_HEIGHT_M = 8_000.0


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
            # A radar that has lost the range is not silent.
            sums.last_plot[s] = max(sums.last_plot[s], time)
        if kinds[row] != KIND_RADAR:
            continue
        sums.last_plot[s] = max(sums.last_plot[s], time)
        outcome = outcomes[row]
        taken = outcome <= RESTARTED
        if k < 0 or not (taken or outcome == REJECTED):
            continue
        if sums.owner[k] != track_ids[row]:
            sums.owner[k] = track_ids[row]
            sums.updates[k] = 0
            for sensor in range(sums.seen.shape[1]):
                sums.seen[k, sensor, HEARD] = -np.inf
                sums.seen[k, sensor, JUDGED] = -np.inf
        known = stages[k] == CONFIRMED
        if stages[k] == BY_IDENTITY:
            known = sums.updates[k] >= confirm_updates
        sums.updates[k] += taken
        compared = (outcome in (UPDATED, REJECTED)) and not np.isnan(innovations[row, 0])
        if known and compared and sums.seen[k, s, JUDGED] < sums.opened[s]:
            judge(innovations[row], s, sums)
            sums.seen[k, s, JUDGED] = time
        if known and outcome == UPDATED and compared:
            weigh_noise(innovations[row], noises[s], s, sums)
        if known and compared:
            weigh_pattern(innovations[row], z[row, 0], z[row, 1], s, sums)
        if taken:
            if known:
                count_looks((time - sums.seen[k, s, HEARD]) / periods[s], s, sums)
            sums.seen[k, s, HEARD] = time


@in_loop
def count_looks(turns: float, s: int, sums: HealthSums) -> None:
    """Count the looks from one update of a track to the next by the same sensor."""
    if 0.5 < turns < MISSES_MAX + 0.5:
        sums.hits[s] += 1.0
        sums.looks[s] += np.floor(turns + 0.5)


@in_loop
def judge(innovation: Floats, s: int, sums: HealthSums) -> None:
    """Keep the first innovation of an aircraft in the window that is open."""
    at = sums.judged[s]
    if at < sums.values.shape[2]:
        sums.values[s, 0, at] = innovation[0] / sqrt(innovation[INNOVATION_COVARIANCE])
        sums.values[s, 1, at] = innovation[1] / sqrt(innovation[INNOVATION_COVARIANCE + 2])
        sums.judged[s] += 1
    if not np.isnan(innovation[INNOVATION_BIASES]):
        sums.common[s, 0] += innovation[INNOVATION_BIASES] / innovation[INNOVATION_COVARIANCE]
        sums.common[s, 1] += (
            innovation[INNOVATION_BIASES + 2] / innovation[INNOVATION_COVARIANCE + 2]
        )
        sums.commons[s] += 1


@in_loop
def weigh_noise(innovation: Floats, noise: Floats, s: int, sums: HealthSums) -> None:
    """Add r²/λ², clipped, and the part of S that the noise as told is."""
    for i in range(2):
        if sums.settled[s, i] == 0:
            continue
        variance = innovation[INNOVATION_COVARIANCE + 2 * i]
        square = innovation[i] * innovation[i] / variance
        sums.clipped[s, i] += min(square / sums.scale[s, i], CLIP)
        sums.told[s, i] += min(noise[i] / variance, 1.0)
        sums.noises[s, i] += 1.0


@in_loop
def weigh_pattern(
    innovation: Floats, range_m: float, azimuth: float, s: int, sums: HealthSums
) -> None:
    """Add Aᵀ S⁻¹ A and Aᵀ S⁻¹ e, component by component.

    A site that is told at s − d makes ranges too long by −d · u (u: away from the radar) and turns
    azimuths by −d · t / ρ (t: to the right of u), for d = true − told.
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
def look_around(
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
    """Count the tracks in cover of each sensor, those that it hears, and what its silence says.

    ``misses`` is the logarithm of the odds against a missed look, ``cover`` gets both counts,
    ``evidence`` the sum of these odds over the tracks that a silent sensor heard last.
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
            heard = sums.seen[k, s, HEARD]
            if aircraft.updated[k] >= time_s - fresh_s:
                ground = hypot(aircraft.mean[k, 0] - sites[s, 0], aircraft.mean[k, 1] - sites[s, 1])
                if within(ground, height, sites[s, 2], reach[s], cone_ratio):
                    cover[s, 0] += 1
                    cover[s, 1] += heard >= time_s - RECENT_TURNS * periods[s]
            if heard >= sums.last_plot[s] - RECENT_TURNS * periods[s]:
                turns = np.floor((aircraft.updated[k] - heard) / periods[s])
                if turns >= 1.0:
                    evidence[s] += min(turns * misses[s], TRACK_EVIDENCE_MAX)


@in_loop
def within(
    ground: float, height: float, site_height: float, reach: float, cone_ratio: float
) -> bool:
    """Return whether a radar should see a place: in range, above the horizon, outside the cone."""
    top = USUAL_HEIGHT_M if np.isnan(height) else height
    horizon = sqrt(2.0 * RADIO_RADIUS_M) * (sqrt(max(top, 0.0)) + sqrt(max(site_height, 0.0)))
    return ground <= min(reach, horizon) and ground >= cone_ratio * (top - site_height)
