"""Jobs as tasks of Ray, where `interfaces.require_named` allows it. Needs the extra `cluster`."""

from collections.abc import Callable
from typing import Any

import ray
from ray.exceptions import RayError

from multiradar.cluster.interfaces import addresses_of_host, require_named
from multiradar.cluster.jobs import Job, JobEvent
from multiradar.cluster.ray_host import connect, own_signals, reason_of
from multiradar.settings.cluster import ClusterSettings


class RayJobs:
    """Runs each job as a task, which Ray does not repeat.

    Parameters
    ----------
    function : callable
        Called with a job, returns its answer; can be imported on each node.
    settings : ClusterSettings
        Addresses that the user has named; the cluster to join, by default one that is started here.
    slots : int
        Processors of a cluster that is started here.

    Raises
    ------
    ConfigurationError
        If Ray might listen on an address that is not named, or there is no cluster at the address.
    """

    def __init__(
        self, function: Callable[[Job], dict[str, Any]], settings: ClusterSettings, slots: int
    ) -> None:
        require_named(settings.listen, addresses_of_host())
        with own_signals():
            connect(settings, slots)
        # A process for each task: it ends with the memory that the task took.
        self._task = ray.remote(num_cpus=1, max_retries=0, max_calls=1)(function)
        self._running: dict[Any, str] = {}

    def start(self, name: str, job: Job) -> None:
        """Start a job, without waiting for it."""
        self._running[self._task.remote(job)] = name

    def next(self) -> JobEvent:
        """Wait for the end of any job that runs."""
        ready, _ = ray.wait([*self._running], num_returns=1)
        name = self._running.pop(ready[0])
        try:
            return JobEvent(name, answer=ray.get(ready[0]))
        except RayError as error:
            return JobEvent(name, lost=reason_of(error))

    def close(self) -> None:
        """End all jobs that run, and leave the cluster; one that was started here ends."""
        for one in self._running:
            ray.cancel(one, force=True)
        self._running.clear()
        ray.shutdown()
