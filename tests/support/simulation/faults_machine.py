"""Faults of the machine: processes, disk, memory, clock."""

import functools
import random
from collections.abc import Callable
from dataclasses import dataclass

from support.simulation import traffic
from support.simulation.engines import POISON_HEIGHT_M
from support.simulation.faults_data import window
from support.simulation.machine import Machine
from support.simulation.process import JOURNAL, Process
from support.simulation.traffic import Message, Occurred
from support.simulation.world import World

# Arranges a fault in a run.
_Arm = Callable[[World, random.Random, Occurred], None]


@dataclass(frozen=True, slots=True)
class _Kills:
    # Kills of the service of a machine; those of one of a pair need the other.
    machine: Machine
    drawn: random.Random
    occurred: Occurred
    power_lost: bool
    paired: bool

    def kill_soon(self, process: Process, boundaries_max: int = 20) -> None:
        process.power_lost = self.power_lost
        process.killed_by = functools.partial(self._killed, process)
        process.disk.kill_at = process.disk.boundaries + self.drawn.randint(1, boundaries_max)

    def kill(self) -> None:
        machine = self.machine
        _delay_standby(machine, self.drawn)
        if machine.standby is not None and self.drawn.random() < 0.2:
            machine.standby.failed = True
            if not self.power_lost:
                self.occurred()
        elif machine.process is not None:
            self.kill_soon(machine.process, 60)
            if self.drawn.random() < 0.2:
                machine.process.kill()
                self._killed(machine.process)

    # A power failure that loses nothing is a kill.
    def _killed(self, process: Process) -> None:
        alone = self.paired and self.machine.standby is None
        if not alone and (process.lost_writes or not self.power_lost):
            self.occurred()


def _kills(*, power_lost: bool, paired: bool = False) -> _Arm:
    def arm(world: World, drawn: random.Random, occurred: Occurred) -> None:
        machine = world.machine
        machine.paired |= paired
        kills = _Kills(machine, drawn, occurred, power_lost, paired)
        for _ in range(drawn.randint(1, 3)):
            world.at(drawn.uniform(0.5, 15.0), kills.kill)
        if drawn.random() < 0.3:
            machine.start_faults.append(kills.kill_soon)

    return arm


def _takeovers(change: Callable[[Machine, Occurred], None]) -> _Arm:
    # The primary of a pair is made to end.
    def arm(world: World, drawn: random.Random, occurred: Occurred) -> None:
        world.machine.paired = True

        def end_primary() -> None:
            _delay_standby(world.machine, drawn)
            change(world.machine, occurred)

        for _ in range(drawn.randint(1, 2)):
            world.at(drawn.uniform(1.0, 15.0), end_primary)

    return arm


def _delay_standby(machine: Machine, drawn: random.Random) -> None:
    # So that it takes over with entries that it has not processed.
    if machine.standby is not None:
        until_s = machine.now_s + drawn.choice((0.0, 1.0)) * drawn.uniform(0.0, 3.0)
        for thread in machine.standby.scheduler.threads:
            thread.stalled_until_s = until_s


def _on_disk(kind: str, change: Callable[[Process, bool], None]) -> _Arm:
    # A state of the disk in a window.
    def arm(world: World, drawn: random.Random, occurred: Occurred) -> None:
        begin_s, end_s = window(drawn)
        world.machine.disk_effects[kind] = occurred

        def turn(*, on: bool) -> None:
            world.machine.disk_state = (lambda process: change(process, on)) if on else None
            if world.machine.process is not None:
                change(world.machine.process, on)

        world.during(begin_s, end_s, lambda: turn(on=True), lambda: turn(on=False))

    return arm


def _full(process: Process, on: bool) -> None:
    process.disk.full = on


def _once(name: str) -> _Arm:
    # The next operations of a kind fail.
    def arm(world: World, drawn: random.Random, occurred: Occurred) -> None:
        world.machine.disk_effects[name] = occurred

        def fail() -> None:
            if world.machine.process is not None:
                setattr(world.machine.process.disk, name, drawn.randint(1, 2))

        for _ in range(drawn.randint(1, 2)):
            world.at(drawn.uniform(1.0, 15.0), fail)
        if name == "failing_reads":
            world.machine.start_faults.append(lambda process: setattr(process.disk, name, 1))

    return arm


def _flips(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """A bit of the journal changes while the service is down."""

    def flip(image: dict[str, bytes]) -> str:
        names = [name for name, content in sorted(image.items()) if content]
        if not names:
            return ""
        name = drawn.choice(names)
        damaged = bytearray(image[name])
        damaged[drawn.randrange(len(damaged))] ^= 1 << drawn.randrange(8)
        image[name] = bytes(damaged)
        return "flip in the log" if name.endswith("-wal") else "flip in the journal"

    _damage(world, drawn, flip, occurred)


def _truncated(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """The journal file ends early."""

    def cut(image: dict[str, bytes]) -> str:
        content = image.get(JOURNAL, b"")
        if len(content) < 2:
            return ""
        image[JOURNAL] = content[: drawn.randrange(1, len(content))]
        return "journal cut"

    _damage(world, drawn, cut, occurred)


def _damage(
    world: World, drawn: random.Random, change: Callable[[dict[str, bytes]], str],
    occurred: Occurred,
) -> None:  # fmt: skip
    def damage(image: dict[str, bytes]) -> str:
        kind = change(image)
        if kind:
            occurred()
        return kind

    def strike() -> None:
        world.machine.damage = damage
        world.machine.kill()

    world.at(drawn.uniform(4.0, 14.0), strike)


def _error(error: Callable[[], Exception]) -> _Arm:
    # The engine fails once.
    def arm(world: World, drawn: random.Random, occurred: Occurred) -> None:
        tampering = world.machine.tampering

        def fail() -> None:
            tampering.error, tampering.on_error = error(), occurred

        world.at(drawn.uniform(1.0, 14.0), fail)

    return arm


def _poison(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """A measurement with which the engine always fails."""
    world.machine.tampering.poisoned, world.machine.tampering.on_poison = True, occurred
    due_s = drawn.uniform(2.0, 11.0)
    row = {
        "time_s": traffic.START_S + due_s, "sensor_id": "41-10", "kind": "radar",
        "range_m": 70_000.0, "azimuth_deg": 5.0, **traffic.identity(70),
        "height_m": POISON_HEIGHT_M,
    }  # fmt: skip
    body = traffic.body("application/json", [row])
    world.send(Message("any", "poison", "application/json", body, [row], due_s))
    world.suspects.add("41-10")


def _stall(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """A thread does not run for some seconds."""

    def stall() -> None:
        if world.machine.process is None:
            return
        thread = drawn.choice(world.machine.process.scheduler.threads)
        thread.stalled_until_s = world.clock.elapsed_s + drawn.uniform(1.0, 6.0)
        thread.on_stall = occurred

    world.all_suspect = True
    for _ in range(drawn.randint(1, 3)):
        world.at(drawn.uniform(1.0, 12.0), stall)


def _host_clock(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """The system time of the host jumps, and is corrected later."""
    begin_s, end_s = window(drawn)
    jump_s = drawn.choice((-3600.0, -60.0, -2.0, 2.0, 60.0, 3600.0))
    world.all_suspect, world.clock.on_wrong = True, occurred
    world.during(
        begin_s, end_s, lambda: setattr(world.clock, "offset_s", jump_s),
        lambda: setattr(world.clock, "offset_s", 0.0),
    )  # fmt: skip


def _other_configuration(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """The service is started with other sensors, and then as before."""
    at_s = drawn.uniform(4.0, 14.0)
    world.at(at_s, lambda: world.machine.start_otherwise(occurred))


def _migration(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """The journal is migrated, to the same sensors or to others."""
    at_s, killed = drawn.uniform(4.0, 14.0), drawn.random() < 0.3
    name = drawn.choice((None, None, "plain", "shifted", "without"))
    if name is not None:
        world.suspects.add("41-20")
    world.at(at_s, lambda: world.machine.migrate(name, occurred, killed=killed))


FAULTS = (
    (21, "kill", _kills(power_lost=False)),
    (21, "kill of one of a pair", _kills(power_lost=False, paired=True)),
    (22, "power failure", _kills(power_lost=True)),
    (23, "bit flip", _flips),
    (23, "journal cut", _truncated),
    (24, "disk full", _on_disk("full", _full)),
    (24, "read error", _once("failing_reads")),
    (25, "sync fails once", _once("failing_syncs")),
    (26, "out of memory", _error(MemoryError)),
    (26, "thread stalls", _stall),
    (27, "poisoned measurement", _poison),
    (28, "engine fails once", _error(lambda: RuntimeError("transient"))),
    (8, "clock of the host", _host_clock),
    (28, "drain of the primary", _takeovers(Machine.drain)),
    (29, "primary loses its lock", _takeovers(Machine.lose_lock)),
    (30, "other configuration", _other_configuration),
    (30, "migration", _migration),
)
