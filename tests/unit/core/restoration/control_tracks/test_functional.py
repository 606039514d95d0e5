"""The functional of a track, its derivatives, and its minimisation."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.restoration.bundle._window_kernels import write_information
from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks._arc_kernels import misfit
from multiradar.restoration.control_tracks._fit_kernels import fit_track
from multiradar.restoration.control_tracks._functional_kernels import assess
from multiradar.restoration.control_tracks._scratch import FitScratch, fit_scratch
from multiradar.restoration.control_tracks.plot_rows import plot_rows
from multiradar.restoration.control_tracks.reading import parameters_of
from multiradar.restoration.control_tracks.settings import BundleSettings
from support.kernels import plain
from support.scenarios.flown import S_SHAPE, flight, plots_of

Floats = NDArray[np.float64]
SETTINGS = BundleSettings()
KINDS, RULES = SETTINGS.kinds(), SETTINGS.rules()
UNTIL_S = 150.0


def rows(seed: int = 1, wrong: float = 0.0) -> Floats:
    plots = plots_of(flight(S_SHAPE), UNTIL_S, np.random.default_rng(seed), wrong=wrong)
    return plot_rows(plots, SETTINGS)


def track(memory: FitScratch, *, off: float = 0.0) -> Floats:
    """The S-shaped flight as a track, or one with small deviations of all parameters."""
    made = np.zeros(layout.TRACK_COUNT)
    made[layout.COUNT] = len(S_SHAPE)
    state = (off * 40.0, off * -30.0, 180.0 + off * 2.0, np.pi / 2.0 + off * 0.01)
    made[layout.EAST : layout.HEADING + 1] = state
    for i, (begin, lateral) in enumerate(S_SHAPE):
        at = layout.SEGMENTS + layout.SEGMENT_COUNT * i
        kind = layout.STRAIGHT if not lateral else layout.RIGHT if lateral > 0.0 else layout.LEFT
        made[at : at + layout.SEGMENT_COUNT] = (
            begin + off * 1.5, lateral + off * 0.2, off * 0.01, kind, begin,
        )  # fmt: skip
    made[layout.PRIOR_MEAN : layout.PRIOR_MEAN + 6] = (0.0, 0.0, 180.0, np.pi / 2.0, 0.0, 0.0)
    covariance = np.diag([1e6, 1e6, 1e4, 1.0, 1e-4, 1e-4])
    made[layout.PRIOR_COVARIANCE : layout.PRIOR_COVARIANCE + 36] = covariance.ravel()
    write_information(made, memory.H, memory.H2)
    return made


def value(of: Floats, plots: Floats, memory: FitScratch) -> float:
    return float(
        assess(of, 0.0, plots, 1, len(plots), KINDS, RULES[layout.CELL_SIGMA_S], *memory[1:3],
               *memory[5:])
    )  # fmt: skip


def test_the_gradient_is_that_of_the_functional() -> None:
    memory, plots = fit_scratch(), rows(wrong=0.05)
    made = track(memory, off=0.3)
    value(made, plots, memory)
    columns, steps = parameters_of(len(S_SHAPE))
    gradient = memory.g[: len(columns)].copy()
    for slope, column, step in zip(gradient, columns, steps, strict=True):
        ends = []
        for way in (step, -step):
            moved = made.copy()
            moved[column] += way
            ends.append(value(moved, plots, memory))
        # Differences of values of some hundred have seven digits at these steps.
        assert (ends[0] - ends[1]) / (2.0 * step) == pytest.approx(slope, rel=1e-3, abs=1e-2)


def test_the_curvature_is_that_of_least_squares() -> None:
    # Without outliers and at the optimum: H is the derivative of the gradient, except for second
    # derivatives of the path times the residuals, which matter most for switches.
    memory, plots = fit_scratch(), rows()
    made = track(memory)
    fit_track(made, 0.0, plots, 1, len(plots), UNTIL_S, KINDS, RULES, 20, memory)
    value(made, plots, memory)
    columns, steps = parameters_of(len(S_SHAPE))
    size = len(columns)
    lower = np.tril(memory.H[:size, :size])
    curvature = lower + np.tril(lower, -1).T
    slopes = np.empty((size, size))
    for i, (column, step) in enumerate(zip(columns, steps, strict=True)):
        ends = []
        for way in (step, -step):
            moved = made.copy()
            moved[column] += way
            value(moved, plots, memory)
            ends.append(memory.g[:size].copy())
        slopes[i] = (ends[0] - ends[1]) / (2.0 * step)
    scale = np.sqrt(np.outer(np.diag(curvature), np.diag(curvature)))
    assert np.abs((slopes - curvature) / scale).max() < 0.3
    assert np.linalg.eigvalsh(curvature / scale).min() > 0.0


def test_a_distant_plot_costs_as_much_as_an_outlier() -> None:
    memory, plots = fit_scratch(), rows()
    made = track(memory)
    before = misfit(made, 0.0, plots, 1, len(plots))
    for far in (3e3, 3e5):
        moved = plots.copy()
        moved[50, layout.PLOT_EAST] += far
        after = misfit(made, 0.0, moved, 1, len(plots))
        assert 0.0 < after - before <= -plots[50, layout.FLOOR] + 1e-9


def test_the_fit_converges_to_the_flight() -> None:
    memory, plots = fit_scratch(), rows(seed=3, wrong=0.05)
    made = track(memory, off=1.0)
    before = value(made, plots, memory)
    after = fit_track(made, 0.0, plots, 1, len(plots), UNTIL_S, KINDS, RULES, 20, memory)
    assert after < before - 10.0
    segments = made[layout.SEGMENTS :][: 4 * layout.SEGMENT_COUNT].reshape(4, -1)
    # 50 m of noise every 1.5 s over 40 s determine u to 0.05 m/s² and a switch to about a second.
    np.testing.assert_allclose(segments[1:3, layout.LATERAL], [-2.0, 2.0], atol=0.2)
    np.testing.assert_allclose(segments[1:, layout.BEGIN], [60.0, 100.0, 140.0], atol=4.0)


def test_limits_hold() -> None:
    memory, plots = fit_scratch(), rows()
    tight = RULES.copy()
    tight[layout.LATERAL_MAX], tight[layout.LONGITUDINAL_MAX] = 1.0, 0.005
    made = track(memory)
    made[layout.SEGMENTS + layout.LATERAL :: layout.SEGMENT_COUNT][:4] = 0.0
    fit_track(made, 0.0, plots, 1, len(plots), UNTIL_S, KINDS, tight, 20, memory)
    segments = made[layout.SEGMENTS :][: 4 * layout.SEGMENT_COUNT].reshape(4, -1)
    # The flight turns with 2 m/s²: the limit is reached.
    np.testing.assert_allclose(segments[1:3, layout.LATERAL], [-1.0, 1.0], rtol=1e-12)
    assert np.abs(segments[:, layout.LONGITUDINAL]).max() <= 0.005


def test_kernels_equal_their_plain_forms() -> None:
    compiled, uncompiled = fit_scratch(), fit_scratch()
    plots = rows(wrong=0.05)
    made = track(compiled, off=0.5)
    found = value(made, plots, compiled)
    same = plain(assess)(
        made, 0.0, plots, 1, len(plots), KINDS, RULES[layout.CELL_SIGMA_S], *uncompiled[1:3],
        *uncompiled[5:],
    )  # fmt: skip
    assert found == pytest.approx(same, rel=1e-12)
    np.testing.assert_allclose(compiled.g, uncompiled.g, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(compiled.H, uncompiled.H, rtol=1e-9, atol=1e-9)
    assert misfit(made, 0.0, plots, 1, len(plots)) == pytest.approx(
        plain(misfit)(made, 0.0, plots, 1, len(plots)), rel=1e-12
    )
