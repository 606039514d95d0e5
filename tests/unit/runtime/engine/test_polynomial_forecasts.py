"""Polynomial forecasts of the service."""

import numpy as np
import pytest

from multiradar.errors import TrajectoryError
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.publication import Publication
from multiradar.runtime.live.view import LiveView
from multiradar.runtime.queries.parameters import FILTER, POLYNOMIAL
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.forecast.regions import gaussian_factor
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from multiradar_schemas.products.forecast import ForecastPoint
from support.scenarios.asked import forecast
from support.scenarios.live_scene import START_S
from support.scenarios.trajectory_scene import (
    MUTE,
    PLANE,
    REPORTING,
    TABLE,
    TURNING,
    flown,
    recording,
)

TRACKING = TrackingSettings(reorder_horizon_s=0.0)


def view_after(seconds: float) -> LiveView:
    publication, engine = Publication(TABLE, TRACKING, RuntimeLimits()), Engine(TABLE, TRACKING)
    publication.attach(lambda: (engine.tracks(), engine.plane), dict)
    for output in (engine.push(measurement_batch(recording(seconds), TABLE)[0]), engine.flush()):
        publication.publish(output, START_S + seconds)
    return publication.view


@pytest.fixture(scope="module")
def view() -> LiveView:
    return view_after(50.0)


@pytest.mark.parametrize("number", [TURNING, REPORTING])
def test_a_straight_flight_is_extrapolated_on_the_earth(view: LiveView, number: int) -> None:
    points = forecast(view, number, 10.0, 5.0, 0.9, POLYNOMIAL)
    assert points is not None
    assert len(points) == 3
    for point in points:
        made = ForecastPoint.model_validate(point)
        assert made.motion == POLYNOMIAL
        assert not made.calibrated
        assert made.region_factor == gaussian_factor(0.9)
        place = np.radians([point["latitude_deg"], point["longitude_deg"]])
        east, north = PLANE.to_plane(*place)
        truth = flown(number, np.array([point["time_s"] - START_S]))
        off = np.hypot(east - truth[0][0], north - truth[1][0])
        # Three sigmas of the position, which has two components.
        assert off < 3.0 * made.position_sigma_m
        assert made.position_sigma_m < 1000.0


def test_it_starts_at_the_present_data_time_as_other_methods(view: LiveView) -> None:
    times = [
        [point["time_s"] for point in forecast(view, TURNING, 10.0, 5.0, 0.9, by) or []]
        for by in (POLYNOMIAL, FILTER)
    ]
    assert times[0] == times[1]


def test_a_forecast_ends_where_the_parabola_of_a_turn_leaves_the_plane() -> None:
    """It continues with 4 m/s², beyond the bounds of the frame of its plots within the hour."""
    view = view_after(90.0)
    points = forecast(view, TURNING, 3600.0, 20.0, 0.9, POLYNOMIAL)
    assert points is not None
    assert 60 < len(points) < 150
    for point in points:
        ForecastPoint.model_validate(point)
    far = forecast(view, TURNING, 3600.0, 3600.0, 0.9, POLYNOMIAL)
    assert far is not None
    assert len(far) == 1


def test_a_track_without_heights_or_with_few_plots_has_no_forecast(view: LiveView) -> None:
    for asked, number in ((view, MUTE), (view_after(8.0), TURNING)):
        with pytest.raises(TrajectoryError) as error:
            forecast(asked, number, 10.0, 5.0, 0.9, POLYNOMIAL)
        assert error.value.code == "TOO_FEW_PLOTS"
    assert forecast(view, 10_000, 10.0, 5.0, 0.9, POLYNOMIAL) is None
