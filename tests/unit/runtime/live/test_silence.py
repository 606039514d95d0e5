"""Total silence is visible: stale tracks, an alarm, a growing delay, no readiness."""

import json
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from prometheus_client import CollectorRegistry, generate_latest

from multiradar.clock import FixedClock
from multiradar.observability.metrics import watch
from multiradar.observability.pipeline_metrics import PipelineCollector, ReadinessCollector
from multiradar.runtime.live.alarms.silence import WITHOUT_SCANS_S
from multiradar.runtime.live.readiness import CODES
from multiradar.runtime.live.service import Service
from multiradar.storage.entries import RejectedRow
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.settings import TrackingSettings
from support.fakes.fake_engine import FakeEngine
from support.processes.live_services import TABLE, GatedJournal, settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import START_S, recording, sensors_file


@pytest.fixture(params=[0.0, -1e6])
def running(request: pytest.FixtureRequest) -> Iterator[tuple[Service, FixedClock, bool]]:
    """A service that received 5 s of measurements, in real time or from a replay."""
    clock = FixedClock(START_S + 5.2 - request.param)
    journal = MemoryJournal()
    service = Service(
        open_journal=lambda: journal,
        open_engine=FakeEngine,
        sensors=TABLE,
        tracking=TrackingSettings(),
        clock=clock,
    )
    service.start()
    submit(service, recording(100))
    yield service, clock, request.param == 0.0
    service.stop()


def _gauges(service: Service) -> dict[str, float]:
    """Return the values in `/metrics` that have no labels."""
    registry = CollectorRegistry()
    watch(registry, PipelineCollector(service.view.status))
    watch(registry, ReadinessCollector(service, CODES))
    lines = generate_latest(registry).decode().splitlines()
    pairs = [line.split() for line in lines if not line.startswith("#") and "{" not in line]
    return {name: float(value) for name, value in pairs}


@pytest.mark.fault(14)
def test_it_is_visible_and_ends(running: tuple[Service, FixedClock, bool]) -> None:
    service, clock, live = running
    status = settled(service)
    assert (status["alarms"], status["unready"]) == ([], [])
    assert "stale" not in service.view.tracks()["state"].to_list()
    before, ages_s = service.view.tracks(), dict(status["sensor_ages_s"])  # type: ignore[call-overload]
    assert ages_s
    clock.advance(WITHOUT_SCANS_S + 65.0)
    status, tracks = settled(service), service.view.tracks()
    assert tracks["age_s"].equals(before["age_s"])
    if not live:
        assert (status["alarms"], status["data_delay_s"], status["unready"]) == ([], None, [])
        assert not {"multiradar_silence_s", "multiradar_data_delay_s"} & _gauges(service).keys()
        assert tracks["reception_age_s"].to_list() == [None] * len(tracks)
        return
    assert status["alarms"] == ["no_data"]
    assert status["silence_s"] == 75.0
    assert status["sensor_ages_s"] == {one: age_s + 75.0 for one, age_s in ages_s.items()}
    assert status["data_delay_s"] == pytest.approx(75.2, abs=0.2)
    assert status["warnings"][0].startswith("no measurements from any sensor for 75 s (limit 10 s)")  # type: ignore[index]
    assert set(tracks["state"]) == {"stale"}
    assert (tracks["reception_age_s"] - tracks["age_s"]).to_list() == [75.0] * len(tracks)
    track = service.view.track(int(tracks["track_id"][0]))
    assert track is not None
    assert track["state"] == "stale"
    gauges = _gauges(service)
    assert (gauges["multiradar_no_data"], gauges["multiradar_silence_s"]) == (1.0, 75.0)
    assert gauges["multiradar_data_delay_s"] == pytest.approx(75.2, abs=0.2)
    later = recording(5).with_columns(pl.col("time_s") + 80.0)
    submit(service, later)
    status = settled(service)
    assert (status["alarms"], status["unready"]) == ([], [])
    assert "stale" not in service.view.tracks()["state"].to_list()
    gauges = _gauges(service)
    assert (gauges["multiradar_no_data"], gauges["multiradar_silence_s"]) == (0.0, 0.0)
    assert gauges["multiradar_data_delay_s"] == pytest.approx(0.0, abs=0.3)


@pytest.mark.parametrize(
    ("disabled", "bound_s"), [((), 9.6), (("41-10",), 24.0), (("41-10", "41-20"), 10.0)]
)
@pytest.mark.fault(14)
def test_the_alarm_is_raised_within_two_scans_of_the_fastest_radar(
    disabled: tuple[str, ...], bound_s: float
) -> None:
    """Radars of 4.8 s and 12 s, and ADS-B, which has no scans."""
    sensors = replace(
        TABLE,
        rotation_period_s=np.array([4.8, 12.0, np.nan]),
        disabled=np.isin(TABLE.ids, disabled),
    )
    clock, journal = FixedClock(START_S + 5.2), MemoryJournal()
    service = Service(
        open_journal=lambda: journal,
        open_engine=FakeEngine,
        sensors=sensors,
        tracking=TrackingSettings(),
        clock=clock,
    )
    service.start()
    try:
        # Of the sensor that is never disabled here.
        submit(service, recording(100).filter(pl.col("sensor_id") == "adsb"))
        assert settled(service)["silence_limit_s"] == pytest.approx(bound_s)
        clock.advance(bound_s - 0.1)
        status = settled(service)
        assert (status["alarms"], status["unready"]) == ([], [])
        assert _gauges(service)["multiradar_no_data"] == 0.0
        assert "stale" not in service.view.tracks()["state"].to_list()
        clock.advance(0.2)
        assert settled(service)["alarms"] == ["no_data"]
        gauges = _gauges(service)
        assert gauges["multiradar_no_data"] == 1.0
        assert gauges["multiradar_silence_s"] == pytest.approx(bound_s + 0.1)
        assert set(service.view.tracks()["state"]) == {"stale"}
    finally:
        service.stop()


def test_events_have_the_delay_of_the_data_at_their_publication(
    running: tuple[Service, FixedClock, bool],
) -> None:
    service, clock, live = running
    settled(service)
    subscription = service.view.subscribe(None, 1000)
    clock.advance(3.0)
    submit(service, recording(5).with_columns(pl.col("time_s") + 5.0))
    settled(service)
    clock.advance(60.0)
    delays = {json.loads(event.payload)["data_delay_s"] for event in subscription.poll(1000)}
    # Received 3 s after the time of the last measurement: 5.2 + 3.0 - 5.2.
    assert [*delays] == [pytest.approx(3.0, abs=0.01) if live else None]


def test_measurements_beside_malformed_rows_end_it(
    running: tuple[Service, FixedClock, bool],
) -> None:
    service, clock, _ = running
    clock.advance(75.0)
    malformed = [RejectedRow(index, "MALFORMED_JSON", "expected an object") for index in (1, 2, 3)]
    later = recording(1).with_columns(pl.col("time_s") + 80.0, index=pl.lit(0))
    service.submit(later, source="test", rejected=malformed).result(WAIT_TIMEOUT_S)
    assert settled(service)["alarms"] == []


def test_rejected_measurements_do_not_end_it(running: tuple[Service, FixedClock, bool]) -> None:
    service, clock, live = running
    clock.advance(75.0)
    submit(service, recording(5).with_columns(sensor_id=pl.lit("unlisted")))
    assert settled(service)["alarms"] == (["no_data"] if live else [])


@pytest.mark.fault(14)
def test_measurements_that_wait_for_the_journal_are_no_silence() -> None:
    """A flood of one source delayed the others, and the alarm said that nothing was received."""
    clock, journal = FixedClock(START_S + 5.2), GatedJournal()
    service = Service(
        open_journal=lambda: journal,
        open_engine=FakeEngine,
        sensors=TABLE,
        tracking=TrackingSettings(),
        clock=clock,
    )
    journal.open.set()
    service.start()
    try:
        submit(service, recording(100))
        settled(service)
        journal.entered.clear()
        journal.open.clear()
        clock.advance(3.0)
        later = recording(1).with_columns(pl.col("time_s") + 8.0)
        waiting = service.submit(later, source="test")
        assert journal.entered.wait(WAIT_TIMEOUT_S)
        clock.advance(20.0)
        assert service.view.status()["alarms"] == []
        assert [one.code for one in service.unready()] == ["LAG"]
        journal.open.set()
        waiting.result(WAIT_TIMEOUT_S)
        assert settled(service)["alarms"] == []
        clock.advance(WITHOUT_SCANS_S + 1.0)
        assert service.view.status()["alarms"] == ["no_data"]
    finally:
        journal.open.set()
        service.stop()


@pytest.mark.parametrize("is_takeover", [False, True])
@pytest.mark.parametrize(
    ("down_s", "is_live"), [(30.0, True), (36_000.0, True), (90_000.0, False), (2.0, True)]
)
def test_silence_counts_from_a_start_or_takeover_for_the_alarm_but_not_for_tracks(
    down_s: float, is_live: bool, is_takeover: bool
) -> None:
    """A proxy sends nothing to an unready service, which would remain so."""
    clock, journal = FixedClock(START_S + 5.2), MemoryJournal()
    # A standby has seen that they were in real time.
    is_live = is_live or is_takeover

    first, second = (
        Service(
            open_journal=lambda: journal,
            open_engine=FakeEngine,
            sensors=TABLE,
            tracking=TrackingSettings(),
            clock=clock,
        )
        for _ in range(2)
    )
    first.start()
    submit(first, recording(100))
    assert settled(first)["received_age_s"] == 0.0
    first.stop()
    if is_takeover:
        second.start(following=True)
    clock.advance(down_s)
    if is_takeover:
        second.lead()
    else:
        second.start()
    try:
        for further_s, since_s in ((0.0, 0.0), (9.5, 9.5), (1.0, 10.5)):
            clock.advance(further_s)
            # Of a time of the same day: older data are those of a replay.
            has_ceased = is_live and down_s + since_s > WITHOUT_SCANS_S
            is_alarm = is_live and since_s > WITHOUT_SCANS_S
            status = settled(second)
            assert status["alarms"] == ["no_data"] * is_alarm
            assert [one["code"] for one in status["unready"]] == ["NO_DATA"] * is_alarm  # type: ignore[attr-defined]
            assert status["received_age_s"] is None
            assert status["silence_limit_s"] == WITHOUT_SCANS_S
            if is_live:
                assert status["silence_s"] == pytest.approx(down_s + since_s, abs=0.5)
            assert (set(second.view.tracks()["state"]) == {"stale"}) is has_ceased
        submit(second, recording(5).with_columns(pl.col("time_s") + down_s + 15.0))
        status = settled(second)
        assert (status["alarms"], status["received_age_s"]) == ([], 0.0)
    finally:
        second.stop()


@pytest.mark.fault(14)
def test_a_standby_notices_it_too() -> None:
    """Its tracks stayed confirmed for ever when the feeds, or the primary, had ceased."""
    clock, journal = FixedClock(START_S + 5.2), MemoryJournal()

    primary, standby = (
        Service(
            open_journal=lambda: journal,
            open_engine=FakeEngine,
            sensors=TABLE,
            tracking=TrackingSettings(),
            clock=clock,
            described=sensors_file(),
        )
        for _ in range(2)
    )

    def assert_silent(silence_s: float, limit_s: float, *, alarm: bool, stale: bool) -> None:
        status = standby.view.status()
        assert (status["silence_s"], status["silence_limit_s"]) == (silence_s, limit_s)
        assert status["alarms"] == ["no_data"] * alarm
        tracks = standby.view.tracks()
        assert (set(tracks["state"]) == {"stale"}) is stale
        assert (tracks["reception_age_s"] - tracks["age_s"]).to_list() == pytest.approx(
            [silence_s] * len(tracks)
        )

    primary.start()
    submit(primary, recording(100))
    standby.start(following=True)
    try:
        assert_silent(standby.view.status()["silence_s"], 10.0, alarm=False, stale=False)
        assert standby.view.status()["silence_s"] == pytest.approx(0.2, abs=0.2)
        submit(primary, recording(5).with_columns(pl.col("time_s") + 5.0))
        clock.advance(3.0)
        reader = standby.view.subscribe(None, 1000)
        standby.follow(2)
        delays = {json.loads(event.payload)["data_delay_s"] for event in reader.poll(1000)}
        assert [*delays] == [pytest.approx(3.0, abs=0.01)]
        assert_silent(0.0, 10.0, alarm=False, stale=False)
        # Rejected measurements are none, and the alarm comes after two scans of the fastest radar.
        submit(primary, recording(5).with_columns(sensor_id=pl.lit("unlisted")))
        known = primary.describe_sensor("41-10") or {}
        plan = primary.plan_sensor("41-10", known | {"rotation_period_s": 4.0})
        primary.change_sensor(plan.change, source="a").result(WAIT_TIMEOUT_S)
        clock.advance(9.0)
        standby.follow(4)
        assert_silent(9.0, 8.0, alarm=True, stale=True)
        submit(primary, recording(5).with_columns(pl.col("time_s") + 17.0))
        standby.follow(5)
        assert_silent(0.0, 8.0, alarm=False, stale=False)
    finally:
        primary.stop()
        standby.stop()
