"""Configured sigmas against the measured noise, at the bounds of both."""

import numpy as np
import pytest

from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.noise import check_noise, check_position_spread, check_spread
from multiradar.wire.sensors import sensor_table
from multiradar_schemas.sensors.sensor import parse_sensors
from support.inputs.mistaken import SIGMAS, recording

NAME = "1-10"
SIGMA_M = SIGMAS[0]


def _evidence(ratio: float, of_others: float = 1.0) -> Evidence:
    evidence = Evidence(recording().table())
    evidence.noise = {NAME: (ratio, 1.0), "2-10": (1.0, of_others)}
    return evidence


def _of(found: Diagnosis | None) -> str:
    if found is None:
        return ""
    sense = found.sentence.partition("too ")[2].partition(":")[0]
    return f"{found.severity} {sense}"


# Measured over configured noise of the range, and scatter of plots over the configured sigma.
@pytest.mark.parametrize(
    ("ratio", "scatter", "expected"),
    [
        (0.58, np.nan, ""),
        (0.56, np.nan, "warning large"),
        (0.251, np.nan, "warning large"),
        (0.249, np.nan, "error large"),
        # A larger scatter is the noise of a radar with few plots among many others.
        (0.3, 0.56, "warning large"),
        (0.3, 0.58, ""),
        (0.3, 3.0, ""),
        (0.3, 0.1, "warning large"),
        # Without a scatter, manoeuvres explain noise up to five times the sigma.
        (5.0, np.nan, ""),
        (5.01, np.nan, "error small"),
        (9.0, 5.01, "error small"),
        (9.0, 5.0, "warning small"),
        (3.4, 1.76, "warning small"),
        (3.4, 1.74, ""),
        # Half of the largest ratio, that of another setting or sensor.
        (9.0, 4.51, "warning small"),
        (9.0, 4.49, ""),
        (1.76, 9.0, "warning small"),
        (1.74, 9.0, ""),
        (9.0, 0.1, ""),
    ],
)
def test_a_sigma_is_wrong_beyond_its_bounds(ratio: float, scatter: float, expected: str) -> None:
    found = check_noise(_evidence(ratio), NAME, (scatter * SIGMA_M, np.nan), causes=False)
    assert _of(found) == expected
    caused = check_noise(_evidence(ratio), NAME, (scatter * SIGMA_M, np.nan), causes=True)
    assert _of(caused) == (expected if expected.endswith("large") else "")


@pytest.mark.parametrize(("ratio", "expected"), [(2.01, "warning small"), (1.99, "")])
def test_noise_below_half_of_that_of_another_sensor_is_its_effect(
    ratio: float, expected: str
) -> None:
    evidence = _evidence(ratio, of_others=4.0)
    assert _of(check_noise(evidence, NAME, (9.0 * SIGMA_M, np.nan), causes=False)) == expected


@pytest.mark.parametrize(
    ("range_m", "azimuth_deg", "expected"),
    [
        (SIGMA_M / 5.01, 1.0, "error large"),
        (SIGMA_M / 4.99, 1.0, ""),
        (SIGMA_M, SIGMAS[1] / 5.01, "error large"),
        (SIGMA_M, SIGMAS[1] / 4.99, ""),
    ],
)
def test_a_scatter_about_others_shows_sigmas_of_five_times_it(
    range_m: float, azimuth_deg: float, expected: str
) -> None:
    spread = range_m, float(np.radians(azimuth_deg))
    assert _of(check_spread(_evidence(1.0), NAME, spread)) == expected


@pytest.mark.parametrize(("spread_m", "expected"), [(5.99, "error large"), (6.01, "")])
def test_reported_positions_scatter_by_a_fifth_of_their_sigma(
    spread_m: float, expected: str
) -> None:
    """The larger one of the two components counts."""
    text = '[[sensor]]\nid = "adsb"\nkind = "adsb"\nposition_sigma_m = 30.0\n'
    sensors = sensor_table(parse_sensors(text))
    assert _of(check_position_spread(sensors, 0, (1.0, spread_m))) == expected
    assert _of(check_position_spread(sensors, 0, (spread_m, 1.0))) == expected
