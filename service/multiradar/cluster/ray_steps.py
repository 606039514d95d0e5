"""The engine `ray`: opens shards on Ray for an engine, as the settings say."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from multiradar.cluster.interfaces import addresses_of_host, require_named
from multiradar.cluster.sharded_steps import ShardedSteps
from multiradar.errors import ConfigurationError
from multiradar.estimation.filters.arrays import Model
from multiradar.estimation.filters.bank import FilterDefinition
from multiradar.settings.cluster import ClusterSettings
from multiradar.settings.service import Settings
from multiradar.tracking.pool import AircraftPool


class RaySteps:
    """Opens the shards of an engine, again after a failure; counts them.

    Parameters
    ----------
    settings : ClusterSettings
        Where Ray may listen and which cluster is used.
    shards : int
        Number of shards.

    Raises
    ------
    ConfigurationError
        If Ray is not installed, or might listen on an address that is not named.
    """

    def __init__(self, settings: ClusterSettings, shards: int) -> None:
        with with_ray():
            from multiradar.cluster.ray_host import RayHost
        require_named(settings.listen, addresses_of_host())
        self._host, self._settings, self._shards = RayHost, settings, shards
        self._opened: ShardedSteps | None = None

    def __call__(
        self, definition: FilterDefinition, aircraft: AircraftPool, model: Model
    ) -> ShardedSteps:
        """Start or join the cluster, and start the shards."""
        host = self._host(self._settings, self._shards)
        self._opened = ShardedSteps(
            definition,
            aircraft,
            model,
            host,
            shards=self._shards,
            deadline_s=self._settings.deadline_s,
        )
        return self._opened

    def document(self) -> dict[str, Any]:
        """Return state and counts for the status of the service; empty before the start."""
        return {} if self._opened is None else self._opened.document()


@contextmanager
def with_ray() -> Iterator[None]:
    """Explain a missing Ray where it is imported.

    Raises
    ------
    ConfigurationError
        If Ray is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name != "ray":
            raise
        raise ConfigurationError(
            "engine: ray is not installed; in the source directory: "
            "pip install --require-hashes -r requirements/cluster.txt"
        ) from error


def steps_of(settings: Settings, workers: int) -> RaySteps | None:
    """Return what opens the shards of the engine that the settings choose; None for threads.

    Parameters
    ----------
    settings : Settings
        All settings.
    workers : int
        Number of shards.

    Raises
    ------
    ConfigurationError
        If it is ray, which is not installed or might listen on an address that is not named.
    """
    return RaySteps(settings.cluster, workers) if settings.engine == "ray" else None
