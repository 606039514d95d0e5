"""Times of records: resolution of truncated times, missing times, scan period."""

import numpy as np
import pytest

from multiradar_converters.asterix.decoding.clocks import (
    ANTENNA,
    NONE,
    RECORD,
    RECORDER,
    TRUNCATED,
    Marks,
    nearest_day,
    times_of,
)
from multiradar_converters.asterix.decoding.services import NORTH, SECTOR, antenna_period_s
from multiradar_converters.asterix.decoding.timing import into_days
from multiradar_converters.asterix.table import repeated

NAN = float("nan")


DAY_S = 86_400.0


def marks(*rows: tuple[int, int, float, float, float], period_s: float = NAN) -> Marks:
    """Make marks of order, source, time, reception, sector."""
    table = np.array([(*row, period_s) for row in rows], dtype=np.float64).reshape(-1, 6)
    whole = table[:, :2].astype(np.int64)
    return Marks(whole[:, 0], whole[:, 1], table[:, 2], table[:, 3], table[:, 4], table[:, 5])


def timed(
    known: Marks,
    *,
    order: int = 10,
    time_s: float = NAN,
    truncated_s: float = NAN,
    azimuth_deg: float = NAN,
    received_s: float = NAN,
) -> tuple[float, int]:
    times, origin = times_of(
        order=np.array([order]),
        source=np.array([7]),
        time_s=np.array([time_s]),
        truncated_s=np.array([truncated_s]),
        azimuth_deg=np.array([azimuth_deg]),
        received_s=np.array([received_s]),
        marks=known,
    )
    return float(times[0]), int(origin[0])


def test_the_records_own_time_goes_first() -> None:
    assert timed(marks((1, 7, 50.0, NAN, 0.0)), time_s=40.0, truncated_s=3.0) == (40.0, RECORD)


def test_an_invalid_time_of_day_is_absent() -> None:
    assert timed(marks(), time_s=86_400.0)[1] == NONE
    assert timed(marks())[1] == NONE


@pytest.mark.parametrize("passed", [-255.0, -1.0, 0.0, 3.5, 255.0])
def test_a_truncated_time_is_restored_within_half_its_period(passed: float) -> None:
    time = 30_000.0 + passed
    known = marks((1, 7, 30_000.0, NAN, 0.0))
    assert timed(known, truncated_s=time % 512) == (time, TRUNCATED)


def test_the_last_mark_before_the_record_counts() -> None:
    known = marks((1, 7, 1000.0, NAN, 0.0), (5, 7, 2000.0, NAN, 0.0), (20, 7, 9000.0, NAN, 0.0))
    assert timed(known, truncated_s=2100.0 % 512)[0] == 2100.0


def test_the_recorders_clock_moves_the_reference_on() -> None:
    """The radar's service messages fell silent for ten minutes."""
    known = marks((1, 7, 1000.0, 1003.0, 0.0))
    assert timed(known, truncated_s=1600.0 % 512, received_s=1603.0)[0] == 1600.0


def test_the_recorders_clock_is_the_reference_where_the_radar_gives_none() -> None:
    known = marks((1, 8, 99.0, NAN, NAN))
    assert timed(known, truncated_s=1600.0 % 512, received_s=1601.0) == (1600.0, TRUNCATED)


def test_another_radars_time_is_the_reference_where_there_is_no_other() -> None:
    assert timed(marks((1, 8, 1601.0, NAN, NAN)), truncated_s=1600.0 % 512)[0] == 1600.0


@pytest.mark.parametrize(("azimuth", "time"), [(90.0, 101.0), (350.0, 100.0 - 1 / 9)])
def test_without_any_time_the_antenna_reports_it(azimuth: float, time: float) -> None:
    known = marks((1, 7, 100.0, NAN, 0.0), period_s=4.0)
    found, origin = timed(known, azimuth_deg=azimuth)
    assert found == pytest.approx(time)
    assert origin == ANTENNA


def test_without_a_scan_period_the_recorders_clock_is_used() -> None:
    known = marks((1, 7, 100.0, 100.5, 0.0))
    assert timed(known, azimuth_deg=90.0, received_s=102.0) == (102.0, RECORDER)


def test_truncated_times_pass_midnight() -> None:
    """The standard lets the time of day begin at 0 then, and a day is no multiple of 512 s."""
    before, after = marks((1, 7, 86_399.0, NAN, 0.0)), marks((1, 7, 1.0, NAN, 0.0))
    assert timed(before, truncated_s=2.0)[0] == 2.0
    assert timed(after, truncated_s=86_398.0 % 512)[0] == 86_398.0
    assert timed(before, truncated_s=86_390.0 % 512)[0] == 86_390.0


def test_the_recorders_clock_moves_the_reference_over_midnight() -> None:
    known = marks((1, 7, 86_000.0, 86_003.0, NAN))
    assert timed(known, truncated_s=100.0, received_s=103.0)[0] == 100.0


def test_times_are_moved_to_the_nearest_period() -> None:
    assert nearest_day(np.array([1.0, 86_399.0]), 86_400.0).tolist() == [86_401.0, 86_399.0]


def scan_period(*rows: tuple[int, float, float, float]) -> float:
    message, time, sector, stated = (np.array(column) for column in zip(*rows, strict=True))
    return antenna_period_s(message, time, sector, stated)


def test_the_scan_period_follows_from_north_marks_though_some_are_missing() -> None:
    times = [k * 4.0 for k in range(10) if k not in (3, 7)]
    assert scan_period(*((NORTH, time, 0.0, NAN) for time in times)) == 4.0


def test_the_scan_period_follows_from_sectors_if_north_marks_are_too_few() -> None:
    rows = [(SECTOR, 100.0 + k * 0.25, 22.5 * k % 360, NAN) for k in range(1, 10)]
    assert scan_period(*rows) == pytest.approx(4.0)


def test_the_reported_scan_period_is_used_without_marks() -> None:
    assert scan_period((NORTH, 100.0, 0.0, 5.0)) == 5.0
    assert np.isnan(scan_period((NORTH, 100.0, 0.0, NAN)))


def test_a_time_an_hour_from_the_others_of_its_source_is_not_kept() -> None:
    times = np.array([100.0, 101.0, 40_000.0, 102.0, 103.0])
    kept = into_days(times, np.array([1, 1, 1, 1, 1]))
    assert kept.tolist() == [True, True, False, True, True]


def test_a_source_whose_clock_is_wrong_by_hours_keeps_its_own_time() -> None:
    times = np.array([100.0, 40_000.0, 101.0, 40_001.0])
    assert into_days(times, np.array([1, 2, 1, 2])).all()
    assert times.tolist() == [100.0, 40_000.0, 101.0, 40_001.0]


@pytest.mark.parametrize(
    ("starts_s", "until_s", "days"),
    [
        # The second radar starts its reports long after midnight.
        ((72_000.0, 1_800.0), 16_200.0, (0, 1)),
        ((84_600.0, 7_200.0), 9_000.0, (0, 1)),
        # Almost at once, about midnight: the file starts on the day before.
        ((2.0, 86_398.0), 0.0, (1, 0)),
        ((86_398.0, 2.0), 0.0, (0, 1)),
        # A recording from after midnight, of which one radar starts before the next midnight.
        ((600.0, 84_600.0), 84_000.0, (0, 0)),
        # Never before the first day, except about midnight.
        ((3_000.0, 80_000.0), 0.0, (0, 0)),
    ],
)
def test_a_source_starts_on_the_day_nearest_to_the_times_before_it(
    starts_s: tuple[float, float], until_s: float, days: tuple[int, int]
) -> None:
    """The first one has reports each 10 min until the second one starts, and then both have."""
    first = starts_s[0] + np.arange(0.0, until_s + 3600.0, 600.0)
    second = starts_s[1] + np.arange(0.0, 3600.0, 600.0)
    source = np.concatenate([np.full(len(first), 1), np.full(len(second), 2)])
    order = np.argsort(
        np.concatenate([first - first[0], second - second[0] + until_s + 1.0]), kind="stable"
    )
    times = np.concatenate([first, second])
    expected = (times + DAY_S * np.array(days)[source - 1])[order]
    times, source = times[order] % DAY_S, source[order]
    assert into_days(times, source).all()
    assert times.tolist() == expected.tolist()


@pytest.mark.parametrize(
    ("start_s", "expected_s"),
    [(72_000.0, 72_000.0), (1_800.0, 88_200.0), (36_000.0, 122_400.0), (60_000.0, 60_000.0)],
)
def test_a_source_after_the_end_of_the_others_is_nearest_to_the_span_of_their_times(
    start_s: float, expected_s: float
) -> None:
    """Recordings of two radars, joined; the first one is of a night, from 20:00 to 9:00."""
    first = np.arange(72_000.0, 118_800.0, 600.0)
    second = start_s + np.arange(0.0, 3600.0, 600.0)
    times = np.concatenate([first, second]) % DAY_S
    source = np.concatenate([np.full(len(first), 1), np.full(len(second), 2)])
    assert into_days(times, source).all()
    assert times[len(first)] == expected_s


def test_equal_octets_of_one_source_within_a_second_are_one_record() -> None:
    same = np.array([5, 5, 5, 5, 6])
    source = np.array([1, 1, 2, 1, 1])
    times = np.array([10.0, 10.5, 10.0, 14.0, 10.0])
    assert repeated(same, source, times).tolist() == [False, True, False, False, False]


def test_sectors_that_repeat_or_go_back_in_time_do_not_count() -> None:
    rows = [(SECTOR, 100.0 + k * 0.25, 22.5 * k % 360, NAN) for k in range(1, 10)]
    repeated_sector = (SECTOR, 102.375, 202.5, NAN)
    assert scan_period(*rows, repeated_sector) == pytest.approx(4.0)
    # The clock steps back by 0.1 s between two sectors and continues from there.
    stepped = [(SECTOR, time - 0.6, sector, NAN) for _, time, sector, _ in rows]
    later = [(SECTOR, time, (sector + 225.0) % 360, NAN) for _, time, sector, _ in stepped]
    whole = [*rows, *((kind, time + 2.0, sector, said) for kind, time, sector, said in later)]
    assert scan_period(*whole) == pytest.approx(4.0)
