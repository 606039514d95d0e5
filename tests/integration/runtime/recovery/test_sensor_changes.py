"""Sensors change while the service runs: restarts from everywhere give the bytes of one run."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.engine.fingerprint import configuration_fingerprint
from multiradar.runtime.live.service import Service
from multiradar.runtime.live.snapshots import SnapshotRules
from multiradar.runtime.stream.events import Event
from multiradar.storage.snapshots import SnapshotFolder
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.settings import TrackingSettings
from support.processes.live_services import settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import cut, recording, sensors, sensors_file

FRAME = recording(1400, step_s=0.05)
TABLE = sensors()
#: A third radar, at the place of the first one.
NEW = "41-15"

# Changes before the parts of the recording, after the first.
CHANGES: list[tuple[str, dict[str, Any], bool]] = [
    ("41-20", {"enabled": False}, False),
    ("41-20", {"enabled": True, "range_sigma_m": 80.0}, False),
    (NEW, {"kind": "radar", "latitude_deg": 50.0, "longitude_deg": 14.0, "height_m": 400.0}, False),
    ("41-10", {"latitude_deg": 50.0001}, False),
    ("41-10", {}, True),
]


class Run:
    """A service on one journal, with or without snapshots."""

    def __init__(self, journal: Path, tracking: TrackingSettings, *, snapshots: bool) -> None:
        fingerprint = configuration_fingerprint(TABLE, tracking)
        rules = SnapshotRules(SnapshotFolder(journal), 1e9, 1, fingerprint)
        self.service = Service(
            open_journal=lambda: SqliteJournal(journal, fingerprint),
            open_engine=lambda: Engine(TABLE, tracking, sampling=Sampling.ALL),
            sensors=TABLE,
            tracking=tracking,
            snapshots=rules if snapshots else None,
            described=sensors_file(),
        )
        self.service.start()

    def change(self, sensor_id: str, values: dict[str, Any], *, reset: bool) -> None:
        """Change some fields of a sensor."""
        known = self.service.describe_sensor(sensor_id) or {}
        plan = self.service.plan_sensor(sensor_id, known | values, reset_biases=reset)
        future = self.service.change_sensor(plan.change, source="operator")
        future.result(WAIT_TIMEOUT_S)

    @property
    def restored(self) -> int:
        """The journal entry up to which a snapshot was used."""
        processor: Any = self.service._processor
        sequence: int = processor._snapshots._restored.sequence
        return sequence

    def known(self) -> dict[str, Any]:
        """Return what readers see."""
        status = settled(self.service)
        names = (
            "output_sha256",
            "output_sequence",
            "sensor_changes",
            "data_time_s",
            "engine",
            "tracks",
            "accepted",
        )
        reader = self.service.view.subscribe(0, 10**6)
        events = []
        while part := reader.poll(1000):
            events += [(one.kind, one.key, _change(one)) for one in part]
        reader.close()
        return {
            **{name: status[name] for name in names},
            "events": events,
            "sensors": self.service.view.sensors(),
            "given": [self.service.describe_sensor(one) for one in ("41-10", NEW, "41-20")],
            "tracks table": self.service.view.tracks().to_dicts(),
        }


def _change(event: Event) -> dict[str, Any]:
    """The payload of a change of a sensor, without the delay of the machine."""
    if event.kind != "sensor":
        return {}
    payload: dict[str, Any] = json.loads(event.payload)
    return payload | {"data_delay_s": None}


def _parts() -> Iterator[pl.DataFrame]:
    """The recording in parts; the third radar has its plots from the second part on."""
    for number, part in enumerate(cut(FRAME, [230] * 5)):
        own = pl.col("sensor_id").eq("41-10") & pl.col("track_number").mod(2).eq(0)
        yield (
            part
            if number < 1
            else part.with_columns(sensor_id=pl.when(own).then(pl.lit(NEW)).otherwise("sensor_id"))
        )


def _play(run: Run, until: int, begin: int = 0) -> list[list[str]]:
    """Send the parts begin…until, each after its change; return the codes of rejected rows."""
    rejected = []
    for number, part in list(enumerate(_parts()))[begin:until]:
        if number:
            sensor_id, values, reset = CHANGES[number - 1]
            run.change(sensor_id, values, reset=reset)
        rejected.append([row.code for row in submit(run.service, part).rejected])
    return rejected


@pytest.mark.parametrize("name", ["imm", "two-stage", "joint"])
def test_restarts_after_each_change_give_the_same_bytes(tmp_path: Path, name: str) -> None:
    tracking = TrackingSettings(filter_name=name)
    whole = Run(tmp_path / "whole", tracking, snapshots=False)
    rejected = _play(whole, 6)
    expected = whole.known()
    whole.service.stop()
    # Rows of a disabled radar are rejected and counted, and of the third one until it is known.
    assert set(rejected[1]) == {"SENSOR_DISABLED", "UNKNOWN_SENSOR"}
    assert set(rejected[2]) == {"UNKNOWN_SENSOR"}
    assert not any(rejected[:1] + rejected[3:])
    ids = [one["id"] for one in expected["sensors"]]
    assert sorted(ids) == ids
    assert {one["id"]: one["updates"] for one in expected["sensors"]}[NEW] > 20
    changed = [key for kind, key, _ in expected["events"] if kind == "sensor"]
    assert changed == [sensor_id for sensor_id, _, _ in CHANGES]
    # The whole journal again.
    again = Run(tmp_path / "whole", tracking, snapshots=False)
    assert again.known() == expected
    again.service.stop()
    # A restart after each part, from the snapshot at its end or the one before.
    journal = tmp_path / "restarted"
    for number in range(6):
        run = Run(journal, tracking, snapshots=True)
        # The snapshot has the sensors in force.
        assert (run.restored > 0) == (number > 0)
        _play(run, number + 1, number)
        run.service.stop()
        if number in (2, 4):
            SnapshotFolder(journal).files()[0].unlink()
    run = Run(journal, tracking, snapshots=True)
    assert run.known() == expected
    run.service.stop()
