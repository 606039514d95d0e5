"""The machine of a run: its disk, and the processes of the service, one or a pair.

A process that dies is started again after a while with what is left on the disk. In a pair, a
standby follows the journal on the same disk, and takes over.
"""

import random
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from multiradar.errors import ConfigurationError, JournalError, MultiradarError
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.engine.fingerprint import configuration_fingerprint
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar_schemas.sensors.sensor import SensorsFile
from support.simulation import traffic
from support.simulation.engines import Tampered, Tampering
from support.simulation.front import Front
from support.simulation.migration import migrated
from support.simulation.process import TRACKING, Process, sensor_table
from support.simulation.record import Detected, Record, Violation, require
from support.simulation.scheduler import VirtualClock
from support.simulation.traffic import Occurred

#: The supervisor starts a process that ended after so long, s.
RESTART_S = 0.5
STARTS_MAX = 60
#: Measurements from one snapshot to the next, and what their files have in their names.
SNAPSHOT_ROWS = 60
SNAPSHOTS = "-snapshots/"
#: Time in which a standby must have processed what the primary has acknowledged, s.
LEVEL_S = 1.0
FENCED = "another service has opened this journal for writing; this service no longer writes to it"


class Clients(Protocol):
    """What the clients of the service notice of its processes."""

    def at(self, time_s: float, action: Callable[[], None]) -> None:
        """Do something at a time, s after the start."""
        ...

    def disconnected(self) -> None:
        """The process that served them has ended."""
        ...

    def served(self) -> None:
        """A process serves them."""
        ...


class Machine:
    """The machine on which the service runs.

    Parameters
    ----------
    seed : int
        Half of the runs have snapshots.
    drawn : Random
        Draws the order of threads, and what the disk loses.
    clock : VirtualClock
        Time.
    front : Front
        The HTTP application.
    record : Record
        Notes starts and ends.
    clients : Clients
        The clients of the service.

    Attributes
    ----------
    process, standby : Process or None
        The process that serves, and the one that follows it.
    paired : bool
        Whether there is a standby.
    damage : callable or None
        Done to the files on the disk before the next start; named when it is damage.
    start_faults : list of callable
        Done to the next process that opens the journal for writing.
    disk_state : callable or None
        Applied to the disk of each process that starts.
    """

    def __init__(
        self, seed: int, *, drawn: random.Random, clock: VirtualClock, front: Front,
        record: Record, clients: Clients,
    ) -> None:  # fmt: skip
        self._random, self._clock, self._front = drawn, clock, front
        self._record, self._clients = record, clients
        self.folder = Path(tempfile.mkdtemp(dir=_memory_folder()))
        self.sensors: SensorsFile = SENSORS["plain"]
        self.tampering = Tampering()
        self.process: Process | None = None
        self.standby: Process | None = None
        self.paired = False
        self.damage: Callable[[dict[str, bytes]], str] | None = None
        self.start_faults: list[Callable[[Process], None]] = []
        #: Called when a kind of fault of the disk has occurred.
        self.disk_effects: dict[str, Occurred] = {}
        self.disk_state: Callable[[Process], None] | None = None
        self._snapshot_rows = SNAPSHOT_ROWS if seed % 2 else 0
        #: When the service last started or took over, s.
        self.started_s = 0.0
        self._otherwise: Occurred | None = None
        self._fenced: Occurred = lambda: None
        #: Whether the journal is migrated before the next start, and whether that is killed once.
        self._migration: SensorsFile | None = None
        self._migration_killed = False
        self._migrated: Occurred = lambda: None
        #: Whether the tip may be older than the journal, so that not all damage is found.
        self._tip_is_old = False
        #: Damage that no start has reported so far.
        self._damaged = ""
        self._image: dict[str, bytes] = {}
        self._starts = 0

    @property
    def now_s(self) -> float:
        """Time since the start of the run, s."""
        return self._clock.elapsed_s

    @property
    def serves(self) -> bool:
        """Whether a process serves the clients."""
        return self.process is not None and not self.process.down

    def running(self) -> list[Process]:
        """Return the processes that run, the primary first."""
        return [one for one in (self.process, self.standby) if one is not None and not one.down]

    # ---------------------------------------------------------------- for faults

    def kill(self) -> None:
        """Kill all processes now."""
        if self.standby is not None:
            self.standby.failed = True
        if self.process is not None:
            self.process.kill()

    def start_otherwise(self, occurred: Occurred) -> None:
        """Kill the service, and start it with another configuration."""
        self._otherwise = occurred
        self.kill()

    def migrate(self, name: str | None, occurred: Occurred, *, killed: bool) -> None:
        """Kill the service, migrate its journal to sensors of `SENSORS`, and start it on that."""
        self._migration = self.sensors if name is None else SENSORS[name]
        self._migration_killed, self._migrated = killed, occurred
        self.kill()

    def drain(self, occurred: Occurred) -> None:
        """Have an operator drain the primary, if there is a standby."""
        process = self.process
        if process is not None and self.serves and self.standby is not None:
            process.drain()
            occurred()

    def lose_lock(self, occurred: Occurred) -> None:
        """Lose the lock of the primary, which goes on; the standby takes over."""
        if self.process is not None and self.serves and self.standby is not None:
            self.process.lose_lock()
            self._fenced = occurred

    # ---------------------------------------------------------------- processes

    def start(self) -> None:
        """Start a process on what is left on the disk."""
        self._starts += 1
        if self._starts > STARTS_MAX:
            raise Violation("I8", "the service never starts again")
        if self._otherwise is not None and self._image:
            self._start_otherwise(self._otherwise)
        if self._migration is not None and self._image and not self._damaged:
            self._migrate(self._migration)
        intact = dict(self._image)
        if self.damage is not None and self._image and not self._tip_is_old:
            # What a start from a snapshot does not read of the journal, it finds later.
            self._image = {name: one for name, one in intact.items() if SNAPSHOTS not in name}
            self._damaged, self.damage = self.damage(self._image), None
        process = self._process(str(self._starts), _fingerprint(self.sensors))
        if self.disk_state is not None:
            self.disk_state(process)
        self._use_start_faults(process)
        self.tampering.raised = False
        try:
            process.start()
        except MultiradarError as error:
            dead = process.disk.dead
            faulty = dead or bool(process.disk.faulted) or self.tampering.raised
            self._record.start_failed(error, damaged=self._damaged, faulty=faulty)
            left = self._end(process)
            if self._damaged and not dead:
                self._repair(intact)
            else:
                self._image = left if dead else intact
            self._later(self._restart)
            return
        self.process, self.started_s = process, self.now_s
        self._record.started(process)
        self._later(self._start_standby)

    def tend(self) -> None:
        """Bury processes that have ended, and have the standby take over."""
        process, standby = self.process, self.standby
        if standby is not None and standby.down:
            self._bury_standby(standby)
        if process is not None and process.down:
            self._bury(process)
        if standby is not None and standby is self.standby and standby.leads:
            if self.process is not None:
                self._fence(self.process)
            self._promote(standby)

    def finish(self) -> Path:
        """Stop the service in order, and return the folder of its disk."""
        process, standby = self.process, self.standby
        assert process is not None, "it runs"
        if standby is not None:
            self._clock.elapsed_s += LEVEL_S
            for thread in standby.scheduler.threads:
                thread.stalled_until_s = self.now_s
            standby.scheduler.settle()
            self._record.level(process, standby)
            self._bury_standby(standby)
        process.stop()
        self._record.stopped(process)
        self._leave(process)
        self.process = None
        return process.folder

    def abandon(self) -> None:
        """End all processes where they are."""
        for process in (self.standby, self.process):
            if process is not None:
                self._end(process)

    # ---------------------------------------------------------------- inside

    def _later(self, action: Callable[[], None]) -> None:
        self._clients.at(self.now_s + RESTART_S, action)

    def _restart(self) -> None:
        if self.process is None and self.standby is None:
            self.start()
        self._clients.served()

    def _repair(self, intact: dict[str, bytes]) -> None:
        if self._record.wrote_since_damage:
            raise Detected
        self._image, self._damaged = intact, ""

    def _process(self, name: str, fingerprint: str, beside: Process | None = None) -> Process:
        folder = self.folder / name
        if beside is None:
            folder.mkdir()
        return Process(
            folder=folder,
            image=self._image,
            seed=self._random,
            clock=self._clock,
            front=self._front,
            sensors=self.sensors,
            fingerprint=fingerprint,
            open_engine=self._open_engine,
            snapshot_rows=self._snapshot_rows,
            beside=beside,
        )

    def _start_otherwise(self, occurred: Occurred) -> None:
        self._otherwise = None
        process = self._process("other", "another fingerprint")
        rejected = False
        try:
            process.start()
        except ConfigurationError:
            rejected = True
        except JournalError:
            # The journal itself may be damaged.
            rejected = bool(self._damaged)
        finally:
            self._end(process)
        require(rejected, "I8", "it starts with another configuration")
        occurred()

    def _migrate(self, sensors: SensorsFile) -> None:
        self._migration = None
        folder = self.folder / f"migration {self._starts}"
        found = migrated(self._image, folder, sensors, killed=self._migration_killed)
        changes = sensors is not self.sensors
        if isinstance(found, MultiradarError):
            self._record.migration_failed(found, changes=changes)
            return
        self._image, self.sensors, self._tip_is_old = found, sensors, False
        self._record.migrated(changes=changes)
        self._migrated()

    def _use_start_faults(self, process: Process) -> None:
        for fault in self.start_faults:
            fault(process)
        self.start_faults.clear()

    def _end(self, process: Process) -> dict[str, bytes]:
        left = process.bury()
        self._leave(process)
        return left

    def _leave(self, process: Process) -> None:
        process.disk.close()
        self._tip_is_old = process.power_lost or bool(process.disk.faulted)
        for kind in process.disk.faulted & set(self.disk_effects):
            self.disk_effects[kind]()

    def _bury(self, process: Process) -> None:
        self.process = None
        left = process.bury()
        self._record.died(process)
        self._clients.disconnected()
        standby = self.standby
        if standby is not None and not (process.power_lost and process.disk.dead):
            standby.survive()
            self._use_start_faults(standby)
            return
        if standby is not None:
            standby.bury()
            self.standby = None
        self._image = left
        self._leave(process)
        self._later(self._restart)

    def _open_engine(self) -> Tampered:
        engine = Engine(sensor_table(self.sensors), TRACKING, 1, sampling=Sampling.DRAWN)
        return Tampered(engine, self.tampering)

    # ---------------------------------------------------------------- standby

    def _start_standby(self) -> None:
        process = self.process
        if process is None or process.down or not self.paired or self.standby is not None:
            return
        standby = self._process("", _fingerprint(self.sensors), beside=process)
        self.tampering.raised = False
        try:
            standby.start()
        except MultiradarError as error:
            faulty = bool(process.disk.faulted) or self.tampering.raised
            self._record.start_failed(error, damaged=self._damaged, faulty=faulty)
            standby.bury()
            self._later(self._start_standby)
            return
        self.standby = standby

    def _bury_standby(self, standby: Process) -> None:
        self.standby = None
        if self.process is not None:
            standby.bury()
            self._later(self._start_standby)
            return
        self._image = self._end(standby)
        self._record.died(standby)
        self._later(self._restart)

    def _fence(self, process: Process) -> None:
        """Have a primary go on that does not know that another service has taken over."""
        with process.disk.sound():
            failure = process.write_on()
        how = f"a primary without the lock is not stopped: {failure}"
        require(isinstance(failure, JournalError) and FENCED in str(failure), "I8", how)
        self._fenced()
        self._bury(process)

    def _promote(self, standby: Process) -> None:
        self.process, self.standby, self.started_s = standby, None, self.now_s
        self._record.took_over(standby)
        self._clients.served()
        self._later(self._start_standby)


def _memory_folder() -> str | None:
    return "/dev/shm" if Path("/dev/shm").is_dir() else None


def _shifted(name: str, metres: float) -> dict[str, tuple[float, float, float]]:
    latitude, longitude, height = traffic.SITES[name]
    return {name: (latitude + metres / 111_000.0, longitude, height)}


def _without(name: str) -> dict[str, tuple[float, float, float]]:
    return {one: site for one, site in traffic.SITES.items() if one != name}


_TOGETHER = {"41-20": traffic.SITES["41-10"]}
#: Sensors: as they are, with a wrong site, with two radars at one site, with both, without a radar.
SENSORS = {
    "plain": traffic.sensors(traffic.SITES),
    "shifted": traffic.sensors(traffic.SITES | _shifted("41-20", 3_000.0)),
    "together": traffic.sensors(traffic.SITES | _TOGETHER),
    "both": traffic.sensors(traffic.SITES | _TOGETHER | _shifted("41-30", 3_000.0)),
    "without": traffic.sensors(_without("41-20")),
}
_FINGERPRINTS: dict[int, str] = {}


def _fingerprint(sensors: SensorsFile) -> str:
    if id(sensors) not in _FINGERPRINTS:
        table = sensor_table(sensors)
        _FINGERPRINTS[id(sensors)] = configuration_fingerprint(table, TRACKING)
    return _FINGERPRINTS[id(sensors)]
