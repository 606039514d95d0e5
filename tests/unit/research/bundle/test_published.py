"""The report's own procedures: arcs, groups, the Hooke–Jeeves search."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import RestorationError
from multiradar.research.bundle import _hooke_jeeves_kernels as hooke_jeeves
from multiradar.research.bundle._hooke_jeeves_kernels import PENALTY, penalised_misfit, search
from multiradar.research.bundle.published import PublishedBundle
from multiradar.research.bundle.search_rules import SEGMENT_MIN_S, SearchRules
from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks._arc_kernels import curvature
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.control_tracks.tracks import whole_seconds
from support.kernels import plain
from support.references.mean_distance import mean_distance
from support.scenarios.flown import flight, plots_of

Floats = NDArray[np.float64]

TURN = ((0.0, 0.0), (40.0, -2.0))
SETTINGS = BundleSettings(apart_m=20.0)
LIMITS = np.array([4.0, 2.0, SEGMENT_MIN_S, SEGMENT_MIN_S])


def started(seed: int = 1, *, sigma_m: float = 50.0) -> tuple[PublishedBundle, int]:
    plots = plots_of(flight(TURN), 70.0, np.random.default_rng(seed), sigma_m=sigma_m)
    known = int(np.searchsorted(plots.time_s, 30.0))
    bundle = PublishedBundle(plots, SETTINGS)
    bundle.start(known)
    bundle.thin(known)
    return bundle, known


def test_an_arc_goes_through_three_points() -> None:
    # Points of circles of 5 km radius, to the right of north and to the left.
    angle = np.array([0.0, 0.3, 0.8])
    for side in (1.0, -1.0):
        east, north = side * 5e3 * (1.0 - np.cos(angle)), 5e3 * np.sin(angle)
        found = curvature(
            np.array([east[0], north[0]]), np.array([east[1], north[1]]), east[2], north[2]
        )
        assert found == pytest.approx(side / 5e3, rel=1e-9)


def test_branches_reach_the_new_plot() -> None:
    bundle, known = started(sigma_m=20.0)
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
    # Twelve plots of a turn outside all tracks: the best arc fits better than any track.
    assert new.min() < old.min() - 5.0


def bundle_now(count: int) -> float:
    return 1.5 * (count - 1)


def test_groups_keep_their_best_and_are_apart() -> None:
    bundle, known = started()
    plots = plots_of(flight(TURN), 70.0, np.random.default_rng(1))
    whole = PublishedBundle(plots, SETTINGS)
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
    bundle, known = started()
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
    for improve in ("optimise", "fit_least_squares"):
        bundle, known = started()
        for count in range(known + 1, known + 20):
            bundle.branch(count)
            bundle.thin(count)
        getattr(bundle, improve)(known + 19)
        lowest.append(bundle.misfits(known + 19).min())
    # Both find minima of the same functional, not always the same one.
    assert lowest[1] < lowest[0] + 3.0


def test_a_violated_limit_costs_in_proportion() -> None:
    track = np.zeros(layout.TRACK_COUNT)
    track[layout.COUNT], track[layout.SPEED] = 2.0, 150.0
    second = layout.SEGMENTS + layout.SEGMENT_COUNT
    track[second + layout.BEGIN] = 30.0
    plots = np.zeros((2, layout.PLOT_COUNT))
    plots[:, layout.TIME] = 1.0, 60.0
    allowed = penalised_misfit(track, 0.0, plots, 0, 0, 60.0, LIMITS)
    assert allowed == 0.0
    for column, value, over in (
        (second + layout.LATERAL, -4.5, 0.5),
        (second + layout.LONGITUDINAL, 3.0, 1.0),
        (second + layout.BEGIN, 8.0, 2.0),
        (second + layout.BEGIN, 56.0, 6.0),
    ):
        moved = track.copy()
        moved[column] = value
        found = penalised_misfit(moved, 0.0, plots, 0, 0, 60.0, LIMITS)
        assert found == pytest.approx(PENALTY * (1.0 + over))
        assert found == plain(penalised_misfit)(moved, 0.0, plots, 0, 0, 60.0, LIMITS)


def test_steps_and_limits_are_as_published() -> None:
    """Section 2.5: Du1, DuFin; Dw1, DwFin; Dt1, DtFin; dh; MAXu, MAXw, dtmin."""
    steps = (
        hooke_jeeves.LATERAL_STEP, hooke_jeeves.LATERAL_LAST, hooke_jeeves.LONGITUDINAL_STEP,
        hooke_jeeves.LONGITUDINAL_LAST, hooke_jeeves.BEGIN_STEP_S, hooke_jeeves.BEGIN_LAST_S,
        hooke_jeeves.SHRINK,
    )  # fmt: skip
    assert steps == (0.5, 0.01, 0.25, 0.01, 32.0, 0.02, 0.5)
    settings = BundleSettings()
    limits = settings.lateral_max_mps2, settings.longitudinal_max_mps2, SEGMENT_MIN_S
    assert limits == (4.0, 2.0, 10.0)


def searched(track: Floats, plots: Floats) -> tuple[float, Floats]:
    moved = track.copy()
    value = search(
        moved, track.copy(), track.copy(), 0.0, plots, 0, len(plots), LIMITS, np.zeros(1)
    )
    return float(value), moved


def test_no_last_step_improves_the_search() -> None:
    """It ends where the published last steps 0.01 m/s², 0.01 m/s², 0.02 s do not improve it."""
    bundle, known = started()
    bundle.branch(known + 8)
    rows = bundle._rows[: known + 8]
    value, found = searched(bundle._tracks[-1], rows)
    assert found[layout.COUNT] == 2.0
    second = layout.SEGMENTS + layout.SEGMENT_COUNT
    for column, step in (
        (layout.SEGMENTS + layout.LATERAL, 0.01), (layout.SEGMENTS + layout.LONGITUDINAL, 0.01),
        (second + layout.LATERAL, 0.01), (second + layout.LONGITUDINAL, 0.01),
        (second + layout.BEGIN, 0.02),
    ):  # fmt: skip
        for direction in (step, -step):
            moved = found.copy()
            moved[column] += direction
            assert penalised_misfit(moved, 0.0, rows, 0, len(rows), rows[-1, 0], LIMITS) >= value


@pytest.mark.parametrize(
    ("part", "value"), [(layout.LATERAL, -6.3), (layout.LONGITUDINAL, 3.1), (layout.BEGIN, 4.0)]
)
def test_a_track_beyond_the_limits_returns_to_them(part: int, value: float) -> None:
    """Section 2.5: the penalty, in proportion to the violation, leads back."""
    bundle, known = started()
    bundle.branch(known + 8)
    track, rows = bundle._tracks[-1].copy(), bundle._rows[: known + 8]
    second = layout.SEGMENTS + layout.SEGMENT_COUNT
    track[second + part] = value
    assert penalised_misfit(track, 0.0, rows, 0, len(rows), rows[-1, 0], LIMITS) > PENALTY
    found, moved = searched(track, rows)
    assert found < PENALTY
    assert abs(moved[second + layout.LATERAL]) <= 4.0
    assert abs(moved[second + layout.LONGITUDINAL]) <= 2.0
    assert 10.0 <= moved[second + layout.BEGIN] <= rows[-1, 0] - 10.0


def end_after_search(rules: SearchRules, aside_m: float) -> float:
    """Distance of the track ends north of the truth after the search, last plot displaced."""
    bundle, known = started()
    last = known + 19
    for count in range(known + 1, last):
        bundle.branch(count)
        bundle.thin(count)
    truth = flight(TURN).geometric([bundle._rows[last - 1, layout.TIME]]).position_m[0]
    bundle._rows[last - 1, layout.PLOT_EAST : layout.PLOT_NORTH + 1] = truth[0], truth[1] + aside_m
    bundle.optimise(last, rules)
    return float(np.median(bundle.ends(last)[:, 1] - truth[1]))


@pytest.mark.slow
def test_a_smaller_weight_of_the_last_plot_attracts_less() -> None:
    """Section 2.7.2: a last plot displaced by three sigmas."""
    light = end_after_search(SearchRules(last_plot=0.01), 150.0)
    assert end_after_search(SearchRules(), 150.0) > light + 20.0


@pytest.mark.slow
def test_a_plot_attracts_only_within_its_dimple() -> None:
    """Section 2.7.2: at five sigmas a plot attracts as little as at 3 km."""
    drawn, dimpled = (
        [end_after_search(rules, aside_m) for aside_m in (250.0, 3e3)]
        for rules in (SearchRules(), SearchRules(dimples=True))
    )
    assert drawn[0] > drawn[1] + 20.0
    assert dimpled[0] == pytest.approx(dimpled[1], abs=5.0)


def test_a_longer_last_segment_is_kept() -> None:
    bundle, known = started()
    for count in range(known + 1, known + 20):
        bundle.branch(count)
        bundle.thin(count)
    bundle.optimise(known + 19, SearchRules(last_segment_s=20.0))
    misfits = bundle.misfits(known + 19)
    best = bundle.controls()[int(np.argmin(misfits))]
    assert bundle_now(known + 19) - best.begin_s[-1] >= 20.0


def test_the_search_equals_its_plain_form() -> None:
    bundle, known = started()
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
    with pytest.raises(RestorationError, match="no three of the 7 plots can be joined by an arc"):
        PublishedBundle(plots, SETTINGS).start(len(plots))
