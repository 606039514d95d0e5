"""A radar at an airport and the traffic around it, as a recording of category 048.

The antenna stands 25 m above the aerodrome, and pressure altitudes read 60 m too low.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.geodesy.polar import slant_range_azimuth
from support.asterix.octets import block, plot_048

LATITUDE_DEG, LONGITUDE_DEG, SITE_HEIGHT_M = 41.0, 2.0, 30.0
SURFACE_HEIGHT_M = 5.0
PRESSURE_OFF_M = -60.0
SCAN_S, SCANS = 4.0, 60
START_S = 36_000.0
RANGE_SIGMA_M, AZIMUTH_SIGMA_DEG = 15.0, 0.05
METRES_OF_MILE = 1852.0
METRES_OF_LEVEL = 30.48
NORTH_M = 111_060.0
EAST_M = 84_140.0

AIRBORNE, ON_GROUND = 0, 1
SENSORS = f"""
[[sensor]]
id = "20-130"
kind = "radar"
sac = 20
sic = 130
latitude_deg = {LATITUDE_DEG}
longitude_deg = {LONGITUDE_DEG}
height_m = {SITE_HEIGHT_M}
rotation_period_s = {SCAN_S}
range_max_m = 111000.0
range_sigma_m = {RANGE_SIGMA_M}
azimuth_sigma_deg = {AZIMUTH_SIGMA_DEG}
"""


@dataclass(frozen=True)
class Moment:
    """Where an aircraft is, m from the radar and above the surface, and what it reports."""

    east_m: float
    north_m: float
    above_m: float
    status: int


@dataclass(frozen=True)
class Target:
    """An aircraft: its address, its path over the time since the start, and whether it has Mode C.

    Attributes
    ----------
    address : str
        The Mode S address.
    at : callable
        The moment after a number of seconds.
    reports_height : bool
        Whether it has Mode C.
    """

    address: str
    at: Callable[[float], Moment]
    reports_height: bool = True


def parked(_since_s: float) -> Moment:
    """Stand at a gate."""
    return Moment(-800.0, -300.0, 0.0, ON_GROUND)


def parked_with_wrong_statuses(since_s: float) -> Moment:
    """Stand at another gate, and report to be airborne in two scans of five."""
    wrong = int(since_s / SCAN_S) % 5 in (2, 3)
    return Moment(-900.0, 600.0, 0.0, AIRBORNE if wrong else ON_GROUND)


def taxiing(since_s: float) -> Moment:
    """Taxi north at 9 m/s, stop for 40 s, turn sharply and taxi east."""
    driven = 9.0 * (min(since_s, 100.0) + max(since_s - 140.0, 0.0))
    return Moment(-1500.0 + max(driven - 900.0, 0.0), -1000.0 + min(driven, 900.0), 0.0, ON_GROUND)


def taking_off(since_s: float) -> Moment:
    """Wait for 60 s, accelerate at 2.5 m/s² to 80 m/s, climb at 10 m/s."""
    run = max(since_s - 60.0, 0.0)
    driven = 1.25 * min(run, 32.0) ** 2 + 80.0 * max(run - 32.0, 0.0)
    flown = max(run - 32.0, 0.0)
    return Moment(-1200.0, 500.0 - driven, 10.0 * flown, AIRBORNE if flown else ON_GROUND)


def landing(since_s: float) -> Moment:
    """Approach at 70 m/s on a slope of 3°, touch down after 100 s, brake at 2 m/s², taxi."""
    braked = min(max(since_s - 100.0, 0.0), 31.0)
    later = max(since_s - 131.0, 0.0)
    flown = 70.0 * min(since_s, 100.0) + 70.0 * braked - braked**2 + 8.0 * later
    above = max(7000.0 - flown, 0.0) * np.tan(np.radians(3.0))
    return Moment(1500.0, -8000.0 + flown, above, AIRBORNE if since_s < 100.0 else ON_GROUND)


def flying_with_ground_bit(since_s: float) -> Moment:
    """Fly at 250 m/s and 300 m, and report to be on the ground."""
    return Moment(-30_000.0 + 250.0 * since_s, 20_000.0, 300.0, ON_GROUND)


TARGETS = (
    Target("4b0001", parked, reports_height=False),
    Target("4b0002", parked_with_wrong_statuses),
    Target("4b0003", taxiing),
    Target("4b0004", taking_off),
    Target("4b0005", landing),
    Target("4b0006", flying_with_ground_bit),
)


def recording(targets: tuple[Target, ...] = TARGETS, *, statuses: bool = True) -> bytes:
    """Write the recording, perhaps without the statuses."""
    random = np.random.default_rng(15)
    blocks = []
    for scan in range(SCANS):
        plots = [plot for one in targets for plot in _plots(one, scan, random, statuses=statuses)]
        blocks.append(block(48, *(octets for _, octets in sorted(plots))))
    return b"".join(blocks)


def position_deg(moment: Moment) -> tuple[float, float]:
    """Return latitude and longitude."""
    return (
        LATITUDE_DEG + moment.north_m / NORTH_M,
        LONGITUDE_DEG + moment.east_m / EAST_M,
    )


def _plots(
    target: Target, scan: int, random: np.random.Generator, *, statuses: bool
) -> Iterator[tuple[float, bytes]]:
    seconds = START_S + SCAN_S * scan
    for _ in range(3):
        moment = target.at(seconds - START_S)
        range_m, azimuth_deg = _seen(moment)
        seconds = START_S + SCAN_S * (scan + azimuth_deg / 360.0)
    noise = random.normal(size=2) * (RANGE_SIGMA_M, AZIMUTH_SIGMA_DEG)
    pressure_m = SURFACE_HEIGHT_M + moment.above_m + PRESSURE_OFF_M
    level = round(pressure_m / METRES_OF_LEVEL * 4) & 0x3FFF
    yield (
        seconds,
        plot_048(
            seconds,
            range_nm=(range_m + noise[0]) / METRES_OF_MILE,
            azimuth_deg=(azimuth_deg + noise[1]) % 360.0,
            code=f"{0o1000 + int(target.address[-1]):04x}",
            level=f"{level:04x}" if target.reports_height else None,
            descriptor="a0",
            address=target.address,
            flight_status=moment.status if statuses else None,
        ),
    )


def _seen(moment: Moment) -> tuple[float, float]:
    latitude, longitude = position_deg(moment)
    site = (np.radians(LATITUDE_DEG), np.radians(LONGITUDE_DEG), SITE_HEIGHT_M)
    height: NDArray[np.float64] = np.array([SURFACE_HEIGHT_M + moment.above_m])
    range_m, azimuth_rad, _ = slant_range_azimuth(
        site, np.radians([latitude]), np.radians([longitude]), height
    )
    return float(range_m[0]), float(np.degrees(azimuth_rad[0]) % 360.0)
