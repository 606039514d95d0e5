"""Range units from the plots of one radar: by speeds, else by the largest range."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from numpy.typing import ArrayLike

from multiradar.diagnosis.cross_sensor.plausibility import (
    aircraft_of,
    check_azimuth_unit,
    check_exchanged_columns,
    check_nearer_than_height,
    check_range_unit,
    check_scan_period,
    measured_period,
    median_speed,
)
from multiradar.diagnosis.evidence import COLUMNS
from multiradar.diagnosis.plots import Plots, plots_of
from multiradar.diagnosis.single_sensor.height_units import check_height_unit

SITE = (0.87, 0.26, 300.0)
FARTHEST_M = 100e3


def plots(unit_m: float, speed_mps: float) -> Plots:
    """One aircraft approaching along one azimuth from 100 km, ranges in this unit."""
    time_s = np.arange(0.0, 200.0, 4.0, dtype=np.float64)
    count = len(time_s)
    missing, azimuth_deg = np.full(count, np.nan), np.full(count, 30.0)
    return Plots(
        time_s, (FARTHEST_M - speed_mps * time_s) / unit_m, azimuth_deg, missing, missing,
        np.full(count, 9000.0), np.full((count, 3), -1, np.int64),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("unit_m", "named", "words"),
    [
        (1.0, True, None),
        (0.3048, True, "in feet"),
        (1000.0, True, "in kilometres"),
        # Without identity there are no speeds; ranges of a few hundred cannot be metres.
        (1.0, False, None),
        (0.3048, False, None),
        (1000.0, False, "in kilometres"),
    ],
)
def test_a_wrong_unit_of_range_shows_in_speeds_or_in_small_ranges(
    unit_m: float, named: bool, words: str | None
) -> None:
    found = plots(unit_m, 200.0)
    paths = np.full(found.size, 0 if named else -1, np.int64)
    said = check_range_unit("1-10", found, SITE, paths, np.inf)
    if words is None:
        assert said is None
    else:
        assert said is not None
        assert (said.sensor_id, said.code) == ("1-10", "range_unit")
        assert words in said.sentence


# Supersonic flights: higher than airliners, or seen up to the instrumented range and no farther.
@pytest.mark.parametrize(
    ("height_m", "range_max_m", "known"),
    [
        (9000.0, 3.0 * FARTHEST_M, True),
        (17_000.0, 3.0 * FARTHEST_M, False),
        (9000.0, FARTHEST_M, False),
    ],
)
def test_supersonic_flights_are_no_ranges_in_feet(
    height_m: float, range_max_m: float, *, known: bool
) -> None:
    found = plots(1.0, 450.0)
    found = replace(found, height_m=np.full(found.size, height_m))
    said = check_range_unit("1-10", found, SITE, np.zeros(found.size, np.int64), range_max_m)
    assert (said is not None) == known


@pytest.mark.parametrize(
    ("farthest", "unit"), [(640.0, None), (620.0, "kilometres"), (33.0, "nautical"), (31.0, None)]
)
def test_the_farthest_plot_of_a_unit_lies_between_60_and_630_km(
    farthest: float, unit: str | None
) -> None:
    found = plots(1000.0, 0.0)
    found = replace(found, range_m=found.range_m / found.range_m.max() * farthest)
    said = check_range_unit("1-10", found, SITE, np.full(found.size, -1), np.inf)
    assert (said is None) == (unit is None)
    assert said is None or f"probably in {unit}" in said.sentence


def test_of_two_units_that_fit_the_more_usual_speed_decides_or_the_instrumented_range() -> None:
    found = plots(1000.0, 120.0)
    paths = np.zeros(found.size, np.int64)
    by_speed = check_range_unit("1-10", found, SITE, paths, np.inf)
    assert by_speed is not None
    assert "probably in nautical miles (or kilometres)" in by_speed.sentence
    assert "and 223 m/s" in by_speed.sentence
    by_range = check_range_unit("1-10", found, SITE, paths, FARTHEST_M)
    assert by_range is not None
    assert "probably in kilometres: " in by_range.sentence


# 50 plots from 100 km to 61 km at 9 000 m, so that a site 70 km higher is farther than the ranges.
@pytest.mark.parametrize(
    ("site_height_m", "above"), [(300.0, None), (-80_000.0, "above"), (120_000.0, "below")]
)
def test_ranges_shorter_than_the_height_over_the_site_are_reported(
    site_height_m: float, above: str | None
) -> None:
    found = check_nearer_than_height("1-10", plots(1.0, 200.0), (0.87, 0.26, site_height_m))
    assert (found is None) == (above is None)
    if found is not None and above is not None:
        assert f"shorter than the height of the aircraft {above} its site" in found.sentence
        assert found.code == "height"


# Plots of three aircraft in turn and of unknown ones; of one of them the plots are 3 s apart only.
def test_the_median_speed_is_that_of_the_aircraft_in_the_middle() -> None:
    speeds = {7: 100.0, 5: 180.0, 9: 250.0}
    time_s = np.repeat(np.arange(0.0, 100.0, 4.0), 5)
    paths = np.tile(np.array([5, -1, 7, 9, 2]), 25)
    time_s[paths == 2] = np.arange(25) * 0.125
    ranges = FARTHEST_M - np.array([speeds.get(one, 900.0) for one in paths.tolist()]) * time_s
    order = np.argsort(time_s, kind="stable")
    count, missing = len(time_s), np.full(len(time_s), np.nan)
    found = Plots(
        time_s[order], ranges[order], np.full(count, 30.0), missing, missing,
        np.full(count, SITE[2]), np.full((count, 3), -1, np.int64),
    )  # fmt: skip
    # A slant range of 100 km to the height of the radar is shorter than the path by less than 1 %.
    speed = median_speed(found, found.range_m, SITE, paths[order])
    assert speed == pytest.approx(180.0, rel=0.01)
    assert np.isnan(median_speed(found, found.range_m, SITE, np.full(count, -1)))


# 7000 is shared by all VFR aircraft: speeds between their plots are those of none.
@pytest.mark.parametrize(("code", "known"), [("4321", True), ("7000", False), ("1000", False)])
def test_a_code_of_conspicuity_names_no_aircraft(code: str, *, known: bool) -> None:
    names = [one for one in COLUMNS if one not in ("kind", "mode_3a", "mode_s_address")]
    empty = {one: pl.Series([None] * 3, dtype=pl.Float64) for one in names}
    texts = {"mode_3a": [code] * 3, "mode_s_address": pl.Series([None] * 3, dtype=pl.String)}
    found = aircraft_of(plots_of(pl.DataFrame({**empty, **texts})))
    assert found.tolist() == [int(code, 8) if known else -1] * 3


def flights(height_m: float, speed_mps: float, aircraft: int) -> Plots:
    """Aircraft that approach at 30 km and less, in steps of 4 s, each along its azimuth."""
    parts = [plots(1.0, speed_mps) for _ in range(aircraft)]
    count = parts[0].size
    missing = np.full(aircraft * count, np.nan)
    return Plots(
        np.tile(parts[0].time_s, aircraft), np.tile(parts[0].range_m - 0.3 * FARTHEST_M, aircraft),
        np.repeat(np.linspace(0.0, 300.0, aircraft), count), missing, missing,
        np.full(aircraft * count, height_m) + np.arange(aircraft * count) % 40,
        np.repeat(np.arange(aircraft), count)[:, None] * np.ones((1, 3), np.int64),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("height_m", "speed_mps", "aircraft", "unit"),
    [
        # 10 668 m in units of 25 ft; traffic of an approach; a pair of military aircraft.
        (1400.0, 230.0, 6, "units of 25 ft"),
        (1400.0, 120.0, 6, None),
        (1400.0, 230.0, 2, None),
        (10_668.0, 230.0, 6, None),
    ],
)
def test_fast_traffic_at_low_heights_shows_their_unit(
    height_m: float, speed_mps: float, aircraft: int, unit: str | None
) -> None:
    said = check_height_unit("1-10", flights(height_m, speed_mps, aircraft), SITE)
    assert (said is None) == (unit is None)
    if said is not None:
        assert (
            f"its heights are probably in {unit}: most aircraft are below 3048 m" in said.sentence
        )


# A scan period of 1 s has many other periods near it, in both senses.
@pytest.mark.parametrize(("turn_deg", "aircraft", "code"), [
    (360.0, 1, None), (360.0, 6, None), (-360.0, 6, "azimuth_anticlockwise"),
])  # fmt: skip
def test_few_aircraft_in_one_direction_show_no_sense_of_rotation(
    turn_deg: float, aircraft: int, code: str | None
) -> None:
    rng = np.random.default_rng(1)
    azimuth_deg = 189.0 + 50.0 * np.arange(aircraft) - 0.06 * np.arange(130)[:, None]
    time_s = (np.arange(130)[:, None] + azimuth_deg / turn_deg).ravel()
    measured_deg = azimuth_deg.ravel() + rng.normal(0.0, 0.05, time_s.size)
    order = np.argsort(time_s)
    missing = np.full(time_s.size, np.nan)
    radar = Plots(
        time_s[order], np.full(time_s.size, 90e3), measured_deg[order] % 360.0, missing, missing,
        missing, np.full((time_s.size, 3), -1, np.int64),
    )  # fmt: skip
    found = check_azimuth_unit("1-10", radar)
    assert (None if found is None else found.code) == code


@pytest.mark.parametrize(("factor", "code"), [(np.pi / 180.0, "azimuth_unit"), (1.0, None)])
def test_a_unit_of_azimuths_shows_among_clutter_at_the_configured_period(
    factor: float, code: str | None
) -> None:
    rng = np.random.default_rng(4)
    time_s = np.sort(rng.uniform(0.0, 400.0, 3000))
    scattered = rng.random(3000) < 0.5
    azimuth_deg = np.where(scattered, rng.uniform(0.0, 360.0, 3000), time_s * 90.0 % 360.0)
    missing = np.full(3000, np.nan)
    radar = Plots(
        time_s, np.full(3000, 50e3), azimuth_deg * factor, missing, missing, missing,
        np.full((3000, 3), -1, np.int64),
    )  # fmt: skip
    found = check_azimuth_unit("1-10", radar, 4.0)
    assert (None if found is None else found.code) == code
    if found is not None:
        assert "probably in radians" in found.sentence
        assert "one revolution in 4.00 s" in found.sentence


def _columns(
    count: int = 20,
    *,
    range_m: ArrayLike = np.nan,
    azimuth_deg: ArrayLike = np.nan,
    height_m: ArrayLike = np.nan,
) -> Plots:
    missing = np.full(count, np.nan)
    given = (
        np.array(np.broadcast_to(np.asarray(one, np.float64), count))
        for one in (range_m, azimuth_deg, height_m)
    )
    ranges, azimuths, heights = given
    keys = np.full((count, 3), -1, np.int64)
    return Plots(np.arange(float(count)), ranges, azimuths, missing, missing, heights, keys)


# No azimuth exceeds 360°, no height 50 km; of the latter, heights up to 16 km.
@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"range_m": 360.0, "azimuth_deg": 360.1}, "its range and azimuth columns"),
        ({"range_m": 360.1, "azimuth_deg": 360.1}, None),
        ({"range_m": 360.0, "azimuth_deg": 360.0}, None),
        ({"range_m": 9e4, "height_m": 360.0, "azimuth_deg": 361.0}, "its height and azimuth"),
        ({"range_m": 9e4, "height_m": 361.0, "azimuth_deg": 361.0}, None),
        ({"range_m": 16_000.0, "height_m": 50_001.0, "azimuth_deg": 9.0}, "its range and height"),
        ({"range_m": 16_001.0, "height_m": 50_001.0, "azimuth_deg": 9.0}, None),
        ({"range_m": 16_000.0, "height_m": 50_000.0, "azimuth_deg": 9.0}, None),
    ],
)
def test_columns_are_exchanged_where_their_values_are_those_of_each_other(
    columns: dict[str, float], words: str | None
) -> None:
    range_m, azimuth_deg = columns["range_m"], columns["azimuth_deg"]
    height_m = columns.get("height_m", np.nan)
    made = _columns(range_m=range_m, azimuth_deg=azimuth_deg, height_m=height_m)
    found = check_exchanged_columns("1-10", made)
    assert (found is not None) == (words is not None)
    assert found is None or str(words) in found.sentence
    assert check_exchanged_columns("1-10", made.select(np.arange(19))) is None


# 300 m of a pressure height, and a tenth of the range; in one plot of 20 it may be garbled.
@pytest.mark.parametrize(
    ("above_m", "wrong", "known"),
    [(1401.0, 2, True), (1400.0, 2, False), (-1401.0, 2, True), (1401.0, 1, False)],
)
def test_a_height_may_exceed_the_range_by_its_tolerance(
    above_m: float, wrong: int, *, known: bool
) -> None:
    height_m = np.full(20, SITE[2])
    height_m[:wrong] += above_m
    found = check_nearer_than_height("1-10", _columns(range_m=1000.0, height_m=height_m), SITE)
    assert (found is not None) is known
    few = _columns(19, range_m=1000.0, height_m=9000.0)
    assert check_nearer_than_height("1-10", few, SITE) is None


def _repeated(between_s: float, count: int = 21, *, late: int = 0) -> Plots:
    """Return plots of one aircraft in one direction, some a scan later than the next one."""
    step = np.full(count - 1, between_s)
    step[:late] *= 2.0
    time_s = np.concatenate([[0.0], np.cumsum(step)])
    keys = np.full((count, 3), -1, np.int64)
    keys[:, 0] = 7
    return replace(_columns(count, azimuth_deg=10.0), time_s=time_s, keys=keys)


@pytest.mark.parametrize(
    ("between_s", "configured_s", "known"),
    [
        (4.27, 4.0, False),
        (4.29, 4.0, True),
        (3.73, 4.0, False),
        (3.71, 4.0, True),
        (20.0, 4.0, True),
        (20.1, 4.0, False),
        (12.0, np.nan, False),
    ],
)
def test_plots_that_repeat_at_another_interval_show_the_scan_period(
    between_s: float, configured_s: float, *, known: bool
) -> None:
    found = check_scan_period("1-10", _repeated(between_s), configured_s)
    assert (found is not None) is known
    assert found is None or f"repeat every {between_s:.2f} s" in found.sentence


@pytest.mark.parametrize(
    ("plots_s", "period_s"),
    [
        (_repeated(5.0), 5.0),
        (_repeated(5.0, 20), np.nan),
        # Fewer than half of the scans are without a detection.
        (_repeated(5.0, late=9), 5.0),
        (_repeated(5.0, late=12), np.nan),
        # Duplicates are no scans.
        (_repeated(0.1), np.nan),
        (_repeated(0.11), 0.11),
    ],
)
def test_the_interval_of_an_aircraft_is_the_scan_that_most_detect(
    plots_s: Plots, period_s: float
) -> None:
    assert measured_period(plots_s) == pytest.approx(period_s, nan_ok=True)


def _rotating(period_s: float, duration_s: float, *, noise: float = 0.0, seed: int = 5) -> Plots:
    random = np.random.default_rng(seed)
    time_s = np.sort(random.uniform(0.0, duration_s, int(12 * duration_s)))
    azimuth_deg = 360.0 * time_s / period_s + np.degrees(noise) * random.normal(size=time_s.size)
    return replace(_columns(time_s.size, azimuth_deg=azimuth_deg % 360.0), time_s=time_s)


@pytest.mark.parametrize(
    ("period_s", "duration_s", "configured_s", "known"),
    [
        (5.0, 300.0, 5.0 / 1.039, False),
        (5.0, 300.0, 5.0 / 1.043, True),
        (5.0, 300.0, 5.0 / 0.962, False),
        (5.0, 300.0, 5.0 / 0.957, True),
        # Three scans.
        (5.0, 15.2, 4.0, True),
        (5.0, 14.8, 4.0, False),
    ],
)
def test_a_rotation_shows_the_scan_period(
    period_s: float, duration_s: float, configured_s: float, *, known: bool
) -> None:
    found = check_scan_period("1-10", _rotating(period_s, duration_s), configured_s)
    assert (found is not None) is known
    assert found is None or "complete a revolution in 5.0" in found.sentence


# A coherence of exp(−σ²/2): 0.998 at 0.0633 rad.
@pytest.mark.parametrize(("noise", "known"), [(0.060, True), (0.067, False)])
def test_azimuths_that_scatter_more_are_no_rotation(noise: float, *, known: bool) -> None:
    made = _rotating(5.0, 240.0, noise=noise)
    assert np.isfinite(measured_period(made)) == known


@pytest.mark.parametrize(("configured_s", "hint"), [(13.1, True), (13.3, False), (10.7, False)])
def test_a_scan_period_in_revolutions_per_minute_is_named(
    configured_s: float, *, hint: bool
) -> None:
    found = check_scan_period("1-10", _repeated(5.0), configured_s)
    assert found is not None
    assert ("12.0 revolutions per minute" in found.sentence) is hint


# Ranges in feet, from 100 km, and in units of 1/256 NM, from 20 km.
@pytest.mark.parametrize(
    ("speed_mps", "known"), [(399.0, False), (401.0, True), (25.1, False), (24.9, True)]
)
def test_the_median_speed_of_aircraft_has_bounds(speed_mps: float, *, known: bool) -> None:
    radar = plots(1.0, speed_mps)
    near_m = 0.0 if speed_mps > 100.0 else 0.8 * FARTHEST_M
    radar = replace(radar, range_m=radar.range_m - near_m, height_m=np.full(radar.size, SITE[2]))
    found = check_range_unit("1-10", radar, SITE, np.zeros(radar.size, np.int64), 2.0 * FARTHEST_M)
    assert (found is not None) is known


@pytest.mark.parametrize(
    ("range_max_m", "height_m", "speed_mps", "known"),
    [
        # The instrumented range within 5 %, up to Mach 2; the median height above FL430.
        (FARTHEST_M / 1.049, 9000.0, 590.0, False),
        (FARTHEST_M / 1.051, 9000.0, 590.0, True),
        (FARTHEST_M / 0.951, 9000.0, 590.0, False),
        (FARTHEST_M / 0.949, 9000.0, 590.0, True),
        (FARTHEST_M, 9000.0, 610.0, True),
        (2.0 * FARTHEST_M, 13_501.0, 560.0, False),
        (2.0 * FARTHEST_M, 13_500.0, 560.0, True),
    ],
)
def test_supersonic_flights_have_bounds(
    range_max_m: float, height_m: float, speed_mps: float, *, known: bool
) -> None:
    radar = plots(1.0, speed_mps)
    radar = replace(radar, height_m=np.full(radar.size, height_m)).select(np.arange(25))
    found = check_range_unit("1-10", radar, SITE, np.zeros(radar.size, np.int64), range_max_m)
    assert (found is not None) is known
