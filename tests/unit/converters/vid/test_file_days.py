"""Files of a dump with times of day start on the days on which they overlap."""

from pathlib import Path

import polars as pl
import pytest

from multiradar_converters.inspection.recordings import InspectionOptions, inspect
from multiradar_converters.vid.text.times import earliest, first_days
from support.inputs import dumps

NAN = float("nan")
HOUR_S = 3600.0
PLOT = ["26", "10", "5", "57014.6", "13.8440", "46.9128223", "6.2769624", "11582.4", "6430"]
REPORT = ["29860", "3c09df", "47.2418161", "8.3530602", "10363.2"]


@pytest.mark.parametrize(
    ("spans_h", "days"),
    [
        (((8.0, 9.0), (8.5, 10.0)), [0, 0]),
        # The second one starts after midnight, or goes on to the next night.
        (((20.0, 4.0), (0.5, 4.0)), [0, 1]),
        (((20.0, 28.0), (0.5, 4.0)), [0, 1]),
        # The first one starts after midnight, and the others before.
        (((0.5, 4.0), (20.0, 4.0), (22.0, 3.0)), [1, 0, 0]),
        # One follows the other within an hour, or does not.
        (((22.0, 23.9), (0.5, 2.0)), [0, 1]),
        (((10.0, 11.0), (0.5, 2.0)), [0, 0]),
        # A day of reports beside an hour of plots.
        (((20.0, 21.0), (6.0, 21.0)), [0, 0]),
        # Rows in disorder do not make a day.
        (((0.1, 0.05), (22.0, 22.1)), [0, 0]),
        (((NAN, NAN), (23.9, 1.0), (0.0, 1.0)), [0, 0, 1]),
    ],
)
def test_files_start_on_the_days_on_which_they_overlap(
    spans_h: tuple[tuple[float, float], ...], days: list[int]
) -> None:
    assert first_days([(first * HOUR_S, last * HOUR_S) for first, last in spans_h]) == days


def test_rows_from_before_midnight_are_the_start_of_a_file() -> None:
    assert earliest([0.05, 86_399.95, 1.0], "seconds-of-day") == 86_399.95
    assert earliest([86_399.95, 0.05, 1.0], "seconds-of-day") == 86_399.95
    assert earliest([40_000.0, 0.05, 0.5, 1.0, 2.0, 3.0], "seconds-of-day") == 0.05
    assert earliest([0.05, 86_399.95], "unix") == 0.05


@pytest.mark.parametrize("reports_first", [False, True])
def test_a_file_that_starts_after_midnight_is_on_the_day_of_the_others(
    reports_first: bool, tmp_path: Path
) -> None:
    """Of a night, one file has every minute from 20:00 on, the other from 0:30 on."""
    whole = [72_000.0 + 60.0 * k for k in range(480)]
    late = [time for time in whole if time >= 88_200.0]
    plots, reports = (late, whole) if reports_first else (whole, late)
    rows = {
        "plots.txt": [[f"{time % 86_400.0}", *PLOT] for time in plots],
        "plots_ads.txt": [[f"{time % 86_400.0}", *REPORT] for time in reports],
    }
    folder = dumps.write_dump(tmp_path / "dump", rows, dumps.columns())
    dumps.run(folder, tmp_path / "out", allow_missing=True)
    table = pl.read_parquet(tmp_path / "out" / "measurements.parquet")
    assert table.filter(kind="adsb")["time_s"].to_list() == reports
    assert set(table.filter(kind="radar")["time_s"]) <= set(plots)
    sensors = inspect([folder], InspectionOptions(), lambda _: None).sensors
    assert sensors["26-10", "radar"].first_s == plots[0]
    assert sensors["adsb", "adsb"].first_s == reports[0]
    assert sensors["adsb", "adsb"].last_s == whole[-1]
