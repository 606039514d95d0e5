"""Plots that wait for their bundles: a queue for each track, bounded over all of them."""

from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.runtime.trajectories.plots import Published
from multiradar.runtime.trajectories.roster import Take


class Next(NamedTuple):
    """What is to be done next.

    Attributes
    ----------
    track_id : int
        For whose bundle.
    anew : bool
        Plots of it were lost: the bundle before is to be let go.
    plots : ndarray of `PLOT_DTYPE`
        Its next plots.
    published : Published
        The biases of their time.
    """

    track_id: int
    anew: bool
    plots: NDArray[np.void]
    published: Published


class WaitingPlots:
    """Queues by track, of which each gives its next plots in turn; one owner at a time.

    Parameters
    ----------
    plots_max : int
        Plots that may wait.
    """

    def __init__(self, plots_max: int) -> None:
        self._plots_max = plots_max
        # In the order in which they are served.
        self._queues: dict[int, deque[Take]] = {}
        # Plots in each: where too many wait, which is the longest is asked for again and again.
        self._lengths: dict[int, int] = {}
        self._anew: set[int] = set()
        #: Plots that wait.
        self.count = 0
        #: Plots that were lost because too many waited.
        self.lost = 0

    def fits(self, take: Take) -> bool:
        """Tell whether there is room for more; for more than all room, when none waits."""
        return not self.count or self.count + len(take.plots) <= self._plots_max

    def put(self, take: Take) -> None:
        """Add plots; without room those of the track of which most wait are lost."""
        self._queues.setdefault(take.track_id, deque()).append(take)
        self._lengths[take.track_id] = self._lengths.get(take.track_id, 0) + len(take.plots)
        self.count += len(take.plots)
        while self.count > self._plots_max and self._queues:
            self._lose(max(self._queues, key=lambda one: (self._lengths[one], -one)))

    def drop(self, track_id: int) -> None:
        """Forget what waits for a track that has ended."""
        self._forget(track_id)
        self._anew.discard(track_id)

    def take(self) -> Next | None:
        """Return what comes next; None when nothing waits."""
        for track_id, queue in self._queues.items():
            first = queue.popleft()
            del self._queues[track_id]
            self._lengths[track_id] -= len(first.plots)
            self.count -= len(first.plots)
            if queue:
                self._queues[track_id] = queue
            else:
                del self._lengths[track_id]
            anew = track_id in self._anew
            self._anew.discard(track_id)
            return Next(track_id, anew, first.plots, first.published)
        return None

    def _forget(self, track_id: int) -> int:
        self._queues.pop(track_id, None)
        plots = self._lengths.pop(track_id, 0)
        self.count -= plots
        return plots

    def _lose(self, track_id: int) -> None:
        self.lost += self._forget(track_id)
        self._anew.add(track_id)
