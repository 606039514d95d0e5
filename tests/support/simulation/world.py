"""A run: traffic, network, clock, disk and processes of the service, all from one seed."""

import functools
import heapq
import itertools
import random
import shutil
from collections.abc import Callable, Sequence

from multiradar.runtime.stream.events import Subscription
from multiradar_schemas.sensors.sensor import SensorsFile
from support.simulation import traffic
from support.simulation.datagrams import DatagramRecord
from support.simulation.disk import draw_from
from support.simulation.front import KEYS, Exchange, Front
from support.simulation.machine import SENSORS, Machine
from support.simulation.process import Process
from support.simulation.record import Record, Violation
from support.simulation.scheduler import VirtualClock
from support.simulation.traffic import Message, Occurred, Row

#: Duration of the traffic, and the time after which all must be acknowledged, s.
DURATION_S = 16.0
PATIENCE_S = 300.0
TICK_S = 0.5
#: A client waits so long for an answer, and pauses before it repeats, s.
ANSWER_S = 4.0
PAUSE_S = 0.5
#: Events that a reader gets at once; one farther behind gets a notice of a gap.
READER_EVENTS_MAX = 40

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
    cut : callable or None
        While it cannot reach the service: called with each message that is held back.
    effects : dict of str to callable
        Called when a property has changed the way of a message, by name.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.waiting: list[Message] = []
        self.outstanding: list[Message] = []
        self.outstanding_max = 1
        self.loss = self.answer_loss = self.copies = self.delay_s = 0.0
        self.cut: Callable[[Message], None] | None = None
        self.effects: dict[str, Occurred] = {}
        #: When the last message was due that has arrived, s.
        self.reached_s = 0.0

    def occurred(self, name: str) -> None:
        """Note that a property has changed the way of a message."""
        if name in self.effects:
            self.effects[name]()


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
        clock.on_wrong = lambda: None
        self.front = front
        self.record = Record(DatagramRecord())
        #: Names of the faults that have taken effect.
        self.occurred: set[str] = set()
        self.machine = Machine(
            seed, drawn=self.random, clock=clock, front=front, record=self.record, clients=self
        )  # fmt: skip
        self.senders = {name: Sender(name) for name in KEYS}
        #: Changes of the rows of a sensor: from, until, and what becomes of each.
        self.changes: dict[str, list[tuple[float, float, Change, Occurred]]] = {}
        #: Sensors that a fault concerns: their rows may be rejected.
        self.suspects: set[str] = set()
        #: Whether a fault concerns the whole service: any row may be late.
        self.all_suspect = False
        self.datagram_faults: list[
            tuple[float, float, Callable[[bytes], list[bytes]], Occurred]
        ] = []
        # When sectors are due of which a fault has left nothing, s, and that fault.
        self._silences: list[tuple[float, Occurred]] = []
        # Faults that have replaced the sensors.
        self._tables: list[Occurred] = []
        self._table = self.machine.sensors
        #: When the last measurement may have been received, s.
        self.heard_s = 0.0
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

    def change(
        self, sensor: str, window: tuple[float, float], change: Change, occurred: Occurred
    ) -> None:
        """Change the rows of a sensor in an interval of true time."""
        self.changes.setdefault(sensor, []).append((*window, change, occurred))
        self.suspects.add(sensor)

    def send(self, message: Message, *occurred: Occurred) -> None:
        """Have a message sent at its time, until it is answered; then faults have occurred."""
        message.effects.extend(occurred)
        self.record.messages.append(message)
        sender = self.senders[message.sender]

        def due() -> None:
            sender.waiting.append(message)
            self._next(sender)

        self.at(message.due_s, due)

    def repeat(self, message: Message, occurred: Occurred) -> None:
        """Send an acknowledged message again, with its key."""
        message.effects.append(occurred)
        self._arrive(self.senders[message.sender], message)

    def use_table(self, name: str, occurred: Occurred) -> None:
        """Run the service with other sensors than those that send; one of `SENSORS`."""
        self.suspects |= {"41-20", "41-30"} if self._tables else {"41-20"}
        self._tables.append(occurred)
        self._table = SENSORS[name if len(self._tables) == 1 else "both"]
        self.machine.sensors = self._table

    def headers(self, client: str, media: str) -> dict[str, str]:
        """Return the headers of a request of a client."""
        return {
            "host": "simulated",
            "authorization": f"Bearer {KEYS[client]}",
            "content-type": media,
        }

    def checked(self, exchange: Exchange, status: int, occurred: Occurred) -> None:
        """Check the answer to a request, with which a fault occurs."""
        self.record.receive(exchange, status)
        if exchange.status == status:
            occurred()

    def read_slowly(self, period_s: float, occurred: Occurred) -> None:
        """Read the stream of events so often, and resume it after each restart.

        A gap is an effect of the fault.
        """
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
                if self.record.read(events, after):
                    occurred()
                after = reader.after
            self.at(self.clock.elapsed_s + period_s, read)

        self.at(period_s, read)

    def read_once(self, after: int) -> bool:
        """Read the events after a number, which may be of another journal, and leave.

        Returns whether a process runs.
        """
        process = self.machine.process
        if process is not None and not process.down:
            reader = process.subscribe(after, READER_EVENTS_MAX)
            events = process.events(reader, READER_EVENTS_MAX)
            self.record.read(events, self._known_after(process, after))
            reader.close()
            return True
        return False

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
            for due_s, occurred in self._silences:
                if due_s <= self.clock.elapsed_s:
                    occurred()
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
                changed = [
                    self._changed(sensor, row)
                    for row in rows
                    if begin_s <= row["time_s"] - traffic.START_S < end_s
                ]
                sector = [row for new, _ in changed for row in new]
                effects = [occurred for _, some in changed for occurred in some]
                if not sector:
                    self._silences += [(due_s, occurred) for occurred in effects]
                    continue
                if sensor == traffic.DATAGRAMS:
                    self.at(due_s, functools.partial(self._emit, sector, effects))
                    continue
                media = traffic.MEDIA[sensor]
                body = traffic.body(media, sector)
                key = f"{sensor}/{place}"
                self.send(Message(names[sensor], key, media, body, sector, due_s), *effects)
        for number in range(int(PATIENCE_S / TICK_S)):
            self.at(number * TICK_S, lambda: None)

    # What becomes of a row, and the faults that have changed it.
    def _changed(self, sensor: str, row: Row) -> tuple[list[Row], list[Occurred]]:
        since_s = row["time_s"] - traffic.START_S
        rows, effects = [row], list[Occurred]()
        for begin_s, end_s, change, occurred in self.changes.get(sensor, []):
            if begin_s <= since_s < end_s:
                before, rows = rows, [new for one in rows for new in change(one)]
                if rows != before:
                    # Of what one removes, other changes are not seen.
                    effects = [*effects, occurred] if rows else [occurred]
        return rows, effects

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
        sent = False
        for _ in range(copies):
            if sender.cut is not None:
                message.effects.append(functools.partial(sender.cut, message))
                continue
            if self.random.random() < sender.loss:
                sender.occurred("loss")
                continue
            usual_s = self.random.uniform(0.005, 0.05)
            delay_s = usual_s + self.random.uniform(0.0, sender.delay_s)
            effects = [sender.effects.get("delay_s")] if delay_s > 2.0 * usual_s else []
            effects += [sender.effects.get("copies")] if sent else []
            self.at(now_s + delay_s, functools.partial(self._arrive, sender, message, effects))
            sent = True
        self.at(now_s + ANSWER_S, lambda: self._give_up(sender, message))

    # Effects are those of the way of this message.
    def _arrive(
        self, sender: Sender, message: Message, effects: Sequence[Occurred | None] = ()
    ) -> None:
        running = self.machine.running()
        if not running:
            return
        for occurred in effects:
            if occurred is not None:
                occurred()
        if not message.arrived and message.due_s < sender.reached_s:
            sender.occurred("outstanding_max")
        message.arrived, sender.reached_s = True, max(sender.reached_s, message.due_s)
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
            self.heard_s = self.clock.elapsed_s
        if sender.cut is not None:
            message.effects.append(functools.partial(sender.cut, message))
            return
        if self.random.random() < sender.answer_loss:
            sender.occurred("answer_loss")
            return
        if final:
            message.done = True
            self._take_effect(message)
        if message in sender.outstanding:
            sender.outstanding.remove(message)
            if not final:
                wait_s = float(exchange.headers.get(b"retry-after", b"0")) or PAUSE_S
                again_s = self.clock.elapsed_s + min(wait_s, 2.0)
                self.at(again_s, lambda: self._again(sender, message))
            self._next(sender)

    def _take_effect(self, message: Message) -> None:
        for occurred in message.effects:
            occurred()
        message.effects.clear()
        if message.key.startswith("41-20/") and self.sensors is self._table:
            for occurred in self._tables:
                occurred()

    def _give_up(self, sender: Sender, message: Message) -> None:
        if message in sender.outstanding and not message.done:
            sender.outstanding.remove(message)
            self._again(sender, message)

    def _again(self, sender: Sender, message: Message) -> None:
        sender.waiting.insert(0, message)
        self._next(sender)

    def _emit(self, rows: list[Row], effects: list[Occurred]) -> None:
        sent = traffic.datagram(rows)
        octets, effects = [sent], list(effects)
        for begin_s, end_s, fault, occurred in self.datagram_faults:
            if begin_s <= self.clock.elapsed_s < end_s:
                before, octets = octets, [new for one in octets for new in fault(one)]
                if octets != before:
                    effects = [*effects, occurred] if octets else [occurred]
        fit = [
            self.throw(one, traffic.RECORDER, len(rows) if one == sent else None) for one in octets
        ]
        if any(fit) or (not octets and self.machine.serves):
            for occurred in effects:
                occurred()

    def throw(self, octets: bytes, sender: str, plots: int | None) -> bool | None:
        """Send a datagram now; return whether it fits into the queue, None without a process.

        `plots` is the number of its plots, None if it does not arrive as it was sent.
        """
        process = self.machine.process
        if process is None or process.down:
            return None
        self.heard_s = self.clock.elapsed_s
        return process.receive(octets, sender, plots)

    # ---------------------------------------------------------------- end

    def _finish(self) -> None:
        if not self._is_over():
            raise Violation("liveness", "not all messages were acknowledged in time")
        process = self.machine.process
        assert process is not None, "it is over"
        process.pump()
        process.scheduler.settle()
        self.record.sample(process)
        silent_s = self.clock.elapsed_s - max(self.heard_s, self.machine.started_s)
        self.record.check_status(process, None if self.all_suspect else silent_s)
        self.record.check_journal(self, self.machine.finish())
