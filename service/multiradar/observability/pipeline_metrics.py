"""Counters and gauges of the live pipeline, read from its status when somebody asks."""

from collections.abc import Callable, Iterator
from typing import Any

from prometheus_client import CollectorRegistry
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

#: Gauges by the name of the status field that they show, with what they mean.
_GAUGES = {
    "data_time_s": "Greatest data time handed to the engine, s",
    "tracks": "Live tracks",
    "journal_sequence": "Last entry of the journal",
    "processed_sequence": "Last entry of the journal that the engine has processed",
    "output_sequence": "Last update of a track",
    "event_sequence": "Last event of the stream",
    "intake_batches": "Messages that wait for the journal",
    "intake_rows": "Measurements that wait for the journal",
    "backlog_rows": "Measurements that wait for the engine",
    "skipped_entries": "Entries of the journal that are passed over",
    "subscribers": "Readers of the event stream",
}
_RESULTS = ("accepted", "rejected", "duplicate")


class PipelineCollector(Collector):
    """Turns a status into metrics at each scrape.

    Parameters
    ----------
    status : callable
        Returns the status of the service.
    """

    def __init__(self, status: Callable[[], dict[str, Any]]) -> None:
        self._status = status

    def collect(self) -> Iterator[Metric]:
        """Yield the metrics of now; what is not known yet is left out."""
        status = self._status()
        measurements = CounterMetricFamily(
            "multiradar_measurements", "Measurements by what became of them", labels=["result"]
        )
        for result in _RESULTS:
            measurements.add_metric([result], status.get(result, 0))
        yield measurements
        outcomes = CounterMetricFamily(
            "multiradar_outcomes", "Accepted measurements by outcome in the filter",
            labels=["outcome"],
        )  # fmt: skip
        for outcome, count in status.get("engine", {}).items():
            outcomes.add_metric([outcome.lower()], count)
        yield outcomes
        running = 1.0 if status.get("state") == "running" else 0.0
        yield GaugeMetricFamily("multiradar_running", "1 when measurements are taken", running)
        for name, meaning in _GAUGES.items():
            value = status.get(name)
            if value is not None:
                yield GaugeMetricFamily(f"multiradar_{name}", meaning, float(value))


def watch_pipeline(
    registry: CollectorRegistry, status: Callable[[], dict[str, Any]]
) -> Callable[[], None]:
    """Show a pipeline in a registry; return what ends that.

    Parameters
    ----------
    registry : CollectorRegistry
        Where to.
    status : callable
        Returns the status of the service.

    Returns
    -------
    callable
        Takes the pipeline out of the registry again.
    """
    collector = PipelineCollector(status)
    registry.register(collector)
    return lambda: registry.unregister(collector)
