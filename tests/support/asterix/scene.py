"""Two radars and some aircraft on straight lines, as ASTERIX on a network."""

from collections.abc import Iterator

import numpy as np

from multiradar.geodesy.polar import slant_range_azimuth
from support.asterix.octets import block, north_mark, plot_048, record, time_of_day

TURN_S = 4.0
DAY_S = 86_400.0
AIRCRAFT = 6
METRES_OF_MILE = 1852.0
#: Sites of the sensors of `live_scene`, by area and system code.
SITES = {(41, 10): (50.0, 14.0, 400.0), (41, 20): (49.2, 16.5, 300.0)}
#: The second radar sends category 001, with truncated times and north marks.
OLD = (41, 20)


def datagrams(start_s: float, turns: int) -> list[tuple[float, bytes]]:
    """Return datagrams in order with the Unix times at which they are sent.

    Each turn of a radar is one datagram: a north mark where it is the old one, and its plots.
    """
    sent = []
    for (area, system), site in SITES.items():
        for turn in range(turns):
            north_s = start_s + TURN_S * turn
            plots = [
                _plot((area, system), site, number, north_s, start_s) for number in range(AIRCRAFT)
            ]
            octets = block(1 if (area, system) == OLD else 48, *plots)
            if (area, system) == OLD:
                octets = north_mark(north_s % DAY_S, source=_code(area, system)) + octets
            sent.append((north_s + TURN_S, octets))
    return sorted(sent)


def records(turns: int) -> int:
    """Return the number of plots in `datagrams`."""
    return len(SITES) * AIRCRAFT * turns


def addresses() -> set[str]:
    """Return the Mode S addresses that the first radar reports."""
    return {f"{0x4B0000 + number:06x}" for number in range(AIRCRAFT)}


def in_turns(whole: list[tuple[float, bytes]], size: int) -> Iterator[list[tuple[float, bytes]]]:
    """Cut datagrams into pieces."""
    for first in range(0, len(whole), size):
        yield whole[first : first + size]


def _code(area: int, system: int) -> str:
    return f"{area:02x}{system:02x}"


def _plot(
    source: tuple[int, int],
    site: tuple[float, float, float],
    number: int,
    north_s: float,
    start_s: float,
) -> bytes:
    """Write the plot of an aircraft in a scan: at the time when the antenna points at it."""
    time_s = north_s
    for _ in range(3):
        range_m, azimuth_deg = _seen(site, number, time_s - start_s)
        time_s = north_s + TURN_S * azimuth_deg / 360.0
    level = f"{(250 + 10 * number) * 4:04x}"
    code = f"{0o1000 + number:04x}"
    miles = range_m / METRES_OF_MILE
    if source != OLD:
        return plot_048(
            time_s % DAY_S,
            source=_code(*source),
            range_nm=miles,
            azimuth_deg=azimuth_deg,
            code=code,
            level=level,
            address=f"{0x4B0000 + number:06x}",
        )
    position = f"{round(miles * 128):04x} {round(azimuth_deg * 65536 / 360) % 65536:04x}"
    truncated = time_of_day(time_s % DAY_S % 512, 16)
    return record(
        (1, _code(*source)), (2, "20"), (3, position), (4, code), (5, level), (7, truncated)
    )


def _seen(site: tuple[float, float, float], number: int, since_s: float) -> tuple[float, float]:
    """Return range, m, and azimuth, degree."""
    latitude = 49.5 + 0.08 * number + 0.0002 * (number - 2) * since_s
    longitude = 15.0 + 0.09 * number + 0.002 * since_s
    height = (250 + 10 * number) * 30.48
    range_m, azimuth_rad, _ = slant_range_azimuth(
        (np.radians(site[0]), np.radians(site[1]), site[2]),
        np.radians([latitude]),
        np.radians([longitude]),
        np.array([height]),
    )
    return float(range_m[0]), float(np.degrees(azimuth_rad[0]) % 360.0)
