"""The compiled path of a bundle against its plain form, and its estimate."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import RestorationError, TrajectoryError
from multiradar.restoration.bundle.estimate import BEST, WEIGHTED, velocity_states
from multiradar.restoration.bundle.final_states import final_states_of
from multiradar.restoration.bundle.path import FitWindow, path_of
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks._fit_kernels import fit_track
from multiradar.restoration.control_tracks._scratch import FitScratch, fit_scratch
from multiradar.restoration.control_tracks._thinning_kernels import trace
from multiradar.restoration.control_tracks.reading import parameters_of, segments_of
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.control_tracks.tracks import whole_seconds
from support.scenarios.flown import S_SHAPE, flight, plots_of

Floats = NDArray[np.float64]


@pytest.fixture(scope="module")
def bundle() -> Bundle:
    found = Bundle(BundleSettings())
    found.push_all(plots_of(flight(S_SHAPE), 150.0, np.random.default_rng(5)))
    return found


def plain_states(track: Floats, anchor_s: float, time_s: Floats) -> Floats:
    flown = np.empty((len(time_s), 4))
    trace(track, anchor_s, time_s, flown)
    return velocity_states(flown)


def plain_spreads(track: Floats, window: FitWindow, time_s: Floats, memory: FitScratch) -> Floats:
    """J H⁻¹ Jᵀ, written with matrices."""
    moved = track.copy()
    fit_track(
        moved, window.anchor_s, window.plots, 0, len(window.plots),
        float(window.plots[-1, layout.TIME]), window.kinds, window.rules, 0, memory,
    )  # fmt: skip
    columns, steps = parameters_of(int(track[layout.COUNT]))
    factor = np.tril(memory.H[: len(columns), : len(columns)])
    inverse = np.linalg.inv(factor @ factor.T)
    slopes = np.empty((len(time_s), 4, len(columns)))
    for j, (column, step) in enumerate(zip(columns, steps, strict=True)):
        ends = []
        for way in (step, -step):
            moved[column] = track[column] + way
            ends.append(plain_states(moved, window.anchor_s, time_s))
        moved[column] = track[column]
        slopes[:, :, j] = (ends[0] - ends[1]) / (2.0 * step)
    return np.asarray(slopes @ inverse @ slopes.transpose(0, 2, 1))


def test_the_kernel_equals_the_plain_form(bundle: Bundle) -> None:
    window = window_of(bundle)
    times, weights = whole_seconds(*bundle.window_s)[::7], bundle.weights()
    found = path_of(bundle._tracks, weights, window, times, fit_scratch())
    memory = fit_scratch()
    mean, second = np.zeros((len(times), 4)), np.zeros((len(times), 4, 4))
    controls, chances = np.zeros((len(times), 2)), np.zeros((len(times), layout.KINDS))
    for weight, track in zip(weights, bundle._tracks, strict=False):
        states = plain_states(track, bundle._anchor_s, times)
        spreads = plain_spreads(track, window, times, memory)
        mean += weight * states
        second += weight * (spreads + states[:, :, None] * states[:, None, :])
        segments = segments_of(track)
        for row, time in enumerate(times):
            at = int(np.sum(segments[1:, layout.BEGIN] <= time))
            controls[row] += weight * segments[at, [layout.LATERAL, layout.LONGITUDINAL]]
            chances[row, int(segments[at, layout.KIND])] += weight
    assert len(weights) > 3
    assert found.state == pytest.approx(mean, rel=1e-12, abs=1e-9)
    # Moments about zero lose 1e-16 of the square of some 3e4 m.
    covariance = second - mean[:, :, None] * mean[:, None, :]
    assert found.covariance == pytest.approx(covariance, rel=1e-6, abs=1e-4)
    assert found.lateral_mps2 == pytest.approx(controls[:, 0], abs=1e-12)
    assert found.longitudinal_mps2 == pytest.approx(controls[:, 1], abs=1e-12)
    assert found.kind_probability == pytest.approx(chances, abs=1e-12)


@pytest.mark.parametrize("by", [BEST, WEIGHTED])
def test_a_path_is_the_estimate_of_each_of_its_times(bundle: Bundle, by: str) -> None:
    times = whole_seconds(*bundle.window_s)
    path, restored = bundle.path(times, by), bundle.restored(times, by)
    assert path.state[:, :2] == pytest.approx(restored.position_m, abs=1e-6)
    for row in (0, 40, len(times) - 1):
        one = bundle.estimate(by, float(times[row]))
        assert path.state[row] == pytest.approx(one.state, abs=1e-6)
        assert path.covariance[row] == pytest.approx(one.covariance, rel=1e-9, abs=1e-9)
    assert np.all(np.linalg.eigvalsh(path.covariance) > 0.0)


def test_a_path_without_times_is_empty(bundle: Bundle) -> None:
    assert bundle.path([]).covariance.shape == (0, 4, 4)


def test_a_copy_is_equal_and_independent(bundle: Bundle) -> None:
    copy, before = bundle.copy(), bundle.estimate()
    assert copy.estimate().state.tolist() == before.state.tolist()
    assert (copy.window_s, copy.plots, len(copy)) == (bundle.window_s, bundle.plots, len(bundle))
    copy.push(before.time_s + 4.0, before.state[:2] + 5000.0, 2500.0 * np.eye(2))
    assert copy.estimate().time_s == before.time_s + 4.0
    assert bundle.estimate().state.tolist() == before.state.tolist()


def test_there_is_no_path_before_the_first_triple() -> None:
    with pytest.raises(RestorationError):
        Bundle(BundleSettings()).path([0.0])


def spoilt(bundle: Bundle, rows: slice) -> Floats:
    """The tracks of a bundle; given rows have an indefinite information matrix."""
    tracks = bundle._tracks.copy()
    tracks[rows, layout.PRIOR_INFORMATION : layout.PRIOR_LOGARITHM] = -np.eye(6).ravel()
    return tracks


def window_of(bundle: Bundle) -> FitWindow:
    settings = BundleSettings()
    plots = bundle._plots[bundle._first : bundle._last]
    return FitWindow(bundle._anchor_s, plots, settings.kinds(), settings.rules())


def test_a_track_without_covariance_has_weight_zero(bundle: Bundle) -> None:
    window, weights = window_of(bundle), bundle.weights()
    times, tracks = whole_seconds(*bundle.window_s)[::7], spoilt(bundle, slice(1, 2))
    others = np.delete(np.arange(len(weights)), 1)
    left = weights[others] / weights[others].sum()
    memory = fit_scratch()
    found = path_of(tracks, weights, window, times, memory)
    expected = path_of(tracks[others], left, window, times, memory)
    assert found.state == pytest.approx(expected.state, rel=1e-12, abs=1e-9)
    assert found.covariance == pytest.approx(expected.covariance, rel=1e-9, abs=1e-9)
    assert found.kind_probability == pytest.approx(expected.kind_probability, abs=1e-12)
    ends = final_states_of(tracks, weights, window, memory)
    assert ends.weight[others] == pytest.approx(left, rel=1e-12)
    assert ends.weight[1] == 0.0
    assert np.all(np.isfinite(ends.covariance))


def test_tracks_without_any_covariance_are_rejected(bundle: Bundle) -> None:
    window, weights, memory = window_of(bundle), bundle.weights(), fit_scratch()
    tracks = spoilt(bundle, slice(None))
    for call in (
        lambda: path_of(tracks, weights, window, np.array([100.0]), memory),
        lambda: final_states_of(tracks, weights, window, memory),
    ):
        with pytest.raises(TrajectoryError, match="trajectories has a covariance") as error:
            call()
        assert error.value.code == "NO_COVARIANCE"
