"""For any plots states are finite, covariances valid, and bounds conservative."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from multiradar.estimation.filters.bank import FILTERS, Outcome
from multiradar.estimation.gaussian import require_covariance
from multiradar.tracking.settings import TrackingSettings
from support.references.compiled_filters import CompiledFilter
from support.references.measurement_models import EllipsoidPolar
from support.references.reference_filters import Observation
from support.scenarios.scenes import Flight, Radar, make_scene

RADARS = [
    Radar("A", 55.9, 60.2, 310.0, biases={0: 400.0, 1: -0.003}),
    Radar("B", 57.4, 61.9, 240.0, biases={0: 130.0, 1: 0.002, 2: 4e-4, 3: 0.2}),
    Radar("C", 55.6, 63.3, 180.0, biases={}),
]
FLIGHTS = [
    Flight(0.0, 30.0, (-60e3, 20e3, 180.0, 120.0), 9_000.0),
    Flight(0.0, 30.0, (15e3, -70e3, -90.0, 200.0), 4_000.0),
]
SCENE = make_scene(np.random.default_rng(0), RADARS, FLIGHTS)
MODEL = EllipsoidPolar(SCENE.plane, SCENE.sensors)


@dataclass(frozen=True)
class Plot:
    """An arbitrary plot: after a gap, deviating by some sigmas, or absurd."""

    aircraft: int
    radar: int
    gap_s: float
    off: tuple[float, float]
    has_height: bool
    epoch_ends: bool


plots = st.builds(
    Plot,
    aircraft=st.integers(0, 1),
    radar=st.integers(0, 2),
    gap_s=st.floats(0.0, 40.0),
    off=st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0))
    | st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)),
    has_height=st.booleans(),
    epoch_ends=st.booleans(),
)


def observe(plot: Plot, time_s: float) -> Observation:
    flight = FLIGHTS[plot.aircraft]
    state = np.array(flight.state)
    state[:2] += time_s * state[2:]
    nothing = Observation(time_s, plot.aircraft, plot.radar, np.zeros(2), flight.height_m)
    seen = MODEL.linearise(nothing, state)
    sigmas = np.sqrt(np.diagonal(seen.noise))
    value = -seen.innovation + seen.by_bias @ SCENE.biases_at(0.0) + sigmas * np.array(plot.off)
    height = flight.height_m if plot.has_height else np.nan
    return Observation(
        time_s, plot.aircraft, plot.radar, np.array([abs(value[0]) + 1.0, value[1]]), height
    )


@pytest.mark.parametrize("name", sorted(FILTERS))
@settings(max_examples=40)
@given(sequence=st.lists(plots, min_size=1, max_size=25))
def test_covariances_remain_valid_for_any_plots(name: str, sequence: list[Plot]) -> None:
    one = CompiledFilter(SCENE, TrackingSettings(filter_name=name), by_epochs=True)
    time_s, started = 0.0, set()
    before = np.diagonal(one.biases()[1]).copy()
    for plot in sequence:
        time_s += plot.gap_s
        outcome = one.process(observe(plot, time_s))
        if outcome <= Outcome.RESTARTED:
            started.add(plot.aircraft)
            assert np.isfinite(one.readout[:8]).all()
        for aircraft in started:
            mean, covariance = one.aircraft(aircraft)
            assert np.isfinite(mean).all()
            require_covariance(covariance, f"{name} after {outcome!r}")
        if plot.epoch_ends:
            one.publish()
            assert np.isfinite(one.biases()[0]).all()
            after = np.diagonal(require_covariance(one.biases()[1], f"{name}, biases"))
            # Without drift no variance grows. CI minimises the sum, in which one bound may rise.
            weights = 1.0 / SCENE.sensors.prior_sigma**2
            assert weights @ after <= weights @ before * (1.0 + 1e-9)
            if name != "ci":
                assert np.all(after <= before * (1.0 + 1e-9))
            before = after.copy()
