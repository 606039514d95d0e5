"""How far behind the data time the measurements of each sensor arrive, and how many too late.

The data time is the greatest that was accepted so far. What is learnt is since the process began;
it changes no output.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime._kernels import FUTURE, LATE
from multiradar.runtime.admission._arrival_kernels import count_delays
from multiradar.tracking.input.measurements import MeasurementBatch

#: Steps in which delays are told, s, and the longest that is told.
DELAY_STEP_S = 0.05
DELAY_MAX_S = 120.0
#: A sensor of which a greater part comes too late, of so many at least, is named in words.
LATE_SHARE_MAX = 0.01
LATE_ROWS_MIN = 100

_VERDICTS = 3


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
        self._counts = np.zeros((len(sensors), _VERDICTS), np.int64)

    def count(self, batch: MeasurementBatch, code: NDArray[np.int8], clock_s: float | None) -> None:
        """Take measurements that were admitted or not.

        Parameters
        ----------
        batch : MeasurementBatch
            Measurements in the order of their arrival.
        code : (n,) int8
            The verdict on each.
        clock_s : float or None
            Data time before the first of them.
        """
        before = np.nan if clock_s is None else clock_s
        count_delays(
            batch.time_s, batch.sensor, code, before, 1.0 / DELAY_STEP_S, self._delays,
            self._counts,
        )  # fmt: skip

    def records(self) -> dict[str, dict[str, Any]]:
        """Return what is known of each sensor that measured, by identifier.

        Returns
        -------
        dict
            `received`, `late` and `future` measurements, and the delay behind the data time, s,
            that half and 99 % of them have at most, in steps of `DELAY_STEP_S`; late ones are among
            them, those from the future are not, and it is None where there are no others.
        """
        told = {}
        for number in np.flatnonzero(self._counts.sum(axis=1)).tolist():
            counts = self._counts[number].tolist()
            told[self._sensors.ids[number]] = {
                "received": sum(counts),
                "late": counts[LATE],
                "future": counts[FUTURE],
                "delay_s_median": self._delay(number, 0.5),
                "delay_s_p99": self._delay(number, 0.99),
            }
        return told

    def warnings(self) -> list[str]:
        """Return a sentence for each sensor for which the reorder horizon is too short."""
        told = []
        for name, record in self.records().items():
            received, late = record["received"], record["late"]
            if received < LATE_ROWS_MIN or late <= LATE_SHARE_MAX * received:
                continue
            told.append(
                f"{name}: {late} of {received} measurements ({late / received:.1%}) came later "
                f"than the reorder horizon of {self._horizon_s:g} s allows and were refused; half "
                f"of all arrive within {record['delay_s_median']:g} s of the data time, 99 % "
                f"within {record['delay_s_p99']:g} s (reorder_horizon_s)"
            )
        return told

    def _delay(self, number: int, share: float) -> float | None:
        behind = np.cumsum(self._delays[number])
        if behind[-1] == 0:
            return None
        step = int(np.searchsorted(behind, share * behind[-1]))
        # The upper end of the step, but for those that are not behind at all.
        return 0.0 if step == 0 else round(DELAY_STEP_S * (step + 1), 2)
