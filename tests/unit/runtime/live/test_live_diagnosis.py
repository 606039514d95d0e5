"""The diagnosis of a service that runs."""

import json
import logging

import polars as pl
import pytest

from multiradar.runtime.live.live_diagnosis import LiveDiagnosis
from multiradar.storage.entries import RejectedRow
from support.fakes.engine_outputs import Update, output_of
from support.inputs.mistaken import RADARS, START_S, recording

WRONG = recording().changed("1-10", range_m=pl.col("range_m") / 1e3)


def opened() -> LiveDiagnosis:
    """Return one that checks on request only."""
    diagnosis = LiveDiagnosis(WRONG.table(), period_s=3600.0)
    diagnosis.start()
    return diagnosis


def checked(diagnosis: LiveDiagnosis) -> bool:
    """Check twice: the engine processes the last measurements of a window after its end."""
    assert not diagnosis.check()
    return diagnosis.check()


def test_tracks_confirmed_after_the_end_of_a_window_belong_to_it() -> None:
    diagnosis = opened()
    diagnosis.record(recording().frame, ())
    assert not diagnosis.check()
    diagnosis.put(output_of([Update(1, START_S, 1)]))
    assert diagnosis.check()
    assert diagnosis.records() == []
    diagnosis.record(recording().frame, ())
    assert checked(diagnosis)
    assert [one["code"] for one in diagnosis.records()] == ["no_tracks"]
    diagnosis.stop()


def test_an_unfinished_window_has_no_findings() -> None:
    diagnosis = opened()
    diagnosis.record(WRONG.frame.filter(pl.col("time_s") < START_S + 30.0), ())
    assert not checked(diagnosis)
    assert diagnosis.records() == []
    diagnosis.stop()


def test_a_finding_is_reported_for_its_sensor_and_logged_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    diagnosis = opened()
    with caplog.at_level(logging.WARNING):
        for _ in range(2):
            diagnosis.record(WRONG.frame, ())
            assert checked(diagnosis)
    assert [one["code"] for one in diagnosis.of("1-10")] == ["range_unit"]
    assert diagnosis.of("2-10") == []
    assert [one["sensor_id"] for one in diagnosis.records()] == ["1-10"]
    said = [record.getMessage() for record in caplog.records]
    assert len(said) == 1
    assert said[0].startswith("diagnosis: 1-10: its ranges are probably in kilometres")
    diagnosis.stop()


def test_a_resolved_finding_is_no_longer_reported() -> None:
    diagnosis = opened()
    diagnosis.record(WRONG.frame, ())
    checked(diagnosis)
    diagnosis.record(recording().frame, ())
    diagnosis.put(output_of([Update(1, START_S, 1)]))
    checked(diagnosis)
    assert diagnosis.records() == []
    diagnosis.stop()


def test_rows_that_were_rejected_count_for_their_sensor() -> None:
    diagnosis = opened()
    right = recording().frame
    raw = json.dumps({"sensor_id": "1-10", "range_m": 1e9})
    diagnosis.put(output_of([Update(1, START_S, 1)]))
    rejects = [RejectedRow(row, "OUT_OF_RANGE", "too far", raw) for row in range(900)]
    diagnosis.record(right, [*rejects, RejectedRow(900, "MALFORMED_JSON", "no JSON", "{")])
    checked(diagnosis)
    found = diagnosis.of("1-10")
    assert [one["code"] for one in found] == ["measurements_lost"]
    assert "900 OUT_OF_RANGE" in found[0]["sentence"]
    diagnosis.stop()


def test_before_the_start_nothing_is_retained() -> None:
    diagnosis = LiveDiagnosis(WRONG.table())
    diagnosis.record(WRONG.frame, ())
    assert not checked(diagnosis)
    diagnosis.stop()


def test_a_site_alarm_is_a_consequence_while_the_wrong_site_is_that_of_another_radar() -> None:
    latitude_deg = RADARS["1-10"][0][0] + 0.01
    displaced = recording().configured("1-10", latitude_deg=latitude_deg)
    diagnosis = LiveDiagnosis(displaced.table(), period_s=3600.0)
    diagnosis.start()
    alarms = ["noise", "site"]
    assert diagnosis.confirmed("2-10", alarms) == alarms
    diagnosis.record(displaced.frame, ())
    assert checked(diagnosis)
    assert [one["code"] for one in diagnosis.of("1-10")] == ["site"]
    assert diagnosis.confirmed("1-10", alarms) == alarms
    assert diagnosis.confirmed("2-10", alarms) == ["noise"]
    diagnosis.stop()
