"""Times without a date are placed on days by all files."""

from pathlib import Path

import numpy as np
import pytest

from multiradar_converters.adsb.day_times import DayClock, Flights, _Whole, day_clocks
from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.batches import Batch
from multiradar_converters.adsb.reading.files import open_source
from multiradar_converters.inspection.recordings import InspectionOptions, inspect
from support.scenarios.trajectories import csv_table, report

DAY_S = 86_400.0
#: First and last hour of a flight; each aircraft has one.
Flight = tuple[float, float]


def flights(*hours: Flight, by_time: bool, first: int = 1, longitude: float = 8.5) -> bytes:
    """Write a file by flight, or by time; times of day start again at midnight."""
    rows = [
        (
            time_s,
            report(
                time_s % 600.0,
                timestamp=time_s % DAY_S,
                icao24=f"{number:06x}",
                longitude=longitude,
            ),
        )
        for number, (begin_h, end_h) in enumerate(hours, first)
        for time_s in np.arange(begin_h * 3600.0, end_h * 3600.0, 60.0).tolist()
    ]
    if by_time:
        rows.sort(key=lambda one: one[0])
    return csv_table([row for _, row in rows])


def begins_h(folder: Path, *contents: bytes) -> dict[int, float]:
    """Return the hour at which each aircraft starts."""
    paths = [folder / f"{number}.csv" for number in range(len(contents))]
    for path, content in zip(paths, contents, strict=True):
        path.write_bytes(content)
    found: dict[int, float] = {}
    for path, clock in zip(paths, day_clocks(paths), strict=True):
        assert clock is not None
        for batch in open_source(path, lambda _: None).batches:
            clock.push(batch)
            address = batch.words[roles.ADDRESS - roles.FIRST_WORD].tolist()
            for one, time_s in zip(address, batch.numbers[roles.TIME].tolist(), strict=True):
                found[one] = min(found.get(one, np.inf), round(time_s / 3600.0, 5))
    return found


@pytest.mark.parametrize("by_time", [True, False])
@pytest.mark.parametrize(
    "hours",
    [
        [(8.0, 9.0), (15.0, 16.0), (22.0, 23.0)],
        # A night in which one flight passes midnight, and one in which it is the last.
        [(20.0, 21.0), (22.5, 24.5), (25.0, 26.0), (28.0, 29.0)],
        [(22.0, 23.5), (23.0, 24.5)],
        # Almost a day.
        [(6.0, 12.0), (12.5, 20.0), (20.5, 25.0), (26.0, 28.0)],
    ],
)
def test_the_order_of_a_file_does_not_matter(
    hours: list[Flight], by_time: bool, tmp_path: Path
) -> None:
    given = hours if by_time else hours[::-1]
    found = begins_h(tmp_path, flights(*given, by_time=by_time))
    assert list(found.values()) == [begin_h for begin_h, _ in given]


def test_a_later_flight_of_a_file_by_flight_is_on_the_same_day(tmp_path: Path) -> None:
    assert begins_h(tmp_path, flights((8.0, 9.0), (22.0, 23.0), by_time=False)) == {1: 8.0, 2: 22.0}


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        # One night in files that follow one another, or overlap by minutes.
        ([[(23.8, 24.2)], [(24.1, 24.4)]], [23.8, 24.1]),
        ([[(22.0, 22.9)], [(23.0, 23.9)], [(24.1, 25.0)]], [22.0, 23.0, 24.1]),
        # Several nights.
        ([[(20.0, 30.0)], [(30.1, 45.0)], [(45.5, 60.0)]], [20.0, 30.1, 45.5]),
        # Two receivers of one night.
        ([[(20.0, 28.0)], [(20.0, 28.0)]], [20.0, 20.0]),
        ([[(24.5, 28.0)], [(20.0, 28.0)]], [24.5, 20.0]),
        # A file for each flight of a day, in any order.
        ([[(22.0, 23.0)], [(8.0, 9.0)], [(12.0, 13.0)]], [22.0, 8.0, 12.0]),
    ],
)
def test_files_of_one_recording_are_on_its_days(
    files: list[list[Flight]], expected: list[float], tmp_path: Path
) -> None:
    contents = [
        flights(*hours, by_time=True, first=number) for number, hours in enumerate(files, 1)
    ]
    assert list(begins_h(tmp_path, *contents).values()) == expected


def test_a_file_that_starts_in_disorder_about_midnight_starts_before_it(tmp_path: Path) -> None:
    rows = [
        report(number, timestamp=time_s, icao24=f"{number + 1:06x}")
        for number, time_s in enumerate([3.0, 86_398.0, 5.0])
    ]
    found = begins_h(tmp_path, csv_table(rows))
    assert [round(hour * 3600.0) for hour in found.values()] == [86_403, 86_398, 86_405]


def test_the_figures_of_an_inspection_have_the_days(tmp_path: Path) -> None:
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    paths[0].write_bytes(flights((23.8, 24.2), by_time=True))
    paths[1].write_bytes(flights((24.1, 24.4), by_time=True, first=2))
    figures = inspect(paths, InspectionOptions(), lambda _: None).sensors["adsb", "adsb"]
    assert figures.first_s == pytest.approx(23.8 * 3600.0)
    assert figures.last_s == pytest.approx(24.4 * 3600.0 - 60.0)


@pytest.mark.parametrize("error_s", [-4000.0, 4000.0, -40_000.0, 20_000.0])
def test_wrong_times_of_a_few_reports_do_not_make_a_file_by_flight(
    error_s: float, tmp_path: Path
) -> None:
    """Of 26 hours with a pause at night, the morning was on the first day."""
    header, *rows = (
        flights((8.0, 22.0), (22.5, 23.5), (30.0, 34.0), by_time=True).decode().splitlines()
    )
    for number, place in enumerate((100, 300, 301, 900), 99):
        time_s = float(rows[place].split(",")[0]) + error_s
        wrong = report(0.0, timestamp=time_s % DAY_S, icao24=f"{number:06x}")
        rows.insert(place, csv_table([wrong]).decode().splitlines()[1])
    found = begins_h(tmp_path, "\n".join([header, *rows, ""]).encode())
    assert [found[number] for number in (1, 2, 3)] == [8.0, 22.5, 30.0]


@pytest.mark.parametrize(
    "hours", [[0.0, 5.0, 30.0, 31.0], [60.0, 61.0, 62.0, 20.0, 21.0, 22.0], [26.0, 27.0, 28.0]]
)
def test_times_that_continue_past_midnight_remain(hours: list[float], tmp_path: Path) -> None:
    rows = [
        report(number, timestamp=hour * 3600.0, icao24=f"{number + 1:06x}")
        for number, hour in enumerate(hours)
    ]
    assert list(begins_h(tmp_path, csv_table(rows)).values()) == hours


def test_a_wrong_time_past_midnight_is_not_that_of_a_file_that_continues(tmp_path: Path) -> None:
    rows = [
        report(number, timestamp=hour * 3600.0, icao24=f"{number + 1:06x}")
        for number, hour in enumerate([20.0, 20.5, 230.2, 21.0, 23.9, 0.1, 0.2])
    ]
    found = list(begins_h(tmp_path, csv_table(rows)).values())
    assert found == [20.0, 20.5, 14.2, 21.0, 23.9, 24.1, 24.2]


#: Day, and first and last hour, of the aircraft of each file, and the hour at which it starts.
Compared = tuple[list[tuple[int, float, float]], list[float]]
#: Two receivers of a whole day, and of two days.
WHOLE_DAYS: list[Compared] = [
    ([(0, 0.0, 24.0), (0, 0.0, 24.0)], [0.0, 0.0]),
    ([(0, 0.0, 24.0), (1, 0.0, 24.0)], [0.0, 24.0]),
    ([(0, 0.0, 24.0), (0, 0.0, 24.0), (1, 0.0, 24.0), (1, 0.0, 24.0)], [0.0, 0.0, 24.0, 24.0]),
    ([(0, 0.0, 24.0), (1, 0.0, 24.0), (0, 0.0, 24.0), (1, 0.0, 24.0)], [0.0, 24.0, 0.0, 24.0]),
]
PARTS_OF_DAYS: list[Compared] = [
    # The same hours of several days, the later ones with a note; and of one day.
    ([(0, 8.0, 18.0), (1, 8.0, 18.0)], [8.0, 32.0]),
    ([(0, 8.0, 18.0), (1, 8.0, 18.0), (2, 9.0, 12.0)], [8.0, 32.0, 57.0]),
    ([(0, 8.0, 18.0), (0, 9.0, 16.0)], [8.0, 9.0]),
    # A night, of which one file starts after midnight, or before the other.
    ([(0, 20.0, 28.0), (0, 25.0, 28.0)], [20.0, 25.0]),
    ([(0, 25.0, 28.0), (0, 20.0, 28.0)], [25.0, 20.0]),
]


@pytest.mark.parametrize(
    ("by_time", "files", "starts_h"),
    [(True, *one) for one in WHOLE_DAYS + PARTS_OF_DAYS] + [(False, *one) for one in PARTS_OF_DAYS],
)
def test_files_are_compared_by_the_places_of_aircraft(
    by_time: bool, files: list[tuple[int, float, float]], starts_h: list[float], tmp_path: Path
) -> None:
    """On each day, the aircraft are elsewhere."""
    paths = [tmp_path / f"{number}.csv" for number in range(len(files))]
    for path, (day, begin_h, end_h) in zip(paths, files, strict=True):
        both = [(begin_h, end_h)] * 2
        path.write_bytes(flights(*both, by_time=by_time, longitude=8.5 + day))
    found = []
    clocks = [clock for clock in day_clocks(paths) if clock is not None]
    for path, clock in zip(paths, clocks, strict=True):
        times = np.empty(0)
        for batch in open_source(path, lambda _: None).batches:
            clock.push(batch)
            times = np.append(times, batch.numbers[roles.TIME])
        found.append(times.min() / 3600.0)
    assert found == pytest.approx(starts_h, abs=0.01)
    assert [clock.first_day for clock in clocks] == [hour // 24 for hour in starts_h]
    days = [day for day, _, _ in files]
    moved = [day > 0 and day not in days[:number] for number, day in enumerate(days)]
    follow = files[0][1:] == (0.0, 24.0)
    assert [bool(clock.note) for clock in clocks] == [one and not follow for one in moved]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("size", [1, 7, 64])
@pytest.mark.parametrize("form", [Flights, _Whole])
def test_batches_have_the_times_of_the_whole(
    form: type[Flights | _Whole], seed: int, size: int
) -> None:
    generator = np.random.Generator(np.random.PCG64(seed))
    time_s = (np.cumsum(generator.choice([-10.0, 20.0, 900.0, 9000.0], 400)) + 80_000.0) % DAY_S
    address = generator.integers(1, 6, 400)

    def pushed(parts: list[slice]) -> list[float]:
        clock = DayClock(form(), np.arange(400.0) * 10.0 * DAY_S)
        found: dict[int, list[float]] = {}
        for part in parts:
            numbers = np.full((roles.NUMBERS, len(time_s[part])), np.nan)
            numbers[roles.TIME] = time_s[part]
            words = np.full((roles.WORDS, len(time_s[part])), roles.ABSENT, dtype=np.int64)
            words[0] = address[part]
            batch = Batch(numbers, words, np.arange(len(time_s[part])), lambda _: b"")
            clock.push(batch)
            for one, value in zip(
                address[part].tolist(), numbers[roles.TIME].tolist(), strict=True
            ):
                found.setdefault(one, []).append(value)
        # Parts are numbered in the order of batches: only the days since the start of each count.
        return [value % (10.0 * DAY_S) for one in sorted(found) for value in found[one]]

    whole = pushed([slice(0, 400)])
    assert pushed([slice(begin, begin + size) for begin in range(0, 400, size)]) == whole
