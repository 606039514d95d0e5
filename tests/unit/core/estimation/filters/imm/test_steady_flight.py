"""Interacting modes in steady flight: noise of the heading."""

import numpy as np
import pytest

from multiradar.tracking.settings import TrackingSettings
from validation.motion.check_manoeuvres import Place
from validation.motion.check_steady import EN_ROUTE, TERMINAL, errors_of, scene

pytestmark = pytest.mark.slow

RUNS, AIRCRAFT = 4, 25
#: Best constant noise under six radars (`check_steady.rows`), m²/s³.
BEST_DENSITY = 20.0


@pytest.fixture(scope="module")
def six_radars() -> tuple[float, float]:
    """Median and worst tenth of the RMS heading error of aircraft with the best constant noise."""
    best = TrackingSettings(
        filter_name="two-stage", manoeuvre_factor_max=1.0, acceleration_density=BEST_DENSITY
    )
    return heading_deg(best, EN_ROUTE + TERMINAL, (20e3, 200e3))


def heading_deg(
    settings: TrackingSettings, places: tuple[Place, ...], away_m: tuple[float, float]
) -> tuple[float, float]:
    flown = [scene(seed, places, away_m, AIRCRAFT, known=True) for seed in range(RUNS)]
    errors = np.concatenate([errors_of(settings, one)[0] for one in flown])
    return float(np.median(errors)), float(np.quantile(errors, 0.9))


@pytest.mark.parametrize("away_m", [(60e3, 150e3), (150e3, 400e3)])
def test_one_slow_radar_is_at_most_half_noisier_than_six_radars_with_constant_noise(
    six_radars: tuple[float, float], away_m: tuple[float, float]
) -> None:
    median, worst = heading_deg(TrackingSettings(filter_name="imm"), EN_ROUTE[:1], away_m)
    assert median < six_radars[0]
    assert worst < 1.5 * six_radars[1]
