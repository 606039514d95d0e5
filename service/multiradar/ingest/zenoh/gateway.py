"""The Zenoh interface of the service."""

import json
import logging
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Protocol

from multiradar.access.security_log import RepeatedEvents
from multiradar.clock import Clock, SystemClock
from multiradar.ingest.zenoh.bus import BusCounts, Inlet, Outlet
from multiradar.ingest.zenoh.catch_up import CatchUp
from multiradar.ingest.zenoh.counts import ZenohCounts
from multiradar.ingest.zenoh.joining import JoinGate
from multiradar.ingest.zenoh.keys import CLOCK, FLUSH, MEASUREMENTS, STATUS, TRACK_CACHES
from multiradar.ingest.zenoh.measurements import MeasurementInlet
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.payload import PayloadBounds
from multiradar.ingest.zenoh.publisher import Publisher
from multiradar.ingest.zenoh.queries import Answers
from multiradar.ingest.zenoh.session import ZenohBus, all_may_operate
from multiradar.runtime.live.readiness import ZENOH_LOST, Reason
from multiradar.runtime.ports import OperatedSink, View

_log = logging.getLogger(__name__)

#: Threads that send answers; a querier that does not read occupies one for some seconds.
_ANSWER_THREADS = 4
#: Maximum queries queued for those threads. The inlet bounds the answers to measurements.
_QUERIES_MAX = 1024
#: Likewise of expensive ones, which have threads of their own.
_EXPENSIVE_MAX = 64
#: Minimum interval between publications of alarms, s.
_ALARM_PERIOD_S = 0.1


class ZenohView(View, Protocol):
    """The read side as used by the gateway."""

    @property
    def sent_before(self) -> int:
        """Number of the last event that was there before the service accepted measurements."""
        ...


class ZenohService(OperatedSink, Protocol):
    """The service as used by the gateway."""

    @property
    def view(self) -> ZenohView:
        """The read side."""
        ...


class Bus(Inlet, Outlet, Protocol):
    """Both directions of one session."""

    counts: BusCounts
    instance: str
    endpoints: tuple[str, ...]

    @property
    def links(self) -> int:
        """Number of links to other sessions."""
        ...

    @property
    def unreachable(self) -> Sequence[str]:
        """Configured endpoints without a link, each as protocol and address."""
        ...

    def announce(self) -> None:
        """Announce this instance to others."""
        ...

    def close(self) -> None:
        """Close the session."""
        ...


class ZenohGateway:
    """Measurement input, track and bias output.

    Parameters
    ----------
    service : Service
        The running service.
    options : ZenohOptions, optional
        Configuration of the session, and limits.
    open_bus : callable
        Opens the session; replaced in tests.
    clock : Clock
        Monotonic time.
    """

    def __init__(
        self,
        service: ZenohService,
        options: ZenohOptions | None = None,
        *,
        open_bus: Callable[[ZenohOptions], Bus] = ZenohBus,
        clock: Clock | None = None,
    ) -> None:
        self._service = service
        self._options = options or ZenohOptions()
        self._open_bus = open_bus
        self._clock = clock or SystemClock()
        self.counts = ZenohCounts()
        self._gate = JoinGate(self._clock)
        self._bus: Bus | None = None
        self._publisher: Publisher | None = None
        self._answering: ThreadPoolExecutor | None = None
        self._free = threading.Semaphore(_QUERIES_MAX)
        self._asking: ThreadPoolExecutor | None = None
        self._free_expensive = threading.Semaphore(_EXPENSIVE_MAX)
        self._events = RepeatedEvents(self._clock)
        self._stopping = threading.Event()
        self._status_thread: threading.Thread | None = None

    @property
    def endpoints(self) -> tuple[str, ...]:
        """Addresses Zenoh listens on; empty before the start."""
        return () if self._bus is None else self._bus.endpoints

    def start(self) -> None:
        """Open the session, accept measurements, publish.

        Raises
        ------
        ConfigurationError
            If the session cannot be opened as configured.
        """
        options, view = self._options, self._service.view
        bus = self._bus = self._open_bus(options)
        self._answering = ThreadPoolExecutor(_ANSWER_THREADS, thread_name_prefix="zenoh-answer")
        self._asking = ThreadPoolExecutor(options.query_threads, thread_name_prefix="zenoh-query")
        catch_up = CatchUp(options.catch_up_samples_max)
        self._publisher = Publisher(
            outlet=bus,
            source=view.subscribe(0, options.catch_up_samples_max),
            # Not what there is by now: the session may have waited for a port.
            known_until=view.sent_before,
            gate=self._gate,
            catch_up=catch_up,
            counts=self.counts,
            options=options,
            clock=self._clock,
        )
        answers = Answers(
            view, self._status, catch_up, self.counts, self._later_unless_full,
            later_expensive=self._later_expensive, deadline_s=options.query_deadline_s,
        )  # fmt: skip
        for key, handler in answers.handlers().items():
            bus.answer(key, handler)
        bus.answer(TRACK_CACHES, self._gate.on_query)
        bus.watch(self._gate.on_arrival)
        bounds = PayloadBounds(options.message_bytes_max, options.message_rows_max)
        access = options.access
        inlet = MeasurementInlet(
            self._service,
            self.counts,
            bounds,
            self._later,
            named=access.has_credentials,
            ends_streams=all_may_operate(options),
            bound={sensor for client in access.clients for sensor in client.sensors},
            events=self._events,
        )
        bus.answer(FLUSH, inlet.on_flush)
        bus.answer(CLOCK, inlet.on_clock)
        bus.answer(f"{MEASUREMENTS}/*", inlet.on_query)
        bus.subscribe(f"{MEASUREMENTS}/*", inlet.on_sample)
        self._publisher.start()
        self._status_thread = threading.Thread(
            target=self._publish_status, name="zenoh-status", daemon=True
        )
        self._status_thread.start()
        bus.announce()

    def stop(self) -> None:
        """Publish pending events, answer queries, close the session; may be called twice."""
        self._stopping.set()
        if self._status_thread is not None:
            self._status_thread.join()
        if self._publisher is not None:
            self._publisher.stop()
            self._publisher = None
        for pool in (self._asking, self._answering):
            if pool is not None:
                pool.shutdown(wait=True)
        if self._bus is not None:
            self._bus.close()
            self._bus = None

    def document(self) -> dict[str, Any]:
        """Return the counters, the last alarms and the state of the session."""
        bus, publisher = self._bus, self._publisher
        return {
            **self.counts.document(),
            "joins_waited_for": self._gate.waits,
            "instance": None if bus is None else bus.instance,
            "links": 0 if bus is None else bus.links,
            "unreachable": [] if bus is None else list(bus.unreachable),
            "publish_lag_s": 0.0 if publisher is None else round(publisher.lag_s, 2),
            "handler_errors": 0 if bus is None else bus.counts.handler_errors,
            "last_error": "" if bus is None else bus.counts.last_error,
        }

    def lost(self) -> Reason | None:
        """Return why clients behind a router are not reached; None if they are."""
        unreachable = () if self._bus is None else self._bus.unreachable
        if not unreachable:
            return None
        # Without the endpoints: anybody may ask. The log and the status name them.
        return Reason(
            ZENOH_LOST,
            f"no Zenoh link to {len(unreachable)} of the configured endpoints; still retrying",
        )

    # ---------------------------------------------------------------- inside

    def _later_unless_full(self, call: Callable[[], None]) -> bool:
        return self._bounded(call, self._free, self._answering)

    def _later_expensive(self, call: Callable[[], None]) -> bool:
        return self._bounded(call, self._free_expensive, self._asking)

    def _bounded(
        self, call: Callable[[], None], free: threading.Semaphore, pool: ThreadPoolExecutor | None
    ) -> bool:
        if not free.acquire(blocking=False):
            return False

        def release_after() -> None:
            try:
                call()
            finally:
                free.release()

        self._run(release_after, pool)
        return True

    def _later(self, call: Callable[[], None]) -> None:
        self._run(call, self._answering)

    def _run(self, call: Callable[[], None], pool: ThreadPoolExecutor | None) -> None:
        def guarded() -> None:
            try:
                call()
            except Exception as error:  # The querier has gone, or a bug: both are reported.
                self.counts.alarm("ANSWER_FAILED", f"{type(error).__name__}: {error}"[:300], "")

        if pool is None or self._stopping.is_set():
            guarded()
            return
        pool.submit(guarded)

    def _status(self) -> bytes:
        document = self._service.view.status() | {"zenoh": self.document()}
        return json.dumps(document, default=str).encode()

    def _publish_status(self) -> None:
        published_s, alarms = float("-inf"), 0
        links = _Links()
        while not self._stopping.wait(_ALARM_PERIOD_S):
            now_s = self._clock.monotonic_s()
            due = now_s - published_s >= self._options.status_period_s
            if (due or self.counts.alarm_count != alarms) and self._bus is not None:
                alarms, published_s = self.counts.alarm_count, now_s
                links.observe(self._bus.unreachable, due=due)
                self._bus.put(STATUS, self._status(), b"")


# Endpoints without a link, in the log: a link that is missing at two checks in turn is not about to
# be made.
class _Links:
    def __init__(self) -> None:
        self._missing: frozenset[str] = frozenset()
        self._logged: frozenset[str] = frozenset()

    def observe(self, unreachable: Sequence[str], *, due: bool) -> None:
        if not due:
            return
        now = frozenset(unreachable)
        lasting, self._missing = now & self._missing, now
        if lasting - self._logged:
            _log.warning(
                "no Zenoh link to %s; still retrying; check zenoh.connect (--zenoh-connect), and "
                "whether a router or peer listens there",
                ", ".join(sorted(lasting)),
            )
        if self._logged - now:
            _log.info("Zenoh link to %s", ", ".join(sorted(self._logged - now)))
        self._logged = (self._logged & now) | lasting
