"""Prints how far the positions of two sensors are apart, for docs/validation/real-radars.md.

::

    multiradar convert asterix RECORDING.ast… --out converted
    multiradar track converted --sensors sensors.toml --out tracks
    python -m validation.tracker.check_reports converted tracks 0-107 0-107-adsb --within-km 3

The positions of the first sensor are interpolated, over at most 4 s, to the times of the second,
by Mode S address. A row as reported, and one with the clocks corrected by the time offsets that
``tracks`` contains: number of pairs, median and 90th percentile of the distance, and its median for
aircraft faster than 20 m/s, on which a clock shows.
"""

import argparse
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.geodesy.system_plane import SystemPlane

Floats = NDArray[np.float64]
#: Longest interval of interpolation, s.
GAP_MAX_S = 4.0
#: Speed from which the clock matters, m/s.
FAST_MPS = 20.0


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("converted", type=Path, help="output folder of `convert`")
    parser.add_argument("tracks", type=Path, help="output folder of `track`")
    parser.add_argument("first", help="id of the sensor that is interpolated")
    parser.add_argument("second", help="id of the sensor that is compared")
    parser.add_argument("--within-km", type=float, default=3.0, help="of the middle of the first")
    options = parser.parse_args()
    rows = pl.read_parquet(options.converted / "measurements.parquet").drop_nulls("latitude_deg")
    late = offsets(options.tracks / "biases.parquet")
    print("| clocks | pairs | median | 90 % | median above 20 m/s |\n|---|---|---|---|---|")
    for name, known in (("as reported", {}), ("corrected", late)):
        apart, speed = distances(rows, options.first, options.second, options.within_km, known)
        fast = apart[speed > FAST_MPS]
        cells = [f"{np.median(apart):.1f} m", f"{np.quantile(apart, 0.9):.1f} m"]
        cells.append(f"{np.median(fast):.1f} m" if len(fast) else "-")
        print(f"| {name} | {len(apart)} | {' | '.join(cells)} |")


def offsets(path: Path) -> dict[str, float]:
    """Return the last time offset of each sensor, s."""
    biases = pl.read_parquet(path).filter(pl.col("parameter") == "time_offset_s")
    last = biases.group_by("sensor_id").agg(pl.col("estimate").sort_by("time_s").last())
    return dict(last.iter_rows())


def distances(
    rows: pl.DataFrame, first: str, second: str, within_km: float, late: dict[str, float]
) -> tuple[Floats, Floats]:
    """Return distances, m, and speeds, m/s, of pairs of positions."""
    own = rows.filter(pl.col("sensor_id") == first)
    middle = own.select(pl.col("latitude_deg", "longitude_deg").median()).row(0)
    plane = SystemPlane(*np.radians(middle).tolist())
    # Wild positions may be anywhere on the Earth.
    near = pl.all_horizontal(
        (pl.col(name) - at).abs() < 1.0
        for name, at in zip(("latitude_deg", "longitude_deg"), middle, strict=True)
    )
    paths = {
        name: dict(path_of(one, plane, late.get(name, 0.0)) for one in aircraft(rows, name, near))
        for name in (first, second)
    }
    found = [
        compared(paths[first][address], path, 1e3 * within_km)
        for address, path in paths[second].items()
        if address in paths[first] and len(paths[first][address]) > 1
    ]
    apart, speed = np.concatenate(found).T
    return apart, speed


def aircraft(rows: pl.DataFrame, sensor: str, near: pl.Expr) -> list[pl.DataFrame]:
    """Return the positions of each aircraft by a sensor."""
    own = rows.filter((pl.col("sensor_id") == sensor) & near).drop_nulls("mode_s_address")
    return own.sort("time_s").partition_by("mode_s_address", maintain_order=True)


def path_of(one: pl.DataFrame, plane: SystemPlane, late_s: float) -> tuple[str, Floats]:
    """Return an address, and rows of time, east and north."""
    east, north = plane.to_plane(
        *(np.radians(one[name].to_numpy()) for name in ("latitude_deg", "longitude_deg"))
    )
    return one["mode_s_address"][0], np.column_stack(
        [one["time_s"].to_numpy() - late_s, east, north]
    )


def compared(path: Floats, reports: Floats, within_m: float) -> Floats:
    """Return rows of distance and speed where a path surrounds a report closely enough."""
    before = np.clip(np.searchsorted(path[:, 0], reports[:, 0]) - 1, 0, len(path) - 2)
    start, end = path[before], path[before + 1]
    interval = end[:, 0] - start[:, 0]
    inside = (start[:, 0] <= reports[:, 0]) & (reports[:, 0] <= end[:, 0])
    usable = inside & (interval > 0.0) & (interval <= GAP_MAX_S)
    usable &= np.hypot(reports[:, 1], reports[:, 2]) < within_m
    start, end, reports, interval = (one[usable] for one in (start, end, reports, interval))
    share = ((reports[:, 0] - start[:, 0]) / interval)[:, None]
    there = start[:, 1:] + share * (end[:, 1:] - start[:, 1:])
    apart = np.hypot(*(there - reports[:, 1:]).T)
    return np.column_stack([apart, np.hypot(*(end - start)[:, 1:].T) / interval])


if __name__ == "__main__":
    main()
