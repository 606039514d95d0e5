"""A destination in memory, for tests."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import polars as pl

from multiradar.ingest.replay.replaying import Answer
from multiradar_schemas.reject import RejectCode


@dataclass(slots=True)
class MemoryDestination:
    """Keeps every batch once, by key.

    Attributes
    ----------
    failures : list of Exception
        Raised one by one before anything is stored, until none is left.
    lost_answers : list of Exception
        Raised one by one after a batch was stored: its answer is lost.
    starts : list of str
        Progress reports of its start, one by one.
    batches : dict
        Stored batches by key, in order.
    flushes : list of str
        Keys of the ends of streams.
    sensors : tuple of str
        Configured sensors; when empty, all sensors are accepted.
    statuses : list of mapping
        Status documents, one by one; the last one remains.
    """

    failures: list[Exception] = field(default_factory=list)
    lost_answers: list[Exception] = field(default_factory=list)
    starts: list[str] = field(default_factory=list)
    batches: dict[str, pl.DataFrame] = field(default_factory=dict)
    flushes: list[str] = field(default_factory=list)
    closed: bool = False
    sensors: tuple[str, ...] = ()
    statuses: list[Mapping[str, Any]] = field(default_factory=list)

    def send(self, frame: pl.DataFrame, key: str) -> Answer:
        """Store a batch, unless its key is known."""
        if self.failures:
            raise self.failures.pop(0)
        duplicate = key in self.batches
        self.batches.setdefault(key, frame)
        if self.lost_answers:
            raise self.lost_answers.pop(0)
        unconfigured = frame["sensor_id"].is_in(self.sensors).not_() if self.sensors else ()
        unknown = tuple(row for row, one in enumerate(unconfigured) if one)
        return Answer(
            accepted=len(frame) - len(unknown),
            rejected=len(unknown),
            duplicate=duplicate,
            codes={str(RejectCode.UNKNOWN_SENSOR): len(unknown)} if unknown else {},
            unknown=unknown,
        )

    def flush(self, key: str) -> None:
        """Record the end of the stream."""
        if self.failures:
            raise self.failures.pop(0)
        self.flushes.append(key)

    def starting(self) -> str | None:
        """Return the next progress report of the start, then None."""
        return self.starts.pop(0) if self.starts else None

    def configured(self) -> tuple[str, ...]:
        """Return the configured sensors."""
        return self.sensors

    def status(self) -> Mapping[str, Any]:
        """Return the next status, and the last one from then on."""
        return self.statuses.pop(0) if len(self.statuses) > 1 else next(iter(self.statuses), {})

    def close(self) -> None:
        """Record the end of the connection."""
        self.closed = True
