"""Scenes on Ray in a namespace of its own: kills, hangs, nodes and fronts that come and go.

    python -m support.cluster.ray_scenes OUT.json

All scenes use one cluster, since its start takes many seconds.
"""

import json
import os
import secrets
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ray
from ray.cluster_utils import Cluster

from multiradar.cluster.hosts import ShardHost
from multiradar.cluster.ray_host import RayHost, RayLink
from multiradar.cluster.shard import Answer, Batch, ShardSpec
from multiradar.cluster.sharded_steps import ShardedSteps
from multiradar.errors import ConfigurationError
from multiradar.estimation.filters.arrays import Model
from multiradar.settings.cluster import ClusterSettings
from multiradar.tracking.settings import TrackingSettings
from support.cluster.shards import IDENTITY, Between, Engines, drifting_traffic, moved, nothing
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from validation.service.namespace import is_in_namespace

ADDRESS = "127.0.0.1"
#: Processors of the first node: shards, and those that replace them.
PROCESSORS = 6
#: A shard that hangs is lost after so long, s.
SHORT_S = 3.0

Found = dict[str, Any]


class Scenes:
    """A cluster, and one traffic for all scenes."""

    def __init__(self) -> None:
        self.cluster = Cluster(
            initialize_head=True,
            head_node_args={"num_cpus": PROCESSORS, "node_ip_address": ADDRESS},
        )
        traffic = drifting_traffic()
        self.engines = {
            name: Engines(traffic, TrackingSettings(filter_name=name, hidden_fields=IDENTITY))
            for name in ("imm", "two-stage")
        }
        self.settings = ClusterSettings(listen=(ADDRESS,), head=self.cluster.address)

    def threads(self) -> Found:
        """Digests without a cluster."""
        return {name: one.on_threads() for name, one in self.engines.items()}

    def shards(self) -> Found:
        """1, 2 and 5 shards; partitions that move at each epoch."""
        found = {f"imm-{n}": self._run(n, between=moved) for n in (1, 2, 5)}
        return found | {"two-stage-2": self._run(2, "two-stage")}

    def kills(self) -> Found:
        """One shard is killed in each epoch, beside partitions that move."""

        def kill(epoch: int, steps: ShardedSteps) -> None:
            moved(epoch, steps)
            ready(steps)
            os.kill(pid_of(steps, epoch % 2), signal.SIGKILL)

        return self._run(2, between=kill)

    def hangs(self) -> Found:
        """A shard stops in the middle of a run."""
        stopped: list[int] = []

        def stop(epoch: int, steps: ShardedSteps) -> None:
            if epoch == 2:
                stopped.append(pid_of(steps, 1))
                os.kill(stopped[0], signal.SIGSTOP)

        found = self._run(2, between=stop, deadline_s=SHORT_S)
        wait_until(lambda: not Path(f"/proc/{stopped[0]}").exists(), "the end of the shard")
        return found

    def dies_with_a_batch(self) -> Found:
        """A shard ends between a batch and its answer."""
        return self._run(1, host=Dying(RayHost(self.settings, 1), batch=7))

    def node_leaves(self) -> Found:
        """A node with a shard leaves."""
        node = self.cluster.add_node(num_cpus=2, node_ip_address=ADDRESS)

        def leave(epoch: int, steps: ShardedSteps) -> None:
            if epoch == 2:
                self.cluster.remove_node(node, allow_graceful=False)

        return self._run(3, between=leave)

    def second_front(self) -> Found:
        """Another front is rejected, and accepted when the first has ended."""
        line = [sys.executable, "-m", "support.cluster.ray_scenes", "--front", self.cluster.address]
        first = subprocess.Popen(line, stdout=subprocess.PIPE, text=True)
        assert first.stdout is not None
        assert first.stdout.readline() == "front\n"
        rejected = self._rejection()
        first.kill()
        first.wait(WAIT_TIMEOUT_S)
        wait_until(lambda: not self._rejection(), "the end of the first front")
        return {"rejected": rejected, "process": first.pid}

    def nothing_there(self) -> Found:
        """There is no cluster at the address."""
        settings = ClusterSettings(listen=(ADDRESS,), head=f"{ADDRESS}:9")
        try:
            RayHost(settings, 1).close()
        except ConfigurationError as error:
            return {"error": str(error)}
        return {"error": ""}

    def _rejection(self) -> str:
        try:
            RayHost(self.settings, 1).close()
        except ConfigurationError as error:
            return str(error)
        return ""

    def _run(
        self,
        shards: int,
        name: str = "imm",
        between: Between = nothing,
        deadline_s: float = WAIT_TIMEOUT_S,
        host: ShardHost | None = None,
    ) -> Found:
        engines = self.engines[name]
        digest = engines.on_shards(
            host or RayHost(self.settings, shards), shards, between, deadline_s
        )
        return {"digest": digest, **engines.document}


class Dying:
    """Shards on Ray; the one of a batch is killed before it answers."""

    def __init__(self, host: RayHost, batch: int) -> None:
        self._host, self.batch = host, batch
        self.close = host.close

    def start(self, spec: ShardSpec, name: str) -> "DyingLink":
        """Start a shard."""
        return DyingLink(self._host.start(spec, name), self)


class DyingLink:
    """Its shard stops before the batch arrives, and is killed after it."""

    def __init__(self, link: RayLink, host: Dying) -> None:
        self._link, self._host = link, host
        self.is_ready, self.stop = link.is_ready, link.stop

    def send(self, batch: Batch, model: Model | None) -> None:
        """Send a batch."""
        if batch.number != self._host.batch:
            self._link.send(batch, model)
            return
        pid = process_of(self._link)
        os.kill(pid, signal.SIGSTOP)
        self._link.send(batch, model)
        os.kill(pid, signal.SIGKILL)

    def receive(self, deadline_s: float) -> Answer:
        """Return the answer."""
        return self._link.receive(deadline_s)


def process_of(link: RayLink) -> int:
    """Return the process of a shard."""
    found = link._actor.__ray_call__.remote(lambda _shard: os.getpid())
    return int(ray.get(found, timeout=WAIT_TIMEOUT_S))


def pid_of(steps: ShardedSteps, shard: int) -> int:
    """Return the process of a shard by its number."""
    link = steps._places[shard].link
    assert isinstance(link, RayLink)
    return process_of(link)


def ready(steps: ShardedSteps) -> None:
    """Wait until all shards run."""

    def all_ready() -> bool:
        steps._adopt()
        return not steps.document()["partitions_of_front"]

    wait_until(all_ready, "shards that are started again")


def _front(head: str) -> None:
    host = RayHost(ClusterSettings(listen=(ADDRESS,), head=head), 1)
    sys.stdout.write("front\n")
    sys.stdout.flush()
    signal.pause()
    host.close()


def main() -> None:
    """Play all scenes and write what was found."""
    assert is_in_namespace(), "Ray is started only beside nothing but loopback"
    if sys.argv[1] == "--front":
        _front(sys.argv[2])
        return
    os.environ.update(RAY_AUTH_TOKEN=secrets.token_hex(32), RAY_USAGE_STATS_ENABLED="0")
    scenes = Scenes()
    played: list[Callable[[], Found]] = [
        scenes.threads, scenes.shards, scenes.kills, scenes.hangs, scenes.dies_with_a_batch,
        scenes.second_front, scenes.nothing_there, scenes.node_leaves,
    ]  # fmt: skip
    found = {}
    for scene in played:
        found[scene.__name__] = scene()
        sys.stderr.write(f"{scene.__name__} {found[scene.__name__]}\n")
    scenes.cluster.shutdown()
    Path(sys.argv[1]).write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main()
