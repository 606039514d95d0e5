"""Measurements that were taken before, and what is told of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.input.measurements import MeasurementBatch

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Duplicates:
    """Measurements that are left out because another one says the same.

    Attributes
    ----------
    place : (n,) int64
        Which they are: places in the order in which measurements were handed to the engine, from 0.
    twin_time_s : (n,) float64
        Data time of the measurement that was kept.
    range_apart_m, azimuth_apart_rad : (n,) float64
        How far apart both are; 0 where they are equal in every column.
    batch : MeasurementBatch
        The measurements that are left out.
    """

    place: Integers
    twin_time_s: Floats
    range_apart_m: Floats
    azimuth_apart_rad: Floats
    batch: MeasurementBatch

    def __len__(self) -> int:
        return len(self.place)

    @classmethod
    def equal(cls, place: Integers, batch: MeasurementBatch) -> "Duplicates":
        """Return measurements that equal another in every column."""
        none = np.zeros(len(batch))
        return cls(place, batch.time_s, none, none, batch)

    @classmethod
    def concatenate(cls, parts: "Sequence[Duplicates]") -> "Duplicates":
        """Return the rows of all parts, one after the other."""
        told = [part for part in parts if len(part)]
        if len(told) < 2:
            return told[0] if told else NO_DUPLICATES
        return cls(
            place=np.concatenate([part.place for part in told]),
            twin_time_s=np.concatenate([part.twin_time_s for part in told]),
            range_apart_m=np.concatenate([part.range_apart_m for part in told]),
            azimuth_apart_rad=np.concatenate([part.azimuth_apart_rad for part in told]),
            batch=MeasurementBatch.concatenate([part.batch for part in told]),
        )

    def reasons(self) -> list[str]:
        """Return one sentence for people for each."""
        told = zip(
            self.batch.time_s.tolist(), self.twin_time_s.tolist(), self.range_apart_m.tolist(),
            np.degrees(self.azimuth_apart_rad).tolist(), strict=True,
        )  # fmt: skip
        return [_reason(*one) for one in told]


NO_DUPLICATES = Duplicates.equal(np.empty(0, np.int64), MeasurementBatch.empty())


def _reason(time_s: float, twin_s: float, range_m: float, azimuth_deg: float) -> str:
    if time_s == twin_s and range_m == 0.0 and azimuth_deg == 0.0:
        return f"expected a measurement of its own, was equal to another at {twin_s} s"
    return (
        f"expected a plot of its own, was the one at {twin_s} s of the same sensor, "
        f"{abs(time_s - twin_s):.3f} s, {range_m:.1f} m and {azimuth_deg:.4f}° apart"
    )
