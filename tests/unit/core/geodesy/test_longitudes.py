"""Medians of longitudes."""

import numpy as np
import pytest

from multiradar.geodesy.longitudes import median_longitude


@pytest.mark.parametrize(
    ("longitude_deg", "median_deg"),
    [
        ([10.0, 30.0, 20.0, np.nan], 20.0),
        ([179.0, -179.0, 178.0], 179.0),
        ([-179.5, 179.9, -179.6, -175.0], -179.55),
        # One at the other side of the Earth moves the median by half a place.
        ([0.0, -1.0, 1.0, 2.0, -170.0, 100.0], 1.5),
        ([], np.nan),
    ],
)
def test_a_median_of_longitudes_lies_among_them(
    longitude_deg: list[float], median_deg: float
) -> None:
    found = np.degrees(median_longitude(np.radians(longitude_deg)))
    assert found == pytest.approx(median_deg, nan_ok=True)
