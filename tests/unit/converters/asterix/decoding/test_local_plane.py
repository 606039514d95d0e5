"""Local coordinates against PROJ, and reference points as options and sensors give them."""

import numpy as np
import pyproj
import pytest

from multiradar_converters.asterix.decoding.local_plane import (
    ReferencePoint,
    misplacement,
    parse_references,
    positions_of,
    references_of,
)
from multiradar_converters.errors import ProfileError
from multiradar_schemas.sensors.sensor import parse_sensors

POINTS = [(41.3, 2.08), (-12.0, -77.0), (0.0, 179.9), (78.0, 15.0)]

SENSORS = """
[[sensor]]
kind = "mlat"
sac = 0
sic = 107
latitude_deg = 41.5
longitude_deg = 2.25
[[sensor]]
kind = "mlat"
sac = 0
sic = 108
[[sensor]]
kind = "adsb"
sac = 0
sic = 109
latitude_deg = 41.5
longitude_deg = 2.25
"""


@pytest.mark.parametrize("point", POINTS)
def test_local_coordinates_are_on_proj_s_oblique_stereographic_plane(
    point: tuple[float, float],
) -> None:
    plane = pyproj.Proj(proj="sterea", lat_0=point[0], lon_0=point[1], ellps="WGS84")
    x, y = np.random.default_rng(1).uniform(-3e5, 3e5, (2, 200))
    x[0] = y[0] = 0.0
    longitude, latitude = plane(x, y, inverse=True)
    found = positions_of(ReferencePoint(*point), x, y)
    np.testing.assert_allclose(found[0], latitude, rtol=0, atol=1e-9)
    turned = (found[1] - longitude + 180.0) % 360.0 - 180.0
    np.testing.assert_allclose(turned, 0.0, rtol=0, atol=1e-9)
    assert (np.abs(found[1]) <= 180.0).all()


def test_reference_points_are_given_by_source() -> None:
    given = parse_references(["0-107=41.297063,2.078447", "20-201=-12,-77.5"])
    assert given == {107: (41.297063, 2.078447), 20 << 8 | 201: (-12.0, -77.5)}


@pytest.mark.parametrize(
    "text", ["0-107=41.3", "107=41.3,2.0", "0-256=41.3,2.0", "0-107=90,2.0", "0-107=41.3,181"]
)
def test_other_texts_are_no_reference_point(text: str) -> None:
    with pytest.raises(ProfileError, match="expected"):
        parse_references([text])


def test_the_site_of_a_multilateration_system_is_its_reference_point() -> None:
    assert references_of(parse_sensors(SENSORS).sensor) == {107: (41.5, 2.25)}


PARIS, OSLO, ATLANTIC = (ReferencePoint(*one) for one in ((48.9, 2.4), (60.2, 11.1), (2.4, 48.9)))
NAURU = ReferencePoint(-0.5, 166.9)


@pytest.mark.parametrize(
    ("given", "reported", "others", "words"),
    [
        (ATLANTIC, PARIS, (), "latitude and longitude are probably swapped: it is 6"),
        (ATLANTIC, None, (PARIS,), "latitude and longitude are probably swapped: it is 6"),
        (NAURU, PARIS, (), "the position is probably wrong: it is 14"),
        # Between 40 and 50 degrees north and east, a swapped point is not far away.
        (ReferencePoint(44.8, 41.7), ReferencePoint(41.7, 44.8), (), "latitude and longitude are"),
        # In the coverage of other sensors, corrected by some metres, or nothing to compare with.
        (OSLO, None, (PARIS,), ""),
        (PARIS, ReferencePoint(48.9001, 2.4), (OSLO,), ""),
        (OSLO, PARIS, (), ""),
        (PARIS, ReferencePoint(0.0, 0.0), (), ""),
        (ATLANTIC, None, (), ""),
    ],
)
def test_a_reference_point_far_from_the_recording_is_reported(
    given: ReferencePoint,
    reported: ReferencePoint | None,
    others: tuple[ReferencePoint, ...],
    words: str,
) -> None:
    found = misplacement(given, reported, others)
    assert found.startswith(words)
    assert bool(found) == bool(words)
