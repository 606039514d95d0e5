"""Tables to and from `traffic` and Stone Soup."""

import datetime as dt
import sys

import numpy as np
import polars as pl
import pytest

import multiradar as mr
from multiradar.errors import ConfigurationError, InputError, MissingColumnError
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA

CENTRE = (50.0, 10.0)
START_S = 1_533_110_400.0  # 2018-08-01 08:00 UTC
TRACKS = pl.DataFrame(
    {
        "time_s": [START_S, START_S + 4.0, START_S + 1.0],
        "track_id": [1, 1, 2],
        "track_number": [7, 7, None],
        "mode_s_address": ["3C4A5B", "3C4A5B", None],
        "mode_3a": ["1000", "1000", "2000"],
        "callsign": ["DLH4T", "DLH4T", None],
        "latitude_deg": [50.5, 50.51, 49.8],
        "longitude_deg": [10.2, 10.2, 9.5],
        "height_m": [3048.0, 3048.0, None],
        "speed_mps": [200.0, 210.0, 150.0],
        "heading_deg": [1.0, 0.5, 271.0],
        "position_sigma_m": [40.0, 30.0, 50.0],
        "velocity_sigma_mps": [4.0, 3.0, 5.0],
        "vertical_rate_mps": [0.508, 0.0, None],
        "state": ["tentative", "confirmed", "confirmed"],
        "sensor_id": ["a", "b", "a"],
    }
)


def test_tracks_have_the_columns_and_units_of_traffic() -> None:
    frame = mr.adapters.to_traffic(TRACKS)
    assert frame.columns == [
        "timestamp", "icao24", "callsign", "flight_id", "latitude", "longitude", "altitude",
        "groundspeed", "track", "vertical_rate",
    ]  # fmt: skip
    first = frame.row(0, named=True)
    assert first["timestamp"] == dt.datetime(2018, 8, 1, 8, tzinfo=dt.UTC)
    assert (first["icao24"], first["flight_id"]) == ("3c4a5b", "track-1")
    # 10 000 ft, 389 kt, 100 ft/min.
    assert first["altitude"] == pytest.approx(10_000.0)
    assert first["groundspeed"] == pytest.approx(388.77, abs=0.01)
    assert first["vertical_rate"] == pytest.approx(100.0)


def test_trajectories_of_traffic_come_back_as_adsb_measurements() -> None:
    class Traffic:
        """As `traffic.core.Traffic`: a table in `.data`."""

        data = mr.adapters.to_traffic(TRACKS).to_arrow()

    found = mr.adapters.from_traffic(Traffic())
    assert dict(found.schema) == dict(MEASUREMENT_SCHEMA)
    assert found["time_s"].to_list() == [START_S, START_S + 1.0, START_S + 4.0]
    assert found["kind"].unique().to_list() == ["adsb"]
    assert found["mode_s_address"].to_list() == ["3C4A5B", None, "3C4A5B"]
    assert found["height_m"].to_list() == pytest.approx([3048.0, None, 3048.0])
    # A flight without an address keeps its identity.
    assert found["track_number"].to_list() == [None, 1, None]


def test_rows_of_traffic_without_a_position_are_left_out() -> None:
    frame = mr.adapters.to_traffic(TRACKS).with_columns(
        latitude=pl.Series([47.0, float("nan"), None]), longitude=pl.Series([8.0, 8.0, 8.0])
    )
    found = mr.adapters.from_traffic(frame)
    assert found["latitude_deg"].to_list() == [47.0]


def test_a_table_that_is_not_of_traffic_is_named_with_what_it_lacks() -> None:
    frame = mr.adapters.to_traffic(TRACKS).rename({"altitude": "altitudes"})
    with pytest.raises(MissingColumnError, match=r"flights: .*rename altitudes to altitude\?"):
        mr.adapters.from_traffic(frame)


def test_tracks_without_a_date_have_no_time_stamps() -> None:
    undated = TRACKS.with_columns(pl.col("time_s") - START_S + 28_800.0)
    with pytest.raises(InputError, match="times have no date"):
        mr.adapters.to_traffic(undated)


def test_stone_soup_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "stonesoup", None)
    with pytest.raises(ConfigurationError, match="pip install stonesoup"):
        mr.adapters.to_stone_soup(TRACKS, CENTRE)


def test_tracks_go_to_stone_soup_and_back() -> None:
    pytest.importorskip("stonesoup")
    tracks = mr.adapters.to_stone_soup(TRACKS, CENTRE)
    assert sorted(len(track) for track in tracks) == [1, 2]
    longest = max(tracks, key=len)
    east, v_east, north, v_north = np.asarray(longest[0].state_vector).ravel()
    # 0.5° north and 0.2° east of the centre; nearly due north.
    assert (north, east) == pytest.approx((55_630.0, 14_180.0), rel=0.01)
    assert (v_north, v_east) == pytest.approx((200.0, 3.5), abs=1.0)
    back = mr.adapters.from_stone_soup(tracks, CENTRE)
    assert back["track_id"].to_list() == [1, 2, 1]
    for name, bound in (
        ("time_s", 1e-6), ("latitude_deg", 1e-9), ("longitude_deg", 1e-9), ("speed_mps", 1e-6),
        ("heading_deg", 1e-6), ("position_sigma_m", 1e-6), ("velocity_sigma_mps", 1e-6),
    ):  # fmt: skip
        expected = TRACKS.sort("time_s")[name].to_numpy()
        np.testing.assert_allclose(back[name].to_numpy(), expected, rtol=0, atol=bound)
