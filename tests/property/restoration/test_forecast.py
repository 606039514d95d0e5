"""A forecast ensemble is a valid function of the bundle alone."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from multiradar.restoration.bundle.manoeuvre_history import ManoeuvreHistory
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.forecast.bundle_forecast import forecast
from multiradar.restoration.forecast.settings import AHEAD_MAX_S, ForecastSettings
from support.scenarios.flown import flight, plots_of


def _bundle(seed: int, lateral_mps2: float, until_s: float) -> Bundle:
    flown = flight(((0.0, 0.0), (50.0, lateral_mps2)))
    bundle = Bundle(BundleSettings(tracks_max=6))
    bundle.push_all(
        plots_of(flown, until_s, np.random.default_rng(seed), interval_s=4.0, wrong=0.1)
    )
    return bundle


@settings(max_examples=12)
@given(
    st.integers(0, 2**16),
    st.floats(-4.0, 4.0),
    st.floats(45.0, 120.0),
    st.lists(st.floats(0.0, AHEAD_MAX_S), min_size=1, max_size=6),
    st.builds(ManoeuvreHistory, st.floats(0.0, 1e7), st.floats(0.0, 1e7)),
)
def test_the_same_bundle_gives_the_same_valid_ensemble(
    seed: int, lateral_mps2: float, until_s: float, ahead: list[float], habits: ManoeuvreHistory
) -> None:
    times = np.sort(ahead)
    one, two = (
        forecast(
            _bundle(seed, lateral_mps2, until_s).final_states(), times, ForecastSettings(), habits
        )
        for _ in range(2)
    )
    np.testing.assert_array_equal(one.weight, two.weight)
    np.testing.assert_array_equal(one.state, two.state)
    np.testing.assert_array_equal(one.covariance, two.covariance)
    np.testing.assert_allclose(one.weight.sum(axis=1), 1.0, rtol=1e-9)
    assert np.isfinite(one.state).all()
    # Of all members, including later ones with probability zero.
    assert np.linalg.eigvalsh(one.covariance).min() > 0.0
    assert np.linalg.eigvalsh(one.spread()).min() > 0.0
