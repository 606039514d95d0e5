"""Health of each radar at the end of an epoch."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.columns import column_types, joined_columns

Floats = NDArray[np.float64]

#: Bits of `HealthRecords.alarms`, by position in `ALARM_NAMES`.
ALARM_SILENT, ALARM_BIAS_JUMP, ALARM_NOISE, ALARM_SITE, ALARM_ADDRESS = range(5)
#: Names of the alarms on the wire.
ALARM_NAMES = ("silent", "bias_jump", "noise", "site", "address")


@dataclass(frozen=True, slots=True)
class HealthRecords:
    """One row for each radar at the end of each epoch that had measurements.

    Attributes
    ----------
    epoch : (n,) int64
        Number of the epoch of data time.
    time_s : (n,) float64
        Data time of its end.
    sensor : (n,) int32
        The radar.
    detection_probability : (n,) float64
        Probability of detection of confirmed tracks; NaN before the first scan.
    looks : (n,) float64
        Number of scans it is based on; old ones count less.
    range_sigma_ratio, azimuth_sigma_ratio : (n,) float64
        Measured over configured noise; NaN while the biases are not settled.
    range_trend_mps, range_trend_sigma_mps : (n,) float64
        Trend of the range offset, and its standard deviation; NaN where it is not estimated, or not
        for long enough.
    azimuth_trend_rad_per_s, azimuth_trend_sigma_rad_per_s : (n,) float64
        The same for the azimuth offset.
    site_east_m, site_north_m, site_sigma_m : (n,) float64
        Estimated error of the configured site (biased low, as tracks absorb part of it), and its
        standard deviation on the worse axis; NaN while unobservable.
    silence_s : (n,) float64
        Data time since the last plot; NaN before the first.
    tracks_in_cover, tracks_heard : (n,) int64
        Confirmed tracks in coverage of the radar, and those of them that it detected recently.
    jumps : (n,) int64
        Number of bias jumps so far.
    last_jump_s : (n,) float64
        Data time of the detection of the last jump; NaN before the first.
    alarms : (n,) int64
        Bit i is set while the alarm `ALARM_NAMES` i is active.
    """

    epoch: NDArray[np.int64]
    time_s: Floats
    sensor: NDArray[np.int32]
    detection_probability: Floats
    looks: Floats
    range_sigma_ratio: Floats
    azimuth_sigma_ratio: Floats
    range_trend_mps: Floats
    range_trend_sigma_mps: Floats
    azimuth_trend_rad_per_s: Floats
    azimuth_trend_sigma_rad_per_s: Floats
    site_east_m: Floats
    site_north_m: Floats
    site_sigma_m: Floats
    silence_s: Floats
    tracks_in_cover: NDArray[np.int64]
    tracks_heard: NDArray[np.int64]
    jumps: NDArray[np.int64]
    last_jump_s: Floats
    alarms: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.epoch)

    @classmethod
    def concatenate(cls, parts: "Sequence[HealthRecords]") -> "HealthRecords":
        """Return the rows of all parts, one after the other."""
        return cls(**joined_columns(cls, parts))

    def select(self, rows: NDArray[np.bool_]) -> "HealthRecords":
        """Return the selected rows."""
        return HealthRecords(
            **{name: getattr(self, name)[rows] for name in column_types(HealthRecords)}
        )
