"""Which radar's bias has jumped: cumulated tests of the innovations of many aircraft."""

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.health.health_sums import HealthSums
from multiradar.tracking.health.health_tests import AIRCRAFT_MIN, JUMP_SIGMAS, jump_evidence

Floats = NDArray[np.float64]

#: Threshold of the cumulated likelihood ratio of a jump: false alarms of a test are at least
#: exp(16) = 9 million tests apart in the mean.
JUMP_THRESHOLD = 16.0
#: A radar is tested from so many turns after its first plot on.
START_TURNS = 15.0
#: After a jump nothing is tested for so many turns, while tracks and biases follow; the alarm holds
#: as long.
RECOVERY_TURNS = 8.0
#: Innovations that are too few to be judged are let go after so many turns.
WINDOW_TURNS = 3.0
#: Innovations tell of noise and pattern when biases add no more than this part to their variance.
SETTLED_SHARE = 0.25


class JumpTests:
    """The tests of the radars of an engine; owned by their health.

    Parameters
    ----------
    radars : (r,) int
        Which sensors are tested.
    periods : (m,) float64
        Turn of every sensor, s.
    tests : bool
        Whether to test at all; else innovations are only asked how well biases are known.

    Attributes
    ----------
    counts : (m,) int64
        How often each sensor jumped so far.
    last_s : (m,) float64
        When that was last noticed, NaN for never.
    """

    def __init__(self, radars: NDArray[np.intp], periods: Floats, *, tests: bool) -> None:
        count = len(periods)
        self._radars, self._periods, self._tests = radars, periods, tests
        self._evidence = np.zeros((count, 2, 2, len(JUMP_SIGMAS)))
        self._first_s = np.full(count, np.inf)
        self._common = np.full((count, 2), np.inf)
        self._held_s = -np.inf
        self.counts = np.zeros(count, np.int64)
        self.last_s = np.full(count, np.nan)

    def recent(self, end_s: float) -> NDArray[np.bool_]:
        """Return (m,) whether a jump of each sensor is so recent that tracks and biases follow."""
        recent: NDArray[np.bool_] = end_s - self.last_s <= RECOVERY_TURNS * self._periods
        return recent

    def find(self, end_s: float, sums: HealthSums) -> int:
        """Test every radar whose innovations are enough; return that which jumped, or −1.

        Parameters
        ----------
        end_s : float
            Data time of the end of the epoch.
        sums : HealthSums
            What was summed until then; windows that were judged begin anew.

        Returns
        -------
        int
            A sensor, −1 for none.
        """
        fresh = np.isinf(self._first_s) & np.isfinite(sums.last_plot)
        self._first_s[fresh] = end_s
        for s in self._radars.tolist():
            if sums.judged[s] >= AIRCRAFT_MIN:
                began_s = self._first_s[s] + START_TURNS * self._periods[s]
                self._test(s, sums, tested=self._tests and end_s >= max(self._held_s, began_s))
                _open_window(s, end_s, sums)
            elif end_s - sums.opened[s] > WINDOW_TURNS * self._periods[s]:
                _open_window(s, end_s, sums)
        most = self._evidence.max(axis=(1, 2, 3))
        jumped = int(np.argmax(most))
        if most[jumped] < JUMP_THRESHOLD:
            return -1
        # What a jump did to the tracks, other radars see as well.
        self._evidence[:] = 0.0
        self._common[jumped] = np.inf
        self._held_s = end_s + RECOVERY_TURNS * float(self._periods[jumped])
        self.counts[jumped] += 1
        self.last_s[jumped] = end_s
        return jumped

    def _test(self, s: int, sums: HealthSums, *, tested: bool) -> None:
        count = int(sums.judged[s])
        for i in range(2):
            # Where nothing asked how uncertain the biases are, they are as uncertain as before.
            if sums.commons[s] > 0:
                self._common[s, i] = sums.common[s, i] / sums.commons[s]
            common = self._common[s, i]
            sums.settled[s, i] = common <= SETTLED_SHARE
            if tested and np.isfinite(common):
                more = jump_evidence(sums.values[s, i, :count], common, sums.scale[s, i])
                self._evidence[s, i] = np.maximum(self._evidence[s, i] + more, 0.0)


def _open_window(s: int, end_s: float, sums: HealthSums) -> None:
    sums.opened[s] = end_s
    sums.judged[s] = sums.commons[s] = 0
    sums.common[s] = 0.0
