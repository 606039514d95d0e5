"""Prints the table of regions of validation/forecasts.md: how often they contain the aircraft.

::

    python -m validation.motion.check_regions  # built-in scenarios, random traffic
    python -m validation.motion.check_regions --flights flights.json.gz --runs 5 --only-random
    python -m validation.motion.check_regions --untaught  # regions of the covariance alone

Every scenario is tracked from its start, without knowledge of its traffic. Every eight seconds each
confirmed track updated since is forecast, like `track --forecasts 8`, and compared with the true
position: fraction inside the 95 % region, and median error. Random traffic, and flights from files
of ADS-B reports, are detected by radars drawn at random (`validation.tracker.unseen_recordings`).
Identity is known, so that tracks are those of their aircraft.
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar import wire
from multiradar.estimation.gaussian import normalised_squared
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.forecast.forecast_calibration import calibration_for
from multiradar.tracking.forecast.region_sizes import HORIZONS_S
from multiradar.tracking.forecast.regions import gaussian_factor
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.outputs import StateSample
from multiradar.tracking.settings import TrackingSettings
from validation.tracker import unseen_recordings as unseen

Floats = NDArray[np.float64]

SCENES = (
    "rotating-gaps", "manoeuvring-traffic", "coupled-motion", "drifting-biases", "climbs",
    "report-1-6",
)  # fmt: skip
PROBABILITY = 0.95
#: Positions are not interpolated across longer gaps, s.
GAP_S = 15.0
ROWS_AT_ONCE = 8192


@dataclass(frozen=True)
class Recording:
    """Input of the tracker, and the true positions."""

    name: str
    measurements: pl.DataFrame
    truth: pl.DataFrame
    sensors: SensorTable


class Ways:
    """Positions of each aircraft on the plane of the tracker, by track number."""

    def __init__(self, truth: pl.DataFrame, plane: SystemPlane) -> None:
        self._ways: dict[int, tuple[Floats, Floats, Floats]] = {}
        known = truth.drop_nulls("track_number").sort("track_number", "time_s")
        for (number,), rows in known.group_by("track_number", maintain_order=True):
            time_s, first = np.unique(rows["time_s"].to_numpy(), return_index=True)
            degrees = (rows[name].to_numpy()[first] for name in ("latitude_deg", "longitude_deg"))
            east_m, north_m = plane.to_plane(*(np.radians(one) for one in degrees))
            self._ways[int(str(number))] = time_s, east_m, north_m

    def at(self, number: int, time_s: Floats) -> Floats:
        """Return positions (k, 2), NaN where unknown."""
        if number not in self._ways:
            return np.full((len(time_s), 2), np.nan)
        known_s, east_m, north_m = self._ways[number]
        after = np.clip(np.searchsorted(known_s, time_s), 1, len(known_s) - 1)
        sure = (time_s >= known_s[0]) & (time_s <= known_s[-1])
        sure &= known_s[after] - known_s[after - 1] <= GAP_S
        there = [np.interp(time_s, known_s, one) for one in (east_m, north_m)]
        return np.where(sure[:, None], np.column_stack(there), np.nan)


def main() -> None:
    """Print a Markdown table."""
    options = arguments()
    ahead = ", ".join(f"{one:g} s" for one in HORIZONS_S)
    print(f"| scenario | filter | forecasts | inside: {ahead} | error (median), m: {ahead} |")
    print("|---|---|---|---|---|", flush=True)
    shares: dict[str, list[Floats]] = {}
    for recording in recordings(options):
        for name in options.filters:
            settings = TrackingSettings(filter_name=name)
            inside, error_m = evaluate_regions(recording, settings, taught=not options.untaught)
            share = np.nanmean(inside, axis=0)
            shares.setdefault(name, []).append(share)
            cells = (
                recording.name, f"`{name}`", str(len(inside)), in_percent(share),
                ", ".join(f"{one:.0f}" for one in np.nanmedian(error_m, axis=0)),
            )  # fmt: skip
            print(f"| {' | '.join(cells)} |", flush=True)
    for name, found in shares.items():
        near = np.mean(np.abs(np.array(found) - PROBABILITY) <= 0.02, axis=0)
        print(f"\n`{name}`: mean {in_percent(np.mean(found, axis=0))}; within 2 % of 95 % in "
              f"{in_percent(near)} of {len(found)} recordings")  # fmt: skip


def in_percent(shares: Floats) -> str:
    """Return fractions as text."""
    return ", ".join(f"{100.0 * one:.1f}" for one in shares)


def arguments() -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--filters", nargs="+", default=["two-stage", "imm"])
    parser.add_argument("--flights", type=Path, help="ADS-B reports; random traffic without")
    parser.add_argument("--runs", type=int, default=3, help="recordings drawn at random")
    parser.add_argument("--first", type=int, default=200, help="seed of the first")
    parser.add_argument("--minutes", type=float, default=40.0)
    parser.add_argument("--only-random", action="store_true", help="no built-in scenes")
    parser.add_argument("--untaught", action="store_true", help="learn nothing")
    return parser.parse_args()


def recordings(options: argparse.Namespace) -> Iterator[Recording]:
    """Make the recordings."""
    with tempfile.TemporaryDirectory() as folder:
        for name in () if options.only_random else SCENES:
            made = Path(folder) / name
            asked = (name, "--duration", str(60.0 * options.minutes), "--out", str(made))
            command = [sys.executable, "-m", "multiradar", "simulate", *asked]
            subprocess.run(command, check=True, capture_output=True)
            measurements, truth = (
                pl.read_parquet(made / f"{one}.parquet") for one in ("measurements", "truth")
            )
            sensors = load_sensor_table(made / "sensors.toml")
            yield Recording(f"`{name}`", measurements, truth, sensors)
        flights = [] if options.flights is None else unseen.read_flights(options.flights)
        for seed in range(options.first, options.first + options.runs):
            one = unseen.recording("", seed, flights, 60.0 * options.minutes)
            path = Path(folder) / f"{seed}.toml"
            path.write_text(one.sensors, encoding="utf-8")
            what = "flights" if flights else "random"
            sensors = load_sensor_table(path)
            yield Recording(f"{what}, seed {seed}", one.measurements, one.truth, sensors)


def evaluate_regions(
    recording: Recording, settings: TrackingSettings, *, taught: bool
) -> tuple[Floats, Floats]:
    """Return whether each region contains its aircraft, and the error: (n, horizons)."""
    measurements = recording.measurements.filter(pl.col("kind") == "radar")
    batch, _ = wire.measurement_batch(measurements, recording.sensors)
    engine = Engine(recording.sensors, settings, sampling=Sampling.ALL)
    ways, calibration = Ways(recording.truth, engine.plane), calibration_for(settings)
    number: dict[int, int] = {}
    inside, error_m = [np.empty((0, len(HORIZONS_S)))], [np.empty((0, len(HORIZONS_S)))]
    pieces = [
        engine.push(batch.select(slice(first, first + ROWS_AT_ONCE)))
        for first in range(0, len(batch), ROWS_AT_ONCE)
    ]
    for output in (*pieces, engine.flush()):
        updates = output.updates
        number |= dict(zip(updates.track_id.tolist(), updates.track_number.tolist(), strict=True))
        for part in calibration.parts(output):
            if part.sample is None or not len(part.sample.states):
                continue
            plan = calibration.scores.plan(HORIZONS_S, PROBABILITY)
            if not taught:
                known, single = np.ones(len(HORIZONS_S), np.bool_), gaussian_factor(PROBABILITY)
                plan = plan._replace(
                    motion=calibration.family.first,
                    calibrated=known,
                    factor=np.full(len(HORIZONS_S), single),
                )
            found = [
                calibration.forecast_by(plan, part.sample.states, place, HORIZONS_S)
                for place in range(len(part.sample.states))
            ]
            off = there(part.sample, ways, number) - np.array([one[0] for one in found])
            squared = normalised_squared(off, np.array([one[1] for one in found]))
            held = squared <= np.array([one[2] for one in found])
            inside.append(np.where(np.isnan(squared), np.nan, held))
            error_m.append(np.hypot(off[..., 0], off[..., 1]))
    return np.concatenate(inside), np.concatenate(error_m)


def there(sample: StateSample, ways: Ways, number: dict[int, int]) -> Floats:
    """Return the true positions of a sample at all horizons, (n, horizons, 2)."""
    states = zip(sample.states.track_id.tolist(), sample.states.time_s.tolist(), strict=True)
    return np.array([ways.at(number[one], time_s + HORIZONS_S) for one, time_s in states])


if __name__ == "__main__":
    main()
