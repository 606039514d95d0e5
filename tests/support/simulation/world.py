"""A run: traffic, network, clock, disk and processes of the service, all from one seed."""

import heapq
import itertools
import random
import shutil
from collections.abc import Callable

from multiradar.runtime.stream.events import Subscription
from multiradar_schemas.sensors.sensor import SensorsFile
from support.simulation import traffic
from support.simulation.disk import draw_from
from support.simulation.front import KEYS, Exchange, Front
from support.simulation.machine import SENSORS, Machine
from support.simulation.process import Process
from support.simulation.record import Record, Violation
from support.simulation.scheduler import VirtualClock
from support.simulation.traffic import Message, Row

#: Duration of the traffic, and the time after which all must be acknowledged, s.
DURATION_S = 16.0
PATIENCE_S = 300.0
TICK_S = 0.5
#: A client waits so long for an answer, and pauses before it repeats, s.
ANSWER_S = 4.0
PAUSE_S = 0.5
#: Events that a reader gets at once; one farther behind gets a notice of a gap.
READER_EVENTS_MAX = 120

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
        self.machine = Machine(
            seed, drawn=self.random, clock=clock, front=front, record=self.record, clients=self
        )  # fmt: skip
        self.senders = {name: Sender(name) for name in KEYS}
        #: Changes of the rows of a sensor: from, until, and what becomes of each.
        self.changes: dict[str, list[tuple[float, float, Change]]] = {}
        #: Sensors that a fault concerns: their rows may be rejected.
        self.suspects: set[str] = set()
        #: Whether a fault concerns the whole service: any row may be late.
        self.all_suspect = False
        self.datagram_faults: list[tuple[float, float, Callable[[bytes], list[bytes]]]] = []
        self._agenda: list[tuple[float, int, Callable[[], None]]] = []
        self._count = itertools.count()
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
        self._arrive(self.senders[message.sender], message)

    def use_table(self, name: str) -> None:
        """Run the service with other sensors than those that send; one of `SENSORS`."""
        self.machine.sensors = SENSORS[name]
        self.suspects.add("41-20")

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
        after = migrations = 0
        reader: Subscription | None = None

        def read() -> None:
            nonlocal after, migrations, reader
            running = self.machine.running()
            process = next((one for one in running if reader in one.readers), None)
            if process is None and running:
                process = self._some(running)
                reader = process.subscribe(after, READER_EVENTS_MAX)
                if self.record.migrations > migrations:
                    # The new journal may have fewer events.
                    migrations = self.record.migrations
                    after = self._known_after(process, after)
            if process is not None and reader is not None:
                events = process.events(reader, READER_EVENTS_MAX)
                self.record.read(events, after)
                after = reader.after
            self.at(self.clock.elapsed_s + period_s, read)

        self.at(period_s, read)

    def read_once(self, after: int) -> None:
        """Read the events after a number, which may be of another journal, and leave."""
        process = self.machine.process
        if process is not None and not process.down:
            reader = process.subscribe(after, READER_EVENTS_MAX)
            events = process.events(reader, READER_EVENTS_MAX)
            self.record.read(events, self._known_after(process, after))
            reader.close()

    def ask(self, exchange: Exchange, answered: Callable[[Exchange], None]) -> None:
        """Ask once, without a repetition."""
        process = self.machine.process
        if process is not None and not process.down:
            process.request(exchange, answered)

    # ---------------------------------------------------------------- the run

    def run(self) -> None:
        """Run to the end and check; raises `Violation`, and `Detected` if damage ended it."""
        try:
            self._plan()
            self.machine.start()
            while self._agenda and not self._is_over():
                time_s, _, action = heapq.heappop(self._agenda)
                self.clock.elapsed_s = max(self.clock.elapsed_s, time_s)
                action()
                self._churn()
            self._finish()
        finally:
            self.machine.abandon()
            shutil.rmtree(self.machine.folder, ignore_errors=True)

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
        return done and self.machine.serves

    def _churn(self) -> None:
        self.machine.tend()
        for process in self.machine.running():
            if process not in self.machine.running():
                # It ended with the other one.
                continue
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
            self.machine.tend()

    # ---------------------------------------------------------------- processes

    @property
    def sensors(self) -> SensorsFile:
        """The sensors with which the service runs."""
        return self.machine.sensors

    def disconnected(self) -> None:
        """Have all clients lose their connections."""
        for sender in self.senders.values():
            lost, sender.outstanding = sender.outstanding, []
            sender.waiting[:0] = [message for message in lost if message not in sender.waiting]

    def served(self) -> None:
        """Have all clients send again."""
        for sender in self.senders.values():
            self._next(sender)

    # The event after which a reader gets those of a service: all, if it has none of that number.
    def _known_after(self, process: Process, after: int) -> int:
        return after if after <= process.service.publication._events.ring.head else 0

    def _some(self, running: list[Process]) -> Process:
        return running[0] if len(running) == 1 else self.random.choice(running)

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
        running = self.machine.running()
        if not running:
            return
        headers = self.headers(message.sender, message.media) | {"idempotency-key": message.key}
        chunks = [(0.0, message.body)]
        exchange = Exchange("POST", message.path, headers, chunks)
        # A client does not know which of a pair is the standby.
        process = self._some(running)
        process.request(exchange, lambda done: self._answered(sender, message, done))

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
        process = self.machine.process
        if process is not None and not process.down:
            fits = process.receive(octets, sender)
            self.record.thrown(fits=fits)

    # ---------------------------------------------------------------- end

    def _finish(self) -> None:
        if not self._is_over():
            raise Violation("liveness", "not all messages were acknowledged in time")
        process = self.machine.process
        assert process is not None, "it is over"
        process.pump()
        process.scheduler.settle()
        self.record.sample(process)
        self.record.check_status(process)
        self.record.check_journal(self, self.machine.finish())
