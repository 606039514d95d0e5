"""A sensor with a wrong clock in the running service: named, and of no effect on the others."""

import numpy as np
import polars as pl
import pytest

from multiradar.clock import FixedClock
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.service import Service
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.settings import TrackingSettings
from support.processes.live_services import TABLE, settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import START_S, recording

WRONG = "41-20"


def _service(journal: MemoryJournal, clock: FixedClock | None) -> Service:
    service = Service(
        open_journal=lambda: journal,
        open_engine=lambda: Engine(TABLE, TrackingSettings()),
        sensors=TABLE,
        tracking=TrackingSettings(),
        clock=clock,
    )
    service.start()
    return service


def _wrong(rows: int, offset_s: float) -> pl.DataFrame:
    wrong = pl.col("sensor_id") == WRONG
    return recording(rows).with_columns(
        time_s=pl.col("time_s") + pl.when(wrong).then(offset_s).otherwise(0.0)
    )


@pytest.mark.slow
@pytest.mark.parametrize("offset_s", [10.0, -60.0])
@pytest.mark.parametrize("live", [True, False])
def test_it_is_named_and_costs_the_others_nothing(offset_s: float, live: bool) -> None:
    clock = FixedClock(START_S + 0.2) if live else None
    service = _service(MemoryJournal(), clock)
    try:
        frame, rejected = _wrong(400, offset_s), []
        for first in range(0, len(frame), 5):
            part = frame[first : first + 5]
            receipt = submit(service, part)
            rejected += [part["sensor_id"][row.index] for row in receipt.rejected]
            if clock is not None:
                clock.advance(0.25)
        assert set(rejected) == {WRONG}
        assert len(rejected) > 100
        status = settled(service)
        assert status["sensor_alarms"][WRONG][-1:] == ["clock"]  # type: ignore[index]
        (sentence,) = [one for one in status["warnings"] if "sensor clock" in one]  # type: ignore[attr-defined]
        assert sentence.startswith(f"{WRONG}: time stamps are ")
        assert ("ahead of" in sentence) == (offset_s > 0.0)
        leads = {one["id"]: one["clock_lead_s"] for one in service.view.sensors()}
        assert leads.pop(WRONG) == pytest.approx(offset_s, abs=2.0)
        assert set(leads.values()) == {None}
    finally:
        service.stop()


@pytest.mark.slow
def test_a_restart_gives_the_same_output() -> None:
    journal = MemoryJournal()
    service = _service(journal, None)
    frame = _wrong(500, 10.0)
    cuts = np.random.default_rng(3).integers(1, 9, 250).cumsum().tolist()
    for first, last in zip([0, *cuts], cuts, strict=False):
        if first < len(frame):
            submit(service, frame[first:last])
    before = settled(service)
    service.stop()
    again = _service(journal, None)
    try:
        after = settled(again)
        assert (after["output_sha256"], after["data_time_s"]) == (
            before["output_sha256"], before["data_time_s"],
        )  # fmt: skip
        assert after["engine"] == before["engine"]
        again.flush(source="test").result(WAIT_TIMEOUT_S)
        assert settled(again)["engine"]["LATE"] == 0  # type: ignore[index]
    finally:
        again.stop()
