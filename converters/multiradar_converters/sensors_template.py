"""`sensors.toml` of a conversion: values from the recording, and fields to fill in.

Values that the recording does not contain are `nan`, which is rejected with the line of every such
field. Every other key is a comment with its default.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_schemas.sensors.sensor import (
    ESTIMATED_BY_KIND,
    PARAMETERS_BY_KIND,
    PRIOR_SIGMA_DEFAULT,
    Sensor,
)

_HEADER = """\
# Sensors found in the recording. Replace each nan (position of the antenna, WGS 84), check the
# rest, and uncomment each value that differs from its default. Angles are in degrees, lengths in
# metres.
"""
#: Source of the position of a sensor other than a radar.
MIDDLE_OF_REPORTS = "centre of the reports, for the system plane"
#: Origin of its local coordinates; where unknown, it is to be filled in.
REFERENCE_POINT = "reference point of the local coordinates"
#: Width of a key and value before the comment.
_WIDTH = 31
_KILOMETRE_M = 1000.0
#: Of surface movement radars: aircraft are larger than its resolution, and its errors are those of
#: a range of a few kilometres.
_SURFACE = "typical of a surface movement radar"
_SURFACE_NOISE = {"range_sigma_m": 10.0, "azimuth_sigma_deg": 0.3}
_SURFACE_PRIOR_SIGMA = {"range_offset_m": 50.0, "azimuth_offset_deg": 1.0}

#: Source of a scan period.
FROM_PLOTS = "measured from the plots"


def middle_of_reports(
    latitude_deg: NDArray[np.float64], longitude_deg: NDArray[np.float64]
) -> tuple[float, float]:
    """Return the medians of positions, also across the antimeridian.

    Parameters
    ----------
    latitude_deg, longitude_deg : float64[n]
        Positions; with NaN the result is NaN.

    Returns
    -------
    latitude_deg, longitude_deg : float
        Medians; longitudes that extend over more than half a turn are ordered from the meridian
        opposite to the direction of their sum.
    """
    longitude = float(np.median(longitude_deg))
    if len(longitude_deg) and np.ptp(longitude_deg) > 180.0:
        towards = float(np.degrees(np.angle(np.exp(1j * np.radians(longitude_deg)).sum())))
        away = np.median((longitude_deg - towards + 180.0) % 360.0 - 180.0)
        longitude = float((towards + away + 180.0) % 360.0 - 180.0)
    return float(np.median(latitude_deg)), longitude


@dataclass(frozen=True, slots=True)
class FoundSensor:
    """A sensor found in a recording.

    Attributes
    ----------
    identifier, kind : str
        As in `sensors.toml`.
    found : str
        Description, such as "7651 plots".
    numbers : sequence of (str, int)
        Keys and values of its numbers in the recording.
    site : (float, float, float), optional
        Latitude and longitude, degrees, and height, m, if the recording contains them.
    site_source : str
        Source of the site.
    rotation_period_s : float
        Scan period, s; NaN if unknown.
    period_source : str
        Source of the scan period, or why there is none.
    range_max_m : float
        Slant range of the farthest plot, m; 0 without plots.
    priors : sequence of str
        Comment lines with priors of its biases from elsewhere.
    surface : bool
        Whether it is a surface movement radar.
    """

    identifier: str
    kind: str
    found: str
    numbers: Sequence[tuple[str, int]] = ()
    site: tuple[float, float, float] | None = None
    site_source: str = ""
    rotation_period_s: float = math.nan
    period_source: str = FROM_PLOTS
    range_max_m: float = 0.0
    priors: Sequence[str] = ()
    surface: bool = False


def sensors_text(sensors: Sequence[FoundSensor]) -> str:
    """Write `sensors.toml`.

    Returns
    -------
    str
        TOML; usable when no field is nan.
    """
    return "".join([_HEADER, *(_table(one) for one in sensors)])


def _table(one: FoundSensor) -> str:
    lines = [
        "",
        "[[sensor]]",
        f'id = "{one.identifier}"',
        f'kind = "{one.kind}"',
        *(f"{key} = {value}" for key, value in one.numbers),
        f"# {one.found}",
        *_site(one),
    ]
    if one.kind != "radar":
        lines.append(
            _default("position_sigma_m", "random error of a position, 1 sigma on each axis")
        )
        return "\n".join([*lines, *_biases(one), ""])
    return "\n".join([*lines, *_antenna(one), *_errors(one), *_biases(one), *one.priors, ""])


def _site(one: FoundSensor) -> list[str]:
    if one.site is not None:
        latitude, longitude, height = one.site
        digits = 2 if one.site_source == MIDDLE_OF_REPORTS else 6
        return [
            _line("latitude_deg", f"{latitude:.{digits}f}", one.site_source),
            _line("longitude_deg", f"{longitude:.{digits}f}", one.site_source),
            _line("height_m", f"{height:.1f}", one.site_source),
        ]
    if one.kind != "radar" and one.site_source != REFERENCE_POINT:
        return []
    what = f"{REFERENCE_POINT}, " if one.kind != "radar" else ""
    lines = [
        _line("latitude_deg", "nan", f"to fill in: {what}decimal degrees, north positive"),
        _line("longitude_deg", "nan", f"to fill in: {what}decimal degrees, east positive"),
    ]
    if one.kind == "radar":
        lines.append(_line("height_m", "nan", "to fill in: antenna above the WGS 84 ellipsoid, m"))
    return lines


def _antenna(one: FoundSensor) -> list[str]:
    lines = []
    if math.isnan(one.rotation_period_s):
        comment = f"scan period, s: {one.period_source}"
        lines.append(_line("# rotation_period_s", "5.0", comment))
    else:
        period = f"{one.rotation_period_s:.3f}"
        lines.append(_line("rotation_period_s", period, f"scan period, s: {one.period_source}"))
    if one.range_max_m > 0.0:
        far_km = one.range_max_m / _KILOMETRE_M
        limit_m = math.ceil(far_km) * _KILOMETRE_M
        comment = f"farthest plot at {far_km:.1f} km; increase to the instrumented range if larger"
        lines.append(_line("range_max_m", f"{limit_m:.1f}", comment))
    else:
        lines.append(_line("# range_max_m", "400000.0", "instrumented range; if omitted, no limit"))
    return lines


def _errors(one: FoundSensor) -> list[str]:
    noise = [
        _default("range_sigma_m", "random error of slant range, 1 sigma"),
        _default("azimuth_sigma_deg", "random error of azimuth, 1 sigma"),
    ]
    if one.surface:
        noise = [_line(key, str(value), _SURFACE) for key, value in _SURFACE_NOISE.items()]
    return [
        *noise,
        _line(
            "# elevation_sigma_deg", "0.1", "random error of elevation, if the radar measures it"
        ),
        _line("# also", '["ID"]', "further ids of the same radar, for example in a second network"),
    ]


def _biases(one: FoundSensor) -> list[str]:
    lines = [
        "# Biases (measured minus true): whether they are estimated, prior mean and sigma, drift."
    ]
    for name in PARAMETERS_BY_KIND[one.kind]:
        estimate = str(name in ESTIMATED_BY_KIND[one.kind]).lower()
        own = one.surface and name in _SURFACE_PRIOR_SIGMA
        mark = "" if own else "# "
        sigma = _SURFACE_PRIOR_SIGMA[name] if own else PRIOR_SIGMA_DEFAULT[name]
        lines.append(
            f"{mark}bias.{name} = {{ estimate = {estimate}, prior = 0.0, prior_sigma = {sigma}, "
            "drift = 0.0 }"
        )
    return lines


def _default(key: str, comment: str) -> str:
    return _line(f"# {key}", str(Sensor.model_fields[key].default), comment)


def _line(key: str, value: str, comment: str) -> str:
    return f"{key} = {value}".ljust(_WIDTH) + f" # {comment}"
