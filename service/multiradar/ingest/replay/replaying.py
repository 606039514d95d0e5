"""Replay of a recording to a service in data time: bounded batches, keys, retries.

Every batch has a key that is a function of the recording and of its rows. A batch whose answer was
lost is sent again with the same key and ingested once: restarting a killed service loses and
duplicates nothing.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Protocol, TypeVar

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.clock import Clock
from multiradar.errors import PeerError, StreamGoesOnError, UnavailableError
from multiradar.storage.recording import INDEX_COLUMN, Recording
from multiradar_schemas.reject import RejectCode

#: Wall time that a batch spans at finite speed: the latency of batching, s.
PACE_INTERVAL_S = 0.25
BACKOFF_FIRST_S = 0.1
BACKOFF_MAX_S = 5.0
#: How long to try a service that never answered, s: long enough for a restart of the network of its
#: host, short enough for a wrong address.
FIRST_CONTACT_S = 5.0
#: How long to wait for a service that answered before, s; a restart takes less.
AWAY_MAX_S = 120.0
#: Maximum pause for a gap in the data, s; longer gaps are shortened to this.
SILENCE_MAX_S = 60.0
#: Maximum Retry-After that is respected, s.
RETRY_AFTER_MAX_S = 60.0
_KEY_HASH_CHARACTERS = 16
#: Remedy when a service never answered.
NOT_RUNNING = "start the service with `multiradar serve`, or specify its address with --to"

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Answer:
    """Answer of the service to a batch: rows accepted, rows rejected, or duplicate."""

    accepted: int
    rejected: int
    duplicate: bool
    #: Number of rejected rows by code.
    codes: Mapping[str, int] = field(default_factory=dict)
    #: Indices of rows whose sensor is not configured in the service.
    unknown: tuple[int, ...] = ()
    #: Reason of the first rejected row by code.
    reasons: Mapping[str, str] = field(default_factory=dict, compare=False)

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> "Answer":
        """Parse the answer of a service.

        Raises
        ------
        KeyError, TypeError, ValueError
            When it does not have the expected form.
        """
        rejected = document["rejected"]
        return cls(
            accepted=int(document["accepted"]),
            rejected=len(rejected),
            duplicate=bool(document["duplicate"]),
            codes=Counter(str(row["code"]) for row in rejected if "code" in row),
            unknown=tuple(
                int(row["index"])
                for row in rejected
                if row.get("code") == RejectCode.UNKNOWN_SENSOR
            ),
            reasons={
                str(row["code"]): str(row["reason"])
                for row in reversed(rejected)
                if "code" in row and "reason" in row
            },
        )


class Destination(Protocol):
    """Destination of a replay; an answer means that the rows are on disk there."""

    def send(self, frame: pl.DataFrame, key: str) -> Answer:
        """Deliver a batch; raise `UnavailableError` when it may be tried again."""
        ...

    def flush(self, key: str) -> None:
        """Mark the end of the stream; raise `UnavailableError` when it may be tried again."""
        ...

    def starting(self) -> str | None:
        """Return the progress of a service that is starting; None when it has started."""
        ...

    def configured(self) -> tuple[str, ...]:
        """Return the configured sensors of the service; empty when it does not report them."""
        ...

    def status(self) -> Mapping[str, Any]:
        """Return the status of the service; empty when it does not report it."""
        ...

    def close(self) -> None:
        """Close the connection."""
        ...


@dataclass(frozen=True, slots=True)
class ReplayPlan:
    """How a recording is replayed.

    Attributes
    ----------
    batch_rows : int
        Maximum measurements per batch.
    speed : float
        Playback speed (1 = real time); infinite means as fast as the service accepts data.
    kinds : collection of str, optional
        Kinds of measurement to send; all when absent.
    run_name : str, optional
        First part of every key; derived from the bytes of the recording when absent. With another
        name the service ingests the same recording again.
    flush : bool
        Whether to mark the end of the stream.
    away_max_s : float
        How long to try a service that went away or accepts nothing, s. One that never answered is
        tried for at most `FIRST_CONTACT_S`, one that is starting for as long as it reports so.
    """

    batch_rows: int = 1000
    speed: float = float("inf")
    kinds: Collection[str] | None = None
    run_name: str | None = None
    flush: bool = True
    away_max_s: float = AWAY_MAX_S


@dataclass(slots=True)
class ReplayCounts:
    """Counts of a replay: measurements read = accepted + rejected + duplicate, batches, retries."""

    read: int = 0
    accepted: int = 0
    rejected: int = 0
    duplicate: int = 0
    batches: int = 0
    retries: int = 0
    rejected_by_code: dict[str, int] = field(default_factory=dict)
    unknown_sensors: dict[str, int] = field(default_factory=dict)
    data_time_s: float | None = None


@dataclass(frozen=True, slots=True)
class ReplayBatch:
    """Consecutive rows of a recording; its data time is their median, robust to a wrong time."""

    frame: pl.DataFrame
    data_time_s: float
    first_row: int
    last_row: int


@dataclass(slots=True)
class Replay:
    """Replays a recording to a destination.

    Attributes
    ----------
    recording : Recording
        The recording.
    destination : Destination
        The destination.
    plan : ReplayPlan
        Speed, batches and keys.
    clock : Clock
        Paces the batches.
    pause : callable
        Waits for a number of seconds.
    on_batch : callable
        Called with the counts after every batch.
    on_wait : callable
        Called with a message when waiting for the service starts, changes or ends.
    sensor_ids : set of str
        Sensors of the measurements sent so far.
    reasons : dict
        Reason of the first rejected measurement by code.
    """

    recording: Recording
    destination: Destination
    plan: ReplayPlan
    clock: Clock
    pause: Callable[[float], None]
    on_batch: Callable[[ReplayCounts], None] = lambda _counts: None
    on_wait: Callable[[str], None] = lambda _sentence: None
    counts: ReplayCounts = field(default_factory=ReplayCounts)
    sensor_ids: set[str] = field(default_factory=set)
    reasons: dict[str, str] = field(default_factory=dict)
    _answered: bool = False

    def run(self) -> ReplayCounts:
        """Send every batch when due, then the end of the stream.

        Returns
        -------
        ReplayCounts
            Measurements read, accepted, rejected and duplicate.

        Raises
        ------
        PeerError
            The service rejected a batch, or was unavailable for too long.
        """
        plan = self.plan
        run_name = plan.run_name or derived_run_name(self.recording, plan.kinds)
        span_s = plan.speed * PACE_INTERVAL_S
        due_s, played_s = self.clock.monotonic_s(), None
        for batch in replay_batches(self.recording, plan.kinds, plan.batch_rows, span_s):
            step_s = 0.0 if played_s is None else batch.data_time_s - played_s
            due_s += min(max(step_s, 0.0), SILENCE_MAX_S) / plan.speed
            played_s = batch.data_time_s
            self._wait_until(due_s)
            key = f"{run_name}-{batch.first_row}-{batch.last_row}"
            answer = self._retry(partial(self.destination.send, batch.frame, key))
            self._count(batch, answer)
            self.on_batch(self.counts)
        if plan.flush:
            try:
                self._retry(partial(self.destination.flush, f"{run_name}-end"))
            except StreamGoesOnError as error:
                # All measurements are there; those of the last seconds are processed with the next.
                self.on_wait(str(error))
        return self.counts

    def _wait_until(self, due_s: float) -> None:
        remaining_s = due_s - self.clock.monotonic_s()
        if remaining_s > 0.0:
            self.pause(remaining_s)

    def _retry(self, attempt: Callable[[], _T]) -> _T:
        phase = _Phase(self.clock.monotonic_s())
        retry = 0
        while True:
            try:
                answer = attempt()
            except UnavailableError as error:
                self._answered |= error.answered
                pause_s = self._wait(phase, error, backoff_s(retry, error.retry_after_s))
                self.counts.retries += 1
                self.pause(pause_s)
                retry += 1
                continue
            if phase.message:
                waited_s = self.clock.monotonic_s() - phase.first_s
                self.on_wait(f"the service responded after {waited_s:.0f} s; the replay continues")
            self._answered = True
            return answer

    def _wait(self, phase: "_Phase", error: UnavailableError, pause_s: float) -> float:
        # The pause before the next attempt; an error where there is none.
        now_s = self.clock.monotonic_s()
        starting = self.destination.starting() if error.answered else None
        if starting is not None:
            phase.since_s = now_s + pause_s
            phase.report(self.on_wait, f"{error}: the service is starting: {starting}; waiting")
            return pause_s
        most_s = self.plan.away_max_s
        if not self._answered:
            most_s = min(most_s, FIRST_CONTACT_S)
        left_s = phase.since_s + most_s - now_s
        if left_s <= 0.0:
            msg = f"{error}; gave up after {most_s:g} s"
            raise PeerError(msg if self._answered else f"{msg}; {NOT_RUNNING}") from error
        phase.report(self.on_wait, f"{error}; retrying for {most_s:g} s")
        return min(pause_s, left_s)

    def _count(self, batch: ReplayBatch, answer: Answer) -> None:
        rows = len(batch.frame)
        counts = self.counts
        counts.read += rows
        counts.batches += 1
        counts.data_time_s = batch.data_time_s
        self.sensor_ids.update(map(str, batch.frame["sensor_id"].unique().to_list()))
        if answer.duplicate:
            counts.duplicate += rows
            return
        if answer.accepted + answer.rejected != rows:
            msg = (
                f"expected a response for {rows} measurements, found {answer.accepted} accepted "
                f"and {answer.rejected} rejected"
            )
            raise PeerError(msg)
        counts.accepted += answer.accepted
        counts.rejected += answer.rejected
        for code, rows_rejected in answer.codes.items():
            known = counts.rejected_by_code.get(code, 0)
            counts.rejected_by_code[code] = known + rows_rejected
        self.reasons = {**answer.reasons, **self.reasons}
        unconfigured = batch.frame["sensor_id"].gather(list(answer.unknown)).to_list()
        for name, rows_rejected in Counter(map(str, unconfigured)).items():
            known = counts.unknown_sensors.get(name, 0)
            counts.unknown_sensors[name] = known + rows_rejected


@dataclass(slots=True)
class _Phase:
    # Attempts for one message: since when they fail while the service is not starting, and the
    # message reported last.
    first_s: float
    since_s: float = field(init=False)
    message: str = ""

    def __post_init__(self) -> None:
        self.since_s = self.first_s

    def report(self, on_wait: Callable[[str], None], sentence: str) -> None:
        if sentence != self.message:
            on_wait(sentence)
            self.message = sentence


def backoff_s(retry: int, retry_after_s: float | None) -> float:
    """Return the pause before a retry: as requested by the service, else exponential back-off.

    Parameters
    ----------
    retry : int
        Number of the retry, from 0.
    retry_after_s : float, optional
        Retry-After of the service, s.

    Returns
    -------
    float
        Pause, s; bounded in both cases.
    """
    if retry_after_s is not None:
        return min(max(retry_after_s, 0.0), RETRY_AFTER_MAX_S)
    return min(BACKOFF_FIRST_S * 2.0 ** min(retry, 30), BACKOFF_MAX_S)


def derived_run_name(recording: Recording, kinds: Collection[str] | None) -> str:
    """Return a name that is a function of the bytes of the recording and the selected kinds."""
    chosen = "all" if kinds is None else ".".join(sorted(kinds))
    return f"{recording.content_sha256()[:_KEY_HASH_CHARACTERS]}-{chosen}"


def replay_batches(
    recording: Recording, kinds: Collection[str] | None, batch_rows: int, span_s: float
) -> Iterator[ReplayBatch]:
    """Split a recording into batches, a function of the arguments alone.

    Parameters
    ----------
    recording : Recording
        The recording.
    kinds : collection of str, optional
        Kinds of measurement to keep; all when absent.
    batch_rows : int
        Maximum rows per batch.
    span_s : float
        Maximum data time that a batch spans, s; may be infinite.

    Yields
    ------
    ReplayBatch
        At least one row each, in the order of the recording.
    """
    latest_s = -np.inf
    for block in recording.blocks(kinds):
        if block.is_empty():
            continue
        rows = block[INDEX_COLUMN].to_numpy()
        frame = block.drop(INDEX_COLUMN)
        time_s = frame["time_s"].cast(pl.Float64).fill_null(np.nan).to_numpy()
        # Rows without a finite time do not advance data time; the service rejects them.
        finite_s = np.where(np.isfinite(time_s), time_s, -np.inf)
        reached_s = np.maximum.accumulate(np.maximum(finite_s, latest_s))
        latest_s = float(reached_s[-1])
        for start, stop in _cuts(_span_numbers(reached_s, span_s), batch_rows):
            yield ReplayBatch(
                frame=frame.slice(start, stop - start),
                data_time_s=_median_or(finite_s[start:stop], 0.0),
                first_row=int(rows[start]),
                last_row=int(rows[stop - 1]),
            )


def _span_numbers(reached_s: NDArray[np.float64], span_s: float) -> NDArray[np.float64]:
    known = np.where(np.isfinite(reached_s), reached_s, 0.0)
    return np.zeros_like(known) if np.isinf(span_s) else np.floor(known / span_s)


def _median_or(time_s: NDArray[np.float64], absent: float) -> float:
    finite = time_s[np.isfinite(time_s)]
    return float(np.median(finite)) if len(finite) else absent


def _cuts(span: NDArray[np.float64], batch_rows: int) -> Iterator[tuple[int, int]]:
    ends = np.append(np.flatnonzero(np.diff(span)) + 1, len(span))
    start = 0
    for end in ends.tolist():
        while start < end:
            stop = min(start + batch_rows, end)
            yield start, stop
            start = stop
