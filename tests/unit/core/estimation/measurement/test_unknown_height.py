"""Effect of a wrong height on the predicted range."""

import numpy as np
import pytest

from multiradar.geodesy import _kernels as kernels
from support.references.unknown_height import range_slope, range_variance

PLANE = kernels.plane_parameters(0.98, 1.06)
SITE_HEIGHT_M = 700.0
SITE = kernels.site_parameters(PLANE, 0.985, 1.05, SITE_HEIGHT_M)


@pytest.mark.parametrize("height_m", [100.0, 3_000.0, 12_000.0])
def test_slope_is_that_of_the_ellipsoid(height_m: float) -> None:
    """Differences of 20 m over random feet within 400 km."""
    rng = np.random.default_rng(3)
    for east, north in rng.uniform(-280e3, 280e3, (200, 2)):
        low = kernels.predict_polar(PLANE, SITE, east, north, height_m - 10.0)[0]
        high = kernels.predict_polar(PLANE, SITE, east, north, height_m + 10.0)[0]
        middle = kernels.predict_polar(PLANE, SITE, east, north, height_m)[0]
        found = range_slope(middle, height_m, SITE_HEIGHT_M)
        assert found == pytest.approx((high - low) / 20.0, abs=0.002)


def test_variance_is_large_near_and_small_far() -> None:
    near, far = range_variance([12_000.0, 80_000.0], 8_000.0, 0.0, 3_000.0)
    assert np.sqrt(near) == pytest.approx(3_000 * 8 / 12, rel=0.01)
    assert np.sqrt(far) == pytest.approx(3_000 * (0.1 + 80 / 2 / 6378), rel=0.01)


def test_above_the_radar_the_slope_is_one() -> None:
    assert range_slope(5_000.0, 5_300.0, 300.0) == pytest.approx(1.0)
    assert range_slope(5_000.0, -4_700.0, 300.0) == pytest.approx(-1.0)
    # The slope is at most one, also for a range too short for the heights.
    assert range_slope(4_000.0, 5_300.0, 300.0) == 1.0
