"""Times of day: an outlier affects no other row, for any blocks; gaps are recognised."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from multiradar_converters.vid import fields
from multiradar_converters.vid.accounting import Account, RejectsFile
from multiradar_converters.vid.profile import Profile
from multiradar_converters.vid.text.detection import detect, first_times
from multiradar_converters.vid.text.reading import read_rows
from multiradar_converters.vid.text.times import TimeUnwrapper, agreed_start
from support.inputs import dumps

DAY = 86400.0
REST = "29860\t3c09df\t47.2418161\t8.3530602\t10363.2"


def read(folder: Path, times: list[str], block_bytes: int = 1 << 16) -> tuple[list[float], Any]:
    """Return the times of the rows that stand and the rejects."""
    path = folder / "plots_ads.txt"
    lines = ["\t".join(dumps.HEADERS[path.name]), *(f"{time}\t{REST}" for time in times)]
    path.write_bytes("".join(f"{line}\n" for line in lines).encode())
    layout = detect(path, fields.REPORTS, Profile())
    form = "seconds-of-day" if layout.time_form is None else layout.time_form
    account = Account(path.name, path.stat().st_size)
    start = agreed_start(first_times(path, layout), form)
    with ThreadPoolExecutor(1) as pool, RejectsFile(folder / "rejects.ndjson") as rejects:
        blocks = read_rows(
            path, layout, pool=pool, account=account, rejects=rejects, progress=lambda _: None,
            clock=TimeUnwrapper(form, start=start),
            block_bytes=block_bytes,
        )  # fmt: skip
        found = [time for rows in blocks for time in rows.number(fields.TIME).tolist()]
    assert account.accepted == len(found)
    assert account.lines == 1 + len(found) + account.rejected.total()
    return found, dumps.rejects(folder)


def steady(begin: float, count: int = 20) -> list[str]:
    return [f"{begin + 0.5 * k:.3f}" for k in range(count)]


def numbers(times: list[str], days: int = 0) -> list[float]:
    return [float(time) + days * DAY for time in times]


@pytest.mark.parametrize(
    ("times", "start"),
    [
        ([29814.0], 29814.0),
        ([29814.0, 29815.0], 29814.0),
        ([79814.0, 29814.0, 29815.0], 29814.0),
        ([29814.0, 29815.0, 79814.0], 29814.0),
    ],
    ids=["one row", "two that agree", "outlier first", "outlier last"],
)
def test_a_file_begins_at_the_first_row_that_others_agree_with(
    times: list[float], start: float
) -> None:
    assert agreed_start(times, "seconds-of-day") == start


def test_a_file_without_rows_has_no_beginning() -> None:
    assert np.isnan(agreed_start([], "seconds-of-day"))


def test_lines_after_a_row_that_is_still_pending_are_all_rejected(tmp_path: Path) -> None:
    found, rejects = read(tmp_path, [*steady(29814.0), "79814.556", "x", "y", "z"])
    assert found == numbers(steady(29814.0))
    assert [one["line"] for one in rejects] == [22, 23, 24, 25]


@pytest.mark.parametrize("wrong", ["79814.556", "9814.556", "116214.556", "99999999", "39814"])
@pytest.mark.parametrize("place", [0, 1, 20, 39, 40])
def test_one_wrong_time_is_rejected_and_moves_no_other_row(
    tmp_path: Path, wrong: str, place: int
) -> None:
    right = steady(29814.0, 40)
    found, (reject,) = read(tmp_path, [*right[:place], wrong, *right[place:]])
    assert found == numbers(right)
    assert (reject["line"], reject["code"]) == (2 + place, "OUT_OF_RANGE")
    if wrong != "99999999":
        assert "time: expected a time near 298" in reject["reason"]
        assert f"was {float(wrong):.3f} s" in reject["reason"]


def test_a_few_wrong_times_in_a_row_that_agree_are_rejected(tmp_path: Path) -> None:
    found, rejects = read(tmp_path, [*steady(29800), *steady(79800, 4), *steady(29811)])
    assert found == numbers([*steady(29800), *steady(29811)])
    assert [reject["line"] for reject in rejects] == [22, 23, 24, 25]


def test_a_clock_that_is_wrong_for_a_while_does_not_move_the_day_of_what_follows(
    tmp_path: Path,
) -> None:
    found, _ = read(tmp_path, [*steady(29800), *steady(79800), *steady(29830)])
    assert found[-20:] == numbers(steady(29830))


@pytest.mark.parametrize(
    ("times", "days"),
    [
        ([steady(29800), steady(36000), steady(70000)], [0, 0, 0]),
        ([steady(72000), steady(21600)], [0, 1]),
        ([steady(86380), steady(5), steady(30000), steady(86300), steady(9)], [0, 1, 1, 1, 2]),
        ([steady(86300), steady(86500), steady(120000)], [0, 0, 0]),
        ([steady(10), steady(86390, 3), steady(20)], [0, -1, 0]),
    ],
    ids=["gaps", "gap over midnight", "two days", "going on", "just before midnight"],
)
def test_a_gap_that_rows_agree_on_is_a_gap(
    tmp_path: Path, times: list[list[str]], days: list[int]
) -> None:
    found, rejects = read(tmp_path, [time for part in times for time in part])
    assert rejects == []
    shifts = [numbers(part, day) for part, day in zip(times, days, strict=True)]
    assert found == [time for part in shifts for time in part]


def test_disorder_of_minutes_about_midnight_is_unwrapped(tmp_path: Path) -> None:
    true = 86000.0 + np.arange(600) * 2.0
    disordered = true + np.where(np.arange(600) % 3 == 0, -300.0, 0.0)
    found, rejects = read(tmp_path, [f"{time % DAY:.3f}" for time in disordered])
    assert rejects == []
    assert found == disordered.tolist()


@settings(max_examples=60)
@given(
    parts=st.lists(
        st.tuples(st.sampled_from([10, 20000, 29800, 70000, 86390]), st.integers(1, 12)),
        min_size=1,
        max_size=8,
    ),
    broken=st.sets(st.integers(0, 60)),
    block_bytes=st.sampled_from([64, 100, 256, 1000]),
)
def test_rejection_does_not_depend_on_the_blocks(
    tmp_path: Path, parts: list[tuple[int, int]], broken: set[int], block_bytes: int
) -> None:
    times = [time for begin, count in parts for time in steady(begin, count)]
    times = ["x" if place in broken else time for place, time in enumerate(times)]
    found, rejects = read(tmp_path, times, block_bytes)
    assert (found, rejects) == read(tmp_path, times)
    lines = [reject["line"] for reject in rejects]
    assert lines == sorted(set(lines))
    assert len(found) + len(lines) == len(times)
