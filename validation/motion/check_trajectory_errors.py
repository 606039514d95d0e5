"""Prints the errors of bundles and tracks of whole scenarios: docs/howto/trajectory-service.md.

::

    python -m validation.motion.check_trajectory_errors  # four scenarios, some minutes
    python -m validation.motion.check_trajectory_errors --duration 600 rotating-gaps

Scenarios of `multiradar simulate` are tracked by `track --trajectories` with unknown biases. The
errors of bundle and track at the same plots are compared from 150 s on, when the biases are known.
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

import multiradar as mr

#: Scenarios with their filter.
SCENES = {
    "manoeuvring-traffic": "imm",
    "rotating-gaps": "imm",
    "one-radar-adsb": "imm",
    "late-clocks": "two-stage",
}
SETTLED_S = 150.0
_RADIUS_M = 6_371_000.0

Floats = NDArray[np.float64]


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--duration", type=float, default=420.0, help="of each scene, s")
    given = parser.parse_args()
    print("| scenario | bundle: median, RMS | track | error² / sigma² | reinitialised |")
    print("|---|---|---|---|---|")
    for scene in given.scenes:
        with tempfile.TemporaryDirectory() as folder:
            place = Path(folder)
            mr.simulate(scene, out=place / "scene", duration_s=given.duration)
            mr.track(
                place / "scene" / "measurements.parquet",
                place / "scene" / "sensors.toml",
                filter=SCENES.get(scene, "imm"),
                out=place / "out",
                trajectories=True,
            )
            print(_row(scene, place), flush=True)


def _row(scene: str, place: Path) -> str:
    truth = pl.read_parquet(place / "scene" / "truth.parquet").sort("time_s")
    reconstructed = pl.read_parquet(place / "out" / "trajectories.parquet").filter(
        pl.col("reason").is_null()
    )
    tracks = pl.read_parquet(place / "out" / "tracks.parquet")
    columns = ["track_id", "time_s", "track_number", "latitude_deg", "longitude_deg"]
    both = reconstructed.join(tracks.select(columns), on=["track_id", "time_s"], suffix="_track")
    since = both["time_s"].min()
    assert isinstance(since, float)
    both = both.filter(pl.col("time_s") > since + SETTLED_S)
    errors = np.concatenate(
        [
            _errors(of, truth.filter(track_number=of["track_number"][0]))
            for of in both.partition_by("track_number")
        ]
    )
    figures = json.loads((place / "out" / "report.json").read_text())["figures"]["trajectories"]
    bundle, track, sigma = errors.T
    cells = [
        f"`{scene}`",
        f"{np.median(bundle):.0f} m, {_rms(bundle):.0f} m",
        f"{np.median(track):.0f} m, {_rms(track):.0f} m",
        f"{np.mean((bundle / sigma) ** 2):.1f}",
        f"{figures['restarts']}",
    ]
    return f"| {' | '.join(cells)} |"


def _errors(reconstructed: pl.DataFrame, truth: pl.DataFrame) -> Floats:
    """Return errors of bundle and track, and the sigma of the bundle, (n, 3), m."""
    time_s = reconstructed["time_s"].to_numpy()
    latitude, longitude = (
        np.interp(time_s, truth["time_s"].to_numpy(), truth[name].to_numpy())
        for name in ("latitude_deg", "longitude_deg")
    )
    found = []
    for suffix in ("", "_track"):
        north = np.radians(reconstructed[f"latitude_deg{suffix}"].to_numpy() - latitude)
        east = np.radians(reconstructed[f"longitude_deg{suffix}"].to_numpy() - longitude)
        found.append(_RADIUS_M * np.hypot(north, east * np.cos(np.radians(latitude))))
    return np.column_stack([*found, reconstructed["position_sigma_m"].to_numpy()])


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


if __name__ == "__main__":
    main()
