"""Prometheus metrics of the live pipeline, collected from its status at each scrape."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Protocol

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

#: Gauges: name of the status field and help.
_GAUGES = {
    "data_time_s": "Latest data time passed to the engine, s",
    "data_delay_s": "System clock minus data time, for real-time data, s",
    "silence_s": "Time since the last measurement from any sensor, for real-time data, s",
    "tracks": "Live tracks",
    "journal_sequence": "Sequence number of the last journal entry",
    "processed_sequence": "Sequence number of the last journal entry processed by the engine",
    "output_sequence": "Sequence number of the last track update",
    "event_sequence": "Sequence number of the last stream event",
    "intake_batches": "Messages waiting for the journal",
    "intake_rows": "Measurements waiting for the journal",
    "backlog_rows": "Measurements waiting for the engine",
    "skipped_entries": "Journal entries skipped",
    "subscribers": "Clients of the event stream",
}
# Numbers of the Zenoh interface in the status that are not counters.
_ZENOH_GAUGES = {
    "links": "Links to other Zenoh sessions",
    "streams": "Tracks and sensors with cached updates",
}
_RESULTS = ("accepted", "rejected", "duplicate")
#: Results of the rows of a source: deferred ones were not read, and are to be sent again.
_SOURCE_RESULTS = {"accepted": "accepted", "rejected": "rejected", "deferred": "deferred_rows"}
#: The same of the journal's disk.
_DISK = {
    "free_bytes": "Free space on the journal disk",
    "size_bytes": "Size of the journal disk",
    "used_bytes": "Size of the journal, including its write-ahead log",
}


#: Alarms of the whole service without labels, and what they mean.
ALARMS = {
    "no_data": "1 if real-time data have stopped arriving",
    "host_clock": "1 if the clocks of all sensors disagree with the system clock",
    "disk_filling": "1 if the journal disk is at least 80 % full (disk_filling_share)",
    "disk_nearly_full": "1 if the journal disk is at least 90 % full (disk_nearly_full_share)",
    "snapshots_failing": "1 if the last snapshot could not be written",
    "history_stopped": "1 if the history is no longer being written to disk",
    "history_incomplete": "1 if history rows have been lost since the service started",
    "region_silent": "1 if a neighbouring region sends no messages",
    "certificate_expiring": "1 if a TLS certificate of the service expires within 30 days",
}


class _Reason(Protocol):
    @property
    def code(self) -> str: ...


class Stated(Protocol):
    """A service with a state, and reasons for which it is not ready."""

    @property
    def state(self) -> str:
        """Its state."""
        ...

    def unready(self) -> Iterable[_Reason]:
        """Return why it is not ready."""
        ...


class ReadinessCollector(Collector):
    """Whether the service accepts measurements and is ready, also while it starts or drains.

    Parameters
    ----------
    service : Stated
        The service.
    reasons : sequence of str
        Codes of the reasons for which the service may not be ready.
    """

    def __init__(self, service: Stated, reasons: Sequence[str]) -> None:
        self._service = service
        self._reasons = reasons

    def collect(self) -> Iterator[Metric]:
        """Yield the current metrics."""
        running = float(self._service.state == "running")
        yield GaugeMetricFamily("multiradar_running", "1 if measurements are accepted", running)
        present = {one.code for one in self._service.unready()}
        yield _gauge(
            "unready", "1 for each reason why the service is not ready", "reason",
            {code: float(code in present) for code in self._reasons},
        )  # fmt: skip


class PipelineCollector(Collector):
    """Converts the status into metrics at each scrape, without those of `ReadinessCollector`.

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
        results = {result: status.get(result, 0) for result in _RESULTS}
        yield _counter("measurements", "Measurements by disposition", "result", results)
        outcomes = {name.lower(): count for name, count in status.get("engine", {}).items()}
        yield _counter(
            "outcomes", "Accepted measurements by outcome in the filter", "outcome", outcomes
        )
        yield _rejected(status.get("rejected_by_source", {}))
        yield CounterMetricFamily(
            "multiradar_internal_errors",
            "Journalled messages whose alarms or diagnosis failed: a bug",
            status.get("internal_errors", 0),
        )
        yield from _sources(status.get("sources", {}))
        yield from _alarms(status)
        yield _gauge(
            "lag_seconds", "Time since reception of the oldest message in each stage, s", "stage",
            _lags_s(status),
        )  # fmt: skip
        yield _gauge(
            "sensor_age_seconds", "Time since the sensor last updated a track, s", "sensor",
            status.get("sensor_ages_s", {}),
        )  # fmt: skip
        yield _gauge(
            "certificate_remaining_seconds",
            "Time until the TLS certificate of an interface expires, s; negative once expired",
            "interface",
            {name: one["remaining_s"] for name, one in (status.get("certificates") or {}).items()},
        )
        disk = status.get("journal_disk") or {}
        for name, meaning in _DISK.items():
            if name in disk:
                yield GaugeMetricFamily(f"multiradar_journal_disk_{name}", meaning, disk[name])
        for name, meaning in _GAUGES.items():
            value = status.get(name)
            if value is not None:
                yield GaugeMetricFamily(f"multiradar_{name}", meaning, float(value))
        if "trajectories" in status:
            yield from _trajectories(status["trajectories"])
        if "zenoh" in status:
            yield from _zenoh(status["zenoh"])


def _alarms(status: dict[str, Any]) -> Iterator[Metric]:
    raised = status.get("alarms", ())
    for name, meaning in ALARMS.items():
        yield GaugeMetricFamily(f"multiradar_{name}", meaning, float(name in raised))
    alarms = GaugeMetricFamily(
        "multiradar_sensor_alarm", "1 for each active sensor alarm", labels=["sensor", "alarm"]
    )
    for sensor, names in status.get("sensor_alarms", {}).items():
        for alarm in names:
            alarms.add_metric([sensor, alarm], 1.0)
    yield alarms


def _counter(name: str, meaning: str, label: str, counts: Mapping[str, float]) -> Metric:
    family = CounterMetricFamily(f"multiradar_{name}", meaning, labels=[label])
    for value, count in counts.items():
        family.add_metric([value], count)
    return family


def _gauge(name: str, meaning: str, label: str, values: Mapping[str, float]) -> Metric:
    family = GaugeMetricFamily(f"multiradar_{name}", meaning, labels=[label])
    for value, number in values.items():
        family.add_metric([value], number)
    return family


def _rejected(by_source: Mapping[str, Mapping[str, int]]) -> Metric:
    family = CounterMetricFamily(
        "multiradar_rejected", "Rejected measurements", labels=["source", "code"]
    )
    for source, codes in by_source.items():
        for code, count in codes.items():
            family.add_metric([source, code], count)
    return family


def _sources(sources: Mapping[str, Mapping[str, int | bool]]) -> Iterator[Metric]:
    rows = CounterMetricFamily(
        "multiradar_source_rows",
        "Rows received from each source, by result",
        labels=["source", "result"],
    )
    for source, counts in sources.items():
        for result, name in _SOURCE_RESULTS.items():
            rows.add_metric([source, result], counts[name])
    yield rows
    yield _gauge(
        "source_quarantined", "1 for each source whose rows are mostly rejected", "source",
        {source: float(counts["quarantined"]) for source, counts in sources.items()},
    )  # fmt: skip


def _lags_s(status: Mapping[str, Any]) -> dict[str, float]:
    lags_s: dict[str, float] = dict(status.get("lags_s", {}))
    if status.get("role") == "standby":
        lags_s["follow"] = status["lag_s"]
    if "zenoh" in status:
        lags_s["publish"] = status["zenoh"]["publish_lag_s"]
    return lags_s


def _trajectories(counts: Mapping[str, Any]) -> Iterator[Metric]:
    results = {name: counts[f"plots_{name}"] for name in ("taken", "lost", "late")}
    yield _counter("trajectory_plots", "Plots for trajectory sets, by result", "result", results)
    yield GaugeMetricFamily(
        "multiradar_trajectory_lag_seconds",
        "Lag of the trajectory sets behind the tracks in data time, s",
        counts["lag_s"],
    )


def _zenoh(zenoh: Mapping[str, Any]) -> Iterator[Metric]:
    counts = {
        name: value
        for name, value in zenoh.items()
        if isinstance(value, int) and name not in _ZENOH_GAUGES
    }
    yield _counter("zenoh_events", "Zenoh interface events", "event", counts)
    for name, meaning in _ZENOH_GAUGES.items():
        yield GaugeMetricFamily(f"multiradar_zenoh_{name}", meaning, zenoh[name])
    yield GaugeMetricFamily(
        "multiradar_zenoh_unreachable",
        "Configured endpoints without a link",
        len(zenoh["unreachable"]),
    )
