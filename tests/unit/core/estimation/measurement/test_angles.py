"""Differences of azimuths are wrapped."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from multiradar.estimation.measurement.angles import wrapped
from multiradar.geodesy import _kernels as kernels
from support.kernels import plain


def test_across_north_the_difference_is_small() -> None:
    difference = np.radians(0.2) - np.radians(359.9)
    assert np.degrees(wrapped(difference)) == pytest.approx(0.3, abs=1e-9)


@given(st.floats(-1e4, 1e4))
def test_wrapped_angles_point_the_same_way(angle: float) -> None:
    found = float(wrapped(angle))
    assert -np.pi <= found < np.pi
    assert abs(np.exp(1j * found) - np.exp(1j * angle)) < 1e-11
    assert found == plain(kernels.wrap_angle)(angle)


def test_nan_angles_remain_nan() -> None:
    assert np.isnan(wrapped(np.nan))
