"""Clocks and units of a reference, seen in the errors of the tracks."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from multiradar.evaluation.measures.update_errors import UpdateErrors, errors_of_updates
from multiradar.evaluation.reference_checks import (
    clock_offset,
    height_unit,
    of_other_sensors,
    rejected_rows,
    shared_sensors,
    wide_gate,
)
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.trajectories import RejectedRow, RowCounts, Tracks
from support.scenarios.skies import reference_of, straight, tracks_of

TIMES_S = np.arange(0.0, 2000.0, 10.0)
SETTINGS = EvaluationSettings(settling_s=0.0)


def compared(
    late_s: float, speed_mps: float = 200.0, height_m: float = 9000.0
) -> tuple[Tracks, UpdateErrors]:
    """Return a track, and its errors from a reference whose clock is late."""
    tracks = tracks_of({1: straight(TIMES_S.tolist(), 0.0, 0.0, speed_mps, 0.0)})
    known = straight(TIMES_S.tolist(), -speed_mps * late_s, 0.0, speed_mps, 0.0)
    reference = reference_of({"a": known})
    heights = np.full(len(reference.time_s), height_m)
    aircraft = np.zeros(len(tracks.time_s), np.int64)
    return tracks, errors_of_updates(
        tracks, replace(reference, height_m=heights), aircraft, SETTINGS
    )


@pytest.mark.parametrize(
    ("late_s", "said"),
    [(1.5, "the tracks are 1.5 s ahead of the reference"), (-7.0, "7.0 s behind the reference")],
)
def test_the_clock_of_a_reference_is_named(late_s: float, said: str) -> None:
    (sentence,) = clock_offset(*compared(late_s))
    assert said in sentence
    assert sentence.endswith("check the clocks of the reference and of the sensors")


@pytest.mark.parametrize(("late_s", "speed_mps"), [(0.0, 200.0), (0.9, 200.0), (5.0, 20.0)])
def test_latency_and_slow_aircraft_are_no_clock(late_s: float, speed_mps: float) -> None:
    assert clock_offset(*compared(late_s, speed_mps)) == []


def test_errors_on_both_sides_are_no_clock() -> None:
    tracks, errors = compared(0.0)
    along_m = np.where(np.arange(len(errors.along_m)) % 10 < 6, 900.0, -900.0)
    assert clock_offset(tracks, replace(errors, along_m=along_m)) == []


@pytest.mark.parametrize(
    ("height_m", "said"),
    [
        (9000.0 / 0.3048, "heights of the reference are probably in feet"),
        (9000.0 * 0.3048, "heights of the tracks are probably in feet"),
        (9000.0 / 30.48, "heights of the reference are probably in flight levels"),
        (9.0, "heights of the reference are probably in kilometres"),
        (90.0, "heights of the reference are probably in hundreds of metres"),
    ],
)
def test_the_unit_of_heights_is_named(height_m: float, said: str) -> None:
    (sentence,) = height_unit(*compared(0.0, height_m=height_m))
    assert sentence.startswith(said)


@pytest.mark.parametrize("height_m", [9000.0, 9120.0, 8000.0, np.nan, 0.0])
def test_other_heights_have_no_unit(height_m: float) -> None:
    assert height_unit(*compared(0.0, height_m=height_m)) == []


def test_tracks_that_used_the_reference_are_named() -> None:
    tracks, _ = compared(0.0)
    (sentence,) = shared_sensors(tracks, ("adsb", "radar"))
    assert sentence.startswith("100% of the updates are from radar, which is also the reference")
    assert shared_sensors(tracks, ("adsb",)) == []


def test_a_gate_wider_than_aircraft_are_apart_is_named() -> None:
    paths = {
        str(number): straight(TIMES_S.tolist(), 0.0, 20e3 * number, 200.0, 0.0)
        for number in range(5)
    }
    reference = reference_of(paths)
    (sentence,) = wide_gate(reference, EvaluationSettings(gate_m=200e3))
    assert sentence.startswith("gate 200000 m: half of the aircraft are within 20000 m of another")
    for gate_m in (1000.0, 2000.0, 15e3):
        assert wide_gate(reference, EvaluationSettings(gate_m=gate_m)) == []
    one = reference_of({"a": paths["0"]})
    assert wide_gate(one, EvaluationSettings(gate_m=200e3)) == []


def test_the_default_gate_is_right_for_close_aircraft() -> None:
    near = {
        str(number): straight(TIMES_S.tolist(), 0.0, 900.0 * number, 200.0, 0.0)
        for number in range(3)
    }
    assert wide_gate(reference_of(near), EvaluationSettings()) == []


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ({"r1", "r2"}, None),
        ({"r1", "r2", "r3"}, None),
        ({"r2"}, "r1 is not in this file, but updated tracks"),
        ({"x"}, "none of the sensors of the tracks (adsb, r1, r2) is in this file, which has x"),
    ],
)
def test_a_sensors_file_without_radars_of_the_tracks_is_reported(
    names: set[str], said: str | None
) -> None:
    tracks, _ = compared(0.0)
    sensor_id = np.resize(np.array(["r1", "r2", "adsb"]), len(tracks.time_s))
    tracks = replace(tracks, sensor_id=sensor_id, measured=np.ones(len(sensor_id), np.bool_))
    found = of_other_sensors(tracks, ["r1", "r2", "r4"], names, Path("sensors.toml"))
    assert len(found) == (said is not None)
    assert said is None or said in found[0]


@pytest.mark.parametrize(
    ("count", "rest"), [(1, ""), (3, ""), (4, "; and 1 more (--json, --html)")]
)
def test_three_rejected_rows_are_named_and_more_are_counted(count: int, rest: str) -> None:
    rejects = tuple(RejectedRow("a.csv", line, None, None, "no time") for line in range(count))
    (sentence,) = rejected_rows(RowCounts(read=9, rejects=rejects))
    named = "; ".join(map(str, rejects[:3]))
    assert sentence == f"{count} of 9 reference rows are rejected: {named}{rest}"
    assert rejected_rows(RowCounts(read=9)) == []
