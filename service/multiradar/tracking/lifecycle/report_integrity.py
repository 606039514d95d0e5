"""Integrity of ADS-B reports: arrays by aircraft and by sensor.

Named tuples of arrays, as compiled functions require; one owner modifies them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# `ReportIntegrity.state`: reports are accepted; rejected until a radar has confirmed them; rejected
# as contradicted; or accepted although radars that cover the aircraft do not detect it.
PLAUSIBLE = 0
SUSPECT = 1
IMPLAUSIBLE = 2
GHOST = 3

#: Maximum number of stored plots of each sensor until the next report.
WAITING_MAX = 3
#: Number of azimuth sectors of a radar.
SECTORS = 32

# Columns of `ReportIntegrity.report` and `ReportIntegrity.other`, and of `ReportIntegrity.plot`.
TIME, EAST, NORTH, EAST_RATE, NORTH_RATE, SIGMA = range(6)
PLOT_TIME, PLOT_Z0, PLOT_Z1, PLOT_HEIGHT, PLOT_VARIANCE = range(5)
# Columns of `ReportIntegrity.mean`: both components, the variance of the mean relative to that of
# one plot, and the largest variance of reported positions in it.
MEAN_0, MEAN_1, MEAN_FACTOR, MEAN_VARIANCE = range(4)
# Columns of `ReportIntegrity.evidence`: information matrix and vector of the offset, and square of
# the mean.
EVIDENCE_EE, EVIDENCE_EN, EVIDENCE_NN, EVIDENCE_E, EVIDENCE_N, EVIDENCE_SQUARE = range(6)


class ReportIntegrity(NamedTuple):
    """Integrity of the reports of each aircraft.

    Attributes
    ----------
    owner : (s,) int64
        Track of the slot, −1 before the first report.
    state : (s,) int64
        `PLAUSIBLE`, `SUSPECT`, `IMPLAUSIBLE` or `GHOST`.
    since : (s,) float64
        Start of the state, data time.
    report : (s, 6) float64
        Last report: time, east, north, their rates, and the sigma of the position; rates are NaN
        before the second report.
    other : (s, 6) float64
        A report inconsistent with the last one; its time NaN for none.
    inconsistencies : (s,) float64
        Number of such reports, fading.
    deviation : (s,) float64
        Deviation of the path between reports from a straight line, m, fading.
    seen : (s,) float64
        Data time of the last plot by another sensor, −∞ before the first.
    hits, agreements : (s,) int64
        Number of agreeing comparisons: in total, and since the last contradiction.
    waiting : (s, m) int64
        Number of plots since the last report.
    plot : (s, m, WAITING_MAX, 5) float64
        Their time, components and height, and the variance of a reported position.
    mean : (s, m, 4) float64
        Mean difference to the reports; see `MEAN_FACTOR`.
    evidence : (s, m, 6) float64
        Information on the offset of the reports on the plane: see `EVIDENCE_EE`.
    tests, outliers, contradictions : (s, m) int64
        Numbers of comparisons in the mean, of consecutive outliers, and of consecutive
        contradictions.
    agreement : (s, m) int64
        1 where a sensor agrees with the reports, −1 where it contradicts them, 0 undecided.
    compared_at : (s, m) float64
        Data time of its last comparison.
    unseen : (s, m) float64
        Data time since which a radar misses the aircraft in its coverage; NaN for none.
    """

    owner: Integers
    state: Integers
    since: Floats
    report: Floats
    other: Floats
    inconsistencies: Floats
    deviation: Floats
    seen: Floats
    hits: Integers
    agreements: Integers
    waiting: Integers
    plot: Floats
    mean: Floats
    evidence: Floats
    tests: Integers
    outliers: Integers
    contradictions: Integers
    agreement: Integers
    compared_at: Floats
    unseen: Floats

    @classmethod
    def empty(cls, capacity: int, sensors: int) -> "ReportIntegrity":
        """Return arrays without reports; without sensors nothing is compared."""
        each = (capacity, sensors)
        return cls(
            owner=np.full(capacity, -1, np.int64),
            state=np.zeros(capacity, np.int64),
            since=np.zeros(capacity),
            report=np.full((capacity, 6), np.nan),
            other=np.full((capacity, 6), np.nan),
            inconsistencies=np.zeros(capacity),
            deviation=np.zeros(capacity),
            seen=np.full(capacity, -np.inf),
            hits=np.zeros(capacity, np.int64),
            agreements=np.zeros(capacity, np.int64),
            waiting=np.zeros(each, np.int64),
            plot=np.zeros((*each, WAITING_MAX, 5)),
            mean=np.zeros((*each, 4)),
            evidence=np.zeros((*each, 6)),
            tests=np.zeros(each, np.int64),
            outliers=np.zeros(each, np.int64),
            contradictions=np.zeros(each, np.int64),
            agreement=np.zeros(each, np.int64),
            compared_at=np.full(each, -np.inf),
            unseen=np.full(each, np.nan),
        )

    def bias_excluded(self, slots: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Return whether slots are excluded from bias estimation."""
        bias_excluded: NDArray[np.bool_] = self.state[slots] != PLAUSIBLE
        return bias_excluded

    def release(self, slots: Integers) -> None:
        """Reset slots that become free."""
        self.owner[slots] = -1
        self.state[slots] = PLAUSIBLE


class Watch(NamedTuple):
    """State of the sensors.

    Attributes
    ----------
    self_reported : (m,) int64
        Whether it relays ADS-B reports.
    kind : (m,) int64
        Kind of measurement.
    period : (m,) float64
        Scan period, s.
    range_max : (m,) float64
        Instrumented range, m; infinite when unknown.
    alive : (m,) float64
        Data time of its last plot of an aircraft, −∞ before the first.
    farthest : (m,) float64
        Largest range, m, of a plot of an aircraft so far.
    lowest : (m, SECTORS) float64
        Sine of the lowest elevation at which it detected an aircraft, by azimuth.
    support_s : float
        Time, s, for which an aircraft counts as seen by other sensors.
    suspect_s : float
        Maximum time, s, for which reports are suspect after a jump.
    """

    self_reported: Integers
    kind: Integers
    period: Floats
    range_max: Floats
    alive: Floats
    farthest: Floats
    lowest: Floats
    support_s: float
    suspect_s: float
