"""Service messages: clock, north marks, sectors, scan period of radars (002, 034), and the site.

The site of a radar is that of its antenna (034/120), that of a multilateration system the
reference point of its local coordinates (019/600, 610, 620). Systems without a configured site
report 0, 0, which counts as absent.
"""

from dataclasses import dataclass

import numpy as np

from multiradar_converters.asterix.layout.columns import Columns, Integers, Numbers

NORTH, SECTOR = 1, 2
#: Neither: a message of a system without an antenna.
OTHER = -1
_MULTILATERATION = 19
_REVOLUTION_DEG = 360.0
# Scan periods of surveillance radars, s.
_PERIOD_MIN_S, _PERIOD_MAX_S = 1.0, 30.0


@dataclass(frozen=True)
class Services:
    """Service messages, a row per message.

    Attributes
    ----------
    message : int64[n]
        Type: 1 north mark, 2 sector crossed, -1 of a system without an antenna.
    time_s : float64[n]
        Time of day, s; NaN if absent.
    sector_deg : float64[n]
        Azimuth crossed by the antenna, 0 at a north mark; NaN for other messages.
    period_s : float64[n]
        Reported scan period, s; NaN if absent.
    site : float64[n, 3]
        Reported latitude and longitude, degree, and height, m; NaN if absent or 0, 0.
    """

    message: Integers
    time_s: Numbers
    sector_deg: Numbers
    period_s: Numbers
    site: Numbers


def read_services(category: int, columns: Columns) -> Services | None:
    """Read service messages; None for categories without them."""
    if category == _MULTILATERATION:
        return _of_multilateration(columns)
    if category not in (2, 34):
        return None
    message = columns.integers("000")
    sector = np.where(message == NORTH, 0.0, columns.numbers("020"))
    latitude, longitude, height = (columns.numbers("120", name) for name in ("LAT", "LON", "HGT"))
    return Services(
        message=message,
        time_s=columns.numbers("030"),
        sector_deg=np.where((message == NORTH) | (message == SECTOR), sector, np.nan),
        period_s=columns.numbers("041"),
        site=_site(latitude, longitude, height),
    )


def _of_multilateration(columns: Columns) -> Services:
    nothing = np.full(len(columns), np.nan)
    height = columns.numbers("610") + np.nan_to_num(columns.numbers("620"))
    latitude, longitude = columns.numbers("600", "LAT"), columns.numbers("600", "LON")
    return Services(
        message=np.full(len(columns), OTHER, dtype=np.int64),
        time_s=columns.numbers("140"),
        sector_deg=nothing,
        period_s=nothing,
        site=_site(latitude, longitude, height),
    )


def _site(latitude_deg: Numbers, longitude_deg: Numbers, height_m: Numbers) -> Numbers:
    site = np.stack([latitude_deg, longitude_deg, height_m], axis=1)
    site[(latitude_deg == 0.0) & (longitude_deg == 0.0)] = np.nan
    return site


def antenna_period_s(
    message: Integers, time_s: Numbers, sector_deg: Numbers, stated_s: Numbers
) -> float:
    """Return the scan period of an antenna.

    From north marks, else from sectors, else as reported by the radar.

    Parameters
    ----------
    message : int64[n]
        Types of its messages, by time.
    time_s : float64[n]
        Their times, s.
    sector_deg : float64[n]
        Azimuth crossed, degree.
    stated_s : float64[n]
        Reported scan period, s.

    Returns
    -------
    float
        Median scan period, s; NaN if unknown.
    """
    north = np.diff(time_s[(message == NORTH) & ~np.isnan(time_s)])
    north = north[(north >= _PERIOD_MIN_S) & (north <= _PERIOD_MAX_S)]
    if len(north) >= 2:
        return float(np.median(north))
    known = ~np.isnan(time_s) & ~np.isnan(sector_deg)
    passed = np.diff(time_s[known])
    swept = np.diff(sector_deg[known]) % _REVOLUTION_DEG
    good = (passed > 0.0) & (swept > 0.0) & (swept < 180.0) & (passed < _PERIOD_MAX_S)
    if good.sum() >= 3:
        return float(_REVOLUTION_DEG * passed[good].sum() / swept[good].sum())
    stated = stated_s[stated_s > 0.0]
    if len(north) or not len(stated):
        return float(north[0]) if len(north) else float("nan")
    return float(np.median(stated))
