"""Prints the README's table of filters: tracks a converted recording with each of them.

::

    python -m validation.peers.compare_filters converted examples/sensors-vid-sample.toml \
        examples/vid-sample/truth.json
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import polars as pl

from multiradar.estimation.filters.bank import FILTERS
from multiradar.toolbox.evaluation.accuracy import position_accuracy


def main() -> None:
    """Track with every filter and print one line each."""
    options = arguments()
    converted, sensors = options.converted, options.sensors
    truth = json.loads(options.truth.read_text())
    reports = pl.read_parquet(converted / "measurements.parquet").filter(kind="adsb")
    for name in FILTERS:
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "tracks"
            command = Path(sys.executable).with_name("multiradar")
            subprocess.run(
                [command, "track", converted, "--sensors", sensors, "--kinds", "radar",
                 "--filter", name, "--out", out],
                check=True, capture_output=True,
            )  # fmt: skip
            metres, degrees = errors(pl.read_parquet(out / "biases.parquet"), truth["radars"])
            accuracy = position_accuracy(reports, pl.read_parquet(out / "tracks.parquet"))
        if accuracy is None:
            raise SystemExit(f"{converted} holds no ADS-B report that a track covers")
        print(
            f"| `{name}` | {metres:.1f} m | {degrees:.4f}° | {accuracy.median_m:.0f} m "
            f"| {accuracy.rms_m:.0f} m |"
        )


def arguments() -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("converted", type=Path, help="folder that `multiradar convert` made")
    parser.add_argument("sensors", type=Path, help="sensors.toml of its radars")
    parser.add_argument("truth", type=Path, help="truth.json with their true biases")
    return parser.parse_args()


def errors(biases: pl.DataFrame, radars: list[dict[str, float]]) -> tuple[float, float]:
    """Return the largest final errors of range bias (m) and azimuth bias (degrees)."""
    last = biases.filter(pl.col("epoch") == pl.col("epoch").max())
    found = {
        (row["sensor_id"], row["parameter"]): row["estimate"] for row in last.iter_rows(named=True)
    }
    names = [f"{radar['source']}-{radar['sensor']}" for radar in radars]
    ranges = [
        found[name, "range_offset_m"] - radar["bias_range"]
        for name, radar in zip(names, radars, strict=True)
    ]
    azimuths = [
        found[name, "azimuth_offset_deg"] - radar["bias_azimuth_deg"]
        for name, radar in zip(names, radars, strict=True)
    ]
    return float(np.abs(ranges).max()), float(np.abs(azimuths).max())


if __name__ == "__main__":
    main()
