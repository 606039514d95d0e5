"""The mixture of two Gaussians has the quantiles it is fitted to."""

import numpy as np
import pytest

from multiradar.tracking.encounters._relative_kernels import RARE_SHARE
from multiradar.tracking.encounters.scale_mixture import MEDIAN, UPPER, mixture_scales
from multiradar.tracking.forecast.regions import gaussian_factor


@pytest.mark.parametrize("ratio", [4.4, 6.0, 30.0, 1e3, 1e5])
def test_the_mixture_has_the_median_and_the_upper_quantile_of_the_errors(ratio: float) -> None:
    half = np.array([0.02, 3.0])
    usual, rare = mixture_scales(half, ratio * half)
    assert (rare > usual).all()
    for share, within in ((MEDIAN, half), (UPPER, ratio * half)):
        held = 1.0 - (1.0 - RARE_SHARE) * np.exp(-0.5 * within / usual)
        held -= RARE_SHARE * np.exp(-0.5 * within / rare)
        # Between two sizes of the table.
        np.testing.assert_allclose(held, share, atol=2e-3)


def test_errors_of_one_gaussian_have_one_size() -> None:
    half, most = (np.array([gaussian_factor(share)]) for share in (MEDIAN, UPPER))
    usual, rare = mixture_scales(7.0 * half, 7.0 * most)
    assert usual[0] == pytest.approx(7.0, rel=1e-9)
    assert rare[0] == pytest.approx(7.0, rel=1e-9)


def test_errors_with_fewer_large_ones_have_the_sizes_of_either_quantile() -> None:
    half, most = (np.array([gaussian_factor(share)]) for share in (MEDIAN, UPPER))
    usual, rare = mixture_scales(7.0 * half, 5.0 * most)
    assert (usual[0], rare[0]) == (pytest.approx(7.0), pytest.approx(5.0))
