"""Tables from disk become arrays, or an error states what was expected and found."""

from collections.abc import Callable

import numpy as np
import polars as pl
import pytest

from multiradar.errors import InputError, MissingColumnError, MultiradarError
from multiradar.evaluation.measures.bias_errors import bias_histories
from multiradar.evaluation.tables import (
    reference_of_reports,
    reference_of_truth,
    tracks_of,
    with_names,
)
from multiradar.geodesy.system_plane import SystemPlane
from multiradar_schemas.products.bias import BIAS_SCHEMA
from multiradar_schemas.products.track import TRACK_SCHEMA

PLANE = SystemPlane(np.radians(47.0), np.radians(8.0))
TRUTH = pl.DataFrame(
    {
        "time_s": [4.0, 0.0, 0.0],
        "track_number": [7, 7, None],
        "latitude_deg": [47.01, 47.0, None],
        "longitude_deg": [8.0, 8.0, None],
        "height_m": [9000.0, 9000.0, None],
        "speed_mps": [278.0, 278.0, None],
        "heading_deg": [0.0, 0.0, None],
    },
    schema_overrides={"track_number": pl.Int64},
)
TRACKS = pl.DataFrame(
    {
        "time_s": [4.0, 0.0, 2.0],
        "track_id": [5, 5, 2],
        "latitude_deg": [47.01, 47.0, 47.0],
        "longitude_deg": [8.0, 8.0, 8.1],
        "height_m": [None, 9000.0, 9000.0],
        "speed_mps": [100.0, 100.0, 100.0],
        "heading_deg": [90.0, 90.0, 180.0],
        "position_sigma_m": [10.0, 20.0, 30.0],
        "velocity_sigma_mps": [1.0, 1.0, 1.0],
        "state": ["confirmed", "tentative", "coasting"],
        "sensor_id": ["a", "a", "b"],
    }
)
REPORTS = pl.DataFrame(
    {
        "time_s": [0.0, 10.0, 0.0, 0.0],
        "track_number": [7, 7, None, None],
        "mode_s_address": ["aa", None, "abcdef", None],
        "latitude_deg": [47.0, 47.0, 46.9, 46.0],
        "longitude_deg": [8.0, 8.01, 8.0, 8.0],
        "height_m": [9000.0, None, 1000.0, 0.0],
    }
)
BIASES = pl.DataFrame(
    {"time_s": [1.0, 2.0], "sensor_id": ["r", "r"], "parameter": ["range_gain"] * 2,
     "estimate": [0.5, 0.6], "sigma": [0.1, 0.1], "epoch": [1, 2], "prior_ratio": [0.1, 0.1]},
    schema=BIAS_SCHEMA,
)  # fmt: skip


def test_a_reported_rate_of_climb_is_used() -> None:
    assert np.isnan(tracks_of(TRACKS, "tracks", PLANE, tentative=True).climb_mps).all()
    picture = TRACKS.with_columns(vertical_rate_mps=pl.Series([1.0, None, 1e9]))
    found = tracks_of(picture, "tracks", PLANE, tentative=True)
    assert sorted(found.climb_mps[np.isfinite(found.climb_mps)].tolist()) == [1.0]


def test_truth_is_sorted_by_aircraft_and_time_without_clutter() -> None:
    found = reference_of_truth(TRUTH, "truth", 15.0)
    assert found.names.tolist() == ["7"]
    assert found.time_s.tolist() == [0.0, 4.0]
    assert found.velocity_mps is not None
    # At 9000 m; the distance on the ground below is a little less.
    assert found.velocity_mps[0] == pytest.approx([0.0, 278.0 / (1.0 + 9000.0 / 6.37e6)], rel=1e-4)
    assert np.diff(found.position_m[:, 1]) == pytest.approx([1111.8], abs=0.5)


def test_reports_are_named_by_track_number_or_else_by_address() -> None:
    found = reference_of_reports(REPORTS, "reports", 15.0)
    assert found.names.tolist() == ["7", "abcdef"]
    assert found.aircraft.tolist() == [0, 0, 1]
    assert found.velocity_mps is None
    assert np.isnan(found.height_m[1])


@pytest.mark.parametrize("dtype", [pl.Null, pl.Int64, pl.Float32])
def test_heights_may_be_absent_or_of_any_kind_of_number(dtype: type[pl.DataType]) -> None:
    height = pl.Series([None, None, 9000 if dtype.is_numeric() else None], dtype=dtype)
    found = tracks_of(TRACKS.with_columns(height_m=height), "tracks", PLANE, tentative=True)
    assert np.isfinite(found.height_m).sum() == dtype.is_numeric()


def test_tracks_are_sorted_by_track_and_time_and_tentative_rows_left_out() -> None:
    found = tracks_of(TRACKS, "tracks", PLANE, tentative=False)
    assert found.ids.tolist() == [2, 5]
    assert found.track.tolist() == [0, 1]
    assert found.measured.tolist() == [False, True]
    assert found.ground_mps == pytest.approx(np.array([[0.0, -100.0], [100.0, 0.0]]), abs=1e-9)
    whole = tracks_of(TRACKS, "tracks", PLANE, tentative=True)
    assert whole.time_s.tolist() == [2.0, 0.0, 4.0]


def _tracks(frame: pl.DataFrame) -> object:
    return tracks_of(frame, "tracks.parquet", PLANE, tentative=False)


def _truth(frame: pl.DataFrame) -> object:
    return reference_of_truth(frame, "truth.parquet", 15.0)


def _reports(frame: pl.DataFrame) -> object:
    return reference_of_reports(frame, "m.parquet", 15.0)


@pytest.mark.parametrize(
    ("read", "frame", "message"),
    [
        (_tracks, TRACKS.drop("speed_mps"), "missing column speed_mps; found: time_s"),
        (_tracks, TRACKS.clear(), "contains no tracks"),
        (_tracks, TRACKS.filter(state="tentative"), "contains no confirmed tracks"),
        (
            _tracks,
            TRACKS.with_columns(position_sigma_m=pl.Series([10.0, np.nan, 1.0])),
            "position_sigma_m: expected a number in row 1, was nan",
        ),
        (
            _tracks,
            TRACKS.with_columns(velocity_sigma_mps=pl.Series([10.0, -1.0, 1.0])),
            "velocity_sigma_mps: expected a sigma of at least 0 in row 1, was -1",
        ),
        (
            _tracks,
            TRACKS.with_columns(time_s=pl.lit("noon")),
            "time_s: expected numbers, was String",
        ),
        (
            _tracks,
            TRACKS.with_columns(pl.col("time_s").cast(pl.Float32)),
            "time_s: expected float64 or integers, was Float32",
        ),
        (
            _tracks,
            TRACKS.with_columns(height_m=pl.lit("high")),
            "height_m: expected numbers, was String",
        ),
        (
            _tracks,
            TRACKS.with_columns(track_id=pl.Series([1, None, 2])),
            "track_id: expected a whole number in every row",
        ),
        (
            _tracks,
            TRACKS.with_columns(latitude_deg=pl.Series([47.0, 47.0, 99.0])),
            "latitude_deg: expected a number in row 2, was 99",
        ),
        (_tracks, TRACKS.with_columns(longitude_deg=-170.0), "within 60 degrees"),
        (_truth, TRUTH.drop("heading_deg"), "missing column heading_deg; found: time_s"),
        (
            _truth,
            TRUTH.filter(pl.col("track_number").is_null()),
            "contains no aircraft positions",
        ),
        (
            _truth,
            TRUTH.with_columns(speed_mps=pl.lit(None, pl.Float64)),
            "rows are rejected; the first: truth.parquet: row 0: aircraft 7: speed_mps: expected",
        ),
        (_reports, REPORTS[3:], "contains no aircraft positions"),
    ],
)
def test_unusable_tables_are_reported(
    read: Callable[[pl.DataFrame], object], frame: pl.DataFrame, message: str
) -> None:
    with pytest.raises(MultiradarError, match=message):
        read(frame)


def test_biases_have_their_truth_between_its_times_only() -> None:
    truth = pl.DataFrame(
        {"time_s": [0.0, 1.5], "sensor_id": ["r", "r"], "parameter": ["range_gain"] * 2,
         "value": [0.0, 1.5]}
    )  # fmt: skip
    (found,) = bias_histories(BIASES, "b", truth, "t")
    assert found.true[0] == 1.0
    assert np.isnan(found.true[1])
    assert found.last == 0
    (alone,) = bias_histories(BIASES, "b", None, "t")
    assert alone.last == 1


def test_biases_with_missing_columns_are_rejected() -> None:
    with pytest.raises(MissingColumnError, match="sigma"):
        bias_histories(BIASES.drop("sigma"), "b", None, "t")
    broken = BIASES.with_columns(estimate=pl.Series([None, 1.0]))
    with pytest.raises(InputError, match="estimate: expected a number in every row"):
        bias_histories(broken, "b", None, "t")


def test_the_columns_used_are_those_that_track_writes() -> None:
    assert set(TRACKS.columns) <= set(TRACK_SCHEMA)


def test_sensors_with_different_identities_of_one_aircraft_give_it_one_name() -> None:
    """Regression: radars with addresses and ADS-B with track numbers doubled the aircraft."""
    rows = pl.DataFrame(
        {
            "track_number": [7, 7, None, None, None, 8, 9, None],
            "mode_s_address": [
                "4b1801",
                None,
                "4b1801",
                "4b1802",
                None,
                "4b1803",
                "4b1803",
                "4b1803",
            ],
        }
    )
    found = with_names(rows)["name"].to_list()
    # An address of two track numbers names neither of them.
    assert found == ["7", "7", "7", "4b1802", None, "8", "9", "4b1803"]
