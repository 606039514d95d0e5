"""Local coordinates of reports (010/042, 020/042): x and y on a plane at a reference point.

The plane is the oblique stereographic projection of WGS 84 at the reference point, x east and y
north there, in which systems of surveillance exchange Cartesian positions; the height has no part
in it. Of a wide area multilateration that reports both forms (020/041 and 042), the two agree to
0.3 m at 80 km on this plane; on the tangent plane with heights they differ by up to 150 m.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from multiradar_converters.asterix.decoding.targets import Targets
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers
from multiradar_converters.distinct import distinct
from multiradar_converters.errors import ProfileError
from multiradar_schemas.sensors.sensor import Sensor

# WGS 84: semi-major axis, m, and flattening.
_SEMI_MAJOR_M, _FLATTENING = 6_378_137.0, 1.0 / 298.257223563
_ECCENTRICITY_SQUARED = _FLATTENING * (2.0 - _FLATTENING)
_ECCENTRICITY = float(np.sqrt(_ECCENTRICITY_SQUARED))
# Each iteration of the latitude adds two digits.
_ITERATIONS = 8
# Next to a pole the plane has no north.
_LATITUDE_MAX_DEG = 89.0
#: Distances of a configured reference point, m: of a swapped one from that which the source
#: reports, and of any from positions of other sensors in the same recording.
_REPORTED_MAX_M, _COVERAGE_MAX_M = 50e3, 1500e3
_CODE_MAX = 255
_NUMBER = r"([+-]?\d+(?:\.\d+)?)"
_CHOICE = re.compile(rf"(\d{{1,3}})-(\d{{1,3}})={_NUMBER},{_NUMBER}")


class ReferencePoint(NamedTuple):
    """Origin of the local coordinates of a source, WGS 84, degree; not a pole."""

    latitude_deg: float
    longitude_deg: float


#: Reference points by source.
References = Mapping[int, ReferencePoint]


def references_of(sensors: Iterable[Sensor]) -> dict[int, ReferencePoint]:
    """Return the sites of multilateration systems, by source, as reference points."""
    return {
        one.sac << 8 | one.sic: ReferencePoint(one.latitude_deg, one.longitude_deg)
        for one in sensors
        if one.kind == "mlat" and one.sac is not None and one.sic is not None
        if one.latitude_deg is not None and one.longitude_deg is not None
    }


def parse_references(choices: Sequence[str]) -> dict[int, ReferencePoint]:
    """Parse reference points such as `0-107=41.297063,2.078447`.

    Parameters
    ----------
    choices : sequence of str
        SAC-SIC, latitude and longitude, degree.

    Returns
    -------
    dict of ReferencePoint
        By source.

    Raises
    ------
    ProfileError
        A text has another form, or no such position exists.
    """
    found = {}
    for text in choices:
        matched = _CHOICE.fullmatch(text)
        if matched is None:
            msg = (
                "expected SAC-SIC=LATITUDE,LONGITUDE such as 0-107=41.297063,2.078447, was "
                f"{text!r}"
            )
            raise ProfileError(msg)
        area, system = int(matched[1]), int(matched[2])
        point = ReferencePoint(float(matched[3]), float(matched[4]))
        if max(area, system) > _CODE_MAX or not _possible(point):
            msg = (
                "expected SAC and SIC of at most 255, a latitude within 89° and a longitude within "
                f"180°, was {text!r}"
            )
            raise ProfileError(msg)
        found[area << 8 | system] = point
    return found


def _possible(point: ReferencePoint) -> bool:
    return abs(point.latitude_deg) <= _LATITUDE_MAX_DEG and abs(point.longitude_deg) <= 180.0


def misplacement(
    given: ReferencePoint, reported: ReferencePoint | None, others: Iterable[ReferencePoint]
) -> str:
    """Return why a configured reference point is probably wrong; empty if it may be right.

    Parameters
    ----------
    given : ReferencePoint
        The configured reference point.
    reported : ReferencePoint or None
        The one that the source itself reports.
    others : iterable of ReferencePoint
        Positions within the coverage of other sensors in the recording.

    Returns
    -------
    str
        Follows the point and a colon.
    """
    # Systems without a configured site report 0, 0. An option may correct a wrong site.
    own = [] if reported is None or not any(reported) else [reported]
    known = [*own, *others]
    swapped = ReferencePoint(given.longitude_deg, given.latitude_deg)
    if not known:
        return ""
    nearest = min(known, key=lambda one: _distance_m(given, one))
    apart_m = _distance_m(given, nearest)
    is_swapped = _possible(swapped) and any(
        _distance_m(swapped, one) <= min(_REPORTED_MAX_M, _distance_m(given, one)) for one in own
    )
    if apart_m <= (_REPORTED_MAX_M if is_swapped else _COVERAGE_MAX_M):
        return ""
    near = [one for one in known if _distance_m(swapped, one) <= _COVERAGE_MAX_M]
    cause = "the position is probably wrong"
    if _possible(swapped) and near:
        cause = "latitude and longitude are probably swapped"
    what = "reference point that the recording contains" if own else "positions of other sensors"
    return (
        f"{cause}: it is {apart_m / 1e3:.0f} km from the {what} "
        f"({nearest.latitude_deg:.4f}, {nearest.longitude_deg:.4f})"
    )


def _distance_m(first: ReferencePoint, second: ReferencePoint) -> float:
    latitudes = np.radians([first.latitude_deg, second.latitude_deg])
    half = np.sin(np.diff(latitudes)[0] / 2.0) ** 2
    east = np.radians(second.longitude_deg - first.longitude_deg)
    half += np.cos(latitudes).prod() * np.sin(east / 2.0) ** 2
    return float(2.0 * _SEMI_MAJOR_M * np.arcsin(np.sqrt(min(half, 1.0))))


def positions_of(point: ReferencePoint, x_m: Numbers, y_m: Numbers) -> tuple[Numbers, Numbers]:
    """Return the positions of local coordinates.

    Parameters
    ----------
    point : ReferencePoint
        Their origin.
    x_m, y_m : float64[n]
        East and north of it on the plane, m.

    Returns
    -------
    latitude_deg, longitude_deg : float64[n]
        WGS 84 positions.

    References
    ----------
    IOGP publication 373-7-2 (EPSG guidance note 7-2), "Oblique Stereographic", method 9809; the
    latitude is iterated on the isometric latitude.
    """
    origin = np.radians(point.latitude_deg)
    sine, cosine = np.sin(origin), np.cos(origin)
    root = np.sqrt(1.0 - _ECCENTRICITY_SQUARED * sine**2)
    meridian_m = _SEMI_MAJOR_M * (1.0 - _ECCENTRICITY_SQUARED) / root**3
    radius_m = np.sqrt(meridian_m * _SEMI_MAJOR_M / root)
    exponent = np.sqrt(1.0 + _ECCENTRICITY_SQUARED * cosine**4 / (1.0 - _ECCENTRICITY_SQUARED))
    # The sphere: sin φ of the origin on it, and the constant of its isometric latitude.
    first = np.exp(2.0 * exponent * _isometric(np.asarray(origin)))
    before = (first - 1.0) / (first + 1.0)
    factor = (exponent + sine) * (1.0 - before) / ((exponent - sine) * (1.0 + before))
    centre = np.arcsin((factor * first - 1.0) / (factor * first + 1.0))
    # From the plane to the sphere.
    distance = np.hypot(x_m, y_m)
    angle = 2.0 * np.arctan2(distance, 2.0 * radius_m)
    across = np.where(distance > 0.0, distance, 1.0)
    rise = np.cos(angle) * np.sin(centre) + y_m * np.sin(angle) * np.cos(centre) / across
    turn = np.arctan2(
        x_m * np.sin(angle),
        across * np.cos(centre) * np.cos(angle) - y_m * np.sin(centre) * np.sin(angle),
    )
    # From the sphere to the ellipsoid.
    isometric = (np.arctanh(rise) - 0.5 * np.log(factor)) / exponent
    latitude = np.arcsin(np.tanh(isometric))
    for _ in range(_ITERATIONS):
        flat = _ECCENTRICITY * np.arctanh(_ECCENTRICITY * np.sin(latitude))
        latitude = np.arcsin(np.tanh(isometric + flat))
    longitude = point.longitude_deg + np.degrees(turn) / exponent
    return np.degrees(latitude), (longitude + 180.0) % 360.0 - 180.0


def located(targets: Targets, source: Integers, references: References) -> Targets:
    """Return reports with positions in place of local coordinates, where the origin is known.

    Parameters
    ----------
    targets : Targets
        The reports.
    source : int64[n]
        Their sources.
    references : mapping
        Reference points by source.

    Returns
    -------
    Targets
        Reports with a position of their own keep it.
    """
    local = local_only(targets)
    if not local.any():
        return targets
    latitude, longitude = targets.latitude_deg.copy(), targets.longitude_deg.copy()
    for one in distinct(source[local]).tolist():
        if one in references:
            own = local & (source == one)
            latitude[own], longitude[own] = positions_of(
                references[one], targets.x_m[own], targets.y_m[own]
            )
    return replace(targets, latitude_deg=latitude, longitude_deg=longitude)


def local_only(targets: Targets) -> Flags:
    """Return which reports have local coordinates as their only position, bool[n]."""
    absent = np.isnan(targets.latitude_deg) & np.isnan(targets.range_m)
    local: Flags = absent & ~np.isnan(targets.x_m + targets.y_m)
    return local


def _isometric(latitude: Numbers) -> Numbers:
    sine = np.sin(latitude)
    isometric: Numbers = np.arctanh(sine) - _ECCENTRICITY * np.arctanh(_ECCENTRICITY * sine)
    return isometric
