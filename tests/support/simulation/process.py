"""One process of the service, from its start to its death, on a virtual disk."""

import asyncio
import contextlib
import functools
import random
import sqlite3
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from multiradar import wire
from multiradar.errors import MultiradarError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.ingest.asterix_gateway import AsterixGateway
from multiradar.ingest.asterix_inlet import InletBounds
from multiradar.ingest.asterix_queue import DatagramQueue
from multiradar.ingest.asterix_sensors import names_by_source, scan_periods_by_source
from multiradar.ingest.asterix_source import MemorySource
from multiradar.runtime.engine.tracking_engine import TrackingEngine
from multiradar.runtime.live.receipt import Receipt
from multiradar.runtime.live.service import Service
from multiradar.runtime.live.snapshots import SnapshotRules
from multiradar.runtime.standby.following import Standby
from multiradar.runtime.stream.events import Event, Subscription
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.snapshots import SnapshotFolder
from multiradar.storage.sqlite import tip
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.tracking.settings import TrackingSettings
from multiradar_converters.asterix.decoding.editions import DECIDED_MIN
from multiradar_converters.asterix.live.reception import LiveDecoder, LiveOptions
from multiradar_schemas.sensors.sensor import SensorsFile
from support.simulation.disk import VirtualDisk
from support.simulation.front import Exchange, Front, VirtualLoop
from support.simulation.scheduler import Scheduler, VirtualClock
from support.simulation.traffic import RECORDER, Occurred

JOURNAL = "journal"
TRACKING = TrackingSettings()
#: Small bounds, so that a run reaches them.
LIMITS = RuntimeLimits(
    intake_batches_max=12,
    intake_rows_max=400,
    commit_batches_max=8,
    backlog_rows_max=300,
    push_rows_max=256,
    events_max=400,
    history_rows_max=2000,
    bias_history_rows_max=500,
    transition_rows_max=500,
    plot_rows_max=500,
    rejects_kept_max=100,
    # The disk of the machine that simulates is none of the run's.
    disk_free_bytes_min=1,
    disk_filling_share=2.0,
    disk_nearly_full_share=2.0,
)
#: Name of the port of datagrams.
PORT = "simulated"
QUEUE_DATAGRAMS_MAX, QUEUE_OCTETS_MAX = 64, 100_000
RETAINED_RECORDS = 1 << 12
#: Fraction of the processes whose sensors are diagnosed.
DIAGNOSED = 0.2
#: Datagrams are decoded so often, s.
INLET_INTERVAL_S = 0.5
#: Time from one snapshot to the next, s.
SNAPSHOT_S = 4.0

# The tables of the sensors of a run, the same in each.
_TABLES: dict[int, tuple[SensorsFile, SensorTable]] = {}


def sensor_table(sensors: SensorsFile) -> SensorTable:
    """Return the table of sensors."""
    if id(sensors) not in _TABLES:
        _TABLES[id(sensors)] = sensors, wire.sensor_table(sensors)
    return _TABLES[id(sensors)][1]


@dataclass(slots=True)
class Delivered:
    """Datagrams that the network delivered to a process.

    Attributes
    ----------
    datagrams, octets : int
        All of them.
    plots : int
        Plots in those that were sent as they arrived, and had room in the queue.
    intact : bool
        Whether all that had room are such.
    own, damaged : int
        Those of the sensor, and how many of these did not arrive as they were sent.
    unlike : bool
        Whether most of these were damaged at some time, and enough for the decoder to decide that
        the sensor matches no known edition: it then rejects intact ones as well.
    """

    datagrams: int = 0
    octets: int = 0
    plots: int = 0
    intact: bool = True
    own: int = 0
    damaged: int = 0
    unlike: bool = False

    def add(self, octets: int, plots: int | None, *, own: bool = True) -> None:
        """Add one, with its number of plots; None if it did not arrive as it was sent."""
        self.datagrams += 1
        self.octets += octets
        self.plots += plots or 0
        self.intact &= plots is not None
        self.own += own
        self.damaged += own and plots is None
        self.unlike |= self.damaged >= DECIDED_MIN and 2 * self.damaged > self.own


class Process:
    """A process of the service.

    Parameters
    ----------
    folder : Path
        Empty folder of its disk.
    image : mapping of str to bytes
        What is on the disk.
    seed : random.Random
        Draws the order of threads, and what the disk loses.
    clock : VirtualClock
        Time.
    front : Front
        The HTTP application.
    sensors : SensorsFile
        The sensors.
    fingerprint : str
        Fingerprint of the configuration.
    open_engine : callable
        Builds an engine.
    snapshot_rows : int
        Measurements from one snapshot to the next; 0 for none.
    beside : Process, optional
        Another process, on whose disk it is; this one then is its standby.

    Attributes
    ----------
    failed : bool
        It has stopped for good and ends.
    leads : bool
        It accepts measurements.
    drained : bool
        It has ended in order.
    killed_by : callable
        Called when its disk kills it.
    lost_writes : bool
        Its power failure has lost writes.
    delivered : Delivered
        Datagrams that it was sent.
    left : mapping of str to bytes or None
        The disk as its kill left it.
    acknowledged : list of (str, Receipt)
        What it had acknowledged when it was killed, whether or not the client heard of it.
    """

    def __init__(
        self, *, folder: Path, image: Mapping[str, bytes], seed: random.Random, clock: VirtualClock,
        front: Front, sensors: SensorsFile, fingerprint: str,
        open_engine: Callable[[], TrackingEngine], snapshot_rows: int,
        beside: "Process | None" = None,
    ) -> None:  # fmt: skip
        self.folder: Path = folder if beside is None else beside.folder
        self._front = front
        self._clock = clock
        self._is_standby = beside is not None
        # Whether it dies when its disk does.
        self._has_disk = beside is None
        self.disk: VirtualDisk
        if beside is None:
            self.disk = VirtualDisk(folder, seed, dict(image))
            self.disk.on_kill = self._struck
        else:
            self.disk = beside.disk
        self.scheduler = Scheduler(seed, clock)
        self.loop = VirtualLoop(clock)
        self.failed = self.leads = self.drained = False
        self.power_lost = self.lost_writes = False
        self.killed_by: Occurred = lambda: None
        self.delivered = Delivered()
        self.left: dict[str, bytes] | None = None
        self.acknowledged: list[tuple[str | None, Receipt]] = []
        self._journal: SqliteJournal | None = None
        self._standby: Standby | None = None
        #: Messages on their way to the journal: key and future.
        self._submitted: list[tuple[str | None, Future[Receipt]]] = []
        self._open: list[tuple[Exchange, asyncio.Task[None], Callable[[Exchange], None]]] = []
        self._fingerprint = fingerprint
        table = sensor_table(sensors)
        self.service = Service(
            open_journal=self._open_journal,
            open_engine=open_engine,
            sensors=table,
            tracking=TRACKING,
            limits=LIMITS,
            clock=clock,
            threads=self.scheduler,
            on_failure=self._fail,
            snapshots=SnapshotRules(
                SnapshotFolder(self.folder / JOURNAL), SNAPSHOT_S, snapshot_rows, fingerprint
            )
            if snapshot_rows
            else None,
            described=sensors,
        )
        # No output depends on the diagnosis, which takes a fifth of a run; recording is cheap.
        if seed.random() >= DIAGNOSED:
            self.service.publication.diagnosis.check = lambda: False  # type: ignore[method-assign]
        self._port = MemorySource(PORT)
        self.gateway = AsterixGateway(
            labels=(PORT,),
            sources=(lambda: self._port,),
            sink=self.service,
            decoder=LiveDecoder(
                LiveOptions(
                    names=names_by_source(table),
                    scan_periods=scan_periods_by_source(table),
                    retained_records=RETAINED_RECORDS,
                )
            ),
            queue=DatagramQueue(QUEUE_DATAGRAMS_MAX, QUEUE_OCTETS_MAX),
            bounds=InletBounds(INLET_INTERVAL_S, 100),
            clock=self.service.reception,
            threads=self.scheduler,
        )
        self.service.publication.count_edge("asterix", self.gateway.counts.document)
        #: Events by number without what depends on the time of the machine, and readers.
        self.readers: list[Subscription] = []

    @property
    def down(self) -> bool:
        """Whether it was killed, or must end."""
        return self.failed or (self.disk.dead and self._has_disk)

    def start(self) -> None:
        """Start it; raises what the service raises."""
        self.service.open()
        assert self._journal is not None, "it is open"
        if self._journal.following:
            self._standby = Standby(
                self.service, self._journal, self._clock, self._begin, self.scheduler
            )
            self._standby.start()
        else:
            self.service.start()
            self._begin()

    def survive(self) -> None:
        """Go on with the disk after the other process has ended, however it did."""
        self._has_disk = True
        self.disk.dead, self.disk.kill_at, self.disk.on_kill = False, None, self._struck

    def request(self, exchange: Exchange, answered: Callable[[Exchange], None]) -> None:
        """Serve a request; `answered` is called with the complete answer, or never."""
        task = self.loop.create_task(exchange.run(self._front.application))
        self._open.append((exchange, task, answered))

    def receive(self, octets: bytes, sender: str, plots: int | None) -> bool:
        """Receive a datagram; return whether it fits into the queue.

        `plots` is the number of its plots, None if it does not arrive as it was sent.
        """
        counts = self.gateway.counts
        dropped = counts.number(0, "datagrams_dropped")
        self._port.sender = sender
        self._port.send(octets)
        self.gateway.receive(0)
        fits = counts.number(0, "datagrams_dropped") == dropped
        self.delivered.add(len(octets), plots if fits else 0, own=sender == RECORDER)
        return fits

    def subscribe(self, after: int | None, depth: int) -> Subscription:
        """Open a stream of events."""
        reader = self.service.view.subscribe(after, depth)
        reader.set_wakeup(lambda: None)
        self.readers.append(reader)
        return reader

    def events(self, reader: Subscription, most: int) -> list[Event]:
        """Return what a reader gets next."""
        return reader.poll(most)

    def pump(self) -> None:
        """Run the event loop, and answer requests that are done."""
        self._front.current.use(self.service, self._submitted)
        self.loop.pump()
        if self.down:
            return
        still = []
        for exchange, task, answered in self._open:
            if exchange.complete:
                answered(exchange)
            elif not task.done():
                still.append((exchange, task, answered))
        self._open = still
        if len(self._submitted) > 64:
            self._submitted[:] = [one for one in self._submitted if not one[1].done()]

    def drain(self) -> None:
        """Accept no more, process and answer what it has acknowledged, and end."""
        self.gateway.stop()
        with contextlib.suppress(MultiradarError):
            self.service.drain()
        self.pump()
        self.failed = self.drained = True

    def lose_lock(self) -> None:
        """Lose the lock of the journal without noticing."""
        assert self._journal is not None, "it is open"
        self._journal._lock.release()

    def write_on(self) -> MultiradarError | None:
        """Write what comes until it fails; return why it has."""
        self._run_on()
        if self.service.failure is None:
            self.service.flush(source="operator", force=True)
            self._run_on()
        return self.service.failure

    def stop(self) -> None:
        """End it in order."""
        self.gateway.stop()
        self.service.stop()
        self._cleanup()

    def bury(self) -> dict[str, bytes]:
        """End it where it is; return the files on its disk."""
        if self.left is None:
            self._killed()
        dead, self.disk.dead = self.disk.dead, True
        self.scheduler.kill()
        with contextlib.suppress(Exception):
            self.service.stop()
        if self._journal is not None:
            with contextlib.suppress(Exception):
                self._journal.close()
        self._cleanup()
        self.disk.dead = dead
        assert self.left is not None, "it was killed"
        return self.left

    def kill(self) -> None:
        """Kill it now."""
        if not self.disk.dead:
            self._killed()
            self.disk.dead = True

    # ---------------------------------------------------------------- inside

    def _open_journal(self) -> SqliteJournal:
        threads: Any = _Threading(self.scheduler)
        tip.threading = threads  # type: ignore[attr-defined]
        self._journal = SqliteJournal(
            self.folder / JOURNAL, self._fingerprint, standby=self._is_standby
        )
        return self._journal

    def _begin(self) -> None:
        self.gateway.open()
        self.gateway.begin()
        self.leads = True

    def _run_on(self) -> None:
        while self.scheduler.step(stalled=True):
            pass

    def _fail(self) -> None:
        self.failed = True

    def _struck(self) -> None:
        self._killed()
        self.killed_by()

    def _killed(self) -> None:
        self.left = self.disk.image(power_lost=self.power_lost)
        self.lost_writes = self.power_lost and self.left != self.disk.image(power_lost=False)
        # An answer may have left at the very instant.
        self.acknowledged = [
            (key, future.result()) for key, future in self._submitted if _is_answered(future)
        ]

    def _cleanup(self) -> None:
        for _, task, _ in self._open:
            task.cancel()
        with contextlib.suppress(Exception):
            self.loop.pump()
        self.loop.close()


class _Threading:
    # The module `threading` for the thread that syncs the tip.

    def __init__(self, scheduler: Scheduler) -> None:
        self.Event = scheduler.event
        self._scheduler = scheduler

    def Thread(  # noqa: N802  # as in `threading`
        self, target: Callable[[], None], name: str, daemon: bool
    ) -> "_Thread":
        return _Thread(self._scheduler, target, name)


class _Thread:
    def __init__(self, scheduler: Scheduler, target: Callable[[], None], name: str) -> None:
        self._begin = functools.partial(scheduler.start, target, name)

    def start(self) -> None:
        self._started = self._begin()

    def join(self) -> None:
        self._started.join()


def _is_answered(future: Future[Receipt]) -> bool:
    return future.done() and not future.cancelled() and future.exception() is None


def read_raw(path: Path) -> list[tuple[Any, ...]]:
    """Return the entries of a closed journal, read without the code under test."""
    with contextlib.closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as connection:
        return connection.execute(
            "SELECT sequence, kind, source, idempotency_key, payload, accepted, rejects, admission "
            "FROM entry ORDER BY sequence"
        ).fetchall()


def read_marks(path: Path) -> list[int]:
    """Return the entries of a closed journal that are marked as unprocessable."""
    with contextlib.closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as connection:
        return [row[0] for row in connection.execute("SELECT sequence FROM skipped")]
