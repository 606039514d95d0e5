"""Association of plots with aircraft: track rows reference plots by source and number.

Plot numbers wrap, so the plot nearest in time within a tolerance is selected, with priority for the
sensor of the track row. Both inputs are ordered by time, so only a window of a few tolerances is in
memory.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.distinct import distinct
from multiradar_converters.vid import _kernels
from multiradar_converters.vid.records import (
    NAMING_WORDS,
    PLOT_WORDS,
    Records,
    plot_of,
    sensor_of,
    times,
)

#: Rows near the edge of a window wait for the next one; exceeds any rounding of a time, s.
_MARGIN_S = 1.0

_WINDOW_RECORDS_MIN = 1 << 16


@dataclass(frozen=True)
class NamedPlots:
    """Plots with final association.

    Attributes
    ----------
    plots : int64[n, 7]
        Records of plots, by time.
    aircraft : int64[n]
        Track number of the row nearest in time that references the plot, -1 for none.
    pair_plot, pair_aircraft : int64[m]
        Each plot (index above) with each aircraft that references it, once.
    """

    plots: Records
    aircraft: NDArray[np.int64]
    pair_plot: NDArray[np.int64]
    pair_aircraft: NDArray[np.int64]


@dataclass
class NamingCounts:
    """Counts of the references."""

    found: int = 0
    lost: int = 0
    plots_unnamed: int = 0
    plots_named_by_several: int = 0


class PlotNamer:
    """Associates track rows with plots, in a single pass.

    Parameters
    ----------
    source_of_sensor : int64[s]
        Number of the source of each sensor.
    tolerance_s : float
        Maximum time difference, s.
    """

    def __init__(self, source_of_sensor: NDArray[np.int64], tolerance_s: float) -> None:
        self.counts = NamingCounts()
        self._source_of_sensor = source_of_sensor
        self._tolerance_s = tolerance_s
        self._plots: Records = np.empty((0, PLOT_WORDS), dtype=np.int64)
        self._distance = np.empty(0)
        self._aircraft = np.empty(0, dtype=np.int64)
        self._pairs: list[NDArray[np.int64]] = []

    def run(self, plots: Iterator[Records], namings: Iterator[Records]) -> Iterator[NamedPlots]:
        """Yield all plots by time, with their association.

        Parameters
        ----------
        plots, namings : iterator of records
            Both by time.
        """
        waiting: Records = np.empty((0, NAMING_WORDS), dtype=np.int64)
        more = True
        while more:
            more = self._read_plots(plots)
            # Without further plots everything is in reach and final.
            reach = np.inf
            if more:
                reach = float(times(self._plots)[-1]) - self._tolerance_s - _MARGIN_S
            waiting = self._name_up_to(reach, waiting, namings)
            settled = np.inf
            if more and len(waiting):
                settled = float(times(waiting)[0]) - self._tolerance_s - _MARGIN_S
            yield from self._settle(settled)

    def _name_up_to(self, reach: float, waiting: Records, namings: Iterator[Records]) -> Records:
        """Associate all references up to a time; return the first ones beyond it."""
        while True:
            if not len(waiting):
                block = next(namings, None)
                if block is None:
                    return waiting
                waiting = block
            cut = int(np.searchsorted(times(waiting), reach, side="right"))
            if cut:
                self._name(waiting[:cut])
            waiting = waiting[cut:]
            if len(waiting):
                return waiting

    def _read_plots(self, plots: Iterator[Records]) -> bool:
        """Read at least as many plots as are in memory; return whether there may be more."""
        parts = [self._plots]
        wanted = max(_WINDOW_RECORDS_MIN, len(self._plots))
        taken = 0
        more = True
        while taken < wanted and more:
            block = next(plots, None)
            more = block is not None
            if block is not None:
                parts.append(block)
                taken += len(block)
        self._plots = np.concatenate(parts)
        self._distance = np.concatenate([self._distance, np.full(taken, np.inf)])
        self._aircraft = np.concatenate([self._aircraft, np.full(taken, -1, dtype=np.int64)])
        return more

    def _name(self, namings: Records) -> None:
        identity = self._plots[:, -1]
        sensor = sensor_of(identity)
        naming_sensor = sensor_of(namings[:, 1])
        aircraft = np.ascontiguousarray(namings[:, 2])
        bits = max(4, int(2 * len(self._plots)).bit_length())
        matched = np.empty(len(namings), dtype=np.int64)
        _kernels.name_plots(
            self._keys(sensor, identity),
            sensor,
            np.ascontiguousarray(times(self._plots)),
            self._keys(naming_sensor, namings[:, 1]),
            naming_sensor,
            np.ascontiguousarray(times(namings)),
            aircraft,
            self._tolerance_s,
            bits,
            np.empty(1 << bits, dtype=np.int64),
            np.empty(len(self._plots), dtype=np.int64),
            self._distance,
            self._aircraft,
            matched,
        )
        found = matched >= 0
        self.counts.found += int(found.sum())
        self.counts.lost += len(found) - int(found.sum())
        self._pairs.append((matched[found] << 32) | aircraft[found])

    def _keys(self, sensor: NDArray[np.int64], identity: NDArray[np.int64]) -> NDArray[np.int64]:
        return (self._source_of_sensor[sensor] << 31) | plot_of(identity)

    def _settle(self, before_s: float) -> Iterator[NamedPlots]:
        cut = int(np.searchsorted(times(self._plots), before_s, side="left"))
        if not cut:
            return
        pairs = distinct(np.concatenate([*self._pairs, np.empty(0, dtype=np.int64)]))
        split = int(np.searchsorted(pairs, cut << 32))
        pair_plot = pairs[:split] >> 32
        self._pairs = [pairs[split:] - (cut << 32)]
        named = NamedPlots(
            self._plots[:cut], self._aircraft[:cut], pair_plot, pairs[:split] & 0xFFFF_FFFF
        )
        self.counts.plots_unnamed += int((named.aircraft < 0).sum())
        twice = distinct(pair_plot[1:][pair_plot[1:] == pair_plot[:-1]])
        self.counts.plots_named_by_several += len(twice)
        self._plots = self._plots[cut:].copy()
        self._distance = self._distance[cut:].copy()
        self._aircraft = self._aircraft[cut:].copy()
        yield named
