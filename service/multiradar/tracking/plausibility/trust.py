"""Whether the reports of aircraft are believed: what is kept of each aircraft and sensor.

Named tuples of arrays, because compiled functions take them as they are; one owner changes them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# `Trust.state`: reports are taken, are set aside until a radar has looked, are set aside for being
# contradicted, or are taken though radars that should see the aircraft do not.
TRUSTED = 0
SUSPECT = 1
DISTRUSTED = 2
GHOST = 3

#: Plots of each sensor that wait for the next report.
WAITING_MAX = 3
#: Azimuths of a radar are told apart by so many sectors.
SECTORS = 32

# Columns of `Trust.report` and `Trust.other`, and of `Trust.plot`.
TIME, EAST, NORTH, EAST_RATE, NORTH_RATE = range(5)
PLOT_TIME, PLOT_Z0, PLOT_Z1, PLOT_HEIGHT = range(4)
# Columns of `Trust.mean`: both components, and the variance of the mean in terms of one plot's.
MEAN_0, MEAN_1, MEAN_FACTOR = range(3)
# Columns of `Trust.said`: information about the offset, its vector, and the square of the mean.
SAID_EE, SAID_EN, SAID_NN, SAID_E, SAID_N, SAID_SQUARE = range(6)


class Trust(NamedTuple):
    """What is kept of the reports of each aircraft.

    Attributes
    ----------
    owner : (s,) int64
        The track that the rest is of, −1 where no report came yet.
    state : (s,) int64
        `TRUSTED`, `SUSPECT`, `DISTRUSTED` or `GHOST`.
    since : (s,) float64
        Data time from which the state holds.
    report : (s, 5) float64
        Last report: time, east, north, and their rates; the rates NaN until two reports came.
    other : (s, 5) float64
        A report that does not go on from the last one; its time NaN for none.
    strays : (s,) float64
        Such reports, fading.
    bent : (s,) float64
        How far, m, the way between reports may have been from the straight line, fading.
    seen : (s,) float64
        Data time of the last plot by another sensor, −∞ before the first.
    hits, agreements : (s,) int64
        Comparisons that agreed: ever, and since the last that did not.
    waiting : (s, m) int64
        Plots since the last report.
    plot : (s, m, WAITING_MAX, 4) float64
        Their time, components and height.
    mean : (s, m, 3) float64
        Mean difference to the reports; see `MEAN_FACTOR`.
    said : (s, m, 6) float64
        What it says of the offset of the reports on the plane: see `SAID_EE`.
    tests, odd, runs : (s, m) int64
        Comparisons in the mean, those far from it in a row, and contradicting ones in a row.
    verdict : (s, m) int64
        1 where a sensor bears the reports out, −1 where it contradicts them, 0 open.
    judged : (s, m) float64
        Data time of its last comparison.
    unseen : (s, m) float64
        Data time since which a radar should have seen the aircraft and did not; NaN for none.
    """

    owner: Integers
    state: Integers
    since: Floats
    report: Floats
    other: Floats
    strays: Floats
    bent: Floats
    seen: Floats
    hits: Integers
    agreements: Integers
    waiting: Integers
    plot: Floats
    mean: Floats
    said: Floats
    tests: Integers
    odd: Integers
    runs: Integers
    verdict: Integers
    judged: Floats
    unseen: Floats

    @classmethod
    def empty(cls, capacity: int, sensors: int) -> "Trust":
        """Return room for aircraft of which no report came; without sensors nothing is compared."""
        each = (capacity, sensors)
        return cls(
            owner=np.full(capacity, -1, np.int64),
            state=np.zeros(capacity, np.int64),
            since=np.zeros(capacity),
            report=np.full((capacity, 5), np.nan),
            other=np.full((capacity, 5), np.nan),
            strays=np.zeros(capacity),
            bent=np.zeros(capacity),
            seen=np.full(capacity, -np.inf),
            hits=np.zeros(capacity, np.int64),
            agreements=np.zeros(capacity, np.int64),
            waiting=np.zeros(each, np.int64),
            plot=np.zeros((*each, WAITING_MAX, 4)),
            mean=np.zeros((*each, 3)),
            said=np.zeros((*each, 6)),
            tests=np.zeros(each, np.int64),
            odd=np.zeros(each, np.int64),
            runs=np.zeros(each, np.int64),
            verdict=np.zeros(each, np.int64),
            judged=np.full(each, -np.inf),
            unseen=np.full(each, np.nan),
        )

    def quiet(self, slots: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Return whether the aircraft of slots must not speak about the biases."""
        quiet: NDArray[np.bool_] = self.state[slots] != TRUSTED
        return quiet

    def forget(self, slots: Integers) -> None:
        """Forget the aircraft of slots that become free."""
        self.owner[slots] = -1
        self.state[slots] = TRUSTED


class Watch(NamedTuple):
    """What is known of the sensors.

    Attributes
    ----------
    own : (m,) int64
        Whether it relays what aircraft say of themselves.
    kind : (m,) int64
        What it measures.
    period : (m,) float64
        Its turn, s.
    range_max : (m,) float64
        Instrumented range, m; infinite when unknown.
    alive : (m,) float64
        Data time of its last plot of an aircraft, −∞ before the first.
    farthest : (m,) float64
        Largest range, m, of a plot of an aircraft so far.
    lowest : (m, SECTORS) float64
        Sine of the least elevation at which it saw an aircraft, by azimuth.
    support_s : float
        An aircraft that others measured within so long is one they see.
    suspect_s : float
        Reports that broke off from the ones before wait so long for a verdict.
    """

    own: Integers
    kind: Integers
    period: Floats
    range_max: Floats
    alive: Floats
    farthest: Floats
    lowest: Floats
    support_s: float
    suspect_s: float
