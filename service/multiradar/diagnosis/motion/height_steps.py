"""Steps of reported heights, which show their unit.

Transponders report heights in steps of 25 or 100 ft: multiples of 7.62 m, of 25 ft, of 0.25 flight
levels. Whole metres are such multiples, rounded; other heights may have been smoothed.
"""

import numpy as np

from multiradar.diagnosis.plots import Floats
from multiradar_schemas.measurements.units import FOOT_M

#: No aircraft with a transponder flies higher than this, m.
HIGHEST_M = 23_000.0
#: Steps of transponders, ft, fraction of heights that are multiples, and how exactly.
STEP_FT, STEPPED_MIN, STEP_WITHIN = 25.0, 0.9, 0.02
STEP_M, FLIGHT_LEVEL_M = STEP_FT * FOOT_M, 100.0 * FOOT_M
#: Different heights that show a step, and a unit in which heights are whole numbers: those of a few
#: level flights may be so in metres.
_DIFFERENT_MIN, _WHOLE_MIN = 3, 10
#: Rounding error of whole numbers.
_ROUNDING = 0.501


def are_stepped(height: Floats, step: float) -> bool:
    """Return whether most values are multiples of a step."""
    off = np.abs((height / step + 0.5) % 1.0 - 0.5)
    return bool(np.mean(off <= STEP_WITHIN) >= STEPPED_MIN)


def are_in(height: Floats, metres: float) -> bool:
    """Return whether most heights in a unit of so many metres are those of transponders.

    Parameters
    ----------
    height : (n,) float64
        Known heights, as recorded.
    metres : float
        The unit, m.
    """
    step = STEP_M / metres
    different = len(np.unique(height))
    whole = bool((height == np.round(height)).all())
    if different < (_WHOLE_MIN if whole and metres > 1.0 else _DIFFERENT_MIN):
        return False
    # Whole numbers are multiples of a step near 1 in any case.
    within = _ROUNDING if whole and step > 4.0 * _ROUNDING else STEP_WITHIN * step
    off = np.abs((height / step + 0.5) % 1.0 - 0.5) * step
    return bool(np.mean(off <= within) >= STEPPED_MIN)
