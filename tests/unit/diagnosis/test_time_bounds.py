"""Times at the bounds of their checks: on the bound, and one step beyond it."""

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis.evidence import COLUMNS, Source
from multiradar.diagnosis.same_aircraft.outages import check_gaps
from multiradar.diagnosis.times import check_ends, check_times, utc

START_S = 1_533_081_600.0
DAY_S = 86_400.0


def source(first_s: float, last_s: float, *, gap_s: float = 0.0, gap_from_s: float = 0.0) -> Source:
    """Return a source with times from the start of a day, s."""
    made = Source()
    made.first_s, made.last_s, made.read = START_S + first_s, START_S + last_s, 100
    made.gap_s, made.gap_from_s = gap_s, START_S + gap_from_s
    return made


def of_plots(kind: str, plots: list[tuple[float, int]]) -> Source:
    """Return a source of times from the start of a day, s, and track numbers."""
    rows = len(plots)
    nothing = {name: [None] * rows for name in COLUMNS}
    named = {"kind": [kind] * rows, "time_s": [START_S + time_s for time_s, _ in plots]}
    made = Source()
    made.add(pl.DataFrame(nothing | named | {"track_number": [name for _, name in plots]}))
    return made


def timed(kind: str, first_s: float, last_s: float, *, gap_s: float = 5.0, seen: int = 9) -> Source:
    """Return a source of which no plots of its end are retained."""
    made = source(first_s, last_s, gap_s=gap_s)
    # One aircraft in each plot, all at once.
    made.kept = of_plots(kind, [(first_s, one) for one in range(seen)]).kept
    return made


# Of 1800 s, a third is 600 s; 2 % are 36 s. Of 1000 s, 30 s are more than 2 %.
@pytest.mark.parametrize(
    ("radar", "whole_s", "found"),
    [
        (timed("radar", 0.0, 1200.0), 1800.0, [("ends_early", "warning")]),
        (timed("radar", 0.0, 1199.0), 1800.0, [("ends_early", "error")]),
        (timed("radar", 0.0, 1199.0, seen=5), 1800.0, [("ends_early", "error")]),
        (timed("radar", 0.0, 1199.0, seen=4), 1800.0, [("ends_early", "warning")]),
        (timed("radar", 0.0, 1764.0), 1800.0, []),
        (timed("radar", 0.0, 1763.0), 1800.0, [("ends_early", "warning")]),
        (timed("radar", 0.0, 970.0), 1000.0, []),
        (timed("radar", 0.0, 969.0), 1000.0, [("ends_early", "warning")]),
        (timed("radar", 0.0, 1500.0, gap_s=100.0), 1800.0, []),
        (timed("radar", 0.0, 1499.0, gap_s=100.0), 1800.0, [("ends_early", "warning")]),
        (timed("radar", 0.0, 260.0), 299.0, []),
        (timed("radar", 0.0, 260.0), 300.0, [("ends_early", "warning")]),
        # With another start it is another period.
        (timed("radar", 36.0, 1199.0), 1800.0, [("ends_early", "error")]),
        (timed("radar", 37.0, 1199.0), 1800.0, []),
        (timed("radar", 36.0, 1800.0), 1800.0, []),
        (timed("radar", 37.0, 1764.0), 1800.0, [("starts_late", "warning")]),
        (timed("radar", 37.0, 1763.0), 1800.0, []),
    ],
)
def test_ends_and_starts_count_from_their_bounds_on(
    radar: Source, whole_s: float, found: list[tuple[str, str]]
) -> None:
    sources = {"1-10": radar, "adsb": timed("adsb", 0.0, whole_s)}
    assert [(one.code, one.severity) for one in check_ends(sources)] == found


def test_radars_end_together_within_a_pause() -> None:
    """The pause is 36 s; apart, the first one ends alone."""
    sources = {"1-10": timed("radar", 0.0, 900.0), "adsb": timed("adsb", 0.0, 1800.0)}
    together = check_ends({**sources, "2-10": timed("radar", 0.0, 936.0)})
    assert [(one.sensor_id, one.severity) for one in together] == [("", "error")]
    apart = check_ends({**sources, "2-10": timed("radar", 0.0, 937.0)})
    assert [(one.sensor_id, one.severity) for one in apart] == [
        ("1-10", "warning"), ("2-10", "warning"),
    ]  # fmt: skip


def test_one_named_measurement_is_no_time_of_the_aircraft() -> None:
    """All measurements count then, as if none were named."""
    radar = timed("radar", 600.0, 1800.0)
    whole = timed("radar", 0.0, 1800.0)
    whole.named_s = START_S + 900.0, START_S + 900.0
    assert [one.code for one in check_ends({"1-10": radar, "2-10": whole})] == ["starts_late"]
    whole.named_s = START_S + 600.0, START_S + 901.0
    assert check_ends({"1-10": radar, "2-10": whole}) == []


@pytest.mark.parametrize(
    ("usual", "last", "codes"),
    [(5, 5, ["ends_early"]), (5, 4, []), (10, 6, ["ends_early"]), (10, 5, [])],
)
def test_a_cut_needs_most_of_the_usual_aircraft(usual: int, last: int, codes: list[str]) -> None:
    """At the last 30 s, five aircraft and 60 % of the usual number are needed."""
    plots = [(10.0 * scan, one) for scan in range(80) for one in range(usual)]
    radar = of_plots("radar", [*plots, *((830.0, one) for one in range(last))])
    whole = timed("radar", 0.0, 1800.0)
    assert [one.code for one in check_ends({"1-10": radar, "2-10": whole})] == codes


@pytest.mark.parametrize(("time_s", "codes"), [(800.0, ["ends_early"]), (799.5, [])])
def test_a_cut_is_that_of_30_seconds(time_s: float, codes: list[str]) -> None:
    plots = [(10.0 * scan, one) for scan in range(79) for one in range(5)]
    last = [(time_s, 4), *((830.0, one) for one in range(4))]
    whole = timed("radar", 0.0, 1800.0)
    found = check_ends({"1-10": of_plots("radar", [*plots, *last]), "2-10": whole})
    assert [one.code for one in found] == codes


def test_the_usual_number_of_aircraft_is_that_of_most_times() -> None:
    """Two at first, 15 later, and eight at the end, which may be the ones left."""
    plots = [(10.0 * scan, one) for scan in range(80) for one in range(2 if scan < 10 else 15)]
    radar = of_plots("radar", [*plots, *((830.0, one) for one in range(8))])
    assert check_ends({"1-10": radar, "2-10": timed("radar", 0.0, 1800.0)}) == []


def test_one_of_two_truncated_sources_shows_the_traffic() -> None:
    sources = {
        "1-10": timed("radar", 0.0, 900.0, seen=1),
        "2-10": timed("radar", 0.0, 900.0, seen=9),
        "adsb": timed("adsb", 0.0, 1800.0),
    }
    assert [one.severity for one in check_ends(sources)] == ["error"]


def test_a_source_of_one_time_has_no_end() -> None:
    assert check_ends({"1-10": timed("radar", 0.0, 0.0), "2-10": timed("adsb", 0.0, 1800.0)}) == []


@pytest.mark.parametrize(("apart_m", "codes"), [(21_000.0, ["ends_early"]), (19_000.0, [])])
def test_plots_without_identity_are_of_several_aircraft_where_they_are_far_apart(
    apart_m: float, codes: list[str]
) -> None:
    rows = [(10.0 * scan, one) for scan in range(80) for one in range(5)]
    nothing = {name: [None] * len(rows) for name in COLUMNS}
    radar = Source()
    radar.add(
        pl.DataFrame(
            nothing
            | {
                "kind": ["radar"] * len(rows),
                "time_s": [START_S + time_s for time_s, _ in rows],
                # Along one direction at one height.
                "range_m": [30_000.0 + apart_m * one for _, one in rows],
                "azimuth_deg": [90.0] * len(rows),
                "height_m": [0.0] * len(rows),
            },
        ).cast({"mode_3a": pl.String, "mode_s_address": pl.String, "track_number": pl.Int64})
    )
    whole = timed("radar", 0.0, 1800.0)
    assert [one.code for one in check_ends({"1-10": radar, "2-10": whole})] == codes


@pytest.mark.parametrize(
    ("gap_s", "words"),
    [
        (43_199.0, None),
        (43_200.0, "have a gap of 12.0 h"),
        (DAY_S - 121.0, "have a gap of 24.0 h"),
        (DAY_S - 120.0, "jump by a day"),
        (DAY_S + 120.0, "jump by a day"),
        (DAY_S + 121.0, "have a gap of 24.0 h"),
        (2.0 * DAY_S + 120.0, "jump by 2 days"),
    ],
)
def test_gaps_count_from_twelve_hours_on_and_jumps_are_by_whole_days(
    gap_s: float, words: str | None
) -> None:
    found = check_gaps({"1-10": source(0.0, 3.0 * DAY_S, gap_s=gap_s)})
    assert [words in one.sentence for one in found if words] == ([True] if words else [])
    assert len(found) == (words is not None)


@pytest.mark.parametrize(("first_s", "found"), [(9.9e10, 1), (1e11, 0), (1.1e11, 0)])
def test_times_of_the_year_5000_are_in_another_unit(first_s: float, found: int) -> None:
    one = Source()
    one.first_s, one.last_s, one.gap_s = first_s, first_s + 1e5, 5e4
    assert len(check_gaps({"1-10": one})) == found


@pytest.mark.parametrize(("first_s", "severity"), [(864_000.0, "warning"), (863_999.0, "error")])
def test_a_gap_of_positions_is_a_warning_where_they_have_a_date(
    first_s: float, severity: str
) -> None:
    one = timed("adsb", 0.0, 1e5, gap_s=5e4)
    one.first_s = first_s
    assert [found.severity for found in check_gaps({"adsb": one})] == [severity]


def test_of_the_gaps_of_all_sources_the_longest_one_is_named() -> None:
    sources = {
        f"{gap_s}": source(0.0, 1e5, gap_s=gap_s) for gap_s in (46_800.0, 50_400.0, 43_200.0)
    }
    (found,) = check_gaps(sources)
    assert "a gap of 14.0 h" in found.sentence


@pytest.mark.parametrize(("count", "each_s", "found"), [
    (100, 700.0, 1), (101, 700.0, 0), (101, 600.0, 0), (101, 599.0, 1),
])  # fmt: skip
def test_measurements_that_are_all_far_apart_show_no_gap(
    count: int, each_s: float, found: int
) -> None:
    one = of_plots("radar", [(each_s * number, 7) for number in range(count)])
    one.gap_s = 50_000.0
    assert len(check_gaps({"1-10": one})) == found


@pytest.mark.parametrize(
    ("first_s", "gap_s", "last_s", "wraps"),
    [
        (0.0, 85_000.0, 86_398.0, True),
        (59.0, 85_000.0, 86_398.0, True),
        (60.0, 85_000.0, 86_398.0, False),
        (0.0, 85_000.0, 86_341.0, True),
        (0.0, 85_000.0, 86_340.0, False),
        # The gap may end with the last measurement, but no time is later than a day.
        (0.0, 85_798.0, 86_398.0, True),
        (0.0, 85_000.0, 86_400.0, False),
    ],
)
def test_times_start_again_where_they_reach_midnight(
    first_s: float, gap_s: float, last_s: float, *, wraps: bool
) -> None:
    one = source(0.0, 0.0, gap_s=gap_s)
    one.first_s, one.last_s, one.gap_from_s = first_s, last_s, 600.0
    (found,) = check_gaps({"1-10": one, "2-10": source(0.0, 600.0)})
    assert ("start again from 0 at midnight" in found.sentence) is wraps


@pytest.mark.parametrize(
    ("apart_s", "words"),
    [
        (600.0, None),
        (601.0, "another day or time zone"),
        (7320.0, "its clock is probably 2 h ahead"),
        (7321.0, "another day or time zone"),
        (7079.0, "another day or time zone"),
        (2.0 * DAY_S, "from another day (2 d ahead)"),
        (DAY_S + 120.0, "from another day (1 d ahead)"),
        (DAY_S + 3600.0, "its clock is probably 25 h ahead"),
    ],
)
def test_sources_are_apart_by_more_than_the_clock_may_jump(
    apart_s: float, words: str | None
) -> None:
    """The gap of the last case is between the end of two sources and the start of the third."""
    duration_s = 0.0
    sources = {name: source(0.0, duration_s) for name in ("1-10", "2-10")}
    found = check_times({**sources, "3-10": source(apart_s, apart_s + 1.0)})
    assert [words in one.sentence for one in found if words] == ([True] if words else [])
    assert len(found) == (words is not None)


@pytest.mark.parametrize(("apart_s", "words"), [
    (7320.0, "2 h off"), (7321.0, "from another day"), (23.0 * DAY_S, "23 d off"),
    (25.0 * 3600.0, "25 h off"),
])  # fmt: skip
def test_two_sources_are_apart_by_whole_hours_or_days(apart_s: float, words: str) -> None:
    (found,) = check_times({"1-10": source(0.0, 1.0), "2-10": source(apart_s, apart_s + 1.0)})
    assert f"the clock of one is probably {words}" in found.sentence


@pytest.mark.parametrize(
    ("first_s", "last_s", "named"),
    [
        (864_000.0, 865_000.0, "dateless"),
        (863_999.0, 865_000.0, ""),
        (9.9e10, 1.1e11, "dateless"),
        (1e11, 1.1e11, ""),
    ],
)
def test_of_two_sources_the_one_with_seconds_since_1970_is_right(
    first_s: float, last_s: float, named: str
) -> None:
    """Without such a one either may be wrong."""
    sources = {"dated": source(0.0, 0.0), "dateless": source(0.0, 0.0)}
    sources["dated"].first_s, sources["dated"].last_s = first_s, last_s
    sources["dateless"].first_s, sources["dateless"].last_s = 1000.0, 1060.0
    assert [one.sensor_id for one in check_times(sources)] == [named]


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1009.0, "in milliseconds"), (1011.0, "another day"), (991.0, "in milliseconds"),
     (989.0, "another day")],
)  # fmt: skip
def test_a_unit_of_times_is_within_a_hundredth(factor: float, words: str) -> None:
    other = Source()
    other.first_s = factor * START_S + 1.0
    other.last_s, other.read = other.first_s + 1.0, 1
    sources = {name: source(0.0, 600.0) for name in ("1-10", "2-10")}
    (found,) = check_times({**sources, "3-10": other})
    assert words in found.sentence


@pytest.mark.parametrize(("apart", "spread"), [(-1.1, 0), (-0.9, 1), (0.9, 1), (1.1, 0)])
def test_days_of_spreadsheets_are_within_a_day(apart: float, spread: int) -> None:
    other = Source()
    other.first_s = START_S / DAY_S + 25_569.0 + apart
    other.last_s, other.read = other.first_s + 0.01, 100
    sources = {name: source(0.0, 600.0) for name in ("1-10", "2-10")}
    (found,) = check_times({**sources, "3-10": other})
    assert ("days since 1899-12-30" in found.sentence) == spread


@pytest.mark.parametrize(("off_s", "words"), [
    (60.0, "in minutes"), (61.0, "from another day"), (-60.0, "in minutes"), (-61.0, "another day"),
])  # fmt: skip
@pytest.mark.parametrize("end", ["first_s", "last_s"])
def test_times_of_day_in_minutes_fit_within_a_minute(end: str, off_s: float, words: str) -> None:
    other = source(600.0, 700.0)
    setattr(other, end, getattr(other, end) + off_s / 60.0)
    sources = {name: source(36_000.0, 42_000.0) for name in ("1-10", "2-10")}
    (found,) = check_times({**sources, "3-10": other})
    assert words in found.sentence


def _digits(count: int, *, each_s: float = 1.0) -> Source:
    seconds = 3600.0 * 10 + each_s * np.arange(count)
    minute, second = np.divmod(seconds, 60.0)
    time_s = 10_000.0 * (minute // 60.0) + 100.0 * (minute % 60.0) + second
    return of_plots("radar", [(float(one), 7) for one in time_s])


@pytest.mark.parametrize(
    ("made", "found"),
    [
        # The numbers span 200 from three minutes and 20 s on.
        (_digits(121, each_s=1.0), 1),
        (_digits(120, each_s=1.0), 0),
        (_digits(100, each_s=1.9), 1),
        (_digits(99, each_s=1.9), 0),
        # Each 2 s, 30 seconds of a minute have a plot; each 2.5 s, 24 do.
        (_digits(120, each_s=2.0), 1),
        (_digits(120, each_s=3.0), 0),
    ],
)
def test_digits_need_plots_a_span_and_different_seconds(made: Source, found: int) -> None:
    assert len(check_times({"1-10": made})) == found


# Minutes from 10:00 on with some of their seconds.
@pytest.mark.parametrize(("seconds", "found"), [(30, 1), (29, 0)])
def test_digits_are_of_30_different_seconds(seconds: int, found: int) -> None:
    time_s = [100_000.0 + 100.0 * minute + one for minute in range(9) for one in range(seconds)]
    assert len(check_times({"1-10": of_plots("radar", [(one, 7) for one in time_s])})) == found


@pytest.mark.parametrize(
    ("further", "found"),
    [(105_959.0, 1), (100_060.0, 0), (106_000.0, 0), (235_959.0, 1), (240_000.0, 0)],
)
def test_one_time_that_is_no_time_of_day_shows_that_there_are_no_digits(
    further: float, found: int
) -> None:
    digits = [10_000.0 + 100.0 * minute + one for minute in range(9) for one in range(40)]
    made = of_plots("radar", [(one, 7) for one in (*digits, further)])
    assert len(check_times({"1-10": made})) == found


@pytest.mark.parametrize(
    ("time_s", "text"),
    [
        (864_000.0, "1970-01-11 00:00:00 UTC"),
        (863_999.0, "23:59:59 of day 9 (no date)"),
        (86_400.0, "0:00:00 of day 1 (no date)"),
        (86_399.0, "23:59:59 (no date)"),
        (1e18, "1e+18 s"),
    ],
)
def test_times_without_a_date_are_those_of_the_first_ten_days(time_s: float, text: str) -> None:
    assert utc(time_s) == text
