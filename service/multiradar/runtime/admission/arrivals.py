"""Arrival delays of measurements behind the data time by sensor, and counts of late ones.

Counts start with the process; no output depends
on them.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission._admission_kernels import EXCESS, FUTURE, LATE
from multiradar.runtime.admission._arrival_kernels import count_delays
from multiradar.tracking.input.measurements import MeasurementBatch

#: Resolution of the delays, s, and the longest delay counted.
DELAY_STEP_S = 0.05
DELAY_MAX_S = 120.0
#: A warning names each sensor with a greater fraction of late measurements, of so many at least.
LATE_SHARE_MAX = 0.01
LATE_ROWS_MIN = 100

_OUTCOMES = 4


class ArrivalBoard:
    """Counts measurements by sensor and delay; one owner, any thread reads.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    horizon_s : float
        The reorder horizon, s.
    """

    def __init__(self, sensors: SensorTable, horizon_s: float) -> None:
        self._sensors = sensors
        self._horizon_s = horizon_s
        steps = int(DELAY_MAX_S / DELAY_STEP_S) + 1
        self._delays = np.zeros((len(sensors), steps), np.int64)
        self._counts = np.zeros((len(sensors), _OUTCOMES), np.int64)

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places."""
        more = max(len(sensors) - len(self._counts), 0)
        self._delays = np.pad(self._delays, ((0, more), (0, 0)))
        self._sensors = sensors
        self._counts = np.pad(self._counts, ((0, more), (0, 0)))

    def count(
        self, batch: MeasurementBatch, code: NDArray[np.int8], clock_s: NDArray[np.float64]
    ) -> None:
        """Count measurements with their result of admission.

        Parameters
        ----------
        batch : MeasurementBatch
            Measurements in the order of their arrival.
        code : (n,) int8
            Result of the admission of each.
        clock_s : (n,) float64
            Data clock before each; NaN where it was not set.
        """
        count_delays(
            batch.time_s, batch.sensor, code, clock_s, 1.0 / DELAY_STEP_S, self._delays,
            self._counts,
        )  # fmt: skip

    def undo(
        self, batch: MeasurementBatch, code: NDArray[np.int8], clock_s: NDArray[np.float64]
    ) -> None:
        """Undo `count` with the same arguments: the measurements will be sent again."""
        delays, counts = np.zeros_like(self._delays), np.zeros_like(self._counts)
        count_delays(batch.time_s, batch.sensor, code, clock_s, 1.0 / DELAY_STEP_S, delays, counts)
        self._delays -= delays
        self._counts -= counts

    def records(self) -> dict[str, dict[str, Any]]:
        """Return the counts of each sensor with measurements, by identifier.

        Returns
        -------
        dict
            `received`, `late`, `future` and `excess` measurements, and the median and 99th
            percentile of the delay behind the data time, s, in steps of `DELAY_STEP_S`. Late
            measurements are included, future ones and those in excess are not; None where there are
            no others.
        """
        records = {}
        for number in np.flatnonzero(self._counts.sum(axis=1)).tolist():
            counts = self._counts[number].tolist()
            records[self._sensors.ids[number]] = {
                "received": sum(counts),
                "late": counts[LATE],
                "future": counts[FUTURE],
                "excess": counts[EXCESS],
                "delay_s_median": self._delay(number, 0.5),
                "delay_s_p99": self._delay(number, 0.99),
            }
        return records

    def warnings(self) -> list[str]:
        """Return a sentence for each sensor for which the reorder horizon is too short."""
        sentences = []
        for name, record in self.records().items():
            received, late = record["received"], record["late"]
            if received < LATE_ROWS_MIN or late <= LATE_SHARE_MAX * received:
                continue
            sentences.append(
                f"{name}: {late} of {received} measurements ({late / received:.1%}) arrived "
                f"later than the reorder horizon of {self._horizon_s:g} s (reorder_horizon_s) "
                "and were rejected; delay behind the data time: median "
                f"{record['delay_s_median']:g} s, 99th percentile {record['delay_s_p99']:g} s"
            )
        return sentences

    def _delay(self, number: int, fraction: float) -> float | None:
        behind = np.cumsum(self._delays[number])
        if behind[-1] == 0:
            return None
        step = int(np.searchsorted(behind, fraction * behind[-1]))
        # The upper end of the step; 0 for rows without delay.
        return 0.0 if step == 0 else round(DELAY_STEP_S * (step + 1), 2)
