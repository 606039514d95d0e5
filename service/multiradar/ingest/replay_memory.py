"""A destination in memory, the twin of the real ones for tests."""

from dataclasses import dataclass, field

import polars as pl

from multiradar.ingest.replay import Answer
from multiradar_schemas.measurements.reject import RejectCode


@dataclass(slots=True)
class MemoryDestination:
    """Takes every batch once and keeps it, by key.

    Attributes
    ----------
    failures : list of Exception
        Raised one by one, before anything is taken, until none is left.
    lost_answers : list of Exception
        Raised one by one after a batch was taken: its answer does not arrive.
    starts : list of str
        What it says of its start, one by one.
    batches : dict
        What was taken, by key, in order.
    flushes : list of str
        Keys of the ends of streams.
    sensors : tuple of str
        The sensors that it knows; all without any.
    """

    failures: list[Exception] = field(default_factory=list)
    lost_answers: list[Exception] = field(default_factory=list)
    starts: list[str] = field(default_factory=list)
    batches: dict[str, pl.DataFrame] = field(default_factory=dict)
    flushes: list[str] = field(default_factory=list)
    closed: bool = False
    sensors: tuple[str, ...] = ()

    def send(self, frame: pl.DataFrame, key: str) -> Answer:
        """Take a batch, unless its key is known."""
        if self.failures:
            raise self.failures.pop(0)
        duplicate = key in self.batches
        self.batches.setdefault(key, frame)
        if self.lost_answers:
            raise self.lost_answers.pop(0)
        strangers = frame["sensor_id"].is_in(self.sensors).not_() if self.sensors else ()
        unknown = tuple(row for row, one in enumerate(strangers) if one)
        return Answer(
            accepted=len(frame) - len(unknown),
            rejected=len(unknown),
            duplicate=duplicate,
            codes={str(RejectCode.UNKNOWN_SENSOR): len(unknown)} if unknown else {},
            unknown=unknown,
        )

    def flush(self, key: str) -> None:
        """Note the end of the stream."""
        if self.failures:
            raise self.failures.pop(0)
        self.flushes.append(key)

    def starting(self) -> str | None:
        """Return the next of what it says of its start, then None."""
        return self.starts.pop(0) if self.starts else None

    def configured(self) -> tuple[str, ...]:
        """Return the sensors that it knows."""
        return self.sensors

    def close(self) -> None:
        """Note that the connection is no longer needed."""
        self.closed = True
