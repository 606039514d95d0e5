"""What waits to be done with bundles: in the order of the engine, bounded over all tracks."""

from collections import OrderedDict
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.runtime.trajectories.plots import Published
from multiradar.runtime.trajectories.roster import LetGo, Order, Sampled, Take


class Next(NamedTuple):
    """Plots that are to be taken next.

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
    """One queue of all tracks, of which the plots of one may be lost; one owner at a time.

    Parameters
    ----------
    plots_max : int
        Plots that may wait; whatever else waits counts as one.
    """

    def __init__(self, plots_max: int) -> None:
        self._plots_max = plots_max
        # By ascending number.
        self._orders: OrderedDict[int, Order] = OrderedDict()
        self._number = 0
        # Numbers of the plots of each track, how many they are, and of the samples.
        self._takes: dict[int, OrderedDict[int, None]] = {}
        self._lengths: dict[int, int] = {}
        self._samples: OrderedDict[int, None] = OrderedDict()
        # Samples and ends of tracks; the latter are never lost, or bundles would stay for ever.
        self._others = 0
        self._anew: set[int] = set()
        #: Plots that wait.
        self.count = 0
        #: Plots that were lost because too many waited.
        self.lost = 0

    def __len__(self) -> int:
        """Return how much waits."""
        return len(self._orders)

    def fits(self, order: Order) -> bool:
        """Tell whether there is room for more; for more than all room, when nothing waits."""
        more = len(order.plots) if isinstance(order, Take) else 1
        return not self._orders or self.count + self._others + more <= self._plots_max

    def put(self, order: Order) -> None:
        """Add something; without room the plots of the track of which most wait are lost."""
        self._number += 1
        self._orders[self._number] = order
        if isinstance(order, Take):
            self._takes.setdefault(order.track_id, OrderedDict())[self._number] = None
            length = self._lengths.get(order.track_id, 0)
            self._lengths[order.track_id] = length + len(order.plots)
            self.count += len(order.plots)
        else:
            self._others += 1
            if isinstance(order, Sampled):
                self._samples[self._number] = None
        while self.count + self._others > self._plots_max and (self._takes or self._samples):
            self._lose()

    def take(self) -> Next | LetGo | Sampled | None:
        """Return what comes next; None when nothing waits."""
        if not self._orders:
            return None
        number, order = self._orders.popitem(last=False)
        if isinstance(order, Take):
            return self._next(number, order)
        self._others -= 1
        if isinstance(order, Sampled):
            del self._samples[number]
        else:
            self._anew.discard(order.track_id)
        return order

    def _next(self, number: int, first: Take) -> Next:
        track_id = first.track_id
        del self._takes[track_id][number]
        self._lengths[track_id] -= len(first.plots)
        self.count -= len(first.plots)
        if not self._takes[track_id]:
            del self._takes[track_id], self._lengths[track_id]
        anew = track_id in self._anew
        self._anew.discard(track_id)
        return Next(track_id, anew, first.plots, first.published)

    def _lose(self) -> None:
        if not self._takes:
            number, _ = self._samples.popitem(last=False)
            del self._orders[number]
            self._others -= 1
            return
        track_id = max(self._takes, key=lambda one: (self._lengths[one], -one))
        for number in self._takes.pop(track_id):
            del self._orders[number]
        plots = self._lengths.pop(track_id)
        self.count -= plots
        self.lost += plots
        self._anew.add(track_id)
