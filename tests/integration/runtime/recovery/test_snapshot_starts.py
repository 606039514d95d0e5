"""The real service, started from snapshots at several points: the bytes of the whole journal."""

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from multiradar.errors import JournalError
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.engine.fingerprint import configuration_fingerprint
from multiradar.runtime.live.service import Service
from multiradar.runtime.live.snapshots import SnapshotRules
from multiradar.state import copied_state, encoded_state
from multiradar.storage.snapshots import SnapshotFolder
from multiradar.storage.sqlite import opening
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.settings import TrackingSettings
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.scenarios.live_scene import cut, recording, sensors

FRAME = recording(1500, step_s=0.05)
TABLE, TRACKING = sensors(), TrackingSettings()
FINGERPRINT = configuration_fingerprint(TABLE, TRACKING)


def _service(journal: Path, *, snapshots: bool = True) -> Service:
    rules = SnapshotRules(SnapshotFolder(journal), 1e9, 1, FINGERPRINT)
    return Service(
        open_journal=lambda: SqliteJournal(journal, FINGERPRINT),
        open_engine=lambda: Engine(TABLE, TRACKING, sampling=Sampling.ALL),
        sensors=TABLE,
        tracking=TRACKING,
        snapshots=rules if snapshots else None,
    )


def _known(service: Service) -> dict[str, Any]:
    """Return what the service has published, and the state behind it, octet by octet."""
    service.settled().result(WAIT_TIMEOUT_S)
    reader = service.view.subscribe(0, 10**6)
    events = []
    while part := reader.poll(1000):
        events += part
    reader.close()
    processor: Any = service._processor
    arrays: list[Any] = []
    documents = [
        encoded_state(copied_state(one), arrays).document for one in processor._holders.values()
    ]
    logs = service.publication.logs
    rows = {
        name: log.rows(max(log.appended - log.capacity, 0), log.appended)
        for name, log in logs.items()
    }
    return {
        "events": events, "documents": documents, "output": processor._digest.hexdigest(),
        "arrays": [(str(one.dtype), one.shape, one.tobytes()) for one in arrays],
        "rows": {name: (one.dtype, one.tobytes()) for name, one in rows.items()},
    }  # fmt: skip


def test_starts_at_several_points_give_the_same_bytes(tmp_path: Path) -> None:
    journal = tmp_path / "journal.sqlite"
    folder = SnapshotFolder(journal)
    sizes = np.random.default_rng(1).integers(30, 200, 6).tolist()
    pieces = iter(cut(FRAME, sizes))
    # Each start uses the snapshot before the last, and the rest of the journal.
    for number in range(3):
        service = _service(journal)
        service.start()
        for _ in range(2):
            service.submit(next(pieces), source="test").result(WAIT_TIMEOUT_S)
        service.stop()
        if number:
            folder.files()[0].unlink()
    from_snapshot, whole = _service(journal), _service(journal, snapshots=False)
    from_snapshot.start()
    from_snapshot.submit(next(pieces), source="test").result(WAIT_TIMEOUT_S)
    from_snapshot.flush(source="test").result(WAIT_TIMEOUT_S)
    restarted = _known(from_snapshot)
    from_snapshot.stop()
    whole.start()
    expected = _known(whole)
    whole.stop()
    again = _service(journal)
    again.start()
    assert _known(again) == expected
    again.stop()
    # The delay of the data, in the payload of live events, is that of the machine.
    assert [one.key for one in restarted.pop("events")] == [
        one.key for one in expected.pop("events")
    ]
    assert restarted == expected


def test_the_pages_of_a_large_journal_are_verified_beside_the_service(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = tmp_path / "journal.sqlite"
    folder = SnapshotFolder(journal)
    service = _service(journal)
    service.start()
    for number, piece in enumerate(cut(FRAME, [100, 100])):
        service.submit(piece, source="test", idempotency_key=f"key {number}").result(WAIT_TIMEOUT_S)
    service.stop()
    _exchange_keys(journal)
    with pytest.raises(JournalError, match="damaged: "):
        _service(journal).start()
    # None is large: all are.
    monkeypatch.setattr(opening, "_AT_ONCE_BYTES", 0)
    with pytest.raises(JournalError, match="damaged: "):
        _service(journal, snapshots=False).start()
    assert folder.files()
    service = _service(journal)
    service.start()
    wait_until(lambda: service.failure is not None, "the damage is found")
    assert "damaged: " in str(service.failure)
    service.stop()
    # The next start reads everything first.
    assert not folder.files()


# Entries as they were, but in the index of keys those of other entries.
def _exchange_keys(journal: Path) -> None:
    with closing(sqlite3.connect(journal)) as connection:
        root = connection.execute(
            "SELECT rootpage FROM sqlite_master WHERE name = 'sqlite_autoindex_entry_1'"
        ).fetchone()[0]
        size = connection.execute("PRAGMA page_size").fetchone()[0]
    content = bytearray(journal.read_bytes())
    page = slice((root - 1) * size, root * size)
    first, second, other = b"key 0", b"key 1", b"key ?"
    for old, new in ((first, other), (second, first), (other, second)):
        content[page] = content[page].replace(old, new)
    journal.write_bytes(content)
