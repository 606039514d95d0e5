"""Times of one source in another unit, and what is no gap."""

import polars as pl
import pytest

from multiradar.diagnosis.evidence import COLUMNS, Source
from multiradar.diagnosis.same_aircraft.outages import check_gaps
from multiradar.diagnosis.same_aircraft.pauses import check_pauses
from multiradar.diagnosis.times import check_ends, check_times

START_S = 1_533_110_400.0


def source(first_s: float, last_s: float, gap_s: float = 0.0) -> Source:
    made = Source()
    made.first_s, made.last_s, made.read = first_s, last_s, 100
    made.gap_s, made.gap_from_s = gap_s, first_s
    return made


@pytest.mark.parametrize(
    ("factor", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")]
)
def test_times_of_one_source_in_another_unit_are_named(factor: float, unit: str) -> None:
    sources = {name: source(START_S, START_S + 1800.0) for name in ("a", "b")}
    sources["c"] = source(factor * START_S, factor * (START_S + 1800.0))
    (found,) = check_times(sources)
    assert found.sentence.startswith(f"c: its times are probably in {unit}: ")


def of_times(*time_s: float) -> Source:
    made, names = Source(), {name: pl.lit(None).alias(name) for name in COLUMNS}
    frame = pl.DataFrame({"time_s": time_s}).with_columns(
        one for name, one in names.items() if name != "time_s"
    )
    made.add(frame.select(COLUMNS))
    return made


@pytest.mark.parametrize("day_s", [0.0, START_S - START_S % 86_400.0])
@pytest.mark.parametrize("start_s", [28_800.0, 43_000.0, 80_000.0])
def test_times_as_hours_minutes_and_seconds_are_named(day_s: float, start_s: float) -> None:
    seconds = [start_s + 1.7 * number for number in range(500)]
    digits = [
        day_s + 10_000.0 * (one // 3600) + 100.0 * (one % 3600 // 60) + one % 60 for one in seconds
    ]
    right = of_times(*(day_s + one for one in seconds))
    (found,) = check_times({"a": right, "b": of_times(*digits)})
    assert (found.sensor_id, found.code) == ("b", "time_unit")
    assert "as one number (HHMMSS)" in found.sentence


def test_times_that_are_rarely_measured_are_no_digits() -> None:
    assert check_times({"a": of_times(*(28_800.0 + 100.0 * number for number in range(30)))}) == []
    within = [28_800.0 + 100.0 * number + second for number in range(9) for second in range(12)]
    assert check_times({"a": of_times(*within)}) == []


@pytest.mark.parametrize(("start_s", "found"), [(START_S, 1), (1e3 * START_S, 0)])
def test_times_in_another_unit_have_no_gaps_in_hours(start_s: float, found: int) -> None:
    assert len(check_gaps({"a": source(start_s, start_s + 2e5, gap_s=1e5)})) == found


@pytest.mark.parametrize(("apart_s", "words"), [
    (86_400.0, "probably 1 d off"), (-7200.0, "probably 2 h off"), (5000.0, "another day or time"),
])  # fmt: skip
def test_two_sensors_without_a_common_time_do_not_show_which_is_wrong(
    apart_s: float, words: str
) -> None:
    whole = source(START_S, START_S + 600.0)
    other = source(START_S + apart_s, START_S + apart_s + 600.0)
    (found,) = check_times({"1-10": whole, "adsb": other})
    assert (found.sensor_id, found.code) == ("", "times_apart")
    assert words in found.sentence
    assert "no other sensor to decide" in found.sentence
    (third,) = check_times({"1-10": whole, "adsb": other, "2-10": whole})
    assert third.sensor_id == "adsb"


@pytest.mark.parametrize("read", [50, 5000])
def test_of_two_sensors_the_one_without_dates_is_wrong(read: int) -> None:
    of_day = source(28_800.0, 29_400.0)
    of_day.read = read
    (found,) = check_times({"1-10": source(START_S, START_S + 600.0), "2-10": of_day})
    assert found.sensor_id == "2-10"
    assert "lack the date" in found.sentence


@pytest.mark.parametrize("names", [("1-10",), ("1-10", "2-10")])
def test_times_of_day_that_start_again_at_midnight_are_named(names: tuple[str, ...]) -> None:
    sources = {name: source(86_000.0, 87_000.0) for name in ("1-10", "2-10")}
    for name in names:
        sources[name] = source(1.0, 86_398.0, gap_s=85_400.0)
        sources[name].gap_from_s = 600.0
    (found,) = check_gaps(sources)
    assert (found.sensor_id, found.code) == ("" if len(names) > 1 else "1-10", "times_jump")
    assert "times probably start again from 0 at midnight" in found.sentence


def timed(
    kind: str, first_s: float, last_s: float, *, gap_s: float = 5.0, aircraft: int = 9
) -> Source:
    """Return a source with some aircraft, s since the start of the recording."""
    made = source(START_S + first_s, START_S + last_s, gap_s)
    nothing = {name: [None] * aircraft for name in COLUMNS}
    named = {"kind": [kind] * aircraft, "track_number": list(range(aircraft))}
    made.kept = [pl.DataFrame(nothing | named | {"time_s": [made.first_s] * aircraft})]
    return made


# Archives of reported positions hold parts of several days, which radars do not.
@pytest.mark.parametrize(
    ("kinds", "severity"),
    [(("adsb",), "warning"), (("adsb", "mlat"), "warning"), (("adsb", "radar"), "error")],
)
def test_several_days_of_positions_are_a_warning(kinds: tuple[str, ...], severity: str) -> None:
    sources = {kind: timed(kind, 0.0, 180_000.0, gap_s=85_000.0) for kind in kinds}
    (found,) = check_gaps(sources)
    assert (found.code, found.severity) == ("times_jump", severity)
    assert "have a gap of 23.6 h" in found.sentence
    assert ("track each day separately" in found.sentence, "wrong dates" in found.sentence) == (
        True, severity == "error",
    )  # fmt: skip


def test_a_radar_with_few_aircraft_ends_with_the_others_of_a_truncated_file() -> None:
    """Regression: it was said to continue, and the file not to be truncated."""
    few = timed("radar", 0.0, 801.0, aircraft=2)
    few.kept = [one.with_columns(time_s=pl.lit(few.last_s)) for one in few.kept]
    sources = {
        "1-1": few,
        "1-10": timed("radar", 0.0, 800.0),
        "adsb": timed("adsb", 0.0, 1800.0),
    }
    (found,) = check_ends(sources)
    assert (found.code, found.severity) == ("ends_early", "error")
    assert found.sentence.startswith("1-1, 1-10: their measurements end at")
    assert "those of adsb continue" in found.sentence
    # Alone, its last aircraft have left it.
    assert check_ends({name: sources[name] for name in ("1-1", "adsb")}) == []


def test_radars_that_all_end_early_are_those_of_a_truncated_file() -> None:
    sources = {
        "1-10": timed("radar", 0.0, 800.0),
        "2-10": timed("radar", 0.0, 803.0),
        "adsb": timed("adsb", 0.0, 1800.0),
    }
    (found,) = check_ends(sources)
    assert (found.sensor_id, found.code, found.severity) == ("", "ends_early", "error")
    assert found.sentence == (
        "1-10, 2-10: their measurements end at 2018-08-01 08:13:23 UTC, while those of adsb "
        "continue until 2018-08-01 08:30:00 UTC (55% of the recording): probably a truncated "
        "file; copy the file again"
    )


@pytest.mark.parametrize(
    ("ends_s", "aircraft", "sensor"),
    [
        # Less than a third is missing.
        ((1700.0, 1703.0, 1800.0), 9, ""),
        # One of two radars was switched off.
        ((600.0, 1799.0, 1800.0), 9, "1-10"),
        # All aircraft may have landed.
        ((1799.0, 1798.0, 600.0), 1, "adsb"),
    ],
)
def test_sensors_that_may_have_been_switched_off_cause_a_warning(
    ends_s: tuple[float, float, float], aircraft: int, sensor: str
) -> None:
    radars = {
        name: timed("radar", 0.0, end_s)
        for name, end_s in zip(("1-10", "2-10"), ends_s[:2], strict=True)
    }
    sources = radars | {"adsb": timed("adsb", 0.0, ends_s[2], aircraft=aircraft)}
    (found,) = check_ends(sources)
    assert (found.sensor_id, found.severity) == (sensor, "warning")


@pytest.mark.parametrize(
    "short",
    [
        # A few scans before the others.
        timed("radar", 0.0, 1780.0),
        # It has such pauses.
        timed("radar", 0.0, 1200.0, gap_s=300.0),
        # Another period.
        timed("radar", 600.0, 1200.0),
    ],
)
def test_other_ends_are_no_diagnosis(short: Source) -> None:
    sources = {
        "1-10": short,
        "adsb": timed("adsb", 0.0, 1800.0),
        "2-10": timed("radar", 0.0, 1800.0),
    }
    assert check_ends(sources) == []


def test_a_minute_is_too_short_for_ends() -> None:
    assert check_ends({"1-10": timed("radar", 0.0, 10.0), "adsb": timed("adsb", 0.0, 60.0)}) == []


def test_a_sensor_that_starts_after_the_others_causes_a_warning() -> None:
    late = timed("radar", 900.0, 1800.0)
    whole = timed("radar", 0.0, 1800.0)
    (found,) = check_ends({"1-10": late, "2-10": whole})
    assert (found.sensor_id, found.code, found.severity) == ("1-10", "starts_late", "warning")


def test_clutter_before_the_first_aircraft_shows_no_late_start() -> None:
    radar, reports = timed("radar", 0.0, 1800.0), timed("adsb", 900.0, 1800.0)
    radar.named_s = START_S + 890.0, START_S + 1800.0
    assert check_ends({"1-10": radar, "adsb": reports}) == []


@pytest.mark.parametrize(("last_gap_s", "codes"), [(400.0, ["pause"]), (200.0, []), (0.0, [])])
def test_a_pause_of_all_sensors_causes_a_warning(last_gap_s: float, codes: list[str]) -> None:
    sources = {
        name: timed("radar", 0.0, 1800.0, gap_s=gap_s)
        for name, gap_s in (("1-10", 500.0), ("2-10", last_gap_s))
    }
    for one in sources.values():
        one.gaps = {START_S + 600.0: one.gap_s} if one.gap_s else {}
    found = check_pauses(sources)
    assert [(one.code, one.severity) for one in found] == [(one, "warning") for one in codes]


def _arriving(count: int, each_s: float) -> Source:
    """Return a radar that sees an aircraft more every so many seconds, first after 300 s."""
    made = timed("radar", 300.0, 1800.0)
    time_s = [300.0 + each_s * one + 4.0 * scan for one in range(count) for scan in range(40)]
    rows = len(time_s)
    nothing = {name: [None] * rows for name in COLUMNS}
    named = {"kind": ["radar"] * rows, "time_s": [START_S + one for one in time_s]}
    number = [one for one in range(count) for _ in range(40)]
    made.kept = [pl.DataFrame(nothing | named | {"track_number": number})]
    made.first_s, made.read = START_S + 300.0, rows
    return made


@pytest.mark.parametrize(("each_s", "codes"), [(0.5, ["starts_late"]), (60.0, [])])
def test_aircraft_that_enter_one_after_the_other_show_no_late_start(
    each_s: float, codes: list[str]
) -> None:
    sources = {"1-10": _arriving(20, each_s), "2-10": timed("radar", 0.0, 1800.0)}
    sources["1-10"].last_s = START_S + 1800.0
    assert [one.code for one in check_ends(sources)] == codes
