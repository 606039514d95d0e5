"""Sites of radars from simulated aircraft that others see, too."""

import math

import numpy as np
import pytest

from multiradar.diagnosis.cross_sensor.agreement import seen_from
from multiradar.diagnosis.cross_sensor.site_solving import solve_sites
from multiradar.diagnosis.plots import Floats, Integers, Plots, Site
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation, geodetic_to_ecef

SITE: Site = (math.radians(47.0), math.radians(8.0), 300.0)
OTHER: Site = (math.radians(47.5), math.radians(9.0), 300.0)
RANGE_BIAS_M, AZIMUTH_BIAS_RAD = 150.0, math.radians(0.2)
HEIGHT_M = 9_000.0
ALL = 60


def positions(
    aircraft: int, seed: int, spacing_s: float, first: int = 0
) -> tuple[Integers, Floats, Floats]:
    """Return identity, time and ECEF position of aircraft on straight lines."""
    generator = np.random.Generator(np.random.PCG64(seed))
    times = np.arange(0.0, 300.0, spacing_s)
    lines = np.random.Generator(np.random.PCG64(7))
    starts = lines.uniform(-120_000.0, 120_000.0, (ALL, 2))
    courses = lines.uniform(0.0, 2.0 * np.pi, ALL)
    shift = generator.uniform(0.0, spacing_s, ALL)
    names = np.repeat(np.arange(first, first + aircraft), len(times))
    time_s = np.tile(times, aircraft) + shift[names]
    along = 220.0 * time_s
    east = starts[names, 0] + along * np.sin(courses[names])
    north = starts[names, 1] + along * np.cos(courses[names])
    flat = geodetic_to_ecef(*SITE) + np.stack([east, north, np.zeros(len(east))], axis=1) @ (
        enu_rotation(*SITE[:2])
    )
    latitude, longitude, _ = ecef_to_geodetic(flat)
    place = geodetic_to_ecef(latitude, longitude, np.full(len(latitude), HEIGHT_M))
    order = np.argsort(time_s, kind="stable")
    return names[order], time_s[order], place[order]


def plots(names: Integers, time_s: Floats, **columns: Floats) -> Plots:
    nothing = np.full(len(names), np.nan)
    none = np.full(len(names), -1)
    return Plots(
        time_s=time_s,
        range_m=columns.get("range_m", nothing),
        azimuth_deg=columns.get("azimuth_deg", nothing),
        latitude_deg=columns.get("latitude_deg", nothing),
        longitude_deg=columns.get("longitude_deg", nothing),
        height_m=np.full(len(names), HEIGHT_M),
        keys=np.stack([none, names, none], axis=1),
    )


def radar(site: Site = SITE, aircraft: int = 30, seed: int = 1, first: int = 0) -> Plots:
    names, time_s, place = positions(aircraft, seed, 4.0, first)
    generator = np.random.Generator(np.random.PCG64(seed + 100))
    range_m, azimuth = seen_from(site, place)
    range_m = range_m + RANGE_BIAS_M + generator.normal(0.0, 40.0, len(names))
    azimuth = azimuth + AZIMUTH_BIAS_RAD + generator.normal(0.0, math.radians(0.06), len(names))
    return plots(names, time_s, range_m=range_m, azimuth_deg=np.degrees(azimuth) % 360.0)


def adsb(aircraft: int = 30) -> Plots:
    names, time_s, place = positions(aircraft, 2, 5.0)
    latitude, longitude, _ = ecef_to_geodetic(place)
    return plots(
        names, time_s, latitude_deg=np.degrees(latitude), longitude_deg=np.degrees(longitude)
    )


def error_m(site: Site, true: Site) -> float:
    return float(np.linalg.norm(geodetic_to_ecef(*site) - geodetic_to_ecef(*true)))


def test_a_site_is_solved_from_adsb_despite_biases() -> None:
    found = solve_sites({"radar": radar()}, {"adsb": adsb()}, {})["radar"]
    assert found.aircraft > 20
    assert found.sigma_m < 60.0
    assert error_m(found.site, SITE) < 3.0 * found.sigma_m
    assert found.reference == "adsb"


def test_a_site_is_solved_from_a_radar_with_a_site() -> None:
    radars = {"near": radar(), "far": radar(OTHER, seed=5)}
    found = solve_sites(radars, {}, {"far": OTHER})["near"]
    # The reference has biases of its own, which are not known.
    assert error_m(found.site, SITE) < 800.0
    assert found.reference == "far"


def test_a_solved_radar_is_a_reference_for_others() -> None:
    others = {"adsb": adsb()}
    far = radar(OTHER, aircraft=30, seed=5, first=30)
    assert solve_sites({"far": far}, others, {}) == {}
    found = solve_sites({"far": far, "near": radar(aircraft=ALL)}, others, {})
    assert set(found) == {"near", "far"}
    assert found["far"].reference == "near"


@pytest.mark.parametrize("aircraft", [0, 1, 5])
def test_few_aircraft_have_no_site(aircraft: int) -> None:
    assert solve_sites({"radar": radar(aircraft=aircraft)}, {"adsb": adsb()}, {}) == {}


def test_azimuths_that_fit_no_site_have_none() -> None:
    one = radar()
    mixed = np.random.Generator(np.random.PCG64(3)).permutation(one.azimuth_deg)
    wrong = plots(one.keys[:, 1], one.time_s, range_m=one.range_m, azimuth_deg=mixed)
    assert solve_sites({"radar": wrong}, {"adsb": adsb()}, {}) == {}


def test_nothing_to_compare_with() -> None:
    assert solve_sites({"radar": radar()}, {}, {}) == {}
