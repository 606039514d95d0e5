"""Prints the tables of docs/guide/health.md on the health of the sensors.

::

    python -m validation.tracker.check_health  # every built-in scenario
    python -m validation.tracker.check_health radar-jump --filters imm
    python -m validation.tracker.check_health --recording converted \
        --sensors examples/sensors-vid-sample.toml

The first two simulate scenarios and list alarms, the error of the detection probability, and when
jumps were detected. The third inserts jumps of 150 m and 0.3° into a recording without any,
one radar and one jump at a time: ten minutes before its end or halfway, or at `--at`.
"""

import argparse
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from multiradar import wire
from multiradar.estimation.filters.bank import FILTERS
from multiradar.estimation.measurement.sensors import PARAMETER_TIME_OFFSET, SensorTable
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame
from multiradar.simulation.scenario.file import builtin_names, builtin_scenario
from multiradar.simulation.scenario.model import Scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.health.health_records import HealthRecords
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import BiasRecords, EngineOutput, TrackUpdates
from multiradar.tracking.settings import TrackingSettings

#: Jumps inserted into a recording: range (m) and azimuth (degrees).
JUMPS = ((150.0, 0.0), (-150.0, 0.0), (0.0, 0.3), (0.0, -0.3))
AFTER_S = (30.0, 60.0)


@dataclass(frozen=True)
class Run:
    """Results of tracking."""

    table: SensorTable
    health: pl.DataFrame
    biases: pl.DataFrame
    updates: TrackUpdates
    counts: dict[str, int]

    def alarms(self) -> list[tuple[float, str, str]]:
        """Return time, sensor and name of every alarm raised."""
        before: dict[str, set[str]] = {}
        found = []
        for time_s, name, text in self.health.select("time_s", "sensor_id", "alarms").iter_rows():
            now = set(text.split(",")) - {""}
            found += [(time_s, name, alarm) for alarm in sorted(now - before.get(name, set()))]
            before[name] = now
        return found

    def bias(self, sensor: str, parameter: str, time_s: float) -> tuple[float, float]:
        """Return an estimate and its sigma at the first end of an epoch from a time on."""
        row = self.biases.filter(
            (pl.col("sensor_id") == sensor)
            & (pl.col("parameter") == parameter)
            & (pl.col("time_s") >= time_s)
        ).row(0, named=True)
        return row["estimate"], row["sigma"]


def tracked(
    batch: MeasurementBatch,
    table: SensorTable,
    settings: TrackingSettings,
    *,
    rows: int | None = None,
    workers: int = 1,
) -> Run:
    """Track measurements in batches."""
    engine = Engine(table, settings, workers)
    size = rows or max(len(batch), 1)
    outputs: list[EngineOutput] = [
        engine.push(batch.select(slice(start, start + size)))
        for start in range(0, len(batch), size)
    ]
    outputs.append(engine.flush())
    engine.close()
    return Run(
        table,
        wire.health_frame(HealthRecords.concatenate([one.health for one in outputs]), table),
        wire.biases_frame(BiasRecords.concatenate([one.biases for one in outputs]), table),
        TrackUpdates.concatenate([one.updates for one in outputs]),
        engine.counts,
    )


def simulated(scene: Scenario, seed: int | None = None) -> tuple[MeasurementBatch, SensorTable]:
    """Simulate a scenario as `multiradar simulate` does."""
    seen = observe(
        scene, np.random.Generator(np.random.PCG64(scene.seed if seed is None else seed))
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sensors.toml"
        path.write_text(sensors_text(scene), encoding="utf-8")
        table = load_sensor_table(path)
    batch, _ = wire.measurement_batch(measurements_frame(scene, seen), table)
    return batch, table


def jumped(
    frame: pl.DataFrame, sensor: str, time_s: float, jump: tuple[float, float]
) -> pl.DataFrame:
    """Return measurements in which a radar jumps at a time."""
    hit = (pl.col("sensor_id") == sensor) & (pl.col("time_s") >= time_s)
    range_m, azimuth_deg = pl.col("range_m"), pl.col("azimuth_deg")
    return frame.with_columns(
        range_m=pl.when(hit).then(range_m + jump[0]).otherwise(range_m),
        azimuth_deg=pl.when(hit).then((azimuth_deg + jump[1]) % 360.0).otherwise(azimuth_deg),
    )


def main() -> None:
    """Print the tables."""
    options = arguments()
    if options.recording is not None:
        print("| filter | radar | jump | found after | in scans | other alarms |")
        print("|---|---|---|---|---|---|")
        for line in put_in(options):
            print(line, flush=True)
        return
    print("| scene | filter | detection off by | alarms that began |\n|---|---|---|---|")
    for name in options.scenes or builtin_names():
        scene = builtin_scenario(name)
        batch, table = simulated(scene)
        timed = (table.parameter_kind == PARAMETER_TIME_OFFSET).any()
        for filter_name in options.filters:
            if timed and not FILTERS[filter_name].estimates_time_offsets:
                continue
            run = tracked(batch, table, TrackingSettings(filter_name=filter_name))
            print(f"| `{name}` | `{filter_name}` | {_detection(scene, run)} | {_said(run)} |")
            for line in _jumps(scene, run):
                print(f"| | | | {line} |", flush=True)


def put_in(options: argparse.Namespace) -> Iterator[str]:
    """Insert jumps into the radar plots of a recording and yield a line for each."""
    table = load_sensor_table(options.sensors)
    frame = pl.read_parquet(options.recording / "measurements.parquet").filter(
        pl.col("kind") == "radar"
    )
    frame = frame.sort("time_s", maintain_order=True)
    first_s, last_s = float(frame["time_s"][0]), float(frame["time_s"][-1])
    time_s = options.at or np.floor(max(last_s - 600.0, 0.5 * (first_s + last_s)))
    radars = sorted(set(frame["sensor_id"].to_list()))
    for filter_name in options.filters:
        settings = TrackingSettings(filter_name=filter_name)
        for sensor in radars:
            period_s = float(table.rotation_period_s[table.ids.index(sensor)])
            for jump in JUMPS:
                batch, _ = wire.measurement_batch(jumped(frame, sensor, time_s, jump), table)
                alarms = tracked(batch, table, settings).alarms()
                mine = [at for at, name, what in alarms if (name, what) == (sensor, "bias_jump")]
                found = f"{mine[0] - time_s:.0f} s | {(mine[0] - time_s) / period_s:.1f}"
                others = len(alarms) - len(mine[:1])
                shown = f"{jump[0]:+.0f} m" if jump[0] else f"{jump[1]:+.1f}°"
                yield (
                    f"| `{filter_name}` | {sensor} | {shown} | {found if mine else '- | -'} "
                    f"| {others} |"
                )


def _detection(scene: Scenario, run: Run) -> str:
    last = run.health.group_by("sensor_id", maintain_order=True).last()
    configured = {one.identifier: one.detection_probability for one in scene.sensors}
    off = [
        abs(found - configured[name])
        for name, found in last.select("sensor_id", "detection_probability").iter_rows()
        if found is not None
    ]
    return f"{max(off):.3f}" if off else "-"


def _said(run: Run) -> str:
    counts = Counter(f"{name}: {alarm}" for _, name, alarm in run.alarms())
    return ", ".join(f"{what} × {count}" for what, count in sorted(counts.items())) or "none"


def _jumps(scene: Scenario, run: Run) -> Iterator[str]:
    found = [(at, name) for at, name, alarm in run.alarms() if alarm == "bias_jump"]
    names = ("range_offset_m", "azimuth_offset_deg")
    for sensor in scene.sensors:
        for parameter, bias in zip(names, sensor.biases, strict=False):
            if bias.jump == 0.0:
                continue
            unit = 1.0 if parameter == names[0] else float(np.radians(1.0))
            truth = (bias.value + bias.jump) / unit
            at = [one for one, name in found if name == sensor.identifier and one >= bias.jump_s]
            after = at[0] - bias.jump_s if at else np.nan
            errors = [
                f"{run.bias(sensor.identifier, parameter, bias.jump_s + more)[0] - truth:+.4g} "
                f"after {more:.0f} s"
                for more in AFTER_S
            ]
            period_s = sensor.rotation_period_s or np.nan
            yield (
                f"{sensor.identifier} {parameter} found after {after:.1f} s = "
                f"{after / period_s:.1f} scans; error {', '.join(errors)}"
            )


def arguments() -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scenes", nargs="*", help="built-in scenes; all when absent")
    parser.add_argument("--filters", nargs="+", default=["two-stage", "imm"], choices=[*FILTERS])
    parser.add_argument("--recording", type=Path, help="a converted recording to put jumps into")
    parser.add_argument("--sensors", type=Path, help="its sensors.toml")
    parser.add_argument("--at", type=float, help="data time of the jumps")
    return parser.parse_args()


if __name__ == "__main__":
    main()
