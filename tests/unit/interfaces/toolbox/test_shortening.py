"""`shorten` uses the snapshots from which a service with the same settings starts."""

from pathlib import Path

import numpy as np
import pytest

from multiradar.ingest.zenoh.handovers import region_exchange
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live import snapshots
from multiradar.runtime.live.processor import Processor
from multiradar.runtime.live.publication import Publication
from multiradar.runtime.live.service import Service
from multiradar.settings.access import AccessSettings
from multiradar.settings.service import load_settings
from multiradar.state import EncodedState
from multiradar.storage.snapshots import Position, Snapshot, SnapshotFolder
from multiradar.storage.sqlite.shortening import digests_of
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.toolbox.operation.shortening import _snapshots
from support.fakes.fake_engine import FakeEngine
from support.inputs.journal_entries import entry
from support.scenarios.live_scene import sensors

FINGERPRINT = "a" * 64
REGION = """
[region]
name = "west"
latitude_deg = 49.0
longitude_deg = 8.0

[[region.neighbours]]
name = "east"
latitude_deg = 49.0
longitude_deg = 14.0
"""


@pytest.mark.parametrize("text", ["", REGION])
def test_snapshots_of_a_service_with_and_without_regions_are_used(
    text: str, tmp_path: Path
) -> None:
    config = tmp_path / "service.toml"
    config.write_text(text)
    settings, path = load_settings(config), tmp_path / "journal.sqlite"
    journal = SqliteJournal(path, FINGERPRINT)
    journal.append([entry(number) for number in range(10)])
    service = Service(
        open_journal=lambda: journal, open_engine=FakeEngine, sensors=sensors(),
        tracking=settings.tracking_settings(), limits=settings.runtime_limits(),
    )  # fmt: skip
    region_exchange(service, settings, AccessSettings())
    parts = {name: type(one) for name, one in service.publication.parts.items()}
    assert set(parts) == ({"regions"} if text else set())
    kinds = {"processor": Processor, "engine": Engine, "publication": Publication, **parts}
    key = snapshots._key(snapshots._given_key(FINGERPRINT, settings.runtime_limits()), (), kinds)
    journal.close()
    folder, expected = SnapshotFolder(path), []
    for position in [Position(one, digest) for one, digest in digests_of(path, [5, 9]).items()]:
        rows = {"history": [folder.write_rows("history", 0, np.zeros(position.sequence))]}
        folder.write(Snapshot(position, key, {"x": EncodedState({}, [np.zeros(1)])}, rows))
        expected.append(position)
    assert _snapshots(path, FINGERPRINT, settings) == expected[::-1]
