"""Processor time of the engine by stage, for the region Europe of the worldwide scenario.

    python -m validation.service.engine_stages [--messages 60] [--warm 24]

The engine processes messages of 0.8 s of data time, as in a service. The output has microseconds
of CPU time of its thread per measurement, and the digest of all updates, to compare two trees.
"""

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import polars as pl

from multiradar import wire
from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.engine.stepper import Stepper
from multiradar.tracking.association.window_association import Association
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.plausibility import adsb_plausibility
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.sensors.sensor import parse_sensors
from validation.service.world_scene import BLOCK_S, START_S, WORLD, World

MESSAGE_S = 0.8
EUROPE = [one.name for one in WORLD].index("europe")
_PUSH = "engine"
#: Stages, and the functions of which they consist.
STAGES: dict[str, tuple[Any, str]] = {
    _PUSH: (Engine, "push"),
    "filter": (Stepper, "step"),
    "sampled states": (Engine, "_samples"),
    "plausibility of reports": (adsb_plausibility, "check_rows"),
    "association": (Association, "associate"),
}


class Stopwatch:
    """Sums the CPU time of the thread in functions, in ns by name."""

    def __init__(self) -> None:
        self.spent = dict.fromkeys(STAGES, 0)

    def wrapped(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that adds its time."""

        def timed(*arguments: Any, **named: Any) -> Any:
            begin = time.thread_time_ns()
            try:
                return function(*arguments, **named)
            finally:
                self.spent[name] += time.thread_time_ns() - begin

        return timed


def main() -> int:
    """Run, and print the figures."""
    parser = argparse.ArgumentParser(prog="python -m validation.service.engine_stages")
    parser.add_argument("--messages", type=int, default=60)
    parser.add_argument("--warm", type=int, default=24, help="messages before those that count")
    options = parser.parse_args()
    watch = Stopwatch()
    for name, (owner, function) in STAGES.items():
        setattr(owner, function, watch.wrapped(name, getattr(owner, function)))
    world = World(15_000, 400, WORLD, 0.5)
    table = wire.sensor_table(parse_sensors(world.sensors_text(EUROPE)))
    engine = Engine(table, TrackingSettings(), sampling=Sampling.ALL)
    digest, before, rows = OutputDigest(), dict(watch.spent), 0
    for number, message in enumerate(messages(world, options.messages)):
        if number == options.warm:
            before, rows = dict(watch.spent), 0
        batch = wire.measurement_batch(message, table)[0]
        digest.add(engine.push(batch))
        rows += len(batch)
    for name, spent in watch.spent.items():
        print(f"{name:26s} {1e-3 * (spent - before[name]) / rows:6.2f} µs per measurement")
    print(f"output_sha256 {digest.hexdigest()}")
    return 0


def messages(world: World, count: int) -> list[pl.DataFrame]:
    """Return messages of `MESSAGE_S` of the region Europe."""
    found = []
    duration_s = BLOCK_S * np.ceil(count * MESSAGE_S / BLOCK_S)
    for number, frames in enumerate(world.blocks(float(duration_s))):
        time_s = frames[EUROPE]["time_s"].to_numpy() - START_S
        edges = number * BLOCK_S + np.arange(MESSAGE_S, BLOCK_S + MESSAGE_S / 2.0, MESSAGE_S)
        cuts = np.searchsorted(time_s, edges).tolist()
        found += [frames[EUROPE][a:b] for a, b in zip([0, *cuts], cuts, strict=False)]
    return found[:count]


if __name__ == "__main__":
    raise SystemExit(main())
