"""Detection of bias jumps: cumulative tests of the innovations of many aircraft."""

from math import isfinite
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.state import Fields
from multiradar.tracking.health.health_sums import HealthSums
from multiradar.tracking.health.health_tests import AIRCRAFT_MIN, JUMP_SIGMAS, jump_evidence

Floats = NDArray[np.float64]

#: Threshold of the cumulative log likelihood ratio of a jump: false alarms of a test are at least
#: exp(16) = 9 million tests apart on average.
JUMP_THRESHOLD = 16.0
#: Number of scans after its first plot before a radar is tested.
START_SCANS = 15.0
#: Number of scans without tests after a jump, while tracks and biases adapt, and duration of the
#: alarm.
RECOVERY_SCANS = 8.0
#: Number of scans after which a window with too few innovations is discarded.
WINDOW_SCANS = 3.0
#: Largest fraction of the variance by biases for the use of innovations in noise and pattern
#: estimates.
SETTLED_SHARE = 0.25


class JumpTests:
    """Jump tests of the radars of an engine; owned by their health.

    Parameters
    ----------
    radars : (r,) int
        Sensors to test.
    periods : (m,) float64
        Scan period of every sensor, s.
    tests : bool
        Whether to test at all; otherwise only the bias uncertainty is evaluated.

    Attributes
    ----------
    counts : (m,) int64
        Number of jumps of each sensor.
    last_s : (m,) float64
        Data time of the last one, NaN for never.
    held_s : float
        Data time before which no radar is tested, s.
    """

    STATE: ClassVar[Fields] = {
        "_evidence": np.ndarray,
        "_first_s": np.ndarray,
        "_common": np.ndarray,
        "held_s": float,
        "counts": np.ndarray,
        "last_s": np.ndarray,
    }

    def __init__(self, radars: NDArray[np.intp], periods: Floats, *, tests: bool) -> None:
        count = len(periods)
        self._radars, self._periods, self._tests = radars, periods, tests
        self._evidence = np.zeros((count, 2, 2, len(JUMP_SIGMAS)))
        self._first_s = np.full(count, np.inf)
        self._common = np.full((count, 2), np.inf)
        self.held_s = -np.inf
        self.counts = np.zeros(count, np.int64)
        self.last_s = np.full(count, np.nan)

    def recent(self, end_s: float) -> NDArray[np.bool_]:
        """Return (m,) whether each sensor is recovering from a jump."""
        recent: NDArray[np.bool_] = end_s - self.last_s <= RECOVERY_SCANS * self._periods
        return recent

    def find(self, end_s: float, sums: HealthSums) -> int:
        """Test every radar with enough innovations; return the one that jumped, or −1.

        Parameters
        ----------
        end_s : float
            Data time of the end of the epoch.
        sums : HealthSums
            Sums until then; tested windows are restarted.

        Returns
        -------
        int
            Number of the sensor, −1 for none.
        """
        fresh = np.isinf(self._first_s) & np.isfinite(sums.last_plot)
        self._first_s[fresh] = end_s
        for s in self._radars.tolist():
            if sums.tested[s] >= AIRCRAFT_MIN:
                began_s = self._first_s[s] + START_SCANS * self._periods[s]
                self._test(s, sums, tested=self._tests and end_s >= max(self.held_s, began_s))
                _open_window(s, end_s, sums)
            elif end_s - sums.opened[s] > WINDOW_SCANS * self._periods[s]:
                _open_window(s, end_s, sums)
        most = self._evidence.max(axis=(1, 2, 3))
        jumped = int(np.argmax(most))
        if most[jumped] < JUMP_THRESHOLD:
            return -1
        # Tracks disturbed by a jump affect the innovations of other radars.
        self._evidence[:] = 0.0
        self._common[jumped] = np.inf
        self.held_s = end_s + RECOVERY_SCANS * float(self._periods[jumped])
        self.counts[jumped] += 1
        self.last_s[jumped] = end_s
        return jumped

    def _test(self, s: int, sums: HealthSums, *, tested: bool) -> None:
        count = int(sums.tested[s])
        for i in range(2):
            # Without new information the previous uncertainty of the biases is used.
            if sums.commons[s] > 0:
                self._common[s, i] = sums.common[s, i] / sums.commons[s]
            common = float(self._common[s, i])
            sums.settled[s, i] = common <= SETTLED_SHARE
            if tested and isfinite(common):
                scale = float(sums.scale[s, i])
                more = jump_evidence(sums.values[s, i, :count], common, scale)
                self._evidence[s, i] = np.maximum(self._evidence[s, i] + more, 0.0)


def _open_window(s: int, end_s: float, sums: HealthSums) -> None:
    sums.opened[s] = end_s
    sums.tested[s] = sums.commons[s] = 0
    sums.common[s] = 0.0
