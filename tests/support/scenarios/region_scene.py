"""Four services around one point, radars that overlap, and aircraft that cross the boundaries."""

from collections.abc import Callable, Iterable
from concurrent.futures import Future
from contextlib import suppress
from typing import NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.ingest.zenoh.bus import JSON, Message
from multiradar.ingest.zenoh.handovers import RegionExchange
from multiradar.ingest.zenoh.memory_bus import MemoryBus
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.receipt import Receipt
from multiradar.runtime.live.service import Service
from multiradar.runtime.live.snapshots import SnapshotRules
from multiradar.runtime.memory.regions.areas import Areas, Centre
from multiradar.runtime.memory.regions.board import RegionBoard, RegionRules
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import sensor_table
from multiradar_schemas.measurements.directions import PLAIN_SCHEMA
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile
from support.processes.waiting import WAIT_TIMEOUT_S

START_S = 1_700_000_000.0
SCAN_S = 4.0
#: The point at which all four regions meet.
CORNER = (50.0, 10.0)
CENTRES = {
    "north-east": Centre("north-east", 51.0, 11.5),
    "north-west": Centre("north-west", 51.0, 8.5),
    "south-east": Centre("south-east", 49.0, 11.5),
    "south-west": Centre("south-west", 49.0, 8.5),
}
#: A radar that all services use; the others have the name of their region.
SHARED = "shared"
RANGE_MAX_M = 220_000.0
TRACKING = TrackingSettings(reorder_horizon_s=1.0)
_M_PER_DEG = 111_200.0


class Flight(NamedTuple):
    """A straight flight: place at the start, east and north of the corner, m, and velocity."""

    address: int
    east_m: float
    north_m: float
    east_mps: float
    north_mps: float

    def place(self, time_s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return latitude and longitude, degrees, at times after the start, s."""
        north_m = self.north_m + self.north_mps * time_s
        east_m = self.east_m + self.east_mps * time_s
        level = np.cos(np.radians(CORNER[0]))
        return CORNER[0] + north_m / _M_PER_DEG, CORNER[1] + east_m / _M_PER_DEG / level


def flights(count: int, seed: int = 5) -> list[Flight]:
    """Return flights that cross a boundary, one along a boundary, and one across the corner."""
    random = np.random.default_rng(seed)
    found = [Flight(0x4B0000, 0.0, -40e3, 0.0, 260.0), Flight(0x4B0001, -5e3, -5e3, 190.0, 190.0)]
    for number in range(2, count):
        across_m, along_m = random.uniform(2e3, 9e3), random.uniform(10e3, 60e3)
        along_m *= random.choice([-1.0, 1.0])
        speed, slant = random.choice([-1.0, 1.0]) * 240.0, random.uniform(-60.0, 60.0)
        start = (-np.sign(speed) * across_m, along_m, speed, slant)
        turned = (along_m, start[0], slant, speed)
        found.append(Flight(0x4B0000 + number, *(start if number % 2 else turned)))
    return found


def sensors_of(region: str) -> SensorsFile:
    """Return the radar of a region, and the one that all share."""
    sites = {region: CENTRES[region][1:], SHARED: CORNER}
    every = [
        {"id": one, "kind": "radar", "latitude_deg": lat, "longitude_deg": lon, "height_m": 300.0,
         "range_sigma_m": 50.0, "azimuth_sigma_deg": 0.06}
        for one, (lat, lon) in sites.items()
    ]  # fmt: skip
    return SensorsFile(sensor=tuple(Sensor.model_validate(one) for one in every))


def plots(traffic: Iterable[Flight], duration_s: float, seed: int = 7) -> pl.DataFrame:
    """Return the plots of all radars by time, with the Mode S address of every second aircraft."""
    random = np.random.default_rng(seed)
    sites = {name: centre[1:] for name, centre in CENTRES.items()} | {SHARED: CORNER}
    frames = []
    for flight in traffic:
        for place, (name, (lat, lon)) in enumerate(sites.items()):
            phase_s = (0.7 * place + 0.37 * (flight.address % 97)) % SCAN_S
            time_s = np.arange(phase_s, duration_s, SCAN_S)
            latitude, longitude = flight.place(time_s)
            height_m = np.full(len(time_s), 9000.0 + 300.0 * (flight.address % 8))
            range_m, azimuth_rad, _ = slant_range_azimuth(
                (np.radians(lat), np.radians(lon), 300.0),
                np.radians(latitude), np.radians(longitude), height_m,
            )  # fmt: skip
            azimuth_deg = np.degrees(azimuth_rad) + random.normal(0.0, 0.06, len(time_s))
            frames.append(pl.DataFrame({
                "time_s": START_S + np.round(time_s, 3),
                "sensor_id": [name] * len(time_s),
                "kind": ["radar"] * len(time_s),
                "range_m": range_m + random.normal(0.0, 50.0, len(time_s)),
                "azimuth_deg": azimuth_deg % 360.0,
                "height_m": height_m,
                "mode_3a": [f"{flight.address % 4096:04o}"] * len(time_s),
                "mode_s_address": [f"{flight.address:06x}"] * len(time_s),
            }).filter(pl.col("range_m") < RANGE_MAX_M))  # fmt: skip
    whole = pl.concat(frames).with_columns(
        pl.lit(None, kind).alias(name)
        for name, kind in PLAIN_SCHEMA.items()
        if name not in frames[0].columns
    )
    return whole.cast(PLAIN_SCHEMA).select(PLAIN_SCHEMA.names()).sort("time_s", "sensor_id")


class ManualClock:
    """A clock that the scene sets."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        """Return the present time of day, long after the data."""
        return START_S + 10_000_000.0 + self.time_s

    def monotonic_s(self) -> float:
        """Return the time."""
        return self.time_s


class Unit:
    """One service with its region.

    Parameters
    ----------
    name : str
        Its region.
    clock : ManualClock
        Times its messages.
    journal : MemoryJournal, optional
        Continued; else a new one.
    snapshots : SnapshotRules, optional
        Where it has its snapshots; else it has none.
    """

    def __init__(
        self, name: str, clock: ManualClock, journal: MemoryJournal | None = None,
        snapshots: SnapshotRules | None = None,
    ) -> None:  # fmt: skip
        self.name = name
        self.journal = journal or MemoryJournal()
        described = sensors_of(name)
        table = sensor_table(described)
        self.service = Service(
            open_journal=lambda: self.journal, open_engine=lambda: Engine(table, TRACKING),
            sensors=table, tracking=TRACKING, described=described, snapshots=snapshots,
        )  # fmt: skip
        neighbours = [one for one in CENTRES.values() if one.name != name]
        self.board = RegionBoard(Areas(CENTRES[name], neighbours), RegionRules())
        self.service.publication.divide(self.board)
        self.bus = MemoryBus()
        self._handed_over: list[Future[Receipt]] = []
        self.exchange = RegionExchange(
            self, self.service.publication.known, self.board, ZenohOptions(),
            period_s=1.0, open_bus=lambda _: self.bus, clock=clock,
        )  # fmt: skip
        self.events = self.service.view.subscribe(0, 1_000_000)
        self.service.start()
        self.exchange.open()

    def push(self, frame: pl.DataFrame) -> None:
        """Process plots of its radars."""
        own = frame.filter(pl.col("sensor_id").is_in([self.name, SHARED]))
        if len(own):
            self.service.submit(own, source="test").result(WAIT_TIMEOUT_S)

    def hand_over(self, message: bytes, *, source: str) -> Future[Receipt]:
        """Submit the message of a neighbour."""
        self._handed_over.append(self.service.hand_over(message, source=source))
        return self._handed_over[-1]

    def settle(self) -> None:
        """Wait until everything is processed, messages that are not journalled yet, too."""
        while self._handed_over:
            self._handed_over.pop().result(WAIT_TIMEOUT_S)
        self.service.settled().result(WAIT_TIMEOUT_S)

    def tracks(self) -> pl.DataFrame:
        """Return the live tracks with the number by which each is the same in all regions."""
        own = pl.format("{}/{}", "region", "track_id")
        return self.service.view.tracks().with_columns(name=pl.coalesce("continues", own))

    def read(self) -> list[bytes]:
        """Return all events so far."""
        return [one.payload for one in self.events.poll(1_000_000)]

    def stop(self) -> None:
        """Stop the service."""
        self.exchange.stop()
        self.service.stop()


class Scene:
    """Four services and the plots that they get."""

    def __init__(self, count: int, duration_s: float) -> None:
        self.clock = ManualClock()
        self.traffic = flights(count)
        self.duration_s = duration_s
        self._plots = plots(self.traffic, duration_s)
        self.units = {name: Unit(name, self.clock) for name in CENTRES}
        #: Regions whose messages reach no other.
        self.cut: set[str] = set()

    def run(self, until_s: float, look: Callable[[float], None] = lambda _: None) -> None:
        """Process the plots of each second up to a time, and exchange messages after it."""
        while self.clock.time_s < until_s:
            begin_s = START_S + self.clock.time_s
            self.clock.time_s += 1.0
            piece = self._plots.filter(pl.col("time_s").is_between(begin_s, begin_s + 1.0, "left"))
            for unit in self.units.values():
                unit.push(piece)
            self._settle()
            for unit in self.units.values():
                unit.exchange.step()
            for unit in self.units.values():
                self._deliver(unit)
            self._settle()
            look(self.clock.time_s)

    def kill(self, name: str) -> None:
        """End a service; its journal stays."""
        self.units.pop(name).stop()

    def restart(self, name: str, journal: MemoryJournal) -> None:
        """Start a service again."""
        self.units[name] = Unit(name, self.clock, journal)

    def stop(self) -> None:
        """Stop all services."""
        for unit in self.units.values():
            with suppress(Exception):
                unit.stop()

    def _settle(self) -> None:
        for unit in self.units.values():
            unit.settle()

    def _deliver(self, unit: Unit) -> None:
        sent, unit.bus.sent = unit.bus.sent, []
        for message in sent:
            for other in self.units.values():
                if other is not unit and unit.name not in self.cut:
                    other.bus.deliver(Message(message.key, message.payload, JSON))
