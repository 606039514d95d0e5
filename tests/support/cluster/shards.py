"""Engines on shards: faults of shards on purpose, partitions that move, digests of the output."""

from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Any

import numpy as np

from multiradar.cluster.hosts import LocalHost, LocalLink, ShardHost
from multiradar.cluster.shard import Answer, ShardSpec
from multiradar.cluster.sharded_steps import ShardedSteps
from multiradar.errors import PeerError
from multiradar.estimation.filters.arrays import Model
from multiradar.estimation.filters.bank import FilterDefinition
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_OFFSET,
)
from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.pool import PARTITIONS, AircraftPool
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.scenes import Scene, make_scene, random_flights, three_radars

#: Epochs of the scenes, s.
EPOCH_S = 4.0
DRIFTS = {PARAMETER_RANGE_OFFSET: 1.0, PARAMETER_AZIMUTH_OFFSET: float(np.radians(0.02))}
IDENTITY = ("track_number", "mode_3a", "mode_s_address", "callsign")

#: Called before each epoch with its number and the pool of steps.
Between = Callable[[int, ShardedSteps], object]


def drifting_traffic(seed: int = 1, aircraft: int = 24, duration_s: float = 20.0) -> Scene:
    """Aircraft on all partitions, and biases that drift."""
    rng = np.random.default_rng(seed)
    radars = [replace(one, rotation_s=1.0, drifts=DRIFTS) for one in three_radars()]
    return make_scene(rng, radars, random_flights(rng, aircraft, duration_s))


def nothing(_epoch: int, _steps: ShardedSteps) -> None:
    """Leave the shards alone."""


def moved(epoch: int, steps: ShardedSteps) -> None:
    """Turn the partitions round by one shard."""
    shards = steps.document()["shards"]
    for partition in range(PARTITIONS):
        steps.place([partition], (partition + epoch) % shards)


def on_local_shards(definition: FilterDefinition, pool: AircraftPool, model: Model) -> ShardedSteps:
    """Open two shards of this process."""
    return ShardedSteps(definition, pool, model, LocalHost(), shards=2, deadline_s=1.0)


class Engines:
    """Runs a scene through engines, and keeps the counts of the last.

    Parameters
    ----------
    scene : Scene
        The scene.
    settings : TrackingSettings
        Settings of the tracker.
    """

    def __init__(self, scene: Scene, settings: TrackingSettings) -> None:
        self._scene, self._settings = scene, settings
        self.document: dict[str, Any] = {}

    def on_threads(self) -> str:
        """Return the digest of the output with one thread."""
        return self._run(Engine(self._scene.sensors, self._settings), nothing, None)

    def on_shards(
        self,
        host: ShardHost,
        shards: int,
        between: Between = nothing,
        deadline_s: float = 60.0,
    ) -> str:
        """Return the digest of the output with shards."""
        opened: list[ShardedSteps] = []

        def open_steps(
            definition: FilterDefinition, pool: AircraftPool, model: Model
        ) -> ShardedSteps:
            steps = ShardedSteps(
                definition, pool, model, host, shards=shards, deadline_s=deadline_s
            )
            opened.append(steps)
            return steps

        engine = Engine(self._scene.sensors, self._settings, open_steps=open_steps)
        return self._run(engine, between, opened[0])

    def _run(self, engine: Engine, between: Between, steps: ShardedSteps | None) -> str:
        batch, digest = self._scene.batch, OutputDigest()
        epochs = np.floor(batch.time_s / EPOCH_S).astype(np.int64)
        for number, epoch in enumerate(np.unique(epochs)):
            if steps is not None:
                between(number, steps)
            digest.add(engine.push(batch.select(np.flatnonzero(epochs == epoch))))
        digest.add(engine.flush())
        if steps is not None:
            self.document = steps.document()
        engine.close()
        return digest.hexdigest()


class FaultyHost:
    """Shards of this process that are lost on purpose, after they have stepped the batch.

    Parameters
    ----------
    lose : collection of int
        Numbers of the batches without an answer.
    wrong : collection of int
        Numbers of the batches that get the answer to another.
    slow_first, slow_starts : int
        How often a shard is not ready: a first one, and one that is started again.
    failing_starts : int
        How many starts after the first ones fail.
    """

    def __init__(
        self,
        lose: Collection[int] = (),
        wrong: Collection[int] = (),
        slow_first: int = 0,
        slow_starts: int = 0,
        failing_starts: int = 0,
    ) -> None:
        self.lose, self.wrong, self.slow_first = set(lose), set(wrong), slow_first
        self.slow_starts, self.failing_starts = slow_starts, failing_starts
        self.names: list[str] = []
        self.stopped: list[str] = []
        self.closed = False

    def start(self, spec: ShardSpec, name: str) -> "FaultyLink":
        """Start a shard."""
        self.names.append(name)
        if not name.endswith("-1") and self.failing_starts:
            self.failing_starts -= 1
            raise PeerError(f"{name}: there is no room")
        return FaultyLink(self, LocalHost().start(spec, name), name)

    def close(self) -> None:
        """Leave the host."""
        self.closed = True


class FaultyLink:
    """A connection with a shard that may be lost.

    Parameters
    ----------
    host : FaultyHost
        Says which answers are lost.
    link : LocalLink
        The shard.
    name : str
        Its name.
    """

    def __init__(self, host: FaultyHost, link: LocalLink, name: str) -> None:
        self._host, self._link, self._name = host, link, name
        self._waits = host.slow_first if name.endswith("-1") else host.slow_starts

    def is_ready(self, wait_s: float) -> bool:
        """Return whether it has started."""
        self._waits -= 1
        return self._waits < 0

    def send(self, batch: Any, model: Model | None) -> None:
        """Send a batch."""
        self._link.send(batch, model)

    def receive(self, deadline_s: float) -> Answer:
        """Return the answer, unless it is lost."""
        answer = self._link.receive(deadline_s)
        if answer.number in self._host.lose:
            raise PeerError(f"{self._name}: no answer within {deadline_s:g} s")
        return answer._replace(number=-1) if answer.number in self._host.wrong else answer

    def stop(self) -> None:
        """End the shard."""
        self._host.stopped.append(self._name)
        self._link.stop()
