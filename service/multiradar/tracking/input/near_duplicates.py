"""Removal of duplicate plots with small differences, as from two networks.

An antenna detects an aircraft once per scan. Two plots of one radar within a fraction of a scan, at
one position up to the resolution of the messages and without conflicting identities, are one plot.
Used twice they would halve the covariance. The earlier one is kept.
"""

from collections.abc import Collection
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.state import Fields
from multiradar.tracking.input._duplicate_kernels import find_twins
from multiradar.tracking.input.duplicates import NO_DUPLICATES, Duplicates
from multiradar.tracking.input.measurements import MeasurementBatch

#: Fraction of a scan within which an antenna detects an aircraft once, and its maximum, s: networks
#: that round times do so to a second or less.
PASS_SCANS = 0.25
PASS_MAX_S = 1.0
# Hash table entries per row.
_BUCKETS_PER_ROW = 2

_IDENTITY = ("mode_3a", "mode_s_address", "track_number")


class NearDuplicates:
    """Removes duplicate plots; owned by the engine.

    Sensors without a known scan period, and others than radars, are not checked.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    hidden : collection of str
        Names of columns that the tracker does not use.

    Attributes
    ----------
    count : int
        Plots left out so far.
    """

    STATE: ClassVar[Fields] = {
        "_recent": MeasurementBatch,
        "count": int,
    }

    def __init__(self, sensors: SensorTable, hidden: Collection[str] = ()) -> None:
        periods_s = np.nan_to_num(sensors.rotation_period_s, nan=0.0)
        self._spans_s = np.minimum(PASS_SCANS * periods_s, PASS_MAX_S)
        self._identity = [name for name in _IDENTITY if name not in hidden]
        # Rows that may have a duplicate in the next release.
        self._recent = MeasurementBatch.empty()
        self.count = 0

    def filter(
        self, rows: MeasurementBatch, arrivals: NDArray[np.int64]
    ) -> tuple[MeasurementBatch, Duplicates]:
        """Divide the next rows into those to keep and duplicates.

        Parameters
        ----------
        rows : MeasurementBatch
            By ascending time, not before those of the last call.
        arrivals : (n,) int64
            Their positions in the order of arrival.

        Returns
        -------
        MeasurementBatch
            Rows to keep: a function of all rows so far, independent of batches.
        Duplicates
            The duplicates.
        """
        if not self._spans_s.any():
            return rows, NO_DUPLICATES
        first = len(self._recent)
        every = MeasurementBatch.concatenate([self._recent, rows])
        twins = self._twins(every, first)
        lone = twins < 0
        since_s = every.time_s[-1] - self._spans_s.max()
        self._recent = every.select(lone & (every.time_s >= since_s))
        if lone.all():
            return rows, NO_DUPLICATES
        second = np.flatnonzero(~lone)
        self.count += len(second)
        return rows.select(lone[first:]), _duplicates(
            every, second, twins[second], arrivals[second - first]
        )

    def rewind(self) -> None:
        """Accept earlier times from the next rows on."""
        self._recent = MeasurementBatch.empty()

    def _twins(self, rows: MeasurementBatch, first: int) -> NDArray[np.int64]:
        n = len(rows)
        table = 1 << (_BUCKETS_PER_ROW * n).bit_length()
        identities = np.empty((n, len(self._identity)), np.int64)
        for column, name in enumerate(self._identity):
            identities[:, column] = getattr(rows, name)
        twins = np.empty(n, np.int64)
        find_twins(
            first, rows.time_s, rows.sensor.astype(np.int64), rows.kind.astype(np.int64),
            rows.range_m, rows.azimuth_rad, rows.height_m, identities, self._spans_s,
            np.full(table, -1), np.empty(n, np.int64), twins,
        )  # fmt: skip
        return twins


def _duplicates(
    rows: MeasurementBatch,
    second: NDArray[np.intp],
    twin: NDArray[np.int64],
    arrivals: NDArray[np.int64],
) -> Duplicates:
    aside = np.abs(rows.azimuth_rad[second] - rows.azimuth_rad[twin])
    return Duplicates(
        arrival=arrivals,
        twin_time_s=rows.time_s[twin],
        range_apart_m=np.abs(rows.range_m[second] - rows.range_m[twin]),
        azimuth_apart_rad=np.minimum(aside, 2.0 * np.pi - aside),
        batch=rows.select(second),
    )
