"""Plots that leave the window update mean and covariance like a plain Kalman filter."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.restoration.bundle._window_kernels import drop_plot, write_information
from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks._fit_kernels import fit_track
from multiradar.restoration.control_tracks._motion_kernels import fly
from multiradar.restoration.control_tracks._scratch import fit_scratch
from multiradar.restoration.control_tracks.plot_rows import plot_rows
from multiradar.restoration.control_tracks.settings import BundleSettings
from support.kernels import plain
from support.scenarios.flown import S_SHAPE, flight, plots_of

Floats = NDArray[np.float64]
SETTINGS = BundleSettings()
KINDS, RULES = SETTINGS.kinds(), SETTINGS.rules()
#: Smoothed parameters, and their prior: position, speed, heading, accelerations.
THETA = np.array([100.0, -50.0, 180.0, 1.4, 0.6, 0.05])
MEAN = THETA + np.array([20.0, -10.0, 1.0, 0.01, 0.05, -0.01])
COVARIANCE = np.diag([80.0, 90.0, 4.0, 0.03, 0.2, 0.02]) ** 2


def made(begins: tuple[float, ...] = (0.0,), kinds: tuple[int, ...] = (layout.RIGHT,)) -> Floats:
    """A track of these segments, the first with the controls of `THETA`."""
    track = np.zeros(layout.TRACK_COUNT)
    track[layout.COUNT] = len(begins)
    track[layout.EAST : layout.HEADING + 1] = THETA[:4]
    for i, (begin, kind) in enumerate(zip(begins, kinds, strict=True)):
        at = layout.SEGMENTS + layout.SEGMENT_COUNT * i
        controls = THETA[4:] if i == 0 else (-1.0, 0.2)
        track[at : at + layout.SEGMENT_COUNT] = begin, *controls, kind, begin
    known = made_known(track)
    write_information(known, np.zeros((6, 6)), np.zeros((6, 6)))
    return known


def made_known(track: Floats) -> Floats:
    track[layout.PRIOR_MEAN : layout.PRIOR_MEAN + 6] = MEAN
    track[layout.PRIOR_COVARIANCE : layout.PRIOR_COVARIANCE + 36] = COVARIANCE.ravel()
    return track


def known(track: Floats) -> tuple[Floats, Floats]:
    at = layout.PRIOR_COVARIANCE
    mean = track[layout.PRIOR_MEAN : layout.PRIOR_MEAN + 6].copy()
    return mean, track[at : at + 36].reshape(6, 6).copy()


def flown(theta: Floats, t: float) -> Floats:
    east, north, speed, heading, u, w = theta.tolist()
    return np.array([*fly(east, north, speed, heading, u, w, t), u, w])


# Predicted mean and covariance, linearised at θ; flights do not consist of exact segments.
def predicted(theta: Floats, mean: Floats, covariance: Floats, t: float) -> tuple[Floats, Floats]:
    slopes = np.empty((6, 6))
    for i, step in enumerate((1.0, 1.0, 1e-2, 1e-5, 1e-4, 1e-4)):
        moved = np.eye(6)[i] * step
        slopes[:, i] = (flown(theta + moved, t) - flown(theta - moved, t)) / (2.0 * step)
    end = flown(theta, t)
    found = slopes @ covariance @ slopes.T
    found[2, 2] += RULES[layout.VELOCITY_DRIFT] * t
    found[3, 3] += RULES[layout.VELOCITY_DRIFT] * t / end[2] ** 2
    return end + slopes @ (mean - theta), found


# Update by a position, weighted by the probability that the plot is good.
def corrected(
    mean: Floats, covariance: Floats, place: Floats, information: Floats
) -> tuple[Floats, Floats]:
    h = np.eye(6)[:2]
    gain = covariance @ h.T @ np.linalg.inv(h @ covariance @ h.T + np.linalg.inv(information))
    return mean + gain @ (place - mean[:2]), covariance - gain @ h @ covariance


def plot_at(time_s: float, place: Floats, sigma_m: float = 60.0) -> Floats:
    rows = np.zeros((1, layout.PLOT_COUNT))
    rows[0, layout.TIME] = time_s
    rows[0, layout.PLOT_EAST : layout.PLOT_NORTH + 1] = place
    covariance = np.array([[sigma_m**2, 900.0], [900.0, 0.5 * sigma_m**2]])
    information = np.linalg.inv(covariance)
    rows[0, layout.EAST_EAST], rows[0, layout.NORTH_NORTH] = np.diagonal(information)
    rows[0, layout.EAST_NORTH] = information[0, 1]
    rows[0, layout.FLOOR] = SETTINGS.floor(np.asarray(np.linalg.det(covariance)))
    return rows


def information_of(rows: Floats, place: Floats) -> Floats:
    found = np.array(
        [
            [rows[0, layout.EAST_EAST], rows[0, layout.EAST_NORTH]],
            [rows[0, layout.EAST_NORTH], rows[0, layout.NORTH_NORTH]],
        ]
    )
    off = place - rows[0, layout.PLOT_EAST : layout.PLOT_NORTH + 1]
    good = 1.0 / (1.0 + np.exp(rows[0, layout.FLOOR] + 0.5 * off @ found @ off))
    return np.asarray(found * good)


def left(track: Floats, rows: Floats, *, compiled: bool = True) -> Floats:
    moved = track.copy()
    function = drop_plot if compiled else plain(drop_plot)
    function(moved, 0.0, rows, 0, KINDS, RULES, np.zeros((6, 6)), np.zeros((6, 6)))
    return moved


# Sigmas and correlations to 1e-6, the accuracy of numerical derivatives.
def assert_known(track: Floats, mean: Floats, covariance: Floats) -> None:
    found_mean, found = known(track)
    sigmas = np.sqrt(np.diagonal(covariance))
    assert found_mean / sigmas == pytest.approx(mean / sigmas, abs=1e-5)
    scale = np.outer(sigmas, sigmas)
    assert found / scale == pytest.approx(covariance / scale, abs=1e-6)


def test_a_dropped_plot_updates_a_kalman_filter() -> None:
    end = flown(THETA, 7.0)
    rows = plot_at(7.0, end[:2] + np.array([40.0, -30.0]))
    moved = left(made(), rows)
    assert moved[layout.EAST : layout.HEADING + 1] == pytest.approx(end[:4], rel=1e-12)
    mean, covariance = predicted(THETA, MEAN, COVARIANCE, 7.0)
    place = rows[0, layout.PLOT_EAST : layout.PLOT_NORTH + 1]
    assert_known(moved, *corrected(mean, covariance, place, information_of(rows, end[:2])))


def test_a_dropped_outlier_has_no_effect() -> None:
    rows = plot_at(7.0, flown(THETA, 7.0)[:2] + np.array([3e3, 0.0]))
    assert_known(left(made(), rows), *predicted(THETA, MEAN, COVARIANCE, 7.0))


def test_an_ended_segment_leaves_no_information_of_its_controls() -> None:
    """The next ones have the prior of their kind, uncorrelated."""
    track = made((0.0, 4.0), (layout.RIGHT, layout.SLOWER))
    rows = plot_at(7.0, np.array([1e5, 1e5]))
    moved = left(track, rows)
    assert moved[layout.COUNT] == 1.0
    assert moved[layout.SEGMENTS + layout.KIND] == layout.SLOWER
    mean, covariance = predicted(THETA, MEAN, COVARIANCE, 4.0)
    kind = KINDS[layout.SLOWER]
    mean[4:] = kind[layout.LATERAL_MEAN], kind[layout.LONGITUDINAL_MEAN]
    covariance[4:], covariance[:, 4:] = 0.0, 0.0
    covariance[4, 4] = kind[layout.LATERAL_SIGMA] ** 2
    covariance[5, 5] = kind[layout.LONGITUDINAL_SIGMA] ** 2
    there = np.array([*flown(THETA, 4.0)[:4], -1.0, 0.2])
    assert_known(moved, *predicted(there, mean, covariance, 3.0))
    assert moved[layout.EAST : layout.HEADING + 1] == pytest.approx(flown(there, 3.0)[:4])


def test_the_information_is_that_of_the_covariance() -> None:
    moved = left(made(), plot_at(7.0, flown(THETA, 7.0)[:2]))
    _, covariance = known(moved)
    at = layout.PRIOR_INFORMATION
    found = moved[at : at + 36].reshape(6, 6) @ covariance
    # Variances from 1e-4 to 1e6: the inverse loses ten digits at most.
    assert found == pytest.approx(np.eye(6), abs=1e-6)
    assert (covariance == covariance.T).all()
    logarithm = -np.linalg.slogdet(covariance)[1]
    assert moved[layout.PRIOR_LOGARITHM] == pytest.approx(logarithm, rel=1e-9)


def test_kernels_equal_their_plain_forms() -> None:
    track = made((0.0, 4.0), (layout.RIGHT, layout.LEFT))
    rows = plot_at(7.0, flown(THETA, 7.0)[:2])
    np.testing.assert_allclose(
        left(track, rows), left(track, rows, compiled=False), rtol=1e-9, atol=1e-12
    )
    # Three iterations over the plots of half a minute.
    plots = plot_rows(plots_of(flight(S_SHAPE), 30.0, np.random.default_rng(1)), SETTINGS)
    track = made()
    track[layout.HEADING] = np.pi / 2.0
    ends = []
    for function in (fit_track, plain(fit_track)):
        moved, memory = track.copy(), fit_scratch()
        value = function(moved, 0.0, plots, 0, len(plots), 29.0, KINDS, RULES, 3, memory)
        ends.append((value, moved))
    assert ends[0][0] == pytest.approx(ends[1][0], rel=1e-9)
    np.testing.assert_allclose(ends[0][1], ends[1][1], rtol=1e-7, atol=1e-9)
