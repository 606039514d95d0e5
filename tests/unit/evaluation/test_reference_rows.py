"""Rows of a reference at positions that no aircraft flies to are rejected, named and counted."""

from collections.abc import Sequence

import numpy as np
import polars as pl
import pytest

from multiradar.errors import InputError
from multiradar.evaluation.reference_rows import CHAINS_MAX, OPEN_MAX, screened
from multiradar.evaluation.tables import reference_of_reports

NUMBERS = ("time_s", "latitude_deg", "longitude_deg")
Row = tuple[str | None, float | None, float | None, float | None]


def flight(
    count: int, *, name: str = "3c0001", begin_s: float = 0.0, step_s: float = 5.0,
    latitude_deg: float = 47.0, speed_mps: float = 200.0,
) -> list[Row]:  # fmt: skip
    """Return reports of a flight to the north."""
    times = begin_s + step_s * np.arange(count)
    moved = speed_mps * (times - begin_s) / 111_200.0
    return [(name, t, latitude_deg + d, 8.0) for t, d in zip(times, moved, strict=True)]


def table(rows: Sequence[Row]) -> pl.DataFrame:
    kinds = {"name": pl.String, **dict.fromkeys(NUMBERS, pl.Float64)}
    return pl.DataFrame(rows, schema=kinds, orient="row")


def rejected(rows: Sequence[Row]) -> list[int]:
    kept, counts = screened(table(rows), NUMBERS, "m.parquet")
    assert counts.read == len(rows) == counts.accepted + len(counts.rejects) + counts.duplicate
    assert len(kept) == counts.accepted
    return [one.offset for one in counts.rejects if one.offset is not None]


def moved(row: Row, latitude_deg: float, longitude_deg: float = 8.0) -> Row:
    return (row[0], row[1], latitude_deg, longitude_deg)


@pytest.mark.parametrize("place", [0, 1, 7, 18, 19])
@pytest.mark.parametrize("latitude_deg", [-71.0, 41.0, 47.5, 89.9])
def test_a_single_wrong_position_is_rejected_anywhere(place: int, latitude_deg: float) -> None:
    rows = flight(20)
    rows[place] = moved(rows[place], latitude_deg)
    assert rejected(rows) == [place]


def test_a_rejected_row_is_named_with_its_reason() -> None:
    rows = flight(20)
    rows[7] = moved(rows[7], 57.0)
    rows[9] = ("3c0001", 45.0, 47.0, 999.0)
    rows[11] = ("3c0001", None, 47.0, 8.0)
    rows[13] = (None, 65.0, 47.0, 8.0)
    _, counts = screened(table(rows), NUMBERS, "m.parquet")
    assert [str(one) for one in counts.rejects] == [
        "m.parquet: row 7: aircraft 3c0001: 1,106 km from the position 5 s earlier, farther than "
        "an aircraft can fly in that time; the other positions of the aircraft are consistent",
        "m.parquet: row 9: aircraft 3c0001: longitude_deg: expected a number from -360 to 360, "
        "was 999.0",
        "m.parquet: row 11: aircraft 3c0001: time_s: expected a number, was None",
        "m.parquet: row 13: no track number and no Mode S address",
    ]


def test_lines_and_rows_before_selection_are_named() -> None:
    rows = flight(8)
    rows[3] = moved(rows[3], -60.0)
    frame = table(rows)
    (indexed,) = screened(frame.with_columns(index=pl.int_range(100, 108)), NUMBERS, "m")[1].rejects
    assert (indexed.file, indexed.offset, indexed.line) == ("m", 103, None)
    lines = frame.with_columns(file=pl.lit("240_mr.new4"), line=pl.int_range(1, 9))
    (line,) = screened(lines, NUMBERS, "m")[1].rejects
    assert (line.file, line.offset, line.line) == ("240_mr.new4", None, 4)


def test_a_wrong_position_that_stays_for_some_reports_is_rejected() -> None:
    rows = flight(30)
    for place in range(10, 16):
        rows[place] = moved(rows[place], 51.0)
    assert rejected(rows) == list(range(10, 16))


def test_wrong_positions_of_many_kinds_leave_the_flight() -> None:
    rows = flight(400)
    places = list(range(5, 395, 4))
    assert len(places) > 3 * OPEN_MAX
    for number, place in enumerate(places):
        rows[place] = moved(rows[place], 47.0, -170.0 + 3.0 * number)
    assert rejected(rows) == places


def test_flights_that_follow_each_other_under_one_name_are_kept() -> None:
    # A track number is used again at once, for another aircraft.
    assert rejected(flight(30) + flight(40, begin_s=151.0, latitude_deg=52.0)) == []


def test_a_flight_faster_than_any_is_kept() -> None:
    # No row contradicts the others.
    assert rejected(flight(30, step_s=10.0, speed_mps=1500.0)) == []


def test_many_aircraft_under_one_name_are_rejected_together() -> None:
    """Forty aircraft in turn, each a degree from the next."""
    many = [
        ("000000", float(k), 5.0 + k % 40, 8.0 + 1e-5 * k) for k in range(OPEN_MAX + CHAINS_MAX * 2)
    ]
    others = flight(20)
    assert rejected([*others, *many]) == list(range(20, 20 + len(many)))
    _, counts = screened(table([*others, *many]), NUMBERS, "m.parquet")
    assert f"on more than {CHAINS_MAX} paths" in str(counts.rejects[0])
    few = many[: CHAINS_MAX // 2]
    assert 0 < len(rejected([*others, *few])) < len(few)


def test_late_reports_of_a_second_receiver_are_kept() -> None:
    rows = flight(60, step_s=1.0)
    late = [(name, t, latitude, 8.0) for name, t, latitude, _ in rows]
    shifted = [(n, (t or 0.0) + 5.3, latitude, lon) for n, t, latitude, lon in late]
    assert rejected([*rows, *shifted]) == []


def test_a_repeated_row_is_a_duplicate_and_a_wrong_one_never_replaces_a_good_one() -> None:
    rows = flight(10)
    # The wrong one comes first.
    wild = moved(rows[4], -20.0)
    _, counts = screened(table([wild, *rows, rows[6]]), NUMBERS, "m")
    assert (counts.accepted, len(counts.rejects), counts.duplicate) == (10, 1, 1)
    assert counts.rejects[0].offset == 0


def test_a_reference_that_is_all_wrong_is_reported() -> None:
    frame = table([("a", 0.0, 95.0, 8.0)] * 3).with_columns(
        mode_s_address="name", track_number=pl.lit(None, pl.Int64), height_m=pl.lit(None)
    )
    with pytest.raises(
        InputError, match=r"m: all 3 rows are rejected; the first: m: row 0: .*was 95\.0"
    ):
        reference_of_reports(frame, "m", 15.0)
