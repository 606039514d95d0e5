"""A storm of new identities delays the output of the other radars little, in virtual time.

Each row that is written or processed takes time of the machine, and nothing else does. The threads
of the service run one at a time, as on a machine of one core.
"""

import random
from collections import Counter, deque
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.receipt import Receipt
from multiradar.runtime.live.service import Service
from multiradar.storage.entries import Entry
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from support.processes.live_services import TABLE
from support.scenarios.live_scene import START_S, recording
from support.simulation.scheduler import Scheduler, VirtualClock

#: The radar of the storm, its rows per second, and when they come, s.
STORM, RATE, FROM_S, TO_S = "41-10", 25_000, 2.0, 4.0
#: Time of the machine for a row of the engine and of the journal, s: more than twice as much as a
#: whole measurement takes with 104 radars (`python -m validation.service.check_world`).
ENGINE_ROW_S, JOURNAL_ROW_S = 100e-6, 10e-6
#: Messages of each sender per second.
MESSAGES_PER_S = 10
#: Maximum delay of the other radars, s.
LATE_MAX_S = 2.0
PLOTS_MAX = 2000
#: Two radars with scans of 4 s, and ADS-B.
SENSORS = replace(
    TABLE,
    rotation_period_s=np.array([4.0, 4.0, np.nan]),
    plots_per_scan_max=np.full(len(TABLE), float(PLOTS_MAX)),
)
SETTINGS = TrackingSettings(reorder_horizon_s=1.0)


class _SlowJournal(MemoryJournal):
    """Takes its time for each row."""

    def __init__(self, clock: VirtualClock) -> None:
        super().__init__()
        self._clock = clock

    def append(self, entries: Sequence[Entry]) -> list[int]:
        rows = sum(one.accepted + len(one.rejects) for one in entries)
        self._clock.elapsed_s += JOURNAL_ROW_S * rows
        return super().append(entries)


class _SlowEngine(Engine):
    """Takes its time for each row, and notes how late those of the other sensors are."""

    def __init__(self, clock: VirtualClock) -> None:
        super().__init__(SENSORS, SETTINGS)
        self._clock = clock
        self.late_s: list[float] = []

    def push(self, batch: MeasurementBatch, clock_s: float | None = None) -> EngineOutput:
        self._clock.elapsed_s += ENGINE_ROW_S * len(batch)
        others = batch.time_s[batch.sensor != SENSORS.ids.index(STORM)]
        self.late_s += (self._clock.true_s - others).tolist()
        return super().push(batch, clock_s)


def _storm() -> pl.DataFrame:
    times = START_S + np.arange(FROM_S, TO_S, 1.0 / RATE)
    chance = np.random.default_rng(1)
    return pl.DataFrame(
        {
            "time_s": times,
            "sensor_id": [STORM] * len(times),
            "kind": ["radar"] * len(times),
            "range_m": chance.uniform(1e4, 2e5, len(times)),
            "azimuth_deg": chance.uniform(0.0, 360.0, len(times)),
            "height_m": chance.uniform(2e3, 9e3, len(times)),
            "mode_s_address": [f"{number:06x}" for number in range(len(times))],
        }
    )


def _messages(frame: pl.DataFrame, source: str) -> list[tuple[float, str, pl.DataFrame]]:
    """Return when each message is sent, s, its sender and its rows."""
    number = ((frame["time_s"] - START_S) * MESSAGES_PER_S).cast(pl.Int64).alias("number")
    parts = frame.with_columns(number).partition_by("number", as_dict=True, include_key=False)
    return [((int(key[0]) + 1) / MESSAGES_PER_S, source, rows) for key, rows in parts.items()]


@pytest.mark.fault(17)
def test_the_other_radars_are_late_by_less_than_two_seconds() -> None:
    clock = VirtualClock(START_S)
    scheduler = Scheduler(random.Random(1), clock)
    engine = _SlowEngine(clock)
    service = Service(
        open_journal=lambda: _SlowJournal(clock),
        open_engine=lambda: engine,
        sensors=SENSORS,
        tracking=SETTINGS,
        clock=clock,
        threads=scheduler,
    )
    service.start()
    frame = recording(120).sort("time_s")
    sent = [*_messages(_storm(), "storm")]
    for sensor in SENSORS.ids:
        sent += _messages(frame.filter(pl.col("sensor_id") == sensor), sensor)
    waiting = deque(sorted(sent, key=lambda one: one[:2]))
    receipts: dict[str, list[Future[Receipt]]] = {}
    while waiting:
        while waiting and waiting[0][0] <= clock.elapsed_s:
            _, source, rows = waiting.popleft()
            receipts.setdefault(source, []).append(service.submit(rows, source=source))
        if not scheduler.step() and waiting:
            clock.elapsed_s = waiting[0][0]
    scheduler.settle()
    # Tentative tracks live longer than the storm.
    tracks = len(engine.tracks())
    service.stop()
    assert len(engine.late_s) == len(frame.filter(pl.col("sensor_id") != STORM))
    assert max(engine.late_s) < LATE_MAX_S
    assert PLOTS_MAX <= tracks < PLOTS_MAX + 50
    rejected = {
        source: Counter(row.code for one in pending for row in one.result().rejected)
        for source, pending in receipts.items()
    }
    assert rejected.pop("storm")["RATE_EXCEEDED"] > 0.7 * RATE * (TO_S - FROM_S)
    assert not any(rejected[sensor] for sensor in SENSORS.ids if sensor != STORM)
