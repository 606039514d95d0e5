"""Offsets that the run estimates far from the configured ones are warnings."""

import numpy as np
import pytest

from multiradar.diagnosis.cross_sensor.offsets import check_large_offsets
from multiradar.diagnosis.evidence import Evidence
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_OFFSET,
)
from support.inputs.mistaken import recording

NAME = "1-10"


@pytest.mark.parametrize(
    ("offset_deg", "sigma_deg", "prior", "known"),
    [
        (2.3, 0.01, {}, True),
        (-2.3, 0.01, {}, True),
        (0.9, 0.01, {}, False),
        (2.3, 0.5, {}, False),
        (2.3, 0.01, {"azimuth_offset_deg": {"prior": 2.0}}, False),
        (2.3, 0.01, {"azimuth_offset_deg": {"prior_sigma": 2.0}}, False),
    ],
)
def test_azimuths_that_are_far_off_are_a_warning(
    offset_deg: float, sigma_deg: float, prior: dict[str, dict[str, float]], *, known: bool
) -> None:
    evidence = Evidence(recording().configured(NAME, bias=prior).table())
    evidence.biases[0, PARAMETER_AZIMUTH_OFFSET] = (
        float(np.radians(offset_deg)), float(np.radians(sigma_deg)),
    )  # fmt: skip
    said = check_large_offsets(evidence)
    assert bool(said) == known
    if said:
        assert (said[0].sensor_id, said[0].severity) == (NAME, "warning")
        assert f"azimuth offset is {offset_deg:+.2f}°, but +0.00° ± 0.50°" in said[0].sentence


@pytest.mark.parametrize(
    ("offset_m", "prior", "known"),
    [
        (5185.0, {}, True),
        (-1100.0, {}, True),
        (900.0, {}, False),
        (1400.0, {"range_offset_m": {"prior_sigma": 800.0}}, False),
    ],
)
def test_ranges_that_are_far_off_are_a_warning(
    offset_m: float, prior: dict[str, dict[str, float]], *, known: bool
) -> None:
    """Regression: an offset beyond that of any radar was estimated without a word."""
    evidence = Evidence(recording().configured(NAME, bias=prior).table())
    evidence.biases[0, PARAMETER_RANGE_OFFSET] = offset_m, 1.2
    said = check_large_offsets(evidence)
    assert bool(said) == known
    if said:
        assert (said[0].sensor_id, said[0].severity) == (NAME, "warning")
        assert f"range offset is {offset_m:+.0f} m, but +0 m ± 500 m" in (said[0].sentence)
