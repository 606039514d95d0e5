"""What shards cost on one machine: threads and Ray in alternation on the same plots.

    python -m validation.service.cluster_cost [--aircraft 2000] [--filter imm] [--rounds 3]

It runs in a network namespace with the loopback interface only, which it makes itself. Identity is
hidden. Seconds are those of the processor of the front for each plot, and of the clock for the run.
"""

import argparse
import os
import statistics
import subprocess
import sys
from dataclasses import dataclass

from multiradar.clock import SystemClock
from multiradar.cluster.ray_steps import RaySteps
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.settings.cluster import ClusterSettings
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.settings import HIDEABLE, TrackingSettings
from multiradar.wire.measurements import measurement_batch
from multiradar.wire.sensors import sensor_table
from multiradar_schemas.sensors.sensor import parse_sensors
from validation.service.namespace import in_namespace, is_in_namespace, why_no_namespace
from validation.service.traffic import Sky, sensors_text

BATCH_ROWS = 8192
#: Data time before the measurement, in which tracks are initiated and kernels loaded, s.
WARM_S = 24.0
CLOCK = SystemClock()


@dataclass(frozen=True, slots=True)
class Run:
    """A run: plots, their seconds by the clock and of the front's processor, octets, digest."""

    plots: int
    clock_s: float
    front_s: float
    sent: int
    received: int
    digest: str


@dataclass(frozen=True, slots=True)
class Scene:
    """The measurements and how they are tracked."""

    sensors: SensorTable
    settings: TrackingSettings
    batch: MeasurementBatch
    warm_rows: int


def main() -> int:
    """Print a line for each engine; the exit status is 0 if all outputs are equal."""
    parser = argparse.ArgumentParser(prog="python -m validation.service.cluster_cost")
    parser.add_argument("--aircraft", type=int, default=2000)
    parser.add_argument("--seconds", type=float, default=40.0)
    parser.add_argument("--filter", default="imm")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    if not is_in_namespace():
        if reason := why_no_namespace():
            print(f"cluster_cost: cannot make a network namespace: {reason}", file=sys.stderr)
            return 1
        line = [sys.executable, "-m", "validation.service.cluster_cost", *sys.argv[1:]]
        return subprocess.run(in_namespace(line), check=False).returncode
    scene = _scene(options.aircraft, options.seconds, options.filter)
    found: dict[str, list[Run]] = {"threads 1": [], "threads 2": [], "ray 2": []}
    for _ in range(options.rounds):
        for name, runs in found.items():
            kind, count = name.split()
            runs.append(_run(scene, kind, int(count)))
    _print(found)
    return int(len({one.digest for runs in found.values() for one in runs}) > 1)


def _print(found: dict[str, list[Run]]) -> None:
    base = found["threads 1"]
    print(f"{base[0].plots:,} plots, identity hidden, {len(base)} rounds; medians")
    print("engine      µs a plot   of the front   ratio to threads 1   octets a plot out, in")
    for name, runs in found.items():
        plots = runs[0].plots
        clock, front = (
            statistics.median(getattr(one, which) for one in runs) / plots * 1e6
            for which in ("clock_s", "front_s")
        )
        ratio = statistics.median(
            one.clock_s / other.clock_s for one, other in zip(runs, base, strict=True)
        )
        octets = f"{runs[0].sent / plots:,.0f}, {runs[0].received / plots:,.0f}"
        print(f"{name:10}  {clock:9.2f}   {front:12.2f}   {ratio:18.2f}   {octets}")


def _scene(aircraft: int, seconds: float, filter_name: str) -> Scene:
    table = sensor_table(parse_sensors(sensors_text()))
    batch, _ = measurement_batch(Sky(aircraft).measured(0.0, WARM_S + seconds, 0.0), table)
    settings = TrackingSettings(filter_name=filter_name, hidden_fields=HIDEABLE)
    return Scene(table, settings, batch, int((batch.time_s < WARM_S).sum()))


def _run(scene: Scene, kind: str, count: int) -> Run:
    shards = RaySteps(ClusterSettings(listen=("127.0.0.1",)), count) if kind == "ray" else None
    engine = Engine(scene.sensors, scene.settings, count, open_steps=shards)
    digest = OutputDigest()
    begin = (0.0, 0.0, 0, 0)
    cuts = [
        *range(0, scene.warm_rows, BATCH_ROWS),
        *range(scene.warm_rows, len(scene.batch), BATCH_ROWS),
    ]
    for first, last in zip(cuts, [*cuts[1:], len(scene.batch)], strict=True):
        if first == scene.warm_rows:
            begin = _now(shards)
        digest.add(engine.push(scene.batch.select(slice(first, last))))
    digest.add(engine.flush())
    now = _now(shards)
    engine.close()
    clock_s, front_s, sent, received = (b - a for a, b in zip(begin, now, strict=True))
    plots = len(scene.batch) - scene.warm_rows
    return Run(plots, clock_s, front_s, int(sent), int(received), digest.hexdigest())


def _now(shards: RaySteps | None) -> tuple[float, float, int, int]:
    counts = {} if shards is None else shards.document()
    times = os.times()
    return (
        CLOCK.monotonic_s(), times.user + times.system,
        counts.get("octets_sent", 0), counts.get("octets_received", 0),
    )  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
