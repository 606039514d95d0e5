"""The read interface has true ages, and agrees with the output of the engine."""

import json
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.errors import ConfigurationError, ForecastError
from multiradar.runtime.live.publication import Publication
from multiradar.runtime.live.view import LiveView
from multiradar.runtime.queries.registry import BIASES, UPDATES
from multiradar.runtime.stream.events import Event
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.forecast.regions import gaussian_factor
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.lifecycle.transitions import MERGED, NO_TRACK, SILENT
from multiradar.tracking.outputs import (
    STATE_TENTATIVE,
    EndedTracks,
    EngineOutput,
)
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import biases_frame, measurement_batch, tracks_frame
from multiradar_schemas.products.bias import BIAS_SCHEMA
from multiradar_schemas.products.forecast import ForecastPoint
from multiradar_schemas.products.health import RadarHealth
from multiradar_schemas.products.track import TRACK_SCHEMA
from support.fakes.fake_engine import FakeEngine
from support.fakes.health import health_records
from support.processes.waiting import join
from support.scenarios.asked import biases, forecast
from support.scenarios.live_scene import START_S, recording, sensors

TABLE = sensors()


class _Published:
    """A publication that a fake engine writes to."""

    def __init__(self, **limits: float) -> None:
        self.engine = FakeEngine()
        bounds = RuntimeLimits(**limits)  # type: ignore[arg-type]
        self.publication = Publication(TABLE, TrackingSettings(), bounds)
        self.view = self.publication.view
        self.publication.attach(lambda: (self.engine.tracks(), self.engine.plane), dict)
        self.data_time_s = -np.inf

    def push(self, frame: pl.DataFrame) -> EngineOutput:
        """Push a frame through the engine and publish the output."""
        batch, _ = measurement_batch(frame, TABLE)
        return self.publish(self.engine.push(batch), float(batch.time_s.max()))

    def publish(self, output: EngineOutput, time_s: float) -> EngineOutput:
        """Publish an output, as at a data time."""
        self.data_time_s = max(self.data_time_s, time_s)
        self.publication.publish(output, self.data_time_s)
        return output

    def end(self, tracks: list[int], time_s: float, into_track: int = NO_TRACK) -> None:
        """Publish the end of tracks."""
        nothing = self.engine.push(MeasurementBatch.empty())
        count = len(tracks)
        into = np.full(count, into_track)
        reason = np.where(into == NO_TRACK, SILENT, MERGED).astype(np.int8)
        ended = EndedTracks(np.array(tracks), np.full(count, time_s), reason, into)
        self.publish(EngineOutput(nothing.updates, nothing.biases, ended), time_s)


def _nothing(published: _Published) -> EngineOutput:
    return published.engine.push(MeasurementBatch.empty())


def _events(view: LiveView) -> list[Event]:
    subscription = view.subscribe(0, 10**6)
    found: list[Event] = []
    while part := subscription.poll(100):
        found += part
    return found


def _at(frame: pl.DataFrame, time_s: float) -> pl.DataFrame:
    return frame[:1].with_columns(time_s=pl.lit(START_S + time_s))


def test_a_live_track_is_its_latest_update_and_its_age() -> None:
    published = _Published()
    output = published.push(recording(300))
    every = tracks_frame(output.updates, TABLE)
    expected = every.group_by("track_id", maintain_order=True).last().sort("track_id")
    tracks = published.view.tracks()
    assert dict(tracks.schema) == {
        **TRACK_SCHEMA,
        "age_s": pl.Float64(),
        "reception_age_s": pl.Float64(),
    }
    assert tracks.drop("age_s", "reception_age_s").equals(expected.select(tracks.columns[:-2]))
    age_s = published.data_time_s - expected["time_s"]
    assert tracks["age_s"].to_list() == age_s.to_list()
    assert published.view.track(3) == tracks.filter(pl.col("track_id") == 3).row(0, named=True)
    assert published.view.track(99) is None


def test_the_status_has_the_output_of_the_entries_it_counts_as_processed() -> None:
    """A client that waits for `processed_sequence` missed the output of the last group."""
    published = _Published()

    def processing() -> dict[str, int]:
        # The engine completes a group while the status is put together.
        published.push(recording(50))
        return {"processed_sequence": 1}

    published.view.service_counts = processing
    status = published.view.status()
    assert (status["processed_sequence"], status["output_sequence"]) == (1, 50)


def test_a_track_without_updates_coasts_and_a_terminated_one_is_removed() -> None:
    published, frame = _Published(), recording(10)
    number = int(frame["track_number"][0]) + 1
    published.push(_at(frame, 0.0))
    other = frame[:1].with_columns(
        track_number=pl.lit(100, pl.Int64), time_s=pl.lit(START_S + 15.0)
    )
    published.push(other)
    assert published.view.tracks()["state"].to_list() == ["confirmed", "confirmed"]
    published.push(other.with_columns(time_s=pl.lit(START_S + 15.001)))
    assert published.view.tracks()["state"].to_list() == ["coasting", "confirmed"]
    track = published.view.track(number)
    assert track is not None
    assert (track["state"], track["age_s"]) == ("coasting", pytest.approx(15.001, abs=1e-6))
    points = forecast(published.view, number, 10.0, 5.0)
    assert points is not None
    assert {point["state"] for point in points} == {"coasting"}
    published.end([number], START_S + 60.0)
    assert published.view.tracks()["track_id"].to_list() == [101]
    assert published.view.track(number) is None
    assert forecast(published.view, number, 10.0, 5.0) is None
    assert published.view.status()["tracks"] == 1
    assert len(published.view.rows(UPDATES, number, None, 10)) == 1


def test_a_tentative_track_stays_tentative() -> None:
    published, frame = _Published(), recording(10)
    output = published.engine.push(measurement_batch(_at(frame, 0.0), TABLE)[0])
    output.updates.state[:] = STATE_TENTATIVE
    published.publish(output, START_S + 100.0)
    assert published.view.tracks()["state"].to_list() == ["tentative"]


def test_a_measurement_that_is_newer_than_the_data_time_has_no_negative_age() -> None:
    published, frame = _Published(), recording(10)
    output = published.engine.push(measurement_batch(_at(frame, 5.0), TABLE)[0])
    published.publish(output, START_S)
    assert published.view.tracks()["age_s"].to_list() == [0.0]


def test_a_forecast_starts_now_and_its_covariance_grows() -> None:
    published, frame = _Published(), recording(10)
    number = int(frame["track_number"][0]) + 1
    published.push(_at(frame, 0.0))
    published.data_time_s = START_S + 4.0
    published.end([], START_S + 4.0)
    points = forecast(published.view, number, 60.0, 20.0)
    assert points is not None
    assert [point["time_s"] - START_S for point in points] == [4.0, 24.0, 44.0, 64.0]
    assert [point["age_s"] for point in points] == [4.0, 24.0, 44.0, 64.0]
    for point in points:
        ForecastPoint.model_validate(point)
    # The fake engine flies north at 100 m/s: 2 km in 20 s, a minute of latitude is 1.85 km.
    north_deg = np.diff([point["latitude_deg"] for point in points])
    np.testing.assert_allclose(north_deg * 60.0 * 1853.8, 2000.0, rtol=2e-3)
    assert abs(points[3]["longitude_deg"] - points[0]["longitude_deg"]) < 1e-3
    sigma = [point["position_sigma_m"] for point in points]
    assert sigma == sorted(sigma)
    # After 4 s, of the variances 100 and 400 m², 1 and 4 m²/s² of the fake engine, it is no less;
    # nothing is known of the traffic yet, and a heading that walks by 0.02 rad²/s at 100 m/s
    # leads away by 65 m: the variance is 0.02 · 100² · 4³ / 3.
    assert sigma[0] == pytest.approx(np.sqrt(100 + 16 + 400 + 64 + 65.3**2), rel=0.05)
    assert not any(point["calibrated"] for point in points)
    assert all(point["region_factor"] == gaussian_factor(0.95) for point in points)


@pytest.mark.parametrize(
    ("horizon_s", "step_s"),
    [
        (-1.0, 1.0),
        (0.0, 1.0),
        (10.0, 0.0),
        (10.0, 0.09),
        (10.0, np.nan),
        (np.inf, 1.0),
        (np.nan, 1.0),
        (1e300, 1e-300),
        (1e200, 1e199),
        (1e5, 1e4),
        (3600.1, 10.0),
    ],
)
def test_an_invalid_forecast_is_rejected(horizon_s: float, step_s: float) -> None:
    published = _Published()
    published.push(recording(10))
    with pytest.raises(ForecastError, match="expected"):
        forecast(published.view, 1, horizon_s, step_s)


def test_a_forecast_at_the_maximum_is_answered_and_beyond_is_rejected() -> None:
    published, frame = _Published(forecast_steps_max=10), recording(10)
    number = int(frame["track_number"][0]) + 1
    published.push(frame)
    points = forecast(published.view, number, 0.9, 0.1)
    assert points is not None
    assert len(points) == 10
    with pytest.raises(ForecastError, match="at most 10 points, found 11"):
        forecast(published.view, number, 1.0, 0.1)


def test_biases_are_the_latest_and_the_history_pages() -> None:
    published = _Published()
    output = published.push(recording(2000))
    name = TABLE.ids[0]
    every = biases_frame(output.biases, TABLE)
    assert biases(published.view, name) == every[-1:].to_dicts()
    assert biases(published.view, "unlisted") == []
    assert biases(published.view, TABLE.ids[1]) == []
    history = published.view.rows(BIASES, name, None, 1000)
    assert dict(history.schema) == dict(BIAS_SCHEMA)
    assert history.equals(every)
    assert published.view.rows(BIASES, name, None, 3).equals(every[-3:])
    since = every["time_s"][5]
    assert published.view.rows(BIASES, name, since, 4).equals(every[5:9])


def test_small_pages_do_not_truncate_a_history() -> None:
    """Paging reads one row more than the page: a shortened read would seem to be the last page."""
    published = _Published(page_rows_max=3)
    frame = recording(2000)
    output = published.push(frame)
    number = int(output.updates.track_id[0])
    assert published.view.page_rows_max == 3
    assert len(published.view.rows(UPDATES, number, -1e11, 10)) == 10
    assert len(published.view.rows(BIASES, TABLE.ids[0], -1e11, 10)) == 10


def test_the_bias_history_is_bounded() -> None:
    published = _Published(bias_history_rows_max=7)
    every = biases_frame(published.push(recording(2000)).biases, TABLE)
    assert len(every) > 14
    assert published.view.rows(BIASES, TABLE.ids[0], None, 1000).equals(every[-7:])


def test_sensors_contain_their_updates() -> None:
    published, frame = _Published(), recording(300)
    published.push(frame)
    by_id = {sensor["id"]: sensor for sensor in published.view.sensors()}
    assert list(by_id) == sorted(TABLE.ids)
    counts = frame.group_by("sensor_id").agg(pl.len(), pl.col("time_s").max())
    for name, count, last_s in counts.iter_rows():
        assert by_id[name]["updates"] == count
        assert by_id[name]["last_update_s"] == last_s
        assert by_id[name]["age_s"] == published.data_time_s - last_s
    assert by_id["adsb"]["latitude_deg"] is None
    assert by_id["41-10"]["latitude_deg"] == pytest.approx(50.0)
    assert json.loads(json.dumps(by_id, allow_nan=False))


def test_the_health_of_a_radar_is_that_of_the_last_epoch() -> None:
    published = _Published()
    output = published.push(recording(300))
    assert published.view.sensors()[0]["health"] is None
    assert published.view.status()["sensor_alarms"] == {}
    health = health_records(
        epoch=[1, 1, 2, 2], sensor=[0, 1, 0, 1], time_s=[4.0, 4.0, 8.0, 8.0], alarms=[0, 0, 1, 0]
    )
    published.publish(replace(output, updates=_nothing(published).updates, health=health), 8.0)
    published.publish(_nothing(published), 9.0)
    by_id = {sensor["id"]: sensor["health"] for sensor in published.view.sensors()}
    assert by_id["41-10"]["alarms"] == "silent"
    assert {row["time_s"] for row in by_id.values() if row} == {8.0}
    assert by_id["adsb"] is None
    assert published.view.status()["sensor_alarms"] == {"41-10": ["silent"]}
    RadarHealth.model_validate(by_id["41-20"])


def _row(event: Event) -> dict[str, Any]:
    row: dict[str, Any] = json.loads(event.payload)
    # Of a publication that data in real time do not reach.
    assert row.pop("data_delay_s") is None
    return row


def test_events_contain_every_row_in_the_order_of_data_time() -> None:
    published = _Published(status_period_s=20.0)
    output = published.push(recording(1000))
    published.end([4], published.data_time_s)
    events = _events(published.view)
    assert [event.sequence for event in events] == list(range(1, len(events) + 1))
    by_kind = {
        kind: [_row(event) for event in events if event.kind == kind]
        for kind in ("track", "bias", "ended", "status")
    }
    assert pl.DataFrame(by_kind["track"], schema=TRACK_SCHEMA).equals(
        tracks_frame(output.updates, TABLE)
    )
    assert pl.DataFrame(by_kind["bias"], schema=BIAS_SCHEMA).equals(
        biases_frame(output.biases, TABLE)
    )
    assert by_kind["ended"] == [
        {"time_s": published.data_time_s, "track_id": 4, "reason": "silent"}
    ]
    assert [mark["time_s"] - START_S for mark in by_kind["status"]] == [20.0, 40.0]
    for event in events:
        payload = json.loads(event.payload)
        key = payload.get("track_id", payload.get("sensor_id", ""))
        assert event.key == ("" if event.kind == "status" else str(key))
    reached = -np.inf
    for event in events:
        time_s = json.loads(event.payload)["time_s"]
        if event.kind == "track":
            reached = max(reached, time_s)
        else:
            # The end of an epoch precedes the first later update.
            assert reached <= time_s


@pytest.mark.slow
def test_events_do_not_depend_on_the_batches() -> None:
    frame = recording(300, step_s=0.2)
    whole = _Published()
    whole.push(frame)
    expected = _events(whole.view)
    for size in (1, 7, 150, 299):
        pieces = _Published()
        for start in range(0, len(frame), size):
            pieces.push(frame[start : start + size])
        assert _events(pieces.view) == expected, size


def test_numbers_that_do_not_exist_are_null() -> None:
    published, frame = _Published(), recording(10)
    for count in (1, 10):
        output = published.engine.push(measurement_batch(frame[:count], TABLE)[0])
        output.updates.height_m[:] = np.nan
        output.updates.velocity_sigma_mps[:] = np.inf
        published.publish(output, START_S)
    for event in _events(published.view):
        if event.kind == "track":
            payload = json.loads(event.payload, parse_constant=lambda word: pytest.fail(word))
            assert payload["height_m"] is payload["velocity_sigma_mps"] is None


def test_nothing_is_known_before_the_first_measurement() -> None:
    publication = Publication(TABLE, TrackingSettings(), RuntimeLimits())
    view = publication.view
    assert view.tracks().is_empty()
    assert dict(view.tracks().schema) == {
        **TRACK_SCHEMA,
        "age_s": pl.Float64(),
        "reception_age_s": pl.Float64(),
    }
    assert view.track(1) is None
    assert view.rows(UPDATES, 1, None, 10).is_empty()
    assert forecast(view, 1, 10.0, 1.0) is None
    assert [sensor["age_s"] for sensor in view.sensors()] == [None] * 3
    assert view.status()["data_time_s"] is None
    assert view.status()["event_sequence"] == 0


def test_the_table_of_tracks_follows_every_publication() -> None:
    published, frame = _Published(), recording(200)
    published.push(frame[:100])
    first = published.view.tracks()
    assert published.view.tracks() is first
    published.push(frame[100:])
    assert published.view.tracks()["sequence"].max() == 200


@pytest.mark.slow
def test_readers_of_all_kinds_do_not_disturb_the_writer() -> None:
    published, frame, done = _Published(history_rows_max=100), recording(400), threading.Event()
    failures: list[BaseException] = []
    calls: list[Callable[[], object]] = [
        published.view.tracks,
        lambda: published.view.track(2),
        lambda: published.view.rows(UPDATES, 2, None, 50),
        published.view.sensors,
        lambda: published.view.rows(BIASES, TABLE.ids[0], START_S, 50),
        published.view.status,
        lambda: _events(published.view),
    ]

    def read(call: Callable[[], object]) -> None:
        while not done.is_set():
            try:
                call()
            except BaseException as error:
                failures.append(error)
                return

    readers = [threading.Thread(target=read, args=(call,)) for call in calls]
    for reader in readers:
        reader.start()
    for start in range(0, len(frame), 20):
        published.push(frame[start : start + 20])
    done.set()
    for reader in readers:
        join(reader)
    assert failures == []
    assert published.view.status()["output_sequence"] == 400


def test_a_bound_of_zero_is_rejected() -> None:
    with pytest.raises(ConfigurationError, match="events_max: expected a bound greater than 0"):
        RuntimeLimits(events_max=0)


def test_a_restarted_publication_repeats_its_output() -> None:
    published, frame = _Published(), recording(500)
    published.push(frame)
    before, tracks = _events(published.view), published.view.tracks()
    published.publication.restart(TABLE)
    assert published.view.tracks().is_empty()
    published.engine = FakeEngine()
    published.push(frame)
    assert _events(published.view) == before
    assert published.view.tracks().equals(tracks)
