"""`/readyz` and `/healthz` of a service that cannot write, is behind, rejects all, or is stuck."""

import re
import threading
from collections.abc import Iterator
from typing import Any

import httpx
import polars as pl
import pytest

from multiradar.api.factory import create_api
from multiradar.clock import FixedClock
from multiradar.errors import JournalError, JournalFullError, MultiradarError, PipelineError
from multiradar.runtime.live.readiness import (
    CODES,
    IS_STANDBY,
    RECENT_S,
    REJECTED_ROWS_MIN,
    Disk,
    Reason,
    ServiceState,
    require_running,
    state_reason,
)
from multiradar.runtime.live.service import Service
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.journal import Space
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.settings import TrackingSettings
from support.fakes.fake_engine import FakeEngine
from support.paths import ROOT
from support.processes.live_services import TABLE, FailingJournal, settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import START_S, recording

_LIMITS = RuntimeLimits()
_MINUTE_S = RECENT_S + 5.0


class _Scene:
    """A service that is up to date, and the answers to its probes."""

    def __init__(self, journal: MemoryJournal) -> None:
        self.clock = FixedClock(START_S + 1e6)
        self.gate, self.entered = threading.Event(), threading.Event()
        self.gate.set()
        self.failures: list[str] = []
        self.service = Service(
            open_journal=lambda: journal,
            open_engine=lambda: FakeEngine(self._wait),
            sensors=TABLE,
            tracking=TrackingSettings(),
            limits=_LIMITS,
            clock=self.clock,
            on_failure=lambda: self.failures.append(str(self.service.failure)),
        )
        self.service.start()
        submit(self.service, recording(40))
        settled(self.service)

    def _wait(self, _batch: MeasurementBatch) -> None:
        self.entered.set()
        self.gate.wait(WAIT_TIMEOUT_S)

    async def ask(self, path: str) -> tuple[int, list[str], str]:
        """Return the status of a probe, the codes of its reasons, and the detail."""
        transport = httpx.ASGITransport(create_api(self.service))
        async with httpx.AsyncClient(transport=transport, base_url="http://test") as client:
            answer = await client.get(path)
        document: dict[str, Any] = answer.json()
        codes = [one["code"] for one in document.get("reasons", ())]
        return answer.status_code, codes or [document.get("code", "")], document.get("detail", "")


_READY = (200, [""], "")


@pytest.fixture
def journal() -> FailingJournal:
    return FailingJournal(JournalFullError("disk full"))


@pytest.fixture
def scene(journal: FailingJournal) -> Iterator[_Scene]:
    scene = _Scene(journal)
    yield scene
    scene.gate.set()
    scene.service.stop()


@pytest.mark.fault(24)
async def test_a_service_with_a_full_disk_is_not_ready(
    scene: _Scene, journal: FailingJournal
) -> None:
    assert await scene.ask("/readyz") == _READY
    journal.failing = True
    with pytest.raises(JournalFullError):
        submit(scene.service, recording(10))
    assert (await scene.ask("/readyz"))[:2] == (503, ["JOURNAL_FULL"])
    assert await scene.ask("/healthz") == _READY
    journal.failing = False
    submit(scene.service, recording(10))
    assert await scene.ask("/readyz") == _READY


async def test_a_full_disk_counts_for_a_minute_so_that_senders_try_again(
    scene: _Scene, journal: FailingJournal
) -> None:
    """A load balancer sends nothing to a service that is not ready: it would never be again."""
    journal.failing = True
    with pytest.raises(JournalFullError):
        submit(scene.service, recording(10))
    scene.clock.advance(RECENT_S + 1.0)
    assert await scene.ask("/readyz") == _READY


@pytest.mark.parametrize(("missing_bytes", "code"), [(1, "JOURNAL_FULL"), (0, "")])
async def test_little_space_is_a_reason(
    scene: _Scene, journal: FailingJournal, missing_bytes: int, code: str
) -> None:
    free = _LIMITS.disk_free_bytes_min - missing_bytes
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(journal, "space", lambda: Space(free, 2 * free, 10))
        assert (await scene.ask("/readyz"))[1] == [code]


@pytest.mark.parametrize(
    ("free_bytes", "alarms"),
    [
        (201, []),
        (200, ["disk_filling"]),
        (101, ["disk_filling"]),
        (100, ["disk_filling", "disk_nearly_full"]),
        (0, ["disk_filling", "disk_nearly_full"]),
    ],
)
def test_a_disk_that_fills_up_raises_alarms_and_reads_go_on(
    scene: _Scene, journal: FailingJournal, free_bytes: int, alarms: list[str],
    caplog: pytest.LogCaptureFixture,
) -> None:  # fmt: skip
    unit = 2**30
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(journal, "space", lambda: Space(free_bytes * unit, 1000 * unit, 10))
        journal.failing = not free_bytes
        if journal.failing:
            with pytest.raises(JournalFullError):
                submit(scene.service, recording(10))
        status = scene.service.view.status()
        scene.service.view.status()
    assert status["alarms"] == alarms
    said = [one for one in status["warnings"] if "disk" in one]
    percent = 100 - free_bytes // 10
    left = f"{free_bytes}.0 GiB" if free_bytes else "0 MiB"
    expected = f"the journal disk is {percent}% full ({left} left)"
    assert [one.startswith(expected) for one in said] == [True] * bool(alarms)
    # Once for each alarm, not at each reading.
    assert caplog.text.count("the journal disk is") == bool(alarms)
    assert scene.service.view.status()["alarms"] == []


def test_the_shares_of_the_disk_are_settings() -> None:
    limits = RuntimeLimits(disk_filling_share=0.5, disk_nearly_full_share=1.0)
    disk = Disk(lambda: Space(0, 10, 10), limits, FixedClock())
    assert disk.alarms()[0] == ["disk_filling", "disk_nearly_full"]
    disk = Disk(lambda: Space(1, 10, 10), limits, FixedClock())
    assert disk.alarms()[0] == ["disk_filling"]
    assert Disk(lambda: None, limits, FixedClock()).alarms() == ([], [])
    disk = Disk(lambda: Space(50 << 20, 1250 << 20, 10), limits, FixedClock(), "history")
    assert disk.alarms()[1][0].startswith("the history disk is 96% full (50 MiB left)")


@pytest.mark.slow
async def test_a_service_that_is_behind_is_not_ready(scene: _Scene) -> None:
    scene.gate.clear()
    scene.entered.clear()
    submit(scene.service, recording(20))
    assert scene.entered.wait(WAIT_TIMEOUT_S)
    submit(scene.service, recording(20))
    scene.clock.advance(_LIMITS.lag_max_s)
    assert await scene.ask("/readyz") == _READY
    scene.clock.advance(1.0)
    status, codes, detail = await scene.ask("/readyz")
    assert (status, codes) == (503, ["LAG"])
    assert "processor was received 11 s ago (limit 10 s)" in detail
    assert scene.service.view.status()["lags_s"] == {
        "intake": 0.0, "journal": 0.0, "processor": 11.0,
    }  # fmt: skip
    # It may still finish.
    assert await scene.ask("/healthz") == _READY
    scene.clock.advance(_LIMITS.stall_max_s)
    status, codes, detail = await scene.ask("/healthz")
    assert (status, codes) == (503, ["STALLED"])
    assert detail == "the engine has made no progress for 71 s (limit 60 s)"
    scene.gate.set()
    settled(scene.service)
    assert await scene.ask("/readyz") == _READY
    assert await scene.ask("/healthz") == _READY


async def test_a_service_that_rejects_all_rows_is_not_ready(scene: _Scene) -> None:
    scene.clock.advance(_MINUTE_S)
    unknown = recording(REJECTED_ROWS_MIN).with_columns(sensor_id=pl.lit("99-9"))
    submit(scene.service, unknown[1:])
    assert await scene.ask("/readyz") == _READY
    submit(scene.service, unknown[:1])
    status, codes, detail = await scene.ask("/readyz")
    assert (status, codes) == (503, ["ALL_REJECTED"])
    assert f"all {REJECTED_ROWS_MIN} measurements" in detail
    assert f"{REJECTED_ROWS_MIN} of them as UNKNOWN_SENSOR" in detail
    assert await scene.ask("/healthz") == _READY
    submit(scene.service, recording(1))
    assert await scene.ask("/readyz") == _READY


async def test_rejected_rows_count_for_a_minute(scene: _Scene) -> None:
    scene.clock.advance(_MINUTE_S)
    submit(scene.service, recording(40).with_columns(sensor_id=pl.lit("99-9")))
    assert (await scene.ask("/readyz"))[1] == ["ALL_REJECTED"]
    settled(scene.service)
    scene.clock.advance(_MINUTE_S)
    assert await scene.ask("/readyz") == _READY


@pytest.mark.fault(25)
async def test_after_an_input_output_error_the_process_is_to_end() -> None:
    journal = FailingJournal(JournalError("disk I/O error"))
    scene = _Scene(journal)
    assert scene.failures == []
    journal.failing = True
    with pytest.raises(JournalError):
        submit(scene.service, recording(10))
    scene.service.stop()
    assert scene.failures == ["disk I/O error"]
    assert (await scene.ask("/readyz"))[:2] == (503, ["JOURNAL_FAILED"])
    assert (await scene.ask("/healthz"))[:2] == (503, ["STALLED"])


@pytest.mark.parametrize(
    ("failure", "state", "step", "expected"),
    [
        (None, "running", "", None),
        (None, "recovering", "compiling", ("NOT_READY", "the service is starting: compiling")),
        (None, "stopped", "", ("NOT_READY", "the service is stopped")),
        (None, "standby", "", ("STANDBY", IS_STANDBY)),
        (PipelineError("x"), "running", "", ("NOT_READY", "the engine has stopped; see the log")),
        (
            JournalError("/x: full"), "failed", "",
            ("JOURNAL_FAILED", "the journal cannot be read or written; see the log"),
        ),
    ],
)  # fmt: skip
def test_what_accepts_no_measurements_has_a_code_and_a_reason(
    failure: MultiradarError | None, state: str, step: str, expected: tuple[str, str] | None
) -> None:
    found = state_reason(failure, ServiceState(state), step)
    assert (None if found is None else (found.code, found.text)) == expected


def test_measurements_that_arrive_during_the_start_get_its_step() -> None:
    """Regression: a service that compiled its kernels was said to be stopped."""
    with pytest.raises(PipelineError, match="the service is starting: compiling; retry later"):
        require_running(ServiceState("stopped"), None, "compiling")
    with pytest.raises(PipelineError, match="the service is not running: stopped"):
        require_running(ServiceState("stopped"), None)


async def test_the_documented_proxy_of_feeds_uses_each_service_that_accepts(
    scene: _Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (ROOT / "docs/howto/standby.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"^    http-check expect ! rstring (\S+)$", text, re.M)
    transport = httpx.ASGITransport(create_api(scene.service))
    excluded = []
    async with httpx.AsyncClient(transport=transport, base_url="http://test") as client:
        assert not re.search(example, (await client.get("/readyz")).text)
        for code in CODES:
            monkeypatch.setattr(scene.service, "unready_checks", [lambda c=code: Reason(c, "why")])
            if re.search(example, (await client.get("/readyz")).text):
                excluded.append(code)
    assert excluded == ["NOT_READY", "STANDBY", "JOURNAL_FAILED"]
    manual = (ROOT / "docs/howto/operations.md").read_text(encoding="utf-8")
    assert f"grep -qvE '{example}'" in manual
