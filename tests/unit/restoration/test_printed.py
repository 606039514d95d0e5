"""The report's own procedures: arcs, groups, the search of Hooke and Jeeves."""

import numpy as np
import pytest

from multiradar.errors import RestorationError
from multiradar.restoration import _layout as layout
from multiradar.restoration._arc_kernels import curvature
from multiradar.restoration._hooke_jeeves_kernels import PENALTY, judged, search
from multiradar.restoration.printed import SEGMENT_MIN_S, PrintedBundle, SearchRules
from multiradar.restoration.settings import BundleSettings
from multiradar.restoration.tracks import mean_distance, whole_seconds
from support.flown import flight, plots_of
from support.kernels import plain

TURN = ((0.0, 0.0), (40.0, -2.0))
SETTINGS = BundleSettings(apart_m=20.0)
LIMITS = np.array([4.0, 2.0, SEGMENT_MIN_S, SEGMENT_MIN_S])


def begun(seed: int = 1, *, sigma_m: float = 50.0) -> tuple[PrintedBundle, int]:
    plots = plots_of(flight(TURN), 70.0, np.random.default_rng(seed), sigma_m=sigma_m)
    known = int(np.searchsorted(plots.time_s, 30.0))
    bundle = PrintedBundle(plots, SETTINGS)
    bundle.start(known)
    bundle.thin(known)
    return bundle, known


def test_an_arc_goes_through_three_points() -> None:
    # Points of a circle of 5 km to the right of north, and of one to the left.
    angle = np.array([0.0, 0.3, 0.8])
    for side in (1.0, -1.0):
        east, north = side * 5e3 * (1.0 - np.cos(angle)), 5e3 * np.sin(angle)
        found = curvature(
            np.array([east[0], north[0]]), np.array([east[1], north[1]]), east[2], north[2]
        )
        assert found == pytest.approx(side / 5e3, rel=1e-9)


def test_branches_lead_to_the_new_plot() -> None:
    bundle, known = begun(sigma_m=20.0)
    before, count = bundle.controls(), known + 12
    bundle.branch(count)
    branches = bundle.controls()[len(before) :]
    assert 0 < len(branches) <= len(before)
    for one in branches:
        assert one.longitudinal_mps2[-1] == 0.0
        # The last segment is the arc, and no segment is shorter than the search allows.
        assert 10.0 <= bundle_now(count) - one.begin_s[-1] <= 40.0
        assert np.diff(one.begin_s).min() >= SEGMENT_MIN_S
    old = bundle.misfits(count)[: len(before)]
    new = bundle.misfits(count)[len(before) :]
    # Twelve plots of a turn that no old track knows: the best arc fits better than any.
    assert new.min() < old.min() - 5.0


def bundle_now(count: int) -> float:
    return 1.5 * (count - 1)


def test_groups_keep_their_best_and_are_apart() -> None:
    bundle, known = begun()
    plots = plots_of(flight(TURN), 70.0, np.random.default_rng(1))
    whole = PrintedBundle(plots, SETTINGS)
    whole.start(known)
    best = whole.misfits(known).min()
    assert len(bundle) < len(whole)
    assert bundle.misfits(known)[0] == best
    grid = whole_seconds(0.0, float(plots.time_s[known - 1]))
    shown = [one.geometric(grid) for one in bundle.controls()]
    for i, one in enumerate(shown):
        for other in shown[:i]:
            assert mean_distance(one, other) >= SETTINGS.apart_m


def test_the_search_lowers_the_functional_within_the_limits() -> None:
    bundle, known = begun()
    for count in range(known + 1, known + 20):
        bundle.branch(count)
        bundle.thin(count)
    before = bundle.misfits(known + 19)
    evaluations = bundle.optimise(known + 19)
    after = bundle.misfits(known + 19)
    assert np.all(after <= before)
    assert after.min() < before.min() - 1.0
    assert evaluations > 100 * len(bundle)
    for one in bundle.controls():
        assert np.abs(one.lateral_mps2).max() <= 4.0
        assert np.abs(one.longitudinal_mps2).max() <= 2.0
        if len(one.begin_s) > 1:
            assert np.diff([*one.begin_s, bundle_now(known + 19)]).min() >= SEGMENT_MIN_S


def test_least_squares_end_as_low_as_the_search() -> None:
    lowest = []
    for improve in ("optimise", "settle"):
        bundle, known = begun()
        for count in range(known + 1, known + 20):
            bundle.branch(count)
            bundle.thin(count)
        getattr(bundle, improve)(known + 19)
        lowest.append(bundle.misfits(known + 19).min())
    # Both find minima of one functional, not always the same.
    assert lowest[1] < lowest[0] + 3.0


def test_a_broken_limit_costs_in_proportion() -> None:
    track = np.zeros(layout.TRACK_COUNT)
    track[layout.COUNT], track[layout.SPEED] = 2.0, 150.0
    second = layout.SEGMENTS + layout.SEGMENT_COUNT
    track[second + layout.BEGIN] = 30.0
    plots = np.zeros((2, layout.PLOT_COUNT))
    plots[:, layout.TIME] = 1.0, 60.0
    allowed = judged(track, 0.0, plots, 0, 0, 60.0, LIMITS)
    assert allowed == 0.0
    for column, value, over in (
        (second + layout.LATERAL, -4.5, 0.5),
        (second + layout.LONGITUDINAL, 3.0, 1.0),
        (second + layout.BEGIN, 8.0, 2.0),
        (second + layout.BEGIN, 56.0, 6.0),
    ):
        moved = track.copy()
        moved[column] = value
        found = judged(moved, 0.0, plots, 0, 0, 60.0, LIMITS)
        assert found == pytest.approx(PENALTY * (1.0 + over))
        assert found == plain(judged)(moved, 0.0, plots, 0, 0, 60.0, LIMITS)


def test_a_longer_last_segment_is_kept() -> None:
    bundle, known = begun()
    for count in range(known + 1, known + 20):
        bundle.branch(count)
        bundle.thin(count)
    bundle.optimise(known + 19, SearchRules(last_segment_s=20.0))
    misfits = bundle.misfits(known + 19)
    best = bundle.controls()[int(np.argmin(misfits))]
    assert bundle_now(known + 19) - best.begin_s[-1] >= 20.0


def test_the_search_does_what_its_plain_form_does() -> None:
    bundle, known = begun()
    bundle.branch(known + 8)
    track = bundle._tracks[-1].copy()
    rows = bundle._rows[: known + 8]
    ends = []
    for function in (search, plain(search)):
        moved, evaluations = track.copy(), np.zeros(1)
        value = function(
            moved, track.copy(), track.copy(), 0.0, rows, 0, len(rows), LIMITS, evaluations
        )
        ends.append((value, evaluations[0]))
    assert ends[0] == pytest.approx(ends[1], rel=1e-9)


def test_without_a_triple_there_is_no_bundle() -> None:
    plots = plots_of(flight(TURN), 10.0, np.random.default_rng(1))
    with pytest.raises(RestorationError, match="was 7 plots without one"):
        PrintedBundle(plots, SETTINGS).start(len(plots))
