"""Plots of tracks, as measured."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.input.measurements import MeasurementBatch


@dataclass(frozen=True, slots=True)
class TrackPlots:
    """The measurements that updated tracks, one for each row of `TrackUpdates`, in its order.

    Attributes
    ----------
    track_id : (n,) int64
        Track of each measurement.
    measured : MeasurementBatch
        The measurements, corrected for known biases, not for estimated ones.
    """

    track_id: NDArray[np.int64]
    measured: MeasurementBatch

    def __len__(self) -> int:
        return len(self.track_id)

    @classmethod
    def concatenate(cls, parts: "Sequence[TrackPlots]") -> "TrackPlots":
        """Return the rows of all parts, one after the other."""
        if not parts:
            return cls(np.empty(0, np.int64), MeasurementBatch.empty())
        return cls(
            np.concatenate([part.track_id for part in parts]),
            MeasurementBatch.concatenate([part.measured for part in parts]),
        )
