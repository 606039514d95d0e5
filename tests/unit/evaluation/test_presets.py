"""Presets pass, fail, or are not applicable with too few samples."""

import numpy as np
import pytest

from multiradar.errors import UnknownPresetError
from multiradar.evaluation.measures.continuity import AircraftUpdates, TrackedPeriods
from multiradar.evaluation.measures.update_errors import UpdateErrors
from multiradar.evaluation.presets import PRESETS, Evidence, evaluate_presets, in_series


def errors(position_m: list[float], aircraft: list[int] | None = None) -> UpdateErrors:
    count = len(position_m)
    aircraft_index = np.zeros(count, np.int64) if aircraft is None else np.array(aircraft)
    other = np.zeros(count)
    time_s = 4.0 * np.arange(count, dtype=np.float64)
    position = np.array(position_m, np.float64)
    offset = np.column_stack([position, other])
    return UpdateErrors(
        np.arange(count), aircraft_index, time_s, position, other, offset, *([other] * 6)
    )


def evidence(found: UpdateErrors, interval_s: list[float] | None = None) -> Evidence:
    updates = AircraftUpdates(found.aircraft, found.time_s)
    where = TrackedPeriods(np.zeros(1, np.int64), np.zeros(1), np.full(1, 4.0 * len(found.time_s)))
    length = np.full(len(found.time_s), 4.0) if interval_s is None else np.array(interval_s)
    return Evidence(found, updates, where, length)


def outcomes(preset: str, given: Evidence) -> list[str]:
    return [str(one.outcome) for one in evaluate_presets([preset], given)]


def test_a_good_track_passes_everything() -> None:
    good = evidence(errors([100.0] * 400))
    assert {str(one.outcome) for one in evaluate_presets(tuple(PRESETS), good)} == {"pass"}


@pytest.mark.parametrize(
    ("preset", "rms_m", "limit_m"),
    [("ed142-enroute", 1, 350.0), ("ed142-tma", 0, 150.0), ("esassp-3nm", 0, 330.0),
     ("esassp-5nm", 0, 550.0)],
)  # fmt: skip
def test_the_root_mean_square_has_its_limit(preset: str, rms_m: int, limit_m: float) -> None:
    assert outcomes(preset, evidence(errors([limit_m] * 400)))[rms_m] == "pass"
    assert outcomes(preset, evidence(errors([limit_m + 0.1] * 400)))[rms_m] == "fail"


def test_one_bad_flight_fails_among_many_good_ones() -> None:
    position = [50.0] * 4000 + [331.0] * 40
    aircraft_index = [0] * 4000 + [1] * 40
    assert outcomes("esassp-3nm", evidence(errors(position, aircraft_index)))[0] == "fail"
    # A flight with few updates is not evaluated on its own.
    short = evidence(errors(position[:4020], aircraft_index[:4020]))
    assert outcomes("esassp-3nm", short)[0] == "pass"


def test_only_three_large_errors_in_a_row_of_one_aircraft_are_a_series() -> None:
    assert in_series(errors([600.0, 600.0, 10.0, 600.0, 600.0]), 555.0) == 0
    assert in_series(errors([10.0, 600.0, 600.0, 556.0, 10.0]), 555.0) == 3
    assert in_series(errors([600.0] * 4, [0, 0, 1, 1]), 555.0) == 0
    assert in_series(errors([600.0] * 4), 926.0) == 0
    three = evidence(errors([600.0] * 3 + [10.0] * 997))
    assert outcomes("esassp-3nm", three) == ["pass", "fail"]
    assert outcomes("esassp-5nm", three) == ["pass", "pass"]


def test_long_gaps_may_be_one_in_a_hundred() -> None:
    good = errors([50.0] * 400)
    assert outcomes("ed142-enroute", evidence(good, [4.0] * 396 + [16.4] * 4))[2] == "pass"
    assert outcomes("ed142-enroute", evidence(good, [4.0] * 395 + [16.4] * 5))[2] == "fail"


def test_too_few_samples_are_not_applicable() -> None:
    assert outcomes("ed142-enroute", evidence(errors([50.0] * 20))) == ["not applicable"] * 3
    assert outcomes("esassp-5nm", evidence(errors([]))) == ["not applicable"] * 2


def test_an_unknown_preset_is_reported_with_the_known_ones() -> None:
    with pytest.raises(UnknownPresetError, match=r"unknown preset 'x'; known: ed142-enroute, "):
        evaluate_presets(["x"], evidence(errors([1.0])))
