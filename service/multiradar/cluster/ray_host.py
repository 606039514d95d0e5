"""Shards as Ray actors; only Ray core: actors, `ray.put`, no restarts and no retries by Ray.

Ray runs what it receives. A host that reaches its ports can run code as this user, so it is started
only where `interfaces.require_named` allows it. Needs the extra `cluster`.
"""

import os
import secrets
import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import ray
from ray.exceptions import RayError

from multiradar.cluster.front import Front
from multiradar.cluster.interfaces import addresses_of_host, require_named
from multiradar.cluster.shard import Answer, Batch, Shard, ShardSpec
from multiradar.errors import ConfigurationError, PeerError
from multiradar.estimation.filters.arrays import Model
from multiradar.settings.cluster import ClusterSettings

#: Of all actors of the service.
NAMESPACE = "multiradar"
#: Name of the actor that only one front of a cluster can have.
FRONT_NAME = "front"
#: Shared memory of a node that this process starts: a batch of 100 000 rows with all states.
STORE_OCTETS = 512 * 1024 * 1024
#: Time in which the head of a cluster accepts a connection, s.
HEAD_ANSWER_S = 10.0
#: Time in which the other front answers who it is, s.
FRONT_ANSWER_S = 10.0


class RayHost:
    """Starts shards on a Ray cluster.

    Parameters
    ----------
    settings : ClusterSettings
        Addresses that the user has named; the cluster to join, by default one that is started here.
    shards : int
        Processors of a cluster that is started here.

    Raises
    ------
    ConfigurationError
        If Ray might listen on an address that is not named, there is no cluster at the address, or
        it has a front.
    """

    def __init__(self, settings: ClusterSettings, shards: int) -> None:
        require_named(settings.listen, addresses_of_host())
        self._model: tuple[Model, Any] | None = None
        with own_signals():
            connect(settings, shards)
        try:
            self._front = _only_front(f"{settings.listen[0]}, process {os.getpid()}")
        except ConfigurationError:
            ray.shutdown()
            raise

    def start(self, spec: ShardSpec, name: str) -> "RayLink":
        """Start a shard, without waiting for it."""
        try:
            actor = (
                ray.remote(Shard)
                .options(
                    name=name, num_cpus=1, max_restarts=0, max_task_retries=0,
                    scheduling_strategy="SPREAD",
                )
                .remote(spec)
            )  # fmt: skip
        except (RayError, ValueError) as error:
            raise PeerError(f"{name}: cannot start: {error}") from error
        return RayLink(self, actor, name)

    def share(self, model: Model) -> Any:
        """Return a reference to a model in shared memory: one for all shards."""
        if self._model is None or self._model[0] is not model:
            self._model = model, ray.put(model)
        return self._model[1]

    def close(self) -> None:
        """Leave the cluster; one that was started here ends."""
        ray.kill(self._front)
        ray.shutdown()


class RayLink:
    """A connection with a shard that is an actor.

    Parameters
    ----------
    host : RayHost
        Shares models.
    actor : object
        The actor.
    name : str
        Its name.
    """

    def __init__(self, host: RayHost, actor: Any, name: str) -> None:
        self._host, self._actor, self._name = host, actor, name
        self._started = actor.__ray_ready__.remote()
        self._answer: Any = None

    def is_ready(self, wait_s: float) -> bool:
        """Return whether the shard has started, after this time at the latest."""
        try:
            if not ray.wait([self._started], timeout=wait_s)[0]:
                return False
            ray.get(self._started)
        except RayError as error:
            raise PeerError(f"{self._name}: {reason_of(error)}") from error
        return True

    def send(self, batch: Batch, model: Model | None) -> None:
        """Send a batch, with the model of the filter if it is not that of the batch before."""
        try:
            shared = None if model is None else self._host.share(model)
            self._answer = self._actor.step.remote(batch, shared)
        except RayError as error:
            raise PeerError(f"{self._name}: {reason_of(error)}") from error

    def receive(self, deadline_s: float) -> Answer:
        """Return the answer to the batch that was sent."""
        sent, self._answer = self._answer, None
        try:
            answer: Answer = ray.get(sent, timeout=deadline_s)
        except RayError as error:
            raise PeerError(f"{self._name}: {reason_of(error)}") from error
        return answer

    def stop(self) -> None:
        """End the shard, in whatever state it is."""
        ray.kill(self._actor, no_restart=True)


def connect(settings: ClusterSettings, slots: int) -> None:
    """Join the cluster of the settings, or start one with processors for some actors or tasks.

    Raises
    ------
    ConfigurationError
        If there is no cluster at the address, or it cannot be used.
    """
    common = {"namespace": NAMESPACE, "log_to_driver": False, "configure_logging": False}
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    try:
        if settings.head is not None:
            _require_listener(settings.head)
            ray.init(settings.head, _node_ip_address=settings.listen[0], **common)
            return
        # Other processes of this host cannot join without it.
        os.environ.setdefault("RAY_AUTH_TOKEN", secrets.token_hex(32))
        ray.init(
            "local", num_cpus=slots, include_dashboard=False, object_store_memory=STORE_OCTETS,
            _node_ip_address=settings.listen[0], **common,
        )  # fmt: skip
    except (RayError, ConnectionError, RuntimeError, ValueError, OSError) as error:
        place = settings.head or settings.listen[0]
        raise ConfigurationError(
            f"cluster: cannot use Ray at {place}: {reason_of(error)}"
        ) from error


# Ray itself tries for minutes.
def _require_listener(head: str) -> None:
    host, _, port = head.rpartition(":")
    with socket.create_connection((host, int(port)), HEAD_ANSWER_S):
        return


def _only_front(owner: str) -> Any:
    try:
        return ray.remote(Front).options(name=FRONT_NAME, num_cpus=0).remote(owner)
    except ValueError as error:
        raise ConfigurationError(
            f"cluster: another front of this cluster is running at {_other_front()}; stop that "
            "front or use another cluster"
        ) from error


def _other_front() -> str:
    try:
        other = ray.get_actor(FRONT_NAME)
        return str(ray.get(other.owner.remote(), timeout=FRONT_ANSWER_S))
    except (RayError, ValueError):
        return "an unknown host"


def reason_of(error: BaseException) -> str:
    """Return the last line that Ray gives, which is the reason."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__


@contextmanager
def own_signals() -> Iterator[None]:
    """Restore the handlers of signals, which Ray replaces by its own."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {one: signal.getsignal(one) for one in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
