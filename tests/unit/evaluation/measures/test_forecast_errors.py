"""Forecasts are compared with the aircraft of their track, in true metres, by horizon."""

import numpy as np
import polars as pl
import pytest

from multiradar.errors import InputError, MissingColumnError
from multiradar.evaluation.measures.forecast_errors import ForecastErrors, forecast_errors
from multiradar.evaluation.trajectories import Reference
from support.scenarios.skies import reference_of, straight, tracks_of

TIMES = [float(t) for t in range(0, 121, 4)]
NORTH = straight(TIMES, 0.0, 0.0, 0.0, 200.0)
EAST = straight(TIMES, 30e3, 0.0, 200.0, 0.0)


def _rows(reference: Reference, off_m: tuple[float, float], **changes: object) -> pl.DataFrame:
    """A forecast of track 1 made at 20 s for 50 s, with an error east and north in metres."""
    latitude, longitude = reference.plane.to_geodetic(off_m[0], 50.0 * 200.0 + off_m[1])
    return pl.DataFrame(
        {
            "track_id": [1],
            "made_s": [20.0],
            "horizon_s": [30.0],
            "time_s": [50.0],
            "by": ["filter"],
            "probability": [0.95],
            "latitude_deg": np.degrees([float(latitude)]),
            "longitude_deg": np.degrees([float(longitude)]),
            "covariance_east_m2": [100.0**2],
            "covariance_east_north_m2": [0.0],
            "covariance_north_m2": [50.0**2],
            "region_major_m": [200.0],
            "region_minor_m": [100.0],
            "region_azimuth_deg": [90.0],
        }
    ).with_columns(**{name: pl.lit(value) for name, value in changes.items()})


def _errors(frame: pl.DataFrame, reference: Reference) -> ForecastErrors:
    tracks = tracks_of({1: NORTH, 2: EAST})
    aircraft_index = np.where(tracks.track == 0, 0, 1)
    return forecast_errors(frame, "forecasts.parquet", tracks, reference, aircraft_index)


@pytest.mark.parametrize(
    ("off_m", "inside", "normalised"),
    [
        ((150.0, 0.0), True, 0.5 * 1.5**2),
        ((0.0, 150.0), False, 0.5 * 3.0**2),
        ((-190.0, 10.0), True, 0.5 * (1.9**2 + 0.2**2)),
        ((150.0, 80.0), False, 0.5 * (1.5**2 + 1.6**2)),
    ],
)
def test_the_region_is_an_ellipse_along_its_azimuth(
    off_m: tuple[float, float],
    inside: bool,
    normalised: float,
) -> None:
    reference = reference_of({"a": NORTH, "b": EAST})
    found = _errors(_rows(reference, off_m), reference)
    assert found.inside.tolist() == [inside]
    # The plane is true to scale below the flight, some kilometres from its centre: parts in 1e5.
    assert found.error_m[0] == pytest.approx(np.hypot(*off_m), rel=1e-3)
    assert found.normalised[0] == pytest.approx(normalised, rel=2e-3)
    assert found.radius_m[0] == pytest.approx(np.sqrt(200.0 * 100.0))


def test_an_oblique_ellipse_lies_clockwise_from_north() -> None:
    reference = reference_of({"a": NORTH, "b": EAST})
    for azimuth_deg, inside in ((45.0, True), (135.0, False)):
        frame = _rows(reference, (120.0, 120.0), region_azimuth_deg=azimuth_deg)
        assert _errors(frame, reference).inside.tolist() == [inside]


def test_forecasts_with_unknown_truth_are_skipped() -> None:
    reference = reference_of({"a": NORTH, "b": EAST})
    for changes in ({"time_s": 500.0}, {"track_id": 7}, {"made_s": 21.0}, {"made_s": -90.0}):
        frame = _rows(reference, (0.0, 0.0), **changes)
        assert len(_errors(frame, reference).inside) == 0
    other = _errors(_rows(reference, (0.0, 0.0), track_id=2), reference)
    # Track 2 follows the other aircraft, which is elsewhere.
    assert other.error_m[0] > 30e3


def test_invalid_forecasts_are_rejected() -> None:
    reference = reference_of({"a": NORTH, "b": EAST})
    good = _rows(reference, (0.0, 0.0))
    with pytest.raises(MissingColumnError):
        _errors(good.drop("region_major_m"), reference)
    with pytest.raises(MissingColumnError):
        _errors(good.drop("by"), reference)
    for name, value in (("time_s", np.nan), ("latitude_deg", "north"), ("made_s", None)):
        with pytest.raises(InputError, match=f"{name}: expected a number in every row"):
            _errors(good.with_columns(pl.lit(value).alias(name)), reference)
    for changes in ({"region_minor_m": 0.0}, {"covariance_east_m2": 0.0}):
        with pytest.raises(InputError, match="positive definite"):
            _errors(good.with_columns(**{k: pl.lit(v) for k, v in changes.items()}), reference)
