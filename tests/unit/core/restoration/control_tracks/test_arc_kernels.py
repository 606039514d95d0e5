"""Branching by arcs, and the kernels of arcs and of thinning against plain forms."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.research.bundle.search_rules import SEGMENT_MIN_S
from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks._arc_kernels import (
    branch_by_arc,
    count_outliers,
    curvature,
    misfit,
    part_of_plot,
    state_at,
)
from multiradar.restoration.control_tracks._thinning_kernels import thin, trace
from multiradar.restoration.control_tracks.plot_rows import plot_rows
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.control_tracks.tracks import (
    ControlTrack,
    MeasurementTrack,
    measurement_track,
)
from support.kernels import plain
from support.scenarios.flown import S_SHAPE, flight, plots_of

Floats = NDArray[np.float64]
SETTINGS = BundleSettings()


def rules() -> Floats:
    found = SETTINGS.rules()
    found[layout.SEGMENT_MIN_S] = SEGMENT_MIN_S
    return found


def row_of(controls: ControlTrack) -> Floats:
    """A track of the kernels; its anchor is the start of the first segment."""
    track = np.zeros(layout.TRACK_COUNT)
    track[layout.COUNT] = len(controls.begin_s)
    track[layout.EAST : layout.HEADING + 1] = controls.start
    for i, begin in enumerate(controls.begin_s):
        at = layout.SEGMENTS + layout.SEGMENT_COUNT * i
        track[at : at + 3] = begin, controls.lateral_mps2[i], controls.longitudinal_mps2[i]
    return track


def exact_plots(flown: ControlTrack, until_s: float, sigma_m: float = 50.0) -> MeasurementTrack:
    times = np.arange(0.0, until_s, 1.5)
    noise = np.broadcast_to(sigma_m**2 * np.eye(2), (len(times), 2, 2))
    return measurement_track(times, flown.geometric(times).position_m, noise, np.zeros(len(times)))


def branched(track: Floats, rows: Floats, *, compiled: bool = True) -> tuple[float, Floats]:
    best, memory = track.copy(), (np.empty(layout.TRACK_COUNT), np.empty(4), np.empty(4))
    function = branch_by_arc if compiled else plain(branch_by_arc)
    found = function(track, best, memory[0], 0.0, rows, 0, len(rows), rules(), *memory[1:])
    return float(found), best


@pytest.mark.parametrize("lateral", [2.0, -3.5])
def test_a_branch_is_the_turn_that_leads_to_the_plot(lateral: float) -> None:
    """Figure 2.1: from a straight track the arc to a plot of a turn that started 20 s before it."""
    plots = exact_plots(flight(((0.0, 0.0), (41.5, lateral))), 62.0)
    assert plots.time_s[-1] == 61.5
    straight = flight(((0.0, 0.0),))
    rows = plot_rows(plots, SETTINGS)
    found, best = branched(row_of(straight), rows)
    assert best[layout.COUNT] == 2.0
    begin, u, w = best[layout.SEGMENTS + layout.SEGMENT_COUNT :][:3]
    assert begin == pytest.approx(41.5)
    # The three points are two of the track, 1.8 m apart, and the plot: the circle deviates from
    # that with the heading of the track by 1e-3 of the lateral acceleration.
    assert u == pytest.approx(lateral, rel=2e-3)
    assert w == 0.0
    end = np.empty(4)
    state_at(best, 0.0, 61.5, end)
    assert np.hypot(*(end[:2] - plots.position_m[-1])) < 1.0
    # Speed and heading at its start are those of the track, at constant speed.
    assert end[2] == pytest.approx(180.0)
    old = misfit(row_of(straight), 0.0, rows, 0, len(rows))
    assert np.isfinite(found)
    assert misfit(best, 0.0, rows, 0, len(rows)) < old - 10.0


def test_the_arc_with_the_best_weight_is_used() -> None:
    """An error of 200 m of the last plot does not pull the arc from the others."""
    turn = ((0.0, 0.0), (41.5, 2.0))
    plots = exact_plots(flight(turn), 62.0)
    plots.position_m[-1] += [0.0, 200.0]
    found, best = branched(row_of(flight(((0.0, 0.0),))), plot_rows(plots, SETTINGS))
    end = np.empty(4)
    state_at(best, 0.0, 61.5, end)
    assert np.hypot(*(end[:2] - flight(turn).geometric([61.5]).position_m[0])) < 120.0
    assert np.isfinite(found)


def test_where_no_arc_is_allowed_there_is_no_branch() -> None:
    straight = row_of(flight(((0.0, 0.0),)))
    # 10 km aside: every arc that leads there has more than 4 m/s².
    aside = exact_plots(flight(((0.0, 0.0),)), 62.0)
    aside.position_m[-1] += [0.0, 10e3]
    assert branched(straight, plot_rows(aside, SETTINGS))[0] == np.inf
    # There is no time for two segments of 10 s within the first twenty seconds.
    young = exact_plots(flight(((0.0, 0.0),)), 18.0)
    assert branched(straight, plot_rows(young, SETTINGS))[0] == np.inf
    # A track with the maximum number of segments gets no more.
    full = row_of(flight([(10.0 * i, 0.0) for i in range(layout.SEGMENTS_MAX)]))
    long = exact_plots(flight(((0.0, 0.0),)), 100.0)
    assert branched(full, plot_rows(long, SETTINGS))[0] == np.inf


def test_positions_of_tracks_are_those_of_their_controls() -> None:
    """The plain form is `ControlTrack.geometric`, by (2.3), also before the anchor."""
    flown = flight(S_SHAPE, along_mps2=-0.3)
    track, times = row_of(flown), np.arange(-10.0, 170.0, 0.5)
    states, one = np.empty((len(times), 4)), np.empty(4)
    trace(track, 0.0, times, states)
    same = flown.geometric(times)
    np.testing.assert_allclose(states[:, :2], same.position_m, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(states[:, 2], same.speed_mps, rtol=1e-13)
    np.testing.assert_allclose(states[:, 3], same.heading_rad, rtol=1e-13)
    for time, state in zip(times[::40].tolist(), states[::40], strict=True):
        segment = state_at(track, 0.0, time, one)
        np.testing.assert_allclose(one, state, rtol=1e-13, atol=1e-8)
        assert segment == max(np.searchsorted(flown.begin_s, time, side="right") - 1, 0)
        plainly = np.empty(4)
        assert plain(state_at)(track, 0.0, time, plainly) == segment
        np.testing.assert_allclose(plainly, one, rtol=1e-13, atol=1e-8)
    plainly_traced = np.empty_like(states)
    plain(trace)(track, 0.0, times, plainly_traced)
    np.testing.assert_allclose(plainly_traced, states, rtol=1e-13, atol=1e-8)


def test_a_plot_is_of_the_track_or_an_outlier() -> None:
    """Section 2.2.4: the likelihood of both together, with the covariance of each plot."""
    rng = np.random.default_rng(1)
    plots = plots_of(flight(S_SHAPE), 90.0, rng, wrong=0.15)
    rows, track = plot_rows(plots, SETTINGS), row_of(flight(S_SHAPE))
    off = plots.position_m - flight(S_SHAPE).geometric(plots.time_s).position_m
    half = 0.5 * np.einsum("ni,nij,nj->n", off, np.linalg.inv(plots.covariance_m2), off)
    parts = -np.logaddexp(-half, rows[:, layout.FLOOR])
    assert misfit(track, 0.0, rows, 0, len(rows)) == pytest.approx(parts.sum(), rel=1e-12)
    for row in (0, int(np.argmax(half))):
        place = plots.position_m[row] - off[row]
        found = part_of_plot(rows, row, *place.tolist())
        assert found == pytest.approx(parts[row], rel=1e-9)
        assert found == pytest.approx(plain(part_of_plot)(rows, row, *place.tolist()), rel=1e-12)
    wrong = int((half > -rows[:, layout.FLOOR]).sum())
    assert wrong > 2
    assert count_outliers(track, 0.0, rows, 0, len(rows)) == wrong
    assert plain(count_outliers)(track, 0.0, rows, 0, len(rows)) == wrong


def test_branches_are_those_of_the_plain_form() -> None:
    plots = plots_of(flight(S_SHAPE), 80.0, np.random.default_rng(2))
    rows, track = plot_rows(plots, SETTINGS), row_of(flight(((0.0, 0.0), (20.0, 0.1))))
    compiled, uncompiled = branched(track, rows), branched(track, rows, compiled=False)
    assert compiled[0] == pytest.approx(uncompiled[0], rel=1e-12)
    np.testing.assert_allclose(compiled[1], uncompiled[1], rtol=1e-12, atol=1e-12)
    points = np.array([1.0, 2.0]), np.array([500.0, 30.0])
    assert curvature(*points, 900.0, 80.0) == plain(curvature)(*points, 900.0, 80.0)


def bundle_of_turns(count: int = 12) -> tuple[Floats, Floats]:
    """Similar straight tracks, all of more weight than three turns; their traces."""
    bends = [(0.0, 0.001 * i) for i in range(count)] + [(20.0, u) for u in (-2.0, 1.0, 2.0)]
    flown = [
        flight(((0.0, 0.0), (begin, u))) if begin else flight(((0.0, u),)) for begin, u in bends
    ]
    tracks = np.array([row_of(one) for one in flown])
    tracks[:, layout.WEIGHT] = -np.arange(len(tracks), dtype=np.float64)
    grid = np.arange(0.0, 41.0)
    traces = np.zeros((len(tracks), len(grid), 4))
    for track, states in zip(tracks, traces, strict=True):
        trace(track, 0.0, grid, states)
    return tracks, traces


def apart_m(traces: Floats) -> Floats:
    """Mean distances of all tracks from each other."""
    off = traces[:, None, :, :2] - traces[None, :, :, :2]
    return np.asarray(np.hypot(off[..., 0], off[..., 1]).mean(axis=-1))


def thinned(
    tracks: Floats, traces: Floats, room: int, apart_m: float, always: int = -1
) -> list[int]:
    kept = np.zeros(len(tracks), np.int64)
    order = np.zeros(len(tracks), np.int64)
    points = traces.shape[1]
    stay = thin(tracks, len(tracks), room, traces, points, apart_m, order, kept, always)
    return [int(one) for one in kept[:stay]]


def test_by_weight_alone_a_bundle_becomes_one_kind_of_motion() -> None:
    """Section 2.2.3: the eight best are nearly equal; by groups all kinds are kept."""
    tracks, traces = bundle_of_turns()
    alone = thinned(tracks.copy(), traces, 8, 0.0)
    assert alone == list(range(8))
    assert apart_m(traces)[0, alone].max() < 2.0
    grouped = thinned(tracks.copy(), traces, 8, 20.0)
    assert grouped == [0, 12, 13, 14]


def test_a_track_may_be_kept_regardless_of_weight() -> None:
    tracks, traces = bundle_of_turns()
    assert thinned(tracks.copy(), traces, 2, 20.0) == [0, 12]
    assert thinned(tracks.copy(), traces, 2, 20.0, 14) == [0, 14]
    # Not if it is close to a better one.
    assert thinned(tracks.copy(), traces, 3, 20.0, 5) == [0, 12, 13]


def test_the_weight_of_a_group_is_assigned_to_its_best_track() -> None:
    tracks, traces = bundle_of_turns()
    weights = np.exp(tracks[:, layout.WEIGHT])
    kept = thinned(tracks, traces, 8, 20.0)
    assert np.exp(tracks[kept[0], layout.WEIGHT]) == pytest.approx(weights[:12].sum(), rel=1e-12)
    assert np.exp(tracks[kept, layout.WEIGHT]).sum() == pytest.approx(weights.sum(), rel=1e-12)


def test_thinning_is_that_of_the_plain_form() -> None:
    rng = np.random.default_rng(3)
    tracks, traces = bundle_of_turns()
    tracks[:, layout.WEIGHT] = rng.normal(size=len(tracks))
    mean = apart_m(traces)
    expected: list[int] = []
    for one in np.argsort(-tracks[:, layout.WEIGHT], kind="stable").tolist():
        if all(mean[one, other] >= 20.0 for other in expected):
            expected.append(one)
    assert thinned(tracks.copy(), traces, 64, 20.0) == expected
    memory = np.zeros((2, len(tracks)), np.int64)
    stay = plain(thin)(tracks, len(tracks), 64, traces, 41, 20.0, *memory, -1)
    assert memory[1, :stay].tolist() == expected
