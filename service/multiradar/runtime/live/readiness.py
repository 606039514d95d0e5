"""Whether the service does what it is for: the reasons why not, for load balancers and alarms."""

import logging
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import StrEnum
from typing import NamedTuple

from multiradar.clock import Clock
from multiradar.errors import JournalError, MultiradarError, PipelineError
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.entries import RejectedRow
from multiradar.storage.full_disk import size_text
from multiradar.storage.journal import Space

NOT_READY = "NOT_READY"
STANDBY = "STANDBY"
JOURNAL_FAILED = "JOURNAL_FAILED"
JOURNAL_FULL = "JOURNAL_FULL"
LAG = "LAG"
ALL_REJECTED = "ALL_REJECTED"
NO_DATA = "NO_DATA"
ZENOH_LOST = "ZENOH_LOST"
#: Codes of all reasons, the most severe first.
CODES = (
    NOT_READY, STANDBY, JOURNAL_FAILED, JOURNAL_FULL, LAG, ALL_REJECTED, NO_DATA, ZENOH_LOST,
)  # fmt: skip
#: Why a standby accepts no measurements.
IS_STANDBY = (
    "this service is the standby: it follows the journal of the primary and takes over when the "
    "primary stops; send measurements to the primary"
)

#: Rows and failed writes count for so long, s.
RECENT_S = 60.0
#: Fewer rejected rows are no reason.
REJECTED_ROWS_MIN = 10

#: Alarms of the disk of the journal, before it is full.
DISK_FILLING, DISK_NEARLY_FULL = "disk_filling", "disk_nearly_full"

_log = logging.getLogger(__name__)
_MIB = 1024 * 1024
# Rows are summed over such intervals, s.
_INTERVAL_S = 5.0

#: Role of a service that is no standby, and how far it is behind another.
PRIMARY = {"role": "primary", "lag_entries": 0, "lag_s": 0.0}


class ServiceState(StrEnum):
    """State of the service."""

    STOPPED = "stopped"
    RECOVERING = "recovering"
    #: Another service writes the journal; this one follows it.
    STANDBY = "standby"
    RUNNING = "running"
    #: It accepts no more measurements, and ends when those so far are processed and published.
    DRAINING = "draining"
    #: No more measurements are accepted; tracks can still be read.
    FAILED = "failed"


class Reason(NamedTuple):
    """Why the service is not ready: a stable code, and the case in words."""

    code: str
    text: str


Check = Callable[[], Reason | None]


class Disk:
    """Space for the journal, or for the history.

    Parameters
    ----------
    space : callable
        Returns the space on the disk of the journal; None where it has no disk.
    limits : RuntimeLimits
        The free space below which it is a reason, and the used shares that raise alarms.
    clock : Clock
        For the time since a failed write.
    owner : str
        What is on the disk, in words.
    """

    def __init__(
        self, space: Callable[[], Space | None], limits: RuntimeLimits, clock: Clock,
        owner: str = "journal",
    ) -> None:  # fmt: skip
        self._space = space
        self._owner = owner
        self._free_bytes_min = limits.disk_free_bytes_min
        self._shares = {
            DISK_FILLING: limits.disk_filling_share,
            DISK_NEARLY_FULL: limits.disk_nearly_full_share,
        }
        self._clock = clock
        self._full_s: float | None = None
        self._logged: list[str] = []

    def note_full(self) -> None:
        """Note that the disk was full at a write."""
        self._full_s = self._clock.monotonic_s()

    def note_written(self) -> None:
        """Note that a write succeeded."""
        self._full_s = None

    def alarms(self) -> tuple[list[str], list[str]]:
        """Return the alarms of a disk that fills up, and a warning in words if there is one."""
        space = self._space()
        share = 0.0 if space is None else 1.0 - space.free_bytes / max(space.size_bytes, 1)
        raised = [name for name, least in self._shares.items() if share >= least]
        warning = [] if space is None or not raised else [
            f"the {self._owner} disk is {share:.0%} full ({size_text(space.free_bytes)} left): "
            "free some space, or enlarge the disk"
        ]  # fmt: skip
        if len(raised) > len(self._logged):
            _log.warning("%s", *warning)
        self._logged = raised
        return raised, warning

    def reason(self) -> Reason | None:
        """Return why the journal may not be writable; None if it is."""
        full_s, space = self._full_s, self._space()
        # A quota is not seen in the free space. It may be gone without a further write.
        if full_s is not None and self._clock.monotonic_s() - full_s <= RECENT_S:
            return Reason(JOURNAL_FULL, "the journal disk is full; free some space")
        if space is None or space.free_bytes >= self._free_bytes_min:
            return None
        return Reason(
            JOURNAL_FULL,
            f"the journal disk has {space.free_bytes / _MIB:.0f} MiB left (limit "
            f"{self._free_bytes_min / _MIB:.0f} MiB); free some space",
        )


class LastMinute:
    """Rows of the last minute by outcome; one thread notes, any thread reads.

    Parameters
    ----------
    clock : Clock
        Time of the rows.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        # Number of the interval, rows that were not rejected, and rejected ones by code.
        self._intervals: deque[tuple[int, Counter[str]]] = deque()
        self._lock = threading.Lock()

    def note(self, accepted: int, rejects: Sequence[RejectedRow]) -> None:
        """Note the rows of a message."""
        number = int(self._clock.monotonic_s() // _INTERVAL_S)
        with self._lock:
            if not self._intervals or self._intervals[-1][0] != number:
                self._intervals.append((number, Counter()))
                self._discard(number)
            counts = self._intervals[-1][1]
            counts[""] += accepted
            counts.update(row.code for row in rejects)

    def reason(self) -> Reason | None:
        """Return why no row was accepted; None if one was, or hardly any came."""
        with self._lock:
            self._discard(int(self._clock.monotonic_s() // _INTERVAL_S))
            codes = sum((counts for _, counts in self._intervals), Counter[str]())
        if codes[""] or codes.total() < REJECTED_ROWS_MIN:
            return None
        ((code, count),) = codes.most_common(1)
        return Reason(
            ALL_REJECTED,
            f"all {codes.total()} measurements in the last minute were rejected, {count} of them "
            f"as {code}: see /v1/rejects",
        )

    def _discard(self, number: int) -> None:
        while self._intervals and self._intervals[0][0] < number - RECENT_S / _INTERVAL_S:
            self._intervals.popleft()


def lags_s(now_s: float, stages: Mapping[str, Iterable[object]]) -> dict[str, float]:
    """Return the time since reception of the oldest message in each stage, s.

    Parameters
    ----------
    now_s : float
        Present time of reception, UTC, s.
    stages : mapping
        The parts of each stage; `oldest_s` of a part is None where it has no message.
    """
    return {
        name: max(0.0, *(now_s - (getattr(part, "oldest_s", None) or now_s) for part in parts))
        for name, parts in stages.items()
    }


def stall(
    failure: MultiradarError | None, moved_s: float | None, now_s: float, most_s: float
) -> str:
    """Return that the service has failed or its engine stalled, in words; empty if neither.

    Parameters
    ----------
    failure : MultiradarError or None
        Why the service accepts no more measurements.
    moved_s : float or None
        When it last moved, s of the monotonic clock; None while it has no work.
    now_s : float
        The present time, s.
    most_s : float
        A longer time is a stall, s.
    """
    if failure is not None:
        return "the service accepts no more measurements; see the log"
    still_s = 0.0 if moved_s is None else now_s - moved_s
    if still_s <= most_s:
        return ""
    return f"the engine has made no progress for {still_s:.0f} s (limit {most_s:g} s)"


def lag_reason(lags_s: Mapping[str, float], most_s: float) -> Reason | None:
    """Return the stage of the pipeline that is too far behind; None if none is.

    Parameters
    ----------
    lags_s : mapping
        Time since reception of the oldest message in each stage, s.
    most_s : float
        A greater lag is a reason, s.
    """
    stage, lag_s = max(lags_s.items(), key=lambda one: one[1])
    if lag_s <= most_s:
        return None
    return Reason(
        LAG, f"the oldest message in stage {stage} was received {lag_s:.0f} s ago (limit "
        f"{most_s:g} s): data arrive faster than they can be processed, or the stage has stopped",
    )  # fmt: skip


def require_running(
    state: ServiceState, failure: MultiradarError | None, start_step: str = ""
) -> None:
    """Raise an error if the service accepts no measurements: that of its failure, or its state.

    Parameters are those of `state_reason`.
    """
    if state is ServiceState.DRAINING:
        raise PipelineError(
            "the service is draining and accepts no more measurements; send them to its standby"
        )
    if state not in (ServiceState.RUNNING, ServiceState.STANDBY):
        raise not_running(state, start_step)
    if failure is not None:
        raise failure
    if state is ServiceState.STANDBY:
        raise PipelineError(IS_STANDBY)


def not_running(state: ServiceState, start_step: str) -> PipelineError:
    """Return the error of a service that has not started, or has stopped."""
    starting = f"the service is starting: {start_step}; retry later"
    return PipelineError(starting if start_step else f"the service is not running: {state}")


def state_reason(
    failure: MultiradarError | None, state: ServiceState, start_step: str
) -> Reason | None:
    """Return why the service does not accept measurements; None if it does.

    Parameters
    ----------
    failure : MultiradarError or None
        Why it accepts no more.
    state : ServiceState
        Its state.
    start_step : str
        The present step of its start, for the reason.
    """
    if failure is not None:
        # Without the message, which names files: anybody may ask.
        if isinstance(failure, JournalError):
            return Reason(JOURNAL_FAILED, "the journal cannot be read or written; see the log")
        return Reason(NOT_READY, "the engine has stopped; see the log")
    if state is ServiceState.RUNNING:
        return None
    if state is ServiceState.STANDBY:
        return Reason(STANDBY, IS_STANDBY)
    text = f"the service is starting: {start_step}" if start_step else f"the service is {state}"
    return Reason(NOT_READY, text)
