"""Clock offset and latency from times of reception, and the alarms about them."""

import numpy as np
import pytest

from multiradar_converters.asterix.decoding.sensor_clocks import (
    SensorClock,
    clock_alarm,
    differences,
    joined,
    receiver_zone_s,
    sensor_clocks,
)

DAY_S = 86_400.0
RADAR, OTHER = 0x1482, 0x1483
HOUR_S = 3600.0


def found(
    latency_s: float, *, source: int = RADAR, ahead_s: float = 0.0, zone_s: float = 0.0,
    start_s: float = 43_200.0, marks: bool = True,
) -> SensorClock:  # fmt: skip
    """Return the clock of 1000 plots with a latency spread over 0.3 s, and of north marks."""
    true_s = start_s + np.arange(1000.0)
    spread_s = np.random.default_rng(7).uniform(0.0, 0.3, 1000)
    plots = differences(
        np.full(1000, source),
        (true_s + ahead_s) % DAY_S,
        (true_s + latency_s + spread_s + zone_s) % DAY_S,
        reports=True,
    )
    services = differences(
        np.full(100, source),
        (true_s[::10] + ahead_s) % DAY_S,
        (true_s[::10] + 0.02 + zone_s) % DAY_S,
        reports=False,
    )
    clocks = sensor_clocks(joined([plots, services] if marks else [plots]))
    assert list(clocks) == [source]
    return clocks[source]


def code(one: SensorClock, zone_s: float = 0.0) -> str | None:
    """Return the code of the alarm."""
    alarm = clock_alarm(one, zone_s)
    return None if alarm is None else alarm[0]


def test_the_fastest_messages_give_the_offset_and_reports_the_latency() -> None:
    one = found(0.2, ahead_s=0.05)
    assert one.offset_s == pytest.approx(0.03, abs=1e-6)
    assert one.latency_min_s == pytest.approx(0.15, abs=0.01)
    assert one.latency_median_s == pytest.approx(0.30, abs=0.02)
    assert one.latency_p99_s == pytest.approx(0.45, abs=0.01)
    assert code(one) is None


@pytest.mark.parametrize("start_s", [0.0, 500.0, DAY_S - 500.0])
@pytest.mark.parametrize(
    ("ahead_s", "alarm", "words"),
    [
        (0.0, None, ""),
        (0.11, None, ""),
        (0.2, "clock", "0.18 s ahead of reception: the sensor clock is fast"),
        (-1.27, "clock", "1.29 s behind reception: the sensor clock is slow"),
        (-0.8, None, ""),
        (26.0 * 60.0, "clock", "26.0 min ahead of reception: the sensor clock is fast"),
        (18.1, "clock", "18.08 s ahead of reception: probably GPS time, 18 s ahead of UTC"),
        (37.0, "clock", "probably TAI time, 37 s ahead of UTC; set the sensor clock to UTC"),
        (20.0, "clock", "the sensor clock is fast"),
        (2.0 * HOUR_S, "clock", "120.0 min ahead of reception: probably local time, +2 h"),
        (-5.5 * HOUR_S, "clock", "probably local time, -5.5 h"),
    ],
)
def test_a_clock_that_is_off_raises_the_alarm_at_any_time_of_day(
    start_s: float, ahead_s: float, alarm: str | None, words: str
) -> None:
    one = found(0.1, ahead_s=ahead_s, start_s=start_s)
    assert code(one) == alarm
    assert words in (clock_alarm(one) or ("", ""))[1]


def test_late_reports_of_a_radar_whose_north_marks_are_fast_raise_another_alarm() -> None:
    assert code(found(1.9)) == "latency"
    assert code(found(1.9, marks=False)) == "clock"
    assert code(found(0.9)) is None


def test_times_of_reception_in_local_time_are_recognised_by_most_sensors() -> None:
    clocks = {RADAR: found(0.1, zone_s=2 * HOUR_S), OTHER: found(0.3, zone_s=2 * HOUR_S)}
    zone_s = receiver_zone_s(clocks)
    assert zone_s == 2 * HOUR_S
    assert [code(one, zone_s) for one in clocks.values()] == [None, None]
    late = found(0.1, zone_s=2 * HOUR_S, ahead_s=-60.0)
    assert code(late, receiver_zone_s(clocks | {1: late})) == "clock"


def test_an_offset_that_is_no_zone_is_an_alarm_of_every_sensor() -> None:
    clocks = {RADAR: found(0.1, ahead_s=1560.0), OTHER: found(0.3, ahead_s=1560.0)}
    assert receiver_zone_s(clocks) == 0.0


def test_single_wrong_times_and_few_messages_raise_no_alarm() -> None:
    time_s = 100.0 + np.arange(1000.0)
    received_s = time_s + 0.2
    time_s[::200] += 400.0
    clocks = sensor_clocks(differences(np.full(1000, RADAR), time_s, received_s, reports=True))
    assert code(clocks[RADAR]) is None
    few = differences(np.full(9, RADAR), time_s[:9] + 90.0, received_s[:9], reports=True)
    assert code(sensor_clocks(few)[RADAR]) is None


def test_messages_without_either_time_do_not_count() -> None:
    nothing = np.full(3, np.nan)
    assert sensor_clocks(differences(np.full(3, RADAR), nothing, np.ones(3), reports=True)) == {}
    assert sensor_clocks(differences(np.full(3, RADAR), np.ones(3), nothing, reports=True)) == {}


def test_unknown_figures_are_none_in_documents() -> None:
    found = differences(np.full(3, RADAR), np.ones(3), np.ones(3), reports=False)
    assert sensor_clocks(found)[RADAR].document() == {
        "messages": 3,
        "clock_offset_s": 0.0,
        "latency_min_s": None,
        "latency_median_s": None,
        "latency_p99_s": None,
    }
