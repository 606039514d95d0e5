"""Days of files in order of time."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from multiradar_converters.asterix import file_order
from multiradar_converters.asterix.file_order import FileOrder, FileTimes, joined_times

DAY_S = 86_400.0
HOUR_S = 3_600.0
DATE_S = 20_000 * DAY_S
#: Seed of the records of a file, and their sensor.
SAME, OTHER, SENSOR, SECOND_SENSOR = 1, 2, 17, 18


def times(
    *spans_s: tuple[float, float],
    seed: int = 0,
    sensor: int = SENSOR,
    received_s: float = np.nan,
    step_s: float | None = None,
) -> FileTimes:
    """Return records of some spans; the hash of each follows from the seed and its time."""
    time_s = np.concatenate(
        [np.array(span) if step_s is None else np.arange(*span, step_s) for span in spans_s]
    )
    record = (time_s * 128.0).astype(np.int64) * 2654435761 % (1 << 31) + (seed << 31)
    return FileTimes(time_s, time_s + received_s, np.full(len(time_s), sensor), record)


def days_of(*files: FileTimes) -> tuple[list[float], FileOrder]:
    order = FileOrder()
    return [order.add(f"{number}", [one]) / DAY_S for number, one in enumerate(files)], order


@pytest.mark.parametrize(
    ("spans_s", "days"),
    [
        (((0.0, 3600.0), (3600.0, 7200.0)), [0, 0]),
        # Two recorders at the same time.
        (((100.0, 3600.0), (0.0, 3500.0)), [0, 0]),
        # Past midnight, and past the next one.
        (((82_800.0, 86_399.0), (0.0, 3600.0), (80_000.0, 86_000.0), (5.0, 9.0)), [0, 1, 1, 2]),
        # The first one goes on past midnight itself.
        (((82_800.0, 90_000.0), (3600.0, 7200.0)), [0, 1]),
        # A night, and the morning after it.
        (((72_000.0, 115_200.0), (32_400.0, 36_000.0)), [0, 1]),
    ],
)
def test_files_in_order_of_time(spans_s: tuple[tuple[float, float], ...], days: list[int]) -> None:
    found, order = days_of(*(times(one) for one in spans_s))
    assert (found, order.exchanged, order.moved) == (days, [], [])


def test_a_file_before_the_previous_one_is_named() -> None:
    days, order = days_of(times((3600.0, 7200.0)), times((0.0, 3000.0)))
    assert (days, order.exchanged) == ([0.0, 0.0], [("1", "0")])


def test_a_file_without_times_changes_nothing() -> None:
    nothing = joined_times([])
    assert days_of(times((80_000.0, 80_000.0)), nothing, times((10.0, 10.0)))[0] == [0, 0, 1]
    assert days_of(nothing, times((10.0, 10.0)))[0] == [0, 0]


@pytest.mark.parametrize("step_s", [0.5, 60.0, 6000.0])
def test_files_of_whole_days_follow_one_another(step_s: float) -> None:
    whole = [times((0.5, DAY_S), seed=seed, step_s=step_s) for seed in range(3)]
    days, order = days_of(*whole)
    assert days == [0, 1, 2]
    assert [one.split(",")[0] for one in order.moved] == [
        "1: placed on a later day than 0",
        "2: placed on a later day than 1",
    ]


# The same hours of another night, that goes on past midnight.
@pytest.mark.parametrize("starts_h", [(20.0, 20.0), (20.0, 19.0), (20.0, 23.0)])
def test_files_of_the_same_hours_of_different_nights_follow_one_another(
    starts_h: tuple[float, float],
) -> None:
    nights = [
        times((start_h * HOUR_S, 28.0 * HOUR_S), seed=seed, step_s=4.0)
        for seed, start_h in enumerate(starts_h)
    ]
    assert days_of(*nights)[0] == [0, 1]


@pytest.mark.parametrize(
    "second",
    [
        times((0.5, DAY_S), seed=SAME, step_s=4.0),
        # It starts later, or earlier, and has lost most records.
        times((25_920.5, DAY_S), seed=SAME, step_s=4.0),
        joined_times(
            [times((60.5, DAY_S), seed=SAME, step_s=12.0), times((0.25, 40.0), step_s=4.0)]
        ),
        # Another radar.
        times((0.5, DAY_S), seed=OTHER, sensor=SECOND_SENSOR, step_s=4.0),
    ],
)
def test_recorders_of_the_same_hours_are_of_one_day(second: FileTimes) -> None:
    days, order = days_of(times((0.5, DAY_S), seed=SAME, step_s=4.0), second)
    assert (days, order.moved) == ([0, 0], [])


def test_the_files_of_a_second_recorder_may_follow_those_of_the_first() -> None:
    night = [
        times((80_000.0, DAY_S), seed=SAME, step_s=4.0),
        times((0.0, 9000.0), seed=SAME, step_s=4.0),
    ]
    assert days_of(*night, *night)[0] == [0, 1, 0, 1]


def test_a_few_records_in_disorder_are_not_of_another_day() -> None:
    """The second file starts with five minutes of old records, one each minute."""
    first = times((0.0, 3600.0), seed=SAME, step_s=1.0)
    late = times((3000.0, 3600.0), seed=OTHER, step_s=60.0)
    second = joined_times([late, times((3600.0, 7200.0), seed=OTHER, step_s=1.0)])
    assert days_of(first, second)[0] == [0, 0]


def test_captures_are_of_their_dates() -> None:
    def dated(day: int, seed: int) -> FileTimes:
        return times((0.5, DAY_S), seed=seed, received_s=DATE_S + day * DAY_S + 0.3, step_s=60.0)

    days, order = days_of(dated(0, 1), dated(1, 2), dated(4, 3))
    assert (days, order.moved, order.exchanged) == ([0, 1, 4], [], [])
    days, order = days_of(dated(1, 2), dated(0, 1))
    assert (days, order.moved, order.exchanged) == ([0, -1], [], [("1", "0")])
    # A capture of a replay has other times of day.
    replayed = times((0.5, DAY_S), seed=OTHER, received_s=DATE_S + 0.25 * DAY_S, step_s=60.0)
    assert days_of(dated(0, 1), replayed)[0] == [0, 1]


def test_equal_status_does_not_prove_the_same_day() -> None:
    """Status of fixed phase is the same on all days."""

    def tracks_and_status(seed: int) -> FileTimes:
        tracks = times((0.5, DAY_S), seed=seed, sensor=256 + 62, step_s=4.0)
        return joined_times([tracks, times((0.0, DAY_S), sensor=256 + 63, step_s=5.0)])

    days, order = days_of(tracks_and_status(SAME), tracks_and_status(OTHER))
    assert (days, len(order.moved)) == ([0, 1], 1)
    days, order = days_of(tracks_and_status(SAME), tracks_and_status(SAME))
    assert (days, order.moved) == ([0, 0], [])


def test_equal_records_of_other_minutes_do_not_prove_the_same_day() -> None:
    first = times((0.5, DAY_S), seed=SAME, step_s=4.0)
    second = replace(first, record=np.roll(first.record, 1000))
    assert days_of(first, second)[0] == [0, 1]


@pytest.mark.parametrize(
    ("seed", "days"), [(SAME, [0, 1, 1]), (OTHER, [0, 1, 2])], ids=["equal", "different"]
)
def test_records_without_a_time_of_day_only_contradict(seed: int, days: list[float]) -> None:
    """Clutter looks the same on all days."""
    second, third = (
        replace(one, record=~one.record)
        for one in (times((0.5, DAY_S), seed=one, step_s=4.0) for one in (SAME, seed))
    )
    assert days_of(times((0.5, DAY_S), seed=OTHER, step_s=4.0), second, third)[0] == days


@pytest.mark.parametrize(
    ("files", "days", "notes"),
    [
        # Files of two sensors and two days: the sensor, and the seed of the day.
        ([(SENSOR, 1), (SENSOR, 2), (SECOND_SENSOR, 1), (SECOND_SENSOR, 2)], [0, 1, 0, 1], 3),
        ([(SENSOR, 1), (SECOND_SENSOR, 1), (SENSOR, 2), (SECOND_SENSOR, 2)], [0, 0, 1, 1], 2),
    ],
)
def test_files_of_other_sensors_start_on_the_first_day_of_their_hours(
    files: list[tuple[int, int]], days: list[float], notes: int
) -> None:
    found, order = days_of(
        *(
            times((8.0 * HOUR_S, 18.0 * HOUR_S), seed=seed, sensor=sensor, step_s=4.0)
            for sensor, seed in files
        )
    )
    assert (found, order.exchanged) == (days, [])
    assert len(order.moved) == notes


def test_the_windows_of_a_file_are_read_one_by_one() -> None:
    first, second = (times((0.5, DAY_S), seed=seed, step_s=4.0) for seed in (SAME, OTHER))
    order = FileOrder()
    order.add("a", [first])
    nothing = joined_times([])
    parts = (second.select(second.time_s // HOUR_S == hour) for hour in range(24))
    assert order.add("b", (one for part in parts for one in (nothing, part))) == DAY_S
    assert order.moved


@pytest.mark.parametrize("seed", [SAME, OTHER])
def test_large_files_are_compared_by_samples(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file_order, "SAMPLE_MAX", 3000)
    first = times((0.0, DAY_S), seed=SAME, step_s=4.0)
    second = times((0.0, DAY_S), seed=seed, step_s=4.0)
    order = FileOrder()
    order.add("a", [first])
    parts: Sequence[FileTimes] = [second.select(second.time_s < 100.0), second]
    assert order.needs_all(parts[0])
    assert order.add("b", [second]) == (0.0 if seed == SAME else DAY_S)


def test_the_first_records_of_a_file_that_follows_suffice() -> None:
    order = FileOrder()
    assert not order.needs_all(times((0.0, 10.0)))
    order.add("a", [times((0.0, 10.0))])
    order.extend(times((10.0, 3600.0), step_s=4.0))
    assert not order.needs_all(times((3600.0, 3610.0)))
    assert order.needs_all(times((3000.0, 3610.0)))
