"""The area of a recorded run, also across the antimeridian."""

import polars as pl
import pytest

from multiradar.runtime.recorded.run import extent_of


@pytest.mark.parametrize(
    ("longitudes_deg", "west", "east"),
    [
        ([8.0, 6.5, 9.0], 6.5, 9.0),
        ([-75.0, -70.0], -75.0, -70.0),
        ([-3.0, 4.0], -3.0, 4.0),
        ([170.0, -178.0, 179.5], 170.0, 182.0),
        ([180.0, -180.0], 180.0, 180.0),
    ],
)
def test_the_narrower_extent_is_that_of_the_tracks(
    longitudes_deg: list[float], west: float, east: float
) -> None:
    latitudes_deg = [46.0 + number for number in range(len(longitudes_deg))]
    rows = pl.LazyFrame({"latitude_deg": latitudes_deg, "longitude_deg": longitudes_deg})
    found = extent_of(rows)
    assert found == pytest.approx((west, 46.0, east, latitudes_deg[-1]))


def test_without_tracks_there_is_none() -> None:
    schema = {"latitude_deg": pl.Float64, "longitude_deg": pl.Float64}
    assert extent_of(pl.LazyFrame(schema=schema)) is None
