"""One plot as a row: the same numbers as of many, and the same errors of the arguments."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import CovarianceError, ShapeError
from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks.plot_rows import plot_row, plot_rows
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.control_tracks.shared_errors import require_part
from multiradar.restoration.control_tracks.tracks import measurement_track

SETTINGS = BundleSettings()
Floats = NDArray[np.float64]
Numbers = tuple[float, ...]


def in_full(time_s: float, position: Floats, covariance: Floats, shared: Floats) -> Numbers:
    """The row as of `plot_rows`, all arguments checked; empty if one is not valid."""
    try:
        plots = measurement_track([time_s], position[None], covariance[None], [0])
        part = require_part(shared, covariance)
    except (CovarianceError, ShapeError):
        return ()
    row = plot_rows(plots, SETTINGS)[0]
    row[layout.SHARED :] = part[0, 0], part[0, 1], part[1, 1]
    return tuple(map(float, row))


def at_once(time_s: float, position: Floats, covariance: Floats, shared: Floats) -> Numbers:
    try:
        return tuple(map(float, plot_row(time_s, position, covariance, shared, SETTINGS)))
    except (CovarianceError, ShapeError):
        return ()


def matrix(sigmas: Floats, correlation: float) -> Floats:
    return np.array(np.outer(sigmas, sigmas) * [[1.0, correlation], [correlation, 1.0]])


def test_the_row_of_one_plot_equals_that_of_many() -> None:
    """Sigmas of 1 cm to 100 km; correlations and shared parts near the limits, and beyond."""
    random = np.random.default_rng(1)
    correlations = [0.0, 0.5, -0.99, 0.99949, 0.9999, 1.0 - 1e-13, 1.0, -1.0, 1.1, np.nan]
    parts = [0.0, 0.3, 1.0 - 1e-12, 1.0, 1.0 + 1e-10, 1.0 + 1e-8, -1e-12, -1e-7]
    rows = []
    for correlation in correlations:
        for part in parts:
            covariance = matrix(10.0 ** random.uniform(-2.0, 5.0, 2), correlation)
            along = random.normal(size=2)
            inside = np.linalg.norm(along) ** 2
            # A part in one direction, as of an azimuth.
            shared = part * min(np.diag(covariance)) * np.outer(along, along) / inside
            for common in (shared, part * covariance):
                plot = random.uniform(0.0, 86400.0), random.normal(size=2), covariance, common
                rows.append(at_once(*plot))
                assert rows[-1] == in_full(*plot)
    valid = [bool(row) for row in rows]
    assert 20 < sum(valid) < len(valid) - 20


def test_arguments_of_other_types_are_checked_and_converted() -> None:
    row = plot_row(1, [2, 3], [[4, 1], [1, 4]], None, SETTINGS)
    full = (np.array([2.0, 3.0]), np.array([[4.0, 1.0], [1.0, 4.0]]), np.zeros((2, 2)))
    assert tuple(row.tolist()) == in_full(1.0, *full)
    wrong: list[tuple[object, ...]] = [
        ([2.0], [[4.0, 1.0], [1.0, 4.0]], None), ([2.0, 3.0], [[4.0, 1.0], [1.2, 4.0]], None),
        ([2.0, np.inf], [[4.0, 1.0], [1.0, 4.0]], None), ([2.0, 3.0], [4.0, 4.0], None),
        ([2.0, 3.0], [[4.0, 1.0], [1.0, 4.0]], [[1.0, 0.0]]),
        ([2.0, 3.0], [[4.0, 1.0], [1.0, 4.0]], [[5.0, 0.0], [0.0, 1.0]]),
    ]  # fmt: skip
    for position, covariance, shared in wrong:
        with pytest.raises((ShapeError, CovarianceError)):
            plot_row(1.0, position, covariance, shared, SETTINGS)  # type: ignore[arg-type]
