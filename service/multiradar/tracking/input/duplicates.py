"""Duplicate measurements, and the reasons for their rejection."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.input.measurements import MeasurementBatch

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Duplicates:
    """Measurements left out as duplicates of others.

    Attributes
    ----------
    arrival : (n,) int64
        Their positions in the order of arrival at the engine, from 0.
    twin_time_s : (n,) float64
        Data time of the measurement that is kept.
    range_apart_m, azimuth_apart_rad : (n,) float64
        Differences between both; 0 where they are equal in every column.
    batch : MeasurementBatch
        The duplicates.
    """

    arrival: Integers
    twin_time_s: Floats
    range_apart_m: Floats
    azimuth_apart_rad: Floats
    batch: MeasurementBatch

    def __len__(self) -> int:
        return len(self.arrival)

    @classmethod
    def equal(cls, arrival: Integers, batch: MeasurementBatch) -> "Duplicates":
        """Return measurements that equal another in every column."""
        none = np.zeros(len(batch))
        return cls(arrival, batch.time_s, none, none, batch)

    @classmethod
    def concatenate(cls, parts: "Sequence[Duplicates]") -> "Duplicates":
        """Return the rows of all parts, one after the other."""
        given = [part for part in parts if len(part)]
        if len(given) < 2:
            return given[0] if given else NO_DUPLICATES
        return cls(
            arrival=np.concatenate([part.arrival for part in given]),
            twin_time_s=np.concatenate([part.twin_time_s for part in given]),
            range_apart_m=np.concatenate([part.range_apart_m for part in given]),
            azimuth_apart_rad=np.concatenate([part.azimuth_apart_rad for part in given]),
            batch=MeasurementBatch.concatenate([part.batch for part in given]),
        )

    def reasons(self) -> list[str]:
        """Return the reason for each, as text."""
        given = zip(
            self.batch.time_s.tolist(), self.twin_time_s.tolist(), self.range_apart_m.tolist(),
            np.degrees(self.azimuth_apart_rad).tolist(), strict=True,
        )  # fmt: skip
        return [_reason(*one) for one in given]


NO_DUPLICATES = Duplicates.equal(np.empty(0, np.int64), MeasurementBatch.empty())


def _reason(time_s: float, twin_s: float, range_m: float, azimuth_deg: float) -> str:
    if time_s == twin_s and range_m == 0.0 and azimuth_deg == 0.0:
        return f"same measurement as at {twin_s} s"
    return (
        f"duplicate of the plot of the same sensor at {twin_s} s: {abs(time_s - twin_s):.3f} s, "
        f"{range_m:.1f} m and {azimuth_deg:.4f}° apart"
    )
