"""`rejects.ndjson` of an offline run: each measurement refused, its place, why and what it said."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from shutil import copyfileobj
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission.admission import ACCEPTED, LATE, Admission
from multiradar.storage.recording import INDEX_COLUMN
from multiradar.tracking.input.duplicates import Duplicates
from multiradar.wire import Rejected, measurement_rows
from multiradar_schemas.measurements.reject import Reject, RejectCode


class RejectFile:
    """Writes refusals in the order of the recording, then what is there twice by its time.

    Parameters
    ----------
    path : Path
        The file to make.
    source : str
        Name of the recording.
    """

    def __init__(self, path: Path, source: str) -> None:
        self._stream = path.open("w", encoding="utf-8", newline="\n")
        # Which rows are there twice shows later; so that blocks leave no trace, they come last.
        self._spool = path.with_name(path.name + ".twice")
        self._twice = self._spool.open("w+", encoding="utf-8", newline="\n")
        self._source = source

    def write(
        self,
        frame: pl.DataFrame,
        refused: Rejected,
        times: "TimeRefusals",
    ) -> Counter[str]:
        """Write what was refused of one batch.

        Parameters
        ----------
        frame : DataFrame
            The batch, with `index`.
        refused : Rejected
            Rows that cannot be true.
        times : TimeRefusals
            Rows of those left that the admission refused.

        Returns
        -------
        Counter
            How many, by code.
        """
        left = np.ones(len(frame), np.bool_)
        left[refused.index] = False
        rows_left = np.flatnonzero(left)
        why = zip(refused.code, refused.reason, strict=True)
        verdicts = dict(zip(refused.index.tolist(), why, strict=True))
        for place, code, reason in times.verdicts:
            verdicts[int(rows_left[place])] = (code, reason)
        for row in sorted(verdicts):
            code, reason = verdicts[row]
            self._stream.write(self._line(frame.row(row, named=True), code, reason))
        return Counter(str(code) for code, _ in verdicts.values())

    def write_duplicates(
        self, found: Duplicates, places: Sequence[int], sensors: SensorTable
    ) -> None:
        """Take measurements that are there twice.

        Parameters
        ----------
        found : Duplicates
            The measurements.
        places : sequence of int
            Row of each in the recording.
        sensors : SensorTable
            The sensors.
        """
        rows = zip(places, found.reasons(), measurement_rows(found.batch, sensors), strict=True)
        for place, reason, raw in rows:
            said = {INDEX_COLUMN: place, **raw}
            self._twice.write(self._line(said, RejectCode.DUPLICATE, reason))

    def finish(self) -> None:
        """Write what is there twice to the end of the file."""
        self._twice.seek(0)
        copyfileobj(self._twice, self._stream)

    def close(self) -> None:
        """Close the file."""
        self._twice.close()
        self._spool.unlink(missing_ok=True)
        self._stream.close()

    def _line(self, row: dict[str, Any], code: RejectCode, reason: str) -> str:
        place = row.pop(INDEX_COLUMN)
        raw = json.dumps({name: value for name, value in row.items() if value is not None})
        reject = Reject(file=self._source, offset=place, reason=reason, code=code, raw=raw)
        return reject.model_dump_json(exclude_none=True) + "\n"


class TimeRefusals:
    """The rows of one batch that the admission refused, each told with the data time it met.

    Parameters
    ----------
    admission : Admission
        What refused them.
    clock_s : float or None
        Its data time before the batch.
    time_s : (n,) float64
        Times of the batch.
    codes : (n,) int8
        Its verdicts.

    Attributes
    ----------
    verdicts : list of (int, RejectCode, str)
        Row of the batch, code and sentence.
    """

    def __init__(
        self,
        admission: Admission,
        clock_s: float | None,
        time_s: NDArray[np.float64],
        codes: NDArray[np.int8],
    ) -> None:
        before = -np.inf if clock_s is None else clock_s
        accepted_s = np.where(codes == ACCEPTED, time_s, -np.inf)
        # The data time that each row met, so that the sentence does not depend on the batches.
        met_s = np.maximum(np.maximum.accumulate(np.append(-np.inf, accepted_s))[:-1], before)
        self.verdicts: list[tuple[int, RejectCode, str]] = []
        for row in np.flatnonzero(codes != ACCEPTED).tolist():
            late = codes[row] == LATE
            bound = _late(admission, met_s[row]) if late else _future(admission, met_s[row])
            code = RejectCode.TIME_LATE if late else RejectCode.TIME_FUTURE
            self.verdicts.append((row, code, f"expected a time {bound}, was {time_s[row]} s"))


def _late(admission: Admission, met_s: float) -> str:
    # The later of the two bounds is the one that counted.
    if admission.floor_s > met_s - admission.horizon_s:
        return f"not before the end of the stream at {admission.floor_s} s"
    return f"at most {admission.horizon_s:g} s before the data time {met_s} s"


def _future(admission: Admission, met_s: float) -> str:
    return f"at most {admission.forward_jump_max_s:g} s after the data time {met_s} s"
