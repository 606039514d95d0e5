"""`rejects.ndjson` of an offline run: rejected measurements with row, code, reason and content."""

import json
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from shutil import copyfileobj
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission.admission_by_time import ACCEPTED, EXCESS, LATE, Admission
from multiradar.storage.recording import INDEX_COLUMN
from multiradar.tracking.input.duplicates import Duplicates
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.wire import Rejected, measurement_rows
from multiradar_schemas.reject import Reject, RejectCode


class RejectFile:
    """Writes rejects in the order of the recording, then duplicates in the order of time.

    Parameters
    ----------
    path : Path
        The file to write.
    source : str
        Name of the recording.
    """

    def __init__(self, path: Path, source: str) -> None:
        self._stream = path.open("w", encoding="utf-8", newline="\n")
        # Duplicates are found later. They come last: the file does not depend on the blocks.
        self._spool = path.with_name(path.name + ".twice")
        self._twice = self._spool.open("w+", encoding="utf-8", newline="\n")
        self._source = source

    def write_lines(self, lines: Iterable[str]) -> None:
        """Write rejects of a conversion, as lines of such a file."""
        self._stream.writelines(lines)

    def write(
        self,
        frame: pl.DataFrame,
        rejected: Rejected,
        times: "TimeRejects",
    ) -> Counter[str]:
        """Write the rejects of one batch.

        Parameters
        ----------
        frame : DataFrame
            The batch, with `index`.
        rejected : Rejected
            Implausible rows.
        times : TimeRejects
            Rows of the rest that the admission rejected.

        Returns
        -------
        Counter
            Number of rejects by code.
        """
        left = np.ones(len(frame), np.bool_)
        left[rejected.index] = False
        rows_left = np.flatnonzero(left)
        why = zip(rejected.code, rejected.reason, strict=True)
        rejections = dict(zip(rejected.index.tolist(), why, strict=True))
        for index, code, reason in times.rejections:
            rejections[int(rows_left[index])] = (code, reason)
        for row in sorted(rejections):
            code, reason = rejections[row]
            self._stream.write(self._line(frame.row(row, named=True), code, reason))
        return Counter(str(code) for code, _ in rejections.values())

    def write_duplicates(
        self, found: Duplicates, indices: Sequence[int], sensors: SensorTable
    ) -> None:
        """Write duplicate measurements.

        Parameters
        ----------
        found : Duplicates
            The measurements.
        indices : sequence of int
            Row of each in the recording.
        sensors : SensorTable
            The sensors.
        """
        rows = zip(indices, found.reasons(), measurement_rows(found.batch, sensors), strict=True)
        for index, reason, raw in rows:
            row = {INDEX_COLUMN: index, **raw}
            self._twice.write(self._line(row, RejectCode.DUPLICATE, reason))

    def finish(self) -> None:
        """Append the duplicates to the file."""
        self._twice.seek(0)
        copyfileobj(self._twice, self._stream)

    def close(self) -> None:
        """Close the file."""
        self._twice.close()
        self._spool.unlink(missing_ok=True)
        self._stream.close()

    def _line(self, row: dict[str, Any], code: RejectCode, reason: str) -> str:
        index = row.pop(INDEX_COLUMN)
        raw = json.dumps({name: value for name, value in row.items() if value is not None})
        reject = Reject(file=self._source, offset=index, reason=reason, code=code, raw=raw)
        return reject.model_dump_json(exclude_none=True) + "\n"


class TimeRejects:
    """The rows of one batch that the admission rejected, with the data time at their arrival.

    Parameters
    ----------
    admission : Admission
        The admission that rejected them.
    clock_s : (n,) float64
        Its data clock before each row, NaN where it was not set.
    batch : MeasurementBatch
        The rows.
    codes : (n,) int8
        Its results.

    Attributes
    ----------
    rejections : list of (int, RejectCode, str)
        Row of the batch, code and reason.
    """

    def __init__(
        self,
        admission: Admission,
        clock_s: NDArray[np.float64],
        batch: MeasurementBatch,
        codes: NDArray[np.int8],
    ) -> None:
        self.rejections: list[tuple[int, RejectCode, str]] = []
        too_many: dict[int, str] = {}
        for row in np.flatnonzero(codes != ACCEPTED).tolist():
            if codes[row] == EXCESS:
                sensor = int(batch.sensor[row])
                if sensor not in too_many:
                    too_many[sensor] = _too_many(admission, sensor)
                self.rejections.append((row, RejectCode.RATE_EXCEEDED, too_many[sensor]))
                continue
            late = codes[row] == LATE
            # The data time at the arrival of the row: the reason does not depend on the batches.
            met_s, time = float(clock_s[row]), float(batch.time_s[row])
            sensor = int(batch.sensor[row])
            bound = _late(admission, met_s) if late else _future(admission, sensor, met_s, time)
            code = RejectCode.TIME_LATE if late else RejectCode.TIME_FUTURE
            self.rejections.append((row, code, f"expected a time {bound}, was {time} s"))


def _too_many(admission: Admission, sensor: int) -> str:
    rate = f"{admission.rate_per_s(sensor):.0f}"
    return f"the sensor exceeds {rate} measurements per second of data time"


def _late(admission: Admission, met_s: float) -> str:
    # The later of the two bounds applies.
    if admission.floor_s > met_s - admission.horizon_s:
        return f"not before the end of the stream at {admission.floor_s} s"
    return f"at most {admission.horizon_s:g} s before the data time {met_s} s"


def _future(admission: Admission, sensor: int, met_s: float, time_s: float) -> str:
    if time_s > met_s + admission.forward_jump_max_s:
        return f"at most {admission.forward_jump_max_s:g} s after the data time {met_s} s"
    most = f"at most {admission.tolerance_of(sensor):g} s"
    if np.isnan(met_s):
        return f"{most} ahead of the clocks of the other sensors"
    return f"{most} after the data time {met_s} s, on which other sensors agree"
