"""A storm of new identities in the running service: named, counted, of no effect on others."""

import json
from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.estimation.measurement.plot_rates import plot_paces
from multiradar.runtime.admission.admission_by_time import ACCEPTED, Admission
from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.preparation import EXCESS_KEPT_MAX
from multiradar.runtime.live.service import Service
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.measurements.columns import complete
from support.processes.live_services import TABLE, settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import recording

STORM = "41-10"
#: Ten plots a second of each sensor, more than those of the recording.
SENSORS = replace(TABLE, plots_per_scan_max=np.full(len(TABLE), 10.0))
SETTINGS = TrackingSettings()


def _service(journal: MemoryJournal) -> Service:
    service = Service(
        open_journal=lambda: journal,
        open_engine=lambda: Engine(SENSORS, SETTINGS),
        sensors=SENSORS,
        tracking=SETTINGS,
    )
    service.start()
    return service


def _storm(rows: int) -> pl.DataFrame:
    """Return a recording with ten times as many rows of new addresses, by one radar."""
    frame = recording(rows)
    false = recording(10 * rows, seed=2, step_s=0.005).filter(pl.col("sensor_id") == STORM)
    false = false.with_columns(
        mode_s_address=pl.int_range(pl.len()).map_elements(lambda n: f"{n:06x}", pl.String),
        track_number=pl.lit(None, pl.Int64), callsign=pl.lit(None, pl.String),
    )  # fmt: skip
    return pl.concat([frame, false]).sort("time_s")


@pytest.mark.slow
@pytest.mark.fault(17)
def test_it_is_named_and_costs_the_others_nothing() -> None:
    service = _service(MemoryJournal())
    try:
        frame, rejected = _storm(800), Counter[tuple[str, str]]()
        for first in range(0, len(frame), 100):
            part = frame[first : first + 100]
            for row in submit(service, part).rejected:
                rejected[row.code, part["sensor_id"][row.index]] += 1
        assert set(rejected) == {("RATE_EXCEEDED", STORM)}
        assert rejected.total() > 1500
        status = settled(service)
        assert status["rejected_by_code"] == {"RATE_EXCEEDED": rejected.total()}
        assert status["arrivals"][STORM]["excess"] == rejected.total()  # type: ignore[index]
        assert status["sensor_alarms"] == {STORM: ["storm"]}
        (sentence,) = [one for one in status["warnings"] if "per second" in one]  # type: ignore[attr-defined]
        assert sentence == (
            "41-10: more than 10 measurements per second (plots_per_scan_max); the "
            "excess is rejected: check the sensor, and whether another sender uses the same name"
        )
        words = {one["id"]: one["storm"] for one in service.view.sensors()}
        assert words.pop(STORM) in sentence
        assert set(words.values()) == {None}
    finally:
        service.stop()


def test_of_a_long_message_the_first_rows_of_the_excess_keep_their_content() -> None:
    service = _service(MemoryJournal())
    try:
        submit(service, recording(100))
        frame = recording(30 * EXCESS_KEPT_MAX, seed=2, step_s=0.001)
        rejected = submit(service, frame).rejected
        excess = [row for row in rejected if row.code == "RATE_EXCEEDED"]
        assert len(excess) == len(rejected) > 2 * EXCESS_KEPT_MAX
        times = [json.loads(row.raw)["time_s"] for row in excess[:EXCESS_KEPT_MAX]]
        assert (
            times
            == frame["time_s"].gather([row.index for row in excess[:EXCESS_KEPT_MAX]]).to_list()
        )
        assert {row.raw for row in excess[EXCESS_KEPT_MAX:]} == {""}
    finally:
        service.stop()


def test_below_its_rate_it_is_named_for_the_tracks_that_it_initiates() -> None:
    service = _service(MemoryJournal())
    try:
        # Every row of this radar is of another aircraft.
        frame = recording(600).with_columns(
            mode_s_address=pl.when(pl.col("sensor_id") == STORM)
            .then(pl.int_range(pl.len()).map_elements(lambda n: f"{n:06x}", pl.String))
            .otherwise("mode_s_address"),
            track_number=pl.lit(None, pl.Int64),
        )
        assert not submit(service, frame).rejected
        service.flush(source="test").result(WAIT_TIMEOUT_S)
        status = settled(service)
        assert status["engine"]["NO_ROOM"] > 50  # type: ignore[index]
        assert status["sensor_alarms"][STORM] == ["storm"]  # type: ignore[index]
        (sentence,) = [one for one in status["warnings"] if "tentative" in one]  # type: ignore[attr-defined]
        assert sentence.startswith("41-10: limit of 10 tentative tracks")
    finally:
        service.stop()


@pytest.mark.slow
def test_live_restarted_and_offline_are_the_same() -> None:
    journal, frame = MemoryJournal(), _storm(500)
    service = _service(journal)
    cuts = [0, *np.random.default_rng(3).integers(1, 60, 400).cumsum().tolist()]
    for first, last in pairwise(cuts):
        if first < len(frame):
            submit(service, frame[first:last])
    before = settled(service)
    service.stop()
    again = _service(journal)
    try:
        after = settled(again)
    finally:
        again.stop()
    batch, _ = wire.measurement_batch(complete(frame), SENSORS)
    admission = Admission(SETTINGS.reorder_horizon_s, len(SENSORS), paces=plot_paces(SENSORS))
    kept = batch.select(admission.admit(batch) == ACCEPTED)
    offline = OutputDigest()
    offline.add(Engine(SENSORS, SETTINGS).push(kept, admission.released_to_s))
    assert before["accepted"] == len(kept) < len(frame) - 1000
    assert before["output_sha256"] == after["output_sha256"] == offline.hexdigest()
