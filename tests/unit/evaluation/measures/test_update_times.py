"""Plots are joined with the updates that they made, also where a clock is known to be late."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.evaluation.measures.bias_errors import BiasHistory
from multiradar.evaluation.measures.plots_on_tracks import plots_on_the_right_track
from multiradar.evaluation.measures.update_times import UPDATE_TIME, with_update_times
from multiradar.evaluation.reference_checks import of_another_recording
from multiradar.evaluation.sensor_differences import sensor_differences
from multiradar.evaluation.tables import TRACK_COLUMNS
from multiradar.evaluation.trajectories import Floats, Tracks
from multiradar.geodesy.wgs84 import enu_rotation, geodetic_to_ecef
from multiradar.toolbox.evaluation.tracked import named_by_tracks
from multiradar_schemas.sensors.sensor import Sensor, parse_sensors
from support.scenarios.skies import PLANE, reference_of, straight, tracks_of

LATE_S = 0.3
SITE_DEG = (45.5, 5.5)
TIMES_S = np.arange(0.0, 400.0, 4.0) + 1_533_110_400.1
FLIGHT = straight((TIMES_S - TIMES_S[0]).tolist(), 20e3, 15e3, 150.0, 120.0)
#: The same at their times, known a minute before and after.
REFERENCE = reference_of(
    {
        "a": [
            (TIMES_S[0] + time, 20e3 + 150.0 * time, 15e3 + 120.0 * time, 150.0, 120.0)
            for time in np.arange(-60.0, 460.0, 4.0).tolist()
        ]
    }
)


def sensors(bias: str) -> tuple[Sensor, ...]:
    return parse_sensors(
        f'[[sensor]]\nid = "radar"\nalso = ["second"]\nkind = "radar"\n'
        f"latitude_deg = {SITE_DEG[0]}\nlongitude_deg = {SITE_DEG[1]}\nheight_m = 200.0\n{bias}\n"
        '[[sensor]]\nid = "adsb"\nkind = "adsb"\n'
    ).sensor


KNOWN = sensors(f"bias.time_offset_s = {{ prior = {LATE_S}, estimate = false }}")


def seen(time_s: Floats) -> tuple[Floats, Floats]:
    """Return slant range, m, and azimuth, degrees, of the flight."""
    after_s = time_s - TIMES_S[0]
    latitude, longitude = PLANE.to_geodetic(20e3 + 150.0 * after_s, 15e3 + 120.0 * after_s)
    site = np.radians(SITE_DEG)
    offset = geodetic_to_ecef(latitude, longitude, np.full(len(time_s), 9000.0))
    offset = offset - geodetic_to_ecef(site[0], site[1], 200.0)
    east, north, up = (offset @ enu_rotation(site[0], site[1]).T).T
    return np.sqrt(east**2 + north**2 + up**2), np.degrees(np.arctan2(east, north)) % 360.0


def plots(name: str = "radar") -> pl.DataFrame:
    """Return plots at `TIMES_S`, stamped late."""
    range_m, azimuth_deg = seen(TIMES_S)
    return pl.DataFrame(
        {
            "time_s": TIMES_S + LATE_S,
            "range_m": range_m,
            "azimuth_deg": azimuth_deg,
            "height_m": 9000.0,
            "name": "a",
        }
    ).with_columns(sensor_id=pl.lit(name))


def tracks(time_s: Floats) -> Tracks:
    return tracks_of(
        {1: [(time, *row[1:]) for time, row in zip(time_s.tolist(), FLIGHT, strict=True)]}
    )


#: As the tracker subtracts the offset.
UPDATES = tracks((TIMES_S + LATE_S) - LATE_S)
OF_A = np.zeros(len(TIMES_S), np.int64)


@pytest.mark.parametrize("name", ["radar", "second"])
def test_the_known_offset_of_a_clock_is_subtracted_under_each_name(name: str) -> None:
    found = with_update_times(plots(name), KNOWN)[UPDATE_TIME].to_numpy()
    assert (found == UPDATES.time_s).all()


def test_unknown_sensors_and_those_without_an_offset_keep_their_times() -> None:
    for name, known in (("adsb", KNOWN), ("other", KNOWN), ("radar", ()), ("radar", sensors(""))):
        found = with_update_times(plots(name), known)
        assert found[UPDATE_TIME].to_list() == found["time_s"].to_list()


# The names of the plots and of the updates: the same, or another one of a second network.
NAMES = pytest.mark.parametrize(
    ("name", "of_updates"), [("radar", "radar"), ("second", "radar"), ("radar", "second")]
)


def updates_of(name: str) -> Tracks:
    return replace(UPDATES, sensor_id=np.full(len(UPDATES.time_s), name))


@NAMES
def test_the_measurements_of_the_tracks_are_no_other_recording(name: str, of_updates: str) -> None:
    given = Path("measurements.parquet")
    assert of_another_recording(updates_of(of_updates), plots(name), KNOWN, given) == []
    (sentence,) = of_another_recording(UPDATES, plots(), (), given)
    assert "0% of the updates" in sentence


@NAMES
def test_plots_on_the_right_track_are_counted(name: str, of_updates: str) -> None:
    found, count = with_update_times(plots(name), KNOWN), len(TIMES_S)
    updates = updates_of(of_updates)
    assert plots_on_the_right_track(updates, REFERENCE, OF_A, found, KNOWN) == (count, count)


@NAMES
def test_plots_are_named_by_the_tracks_that_they_updated(
    name: str, of_updates: str, tmp_path: Path
) -> None:
    table: dict[str, Any] = {one: [None] * len(TIMES_S) for one in TRACK_COLUMNS}
    table |= {"time_s": UPDATES.time_s, "track_id": [7] * len(TIMES_S)}
    table |= {"state": ["confirmed"] * len(TIMES_S), "sensor_id": [of_updates] * len(TIMES_S)}
    pl.DataFrame(table).write_parquet(tmp_path / "tracks.parquet")
    unnamed = plots(name).with_columns(track_number=pl.lit(None, pl.Int64))
    named = named_by_tracks(unnamed, KNOWN, tmp_path)
    assert named["track_number"].to_list() == [7] * len(TIMES_S)


def differences(
    known: tuple[Sensor, ...], updates: Tracks, estimate_s: float
) -> dict[str, tuple[int, float, float]]:
    ones = np.ones(2)
    late = BiasHistory(
        "radar", "time_offset_s", TIMES_S[[0, -1]], estimate_s * ones, 0.01 * ones, np.nan * ones
    )
    found = sensor_differences(
        updates, REFERENCE, OF_A, plots(), sensors=known, biases=[late] if estimate_s else []
    )
    return {one.quantity: (one.plots, one.mean, one.left) for one in found}


def test_a_time_offset_explains_the_differences_of_moving_aircraft() -> None:
    """The aircraft flies away from the radar: stamped late, its ranges look short."""
    estimated = sensors("bias.time_offset_s = { prior_sigma = 1.0, estimate = true }")
    stamped = tracks(TIMES_S + LATE_S)
    for known, updates, estimate_s in ((KNOWN, UPDATES, 0.0), (estimated, stamped, LATE_S)):
        count, mean_m, left_m = differences(known, updates, estimate_s)["range_m"]
        assert count == len(TIMES_S)
        assert -70.0 < mean_m < -20.0
        assert abs(left_m) < 0.1
        assert abs(differences(known, updates, estimate_s)["azimuth_deg"][2]) < 1e-3
