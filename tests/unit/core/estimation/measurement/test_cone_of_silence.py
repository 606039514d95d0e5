"""The edge of the cone, and what lies below it."""

import numpy as np
import pytest

from multiradar.errors import ConfigurationError
from multiradar.estimation.measurement.cone_of_silence import outside_cone


def test_the_edge_is_at_45_degrees_above_the_radar_not_above_the_sea() -> None:
    np.testing.assert_array_equal(
        outside_cone([9_000.0, 8_999.0], 10_000.0, 1_000.0), [True, False]
    )


def test_a_larger_ratio_is_a_wider_cone() -> None:
    assert outside_cone(15_000.0, 10_000.0, 0.0)
    assert not outside_cone(15_000.0, 10_000.0, 0.0, cone_ratio=1.6)


def test_below_the_radar_there_is_no_cone() -> None:
    assert outside_cone(10.0, 200.0, 800.0)


def test_nan_is_inside_the_cone() -> None:
    assert not outside_cone(np.nan, 1_000.0, 0.0)
    assert not outside_cone(1e5, np.nan, 0.0)
    with pytest.raises(ConfigurationError, match="cone ratio"):
        outside_cone(1e5, 1e3, 0.0, cone_ratio=-1.0)


def test_a_ratio_of_zero_is_no_cone() -> None:
    assert outside_cone(1.0, 1e4, 0.0, cone_ratio=0.0)
