"""A service that is killed at any moment loses nothing that it acknowledged."""

import itertools
import os
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from multiradar.runtime.engine.fingerprint import configuration_fingerprint
from multiradar.runtime.live.payload import decode_rows, encode_rows
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.tracking.settings import TrackingSettings
from support.processes.live_process import LiveProcess, live_service
from support.processes.waiting import WAIT_TIMEOUT_S, join
from support.scenarios.live_scene import cut, recording, sensors

#: `TEST_KILLS=1000` for the long run, on several journals.
KILLS = int(os.environ.get("TEST_KILLS", "8"))
KILLS_A_JOURNAL = min(KILLS, 20)
ROWS_A_KILL = 6000
#: Every other process takes snapshots, after so many measurements.
SNAPSHOT_ROWS = 2000
OUTSTANDING_MAX = 12
KILLED = -9


class _Progress:
    """Of one process: room for messages without an answer, whether it is ready, and has ended."""

    def __init__(self) -> None:
        self.room = threading.Semaphore(OUTSTANDING_MAX)
        self.ready, self.over = threading.Event(), threading.Event()


class _Replay:
    """Sends batches in order, each until it is acknowledged, to one process after the other."""

    def __init__(self, batches: list[pl.DataFrame], journal: Path) -> None:
        self._payloads = [encode_rows(batch) for batch in batches]
        self._journal = journal
        self.acknowledged: dict[int, int] = {}
        self.duplicates = 0
        self.failures: list[Exception] = []
        self._processes = 0
        self.sha256 = ""

    @property
    def _first_open(self) -> int:
        return next(n for n in itertools.count() if n not in self.acknowledged)

    def run(self, answers_until_kill: int | None, delay_s: float) -> int:
        """Send what is open; kill after so many answers (the first means that it is ready)."""
        self._processes += 1
        process = LiveProcess(
            self._journal,
            workers=1 + len(self.acknowledged) % 2,
            snapshot_rows=SNAPSHOT_ROWS * (self._processes % 2),
        )
        progress = _Progress()
        reader = threading.Thread(
            target=self._read, args=(process, answers_until_kill, delay_s, progress)
        )
        reader.start()
        if answers_until_kill == 0:
            threading.Timer(delay_s, process.kill).start()
        assert progress.ready.wait(WAIT_TIMEOUT_S)
        try:
            for number in range(self._first_open, len(self._payloads)):
                progress.room.acquire()
                # The pipe may still accept messages: a process that dies closes its files in turn.
                if progress.over.is_set():
                    raise BrokenPipeError
                process.send(str(number), self._payloads[number])
            process.send("end", b"")
        except BrokenPipeError:
            assert answers_until_kill is not None
        join(reader)
        status = process.wait()
        assert self.failures == []
        return status

    def _read(
        self,
        process: LiveProcess,
        answers_until_kill: int | None,
        delay_s: float,
        progress: _Progress,
    ) -> None:
        count = 0
        try:
            while found := process.answers():
                answer = found[0]
                count += 1
                if count == answers_until_kill:
                    threading.Timer(delay_s, process.kill).start()
                if "key" in answer:
                    self.acknowledged[int(answer["key"])] = answer["accepted"]
                    self.duplicates += answer["duplicate"]
                    progress.room.release()
                self.sha256 = answer.get("sha256", "")
                progress.ready.set()
        except Exception as error:
            self.failures.append(error)
            process.kill()
        finally:
            progress.ready.set()
            progress.over.set()
            # A blocked sender goes on.
            for _ in range(OUTSTANDING_MAX):
                progress.room.release()


@pytest.mark.parametrize("campaign", range(KILLS // KILLS_A_JOURNAL))
@pytest.mark.fault(21, 29)
def test_kills_at_random_times_do_not_change_the_output(
    campaign: int, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    kills = KILLS_A_JOURNAL
    random = np.random.default_rng(20260101 + kills + 1000 * campaign)
    frame = recording(kills * ROWS_A_KILL, aircraft=40, step_s=0.02)
    sizes = random.choice([1, 7, 50, 400], kills * ROWS_A_KILL, p=[0.2, 0.3, 0.3, 0.2])
    ends = int(np.searchsorted(np.cumsum(sizes), len(frame)))
    batches = cut(frame, sizes[:ends].tolist())
    path = tmp_path / "journal.db"
    replay = _Replay(batches, path)
    killed = 0
    while killed < kills:
        # One in five during the recovery, the others while it accepts measurements.
        answers = int(random.choice([0, 1, 10, 60, 90]))
        delay_s = float(random.uniform(0.2, 1.5) if answers == 0 else random.exponential(0.01))
        status = replay.run(answers, delay_s)
        assert status in (0, KILLED)
        killed += status == KILLED
        if status == 0:
            break
    assert killed > kills // 2
    # In the report of `--junitxml`.
    record_property("kills", killed)
    assert replay.run(None, 0.0) == 0

    undisturbed = live_service(tmp_path / "undisturbed.db")
    undisturbed.start()
    undisturbed.submit(frame, source="test").result(WAIT_TIMEOUT_S)
    undisturbed.flush(source="test").result(WAIT_TIMEOUT_S)
    undisturbed.settled().result(WAIT_TIMEOUT_S)
    expected = undisturbed.view.status()
    undisturbed.stop()
    assert expected["accepted"] == len(frame)
    assert replay.sha256 == expected["output_sha256"]

    assert replay.acknowledged == {number: len(batch) for number, batch in enumerate(batches)}
    journal = SqliteJournal(path, configuration_fingerprint(sensors(), TrackingSettings()))
    stored = [one.entry for one in journal.read(0) if one.entry.payload]
    journal.close()
    assert [entry.idempotency_key for entry in stored] == [str(n) for n in range(len(batches))]
    assert pl.concat([decode_rows(entry.payload) for entry in stored]).equals(frame)


def test_the_test_resends_accepted_but_unanswered_messages(tmp_path: Path) -> None:
    """Without duplicates the test above would not cover the time between disk and answer."""
    batches = cut(recording(600), [5] * 119)
    replay = _Replay(batches, tmp_path / "journal.db")
    replay.run(30, 0.0)
    # Answers are discarded, as by a sender that is killed too.
    replay.acknowledged.clear()
    assert replay.run(None, 0.0) == 0
    assert replay.duplicates >= 28
    assert replay.acknowledged == {number: len(batch) for number, batch in enumerate(batches)}
