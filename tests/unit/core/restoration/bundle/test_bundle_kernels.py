"""The step of a bundle against its plain form, and the compaction of tracks."""

import numpy as np
import pytest

from multiradar.restoration.bundle import trajectory_bundle as of_bundles
from multiradar.restoration.bundle._bundle_kernels import compact, push_plot
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks.settings import BundleSettings
from support.kernels import plain
from support.scenarios.flown import flight, plots_of


@pytest.mark.parametrize("seed", range(5))
def test_kept_tracks_are_moved_to_the_front(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tracks = rng.normal(size=(30, 4))
    kept = rng.permutation(20)[:12].astype(np.int64)
    for function in (compact, plain(compact)):
        moved, order = tracks.copy(), np.zeros(30, np.int64)
        function(moved, kept, order, 12)
        np.testing.assert_array_equal(moved[:12], tracks[kept])
        np.testing.assert_array_equal(np.sort(moved, axis=0), np.sort(tracks, axis=0))


@pytest.mark.slow
def test_a_step_equals_its_plain_form(monkeypatch: pytest.MonkeyPatch) -> None:
    """A turn, wrong plots, and a sliding window: tracks to 1e-6 of their weights."""
    plots = plots_of(
        flight(((0.0, 0.0), (45.0, 2.0))), 80.0, np.random.default_rng(3), interval_s=3.0, wrong=0.1
    )
    settings = BundleSettings(window_s=40.0)
    found = []
    for function in (push_plot, plain(push_plot)):
        monkeypatch.setattr(of_bundles, "push_plot", function)
        bundle = Bundle(settings)
        bundle.push_all(plots)
        found.append(bundle)
    assert found[0].window_s == found[1].window_s
    assert found[0].window_s[0] > 30.0
    assert found[0].weights() == pytest.approx(found[1].weights(), abs=1e-6)
    states = [one.estimate().state for one in found]
    assert states[0] == pytest.approx(states[1], rel=1e-9, abs=1e-6)
