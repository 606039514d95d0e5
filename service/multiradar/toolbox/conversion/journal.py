"""Measurements of a journal or an archive, as the service received them."""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from multiradar.errors import InputError
from multiradar.storage.entries import EntryKind, RejectedRow, StoredEntry
from multiradar.storage.recording import MEASUREMENTS_FILE, Recording
from multiradar.toolbox.messages.progress import counting_bar
from multiradar_schemas.reject import Reject, RejectCode

if TYPE_CHECKING:
    import polars as pl

#: Entries from one call for the progress bar to the next.
_STEP_ENTRIES = 64


def convert_journal(
    source: Path, out: Path, recovered: Collection[RejectCode], from_s: float, until_s: float
) -> dict[str, Any]:
    """Write the measurements of a journal in the order of their arrival.

    Parameters
    ----------
    source : Path
        State of a service that may be running, backup, journal or archive.
    out : Path
        The folder to create.
    recovered : collection of RejectCode
        Codes of rejects that are read as measurements; with any, all are sorted by time.
    from_s, until_s : float
        Only measurements at or after the first and before the second time, s.

    Returns
    -------
    dict
        Contents of `report.json`.

    Raises
    ------
    InputError
        There is no such journal or archive, or it has no measurements in this time.
    OutputExistsError
        `out` exists.
    JournalError, ConfigurationError
        It is damaged, or of another format; nothing is written.
    """
    from multiradar.storage.output_folder import new_folder
    from multiradar.toolbox.operation.backups import entries_of

    found = _Found(source.name, frozenset(recovered), from_s, until_s)
    with new_folder(out) as folder:
        with (
            entries_of(source) as (first, last, entries),
            (folder / "rejects.ndjson").open("w", encoding="utf-8", newline="\n") as rejects,
            counting_bar("reading entries") as show,
        ):
            writer = _Writer(folder / MEASUREMENTS_FILE)
            for stored in entries:
                writer.append(found.measurements(stored, rejects))
                if stored.sequence % _STEP_ENTRIES == 0 or stored.sequence == last:
                    show(stored.sequence - first + 1, last - first + 1)
            writer.finish()
        if not found.accepted:
            raise InputError(f"{source}: {found.lacking()}")
        if recovered:
            _sort(folder)
        return found.write_report(folder / "report.json", source, first, last)


class _Writer:
    # The columns are those of a conversion.
    def __init__(self, path: Path) -> None:
        from multiradar.storage.table_writer import TableWriter
        from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA

        self._columns = MEASUREMENT_SCHEMA.names()
        self._writer = TableWriter(path, MEASUREMENT_SCHEMA)

    def append(self, frame: "pl.DataFrame") -> None:
        if len(frame):
            self._writer.append(frame.select(self._columns))

    def finish(self) -> None:
        self._writer.finish()


@dataclass
class _Found:
    # What a journal contained.
    name: str
    recovered_codes: frozenset[RejectCode]
    from_s: float
    until_s: float
    accepted: int = 0
    recovered: Counter[RejectCode] = field(default_factory=Counter)
    rejected: Counter[RejectCode] = field(default_factory=Counter)
    lost: int = 0
    outside: int = 0
    flushes: int = 0
    sensor_changes: list[dict[str, Any]] = field(default_factory=list)
    clock_changes: list[dict[str, Any]] = field(default_factory=list)
    first_s: float = np.inf
    last_s: float = -np.inf

    def measurements(self, stored: StoredEntry, rejects: IO[str]) -> "pl.DataFrame":
        """Return the measurements of an entry, and write its rejected rows."""
        import polars as pl

        from multiradar.runtime.admission.admission_by_time import data_clock_of
        from multiradar.runtime.admission.sensors_in_force import changed_sensor
        from multiradar.runtime.live.payload import decode_rows
        from multiradar_schemas.measurements.columns import complete

        entry = stored.entry
        frames = []
        if entry.kind is EntryKind.SENSOR:
            sensor_id = changed_sensor(entry.payload)
            self.sensor_changes.append({"entry": stored.sequence, "sensor_id": sensor_id})
        elif entry.kind is EntryKind.CLOCK:
            time_s = data_clock_of(entry.admission)
            self.clock_changes.append({"entry": stored.sequence, "time_s": time_s})
        elif entry.kind is EntryKind.FLUSH:
            self.flushes += 1
        elif entry.kind is EntryKind.BATCH and entry.payload:
            frames.append(complete(decode_rows(entry.payload)))
        if entry.rejects:
            frame, left = self._recover(entry.rejects)
            for row in left:
                self._reject(row, stored, rejects)
            frames.append(complete(frame))
        rows = pl.concat(frames) if frames else pl.DataFrame()
        return self._within(rows) if len(rows) else rows

    def _within(self, rows: "pl.DataFrame") -> "pl.DataFrame":
        import polars as pl

        # A time that is not a number is in no interval.
        kept = rows.filter(pl.col("time_s") >= self.from_s, pl.col("time_s") < self.until_s)
        self.outside += len(rows) - len(kept)
        self.accepted += len(kept)
        if len(kept):
            low, high = kept.select(pl.min("time_s"), pl.max("time_s").alias("last")).row(0)
            self.first_s, self.last_s = min(self.first_s, low), max(self.last_s, high)
        return kept

    def _recover(self, rows: Sequence[RejectedRow]) -> "tuple[pl.DataFrame, list[RejectedRow]]":
        from multiradar_converters.normalised.text import parse_ndjson

        wanted = [row for row in rows if row.code in self.recovered_codes and row.raw]
        lines = [" ".join(row.raw.splitlines()).encode("utf-8", "replace") for row in wanted]
        parsed = parse_ndjson(b"\n".join(lines))
        readable = set(parsed.frame["index"].to_list())
        kept = {row.index: RejectCode(row.code) for k, row in enumerate(wanted) if k in readable}
        self.recovered.update(kept.values())
        return parsed.frame, [row for row in rows if row.index not in kept]

    def _reject(self, row: RejectedRow, stored: StoredEntry, rejects: IO[str]) -> None:
        code = RejectCode(row.code)
        self.rejected[code] += 1
        # Without its content, or with content that is not a measurement.
        self.lost += code in self.recovered_codes
        line = Reject(
            file=self.name, offset=row.index, code=code, raw=row.raw,
            reason=f"entry {stored.sequence} from {stored.entry.source}: {row.reason}",
        )  # fmt: skip
        rejects.write(line.model_dump_json(exclude_none=True) + "\n")

    def lacking(self) -> str:
        """Return why there are no measurements."""
        if self.outside:
            return (
                f"no measurements in the selected period; all {self.outside:,} measurements are "
                "outside"
            )
        if self.rejected:
            by_code = ", ".join(f"{code} {count}" for code, count in sorted(self.rejected.items()))
            return f"no accepted measurements; rejected: {by_code}"
        return "no measurements"

    def write_report(self, path: Path, source: Path, first: int, last: int) -> dict[str, Any]:
        """Write and return the report."""
        from multiradar_converters.report_file import Converted, write_report

        rejected = sum(self.rejected.values())
        counts = {"read": self.accepted + rejected, "accepted": self.accepted, "rejected": rejected}
        size = sum(one.stat().st_size for one in [source, *source.glob("*")] if one.is_file())
        return write_report(path, Converted(
            command="convert journal",
            inputs=[(self.name, size, counts)],
            rejected_by_code=self.rejected,
            measurements=self.accepted,
            settings={
                "recovered": sorted(self.recovered_codes),
                "from_s": self.from_s if np.isfinite(self.from_s) else None,
                "until_s": self.until_s if np.isfinite(self.until_s) else None,
            },
            figures={
                "first_entry": first,
                "last_entry": last,
                "first_s": self.first_s,
                "last_s": self.last_s,
                "recovered_by_code": dict(sorted(self.recovered.items())),
                "not_recovered": self.lost,
                "outside": self.outside,
                "flushes": self.flushes,
                "sensor_changes": self.sensor_changes,
                "clock_changes": self.clock_changes,
            },
        ))  # fmt: skip


def _sort(folder: Path) -> None:
    from multiradar.storage.time_order import in_time_order
    from multiradar_converters.leftovers import temporary_folder

    path = folder / MEASUREMENTS_FILE
    with temporary_folder("multiradar-sort-") as temporary:
        sorted_rows = in_time_order(Recording(path), temporary)
        writer = _Writer(folder / "sorted.parquet")
        for block in sorted_rows.blocks():
            writer.append(block)
        writer.finish()
    (folder / "sorted.parquet").replace(path)
