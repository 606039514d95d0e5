"""Measurements in the order of their time, whatever the order of their arrival."""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.measurements import MeasurementBatch

#: Rows are released in steps of this much data time: whole windows of the association, which also
#: makes single measurements cost little.
RELEASE_STEP_S = 0.5

# Columns that order rows of the same time, the most significant first; together they are the whole
# row, so that rows which tie in all of them are duplicates.
_TIE_COLUMNS = (
    "sensor",
    "track_number",
    "mode_s_address",
    "range_m",
    "azimuth_rad",
    "latitude_rad",
    "longitude_rad",
    "height_m",
    "mode_3a",
    "kind",
)


class ReorderBuffer:
    """Holds measurements until nothing earlier can come.

    Released is what lies before the latest time seen less the horizon. The released rows, one
    release after the other, are the rows sorted by time, then by content: a function of the
    set of rows, not of the batches they came in nor of their order within the horizon.

    Parameters
    ----------
    horizon_s : float
        How much later than its successors a measurement may arrive, s of data time.
    """

    def __init__(self, horizon_s: float) -> None:
        self._horizon_s = horizon_s
        self._waiting: list[MeasurementBatch] = []
        self._latest_s = -math.inf
        self._released_s = -math.inf
        self.late = 0
        self.duplicates = 0

    def push(self, batch: MeasurementBatch) -> MeasurementBatch | None:
        """Take rows; return what may go on, in order, or None.

        Parameters
        ----------
        batch : MeasurementBatch
            Rows in the order of their arrival.

        Returns
        -------
        MeasurementBatch or None
            Rows in canonical order, without duplicates.
        """
        if len(batch) == 0:
            return None
        late = batch.time_s < self._released_s
        if late.any():
            # The gate before the journal refuses these; after a flush some may still come.
            self.late += int(late.sum())
            batch = batch.take(~late)
            if len(batch) == 0:
                return None
        self._waiting.append(batch)
        self._latest_s = max(self._latest_s, float(batch.time_s.max()))
        watermark = self._latest_s - self._horizon_s
        watermark = math.floor(watermark / RELEASE_STEP_S) * RELEASE_STEP_S
        if watermark <= self._released_s:
            return None
        return self._release(watermark)

    def flush(self) -> MeasurementBatch | None:
        """Return all that waits, in order, or None."""
        if not self._waiting:
            return None
        return self._release(math.nextafter(self._latest_s, math.inf))

    def _release(self, watermark_s: float) -> MeasurementBatch | None:
        rows = MeasurementBatch.concatenate(self._waiting)
        ready = rows.time_s < watermark_s
        self._released_s = watermark_s
        self._waiting = [] if ready.all() else [rows.take(~ready)]
        if not ready.any():
            return None
        released = rows.take(ready)
        released = released.take(canonical_order(released))
        unique = ~_repeats(released)
        self.duplicates += int(len(unique) - unique.sum())
        return released if unique.all() else released.take(unique)


def canonical_order(batch: MeasurementBatch) -> NDArray[np.intp]:
    """Return the order of rows by time, then by content.

    Parameters
    ----------
    batch : MeasurementBatch
        Rows in any order.

    Returns
    -------
    (n,) intp
        Indices.
    """
    order = np.argsort(batch.time_s, kind="stable")
    times = batch.time_s[order]
    same = np.flatnonzero(times[1:] == times[:-1])
    if len(same):
        # Few rows share their time with another; only they are compared in full.
        places = np.union1d(same, same + 1)
        tied = order[places]
        keys = [getattr(batch, name)[tied] for name in reversed(_TIE_COLUMNS)]
        order[places] = tied[np.lexsort([*keys, batch.time_s[tied]])]
    return order


def _repeats(batch: MeasurementBatch) -> NDArray[np.bool_]:
    """Return which rows equal the row before in every column."""
    repeat = np.zeros(len(batch), np.bool_)
    repeat[1:] = batch.time_s[1:] == batch.time_s[:-1]
    if not repeat.any():
        return repeat
    for name in _TIE_COLUMNS:
        column = getattr(batch, name)
        equal = column[1:] == column[:-1]
        if column.dtype.kind == "f":
            equal |= np.isnan(column[1:]) & np.isnan(column[:-1])
        repeat[1:] &= equal
    return repeat
