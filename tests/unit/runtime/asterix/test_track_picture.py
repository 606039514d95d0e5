"""Reports of single tracks: extrapolated, with ages by source, anywhere on the Earth."""

from dataclasses import replace
from typing import Any

import numpy as np
import pyproj
import pytest
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION, KIND_RADAR
from multiradar.runtime.asterix.numbers import NUMBERS
from multiradar.runtime.asterix.sensor_picture import SensorPicture
from multiradar.runtime.asterix.track_picture import TrackPicture
from multiradar.tracking.input.measurements import COLUMNS, MeasurementBatch
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import sensor_table
from multiradar_converters.asterix.writing.track_reports import TrackReports, track_records
from multiradar_schemas.measurements.measurement import DETECTIONS
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile
from support.asterix.reports import SENDER, read_tracks
from support.scenarios.live_scene import sensors, sensors_file

TABLE = sensors()
TRACKING = TrackingSettings()
RADAR, OTHER_RADAR, ADSB = 0, 1, 2

Added = tuple[TrackUpdates, MeasurementBatch, NDArray[np.float64]]


def picture() -> TrackPicture:
    return TrackPicture(TABLE, SensorPicture(TABLE, 60.0), TRACKING)


def updates(time_s: Any, **said: Any) -> Added:
    """Updates of track 1 by a Mode S plot over (50° N, 15° E), but for what is said.

    `plot_…` is of the measurement, the rest of the track.
    """
    times = np.atleast_1d(np.asarray(time_s, np.float64))
    columns: dict[str, Any] = {
        "sequence": 1, "track_id": 1, "sensor": RADAR, "track_number": -1,
        "mode_s_address": 0x4B1234, "mode_3a": 0o1234, "latitude_rad": np.radians(50.0),
        "longitude_rad": np.radians(15.0), "height_m": 9000.0, "speed_mps": 250.0,
        "heading_rad": np.radians(60.0), "position_sigma_m": 50.0, "velocity_sigma_mps": 3.0,
        "state": 1, "turn_right_probability": np.nan, "turn_left_probability": np.nan,
        "speed_change_probability": np.nan, "vertical_rate_mps": np.nan, "height_sigma_m": 10.0,
        "adsb_implausible": False, "callsign": -1, "on_ground": -1, "plot_kind": KIND_RADAR,
        "plot_range_m": 1e5, "plot_azimuth_rad": 1.0, "plot_latitude_rad": np.nan,
        "plot_longitude_rad": np.nan, "plot_height_m": 9000.0, "plot_mode_3a": 0o1234,
        "plot_mode_s_address": 0x4B1234, "measured_mode_s_address": 0x4B1234,
    }  # fmt: skip
    filled = {
        name: np.broadcast_to(np.asarray(value), times.shape).copy()
        for name, value in (columns | said).items()
    }
    whole = {name: filled[name] for name in TrackUpdates.__dataclass_fields__ if name != "time_s"}
    measured: dict[str, Any] = {
        name: filled.get(f"plot_{name}", filled.get(name, times)) for name in COLUMNS
    }
    spread = np.tile([0.0, 0.0, 900.0, 0.0, 400.0], (len(times), 1))
    return TrackUpdates(time_s=times, **whole), MeasurementBatch(**measured), spread


def reported(time_s: float, *added: Added) -> TrackReports:
    tracks = picture()
    for one in added:
        tracks.update(*one)
    return tracks.reports(time_s)


@pytest.mark.parametrize(
    ("latitude_deg", "longitude_deg", "heading_deg"),
    [(50.0, 15.0, 60.0), (60.0, 179.995, 90.0), (-60.0, -179.999, 270.0), (89.99, 0.0, 10.0)],
)
def test_a_track_is_moved_on_over_ground(
    latitude_deg: float, longitude_deg: float, heading_deg: float
) -> None:
    place = updates(
        100.0,
        latitude_rad=np.radians(latitude_deg),
        longitude_rad=np.radians(longitude_deg),
        heading_rad=np.radians(heading_deg),
        vertical_rate_mps=-10.0,
    )
    reports = reported(110.0, place)
    geod = pyproj.Geod(ellps="WGS84")
    longitude, latitude, back = geod.fwd(longitude_deg, latitude_deg, heading_deg, 2500.0)
    apart = geod.inv(longitude, latitude, reports.longitude_deg[0], reports.latitude_deg[0])[2]
    assert apart < 0.1
    onward = np.radians(back + 180.0)
    assert reports.velocity_east_mps[0] == pytest.approx(250.0 * np.sin(onward), abs=0.5)
    assert reports.velocity_north_mps[0] == pytest.approx(250.0 * np.cos(onward), abs=0.5)
    assert reports.barometric_m[0] == pytest.approx(8900.0)
    assert reports.measured_height_m[0] == 9000.0
    # It can be written and read wherever it is.
    (record,) = read_tracks(track_records(reports, SENDER))
    assert -180.0 <= record["105"]["LON"] < 180.0


def test_the_accuracy_is_that_of_the_reported_time() -> None:
    at_once = reported(100.0, updates(100.0))
    # 30 m to the east, 20 m to the north, on a plane whose scale is one to 10⁻³ here.
    assert np.sqrt(at_once.variance_east_m2[0]) == pytest.approx(30.0, rel=2e-3)
    assert np.sqrt(at_once.variance_north_m2[0]) == pytest.approx(20.0, rel=2e-3)
    later = reported(110.0, updates(100.0))
    # Worst case: errors of position and velocity fully correlated; 3 m/s is that of both axes.
    noise = TRACKING.acceleration_density * 10.0**3 / 3.0
    expected = np.sqrt((30.0 + 3.0 / np.sqrt(2.0) * 10.0) ** 2 + noise)
    assert np.sqrt(later.variance_east_m2[0]) == pytest.approx(expected, rel=2e-3)


def test_ages_are_reported_by_source() -> None:
    radar = updates([100.0, 102.0], plot_mode_s_address=[-1, 0x4B1234])
    primary = updates(104.0, plot_mode_s_address=-1, plot_mode_3a=-1, plot_height_m=np.nan)
    squitter = updates(105.0, sensor=ADSB, plot_kind=KIND_POSITION, plot_range_m=np.nan)
    bearing = updates(
        106.0, plot_kind=KIND_BEARING, plot_mode_3a=-1, plot_height_m=np.nan, plot_mode_s_address=-1
    )
    reports = reported(110.0, radar, primary, squitter, bearing)
    np.testing.assert_allclose(reports.age_s[0], [6.0, 10.0, 8.0, 5.0, np.nan])
    assert reports.track_age_s[0] == 10.0
    assert (reports.height_age_s[0], reports.code_age_s[0]) == (5.0, 5.0)
    # What was measured last was no plot; the last height that was measured is kept.
    assert reports.sensor[0] == -1
    assert reports.measured_height_m[0] == 9000.0


@pytest.mark.parametrize(
    ("said", "kind"),
    [
        ({}, 5),
        ({"plot_mode_s_address": -1}, 2),
        ({"plot_mode_s_address": -1, "plot_mode_3a": -1}, 2),
        ({"plot_mode_s_address": -1, "plot_mode_3a": -1, "plot_height_m": np.nan}, 1),
    ],
)
def test_the_plot_type_follows_from_its_fields(said: dict[str, Any], kind: int) -> None:
    assert reported(101.0, updates(100.0, **said)).plot_type.tolist() == [kind]


@pytest.mark.parametrize(
    ("detection", "kind", "ages"),
    [
        ("psr", 1, [10.0, np.nan, np.nan]),
        ("ssr", 2, [np.nan, 10.0, np.nan]),
        ("psr_ssr", 3, [10.0, 10.0, np.nan]),
        ("mode_s", 5, [np.nan, np.nan, 10.0]),
        ("psr_mode_s", 7, [10.0, np.nan, 10.0]),
    ],
)
@pytest.mark.parametrize("coded", [True, False])
def test_the_type_that_a_radar_reports_counts(
    detection: str, kind: int, ages: list[float], coded: bool
) -> None:
    """A garbled secondary plot has no code, and is no primary plot."""
    garbled: dict[str, Any] = {"plot_mode_s_address": -1, "plot_mode_3a": -1}
    update, measured, spread = updates(
        100.0, **({} if coded else garbled | {"plot_height_m": np.nan})
    )
    column = np.array([DETECTIONS.index(detection)], np.int8)
    reports = reported(110.0, (update, replace(measured, detection=column), spread))
    assert reports.plot_type.tolist() == [kind]
    np.testing.assert_allclose(reports.age_s[0, :3], ages)


def test_biases_of_primary_plots_need_primary_plots() -> None:
    sensors = SensorPicture(TABLE, 60.0)
    tracks = TrackPicture(TABLE, sensors, TRACKING)
    garbled = updates(100.0, plot_mode_s_address=-1, plot_mode_3a=-1, plot_height_m=np.nan)
    for detection, found in (("ssr", (True, False)), ("psr_ssr", (True, True))):
        column = np.array([DETECTIONS.index(detection)], np.int8)
        tracks.update(garbled[0], replace(garbled[1], detection=column), garbled[2])
        reports = sensors.reports(101.0)
        assert (reports.secondary[RADAR], reports.primary[RADAR]) == found


def test_a_track_of_one_sensor_lately_is_monosensor() -> None:
    both = updates([100.0, 101.0], sensor=[RADAR, OTHER_RADAR])
    assert not reported(102.0, both).monosensor[0]
    long_s = TRACKING.coast_after_s + 1.0
    alone = updates(101.0 + long_s, sensor=RADAR)
    assert reported(103.0 + long_s, both, alone).monosensor[0]


def test_a_sensor_that_is_added_has_not_measured_the_tracks_before() -> None:
    one_more = Sensor.model_validate({"id": "more", "kind": "adsb"})
    tracks = picture()
    tracks.update(*updates(100.0))
    tracks.use(sensor_table(SensorsFile(sensor=(*sensors_file().sensor, one_more))))
    tracks.update(*updates(104.0))
    assert tracks.reports(105.0).monosensor.tolist() == [True]


def test_a_height_that_is_not_measured_is_geometric() -> None:
    unheard = updates([100.0, 104.0], plot_height_m=np.nan, height_m=[8000.0, 8100.0])
    reports = reported(105.0, unheard)
    assert reports.geometric_m[0] == 8100.0
    assert np.isnan(reports.barometric_m[0])
    nothing = reported(105.0, updates(100.0, plot_height_m=np.nan, height_m=np.nan))
    assert np.isnan([nothing.geometric_m[0], nothing.barometric_m[0]]).all()


def test_modes_of_movement_are_reported_where_one_is_likely() -> None:
    def movement(right: float, left: float, speed: float, climb: float) -> list[int]:
        one = updates(
            100.0, turn_right_probability=right, turn_left_probability=left,
            speed_change_probability=speed, vertical_rate_mps=climb,
        )  # fmt: skip
        reports = reported(101.0, one)
        return [int(part[0]) for part in (reports.turning, reports.speeding, reports.climbing)]

    assert movement(0.1, 0.1, 0.1, 0.0) == [0, 0, 0]
    assert movement(0.6, 0.1, 0.1, 5.0) == [1, 0, 1]
    assert movement(0.1, 0.6, 0.1, -5.0) == [2, 0, 2]
    assert movement(0.3, 0.3, 0.2, 1.0) == [3, 0, 0]
    # That the speed changes is reported, its sign is undetermined.
    assert movement(0.1, 0.1, 0.7, np.nan) == [0, 3, 3]
    assert movement(np.nan, np.nan, np.nan, np.nan) == [3, 3, 3]
    # What is as likely as not is undetermined; 300 ft/min is still level.
    assert movement(0.5, 0.0, 0.5, 1.524) == [3, 3, 0]
    assert movement(0.0, 0.5, 0.5, -1.524) == [3, 3, 0]
    assert movement(0.51, 0.0, 0.49, 1.53) == [1, 0, 1]
    assert movement(0.0, 0.51, 0.49, -1.53) == [2, 0, 2]


@pytest.mark.slow
def test_more_tracks_than_numbers_are_left_out_and_counted() -> None:
    tracks = picture()
    many = NUMBERS + 10
    tracks.update(*updates(np.full(many, 100.0), track_id=np.arange(1, many + 1)))
    reports = tracks.reports(101.0)
    assert sorted(reports.number.tolist()) == list(range(NUMBERS))
    assert tracks.numbers.unassigned == 10


def test_a_terminated_track_is_reported_once_more_and_then_discarded() -> None:
    tracks = picture()
    tracks.update(*updates([100.0, 100.0], track_id=[1, 2]))
    assert tracks.reports(101.0).last.tolist() == [False, False]
    tracks.terminate(np.array([2, 77]))
    reports = tracks.reports(102.0)
    assert (reports.number.tolist(), reports.last.tolist()) == ([1, 2], [False, True])
    assert tracks.reports(103.0).number.tolist() == [1]
    tracks.discard_terminated(100.0 + TRACKING.drop_after_s + TRACKING.epoch_s + 1.0)
    assert len(tracks) == 0


def test_a_terminated_track_is_kept_until_all_users_have_its_end() -> None:
    tracks = picture()
    tracks.update(*updates([100.0, 100.0], track_id=[1, 2]))
    assert tracks.reports(101.0, 101.0).last.tolist() == [False, False]
    tracks.terminate(np.array([2]))
    assert tracks.reports(102.0, 101.0).last.tolist() == [False, True]
    assert tracks.reports(103.0, 103.0).last.tolist() == [False, True]
    assert tracks.reports(104.0, 104.0).number.tolist() == [1]


def test_a_track_is_reported_with_its_present_callsign() -> None:
    reports = reported(103.0, updates(100.0, callsign=-1), updates(102.0, callsign=0x10C238A57820))
    assert reports.callsign.tolist() == [0x10C238A57820]
    assert reported(101.0, updates(100.0)).callsign.tolist() == [-1]
