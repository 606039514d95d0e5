"""Accounting of every line and byte of a file, and rejected lines."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Self

from multiradar_converters.errors import AccountingError, LayoutError
from multiradar_schemas.reject import Reject, RejectCode


@dataclass(frozen=True)
class RejectedLine:
    """A rejected line for `rejects.ndjson`; lines are numbered from 1."""

    line: int
    code: RejectCode
    reason: str
    raw: bytes


@dataclass
class Account:
    """Disposition of the lines and bytes of a file."""

    file: str
    size: int
    table: str = ""
    # Latest time of its rows.
    last_s: float | None = None
    bytes_read: int = 0
    lines: int = 0
    header: int = 0
    blank: int = 0
    accepted: int = 0
    rejected: Counter[RejectCode] = field(default_factory=Counter)
    # First rejected line of each code.
    examples: dict[RejectCode, RejectedLine] = field(default_factory=dict)

    def reject(self, line: RejectedLine) -> None:
        """Record a rejected line."""
        self.rejected[line.code] += 1
        self.examples.setdefault(line.code, line)

    def add_time(self, last_s: float) -> None:
        """Record the time of a row."""
        self.last_s = last_s if self.last_s is None else max(self.last_s, last_s)

    def check_some_accepted(self) -> None:
        """Reject a file without any accepted line.

        Raises
        ------
        LayoutError
            With the most frequent reason.
        """
        if self.accepted or not self.rejected:
            return
        code, count = self.rejected.most_common(1)[0]
        first = self.examples[code]
        msg = (
            f"{self.file}: none of {self.rejected.total()} lines were accepted; {count} were "
            f"rejected as {code}, the first in line {first.line}: {first.reason}"
        )
        raise LayoutError(msg)

    def check(self) -> None:
        """Check that lines and bytes read are accounted for.

        Raises
        ------
        AccountingError
            A line or byte is unaccounted for.
        """
        accounted = self.header + self.blank + self.accepted + self.rejected.total()
        if self.lines != accounted:
            msg = f"{self.file}: read {self.lines} lines, but accounted for {accounted}"
            raise AccountingError(msg)
        if self.bytes_read != self.size:
            msg = (
                f"{self.file}: expected {self.size} bytes, read {self.bytes_read}: "
                "the file changed while it was being read"
            )
            raise AccountingError(msg)

    def figures(self) -> dict[str, object]:
        """Return the account for `report.json`."""
        return {
            "table": self.table,
            "last_s": self.last_s,
            "bytes": self.size,
            "lines": self.lines,
            "header": self.header,
            "blank": self.blank,
            "accepted": self.accepted,
            "rejected": self.rejected.total(),
            "rejected_by_code": {str(code): n for code, n in sorted(self.rejected.items())},
        }


class RejectsFile:
    """`rejects.ndjson`, written while lines are rejected."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", encoding="utf-8", newline="\n")

    def write(self, file: str, encoding: str, rejected: RejectedLine) -> None:
        """Add one line."""
        record = Reject(
            file=file,
            line=rejected.line,
            reason=rejected.reason,
            code=rejected.code,
            raw=_decoded(rejected.raw, encoding),
        )
        self._file.write(record.model_dump_json(exclude_none=True) + "\n")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._file.close()


def _decoded(raw: bytes, encoding: str) -> str:
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode(encoding if encoding != "utf-8" else "windows-1251", "backslashreplace")
