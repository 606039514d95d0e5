"""Positions of plots: corrected for biases, with the uncertainty of biases and heights."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION, KIND_RADAR
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.runtime.trajectories.plots import (
    PLOT_DTYPE,
    LocatedPlot,
    NotLocated,
    PlotLocator,
    Published,
    prior_biases,
)
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import sensor_table
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile
from support.scenarios import live_scene

TABLE = live_scene.sensors()
RADAR, ADSB = TABLE.ids.index("41-10"), TABLE.ids.index("adsb")
TRACKING = TrackingSettings()
PLACES = PlotLocator(TABLE, TRACKING)
PLACE = np.radians([50.4, 14.9])
HEIGHT_M = 9144.0
NONE = np.zeros((len(TABLE), len(PARAMETER_NAMES)))
NOTHING = Published(NONE, NONE)
#: Of range (m), azimuth (rad), gain, clock (s), eccentricity (rad) and site (m); all at once.
BIASES = np.array([300.0, 0.004, 2e-4, 0.5, 0.002, -0.001, 40.0, -30.0, 0.0])
SIGMAS = np.array([40.0, 0.0007, 1e-4, 0.2, 0.0004, 0.0003, 60.0, 20.0, 0.0])
STEPS = (1.0, 1e-5, 1e-6, 1e-3, 1e-5, 1e-5, 1.0, 1.0)


def plot(**values: Any) -> np.void:
    row = np.zeros(1, PLOT_DTYPE)
    known = {
        "sensor": RADAR, "kind": KIND_RADAR, "height_m": HEIGHT_M, "track_height_m": np.nan,
        "track_height_sigma_m": np.nan, "latitude_rad": np.nan, "longitude_rad": np.nan,
        "position_sigma_m": np.nan,
    }  # fmt: skip
    for name, value in (known | values).items():
        row[name] = value
    found: np.void = row[0]
    return found


def seen(**values: Any) -> np.void:
    """A plot of the radar, without errors, of an aircraft at `PLACE`."""
    site = (
        float(TABLE.latitude_rad[RADAR]), float(TABLE.longitude_rad[RADAR]),
        float(TABLE.height_m[RADAR]),
    )  # fmt: skip
    height = values.pop("true_height_m", HEIGHT_M)
    slant, azimuth, _ = slant_range_azimuth(
        site, np.array([PLACE[0]]), np.array([PLACE[1]]), np.array([height])
    )
    return plot(**{"range_m": slant[0], "azimuth_rad": azimuth[0]} | values)


def placed(row: np.void, published: Published = NOTHING) -> LocatedPlot:
    found = PLACES.locate(row, published)
    assert isinstance(found, LocatedPlot)
    return found


def truth() -> NDArray[np.float64]:
    return np.array(PLACES.plane.to_plane(*PLACE), np.float64)


def published(estimate: NDArray[np.float64], sigma: NDArray[np.float64]) -> Published:
    known = Published(NOTHING.estimate.copy(), NOTHING.sigma.copy())
    known.estimate[RADAR], known.sigma[RADAR] = estimate, sigma
    return known


def test_a_plot_without_errors_is_located_at_the_aircraft() -> None:
    assert placed(seen()).position_m == pytest.approx(truth(), abs=0.01)


def test_plots_are_corrected_for_published_biases() -> None:
    clean = seen(track_speed_mps=200.0, track_heading_rad=0.3)
    off = clean.copy()
    off["range_m"] = clean["range_m"] * (1.0 + BIASES[2]) + BIASES[0]
    sine, cosine = np.sin(clean["azimuth_rad"]), np.cos(clean["azimuth_rad"])
    off["range_m"] += sine * BIASES[6] + cosine * BIASES[7]
    off["azimuth_rad"] += BIASES[1] + sine * BIASES[4] + cosine * BIASES[5]
    off["azimuth_rad"] += (cosine * BIASES[6] - sine * BIASES[7]) / clean["range_m"]
    # A clock that is fast by 0.5 s: at the time it says the aircraft is 100 m farther on.
    ahead = PLACES.plane.local_matrix(truth()[0], truth()[1], HEIGHT_M)
    moved = np.linalg.solve(ahead, 0.5 * 200.0 * np.array([np.sin(0.3), np.cos(0.3)]))
    found = placed(off, published(BIASES, SIGMAS)).position_m
    assert found == pytest.approx(truth() + moved, abs=0.2)
    assert np.hypot(*(placed(off).position_m - truth())) > 300.0


def test_the_covariance_includes_noise_biases_and_height() -> None:
    """Against differences: each error shifts the position, and their squares add up."""
    row = seen(track_speed_mps=200.0, track_heading_rad=0.3)
    errors: list[tuple[str, float, float]] = [
        ("range_m", TABLE.range_sigma_m[RADAR], 1.0),
        ("azimuth_rad", TABLE.azimuth_sigma_rad[RADAR], 1e-5),
        ("height_m", float(np.sqrt(PLACES.height(row)[1])), 1.0),
    ]
    expected, own = np.zeros((2, 2)), np.zeros((2, 2))
    for name, sigma, step in errors:
        up, down = row.copy(), row.copy()
        up[name], down[name] = row[name] + step, row[name] - step
        slope = (placed(up).position_m - placed(down).position_m) / (2.0 * step)
        expected += sigma**2 * np.outer(slope, slope)
    own += expected
    assert placed(row).covariance_m2 == pytest.approx(own, rel=1e-3)
    assert not placed(row).shared_m2.any()
    for place, step in enumerate(STEPS):
        moved = np.zeros_like(SIGMAS)
        moved[place] = step
        ends = [placed(row, published(way * moved, 0.0 * SIGMAS)).position_m for way in (1, -1)]
        slope = (ends[0] - ends[1]) / (2.0 * step)
        expected += SIGMAS[place] ** 2 * np.outer(slope, slope)
    found = placed(row, published(np.zeros_like(SIGMAS), SIGMAS))
    # The derivative by the gain is that of the range times the range; it bends by 1e-3 over it.
    # Plots are corrected for a shift of the site as if it acted along the slant range.
    assert found.covariance_m2 == pytest.approx(expected, rel=6e-3)
    assert found.shared_m2 == pytest.approx(expected - own, rel=1e-2, abs=30.0)


def test_a_plot_without_height_is_laid_at_that_of_its_track() -> None:
    known = seen(height_m=np.nan, track_height_m=HEIGHT_M, track_height_sigma_m=150.0)
    assert placed(known).position_m == pytest.approx(truth(), abs=0.01)
    unknown = seen(height_m=np.nan)
    assert PLACES.height(unknown) == (
        TRACKING.assumed_height_m, 0.0, TRACKING.assumed_height_sigma_m**2,
    )  # fmt: skip
    # All its plots are laid at one height: they err alike.
    assert np.trace(placed(known).shared_m2) > 0.0
    sigmas = [np.sqrt(np.trace(placed(row).covariance_m2)) for row in (seen(), known, unknown)]
    assert sigmas == sorted(sigmas)
    # What the assumed height is wrong by is within what it says of itself.
    off = placed(unknown).position_m - truth()
    assert off @ np.linalg.solve(placed(unknown).covariance_m2, off) < 9.0


def test_a_reported_position_is_located_in_true_metres() -> None:
    row = plot(sensor=ADSB, kind=KIND_POSITION, latitude_rad=PLACE[0], longitude_rad=PLACE[1])
    found = placed(row)
    assert found.position_m == pytest.approx(truth(), abs=1e-6)
    true = PLACES.plane.local_matrix(*truth())
    variance = float(TABLE.position_sigma_m[ADSB] ** 2)
    assert true @ found.covariance_m2 @ true.T == pytest.approx(variance * np.eye(2), abs=1e-6)
    row["position_sigma_m"] = 7.0
    of_its_own = true @ placed(row).covariance_m2 @ true.T
    assert of_its_own == pytest.approx(49.0 * np.eye(2), abs=1e-6)


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        (plot(kind=KIND_BEARING, azimuth_rad=1.0, range_m=np.nan), NotLocated.BEARING),
        (plot(range_m=9200.0, azimuth_rad=1.0), NotLocated.CONE_OF_SILENCE),
        # Nearer than the aircraft is high.
        (plot(range_m=5000.0, azimuth_rad=1.0), NotLocated.NO_PLACE),
        (plot(range_m=np.nan, azimuth_rad=1.0), NotLocated.NO_PLACE),
        # Beyond the edge of the plane.
        (plot(sensor=ADSB, kind=KIND_POSITION, latitude_rad=-1.2, longitude_rad=2.0),
         NotLocated.NO_PLACE),
        (plot(sensor=ADSB, kind=KIND_POSITION), NotLocated.NO_PLACE),
    ],
)  # fmt: skip
def test_a_plot_without_position_has_a_reason(row: np.void, reason: NotLocated) -> None:
    assert PLACES.locate(row, NOTHING) is reason


def test_the_cone_is_that_of_the_tracker() -> None:
    steep = plot(range_m=12_000.0, azimuth_rad=1.0)
    assert PLACES.locate(steep, NOTHING) is NotLocated.CONE_OF_SILENCE
    wide = PlotLocator(TABLE, replace(TRACKING, cone_ratio=0.5))
    assert isinstance(wide.locate(steep, NOTHING), LocatedPlot)


def test_plots_are_corrected_for_the_prior_before_the_first_epoch() -> None:
    means = np.zeros_like(TABLE.prior_mean)
    means[0] = 120.0
    sensor, kind = int(TABLE.parameter_sensor[0]), int(TABLE.parameter_kind[0])
    known = prior_biases(replace(TABLE, prior_mean=means))
    assert known.estimate[sensor, kind] == 120.0


def test_a_queued_report_is_located_after_a_sensor_was_added() -> None:
    """It failed with the biases of the sensors before, and its bundle was reinitialised."""
    report = plot(
        sensor=ADSB, kind=KIND_POSITION, latitude_rad=PLACE[0], longitude_rad=PLACE[1],
        position_sigma_m=20.0,
    )  # fmt: skip
    file = live_scene.sensors_file()
    added = Sensor(id="mlat", kind="mlat")
    grown = PlotLocator(TABLE, TRACKING)
    grown.use(sensor_table(SensorsFile(sensor=(*file.sensor, added)), in_order=True))
    found, expected = grown.locate(report, NOTHING), placed(report)
    assert isinstance(found, LocatedPlot)
    for one, other in zip(found, expected, strict=True):
        assert np.array_equal(one, other)
