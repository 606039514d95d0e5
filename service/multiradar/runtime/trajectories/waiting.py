"""The queue of operations on bundles: in the order of the engine, bounded over all tracks."""

import math
from collections import OrderedDict
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.runtime.trajectories.plots import Published
from multiradar.runtime.trajectories.roster import DropBundle, Order, PushPlots, Sampled

#: Maximum plots of a track in a round: a long operation would leave the other threads idle.
SLICE_PLOTS = 2


class NextPlots(NamedTuple):
    """The next plots of a bundle.

    Attributes
    ----------
    track_id : int
        The track.
    restart : bool
        Plots were lost: the previous bundle is to be dropped.
    plots : ndarray of `PLOT_DTYPE`
        Its next plots, at least one.
    published : Published
        The biases at their time.
    """

    track_id: int
    restart: bool
    plots: NDArray[np.void]
    published: Published


class WaitingPlots:
    """One queue for all tracks; when full, the plots of one track are lost; one owner at a time.

    Parameters
    ----------
    plots_max : int
        Maximum queued plots; other operations count as one.
    """

    def __init__(self, plots_max: int) -> None:
        self._plots_max = plots_max
        # By ascending number.
        self._orders: OrderedDict[int, Order] = OrderedDict()
        self._number = 0
        # Numbers of the operations of each track, plots of each, and numbers of the samples.
        self._plots: dict[int, OrderedDict[int, None]] = {}
        self._lengths: dict[int, int] = {}
        self._samples: OrderedDict[int, None] = OrderedDict()
        # Samples and ends of tracks; the latter are never lost, or bundles would never be dropped.
        self._others = 0
        self._restarting: set[int] = set()
        #: Queued plots.
        self.count = 0
        #: Plots lost because the queue was full, and skipped because they were too old.
        self.lost = self.late = 0

    def __len__(self) -> int:
        """Return the number of queued operations."""
        return len(self._orders)

    def fits(self, order: Order) -> bool:
        """Return whether an operation fits; any fits into an empty queue."""
        more = len(order.plots) if isinstance(order, PushPlots) else 1
        return not self._orders or self.count + self._others + more <= self._plots_max

    def put(self, order: Order) -> None:
        """Add an operation; if full, the plots of the track with the most queued plots are lost."""
        self._number += 1
        self._orders[self._number] = order
        if isinstance(order, PushPlots):
            self._plots.setdefault(order.track_id, OrderedDict())[self._number] = None
            length = self._lengths.get(order.track_id, 0)
            self._lengths[order.track_id] = length + len(order.plots)
            self.count += len(order.plots)
        else:
            self._others += 1
            if isinstance(order, Sampled):
                self._samples[self._number] = None
        while self.count + self._others > self._plots_max and (self._plots or self._samples):
            self._lose()

    def pop(self, plots_max: int) -> list[NextPlots] | DropBundle | Sampled | None:
        """Pop the next round of plots or the next other operation; None when the queue is empty.

        Parameters
        ----------
        plots_max : int
            Maximum plots of a round.

        Returns
        -------
        list of NextPlots, DropBundle, Sampled or None
            Plots of different tracks, which may be processed concurrently: at most `SLICE_PLOTS` of
            each, none beyond an operation of another type. The order of each track is kept.
        """
        if not self._orders:
            return None
        number, order = next(iter(self._orders.items()))
        if isinstance(order, PushPlots):
            return [self._cut(*one) for one in self._round(plots_max)]
        del self._orders[number]
        self._others -= 1
        if isinstance(order, Sampled):
            del self._samples[number]
        else:
            self._restarting.discard(order.track_id)
        return order

    def skip_before(self, time_s: float) -> None:
        """Skip the plots of the oldest operations up to a data time; the bundles continue.

        A bundle that is short of time gets fewer plots, all of which are recent.
        """
        old = []
        for number, order in self._orders.items():
            if isinstance(order, PushPlots):
                if order.plots["time_s"][0] >= time_s:
                    break
                old.append((number, order))
        for number, order in old:
            self._remove(number, order)
            self.late += len(order.plots)

    @property
    def oldest_s(self) -> float:
        """Data time of the plot that has waited longest; infinite without any."""
        plots = (one.plots for one in self._orders.values() if isinstance(one, PushPlots))
        return float(next((one["time_s"][0] for one in plots), math.inf))

    # Numbers and operations of the next round, and plots of each.
    def _round(self, plots_max: int) -> list[tuple[int, PushPlots, int]]:
        found: dict[int, tuple[int, PushPlots, int]] = {}
        for number, order in self._orders.items():
            if not isinstance(order, PushPlots) or order.track_id in found or not plots_max:
                break
            length = min(len(order.plots), SLICE_PLOTS, plots_max)
            found[order.track_id] = number, order, length
            plots_max -= length
        return list(found.values())

    def _cut(self, number: int, order: PushPlots, length: int) -> NextPlots:
        track_id, plots, published = order
        if length == len(plots):
            self._remove(number, order)
        else:
            self._orders[number] = order._replace(plots=plots[length:])
            self._lengths[track_id] -= length
            self.count -= length
        restart = track_id in self._restarting
        self._restarting.discard(track_id)
        return NextPlots(track_id, restart, plots[:length], published)

    def _remove(self, number: int, order: PushPlots) -> None:
        track_id = order.track_id
        del self._orders[number], self._plots[track_id][number]
        self._lengths[track_id] -= len(order.plots)
        self.count -= len(order.plots)
        if not self._plots[track_id]:
            del self._plots[track_id], self._lengths[track_id]

    def _lose(self) -> None:
        if not self._plots:
            number, _ = self._samples.popitem(last=False)
            del self._orders[number]
            self._others -= 1
            return
        track_id = max(self._plots, key=lambda one: (self._lengths[one], -one))
        for number in self._plots.pop(track_id):
            del self._orders[number]
        plots = self._lengths.pop(track_id)
        self.count -= plots
        self.lost += plots
        self._restarting.add(track_id)
