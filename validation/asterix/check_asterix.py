"""Prints track continuity of a converted recording, and residuals before and after bias correction.

::

    multiradar convert asterix RECORDING --sensors sensors.toml --out PLOTS
    multiradar track PLOTS --sensors sensors.toml --out TRACKS
    python -m validation.asterix.check_asterix PLOTS TRACKS sensors.toml [BIASES]

*Continuity*: fraction of the scans between the first and the last plot of a track that have a plot.
*Noise*: from second differences of range and azimuth of successive scans (their median, for a
normal distribution), to which the motion hardly contributes. *Residuals*: two radars with a scan
period in the sensors file detect an aircraft within 0.5 s; both plots become positions with the
reported height, the earlier one extrapolated with the velocity of the track; their distance is
given raw, and corrected by the final biases of the tracks. With BIASES the biases come from other
tracks, or from the output of `multiradar align --json`, for cross-validation between two halves of
the aircraft.
"""

import json
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation, geodetic_to_ecef
from multiradar_schemas.sensors.sensor import Sensor, load_sensors

Floats = NDArray[np.float64]

LIFE_MIN_S = 60.0
APART_MAX_S = 0.5
NORMAL = 0.6745
SECOND_DIFFERENCE = np.sqrt(6.0)


def updates(plots: Path, tracks: Path) -> pl.DataFrame:
    """Return every update of a track with its plot."""
    measured = pl.read_parquet(plots / "measurements.parquet").select(
        "time_s", "sensor_id", "range_m", "azimuth_deg", pl.col("height_m").alias("heard_m")
    )
    table = pl.read_parquet(tracks / "tracks.parquet")
    # A sensor sometimes gives two plots of one time: these are excluded.
    single = measured.unique(["time_s", "sensor_id"], keep="none")
    return table.join(single, on=["time_s", "sensor_id"]).sort("track_id", "time_s")


def continuity(table: pl.DataFrame, turn_s: float) -> str:
    """Return number of tracks, their life and the scans without a plot as text."""
    lives = table.group_by("track_id").agg(
        (pl.col("time_s").max() - pl.col("time_s").min()).alias("life"),
        pl.len().alias("plots"),
        pl.col("time_s").sort().diff().max().alias("gap"),
    )
    long = lives.filter(pl.col("life") >= LIFE_MIN_S)
    life = long["life"].to_numpy()
    share = float(long["plots"].to_numpy().sum() / (np.round(life / turn_s) + 1).sum())
    gaps = int((long["gap"].to_numpy() > 4 * turn_s).sum())
    return (
        f"{lives.height} tracks, {long.height} of at least {LIFE_MIN_S:.0f} s (median "
        f"{np.median(life):.0f} s); {100 * share:.1f} % of their scans have a plot; "
        f"{gaps} of them miss four consecutive scans or more"
    )


def noise(table: pl.DataFrame, turn_s: float) -> tuple[float, float]:
    """Return the noise of range, m, and azimuth, degree."""
    ranges: list[float] = []
    azimuths: list[float] = []
    for track in table.partition_by("track_id"):
        time, distance, azimuth = (
            track[name].to_numpy() for name in ("time_s", "range_m", "azimuth_deg")
        )
        steps = np.diff(time)
        even = (np.abs(steps[1:] - turn_s) < 0.1) & (np.abs(steps[:-1] - turn_s) < 0.1)
        turned = np.rad2deg(np.unwrap(np.deg2rad(azimuth)))
        ranges += np.diff(distance, 2)[even].tolist()
        azimuths += np.diff(turned, 2)[even].tolist()
    scale = NORMAL * SECOND_DIFFERENCE
    return (
        float(np.median(np.abs(ranges)) / scale),
        float(np.median(np.abs(azimuths)) / scale),
    )


def position(sensor: Sensor, distance: float, azimuth_deg: float, height: float) -> Floats:
    """Return the position of a plot, ECEF, m."""
    latitude, longitude = (
        np.deg2rad(sensor.latitude_deg or 0.0),
        np.deg2rad(sensor.longitude_deg or 0.0),
    )
    site = geodetic_to_ecef(latitude, longitude, sensor.height_m or 0.0)
    rotation = enu_rotation(latitude, longitude)
    azimuth = np.deg2rad(azimuth_deg)
    up = height - (sensor.height_m or 0.0)
    for _ in range(8):
        ground = np.sqrt(max(distance**2 - up**2, 1.0))
        line = np.array([ground * np.sin(azimuth), ground * np.cos(azimuth), up])
        place: Floats = site + line @ rotation
        up += height - float(ecef_to_geodetic(place)[2])
    return place


def residuals(
    table: pl.DataFrame, sensors: dict[str, Sensor], biases: dict[str, Any]
) -> tuple[Floats, Floats]:
    """Return distances between two radars' plots of an aircraft, m, raw and corrected."""
    before: list[float] = []
    after: list[float] = []
    for track in table.partition_by("track_id"):
        for first, second in pairwise(track.to_dicts()):
            if first["sensor_id"] == second["sensor_id"] or any(
                one["sensor_id"] not in sensors or one["heard_m"] is None for one in (first, second)
            ):
                continue
            passed = second["time_s"] - first["time_s"]
            if passed > APART_MAX_S:
                continue
            heading = np.deg2rad(second["heading_deg"])
            moved = passed * second["speed_mps"] * np.array([np.sin(heading), np.cos(heading), 0])
            rotation = enu_rotation(
                np.deg2rad(second["latitude_deg"]), np.deg2rad(second["longitude_deg"])
            )
            for known, found in (({}, before), (biases, after)):
                places = [_place(one, sensors, known) for one in (first, second)]
                found.append(float(np.hypot(*(rotation @ (places[1] - places[0]) - moved)[:2])))
    return np.array(before), np.array(after)


def _place(row: dict[str, Any], sensors: dict[str, Sensor], biases: dict[str, Any]) -> Floats:
    known = biases.get(row["sensor_id"], {})
    offset = known.get("range_offset_m", {}).get("estimate", 0.0)
    turned = known.get("azimuth_offset_deg", {}).get("estimate", 0.0)
    return position(
        sensors[row["sensor_id"]],
        row["range_m"] - offset,
        row["azimuth_deg"] - turned,
        row["heard_m"],
    )


def biases_of(given: Path) -> dict[str, Any]:
    """Return the biases of a folder of tracks, or of the output of `align --json`."""
    if given.is_dir():
        report = json.loads((given / "report.json").read_text())
        return dict(report["figures"]["final_biases"])
    found: dict[str, Any] = {}
    for one in json.loads(given.read_text())["biases"]:
        found.setdefault(one["sensor_id"], {})[one["parameter"]] = one
    return found


def main() -> None:
    """Print the figures."""
    plots, tracks, listed, *other = map(Path, sys.argv[1:])
    table = updates(plots, tracks)
    sensors = {
        one.id: one
        for one in load_sensors(listed).sensor
        if one.kind == "radar" and one.rotation_period_s is not None
    }
    antennas = json.loads((plots / "report.json").read_text())["figures"]["antennas"]
    for name in table["sensor_id"].unique().sort():
        turn_s = antennas.get(name, {}).get("turn_s")
        own = table.filter(pl.col("sensor_id") == name)
        if turn_s is None or own.height < 1000:
            continue
        range_m, azimuth_deg = noise(own, turn_s)
        seen = pl.read_parquet(tracks / "tracks.parquet").filter(pl.col("sensor_id") == name)
        print(f"{name}: scan period {turn_s} s; {continuity(seen, turn_s)}")
        print(f"{name}: noise {range_m:.1f} m and {azimuth_deg:.4f}°")
    before, after = residuals(table, sensors, biases_of((other or [tracks])[0]))
    if len(before):
        for what, values in (("before", before), ("after", after)):
            print(
                f"{len(values)} pairs of radars of known site, {what}: median "
                f"{np.median(values):.0f} m, RMS {np.sqrt(np.mean(values**2)):.0f} m, "
                f"90 % {np.quantile(values, 0.9):.0f} m"
            )


if __name__ == "__main__":
    main()
