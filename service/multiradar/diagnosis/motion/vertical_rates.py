"""Heights in feet, by the rates at which aircraft climb and the steps in which they report.

Transponders report heights in steps of 25 or 100 ft, which no multiple of 25 m is. Half of the
climbs and descents of real traffic are slower than 8 m/s (1600 ft/min), from gliders to jets.
"""

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.model import Diagnosis, Severity
from multiradar.diagnosis.motion.height_steps import STEP_FT, are_in
from multiradar.diagnosis.plots import Booleans, Floats, Integers
from multiradar_schemas.measurements.units import FOOT_M

#: Time between two heights from which a rate is computed, s; slower changes are level flight, m/s.
APART_MIN_S, APART_MAX_S, CLIMBING_MPS = 30.0, 60.0, 1.5
#: Median rate above which heights in steps of feet are in feet, and any heights are, m/s.
FAST_MPS, IMPOSSIBLE_MPS = 9.0, 14.0
#: Rate of which no aircraft is capable, m/s, even if its heights are in feet; time between
#: successive heights, s; fraction that jumps by more where heights are those of other aircraft. Of
#: right heights, 0 to 3.5 % do (garbled codes).
JUMP_MPS, JUMP_MIN_S, JUMP_MAX_S, JUMPING_MIN = 150.0, 1.0, 15.0, 0.05
#: Fraction from which on those that do not jump show nothing.
JUMPING_MANY = 0.2
#: Fewer climbing aircraft show nothing. One that climbs less of the time has garbled heights.
CLIMBING_MIN, CLIMBING_SHARE_MIN = 3, 0.15
#: Usual climbs after conversion, m/s: feet explain no faster ones.
USUAL_MPS = 8.0
#: Heights scatter if this fraction is off the line between the heights before and after by more
#: than the first, m, and an acceleration, m/s²; longest time to the next height, s; least number,
#: also of aircraft. Of right heights, up to 4 % are (garbled codes).
SCATTER_MIN, SCATTER_M, SCATTER_MPS2, SCATTER_MAX_S = 0.25, 150.0, 2.0, 15.0
SCATTER_HEIGHTS_MIN, SCATTER_AIRCRAFT_MIN = 100, 3


def check_vertical_rates(
    name: str, time_s: Floats, height_m: Floats, aircraft: Integers
) -> Diagnosis | None:
    """Diagnose heights in feet by the median rate of climbs and descents.

    Parameters
    ----------
    name : str
        The sensor.
    time_s, height_m : (n,) float64
        Times and heights; NaN where missing.
    aircraft : (n,) int64
        Aircraft of each; −1 where unknown.
    """
    known = np.isfinite(height_m) & (aircraft >= 0)
    order = np.lexsort((time_s[known], aircraft[known]))
    time_s, height_m = time_s[known][order], height_m[known][order]
    aircraft = aircraft[known][order]
    first, last = pairs_apart(time_s, aircraft, APART_MIN_S, APART_MAX_S)
    rate_mps = np.abs(height_m[last] - height_m[first]) / (time_s[last] - time_s[first])
    climbing = rate_mps > CLIMBING_MPS
    _, place = np.unique(aircraft[first], return_inverse=True)
    share = np.bincount(place, climbing) / np.bincount(place)
    climbing &= share[place] >= CLIMBING_SHARE_MIN
    if np.count_nonzero(climbing) < TESTED_MIN:
        return None
    if len(np.unique(aircraft[first[climbing]])) < CLIMBING_MIN:
        return None
    in_feet = are_in(height_m, FOOT_M) and not are_in(height_m, 1.0)
    limit_mps = FAST_MPS if in_feet else IMPOSSIBLE_MPS
    jumps, compared = _jumps(time_s, height_m, aircraft)
    until = np.concatenate([[0], np.cumsum(jumps)])
    steady = climbing & (until[first] == until[last])
    median_mps = float(np.median(rate_mps[steady])) if steady.any() else 0.0
    jumping = np.count_nonzero(jumps) / max(compared, 1)
    usable = jumping < JUMPING_MANY and np.count_nonzero(steady) >= TESTED_MIN
    if usable and (are_in(height_m, 1.0) or median_mps * FOOT_M > USUAL_MPS):
        # Fighters climb at 80 m/s.
        return None
    if not usable or median_mps <= limit_mps:
        if jumping < JUMPING_MIN or np.median(rate_mps[climbing]) <= limit_mps:
            return None
        return _of_other_rows(name, jumping)
    steps = f", and they are multiples of {STEP_FT:.0f}" if in_feet else ""
    severity: Severity = "error" if in_feet else "warning"
    return Diagnosis(
        name,
        "height_unit",
        f"{name}: its heights are probably in feet: half of the climb and descent rates exceed "
        f"{median_mps:.0f} m/s ({median_mps * FOOT_M:.0f} m/s if the heights are in feet){steps}; "
        "convert them to metres",
        severity,
    )


def check_height_scatter(
    name: str, time_s: Floats, height_m: Floats, aircraft: Integers, *, coded: bool
) -> Diagnosis | None:
    """Diagnose heights of which no aircraft is capable in their succession.

    Parameters
    ----------
    name : str
        The sensor.
    time_s, height_m : (n,) float64
        Times and heights; NaN where missing.
    aircraft : (n,) int64
        Aircraft of each; −1 where unknown.
    coded : bool
        Whether transponders report them; measured ones scatter.
    """
    known = np.isfinite(height_m) & (aircraft >= 0)
    order = np.lexsort((time_s[known], aircraft[known]))
    time_s, height_m = time_s[known][order], height_m[known][order]
    of = aircraft[known][order]
    before_s, after_s = time_s[1:-1] - time_s[:-2], time_s[2:] - time_s[1:-1]
    chosen = (of[2:] == of[:-2]) & (np.minimum(before_s, after_s) >= JUMP_MIN_S)
    chosen &= np.maximum(before_s, after_s) <= SCATTER_MAX_S
    if np.count_nonzero(chosen) < SCATTER_HEIGHTS_MIN:
        return None
    weight = (after_s / np.maximum(before_s + after_s, JUMP_MIN_S))[chosen]
    line_m = weight * height_m[:-2][chosen] + (1.0 - weight) * height_m[2:][chosen]
    off_m = np.abs(height_m[1:-1][chosen] - line_m)
    limit_m = SCATTER_M + 0.5 * SCATTER_MPS2 * (before_s * after_s)[chosen]
    off, middle = off_m > limit_m, of[1:-1][chosen]
    aircraft_off = len(np.unique(middle[off]))
    if np.mean(off) < SCATTER_MIN or aircraft_off < max(
        SCATTER_AIRCRAFT_MIN, 0.5 * len(np.unique(middle))
    ):
        return None
    return Diagnosis(
        name,
        "height_scatter",
        f"{name}: its heights (height_m) are probably not those of its aircraft: "
        f"{np.mean(off):.0%} of them are off the line between the heights before and after, by a "
        f"median of {np.median(off_m[off]):.0f} m; check how the column was decoded or joined",
        "error" if coded else "warning",
    )


def _of_other_rows(name: str, jumping: float) -> Diagnosis:
    return Diagnosis(
        name,
        "height_rows",
        f"{name}: its heights or the identities of its aircraft probably belong to other rows: "
        f"{jumping:.1%} of the successive heights of an aircraft imply more than {JUMP_MPS:.0f} "
        "m/s; check how the columns, or the plots and their track numbers, were joined",
    )


# Whether a height follows the one before by a jump, and how many are compared. Rows are by aircraft
# and time.
def _jumps(time_s: Floats, height_m: Floats, aircraft: Integers) -> tuple[Booleans, int]:
    apart_s = np.diff(time_s)
    compared = (np.diff(aircraft) == 0) & (apart_s >= JUMP_MIN_S) & (apart_s <= JUMP_MAX_S)
    jumps = compared & (np.abs(np.diff(height_m)) > JUMP_MPS * apart_s)
    return jumps, int(np.count_nonzero(compared))


def pairs_apart(
    time_s: Floats, aircraft: Integers, least_s: float, most_s: float
) -> tuple[Integers, Integers]:
    """Return pairs of rows of one aircraft, the second the first one at least so much later.

    Parameters
    ----------
    time_s : (n,) float64
        Times.
    aircraft : (n,) int64
        Aircraft of each.
    least_s, most_s : float
        Time between the two, s.
    """
    order = np.lexsort((time_s, aircraft))
    # Complex numbers are ordered by their real part, the aircraft, and then by time.
    place = aircraft[order] + 1j * time_s[order]
    after = np.searchsorted(place, place + 1j * least_s)
    first = np.flatnonzero(after < len(place))
    last = after[first]
    good = (place[last].real == place[first].real) & (
        place[last].imag - place[first].imag <= most_s
    )
    return order[first[good]], order[last[good]]
