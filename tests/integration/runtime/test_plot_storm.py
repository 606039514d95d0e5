"""Ten times as many false plots as true ones for a minute: no track and no plot is lost."""

import threading
from collections import Counter
from dataclasses import replace
from pathlib import Path

import httpx
import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.app import Application
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.settings.service import load_settings
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame, truth_frame
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.outputs import (
    STATE_CONFIRMED,
    EndedTracks,
    EngineOutput,
    TrackUpdates,
)
from multiradar.tracking.settings import TrackingSettings
from support.processes import clients
from support.processes.waiting import WAIT_TIMEOUT_S, join, wait_until

SCENE = builtin_scenario("plot-storm")
STORM_S = (SCENE.sensors[0].clutter_bursts[0].start_s, SCENE.sensors[0].clutter_bursts[0].end_s)
NAMELESS = TrackingSettings(hidden_fields=("track_number", "mode_s_address", "mode_3a"))
SEEN = observe(SCENE, np.random.Generator(np.random.PCG64(SCENE.seed)))
FRAME = measurements_frame(SCENE, SEEN)
#: Rows of a message, and of measurements that may wait: small, so that a burst must wait its turn.
MESSAGE_ROWS, WAITING_ROWS = 500, 1000


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> SensorTable:
    path = tmp_path_factory.mktemp("sensors") / "sensors.toml"
    path.write_text(sensors_text(SCENE), encoding="utf-8")
    return load_sensor_table(path)


def played(table: SensorTable, settings: TrackingSettings) -> tuple[list[EngineOutput], Engine]:
    batch, rejected = wire.measurement_batch(FRAME, table)
    assert len(rejected) == 0
    engine = Engine(table, settings)
    outputs = [
        engine.push(batch.select(slice(first, first + 4096)))
        for first in range(0, len(batch), 4096)
    ]
    return [*outputs, engine.flush()], engine


def test_the_storm_is_ten_times_the_load() -> None:
    truth = truth_frame(SCENE, SEEN).filter(pl.col("time_s").is_between(*STORM_S))
    false = truth["track_number"].null_count()
    assert false > 9 * (len(truth) - false)


@pytest.mark.fault(17)
def test_every_aircraft_keeps_its_track_through_the_storm(table: SensorTable) -> None:
    outputs, engine = played(table, NAMELESS)
    updates = TrackUpdates.concatenate([output.updates for output in outputs])
    frame = wire.tracks_frame(updates, table).drop("track_number")
    truth = truth_frame(SCENE, SEEN).select("time_s", "sensor_id", "track_number")
    rows = frame.join(truth, on=["time_s", "sensor_id"], how="left")
    confirmed = rows.filter(pl.col("state") == "confirmed")
    during = confirmed.filter(pl.col("time_s").is_between(*STORM_S)).drop_nulls("track_number")
    before = confirmed.filter(pl.col("time_s") < STORM_S[0]).drop_nulls("track_number")
    owner = {number: track for track, number in before.select("track_id", "track_number").rows()}
    assert len(owner) == len(SEEN.aircraft)
    kept = [owner.get(number) == track for track, number in
            during.select("track_id", "track_number").rows()]  # fmt: skip
    assert len(kept) > 900
    assert np.mean(kept) > 0.99
    # None of the tracks of before ended in the storm, and hardly one of false plots lived.
    ended = EndedTracks.concatenate([output.ended for output in outputs])
    within = (ended.time_s >= STORM_S[0]) & (ended.time_s <= STORM_S[1])
    assert not set(ended.track_id[within].tolist()) & set(owner.values())
    false = confirmed["track_id"].n_unique() - len(set(owner.values()))
    assert false <= 2
    # All plots of the storm are accounted for, and what they began has ended again.
    assert sum(engine.counts.values()) == len(FRAME)
    assert len(engine.tracks()) < 100


def test_memory_for_false_plots_is_bounded_by_a_few_scans(table: SensorTable) -> None:
    batch, _ = wire.measurement_batch(FRAME, table)
    engine = Engine(table, NAMELESS)
    alive = []
    for first in range(0, len(batch), 256):
        engine.push(batch.select(slice(first, first + 256)))
        alive.append(len(engine.tracks()))
    # 300 plots per scan of each of three radars; a track of one plot is dropped after three scans.
    assert max(alive) < 3 * 3 * 300 + 200


def test_a_clutter_burst_over_http_loses_no_plot_and_gives_the_offline_tracks(
    table: SensorTable, tmp_path: Path
) -> None:
    chosen = {
        "server": {"port": 0},
        "http": {"acknowledge_deadline_s": WAIT_TIMEOUT_S},
        "journal": {"path": tmp_path / "journal.sqlite"},
        "zenoh": {"enabled": False},
        "tracking": {"hidden_fields": NAMELESS.hidden_fields},
        "runtime": {"intake_rows_max": WAITING_ROWS, "backlog_rows_max": WAITING_ROWS},
    }
    application = Application(load_settings(None, chosen), table, lambda: None)
    application.start()
    try:
        rubbish: Counter[str] = Counter()
        other = threading.Thread(target=send_rubbish, args=(application.http_url, rubbish))
        other.start()
        with clients.client(application.http_url) as client:
            for first in range(0, len(FRAME), MESSAGE_ROWS):
                rows = FRAME[first : first + MESSAGE_ROWS]
                assert post(client, rows) == len(rows)
            assert client.post("/v1/flush").status_code == 200
            join(other)
            application.service.settled().result(WAIT_TIMEOUT_S)
            status = client.get("/v1/status").json()
    finally:
        application.stop()
    assert rubbish["rows"] > 0
    assert status["accepted"] == len(FRAME)
    assert status["rejected_by_code"] == {"DUPLICATE": 1, "UNKNOWN_SENSOR": rubbish["rows"]}
    assert status["read"] == status["accepted"] + status["rejected"]
    digest = OutputDigest()
    for output in played(table, NAMELESS)[0]:
        digest.add(output)
    assert status["output_sha256"] == digest.hexdigest()


def post(client: httpx.Client, rows: pl.DataFrame) -> int:
    """Submit rows, repeatedly while the service is busy; return the number accepted."""
    body = rows.write_ndjson().encode()
    kind = {"content-type": "application/x-ndjson"}
    accepted: list[int] = []

    def was_accepted() -> bool:
        answer = client.post("/v1/measurements", content=body, headers=kind)
        if answer.status_code != httpx.codes.TOO_MANY_REQUESTS:
            accepted.append(answer.json()["accepted"])
        return bool(accepted)

    wait_until(was_accepted, "space in the intake")
    return accepted[0]


def send_rubbish(url: str, sent: "Counter[str]") -> None:
    """Plots of an unknown radar, as many as of all others in the clutter burst."""
    storm = FRAME.filter(pl.col("time_s").is_between(*STORM_S))
    rows = storm.with_columns(sensor_id=pl.lit("unlisted"))
    with clients.client(url) as client:
        for first in range(0, len(rows), MESSAGE_ROWS):
            part = rows[first : first + MESSAGE_ROWS]
            assert post(client, part) == 0
            sent["rows"] += len(part)


def test_with_codes_too_the_storm_changes_no_track(table: SensorTable) -> None:
    outputs, _ = played(table, replace(NAMELESS, hidden_fields=("track_number",)))
    updates = TrackUpdates.concatenate([output.updates for output in outputs])
    confirmed = updates.track_id[updates.state == STATE_CONFIRMED]
    assert len(np.unique(confirmed)) <= len(SEEN.aircraft) + 2
