"""Reported positions in another unit, without positions, or with wrong times."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from multiradar.diagnosis.motion.reports import _stretch, check_reports
from multiradar.diagnosis.plots import Floats, Plots

AIRCRAFT, REPORTS, PERIOD_S = 5, 120, 10.0


def reports(**changed: Callable[[Floats], Floats]) -> Plots:
    """Return reports of aircraft at 200 m/s and 9 km, with changed columns."""
    number = np.repeat(np.arange(AIRCRAFT), REPORTS)
    flown_s = np.tile(PERIOD_S * np.arange(REPORTS), AIRCRAFT)
    columns = {
        "time_s": 1_533_110_400.0 + flown_s + number,
        "latitude_deg": 46.05 + 0.2 * number + flown_s * 150.0 / 111_195.0,
        "longitude_deg": 7.05 + 0.3 * number + flown_s * 130.0 / 77_000.0,
        # In steps of 25 ft.
        "height_m": np.full(len(number), 8999.22) + 99.06 * number,
    }
    columns |= {name: change(columns[name]) for name, change in changed.items()}
    order = np.argsort(columns["time_s"], kind="stable")
    nothing = np.full(len(number), np.nan)
    keys = np.column_stack([np.full(len(number), -1), number + 0x4B1800, np.full(len(number), -1)])
    return Plots(range_m=nothing, azimuth_deg=nothing, keys=keys, **columns).select(order)


def _minutes(degrees: Floats) -> Floats:
    return np.floor(degrees) + 0.6 * (degrees % 1.0)


def test_reports_without_a_mistake_have_no_diagnosis() -> None:
    assert check_reports("adsb", reports()) is None


@pytest.mark.parametrize(
    ("changed", "code", "words"),
    [
        ({"latitude_deg": _minutes, "longitude_deg": _minutes}, "position_minutes",
         "in degrees and minutes"),
        ({"latitude_deg": np.radians, "longitude_deg": np.radians}, "position_unit", "in radians"),
        ({"latitude_deg": np.zeros_like, "longitude_deg": np.zeros_like}, "position_missing",
         "100% of its positions are 0°, 0°"),
        ({"height_m": lambda one: one / 30.48}, "height_unit", "in hundreds of feet or metres"),
        ({"height_m": lambda one: one / 0.3048}, "height_unit", "in feet: 100% of them are above"),
        ({"height_m": lambda one: one * 0.3048}, "height_unit", "in metres in a column of feet"),
        ({"time_s": lambda one: one / 86_400.0}, "time_unit", "in days"),
        ({"time_s": lambda one: one / 60.0}, "time_unit", "in minutes"),
        ({"time_s": lambda one: np.full_like(one, 7.0)}, "column_constant", "all its times are 7"),
    ],
)  # fmt: skip
def test_a_mistake_in_reports_is_named(
    changed: dict[str, Callable[[Floats], Floats]], code: str, words: str
) -> None:
    found = check_reports("adsb", reports(**changed))
    assert found is not None
    assert found.code == code
    assert words in found.sentence


def test_one_address_for_all_aircraft_is_named() -> None:
    one = reports()
    found = check_reports("adsb", Plots(**{
        **{name: getattr(one, name) for name in ("time_s", "range_m", "azimuth_deg",
           "latitude_deg", "longitude_deg", "height_m")},
        "keys": np.tile([-1, 0x4B1800, -1], (one.size, 1)),
    }))  # fmt: skip
    assert found is not None
    assert found.code == "speeds_impossible"


def test_a_slow_helicopter_below_3000_m_is_not_in_radians() -> None:
    slow = reports(
        latitude_deg=lambda one: 46.0 + (one - 46.0) / 100.0,
        longitude_deg=lambda one: 7.0 + (one - 7.0) / 100.0,
        height_m=lambda one: one / 20.0,
    )
    assert check_reports("adsb", slow) is None


@pytest.mark.parametrize(("longitude", "known"), [(7.0, False), (-68.2, False), (2.0, True)])
def test_taxiing_above_3000_m_is_not_in_radians(longitude: float, *, known: bool) -> None:
    """Regression: at La Paz, at 4060 m, the median speed is that of taxiing."""
    latitude = 0.8 if known else -16.5
    slow = reports(
        latitude_deg=lambda one: latitude + (one - 46.0) / 60.0,
        longitude_deg=lambda one: longitude + (one - 7.0) / 60.0,
        height_m=lambda one: np.full_like(one, 4061.0) + (one > 7000.0) * 7.62,
    )
    found = check_reports("adsb", slow)
    assert (found is not None) == known
    assert found is None or found.code == "position_unit"


def cruising(north: float, east: float) -> Plots:
    """Return reports of 12 aircraft at about 230 m/s in all directions, with a wind of 25 m/s."""
    number = np.repeat(np.arange(12), REPORTS)
    flown_s = np.tile(PERIOD_S * np.arange(REPORTS), 12)
    course = 2.0 * np.pi * number / 12
    speed = 225.0 + number + 25.0 * np.sin(course)
    latitude = north + flown_s * speed * np.cos(course) / 111_195.0
    longitude = east + flown_s * speed * np.sin(course) / 111_195.0 / np.cos(np.radians(north))
    nothing, missing = np.full(len(number), np.nan), np.full(len(number), -1)
    keys = np.column_stack([missing, number + 0x4B1800, missing])
    height_m = np.full(len(number), 10_000.0)
    return Plots(flown_s, nothing, nothing, latitude, longitude, height_m, keys)


@pytest.mark.parametrize("place", [(46.0, 8.0), (59.0, -3.0), (-33.0, 70.0), (1.0, 60.0)])
def test_latitudes_for_longitudes_are_named_by_speeds(place: tuple[float, float]) -> None:
    plots = cruising(*place)
    assert check_reports("adsb", plots) is None
    swapped = replace(plots, latitude_deg=plots.longitude_deg, longitude_deg=plots.latitude_deg)
    found = check_reports("adsb", swapped)
    assert found is not None
    assert found.code == "columns_exchanged"
    few = swapped.select(swapped.keys[:, 1] < 0x4B1800 + 9)
    assert check_reports("adsb", few) is None


def test_speeds_of_circles_are_the_same_across_the_antimeridian() -> None:
    plots = cruising(-17.0, 179.8)
    number, turned = plots.keys[:, 1] - 0x4B1800, 2.0 * np.pi * plots.time_s / 600.0
    latitude_deg = -17.0 + 0.1 * number + 0.2 * np.cos(turned)
    longitude_deg = 179.9 + 0.02 * number + 0.2 * np.sin(turned)
    across_deg = (longitude_deg + 180.0) % 360.0 - 180.0
    assert np.ptp(across_deg) > 359.0
    beyond, found = (
        _stretch(replace(plots, latitude_deg=latitude_deg, longitude_deg=one))
        for one in (longitude_deg, across_deg)
    )
    assert beyond is not None
    assert found == pytest.approx(beyond)


@pytest.mark.parametrize(
    ("count", "aircraft", "others", "named"),
    [
        (20, 3, 0, True),
        (19, 3, 0, False),
        (20, 2, 0, False),
        (61, 3, 20, True),
        (61, 3, 21, False),
    ],
    ids=["all-bounds", "reports", "aircraft", "share", "below-share"],
)
def test_a_placeholder_is_two_thirds_of_twenty_latitudes_of_three_aircraft(
    count: int, aircraft: int, others: int, *, named: bool
) -> None:
    one = reports(latitude_deg=lambda one: np.full_like(one, 46.5))
    chosen = one.select(np.flatnonzero(one.keys[:, 1] < 0x4B1800 + aircraft)[:count])
    chosen.latitude_deg[:others] -= 0.01 * np.arange(1, others + 1)
    found = check_reports("adsb", chosen)
    assert (found is not None and found.code == "column_constant") == named


def test_positions_of_zero_are_named_if_more_than_a_third_of_them() -> None:
    one = reports().select(np.arange(21))
    for zeros, named in ((7, False), (8, True)):
        latitude_deg, longitude_deg = one.latitude_deg.copy(), one.longitude_deg.copy()
        latitude_deg[:zeros] = longitude_deg[:zeros] = 0.0
        found = check_reports(
            "adsb", replace(one, latitude_deg=latitude_deg, longitude_deg=longitude_deg)
        )
        assert (found is not None and found.code == "position_missing") == named, zeros
