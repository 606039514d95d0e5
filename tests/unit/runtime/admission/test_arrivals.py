"""Arrival delays are counted by sensor, with a warning where the horizon is too short."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from multiradar.runtime.admission.admission_by_time import Admission
from multiradar.runtime.admission.arrivals import DELAY_MAX_S, DELAY_STEP_S, ArrivalBoard
from multiradar.tracking.input.measurements import MeasurementBatch
from support.inputs.batches import batch_of
from support.processes.live_services import TABLE, Starter, services, settled, submit
from support.scenarios.live_scene import recording

HORIZON_S = 6.0


@pytest.fixture
def start() -> Iterator[Starter]:
    """Start services that are stopped at the end."""
    with services() as starter:
        yield starter


def delayed(delay_s: np.ndarray[tuple[int], np.dtype[np.float64]]) -> MeasurementBatch:
    """Two sensors that measure alternately once a second, the second with these delays."""
    count = len(delay_s)
    time_s = np.repeat(np.arange(count, dtype=np.float64), 2)
    sensor = np.tile([0, 1], count).astype(np.int32)
    # A little more, so that what is measured at the moment of arrival has come before.
    arrival_s = time_s + np.where(sensor == 1, np.repeat(delay_s, 2) + 1e-3, 0.0)
    order = np.argsort(arrival_s, kind="stable")
    rows = batch_of(time_s.tolist())
    return replace(rows, sensor=sensor).select(order)


def counted(batch: MeasurementBatch, size: int = 10**6) -> ArrivalBoard:
    board = ArrivalBoard(TABLE, HORIZON_S)
    admission = Admission(HORIZON_S, len(TABLE), arrivals=board)
    for first in range(0, len(batch), size):
        admission.admit(batch.select(slice(first, first + size)))
    return board


def test_the_delay_of_a_sensor_is_that_behind_the_data_time() -> None:
    delay_s = np.where(np.arange(1000) % 50 == 0, 5.0, 2.0)
    records = counted(delayed(delay_s)).records()
    steady, slow = records["41-10"], records["41-20"]
    assert steady["delay_s_median"] == steady["delay_s_p99"] == 0.0
    assert slow["delay_s_median"] == pytest.approx(2.0, abs=2 * DELAY_STEP_S)
    assert slow["delay_s_p99"] == pytest.approx(5.0, abs=2 * DELAY_STEP_S)
    assert (slow["received"], slow["late"], slow["future"]) == (1000, 0, 0)
    assert "adsb" not in records


def test_delays_do_not_depend_on_batches() -> None:
    batch = delayed(np.random.default_rng(1).uniform(0.0, 9.0, 400))
    expected = counted(batch).records()
    assert expected["41-20"]["late"] > 50
    for size in (1, 7):
        assert counted(batch, size).records() == expected


@pytest.mark.parametrize(("late", "warned"), [(9, False), (30, True)])
def test_a_warning_is_issued_for_a_short_horizon(late: int, warned: bool) -> None:
    delay_s = np.full(1000, 1.0)
    delay_s[100 : 100 + 20 * late : 20] = 8.0
    board = counted(delayed(delay_s))
    assert board.records()["41-20"]["late"] == late
    sentences = board.warnings()
    assert len(sentences) == warned
    if warned:
        assert sentences[0].startswith("41-20: 30 of 1000 measurements (3.0%) arrived later than")
        assert "99th percentile 8" in sentences[0]


def test_endless_delays_and_wrong_clocks_are_counted_too() -> None:
    batch = batch_of([1000.0, 1000.0, 1.0, 5000.0])
    batch = replace(batch, sensor=np.array([0, 1, 0, 0], np.int32))
    record = counted(batch).records()["41-10"]
    assert (record["received"], record["late"], record["future"]) == (3, 1, 1)
    assert record["delay_s_p99"] >= DELAY_MAX_S
    only_future = ArrivalBoard(TABLE, HORIZON_S)
    only_future.count(batch_of([1.0]), np.array([2], np.int8), np.zeros(1))
    assert only_future.records()["41-10"]["delay_s_median"] is None
    assert only_future.warnings() == []


def test_the_status_shows_the_delays_and_warns(start: Starter) -> None:
    service = start()
    frame = recording(2000)
    late = frame.filter(pl.col("sensor_id") == "41-20").head(100)
    others = frame.filter(pl.col("sensor_id") != "41-20")
    submit(service, others)
    submit(service, late)
    status = settled(service)
    arrivals, warnings = status["arrivals"], status["warnings"]
    assert isinstance(arrivals, dict)
    assert isinstance(warnings, list)
    assert arrivals["41-20"]["late"] == 100
    assert [sentence[:5] for sentence in warnings] == ["41-20", "41-20"]
    assert "sensor clock" in warnings[1]
