"""Heights extrapolated for encounters agree with the height filter."""

import numpy as np
import pytest

from multiradar.estimation.filters.height._height_kernels import (
    COUNT,
    P00,
    P01,
    P11,
    RATE,
    RATE_SIGMA_MPS,
    SOURCE,
    VERTICAL_COUNT,
    lasting_variance,
    moved_height,
)
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.encounters.climbs import (
    CLIMB_HEIGHT,
    CLIMB_KIND,
    CLIMB_RATE,
    CLIMB_RATE_VARIANCE,
    CLIMB_VARIANCE,
    climbs,
    moved_climbs,
)
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from support.scenarios.live_scene import recording, sensors

SLOTS = np.array([1, 0, 2])


def _vertical() -> np.ndarray:
    vertical = np.zeros((3, VERTICAL_COUNT))
    vertical[:, RATE], vertical[:, P00], vertical[:, P01], vertical[:, P11] = 7.0, 400.0, 30.0, 9.0
    vertical[:, COUNT], vertical[:, SOURCE] = 2.0, 2.0
    return vertical


def test_heights_move_as_in_their_filter() -> None:
    engine = Engine(sensors(), TrackingSettings())
    aircraft = engine._pool.aircraft._replace(
        height=np.array([5000.0, 6000.0, np.nan]), vertical=_vertical()
    )
    known = climbs(aircraft, SLOTS)
    assert np.isnan(known[2]).all()
    later = moved_climbs(known, np.array([20.0, 0.0, 5.0]))
    height, variance = moved_height(20.0, 1, aircraft.height, aircraft.vertical)
    assert later[0, CLIMB_HEIGHT] == height
    assert later[0, CLIMB_VARIANCE] == pytest.approx(variance)
    np.testing.assert_array_equal(later[1], known[1])


def test_the_variance_includes_lasting_quantisation_and_exact_heights_may_climb() -> None:
    engine = Engine(sensors(), TrackingSettings())
    vertical = _vertical()
    vertical[:, RATE], vertical[:, P00] = 0.0, 1.0
    vertical[1, COUNT] = 0.0
    vertical[1, P11] = 0.0
    aircraft = engine._pool.aircraft._replace(height=np.full(3, 5000.0), vertical=vertical)
    known = climbs(aircraft, SLOTS)
    assert known[1, CLIMB_VARIANCE] == lasting_variance(0, vertical) > 70.0
    assert known[0, CLIMB_VARIANCE] == 0.0
    assert known[0, CLIMB_RATE_VARIANCE] == RATE_SIGMA_MPS**2


def test_the_engine_outputs_heights_and_kinds_of_its_tracks() -> None:
    engine = Engine(sensors(), TrackingSettings())
    engine.push(measurement_batch(recording(1200), sensors())[0])
    engine.flush()
    states = engine.tracks()
    assert states.climbs is not None
    np.testing.assert_array_equal(states.climbs[:, CLIMB_HEIGHT], states.height_m)
    assert set(states.climbs[:, CLIMB_KIND].tolist()) <= {1.0, 2.0}
    assert np.abs(states.climbs[:, CLIMB_RATE]).max() < 5.0
