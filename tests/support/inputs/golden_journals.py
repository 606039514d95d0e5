"""The state of a service with a few measurements, as a version of it writes them.

`python -m support.inputs.golden_journals VERSION` in `tests` writes it to `golden/journals`: its
files as one compressed archive, and what a later version must find in them.
"""

import hashlib
import io
import json
import math
import sys
import tarfile
import tempfile
from pathlib import Path
from typing import Any

import polars as pl

from multiradar import wire
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.engine.fingerprint import OUTPUT_RULES, configuration_fingerprint
from multiradar.runtime.live.service import Service
from multiradar.runtime.live.snapshots import SnapshotRules
from multiradar.storage.backup import DATABASE
from multiradar.storage.snapshots import SnapshotFolder
from multiradar.storage.sqlite.journal_rows import FORMAT_VERSION
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.storage.verification import verify_journal
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.settings import TrackingSettings
from multiradar_compiled.arithmetic_kernels import arithmetic
from multiradar_schemas.sensors.sensor import SensorsFile
from support.paths import ROOT
from support.processes.live_services import settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import cut, recording, sensors_file

GOLDEN = ROOT / "tests" / "golden" / "journals"
ARCHIVE, METADATA = "state.tar.xz", "metadata.json"
_AIRCRAFT = 6
#: Measurements before each change of a sensor, and after the last one.
_PARTS = (120, 60, 60, 60)
#: A third radar, and a site of the second one.
_CHANGES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("41-15", {"kind": "radar", "latitude_deg": 50.2, "longitude_deg": 14.2, "height_m": 300.0}),
    ("41-20", {"latitude_deg": 49.2001, "range_sigma_m": 60.0}),
)


def service(state: Path, sensors: SensorsFile) -> Service:
    """Return a service on the journal of a state; not started."""
    table, tracking = wire.sensor_table(sensors), TrackingSettings()
    fingerprint = configuration_fingerprint(table, tracking)
    journal = state / DATABASE
    return Service(
        open_journal=lambda: SqliteJournal(journal, fingerprint),
        open_engine=lambda: Engine(table, tracking, sampling=Sampling.DRAWN),
        sensors=table,
        tracking=tracking,
        snapshots=SnapshotRules(SnapshotFolder(journal), math.inf, 2**31, fingerprint),
        described=sensors,
    )


def figures(running: Service) -> dict[str, Any]:
    """Return what a service has made of its journal, when everything is processed."""
    status = settled(running)
    names = ("journal_sequence", "accepted", "rejected", "output_sha256", "output_sequence")
    return {name: status[name] for name in names}


def write(state: Path, sensors: SensorsFile) -> dict[str, Any]:
    """Write measurements, rejected ones, changes of sensors and the end of a stream."""
    running = service(state, sensors)
    running.start()
    first, *parts, last = cut(recording(sum(_PARTS), aircraft=_AIRCRAFT), list(_PARTS))
    submit(running, first, "first")
    for part, (sensor_id, values) in zip(parts, _CHANGES, strict=True):
        known = running.describe_sensor(sensor_id) or {}
        plan = running.plan_sensor(sensor_id, known | values)
        running.change_sensor(plan.change, source="operator").result(WAIT_TIMEOUT_S)
        unknown = pl.when(pl.int_range(pl.len()) < 3).then(pl.lit("99-99")).otherwise("sensor_id")
        submit(running, part.with_columns(sensor_id=unknown), f"after {sensor_id}")
    running.stop()
    running = service(state, sensors)
    running.start()
    submit(running, last, "last")
    running.flush(source="operator", force=True).result(WAIT_TIMEOUT_S)
    found = figures(running)
    running.stop()
    # Without the last one, so that a start has entries after a snapshot, too.
    snapshots = SnapshotFolder(state / DATABASE)
    snapshots.reject(snapshots.files()[0])
    snapshots.tidy()
    return found


def unpack(folder: Path, state: Path) -> dict[str, Any]:
    """Unpack a state that a version has written, and return what is known of it."""
    metadata: dict[str, Any] = json.loads((folder / METADATA).read_text(encoding="utf-8"))
    octets = (folder / ARCHIVE).read_bytes()
    assert hashlib.sha256(octets).hexdigest() == metadata["sha256"], folder
    with tarfile.open(fileobj=io.BytesIO(octets), mode="r:xz") as archive:
        # Python before 3.11.4 knows no filter; the archive is the project's own.
        archive.extraction_filter = getattr(tarfile, "data_filter", None)
        archive.extractall(state)
    return metadata


def main(version: str) -> None:
    """Write the state of this version."""
    sensors = sensors_file()
    folder = GOLDEN / version
    folder.mkdir()
    with tempfile.TemporaryDirectory() as name:
        state = Path(name)
        found = write(state, sensors)
        verified = verify_journal(state / DATABASE)
        with tarfile.open(folder / ARCHIVE, "w:xz") as archive:
            for path in sorted(state.iterdir()):
                archive.add(path, path.name)
    metadata = {
        "version": version,
        "format": FORMAT_VERSION,
        "rules": OUTPUT_RULES,
        "arithmetic": arithmetic(),
        "sha256": hashlib.sha256((folder / ARCHIVE).read_bytes()).hexdigest(),
        "digest": verified.digest,
        "figures": found,
        "sensor": [one.model_dump(mode="json", exclude_unset=True) for one in sensors.sensor],
    }
    (folder / METADATA).write_text(json.dumps(metadata, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
