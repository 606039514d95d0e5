"""Faults of the machine: processes, disk, memory, clock."""

import random
from collections.abc import Callable

from support.simulation import traffic
from support.simulation.engines import POISON_HEIGHT_M
from support.simulation.faults_data import window
from support.simulation.process import JOURNAL, Process
from support.simulation.traffic import Message
from support.simulation.world import World


def _kills(*, power_lost: bool) -> Callable[[World, random.Random], None]:
    def arm(world: World, drawn: random.Random) -> None:
        def kill() -> None:
            process = world.process
            if process is None:
                return
            process.power_lost = power_lost
            if drawn.random() < 0.2:
                process.kill()
            else:
                process.disk.kill_at = process.disk.boundaries + drawn.randint(1, 60)

        def kill_at_start(process: Process) -> None:
            process.power_lost = power_lost
            process.disk.kill_at = process.disk.boundaries + drawn.randint(1, 20)

        for _ in range(drawn.randint(1, 3)):
            world.at(drawn.uniform(0.5, 15.0), kill)
        if drawn.random() < 0.3:
            world.start_faults.append(kill_at_start)

    return arm


def _on_disk(change: Callable[[Process, bool], None]) -> Callable[[World, random.Random], None]:
    # A state of the disk in a window.
    def arm(world: World, drawn: random.Random) -> None:
        begin_s, end_s = window(drawn)

        def turn(*, on: bool) -> None:
            world.disk_state = (lambda process: change(process, on)) if on else None
            if world.process is not None:
                change(world.process, on)

        world.during(begin_s, end_s, lambda: turn(on=True), lambda: turn(on=False))

    return arm


def _full(process: Process, on: bool) -> None:
    process.disk.full = on


def _once(name: str) -> Callable[[World, random.Random], None]:
    # The next operations of a kind fail.
    def arm(world: World, drawn: random.Random) -> None:
        def fail() -> None:
            if world.process is not None:
                setattr(world.process.disk, name, drawn.randint(1, 2))

        for _ in range(drawn.randint(1, 2)):
            world.at(drawn.uniform(1.0, 15.0), fail)
        if name == "failing_reads":
            world.start_faults.append(lambda process: setattr(process.disk, name, 1))

    return arm


def _flips(world: World, drawn: random.Random) -> None:
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

    _damage(world, drawn, flip)


def _truncated(world: World, drawn: random.Random) -> None:
    """The journal file ends early."""

    def cut(image: dict[str, bytes]) -> str:
        content = image.get(JOURNAL, b"")
        if len(content) < 2:
            return ""
        image[JOURNAL] = content[: drawn.randrange(1, len(content))]
        return "journal cut"

    _damage(world, drawn, cut)


def _damage(world: World, drawn: random.Random, change: Callable[[dict[str, bytes]], str]) -> None:
    def strike() -> None:
        world.damage = change
        if world.process is not None:
            world.process.kill()

    world.at(drawn.uniform(4.0, 14.0), strike)


def _error(error: Callable[[], Exception]) -> Callable[[World, random.Random], None]:
    # The engine fails once.
    def arm(world: World, drawn: random.Random) -> None:
        world.at(drawn.uniform(1.0, 14.0), lambda: setattr(world.tampering, "error", error()))

    return arm


def _poison(world: World, drawn: random.Random) -> None:
    """A measurement with which the engine always fails."""
    world.tampering.poisoned = True
    due_s = drawn.uniform(2.0, 11.0)
    row = {
        "time_s": traffic.START_S + due_s, "sensor_id": "41-10", "kind": "radar",
        "range_m": 70_000.0, "azimuth_deg": 5.0, **traffic.identity(70),
        "height_m": POISON_HEIGHT_M,
    }  # fmt: skip
    body = traffic.body("application/json", [row])
    world.send(Message("any", "poison", "application/json", body, [row], due_s))
    world.suspects.add("41-10")


def _stall(world: World, drawn: random.Random) -> None:
    """A thread does not run for some seconds."""

    def stall() -> None:
        if world.process is None:
            return
        thread = drawn.choice(world.process.scheduler.threads)
        thread.stalled_until_s = world.clock.elapsed_s + drawn.uniform(1.0, 6.0)

    world.all_suspect = True
    for _ in range(drawn.randint(1, 3)):
        world.at(drawn.uniform(1.0, 12.0), stall)


def _host_clock(world: World, drawn: random.Random) -> None:
    """The system time of the host jumps, and is corrected later."""
    begin_s, end_s = window(drawn)
    jump_s = drawn.choice((-3600.0, -60.0, -2.0, 2.0, 60.0, 3600.0))
    world.all_suspect = True
    world.during(
        begin_s, end_s, lambda: setattr(world.clock, "offset_s", jump_s),
        lambda: setattr(world.clock, "offset_s", 0.0),
    )  # fmt: skip


def _other_configuration(world: World, drawn: random.Random) -> None:
    """The service is started with other sensors, and then as before."""
    world.at(drawn.uniform(4.0, 14.0), world.start_otherwise)


FAULTS = (
    (21, "kill", _kills(power_lost=False)),
    (22, "power failure", _kills(power_lost=True)),
    (23, "bit flip", _flips),
    (23, "journal cut", _truncated),
    (24, "disk full", _on_disk(_full)),
    (24, "read error", _once("failing_reads")),
    (25, "sync fails once", _once("failing_syncs")),
    (26, "out of memory", _error(MemoryError)),
    (26, "thread stalls", _stall),
    (27, "poisoned measurement", _poison),
    (28, "engine fails once", _error(lambda: RuntimeError("transient"))),
    (8, "clock of the host", _host_clock),
    (30, "other configuration", _other_configuration),
)
