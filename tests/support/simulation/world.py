"""A run: traffic, network, clock, disk and processes of the service, all from one seed."""

import heapq
import itertools
import random
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

from multiradar import wire
from multiradar.errors import ConfigurationError, JournalError, MultiradarError
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.engine.fingerprint import configuration_fingerprint
from multiradar.runtime.stream.events import Subscription
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar_schemas.sensors.sensor import SensorsFile
from support.simulation import traffic
from support.simulation.disk import draw_from
from support.simulation.engines import Tampered, Tampering
from support.simulation.front import KEYS, Exchange, Front
from support.simulation.process import TRACKING, Process
from support.simulation.record import Detected, Record, Violation, require
from support.simulation.scheduler import VirtualClock
from support.simulation.traffic import Message, Row

#: Duration of the traffic, and the time after which all must be acknowledged, s.
DURATION_S = 16.0
PATIENCE_S = 300.0
TICK_S = 0.5
#: A client waits so long for an answer, and pauses before it repeats, s.
ANSWER_S = 4.0
PAUSE_S = 0.5
#: The supervisor starts a process that ended after so long, s.
RESTART_S = 0.5
STARTS_MAX = 60
#: Events that a reader gets at once; one farther behind gets a notice of a gap.
READER_EVENTS_MAX = 120
#: Measurements from one snapshot to the next, and what their files have in their names.
SNAPSHOT_ROWS = 60
SNAPSHOTS = "-snapshots/"

Change = Callable[[Row], list[Row]]


class Sender:
    """A client that sends messages in order, each until it is acknowledged.

    Attributes
    ----------
    outstanding_max : int
        Messages on their way at once; more than one arrive in any order.
    loss, answer_loss, copies : float
        Probability that a request is lost, its answer is, and that it arrives twice.
    delay_s : float
        Greatest further delay, s.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.waiting: list[Message] = []
        self.outstanding: list[Message] = []
        self.outstanding_max = 1
        self.loss = self.answer_loss = self.copies = self.delay_s = 0.0
        self.cut = False


class World:
    """A run of the service under faults.

    Parameters
    ----------
    seed : int
        Seed of everything.
    front : Front
        The HTTP application.
    clock : VirtualClock
        The time of the front.
    """

    def __init__(self, seed: int, front: Front, clock: VirtualClock) -> None:
        self.seed = seed
        self.random = random.Random(seed)
        self.clock = clock
        clock.elapsed_s = clock.offset_s = 0.0
        self.front = front
        self.record = Record()
        self.tampering = Tampering()
        self.sensors: SensorsFile = SENSORS["plain"]
        self.senders = {name: Sender(name) for name in KEYS}
        #: Changes of the rows of a sensor: from, until, and what becomes of each.
        self.changes: dict[str, list[tuple[float, float, Change]]] = {}
        #: Sensors that a fault concerns: their rows may be rejected.
        self.suspects: set[str] = set()
        #: Whether a fault concerns the whole service: any row may be late.
        self.all_suspect = False
        self.datagram_faults: list[tuple[float, float, Callable[[bytes], list[bytes]]]] = []
        self.process: Process | None = None
        #: Done to the files on the disk before the next start; named when it is damage.
        self.damage: Callable[[dict[str, bytes]], str] | None = None
        self.start_faults: list[Callable[[Process], None]] = []
        #: Applied to the disk of each process that starts.
        self.disk_state: Callable[[Process], None] | None = None
        #: Half of the runs have snapshots.
        self._snapshot_rows = SNAPSHOT_ROWS if seed % 2 else 0
        self._otherwise = False
        #: Whether the tip may be older than the journal, so that not all damage is found.
        self._tip_is_old = False
        #: Damage that no start has reported so far.
        self.damaged = ""
        self._image: dict[str, bytes] = {}
        self._agenda: list[tuple[float, int, Callable[[], None]]] = []
        self._count = itertools.count()
        self._starts = 0
        self._folder = Path(tempfile.mkdtemp(dir=_memory_folder()))
        draw_from(seed)

    # ---------------------------------------------------------------- for faults

    def at(self, time_s: float, action: Callable[[], None]) -> None:
        """Do something at a time, s after the start."""
        heapq.heappush(self._agenda, (time_s, next(self._count), action))

    def during(
        self, begin_s: float, end_s: float, on: Callable[[], None], off: Callable[[], None]
    ) -> None:
        """Do something at a time, and undo it at another."""
        self.at(begin_s, on)
        self.at(end_s, off)

    def change(self, sensor: str, begin_s: float, end_s: float, change: Change) -> None:
        """Change the rows of a sensor in an interval of true time."""
        self.changes.setdefault(sensor, []).append((begin_s, end_s, change))
        self.suspects.add(sensor)

    def send(self, message: Message) -> None:
        """Have a message sent at its time, until it is answered."""
        self.record.messages.append(message)
        sender = self.senders[message.sender]

        def due() -> None:
            sender.waiting.append(message)
            self._next(sender)

        self.at(message.due_s, due)

    def repeat(self, message: Message) -> None:
        """Send an acknowledged message again, with its key."""
        if self.process is not None and not self.process.down:
            self._arrive(self.senders[message.sender], message)

    def use_table(self, name: str) -> None:
        """Run the service with other sensors than those that send; one of `SENSORS`."""
        self.sensors = SENSORS[name]
        self.suspects.add("41-20")

    def start_otherwise(self) -> None:
        """Kill the service, and start it with another configuration."""
        self._otherwise = True
        if self.process is not None:
            self.process.kill()

    def headers(self, client: str, media: str) -> dict[str, str]:
        """Return the headers of a request of a client."""
        return {
            "host": "simulated",
            "authorization": f"Bearer {KEYS[client]}",
            "content-type": media,
        }

    def checked(self, exchange: Exchange, status: int | None = None) -> None:
        """Check the answer to a request; None for any status."""
        self.record.receive(exchange, status)

    def read_slowly(self, period_s: float) -> None:
        """Read the stream of events so often, and resume it after each restart."""
        after = 0
        reader: Subscription | None = None

        def read() -> None:
            nonlocal after, reader
            process = self.process
            if process is not None and not process.down:
                if reader is None or reader not in process.readers:
                    reader = process.subscribe(after, READER_EVENTS_MAX)
                events = process.events(reader, READER_EVENTS_MAX)
                self.record.read(events, after)
                after = reader.after
            self.at(self.clock.elapsed_s + period_s, read)

        self.at(period_s, read)

    def read_once(self, after: int) -> None:
        """Read the events after a number, which may be of another journal, and leave."""
        if self.process is not None and not self.process.down:
            reader = self.process.subscribe(after, READER_EVENTS_MAX)
            head = self.process.service.view.status()["event_sequence"]
            events = self.process.events(reader, READER_EVENTS_MAX)
            self.record.read(events, after if after <= head else 0)
            reader.close()

    def ask(self, exchange: Exchange, answered: Callable[[Exchange], None]) -> None:
        """Ask once, without a repetition."""
        if self.process is not None and not self.process.down:
            self.process.request(exchange, answered)

    # ---------------------------------------------------------------- the run

    def run(self) -> None:
        """Run to the end and check; raises `Violation`, and `Detected` if damage ended it."""
        try:
            self._plan()
            self._start()
            while self._agenda and not self._is_over():
                time_s, _, action = heapq.heappop(self._agenda)
                self.clock.elapsed_s = max(self.clock.elapsed_s, time_s)
                action()
                self._churn()
            self._finish()
        finally:
            if self.process is not None:
                self.process.bury()
            shutil.rmtree(self._folder, ignore_errors=True)

    def _plan(self) -> None:
        seen = traffic.plots(self.seed, DURATION_S)
        names = {"41-10": "alpha", "41-20": "bravo", traffic.ADSB: "charlie"}
        for sensor, rows in seen.items():
            for place in range(int(DURATION_S / traffic.SECTOR_S)):
                begin_s = place * traffic.SECTOR_S
                end_s = begin_s + traffic.SECTOR_S
                due_s = end_s + self.random.uniform(0.0, 0.2)
                sector = [
                    changed
                    for row in rows
                    if begin_s <= row["time_s"] - traffic.START_S < end_s
                    for changed in self._changed(sensor, row)
                ]
                if not sector:
                    continue
                if sensor == traffic.DATAGRAMS:
                    self.at(due_s, lambda rows=sector: self._emit(rows))  # type: ignore[misc]
                    continue
                media = traffic.MEDIA[sensor]
                body = traffic.body(media, sector)
                key = f"{sensor}/{place}"
                self.send(Message(names[sensor], key, media, body, sector, due_s))
        for number in range(int(PATIENCE_S / TICK_S)):
            self.at(number * TICK_S, lambda: None)

    def _changed(self, sensor: str, row: Row) -> list[Row]:
        since_s = row["time_s"] - traffic.START_S
        rows = [row]
        for begin_s, end_s, change in self.changes.get(sensor, []):
            if begin_s <= since_s < end_s:
                rows = [new for one in rows for new in change(one)]
        return rows

    def _is_over(self) -> bool:
        done = self.clock.elapsed_s > DURATION_S + 12.0 and all(
            not (sender.waiting or sender.outstanding) for sender in self.senders.values()
        )
        return done and self.process is not None and not self.process.down

    def _churn(self) -> None:
        process = self.process
        if process is None:
            return
        if self.random.random() < 0.6:
            process.pump()
            process.scheduler.settle()
        else:
            for _ in range(self.random.randrange(6)):
                process.scheduler.step()
                if self.random.random() < 0.5 and not process.down:
                    process.pump()
        if not process.down:
            process.pump()
            self.record.sample(process)
        if process.down:
            self._bury()

    # ---------------------------------------------------------------- processes

    def _start(self) -> None:
        self._starts += 1
        if self._starts > STARTS_MAX:
            raise Violation("I8", "the service never starts again")
        if self._otherwise and self._image:
            self._start_otherwise()
        intact = dict(self._image)
        if self.damage is not None and self._image and not self._tip_is_old:
            # What a start from a snapshot does not read of the journal, it finds later.
            self._image = {name: one for name, one in intact.items() if SNAPSHOTS not in name}
            self.damaged, self.damage = self.damage(self._image), None
        process = self._process(str(self._starts), _fingerprint(self.sensors))
        if self.disk_state is not None:
            self.disk_state(process)
        for fault in self.start_faults:
            fault(process)
        self.start_faults.clear()
        self.tampering.raised = False
        try:
            process.start()
        except MultiradarError as error:
            dead = process.disk.dead
            faulty = dead or process.disk.faulted or self.tampering.raised
            self.record.start_failed(error, damaged=self.damaged, faulty=faulty)
            left = process.bury()
            self._note_tip(process)
            if self.damaged and not dead:
                self._repair(intact)
            else:
                self._image = left if dead else intact
            self.at(self.clock.elapsed_s + RESTART_S, self._restart)
            return
        self.process = process
        self.record.started(process)

    def _repair(self, intact: dict[str, bytes]) -> None:
        if self.record.wrote_since_damage:
            raise Detected
        self._image, self.damaged = intact, ""

    def _process(self, name: str, fingerprint: str) -> Process:
        folder = self._folder / name
        folder.mkdir()
        return Process(
            folder=folder,
            image=self._image,
            seed=self.random,
            clock=self.clock,
            front=self.front,
            sensors=self.sensors,
            fingerprint=fingerprint,
            open_engine=self._open_engine,
            snapshot_rows=self._snapshot_rows,
        )

    def _start_otherwise(self) -> None:
        self._otherwise = False
        process = self._process("other", "another fingerprint")
        rejected = False
        try:
            process.start()
        except ConfigurationError:
            rejected = True
        except JournalError:
            # The journal itself may be damaged.
            rejected = bool(self.damaged)
        finally:
            process.bury()
        require(rejected, "I8", "it starts with another configuration")

    def _bury(self) -> None:
        process = self.process
        assert process is not None
        self.process = None
        self._image = process.bury()
        self._note_tip(process)
        self.record.died(process)
        for sender in self.senders.values():
            lost, sender.outstanding = sender.outstanding, []
            sender.waiting[:0] = [message for message in lost if message not in sender.waiting]
        self.at(self.clock.elapsed_s + RESTART_S, self._restart)

    def _note_tip(self, process: Process) -> None:
        self._tip_is_old = process.power_lost or process.disk.faulted

    def _restart(self) -> None:
        if self.process is None:
            self._start()
        for sender in self.senders.values():
            self._next(sender)

    def _open_engine(self) -> Tampered:
        table = wire.sensor_table(self.sensors)
        engine = Engine(table, TRACKING, 1, sampling=Sampling.DRAWN)
        return Tampered(engine, self.tampering)

    # ---------------------------------------------------------------- network

    def _next(self, sender: Sender) -> None:
        while sender.waiting and len(sender.outstanding) < sender.outstanding_max:
            message = sender.waiting.pop(0)
            if not message.done:
                sender.outstanding.append(message)
                self._deliver(sender, message)

    def _deliver(self, sender: Sender, message: Message) -> None:
        now_s = self.clock.elapsed_s
        copies = 2 if self.random.random() < sender.copies else 1
        for _ in range(copies):
            if sender.cut or self.random.random() < sender.loss:
                continue
            delay_s = self.random.uniform(0.005, 0.05) + self.random.uniform(0.0, sender.delay_s)
            self.at(now_s + delay_s, lambda: self._arrive(sender, message))
        self.at(now_s + ANSWER_S, lambda: self._give_up(sender, message))

    def _arrive(self, sender: Sender, message: Message) -> None:
        if self.process is None or self.process.down:
            return
        headers = self.headers(message.sender, message.media) | {"idempotency-key": message.key}
        chunks = [(0.0, message.body)]
        exchange = Exchange("POST", message.path, headers, chunks)
        self.process.request(exchange, lambda done: self._answered(sender, message, done))

    def _answered(self, sender: Sender, message: Message, exchange: Exchange) -> None:
        final = self.record.answered(message, exchange)
        if final:
            message.acknowledged_s = min(message.acknowledged_s, self.clock.elapsed_s)
        if sender.cut or self.random.random() < sender.answer_loss:
            return
        if final:
            message.done = True
        if message in sender.outstanding:
            sender.outstanding.remove(message)
            if not final:
                wait_s = float(exchange.headers.get(b"retry-after", b"0")) or PAUSE_S
                again_s = self.clock.elapsed_s + min(wait_s, 2.0)
                self.at(again_s, lambda: self._again(sender, message))
            self._next(sender)

    def _give_up(self, sender: Sender, message: Message) -> None:
        if message in sender.outstanding and not message.done:
            sender.outstanding.remove(message)
            self._again(sender, message)

    def _again(self, sender: Sender, message: Message) -> None:
        sender.waiting.insert(0, message)
        self._next(sender)

    def _emit(self, rows: list[Row]) -> None:
        octets = [traffic.datagram(rows)]
        for begin_s, end_s, fault in self.datagram_faults:
            if begin_s <= self.clock.elapsed_s < end_s:
                octets = [new for one in octets for new in fault(one)]
        for one in octets:
            self.throw(one, "192.0.2.30")

    def throw(self, octets: bytes, sender: str) -> None:
        """Send a datagram now."""
        if self.process is not None and not self.process.down:
            fits = self.process.receive(octets, sender)
            self.record.thrown(fits=fits)

    # ---------------------------------------------------------------- end

    def _finish(self) -> None:
        if not self._is_over():
            raise Violation("liveness", "not all messages were acknowledged in time")
        process = self.process
        assert process is not None
        process.pump()
        process.scheduler.settle()
        self.record.sample(process)
        self.record.check_status(process)
        folder = self._folder / str(self._starts)
        process.stop()
        self.process = None
        self.record.check_journal(self, folder)


def _memory_folder() -> str | None:
    return "/dev/shm" if Path("/dev/shm").is_dir() else None


def _shifted(metres: float) -> dict[str, tuple[float, float, float]]:
    latitude, longitude, height = traffic.SITES["41-20"]
    return traffic.SITES | {"41-20": (latitude + metres / 111_000.0, longitude, height)}


#: Sensors: as they are, with a wrong site, with two radars at one site.
SENSORS = {
    "plain": traffic.sensors(traffic.SITES),
    "shifted": traffic.sensors(_shifted(3_000.0)),
    "together": traffic.sensors(traffic.SITES | {"41-20": traffic.SITES["41-10"]}),
}
_FINGERPRINTS: dict[int, str] = {}


def _fingerprint(sensors: SensorsFile) -> str:
    if id(sensors) not in _FINGERPRINTS:
        table = wire.sensor_table(sensors)
        _FINGERPRINTS[id(sensors)] = configuration_fingerprint(table, TRACKING)
    return _FINGERPRINTS[id(sensors)]
