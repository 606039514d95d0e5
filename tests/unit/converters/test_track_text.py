"""`.new4` and `.plt` text against Python's own formatting."""

import datetime as dt
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from multiradar_converters.errors import LayoutError
from multiradar_converters.track_text import new4, plt

OZI_EPOCH = dt.datetime(1899, 12, 30, tzinfo=dt.UTC)
MONTHS = "Jan Feb Mar Apr May Jun Jul Aug Sep Oct Nov Dec".split()  # noqa: SIM905 - reads better

rows = st.tuples(
    st.integers(-86_400_000_000, 4_000_000_000_000_000).map(lambda us: us / 1e6),
    st.integers(-90 * 10**9, 90 * 10**9).map(lambda value: value / 1e9),
    st.integers(-180 * 10**9, 180 * 10**9).map(lambda value: value / 1e9),
    st.one_of(st.none(), st.integers(-1_000_000, 40_000_000).map(lambda value: value / 1e3)),
)


def matrix(row: tuple[float, float, float, float | None]) -> NDArray[np.float64]:
    return np.array([[math.nan if value is None else value for value in row]])


def shortest(value: float | None, least: int, most: int) -> str:
    """Format with at least and at most so many decimals."""
    if value is None:
        return ""
    text = f"{value:.{most}f}"
    while text[-1] == "0" and len(text) - text.index(".") - 1 > least:
        text = text[:-1]
    return text if float(text) else text.removeprefix("-")


@given(rows)
def test_new4_lines_keep_every_decimal_of_the_recording(
    row: tuple[float, float, float, float | None],
) -> None:
    time, latitude, longitude, height = row
    expected = "\t".join(
        [
            shortest(time, 3, 6),
            shortest(latitude, 7, 9),
            shortest(longitude, 7, 9),
            shortest(height, 1, 3),
        ]
    )
    assert new4.format_lines(matrix(row)).decode() == expected + "\n"


@given(rows)
def test_plt_points_say_place_feet_days_and_date(
    row: tuple[float, float, float, float | None],
) -> None:
    time, latitude, longitude, height = row
    line = plt.format_points(matrix(row)).decode()
    assert line.endswith("\r\n")
    fields = line.rstrip("\r\n").split(",")
    assert float(fields[0]) == pytest.approx(latitude, abs=5.01e-7)
    assert float(fields[1]) == pytest.approx(longitude, abs=5.01e-7)
    assert fields[2] == "1"
    feet = -777.0 if height is None else height / 0.3048
    assert float(fields[3]) == pytest.approx(feet, abs=0.0501)
    # Seven decimals of a day.
    assert float(fields[4]) == pytest.approx(time / 86400 + 25569, abs=0.6e-7)
    moment = dt.datetime(1970, 1, 1, tzinfo=dt.UTC) + dt.timedelta(seconds=math.floor(time))
    assert fields[5] == f" {moment.day:02d}-{MONTHS[moment.month - 1]}-{moment.year % 100:02d}"
    assert fields[6] == f" {moment:%H:%M:%S}"


def test_a_long_pause_starts_a_segment_also_between_calls() -> None:
    time = np.array([0.0, 600.0, 1200.1])
    points = np.column_stack([time, np.zeros((3, 3))])
    lines = plt.format_points(points).decode().splitlines()
    assert [line.split(",")[2] for line in lines] == ["1", "0", "1"]
    lines = plt.format_points(points, before_s=-5.0).decode().splitlines()
    assert [line.split(",")[2] for line in lines] == ["0", "0", "1"]


def test_a_plt_header_stays_six_lines_of_latin_1() -> None:
    header = plt.format_header("26, жук\r\nимя", 7).decode("latin-1")
    lines = header.split("\r\n")
    assert lines[:4] == [
        "OziExplorer Track Point File Version 2.1",
        "WGS 84",
        "Altitude is in Feet",
        "Reserved 3",
    ]
    assert lines[4] == "0,2,255,26 ??? ???,0,0,2,8421376"
    assert lines[5:] == ["7", ""]


def test_new4_reads_back_what_it_writes_and_rejects_other_text(tmp_path: Path) -> None:
    path = tmp_path / "a.new4"
    points = np.array([[1.5, 1.5, 1.5, math.nan], [2.0, 2.0, 2.0, 9.0]])
    path.write_bytes(new4.format_lines(points))
    assert np.array_equal(new4.read(path), points, equal_nan=True)
    for text in ("1\t2\t3\n", "1\t2\t3\tx\n", "\t2\t3\t4\n"):
        path.write_text(text)
        with pytest.raises(LayoutError, match=r"a\.new4:1"):
            new4.read(path)
