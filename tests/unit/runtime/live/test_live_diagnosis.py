"""The diagnosis of a service that runs."""

import json
import logging
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import polars as pl
import pytest

from multiradar.clock import FixedClock
from multiradar.diagnosis import findings, held_findings
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.held_findings import WINDOWS_MAX, HeldFindings
from multiradar.diagnosis.model import Diagnosis
from multiradar.runtime.live import live_diagnosis
from multiradar.runtime.live.live_diagnosis import (
    BUSY_SHARE,
    PIECE_S,
    REMAINDER_MIN_S,
    UNKNOWN_MAX,
    LiveDiagnosis,
)
from multiradar.runtime.live.threads import SystemThreads
from multiradar.runtime.picture.sensor_findings import add_findings, confirmed
from multiradar.storage.entries import RejectedRow
from support.fakes.engine_outputs import Update, output_of
from support.inputs.mistaken import RADARS, START_S, recording
from support.processes.waiting import wait_until

WRONG = recording().changed("1-10", range_m=pl.col("range_m") / 1e3)
RIGHT = recording()


def opened(data_time: Callable[[], float | None] = lambda: None) -> LiveDiagnosis:
    """Return one that checks on request only."""
    diagnosis = LiveDiagnosis(WRONG.table(), data_time, period_s=3600.0)
    diagnosis.start()
    return diagnosis


def checked(diagnosis: LiveDiagnosis) -> bool:
    """Check twice: the engine processes the last measurements of a window after its end."""
    assert not diagnosis.check()
    return diagnosis.check()


def window(diagnosis: LiveDiagnosis, frame: pl.DataFrame = RIGHT.frame) -> list[dict[str, str]]:
    """Diagnose a window of measurements; return the findings that hold after it."""
    diagnosis.record(frame, ())
    diagnosis.put(output_of([Update(1, START_S, 1)]))
    assert checked(diagnosis)
    return diagnosis.records()


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


def test_the_end_of_a_stream_ends_its_window() -> None:
    """A recording of half a minute was never diagnosed."""
    diagnosis = opened()
    diagnosis.record(WRONG.frame.filter(pl.col("time_s") < START_S + 45.0), ())
    diagnosis.put(output_of([Update(1, START_S, 1)]))
    assert not diagnosis.is_pending
    diagnosis.end_stream()
    wait_until(lambda: not diagnosis.is_pending, "the diagnosis")
    assert [(one["sensor_id"], one["code"]) for one in diagnosis.records()] == [
        ("1-10", "range_unit")
    ]
    diagnosis.stop()


def test_the_last_seconds_of_a_long_stream_are_not_diagnosed() -> None:
    diagnosis = opened()
    assert window(diagnosis) == []
    diagnosis.record(WRONG.frame.filter(pl.col("time_s") < START_S + REMAINDER_MIN_S - 5.0), ())
    diagnosis.end_stream()
    wait_until(lambda: not diagnosis.is_pending, "the diagnosis")
    assert diagnosis.records() == []
    diagnosis.stop()


def test_a_failed_diagnosis_of_the_end_of_a_stream_is_not_pending(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(evidence: object) -> list[Diagnosis]:
        raise ValueError(evidence)

    monkeypatch.setattr(live_diagnosis, "diagnose", fail)
    diagnosis = opened()
    diagnosis.record(WRONG.frame, ())
    diagnosis.end_stream()
    wait_until(lambda: not diagnosis.is_pending, "the diagnosis")
    diagnosis.stop()


def test_a_stop_abandons_the_diagnosis(monkeypatch: pytest.MonkeyPatch) -> None:
    """With 105 sensors, a service stopped only after minutes."""
    diagnosis = opened()
    completed: list[list[Diagnosis]] = []

    def stopped_meanwhile(evidence: Evidence) -> list[Diagnosis]:
        diagnosis.stop()
        found = findings.diagnose(evidence)
        completed.append(found)
        return found

    monkeypatch.setattr(live_diagnosis, "diagnose", stopped_meanwhile)
    diagnosis.record(WRONG.frame, ())
    assert not checked(diagnosis)
    assert not completed
    assert not diagnosis.records()


@pytest.mark.fault(12)
def test_records_of_unknown_sources_alone_are_reported_once_with_the_sources(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Nothing was accepted, and nothing was said."""
    diagnosis = opened()
    reason = "no sensor in the sensors file has this SAC and SIC: 26-11"
    with caplog.at_level(logging.WARNING):
        for _ in range(2):
            for _ in range(UNKNOWN_MAX):
                row = RejectedRow(0, "UNKNOWN_SENSOR", reason, "30 00 1a")
                diagnosis.record(RIGHT.frame.clear(), [row])
            assert checked(diagnosis)
    (found,) = diagnosis.records()
    assert found["code"] == "sensors_of_another_recording"
    assert "26-11" in found["sentence"]
    assert len([one for one in caplog.records if "26-11" in one.getMessage()]) == 1
    diagnosis.stop()


def test_a_finding_is_reported_for_its_sensor_and_logged_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    diagnosis = opened()
    with caplog.at_level(logging.WARNING):
        for _ in range(2):
            diagnosis.record(WRONG.frame, ())
            assert checked(diagnosis)
    (found,) = diagnosis.records()
    assert (found["sensor_id"], found["code"]) == ("1-10", "range_unit")
    records: list[dict[str, Any]] = [{"id": name, "health": None} for name in ("1-10", "2-10")]
    add_findings(records, [found])
    assert [one["diagnoses"] for one in records] == [[found], []]
    said = [record.getMessage() for record in caplog.records]
    assert len(said) == 1
    assert said[0].startswith("diagnosis: 1-10: its ranges are probably in kilometres")
    diagnosis.stop()


@pytest.mark.slow
def test_a_finding_holds_until_three_windows_in_a_row_have_not_found_it() -> None:
    diagnosis = opened()
    (found,) = window(diagnosis, WRONG.frame)
    for _ in range(2):
        for _ in range(WINDOWS_MAX - 1):
            assert window(diagnosis) == [found]
        assert window(diagnosis, WRONG.frame) == [found]
    for _ in range(WINDOWS_MAX - 1):
        assert window(diagnosis) == [found]
    assert window(diagnosis) == []
    diagnosis.stop()


@pytest.mark.slow
def test_windows_without_the_sensor_do_not_refute_a_finding() -> None:
    diagnosis = opened()
    (found,) = window(diagnosis, WRONG.frame)
    silent = RIGHT.only("2-10", "3-10").frame
    for _ in range(2 * WINDOWS_MAX):
        assert found in window(diagnosis, silent)
    diagnosis.stop()


@pytest.mark.slow
def test_findings_of_a_past_time_are_those_that_held_then() -> None:
    times_s = iter([START_S, *(START_S + 60.0 * one for one in range(1, WINDOWS_MAX + 1))])
    diagnosis = opened(lambda: next(times_s))
    (found,) = window(diagnosis, WRONG.frame)
    for _ in range(WINDOWS_MAX):
        window(diagnosis)
    assert diagnosis.records() == []
    assert diagnosis.records(START_S - 1.0) == []
    # A page may round the time down.
    for at_s in (START_S - 0.0005, START_S, START_S + 179.0):
        assert diagnosis.records(at_s) == [found]
    assert diagnosis.records(START_S + 180.0) == []
    diagnosis.stop()


def test_a_changed_sensor_or_a_restart_ends_a_finding() -> None:
    table = WRONG.table()
    diagnosis = opened()
    (found,) = window(diagnosis, WRONG.frame)
    diagnosis.use(WRONG.configured("2-10", range_sigma_m=77.0).table())
    assert diagnosis.records() == [found]
    diagnosis.use(WRONG.configured("1-10", range_sigma_m=77.0).table())
    assert diagnosis.records() == []
    diagnosis.use(table)
    window(diagnosis, WRONG.frame)
    diagnosis.set_back()
    assert diagnosis.records() == [found]
    diagnosis.restart()
    assert diagnosis.records() == diagnosis.records(START_S + 1e6) == []
    diagnosis.stop()


def test_a_window_of_a_fast_replay_says_nothing_of_ends_of_recordings() -> None:
    """A radar that stops is silent until it sends again, which its alarm says."""
    ended = (pl.col("sensor_id") == "1-10") & (pl.col("time_s") > START_S + 30.0)
    frame = RIGHT.frame.filter(~ended)
    slow = frame.with_columns(time_s=START_S + 20.0 * (pl.col("time_s") - START_S))
    diagnosis = opened()
    assert "ends_early" not in [one["code"] for one in window(diagnosis, slow)]
    diagnosis.stop()


def test_a_held_finding_has_the_newest_sentence_in_its_place() -> None:
    held = HeldFindings()
    first = [Diagnosis("1-10", "site", "1.9 km"), Diagnosis("", "no_tracks", "none")]
    assert held.update(first, {"1-10"}, 10.0) == first
    again = Diagnosis("1-10", "site", "2.0 km", "warning")
    assert held.update([again], {"1-10"}, 20.0) == []
    assert held.at() == (again, first[1])
    assert held.at(19.0) == tuple(first)


def test_findings_and_their_changes_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(held_findings, "FINDINGS_MAX", 3)
    held = HeldFindings()
    for number in range(held_findings.CHANGES_MAX + 5):
        held.update([Diagnosis(f"x{number}", "unknown", "x")], set(), float(number))
    assert len(held.at()) == 3
    assert held.at(4.0) == ()
    assert len(held.at(5.0)) == 3


def test_rows_that_were_rejected_count_for_their_sensor() -> None:
    diagnosis = opened()
    right = recording().frame
    raw = json.dumps({"sensor_id": "1-10", "range_m": 1e9})
    diagnosis.put(output_of([Update(1, START_S, 1)]))
    rejects = [RejectedRow(row, "OUT_OF_RANGE", "too far", raw) for row in range(900)]
    diagnosis.record(right, [*rejects, RejectedRow(900, "MALFORMED_JSON", "no JSON", "{")])
    checked(diagnosis)
    (found,) = diagnosis.records()
    assert (found["sensor_id"], found["code"]) == ("1-10", "measurements_lost")
    assert "900 OUT_OF_RANGE" in found["sentence"]
    diagnosis.stop()


def test_rows_kept_without_their_content_are_not_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Most rows of a storm: decoding an empty text costs more than all else about such a row."""
    decoded: list[str] = []

    def loads(text: str) -> Any:
        decoded.append(text)
        return json.loads(text)

    monkeypatch.setattr(live_diagnosis, "json", SimpleNamespace(loads=loads))
    diagnosis = opened()
    raw = json.dumps({"sensor_id": "1-10"})
    rejects = [RejectedRow(row, "RATE_EXCEEDED", "too many", "") for row in range(1, 900)]
    diagnosis.record(recording().frame, [RejectedRow(0, "RATE_EXCEEDED", "x", raw), *rejects])
    assert decoded == [raw]
    diagnosis.stop()


def test_a_nested_row_has_no_sensor() -> None:
    """It ended the service: reading it again raised RecursionError in the writer's thread."""
    diagnosis = opened()
    nested = "[" * 1500 + "]" * 1500
    diagnosis.record(recording().frame, [RejectedRow(0, "MALFORMED_JSON", "too deep", nested)])
    diagnosis.stop()


def test_before_the_start_nothing_is_retained() -> None:
    diagnosis = LiveDiagnosis(WRONG.table())
    diagnosis.record(WRONG.frame, ())
    assert not checked(diagnosis)
    diagnosis.stop()


@pytest.mark.fault(13)
def test_a_site_alarm_is_a_consequence_while_the_wrong_site_is_that_of_another_radar() -> None:
    latitude_deg = RADARS["1-10"][0][0] + 0.01
    displaced = recording().configured("1-10", latitude_deg=latitude_deg)
    diagnosis = LiveDiagnosis(displaced.table(), period_s=3600.0)
    diagnosis.start()
    alarms = ["noise", "site"]
    assert confirmed("2-10", alarms, diagnosis.records()) == alarms
    diagnosis.record(displaced.frame, ())
    assert checked(diagnosis)
    found = diagnosis.records()
    assert [(one["sensor_id"], one["code"]) for one in found] == [("1-10", "site")]
    assert confirmed("1-10", alarms, found) == alarms
    assert confirmed("2-10", alarms, found) == ["noise"]
    health = {"alarms": "noise,site", "noise": 2.0}
    records: list[dict[str, Any]] = [{"id": one, "health": health} for one in ("1-10", "2-10")]
    add_findings(records, found)
    assert [one["health"] for one in records] == [health, {**health, "alarms": "noise"}]
    diagnosis.stop()


class _Ticking(FixedClock):
    # A clock that goes on with each look at it.
    def monotonic_s(self) -> float:
        self.advance(2.0 * PIECE_S)
        return super().monotonic_s()


class _Noted(threading.Event):
    # An event that notes how long it was waited for, and does not wait.
    def __init__(self, waits_s: list[float | None]) -> None:
        super().__init__()
        self._waits_s = waits_s

    def wait(self, timeout: float | None = None) -> bool:
        self._waits_s.append(timeout)
        return self.is_set()


class _NotedThreads(SystemThreads):
    def __init__(self) -> None:
        self.waits_s: list[float | None] = []

    def event(self) -> _Noted:
        return _Noted(self.waits_s)


def test_a_diagnosis_leaves_most_of_a_core_to_the_engine() -> None:
    """One of 105 sensors used more than a core, all the time."""
    threads, period_s = _NotedThreads(), 3600.0
    diagnosis = LiveDiagnosis(WRONG.table(), period_s=period_s, threads=threads, clock=_Ticking())
    diagnosis.start()
    diagnosis.record(WRONG.frame, ())
    wait_until(diagnosis.records, "a finding")
    diagnosis.stop()
    pauses_s = [one for one in threads.waits_s if one != period_s]
    assert len(pauses_s) > len(RADARS)
    each_s = 2.0 * PIECE_S * (1.0 / BUSY_SHARE - 1.0)
    assert pauses_s == pytest.approx([each_s] * len(pauses_s))
