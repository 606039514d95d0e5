"""Azimuths of all radars that the run found off by nearly one angle."""

import numpy as np
import pytest

from multiradar.diagnosis.cross_sensor.offsets import check_common_azimuth
from multiradar.diagnosis.cross_sensor.registration import SIGMAS
from multiradar.diagnosis.evidence import Evidence
from multiradar.estimation.measurement.sensors import PARAMETER_AZIMUTH_OFFSET
from support.inputs.mistaken import recording

SURE_DEG = 1.0 / SIGMAS


def _sentences(*angles_deg: float, sigma_deg: float = 0.99 * SURE_DEG) -> list[str]:
    """Return what is found of radars whose azimuths are off by these angles."""
    evidence = Evidence(recording().table())
    for number, angle_deg in enumerate(angles_deg):
        estimate, sigma = np.radians([angle_deg, sigma_deg])
        evidence.biases[number, PARAMETER_AZIMUTH_OFFSET] = float(estimate), float(sigma)
    return [one.sentence for one in check_common_azimuth(evidence)]


@pytest.mark.parametrize(
    ("found", "count"),
    [
        (_sentences(1.01, 1.99, 1.5), 3),
        (_sentences(0.99, 1.9, 1.5), 0),
        (_sentences(-1.01, -1.99), 2),
        (_sentences(1.01, 2.02, 1.5), 0),
        (_sentences(1.5, 1.5, sigma_deg=1.01 * SURE_DEG), 0),
        (_sentences(1.5), 0),
    ],
)
def test_azimuths_are_off_alike_within_a_degree(found: list[str], count: int) -> None:
    assert len(found) == count


def test_the_smallest_and_the_largest_angle_are_named() -> None:
    first, *_ = _sentences(2.6, 1.8, 2.2)
    assert first.startswith("1-10: its azimuths are probably off by +2.6°, like those of all ")
    assert "all radars (+1.8 to +2.6°); check whether" in first
    # A displaced site and an angle of two radars displace the aircraft alike.
    assert ", or one of the two sites is wrong; check" in _sentences(2.6, 1.8)[0]
