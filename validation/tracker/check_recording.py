"""Prints the table of docs/validation/real-radars.md: identity, ground and speeds of a recording.

::

    multiradar convert asterix RECORDING.ast --out converted
    python -m validation.tracker.check_recording converted sensors.toml

A row for each filter: measurements of radars that could not be located; tracks that were confirmed
at some time; updates by a measurement with another Mode S address than the track; measurements on
the ground, and those of them that updated a track of their own address; speeds of tracks on the
ground, median, 99 % and largest; confirmed updates above 350 m/s. It needs no reference.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import polars as pl

FILTERS = ("two-stage", "imm")
#: Faster than airliners.
FAST_MPS = 350.0
#: Quantiles of the speeds on the ground.
SHARES = (0.5, 0.99, 1.0)
HEADER = (
    "filter", "not located", "tracks, confirmed", "updates by another address",
    "on the ground, own track", "speed on the ground: median, 99 %, largest",
    "confirmed above 350 m/s",
)  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("converted", type=Path, help="output folder of `convert`")
    parser.add_argument("sensors", type=Path, help="sensors file")
    parser.add_argument("--filters", nargs="+", default=FILTERS)
    options = parser.parse_args()
    print(f"| {' | '.join(HEADER)} |\n|{'---|' * len(HEADER)}")
    for name in options.filters:
        with tempfile.TemporaryDirectory() as made:
            out = Path(made) / "tracks"
            tracked(options.converted, options.sensors, name, out)
            print(f"| {' | '.join((f'`{name}`', *cells(options.converted, out)))} |", flush=True)


def tracked(converted: Path, sensors: Path, name: str, out: Path) -> None:
    """Track the radars of a recording; status 1 (a diagnosis) keeps its results, too."""
    command = [
        "track", str(converted), "--sensors", str(sensors), "--filter", name, "--out", str(out)
    ]  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-m", "multiradar", *command], capture_output=True, text=True, check=False
    )
    if not (out / "report.json").exists():
        raise SystemExit(f"multiradar {' '.join(command)}: {done.stderr.strip()}")


def cells(converted: Path, out: Path) -> tuple[str, ...]:
    """Return the figures of a run as text."""
    figures = json.loads((out / "report.json").read_text(encoding="utf-8"))["figures"]
    tracks = pl.read_parquet(out / "tracks.parquet")
    measured = pl.read_parquet(converted / "measurements.parquet")
    other = tracks.filter(pl.col("measured_mode_s_address") != pl.col("mode_s_address"))
    on_ground = measured.filter(pl.col("on_ground"))
    own = on_ground.join(
        tracks.select("time_s", "sensor_id", mode_s_address="measured_mode_s_address"),
        on=["time_s", "sensor_id", "mode_s_address"],
        how="semi",
    )
    speed = tracks.filter(pl.col("on_ground"))["speed_mps"].to_numpy()
    fast = tracks.filter((pl.col("state") == "confirmed") & (pl.col("speed_mps") > FAST_MPS))
    return (
        str(figures["measurements_by_outcome"].get("unlocatable", 0)),
        f"{figures['tracks']}, {figures['tracks_confirmed']}",
        f"{other.height} of {tracks.height} ({other['track_id'].n_unique()} tracks)",
        f"{own.height} of {on_ground.height}",
        "{:.1f}, {:.1f}, {:.1f} m/s".format(*np.quantile(speed, SHARES)) if len(speed) else "–",
        str(fast.height),
    )


if __name__ == "__main__":
    main()
