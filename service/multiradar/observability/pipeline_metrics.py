"""Prometheus metrics of the live pipeline, collected from its status at each scrape."""

from collections.abc import Callable, Iterator
from typing import Any

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

#: Gauges: name of the status field and help.
_GAUGES = {
    "data_time_s": "Latest data time passed to the engine, s",
    "data_delay_s": "Time of the machine less data time, of data in real time, s",
    "silence_s": "Time since the last measurement of any sensor, of data in real time, s",
    "tracks": "Live tracks",
    "journal_sequence": "Last entry of the journal",
    "processed_sequence": "Last entry of the journal that the engine has processed",
    "output_sequence": "Last update of a track",
    "event_sequence": "Last event of the stream",
    "intake_batches": "Messages waiting for the journal",
    "intake_rows": "Measurements waiting for the journal",
    "backlog_rows": "Measurements waiting for the engine",
    "skipped_entries": "Journal entries skipped",
    "subscribers": "Readers of the event stream",
}
_RESULTS = ("accepted", "rejected", "duplicate")


class PipelineCollector(Collector):
    """Converts the status into metrics at each scrape.

    Parameters
    ----------
    status : callable
        Returns the status of the service.
    """

    def __init__(self, status: Callable[[], dict[str, Any]]) -> None:
        self._status = status

    def collect(self) -> Iterator[Metric]:
        """Yield the current metrics; unknown values are omitted."""
        status = self._status()
        measurements = CounterMetricFamily(
            "multiradar_measurements", "Measurements by disposition", labels=["result"]
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
        yield GaugeMetricFamily("multiradar_running", "1 when measurements are accepted", running)
        no_data = 1.0 if "no_data" in status.get("alarms", ()) else 0.0
        yield GaugeMetricFamily(
            "multiradar_no_data", "1 when data in real time have ceased", no_data
        )
        alarms = GaugeMetricFamily(
            "multiradar_sensor_alarm", "1 for each alarm of a sensor", labels=["sensor", "alarm"]
        )
        for sensor, names in status.get("sensor_alarms", {}).items():
            for alarm in names:
                alarms.add_metric([sensor, alarm], 1.0)
        yield alarms
        for name, meaning in _GAUGES.items():
            value = status.get(name)
            if value is not None:
                yield GaugeMetricFamily(f"multiradar_{name}", meaning, float(value))
