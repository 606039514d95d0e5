"""Values of reports and the reasons for which some of them were dropped, as bits."""

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.aircraft_data.plausibility import Finding, drop, findings
from multiradar_converters.aircraft_data.quantities import Numbers

Integers = NDArray[np.int64]

#: Reasons for which values are dropped, by bit.
REASONS = (
    "copies",
    "equal_registers",
    "unannounced_bits",
    "vertical_rates",
    "age",
    "range_exceeded",
    "out_of_range",
    "wind",
    "roll_and_rate",
    "airspeed_and_mach",
    "true_and_mach",
    "track_and_heading",
    "unchanged",
    "positions",
)


def reason_bits(found: Iterable[Finding], count: int) -> Integers:
    """Return the reasons of each report as bits, int64[count]."""
    bits = np.zeros(count, np.int64)
    for one in found:
        bits[one.where] |= 1 << REASONS.index(one.reason)
    return bits


def reason_counts(bits: Integers) -> Counter[str]:
    """Return the number of reports of each reason."""
    counts = {name: int((bits >> k & 1).sum()) for k, name in enumerate(REASONS)}
    return +Counter(counts)


def checked(
    values: Numbers, height_m: Numbers, before: Sequence[Finding] = ()
) -> tuple[Numbers, Integers]:
    """Drop implausible values.

    Parameters
    ----------
    values : float64[n, 10]
        Columns of `QUANTITIES`.
    height_m : float64[n]
        Pressure altitude, m; NaN for none.
    before : sequence of Finding
        Findings of the source, whose values are absent already.

    Returns
    -------
    values : float64[n, 10]
        The plausible ones.
    bits : int64[n]
        Reasons for which values were dropped, see `REASONS`.
    """
    found = findings(values, height_m)
    return drop(values, found), reason_bits([*before, *found], len(values))
