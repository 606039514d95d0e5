"""Files of a dump with times of day start on the days on which they overlap."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from multiradar_converters.inspection.recordings import InspectionOptions, inspect
from multiradar_converters.vid.fields import PLOTS
from multiradar_converters.vid.profile import Profile
from multiradar_converters.vid.text.detection import detect, sampled_times
from multiradar_converters.vid.text.times import agreed_start, first_days, span
from support.inputs import dumps

NAN = float("nan")
HOUR_S = 3600.0
PLOT = ["26", "10", "5", "57014.6", "13.8440", "46.9128223", "6.2769624", "11582.4", "6430"]
HEADER = "time source sensor plot range azimuth lat lon h code"
REPORT = ["29860", "3c09df", "47.2418161", "8.3530602", "10363.2"]


@pytest.mark.parametrize(
    ("spans_h", "days"),
    [
        (((8.0, 9.0), (8.5, 10.0)), [0, 0]),
        # The second one starts after midnight, or goes on to the next night.
        (((20.0, 28.0), (0.5, 4.0)), [0, 1]),
        # The first one starts after midnight, and the others before.
        (((0.5, 4.0), (20.0, 28.0), (22.0, 27.0)), [1, 0, 0]),
        # One follows the other within an hour, or does not.
        (((22.0, 23.9), (0.5, 2.0)), [0, 1]),
        (((10.0, 11.0), (0.5, 2.0)), [0, 0]),
        # A day of reports beside an hour of plots.
        (((20.0, 21.0), (6.0, 21.0)), [0, 0]),
        # Whole days, and more than a day.
        (((0.0, 24.0), (20.0, 24.0), (0.0, 24.0)), [0, 0, 0]),
        (((0.1, 23.9), (22.5, 23.3)), [0, 0]),
        (((0.1, 23.9), (12.0, 23.9)), [0, 0]),
        (((8.0, 32.0), (22.0, 32.0)), [0, 0]),
        (((8.0, 32.0), (1.0, 8.1)), [0, 1]),
        (((8.0, 80.0), (8.0, 80.0)), [0, 0]),
        # Some rows of the first one are from before midnight.
        (((-0.1, 4.0), (20.0, 28.0)), [1, 0]),
        (((-0.1, 4.0), (0.5, 4.0)), [1, 1]),
        (((NAN, NAN), (23.9, 25.0), (0.0, 1.0)), [0, 0, 1]),
    ],
)
def test_files_start_on_the_days_on_which_they_overlap(
    spans_h: tuple[tuple[float, float], ...], days: list[int]
) -> None:
    assert first_days([(first * HOUR_S, last * HOUR_S) for first, last in spans_h]) == days


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        ([0.05, 86_399.95, 1.0], (-0.05, 1.0)),
        ([86_399.95, 0.05, 1.0], (86_399.95, 86_401.0)),
        # A wrong row, and rows in disorder.
        ([40_000.0, 0.05, 0.5, 1.0, 2.0, 3.0], (0.05, 3.0)),
        ([900.0, 600.0, 300.0], (300.0, 900.0)),
        # Rows of several days that continue, or start again at midnight.
        ([5.0 + 600.0 * k for k in range(400)], (5.0, 239_405.0)),
        ([(5.0 + 600.0 * k) % 86_400.0 for k in range(400)], (5.0, 239_405.0)),
    ],
)
def test_the_times_of_a_file_span_its_midnights(
    times: list[float], expected: tuple[float, float]
) -> None:
    start_s = agreed_start(times, "seconds-of-day")
    assert span(times, "seconds-of-day", start_s) == pytest.approx(expected)


def test_dates_and_no_times_have_no_span() -> None:
    assert np.isnan(span([0.05, 86_399.95], "unix", 0.05)).all()
    assert np.isnan(span([], "seconds-of-day", NAN)).all()


@pytest.mark.parametrize("rows", [40, 40_000])
def test_the_sampled_times_of_a_file_are_of_all_its_parts(rows: int, tmp_path: Path) -> None:
    path = tmp_path / "plots.txt"
    lines = [" ".join([f"{2.0 * k}", *PLOT]) for k in range(rows)]
    path.write_text("\n".join([HEADER, *lines, ""]), encoding="ascii")
    found = sampled_times(path, detect(path, PLOTS, Profile()))
    assert found[0] == 0.0
    assert found[-1] == 2.0 * (rows - 1)
    assert len(found) <= 10_000
    assert 0.0 < max(np.diff(found)) <= 2.0 * max(1, rows // 100)


@pytest.mark.parametrize(
    ("plots_h", "reports_h"),
    [((0.0, 23.99), (20.0, 23.99)), ((0.1, 23.9), (22.5, 23.3)), ((8.0, 32.0), (22.0, 32.0))],
)
def test_files_of_a_whole_day_start_on_it(
    plots_h: tuple[float, float], reports_h: tuple[float, float], tmp_path: Path
) -> None:
    """A day, or more, was taken for the minutes that it has more or less than a day."""
    plots, reports = (
        np.arange(first * HOUR_S, last * HOUR_S, 60.0) for first, last in (plots_h, reports_h)
    )
    rows = {
        "plots.txt": [[f"{time % 86_400.0}", *PLOT] for time in plots.tolist()],
        "plots_ads.txt": [[f"{time % 86_400.0}", *REPORT] for time in reports.tolist()],
    }
    folder = dumps.write_dump(tmp_path / "dump", rows, dumps.columns())
    dumps.run(folder, tmp_path / "out", allow_missing=True)
    table = pl.read_parquet(tmp_path / "out" / "measurements.parquet")
    for kind, times in (("radar", plots), ("adsb", reports)):
        assert table.filter(kind=kind)["time_s"].to_numpy() == pytest.approx(times)


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
