"""Compiled terms of the score of a plot and a track: ground status, and rotation of the antenna.

Symbols as in `multiradar.tracking.association._association_kernels`.

References
----------
The project's own: a rotating antenna detects an aircraft once per scan.
"""

import math

import numpy as np

from multiradar.estimation.filters._ground_kernels import (
    ON_GROUND,
    UNKNOWN,
    height_of_row,
    reported_on_ground,
    settle_ground,
)
from multiradar.estimation.filters._kernels import UPDATED
from multiradar.estimation.filters.arrays import Aircraft, Model, Rows
from multiradar_compiled.kernels import in_loop

# On the ground against airborne, as evidence: the logarithm of the likelihood ratio. It is wrong at
# take-offs, landings and wrong statuses only.
STATUS_DIFFERENT = -4.0
# Difference of a pressure altitude and the height of the surface, m, by pressure.
PRESSURE_OFF_M = 400.0
# A plot with a larger deviation from a whole number of scans is unlikely to be of the aircraft.
PHASE_OFF = 0.2
# After more scans the phase is not known well enough.
PHASE_SCANS_MAX = 3.5
LOG_OFF_PHASE = -4.0


@in_loop
def height_to_locate(row: int, rows: Rows, model: Model) -> float:
    """Return the height at which a plot is located without a track, NaN for none."""
    received, site_height = rows.height[row], model.noises[rows.sensor[row], 3]
    grounded = reported_on_ground(rows.ground[row], received, site_height)
    return height_of_row(grounded, rows.kind[row], received, site_height)[1]


@in_loop
def paired_height(
    row: int, k: int, rows: Rows, site_height: float, aircraft: Aircraft
) -> tuple[int, float]:
    """Return kind and height of a plot for `check_height`, if it belongs to track k.

    Without a received height the position depends on the assumed height.
    """
    received = rows.height[row] if not np.isnan(aircraft.height[k]) else np.nan
    grounded = settle_ground(
        rows.ground[row], received, site_height, UPDATED, k, aircraft.on_ground, aircraft.mean,
        aircraft.covariance, aircraft.height, aircraft.vertical,
    )  # fmt: skip
    return height_of_row(grounded, rows.kind[row], received, site_height)


@in_loop
def height_apart(k: int, measured: float, aircraft: Aircraft) -> float:
    """Return the difference of a received height and that of track k, as far as it is evidence."""
    apart: float = abs(measured - aircraft.height[k])
    # The height of the surface is no pressure altitude.
    return max(apart - PRESSURE_OFF_M, 0.0) if aircraft.on_ground[k] == ON_GROUND else apart


@in_loop
def log_of_status(reported: int, status: int) -> float:
    """Return the score of the statuses of a plot and a track."""
    contradict = reported != UNKNOWN and status != UNKNOWN and reported != status
    return STATUS_DIFFERENT if contradict else 0.0


@in_loop
def log_scan_phase(since: float, period: float) -> float:
    """Return the score of the time since the last plot of a track by the same sensor.

    ``period`` is 0 where the scan period is unknown.
    """
    score = 0.0
    if since < PHASE_SCANS_MAX * period:
        scans = since / period
        if abs(scans - math.floor(scans + 0.5)) > PHASE_OFF:
            score = LOG_OFF_PHASE
    return score
