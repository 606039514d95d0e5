"""Plots of one rotating radar: aircraft on straight lines, and clutter at any time."""

import numpy as np

from multiradar.diagnosis.plots import Plots


def rotating_plots(
    *,
    aircraft: int = 20,
    clutter_share: float = 0.0,
    period_s: float = 5.0,
    seed: int = 1,
    duration_s: float = 300.0,
    identified: bool = True,
) -> Plots:
    """Return the plots of a radar, by time.

    Parameters
    ----------
    aircraft : int
        Number of aircraft.
    clutter_share : float
        Fraction of the plots that come at any time, from any direction.
    period_s : float
        Scan period, s.
    seed : int
        Of the traffic and the noise.
    duration_s : float
        Duration, s.
    identified : bool
        Whether plots of aircraft have a track number.
    """
    random = np.random.default_rng(seed)
    scans = int(duration_s / period_s)
    place = random.uniform(-80e3, 80e3, (aircraft, 2))
    course = random.uniform(0.0, 2.0 * np.pi, aircraft)
    velocity = 220.0 * np.column_stack([np.sin(course), np.cos(course)])
    scan, which = (one.ravel() for one in np.mgrid[:scans, :aircraft])
    time_s = scan * period_s
    for _ in range(3):
        east, north = (place[which] + velocity[which] * time_s[:, None]).T
        azimuth = np.arctan2(east, north) % (2.0 * np.pi)
        time_s = (scan + azimuth / (2.0 * np.pi)) * period_s
    azimuth_deg = (np.degrees(azimuth) + random.normal(0.0, 0.07, len(azimuth))) % 360.0
    range_m = np.hypot(east, north) + random.normal(0.0, 50.0, len(azimuth))
    number = which.astype(np.int64) if identified else np.full(len(which), -1)
    extra = int(len(time_s) * clutter_share / (1.0 - clutter_share))
    time_s = np.concatenate([time_s, random.uniform(0.0, duration_s, extra)])
    order = np.argsort(time_s, kind="stable")
    missing = np.full(len(time_s), np.nan)
    keys = np.full((len(time_s), 3), -1, np.int64)
    keys[: len(number), 0] = number
    height_m = np.concatenate([9000.0 + 30.0 * which, np.full(extra, np.nan)])
    return Plots(
        time_s,
        np.concatenate([range_m, random.uniform(5e3, 120e3, extra)]),
        np.concatenate([azimuth_deg, random.uniform(0.0, 360.0, extra)]),
        missing,
        missing,
        height_m,
        keys,
    ).select(order)
