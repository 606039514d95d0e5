"""Rejects rows whose times are outliers within their file."""

import datetime as dt
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.vid import fields
from multiradar_converters.vid.accounting import Account, RejectedLine, RejectsFile
from multiradar_converters.vid.text.layout import FileLayout
from multiradar_converters.vid.text.lines import Row, parse_line
from multiradar_converters.vid.text.times import TimeUnwrapper
from multiradar_schemas.reject import RejectCode

# Maximum rejected lines waiting for a decision on an earlier row, so that rejects stay in order.
_WAITING_REJECTS_MAX = 10_000


@dataclass
class Rows:
    """Accepted rows of a block.

    Attributes
    ----------
    numbers : float64[6, n]
        By role, SI and degrees; NaN if absent. Roles that the table lacks are undefined.
    integers : int64[6, n]
        By role minus `FIRST_INTEGER`; -1 if absent.
    begins : int64[n]
        Begin of the line of each in the text of its block.
    """

    numbers: NDArray[np.float64]
    integers: NDArray[np.int64]
    begins: NDArray[np.int64]

    def chosen(self, keep: NDArray[np.bool_] | slice) -> "Rows":
        """Return selected rows."""
        return Rows(self.numbers[:, keep], self.integers[:, keep], self.begins[keep])

    def number(self, role: int) -> NDArray[np.float64]:
        """Return the column of a role."""
        column: NDArray[np.float64] = self.numbers[role]
        return column

    def integer(self, role: int) -> NDArray[np.int64]:
        """Return the column of a role."""
        column: NDArray[np.int64] = self.integers[role - fields.FIRST_INTEGER]
        return column

    def __len__(self) -> int:
        return len(self.numbers[0])


@dataclass
class Parsed:
    """Result of parsing the lines of a block."""

    size: int
    text: bytearray | bytes
    lines: int = 0
    blank: int = 0
    header: int = 0
    rows: list[Rows] = field(default_factory=list)
    # Line numbers within the block, from 0.
    rejected: list[RejectedLine] = field(default_factory=list)


class TimeFilter:
    """Checks the times of the rows of a file, block by block, and writes its rejects in order.

    Parameters
    ----------
    layout : FileLayout
        Layout of the file.
    clock : TimeUnwrapper or None
        Unwraps times and marks outliers; None accepts every row.
    account : Account
        Rejected lines are added; its line count is that of the previous blocks.
    rejects : RejectsFile
        Receives the rejected lines.
    """

    def __init__(
        self,
        layout: FileLayout,
        clock: TimeUnwrapper | None,
        account: Account,
        rejects: RejectsFile,
    ) -> None:
        self._layout = layout
        self._clock = clock
        self._account = account
        self._file = rejects
        self._rejects: list[RejectedLine] = []
        # Rows pending a decision by later rows, and their lines.
        self._waiting: Rows | None = None
        self._lines: list[tuple[int, bytes]] = []
        self._last_s = 0.0

    def push(self, parsed: Parsed) -> list[Rows]:
        """Process a block; return accepted rows, which may belong to previous blocks."""
        before = self._account.lines
        self._rejects += [
            RejectedLine(before + 1 + each.line, each.code, each.reason, each.raw)
            for each in parsed.rejected
        ]
        passed = [self._checked(rows, parsed.text) for rows in parsed.rows if len(rows)]
        self._write()
        return [rows for rows in passed if len(rows)]

    def finish(self) -> None:
        """Reject pending rows at the end of the file."""
        for line, raw in self._lines:
            self._reject(line, raw, self._last_s)
        self._lines = []
        self._write()

    def _checked(self, rows: Rows, text: bytearray | bytes) -> Rows:
        if self._clock is None:
            return rows
        lines = self._lines
        if self._waiting is not None:
            rows = _concatenated(self._waiting, rows)
        times = rows.number(fields.TIME)
        kept = np.empty(len(rows), dtype=np.bool_)
        decided, rejected = self._clock.run(times, kept)
        self._waiting, self._lines = None, []
        if decided == len(rows) and not rejected:
            return rows

        def line_of(place: int) -> tuple[int, bytes]:
            if place < len(lines):
                return lines[place]
            return self._line(text, int(rows.begins[place]))

        for place in np.flatnonzero(~kept[:decided]).tolist():
            self._reject(*line_of(place), float(times[place]))
        if decided < len(rows):
            self._waiting = rows.chosen(slice(decided, None))
            self._lines = [line_of(place) for place in range(decided, len(rows))]
            self._last_s = self._clock.last_s
        return rows.chosen(slice(decided)).chosen(kept[:decided])

    def _line(self, text: bytearray | bytes, begin: int) -> tuple[int, bytes]:
        mark = bytes((self._layout.terminator,))
        end = text.find(mark, begin)
        raw = bytes(text[begin : len(text) if end < 0 else end])
        return self._account.lines + 1 + text.count(mark, 0, begin), raw.removesuffix(b"\r")

    def _reject(self, line: int, raw: bytes, near: float) -> None:
        row = parse_line(raw, self._layout)
        time = row.numbers[fields.TIME] if isinstance(row, Row) else float("nan")
        name = self._layout.name_of(fields.TIME)
        reason = (
            f"{name}: expected a time near {self._shown(near, 0)} as in neighbouring lines, "
            f"was {self._shown(time, 3)}"
        )
        self._rejects.append(RejectedLine(line, RejectCode.OUT_OF_RANGE, reason, raw))

    def _shown(self, time: float, decimals: int) -> str:
        if not self._layout.iso_time:
            return f"{time:.{decimals}f} s"
        moment = dt.datetime(1970, 1, 1) + dt.timedelta(seconds=round(time, decimals))  # noqa: DTZ001
        return f"{moment.isoformat(timespec='milliseconds' if decimals else 'seconds')}Z"

    def _write(self) -> None:
        """Write the rejected lines before the first pending row."""
        end = self._lines[0][0] if self._lines else None
        if len(self._rejects) > _WAITING_REJECTS_MAX:
            end = None
        self._rejects.sort(key=lambda each: each.line)
        later = []
        for rejected in self._rejects:
            if end is not None and rejected.line > end:
                later.append(rejected)
                continue
            self._file.write(self._account.file, self._layout.encoding, rejected)
            self._account.reject(rejected)
        self._rejects = later


def _concatenated(first: Rows, then: Rows) -> Rows:
    return Rows(
        np.concatenate([first.numbers, then.numbers], axis=1),
        np.concatenate([first.integers, then.integers], axis=1),
        np.concatenate([first.begins, then.begins]),
    )
