"""The centre of reported positions, for the system plane."""

import numpy as np
import pytest

from multiradar_converters.sensors_template import middle_of_reports


@pytest.mark.parametrize(
    ("longitude_deg", "middle_deg"),
    [
        ([10.0, 30.0, 20.0], 20.0),
        ([178.5, 179.5, -179.7, -178.9, 179.0], 179.5),
        ([-179.0, -179.5, 179.5], -179.5),
        ([10.0, np.nan], np.nan),
    ],
)
def test_the_middle_lies_among_the_reports(longitude_deg: list[float], middle_deg: float) -> None:
    latitude_deg = np.linspace(-18.0, -16.0, len(longitude_deg))
    found = middle_of_reports(latitude_deg, np.array(longitude_deg))
    assert found == pytest.approx((-17.0, middle_deg), nan_ok=True)
