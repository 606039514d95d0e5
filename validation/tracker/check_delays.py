"""Prints the tables of docs/guide/transponders.md on delays of transponders.

::

    python -m validation.tracker.check_delays            # 4 seeds; 6 min of processor time
    python -m validation.tracker.check_delays --runs 12

Simulates `transponder-delays`, with and without its ADS-B, and tracks it with the delays of the
aircraft estimated and not (the key `transponder_delay_sigma_m` removed from `sensors.toml`).
`error² / sigma²` is 1 where a sigma is right: of the range and azimuth offsets at the end, and of
positions from two minutes after the initiation of a track.
"""

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

import multiradar as mr
from validation.tracker.check_scenes import bias_errors, position_errors, simulated

Floats = NDArray[np.float64]

SCENE = "transponder-delays"
FILTERS = ("two-stage", "imm")
KEY = "transponder_delay_sigma_m"
OF_PRIMARY = "primary"


@dataclass(frozen=True)
class Found:
    """Results of one run; delays are empty where none is estimated."""

    range_offset: pl.DataFrame
    azimuth_offset: pl.DataFrame
    position_m: Floats
    position_sigma_m: Floats
    residual: float
    delays: pl.DataFrame


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=4, help="seeds")
    runs = parser.parse_args().runs
    kept: dict[tuple[str, str], list[Found]] = {}
    print(
        "| sensors | filter | delays | range offset, RMS error | sigma | error² / sigma² | "
        "azimuth error² / sigma² | range residual² / sigma² | position RMS | error² / sigma² |"
    )
    print(f"|{'---|' * 10}")
    with tempfile.TemporaryDirectory() as folder:
        made = [simulated(SCENE, Path(folder) / f"run-{run}", run) for run in range(runs)]
        for kinds in ("radar,adsb", "radar"):
            for name in FILTERS:
                for on in (False, True):
                    found = [tracked(one, name, kinds, on=on) for one in made]
                    print(f"| {' | '.join(row(kinds, name, found, on=on))} |", flush=True)
                    if on:
                        kept[kinds, name] = found
    print(
        "\n| sensors | filter | aircraft | delay, RMS error | sigma | error² / sigma² | scatter |"
    )
    print(f"|{'---|' * 7}")
    for (kinds, name), found in kept.items():
        print(f"| {' | '.join(delay_row(kinds, name, found))} |")


def tracked(folder: Path, name: str, kinds: str, *, on: bool) -> Found:
    """Track a simulated folder and compare with its truth."""
    with tempfile.TemporaryDirectory() as made:
        out, sensors = Path(made) / "tracks", Path(made) / "sensors.toml"
        lines = (folder / "sensors.toml").read_text(encoding="utf-8").splitlines()
        sensors.write_text(
            "\n".join(line for line in lines if on or not line.startswith(KEY)), encoding="utf-8"
        )
        mr.track(folder, sensors, filter=name, kinds=kinds.split(","), out=out)
        tracks = pl.read_parquet(out / "tracks.parquet")
        biases = pl.read_parquet(out / "biases.parquet")
        health = pl.read_parquet(out / "health.parquet")
        delays = pl.read_parquet(out / "aircraft_delays.parquet") if on else pl.DataFrame()
    truth = pl.read_parquet(folder / "truth_biases.parquet")
    known = biases.filter(pl.col("time_s") <= truth["time_s"].max())
    errors = bias_errors(known.filter(pl.col("epoch") == pl.col("epoch").max()), truth)
    if on:
        delays = delays.join(
            pl.read_parquet(folder / "truth_delays.parquet"), "track_number", suffix="_true"
        )
    last = health.group_by("sensor_id", maintain_order=True).last()
    secondary = last.filter(pl.col("sensor_id") != OF_PRIMARY)
    return Found(
        errors.filter(pl.col("parameter") == "range_offset_m"),
        errors.filter(pl.col("parameter") == "azimuth_offset_deg"),
        *position_errors(tracks, pl.read_parquet(folder / "truth.parquet")),
        float(np.mean(secondary["range_sigma_ratio"].to_numpy() ** 2)),
        delays,
    )


def row(kinds: str, name: str, found: list[Found], *, on: bool) -> list[str]:
    """Return the cells of a filter, delays estimated or not."""
    ranges = pl.concat([one.range_offset for one in found])
    azimuths = pl.concat([one.azimuth_offset for one in found])
    error = np.concatenate([one.position_m for one in found])
    sigma = np.concatenate([one.position_sigma_m for one in found])
    return [
        "radar, ADS-B" if "adsb" in kinds else "radar",
        f"`{name}`",
        "estimated" if on else "not",
        f"{rms(ranges['error']):.1f} m",
        f"{rms(ranges['sigma']):.1f} m",
        f"{ratio(ranges):.2f}",
        f"{ratio(azimuths):.2f}",
        shown(float(np.mean([one.residual for one in found]))),
        f"{np.sqrt(np.mean(error**2)):.1f} m",
        f"{np.mean((error / sigma) ** 2):.2f}",
    ]


def delay_row(kinds: str, name: str, found: list[Found]) -> list[str]:
    """Return the cells of the delays estimated by a filter."""
    delays = pl.concat([one.delays for one in found])
    error = (delays["delay_m"] - delays["delay_m_true"]).to_numpy()
    sigma = delays["sigma_m"].to_numpy()
    return [
        "radar, ADS-B" if "adsb" in kinds else "radar",
        f"`{name}`",
        f"{len(delays)}",
        f"{np.sqrt(np.mean(error**2)):.1f} m",
        f"{np.sqrt(np.mean(sigma**2)):.1f} m",
        f"{np.mean((error / sigma) ** 2):.2f}",
        f"{np.std(delays['delay_m_true'].to_numpy()):.1f} m",
    ]


def shown(value: float) -> str:
    """Return a number, or a dash where a radar had too few plots for its noise."""
    return "–" if np.isnan(value) else f"{value:.2f}"


def rms(values: pl.Series) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values.to_numpy() ** 2)))


def ratio(errors: pl.DataFrame) -> float:
    """Return the mean of error² / sigma²."""
    return float(np.mean((errors["error"] / errors["sigma"]).to_numpy() ** 2))


if __name__ == "__main__":
    main()
