"""The plane of a track: the same live and offline, for any batches; or a reason."""

from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.errors import PlaneError
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_COSINE,
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_AZIMUTH_SINE,
)
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.publication import Publication
from multiradar.runtime.memory.bias_board import BIAS_DTYPE
from multiradar.runtime.queries.manoeuvre_planes import plane_of_track
from multiradar.runtime.queries.parameters import WINDOW_DEFAULT_S
from multiradar.runtime.queries.registry import MANOEUVRE_PLANE
from multiradar.runtime.queries.track_windows import WindowTable, azimuth_bias_sigmas
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.products.manoeuvre_plane import MANOEUVRE_PLANE_SCHEMA, ManoeuvrePlane
from support.scenarios import live_scene

TABLE = live_scene.sensors()
SETTINGS = TrackingSettings(reorder_horizon_s=0.0)
#: Tracks by first appearance: the turn, the straight flight, the aircraft without height.
TURNING, STRAIGHT, MUTE = 1, 2, 3


def scene(seconds: float = 80.0) -> pl.DataFrame:
    """A turn at 3 °/s in a plane tilted by 10°, a straight flight, and one without heights."""
    rng = np.random.default_rng(1)
    frame = SystemPlane(np.radians(49.9), np.radians(15.2))
    time_s = np.arange(0.0, seconds, 2.0)
    angle = np.radians(3.0) * time_s
    flights = {
        TURNING: (
            4e3 * np.cos(angle),
            4e3 * np.sin(angle),
            6e3 + 4e3 * np.tan(np.radians(10.0)) * np.cos(angle),
        ),
        STRAIGHT: (200.0 * time_s, 30e3 + 100.0 * time_s, 8e3 + 0.0 * time_s),
        MUTE: (-200.0 * time_s, -30e3 + 100.0 * time_s, 8e3 + 0.0 * time_s),
    }
    parts = []
    for number, (east, north, height) in flights.items():
        latitude, longitude = frame.to_geodetic(east, north)
        for place, sensor in enumerate(("41-10", "41-20")):
            own = TABLE.ids.index(sensor)
            site = (
                float(TABLE.latitude_rad[own]), float(TABLE.longitude_rad[own]),
                float(TABLE.height_m[own]),
            )  # fmt: skip
            slant, azimuth, _ = slant_range_azimuth(site, latitude, longitude, height)
            count = len(time_s)
            parts.append(
                pl.DataFrame(
                    {
                        "time_s": live_scene.START_S + time_s + 0.5 * place + 0.1 * number,
                        "sensor_id": [sensor] * count,
                        "kind": ["radar"] * count,
                        "range_m": slant + rng.normal(0.0, 50.0, count),
                        "azimuth_deg": np.degrees(azimuth + rng.normal(0.0, 0.001, count)) % 360.0,
                        "height_m": [None] * count
                        if number == MUTE
                        else height + rng.normal(0.0, 2.97, count),
                        "track_number": [number] * count,
                    }
                )
            )
    rows = pl.concat(parts, how="vertical_relaxed").sort("time_s")
    missing = [name for name in MEASUREMENT_SCHEMA if name not in rows.columns]
    return rows.with_columns(pl.lit(None).alias(name) for name in missing).select(
        pl.col(name).cast(kind) for name, kind in MEASUREMENT_SCHEMA.items()
    )


class _Published:
    """An engine and its published output."""

    def __init__(self, **limits: int) -> None:
        self.engine = Engine(TABLE, SETTINGS)
        bounds = RuntimeLimits(**limits)
        self.publication = Publication(TABLE, SETTINGS, bounds)
        self.view = self.publication.view
        self.table = WindowTable(
            plane_of_track, MANOEUVRE_PLANE_SCHEMA, TABLE, WINDOW_DEFAULT_S, SETTINGS.epoch_s
        )
        self.rows = pl.DataFrame(schema=MANOEUVRE_PLANE_SCHEMA)

    def push(self, frame: pl.DataFrame) -> None:
        batch, _ = measurement_batch(frame, TABLE)
        output = self.engine.push(batch)
        self.publication.publish(output, float(batch.time_s.max()))
        self.rows = self.rows.vstack(self.table.update(output))

    def end(self) -> None:
        output = self.engine.flush()
        self.publication.publish(output, None)
        self.rows = self.rows.vstack(self.table.update(output)).vstack(self.table.finish())


@pytest.fixture(scope="module")
def published() -> _Published:
    found = _Published()
    found.push(scene())
    found.end()
    return found


def test_a_turn_in_a_tilted_plane_is_found(published: _Published) -> None:
    """Λ near its degrees of freedom, the tilt within 4 of its sigmas."""
    answer = published.view.ask(MANOEUVRE_PLANE, TURNING, window_s=60.0)
    assert answer is not None
    plane = ManoeuvrePlane.model_validate(answer)
    assert plane.is_planar
    assert plane.points == 61
    assert abs(plane.tilt_deg - 10.0) < 4.0 * plane.normal_sigma_deg < 4.0
    assert plane.refused_by_printed_criterion is False
    # The plane falls towards the west: its normal leans there.
    assert plane.normal_east < -0.1
    assert len(plane.positions) == plane.points
    assert plane.positions[-1].time_s == plane.time_s


@pytest.mark.slow
def test_offline_agrees_with_the_service(published: _Published) -> None:
    """The last row of each track, and on the way: after every epoch the service was asked too."""
    live = published.view.ask(MANOEUVRE_PLANE, TURNING, window_s=WINDOW_DEFAULT_S)
    assert live is not None
    del live["positions"]
    last = published.rows.filter(pl.col("track_id") == TURNING).row(-1, named=True)
    assert last == {**live, "reason": None}
    on_the_way = _Published()
    asked: dict[float, dict[str, Any]] = {}
    for measured in scene().iter_slices(1):
        on_the_way.push(measured)
        try:
            answer = on_the_way.view.ask(MANOEUVRE_PLANE, TURNING, window_s=WINDOW_DEFAULT_S)
        except PlaneError:
            continue
        if answer is not None:
            del answer["positions"]
            asked[answer["time_s"]] = answer
    on_the_way.end()
    asked[live["time_s"]] = live
    assert on_the_way.rows.equals(published.rows)
    planes = on_the_way.rows.filter(pl.col("track_id") == TURNING, pl.col("reason").is_null())
    assert len(planes) >= 15
    for row in planes.iter_rows(named=True):
        assert row == {**asked[row["time_s"]], "reason": None}


def test_a_straight_flight_and_one_without_heights_have_reasons(published: _Published) -> None:
    for track_id, code in ((STRAIGHT, "POINTS_ON_A_LINE"), (MUTE, "TOO_FEW_POINTS")):
        with pytest.raises(PlaneError) as error:
            published.view.ask(MANOEUVRE_PLANE, track_id, window_s=60.0)
        assert error.value.code == code
        row = published.rows.filter(pl.col("track_id") == track_id).row(-1, named=True)
        assert row["reason"] == code
        assert row["p_value"] is None
    assert published.view.ask(MANOEUVRE_PLANE, 99, window_s=60.0) is None


def test_the_window_runs_with_the_track(published: _Published) -> None:
    short = published.view.ask(MANOEUVRE_PLANE, TURNING, window_s=20.0)
    assert short is not None
    assert short["points"] == 21
    assert short["positions"][0]["time_s"] >= short["time_s"] - 20.0


def test_plots_that_were_dropped_from_memory_are_no_plane() -> None:
    found = _Published(plot_rows_max=4)
    found.push(scene(20.0))
    with pytest.raises(PlaneError, match="points"):
        found.view.ask(MANOEUVRE_PLANE, TURNING, window_s=60.0)


def test_the_azimuth_bias_sigma_is_its_prior_until_it_is_published() -> None:
    own = np.flatnonzero(TABLE.parameter_kind == PARAMETER_AZIMUTH_OFFSET)
    beforehand = np.zeros(len(TABLE))
    beforehand[TABLE.parameter_sensor[own]] = TABLE.prior_sigma[own]
    assert 0 < np.count_nonzero(beforehand) < len(TABLE)
    assert azimuth_bias_sigmas(np.empty(0, BIAS_DTYPE), TABLE).tolist() == beforehand.tolist()
    first = int(TABLE.parameter_sensor[own[0]])
    published = np.zeros(2, BIAS_DTYPE)
    published["sensor"], published["parameter"] = first, (PARAMETER_AZIMUTH_OFFSET, 0)
    published["sigma"] = 1e-4, 30.0
    beforehand[first] = 1e-4
    assert azimuth_bias_sigmas(published, TABLE).tolist() == beforehand.tolist()


def test_the_azimuth_bias_sigma_includes_the_eccentricity() -> None:
    published = np.zeros(3, BIAS_DTYPE)
    kinds = (PARAMETER_AZIMUTH_OFFSET, PARAMETER_AZIMUTH_SINE, PARAMETER_AZIMUTH_COSINE)
    published["parameter"], published["sigma"] = kinds, (3e-4, 1e-4, 4e-4)
    assert azimuth_bias_sigmas(published, TABLE)[0] == pytest.approx(5e-4)
