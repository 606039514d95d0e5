"""Where shards run, behind two protocols; the form within this process."""

from typing import Protocol

from multiradar.cluster.shard import Answer, Batch, Shard, ShardSpec
from multiradar.errors import PeerError
from multiradar.estimation.filters.arrays import Model


class ShardLink(Protocol):
    """A connection of the front with one shard: one batch at a time."""

    def is_ready(self, wait_s: float) -> bool:
        """Return whether the shard has started, after this time at the latest.

        Raises
        ------
        PeerError
            If it cannot start.
        """
        ...

    def send(self, batch: Batch, model: Model | None) -> None:
        """Send a batch, with the model of the filter if it is not that of the batch before.

        Raises
        ------
        PeerError
            If it cannot be sent.
        """
        ...

    def receive(self, deadline_s: float) -> Answer:
        """Return the answer to the batch that was sent.

        Raises
        ------
        PeerError
            If the shard is lost or does not answer within the deadline.
        """
        ...

    def stop(self) -> None:
        """End the shard, in whatever state it is."""
        ...


class ShardHost(Protocol):
    """Starts shards."""

    def start(self, spec: ShardSpec, name: str) -> ShardLink:
        """Start a shard, without waiting for it.

        Parameters
        ----------
        spec : ShardSpec
            What it needs.
        name : str
            No two shards of a front ever have the same.
        """
        ...

    def close(self) -> None:
        """Leave the host; shards that still run end."""
        ...


class LocalHost:
    """Runs shards in this process: for tests, and to compare with."""

    def start(self, spec: ShardSpec, name: str) -> "LocalLink":
        """Start a shard."""
        return LocalLink(Shard(spec), name)

    def close(self) -> None:
        """Leave the host."""


class LocalLink:
    """A shard of this process.

    Parameters
    ----------
    shard : Shard
        The shard.
    name : str
        Its name.
    """

    def __init__(self, shard: Shard, name: str) -> None:
        self._shard: Shard | None = shard
        self._sent: tuple[Batch, Model | None] | None = None
        self._name = name

    def is_ready(self, wait_s: float) -> bool:
        """Return that it has started."""
        return True

    def send(self, batch: Batch, model: Model | None) -> None:
        """Hold a batch until its answer is wanted."""
        self._sent = batch, model

    def receive(self, deadline_s: float) -> Answer:
        """Step the batch that was sent."""
        if self._shard is None or self._sent is None:
            raise PeerError(f"{self._name}: the shard has stopped")
        (batch, model), self._sent = self._sent, None
        return self._shard.step(batch, model)

    def stop(self) -> None:
        """End the shard."""
        self._shard = None
