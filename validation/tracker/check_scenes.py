"""Prints the table of validation/scenarios.md: tracks simulated scenarios and compares with truth.

::

    python -m validation.tracker.check_scenes  # every built-in scenario, and random ones
    python -m validation.tracker.check_scenes --runs 2 --random 0 \
        --filters two-stage drifting-biases my.toml

A row is one scenario and filter over all runs (seeds). `bias error² / sigma²` and `position
error² / sigma²` are 1 where the filter's sigma is right; `worst bias` is the largest error of a
final bias, in its sigmas. Positions are evaluated from two minutes after the initiation of a
track. Where a scenario has time offsets, filters without them are skipped with a warning.
"""

import argparse
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

import multiradar as mr
from multiradar.errors import FindingsError
from multiradar.estimation.filters.bank import FILTERS
from multiradar.simulation.scenario.file import builtin_names
from multiradar.toolbox.tracking.request import TrackOptions

Floats = NDArray[np.float64]

SETTLED_S = 120.0
# Evaluated by check_association.py, check_probabilistic.py, check_health.py,
# check_plausibility.py and tests.
ASSOCIATION_SCENES = (
    "crossing", "formation", "shared-code", "code-change", "shared-address", "clutter",
    "duplicated-networks", "plot-storm", "radar-jump", "u-turn-edge", "primary-only",
    "garbled-codes", "ghost-adsb", "formation-split", "unresolved",
    "newcomers", "bearings-only", "aircraft-data",
)  # fmt: skip
HEADER = (
    "scenario", "filter", "density", "range bias", "azimuth bias", "bias error² / sigma²",
    "worst bias", "position", "position error² / sigma²",
)  # fmt: skip


@dataclass(frozen=True)
class Figures:
    """Results of one run: bias errors and position errors with their sigmas."""

    biases: pl.DataFrame
    position_m: Floats
    position_sigma_m: Floats


def main() -> None:
    """Print a Markdown table of every scenario with every filter."""
    options = arguments()
    print(f"| {' | '.join(HEADER)} |\n|{'---|' * len(HEADER)}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for name, scene, density in scenes(options, Path(folder)):
            runs = [
                simulated(scene, Path(folder) / f"{name}-{run}", run) for run in range(options.runs)
            ]
            able = filters_for(runs[0], options.filters)
            for filter_name in able:
                found = [tracked(run, filter_name, density) for run in runs]
                print(f"| {' | '.join(row(name, filter_name, density, found))} |", flush=True)
            for filter_name in options.filters:
                if filter_name not in able:
                    print(f"{name}: {filter_name} does not estimate its biases", file=sys.stderr)


def arguments() -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", help="built-in names or files; all built-in ones")
    parser.add_argument(
        "--filters", nargs="+", default=list(FILTERS), choices=list(FILTERS), metavar="FILTER"
    )
    parser.add_argument("--runs", type=int, default=3, help="seeds of each scene")
    parser.add_argument("--random", type=int, default=12, help="number of random scenes")
    return parser.parse_args()


def scenes(options: argparse.Namespace, folder: Path) -> Iterator[tuple[str, str, float | None]]:
    """Yield name, argument of `simulate`, and acceleration density for `track` of each scene."""
    known = builtin_names()
    names = options.scenes or [name for name in known if name not in ASSOCIATION_SCENES]
    for name in names:
        yield Path(name).stem, name, None
    for number in range(options.random):
        text, density = random_scene(np.random.Generator(np.random.PCG64([2016, number])))
        path = folder / f"random-{number}.toml"
        path.write_text(text, encoding="utf-8")
        yield path.stem, str(path), density


def simulated(scene: str, out: Path, run: int) -> Path:
    """Simulate a run of a scenario into a new folder."""
    mr.simulate(scene, out=out, seed=None if run == 0 else 1000 + run)
    return out


def filters_for(folder: Path, names: list[str]) -> list[str]:
    """Return those of the filters that can estimate the biases of a simulated folder."""
    sensors = tomllib.loads((folder / "sensors.toml").read_text(encoding="utf-8"))["sensor"]
    timed = any(
        one.get("bias", {}).get("time_offset_s", {}).get("estimate", False) for one in sensors
    )
    delayed = any("transponder_delay_sigma_m" in one for one in sensors)
    return [
        name
        for name in names
        if (not timed or FILTERS[name].estimates_time_offsets)
        and (not delayed or FILTERS[name].estimates_delays)
    ]


def tracked(folder: Path, filter_name: str, density: float | None) -> Figures:
    """Track a simulated folder and compare with its truth."""
    unused = density is None or FILTERS[filter_name].keeps_modes
    options = TrackOptions() if density is None or unused else {"acceleration_density": density}
    out = folder / f"tracks-{filter_name}"
    try:
        mr.track(folder, folder / "sensors.toml", filter=filter_name, out=out, **options)
    except FindingsError as error:
        # Some scenes have a radar that loses a third of its plots; the run is complete.
        print(f"{folder.name}, {filter_name}: {error}", file=sys.stderr)
    run = mr.Run(out)
    tracks, biases = run.tracks, run.biases
    truth = pl.read_parquet(folder / "truth.parquet")
    true_biases = pl.read_parquet(folder / "truth_biases.parquet")
    # The last epoch ends after the scenario: the true drifted bias is unknown then.
    known = biases.filter(pl.col("time_s") <= true_biases["time_s"].max())
    last = known.filter(pl.col("epoch") == pl.col("epoch").max())
    return Figures(bias_errors(last, true_biases), *position_errors(tracks, truth))


def bias_errors(estimates: pl.DataFrame, truth: pl.DataFrame) -> pl.DataFrame:
    """Return parameter, error and sigma of bias estimates; the truth is linear between times."""
    names = ("sensor_id", "parameter")
    rows = []
    for row in estimates.iter_rows(named=True):
        own = truth.filter(*(pl.col(name) == row[name] for name in names)).sort("time_s")
        true = np.interp(row["time_s"], own["time_s"].to_numpy(), own["value"].to_numpy())
        rows.append((row["parameter"], row["estimate"] - float(true), row["sigma"]))
    schema = {"parameter": pl.String, "error": pl.Float64, "sigma": pl.Float64}
    return pl.DataFrame(rows, schema=schema, orient="row")


def position_errors(tracks: pl.DataFrame, truth: pl.DataFrame) -> tuple[Floats, Floats]:
    """Return errors (m) and sigmas (m) of the updates of settled tracks."""
    keys = ["time_s", "track_number", "sensor_id"]
    shown = truth.drop_nulls("track_number").unique(keys, maintain_order=True)
    settled = tracks.filter(
        pl.col("time_s") > pl.col("time_s").min().over("track_number") + SETTLED_S
    )
    both = settled.join(shown, on=keys, suffix="_true")
    latitude = np.radians(both["latitude_deg_true"].to_numpy())
    north = np.radians((both["latitude_deg"] - both["latitude_deg_true"]).to_numpy())
    apart = (both["longitude_deg"] - both["longitude_deg_true"]).to_numpy()
    east = np.radians(np.mod(apart + 180.0, 360.0) - 180.0)
    # Radii of curvature of WGS 84 at the aircraft.
    root = np.sqrt(1.0 - 0.00669437999014 * np.sin(latitude) ** 2)
    metres = np.hypot(
        north * 6_378_137.0 * (1.0 - 0.00669437999014) / root**3,
        east * np.cos(latitude) * 6_378_137.0 / root,
    )
    return metres, both["position_sigma_m"].to_numpy()


def row(name: str, filter_name: str, density: float | None, runs: list[Figures]) -> list[str]:
    """Return the cells of one scenario and filter."""
    biases = pl.concat([run.biases for run in runs])
    ratio = biases.select(pl.col("error") / pl.col("sigma")).to_series().to_numpy()
    metres = np.concatenate([run.position_m for run in runs])
    sigma = np.concatenate([run.position_sigma_m for run in runs])
    worst = f"{np.abs(ratio).max():.1f}" if len(ratio) else "–"
    return [
        name,
        filter_name,
        "default" if density is None else f"{density:g}",
        f"{spread(biases, 'range_offset_m'):.1f} m",
        f"{spread(biases, 'azimuth_offset_deg'):.4f}°",
        f"{np.mean(ratio**2):.2f}" if len(ratio) else "–",
        worst,
        f"{np.sqrt(np.mean(metres**2)):.1f} m",
        f"{np.mean((metres / sigma) ** 2):.2f}",
    ]


def spread(biases: pl.DataFrame, parameter: str) -> float:
    """Return the root-mean-square error of a parameter."""
    errors = biases.filter(pl.col("parameter") == parameter)["error"].to_numpy()
    return float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")


def random_scene(rng: np.random.Generator) -> tuple[str, float]:
    """Return a scenario as TOML, and the density of its aircraft's acceleration."""
    density = float(rng.choice([0.02, 0.1, 0.5]))
    radars, anchored = int(rng.integers(1, 6)), bool(rng.integers(0, 2))
    if radars == 1:
        anchored = True
    latitude, longitude = rng.uniform(-60.0, 65.0), rng.uniform(-170.0, 170.0)
    parts = [
        f"duration_s = {rng.integers(600, 1201)}",
        f"[plane]\nlatitude_deg = {latitude:.4f}\nlongitude_deg = {longitude:.4f}",
        f"[[traffic]]\ncount = {rng.integers(8, 40)}\neast_m = [-130e3, 130e3]\n"
        f"north_m = [-130e3, 130e3]\nheight_m = [4000, 12000]\nspeed_mps = [120, 260]\n"
        f"acceleration_density = {density}\nequipped_share = {rng.uniform(0.3, 1.0):.2f}\n"
        "height_step_m = 7.62",
    ]
    parts += [radar(f"radar-{number}", rng, anchored) for number in range(radars)]
    if anchored:
        parts.append(
            f'[[sensor]]\nid = "adsb"\nkind = "adsb"\ninterval_s = {rng.uniform(1.0, 5.0):.1f}\n'
            f"position_sigma_m = {rng.uniform(10.0, 60.0):.0f}\ndetection_probability = 0.8"
        )
    text = "\n\n".join(parts) + "\n"
    tomllib.loads(text)
    return text, density


def radar(name: str, rng: np.random.Generator, anchored: bool) -> str:
    """Return a random radar as TOML; a gain only where it is observable."""
    east, north = rng.uniform(-110e3, 110e3, 2)
    drift = float(rng.choice([0.0, 0.0, 0.1]))
    gap = rng.uniform(100.0, 500.0)
    lines = [
        f'[[sensor]]\nid = "{name}"\neast_m = {east:.0f}\nnorth_m = {north:.0f}',
        f"height_m = {rng.uniform(0.0, 1500.0):.0f}",
        f"rotation_period_s = {rng.uniform(3.0, 12.0):.2f}",
        f"range_sigma_m = {rng.uniform(15.0, 80.0):.0f}",
        f"azimuth_sigma_deg = {rng.uniform(0.03, 0.12):.3f}",
        f"range_max_m = {rng.uniform(200e3, 400e3):.0f}",
        f"detection_probability = {rng.uniform(0.7, 1.0):.2f}",
        f"gaps_s = [[{gap:.0f}, {gap + rng.uniform(20.0, 150.0):.0f}]]",
        f"bias.range_offset_m = {{ value = {rng.normal(0.0, 300.0):.0f}, drift = {drift} }}",
        f"bias.azimuth_offset_deg = {{ value = {rng.normal(0.0, 0.25):.3f}, "
        f"drift = {drift * 0.02:.4f} }}",
    ]
    if anchored and rng.uniform() < 0.5:
        lines.append(f"bias.range_gain = {rng.normal(0.0, 0.001):.5f}")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
