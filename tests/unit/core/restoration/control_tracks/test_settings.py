"""Settings of the trajectory bundle, as its kernels read them."""

import pytest

from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks.settings import BundleSettings


def test_the_largest_accelerations_are_multiples_of_the_usual_ones() -> None:
    settings = BundleSettings(lateral_max_mps2=5.0, longitudinal_max_mps2=2.0, beyond_factor=3.0)
    rules = settings.rules()
    named = [layout.LATERAL_MAX, layout.LATERAL_BEYOND]
    named += [layout.LONGITUDINAL_MAX, layout.LONGITUDINAL_BEYOND]
    assert rules[named].tolist() == pytest.approx([5.0, 15.0, 2.0, 6.0])
