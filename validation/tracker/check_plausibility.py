"""Prints guide/plausibility.md: implausible ADS-B reports in the scenario `ghost-adsb`.

::

    python -m validation.tracker.check_plausibility  # two-stage and imm
    python -m validation.tracker.check_plausibility blom ci  # these filters

Each filter tracks the scenario with its ADS-B, with the same reports declared as multilateration,
which is not checked, and with radars alone. An error is the distance of an update from the truth.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import polars as pl

SCENE = "ghost-adsb"
#: Track number, start of wrong reports, start of evaluation, s.
CASES = {
    "jump by 5 km for five minutes": (1, 300.0, 300.0),
    "drift away by 25 m/s": (2, 300.0, 300.0),
    "1.5 km off from the start": (3, 0.0, 60.0),
}
GHOST_SINCE_S = 200.0
HEADER = (
    "filter", "reports", "flagged after", "worst error", "RMS", "worst, accepted", "RMS, accepted",
    "worst, radars alone", "RMS, radars alone",
)  # fmt: skip
EARTH_RADIUS_M = 6_371_000.0


def main() -> None:
    """Print a Markdown table, and what else was flagged."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("filters", nargs="*", default=["two-stage", "imm"])
    print(f"| {' | '.join(HEADER)} |\n|{'---|' * len(HEADER)}", flush=True)
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made) / SCENE
        multiradar("simulate", SCENE, "--out", str(folder))
        believe(folder)
        truth = pl.read_parquet(folder / "truth.parquet")
        for name in parser.parse_args().filters:
            show(name, folder, truth)


def believe(folder: Path) -> None:
    """Write the scenario again, with reports that are not checked for plausibility."""
    rows = pl.read_parquet(folder / "measurements.parquet")
    rows.with_columns(pl.col("kind").str.replace("adsb", "mlat")).write_parquet(
        folder / "believed.parquet"
    )
    sensors = (folder / "sensors.toml").read_text(encoding="utf-8")
    changed = sensors.replace('kind = "adsb"', 'kind = "mlat"')
    (folder / "believed.toml").write_text(changed, encoding="utf-8")


def show(name: str, folder: Path, truth: pl.DataFrame) -> None:
    """Track with a filter, and print its rows."""
    doubted = track(folder, name, "measurements.parquet", "sensors.toml", truth)
    believed = track(folder, name, "believed.parquet", "believed.toml", truth)
    alone = track(folder, name, "measurements.parquet", "sensors.toml", truth, "--kinds", "radar")
    for case, (aircraft, wrong_s, since_s) in CASES.items():
        first = doubted.filter((pl.col("aircraft") == aircraft) & pl.col("adsb_implausible"))
        after = f"{first['time_s'].to_numpy().min() - wrong_s:.0f} s"
        cells = [
            cell for run in (doubted, believed, alone) for cell in errors(run, aircraft, since_s)
        ]
        print(f"| {' | '.join([name, case, after, *cells])} |", flush=True)
    ghost = doubted.filter(pl.col("aircraft").is_null() & pl.col("adsb_implausible"))
    after = f"{ghost['time_s'].to_numpy().min() - GHOST_SINCE_S:.0f} s"
    print(f"| {name} | of an aircraft that no radar sees | {after} |{' – |' * 6}", flush=True)
    known = [one for one, _, _ in CASES.values()]
    others = doubted.filter(pl.col("adsb_implausible") & ~pl.col("aircraft").is_in(known))
    if len(others):
        print(f"flagged though right: {others['aircraft'].unique().to_list()}", file=sys.stderr)


def errors(tracks: pl.DataFrame, aircraft: int, since_s: float) -> list[str]:
    """Return the worst error and the root mean square of an aircraft as text."""
    mine = tracks.filter((pl.col("aircraft") == aircraft) & (pl.col("time_s") >= since_s))
    error_m = mine["error_m"].to_numpy()
    return [f"{error_m.max():.0f} m", f"{np.sqrt(np.mean(error_m**2)):.0f} m"]


def track(
    folder: Path, name: str, rows: str, sensors: str, truth: pl.DataFrame, *options: str
) -> pl.DataFrame:
    """Return the updates with the aircraft of their plots and their errors."""
    with tempfile.TemporaryDirectory() as made:
        out = Path(made) / "tracks"
        multiradar(
            "track", str(folder / rows), "--sensors", str(folder / sensors), "--filter", name,
            "--out", str(out), *options,
        )  # fmt: skip
        tracks = pl.read_parquet(out / "tracks.parquet")
    keys = ["time_s", "sensor_id"]
    known = truth.select(
        *keys, pl.col("track_number").alias("aircraft"), pl.col("latitude_deg").alias("true_lat"),
        pl.col("longitude_deg").alias("true_lon"),
    ).unique(keys, keep="none")  # fmt: skip
    east = (pl.col("longitude_deg") - pl.col("true_lon")) * pl.col("true_lat").radians().cos()
    north = pl.col("latitude_deg") - pl.col("true_lat")
    error_m = (east**2 + north**2).sqrt().radians() * EARTH_RADIUS_M
    return tracks.join(known, on=keys).with_columns(error_m.alias("error_m"))


def multiradar(*command: str) -> None:
    """Run a command."""
    done = subprocess.run(
        [sys.executable, "-m", "multiradar", *command], capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise SystemExit(f"multiradar {' '.join(command)}: {done.stderr.strip()}")


if __name__ == "__main__":
    main()
