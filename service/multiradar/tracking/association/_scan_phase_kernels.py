"""Compiled score of the time between two plots by the antenna rotation.

References
----------
The project's own: a rotating antenna detects an aircraft once per scan.
"""

import math

from multiradar_compiled.kernels import in_loop

# A plot with a larger deviation from a whole number of scans is unlikely to be of the aircraft.
PHASE_OFF = 0.2
# After more scans the phase is not known well enough.
PHASE_SCANS_MAX = 3.5
LOG_OFF_PHASE = -4.0


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
