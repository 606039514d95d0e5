"""The manoeuvre-plane study: the paper's example, rejections, helices."""

from itertools import pairwise

import numpy as np
import pytest

from multiradar.research.studies.manoeuvre_plane import study as manoeuvre_plane
from multiradar.research.studies.manoeuvre_plane.runs import (
    CENTRE_M,
    HELIX_RADII_M,
    NORMAL,
    RADII_M,
    SOURCES,
    TIMES_S,
    VARIANCE_M2,
    Case,
    noise_of,
    normal_error_rad,
    path,
    planes,
)
from multiradar.research.studies.result import StudyOptions, StudyResult

pytestmark = pytest.mark.slow

RUNS = 20


@pytest.fixture(scope="module")
def result() -> StudyResult:
    return manoeuvre_plane.run(StudyOptions(runs=RUNS, seed=2), lambda _done, _total: None)


def _values(result: StudyResult, **wanted: object) -> list[float]:
    return [
        float(row["value"] or 0.0)
        for row in result.rows
        if all(row[name] == value for name, value in wanted.items())
    ]


def test_the_example_is_as_published() -> None:
    """500 m/s on a circle in OXZ, its centre at 5 km and 45°; 625 m², 100 Hz from 2 to 10 s."""
    for radius in RADII_M:
        flown = path(Case(SOURCES[0], radius, 0.0))
        assert flown.shape == (1000, 3)
        assert np.linalg.norm(flown - CENTRE_M, axis=1) == pytest.approx(radius)
        # A chord of 5 m is shorter than its arc by (5 m)³ / 24 R²: 5 µm.
        steps = np.linalg.norm(np.diff(flown, axis=0), axis=1) * 100.0
        assert steps == pytest.approx(500.0, rel=2e-6)
        assert flown @ NORMAL == pytest.approx(0.0, abs=1e-9)
    assert (np.linalg.norm(CENTRE_M), CENTRE_M[0]) == pytest.approx((5000.0, CENTRE_M[2]))
    assert noise_of(SOURCES[0], 1).roots[0] == pytest.approx(np.sqrt(VARIANCE_M2) * np.eye(3))
    assert (VARIANCE_M2, TIMES_S[0], TIMES_S[-1]) == (625.0, 2.0, 10.0)


def test_a_hundred_runs_of_the_example_find_the_normal_to_two_milliradians() -> None:
    for seed, radius in enumerate(RADII_M):
        found = planes(Case(SOURCES[0], radius, 0.0), (10.0,), 100, np.random.default_rng(seed))
        errors = [normal_error_rad(plane) for (plane,) in found if plane is not None]
        assert len(errors) == 100
        assert np.mean(errors) <= 2e-3


def test_errors_fall_with_the_time_observed(result: StudyResult) -> None:
    """Figures 3 and 4; the published values of one run are typical here."""
    for name in ("normal_error_mrad", "distance_error_m"):
        values = _values(result, part="example", radius_m=RADII_M[0], quantity=name)
        assert all(late < early for early, late in pairwise(values[::2]))
        assert values[-1] < 0.1 * values[0]
        (share,) = _values(
            result, radius_m=RADII_M[0], quantity=f"{name}_as_printed_share", time_s=10.0
        )
        assert share > 0.05


def test_figures_of_the_paper_are_drawn(result: StudyResult) -> None:
    named = {plot.name: plot for plot in result.plots}
    assert list(named) == ["normal", "distance", "criterion", "path"]
    for name, value in (("normal", 1.4), ("distance", 2.0)):
        published = next(one for one in named[name].series if one.label.startswith("published"))
        assert (published.x.tolist(), published.y.tolist()) == ([10.0], [value])
    mean, threshold, exact = named["criterion"].series
    assert (mean.y < threshold.y).all()
    # The published threshold rejects more than 0.3 %.
    assert (threshold.y < exact.y).all()


def test_the_errors_of_the_normal_are_those_of_the_paper(result: StudyResult) -> None:
    """The paper's figure ends at 1.4 mrad; the mean must be at most 2."""
    for radius in RADII_M:
        (error,) = _values(
            result, part="example", radius_m=radius, time_s=10.0, quantity="normal_error_mrad"
        )
        assert 0.7 < error <= 2.0
    published = [row["printed"] for row in result.rows if row["printed"] is not None]
    assert published == [1.4, 2.0] * len(RADII_M)


def test_the_criterion_stays_below_its_threshold_as_in_figure_2(result: StudyResult) -> None:
    series = [
        _values(result, part="example", radius_m=RADII_M[0], quantity=name)
        for name in ("printed_statistic", "printed_threshold")
    ]
    assert len(series[0]) == len(TIMES_S)
    assert all(below < above for below, above in zip(*series, strict=True))


def test_rejections_lie_in_their_band(result: StudyResult) -> None:
    rows = [row for row in result.rows if row["quantity"] == "refused_share"]
    rejections = [row for row in rows if row["part"] == "rejection"]
    assert [row["source"] for row in rejections] == list(SOURCES)
    for row in rejections:
        low, share, high = (float(row[name] or 0.0) for name in ("band_low", "value", "band_high"))
        assert row["expected"] == 0.003
        assert low <= share <= high < 0.02


def test_the_table_of_rejections_is_in_per_cent() -> None:
    known: manoeuvre_plane.Row = {"part": "rejection", "source": "radar", "runs": 1000}
    shares: list[manoeuvre_plane.Row] = [
        {"quantity": "refused_share", "value": 0.004, "band_low": 0.001, "band_high": 0.00625},
        {"quantity": "refused_by_printed_share", "value": 0.25},
    ]
    table = manoeuvre_plane._rejection_table([known | share for share in shares])
    assert table.rows == (("radar", 1000, 0.4, "0.10 … 0.62", 25.0),)


def test_a_helix_is_rejected_and_a_circle_is_not(result: StudyResult) -> None:
    for radius in HELIX_RADII_M:
        shares = _values(result, part="helix", radius_m=radius)
        assert shares[0] <= 0.05
        assert shares[-1] == 1.0
    # After four fifths of a turn a climb of 20 m/s is detected, after half a turn it is not.
    (half, more) = _values(result, part="helix", climb_mps=20.0)
    assert more > half


def test_every_row_has_the_same_columns(result: StudyResult) -> None:
    assert {tuple(row) for row in result.rows} == {tuple(result.rows[0])}
    assert result.json_object()["options"] == {"runs": RUNS}
