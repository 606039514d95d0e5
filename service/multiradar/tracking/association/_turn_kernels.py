"""Compiled: what the turn of an antenna says about whose a plot is.

References
----------
The project's own: an antenna that turns evenly meets an aircraft once a turn.
"""

import math

from multiradar_compiled.kernels import in_loop

# A plot so far, in turns, from a whole number of them after the last one is hardly of the aircraft.
PHASE_OFF = 0.2
# After more turns than these their length is not known well enough to tell.
PHASE_TURNS_MAX = 3.5
LOG_OFF_PHASE = -4.0


@in_loop
def log_of_phase(since: float, turn: float) -> float:
    """Return what the time since its last plot of a track says against another by one sensor.

    ``turn`` is 0 where it is not known.
    """
    score = 0.0
    if since < PHASE_TURNS_MAX * turn:
        turns = since / turn
        if abs(turns - math.floor(turns + 0.5)) > PHASE_OFF:
            score = LOG_OFF_PHASE
    return score
