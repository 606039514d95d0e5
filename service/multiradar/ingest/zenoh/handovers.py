"""The exchange with neighbouring regions, in a Zenoh session of its own.

The session is not that of the clients: in one network, a query for tracks would be answered by the
services of all regions, and measurements for one would reach all.
"""

import logging
import math
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from multiradar.clock import Clock, SystemClock
from multiradar.errors import InputError, MultiradarError
from multiradar.ingest.zenoh.bus import Message
from multiradar.ingest.zenoh.gateway import Bus
from multiradar.ingest.zenoh.keys import HANDOVERS, last_part
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import ZenohBus, require_guarded
from multiradar.runtime.live.receipt import Receipt
from multiradar.runtime.live.service import Service
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.memory.regions.areas import Areas, Centre
from multiradar.runtime.memory.regions.board import RegionBoard, RegionRules
from multiradar.runtime.memory.regions.messages import TIME_APART_MAX_S, packed, read_handover
from multiradar.runtime.memory.regions.outgoing import handover_message
from multiradar.runtime.ports import HandoverSink
from multiradar.settings.access import AccessSettings
from multiradar.settings.service import Settings
from multiradar_schemas.products.handover import OCTETS_MAX

_log = logging.getLogger(__name__)

#: Messages that come faster than this fraction of the period are not used.
_EARLY = 0.2
#: An endpoint that the service before still closes is waited for, s.
_LISTEN_WAIT_S = 30.0
#: Alarms in the status.
_ALARMS_SHOWN = 8
_COUNTS = (
    "published", "tracks_left_out", "received", "malformed", "too_frequent", "lost", "failed",
)  # fmt: skip


class RegionExchange:
    """Publishes what this region hands over, and submits what its neighbours do.

    Parameters
    ----------
    sink : HandoverSink
        The service.
    known : Knowledge
        Its tracks and biases.
    board : RegionBoard
        The regions.
    options : ZenohOptions
        Of the session.
    period_s : float
        Time between two messages, s.
    open_bus : callable, optional
        Opens the session.
    clock : Clock, optional
        Times the messages.
    """

    def __init__(
        self, sink: HandoverSink, known: Knowledge, board: RegionBoard, options: ZenohOptions, *,
        period_s: float, open_bus: Callable[[ZenohOptions], Bus] = ZenohBus,
        clock: Clock | None = None,
    ) -> None:  # fmt: skip
        self._sink, self._known, self._board = sink, known, board
        self._options = options
        self._period_s = period_s
        self._open_bus = open_bus
        self._clock = clock or SystemClock()
        self._bus: Bus | None = None
        self._lock = threading.Lock()
        self._counts = {
            name: dict.fromkeys(_COUNTS, 0) for name in (board.name, *board.areas.neighbours)
        }
        self._alarms: deque[dict[str, str]] = deque(maxlen=_ALARMS_SHOWN)
        self._received_s: dict[str, float] = {}
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def endpoints(self) -> tuple[str, ...]:
        """Addresses it listens on; empty before the start."""
        return () if self._bus is None else self._bus.endpoints

    def start(self) -> None:
        """Open the session, and publish in a thread.

        Raises
        ------
        ConfigurationError
            If the session cannot be opened as configured.
        """
        self.open()
        self._thread = threading.Thread(target=self._run, name="regions", daemon=True)
        self._thread.start()

    def open(self) -> None:
        """Open the session, and accept messages; `step` publishes."""
        self._bus = self._open_bus(self._options)
        for name in self._board.areas.neighbours:
            self._bus.subscribe(f"{HANDOVERS}/{name}", self.on_message)

    def step(self) -> None:
        """Publish once what this region hands over."""
        message = handover_message(self._board, self._known)
        if message is not None and self._bus is not None:
            self._bus.put(f"{HANDOVERS}/{self._board.name}", message.payload, b"")
            self._count(self._board.name, "published")
            self._count(self._board.name, "tracks_left_out", number=message.left_out)

    def on_message(self, message: Message) -> None:
        """Validate a message of a neighbour, and submit it to the journal."""
        region = last_part(message.key)
        if region not in self._board.areas.neighbours:
            return
        self._count(region, "received")
        now_s, before_s = self._clock.monotonic_s(), self._received_s.get(region, -math.inf)
        if now_s - before_s < _EARLY * self._period_s:
            self._count(region, "too_frequent")
            return
        self._received_s[region] = now_s
        try:
            self._require(region, message.payload)
        except InputError as error:
            self._count(region, "malformed", "HANDOVER_MALFORMED", str(error))
            return
        try:
            future = self._sink.hand_over(packed(message.payload), source=f"region {region}")
        except MultiradarError as error:
            # The next message has all that this one had.
            self._count(region, "lost", "HANDOVER_LOST", str(error))
        else:
            future.add_done_callback(lambda done: self._settled(region, done))

    def stop(self) -> None:
        """Close the session; may be called twice."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()
        bus, self._bus = self._bus, None
        if bus is not None:
            bus.close()

    def document(self) -> dict[str, Any]:
        """Return counts by region, the last alarms, and the state of the neighbours."""
        bus = self._bus
        with self._lock:
            counts = {name: dict(numbers) for name, numbers in self._counts.items()}
            alarms = list(self._alarms)
        return {
            "name": self._board.name,
            **self._board.figures(),
            "messages": counts,
            "alarms": alarms,
            "links": 0 if bus is None else bus.links,
            "unreachable": [] if bus is None else list(bus.unreachable),
        }

    # ---------------------------------------------------------------- inside

    def _settled(self, region: str, done: Future[Receipt]) -> None:
        error = done.exception()
        if isinstance(error, MultiradarError):
            self._count(region, "lost", "HANDOVER_LOST", error.for_clients)
        elif error is not None:
            self._count(region, "lost", "HANDOVER_LOST", type(error).__name__)

    def _run(self) -> None:
        while not self._stopping.wait(self._period_s):
            try:
                self.step()
            except Exception as error:  # The service goes on; the neighbours find it silent.
                _log.exception("the handover message to the neighbouring regions failed")
                self._count(self._board.name, "failed", "HANDOVER_FAILED", type(error).__name__)

    def _require(self, region: str, payload: bytes) -> None:
        found = read_handover(payload, self._board.areas)
        if found.region != region:
            raise InputError(f"expected a message from region {region}, was from {found.region}")
        data_time_s = self._known.data_time_s
        if data_time_s is None:
            return
        ahead_s = found.time_s - data_time_s
        # Without data, the data time here stands still.
        _, has_ceased = self._known.silence()
        if ahead_s < -TIME_APART_MAX_S or (ahead_s > TIME_APART_MAX_S and not has_ceased):
            raise InputError(
                f"expected a time within {TIME_APART_MAX_S:g} s of the data time of this service "
                f"({data_time_s:.0f} s), was {found.time_s:.0f} s"
            )

    def _count(
        self, region: str, name: str, code: str = "", reason: str = "", number: int = 1
    ) -> None:
        with self._lock:
            self._counts[region][name] += number
            if code:
                self._alarms.append({"region": region, "code": code, "reason": reason[:300]})


def region_exchange(
    service: Service, settings: Settings, access: AccessSettings
) -> RegionExchange | None:
    """Return the exchange of a service, not started; None without neighbours.

    Raises
    ------
    ConfigurationError
        If it would listen beyond loopback without certificates.
    """
    wanted = settings.region
    if wanted.name is None or wanted.latitude_deg is None or wanted.longitude_deg is None:
        return None
    neighbours = [Centre(n.name, n.latitude_deg, n.longitude_deg) for n in wanted.neighbours]
    areas = Areas(Centre(wanted.name, wanted.latitude_deg, wanted.longitude_deg), neighbours)
    board = RegionBoard(
        areas,
        RegionRules(
            wanted.margin_m, wanted.hysteresis_m, wanted.silence_s, wanted.discard_after_s,
            settings.tracking_settings().coast_after_s,
        ),
    )  # fmt: skip
    options = ZenohOptions(
        listen=wanted.listen,
        connect=tuple(one.endpoint for one in wanted.neighbours if one.endpoint is not None),
        region=wanted.name,
        neighbours=tuple(areas.neighbours),
        access=access,
        message_bytes_max=OCTETS_MAX,
        listen_wait_s=_LISTEN_WAIT_S if settings.journal.standby else 0.0,
    )
    require_guarded(options, "region.listen")
    service.publication.divide(board)
    exchange = RegionExchange(
        service, service.publication.known, board, options, period_s=wanted.period_s
    )
    service.publication.count_edge("regions", exchange.document)
    return exchange
