"""Prometheus metrics of ASTERIX listeners, collected at each scrape."""

from collections.abc import Callable, Iterator
from typing import Any

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from multiradar_converters.asterix.decoding.sensor_clocks import TIME_ALARMS

#: Metrics: name, help, label, and the counter of a listener for each value of the label.
_FAMILIES: tuple[tuple[str, str, str, dict[str, str]], ...] = (
    ("datagrams", "Datagrams received, dropped, and lost by the operating system", "result", {
        "received": "datagrams",
        "dropped": "datagrams_dropped",
        "lost_by_system": "datagrams_lost_by_system",
    }),
    ("octets", "Octets by disposition", "result", {
        "received": "octets",
        "dropped": "octets_dropped",
        "framing": "octets_framing",
        "decoded": "octets_decoded",
        "skipped": "octets_skipped",
        "quarantined": "octets_quarantined",
    }),
    ("records", "Target reports by disposition", "result", {
        "measurement": "records_measurement",
        "duplicate": "records_duplicate",
        "left_out": "records_left_out",
        "refused": "records_refused",
    }),
    ("rows", "Measurements by ingest result", "result", {
        "accepted": "rows_accepted",
        "rejected": "rows_rejected",
        "lost": "rows_lost",
    }),
)  # fmt: skip


class AsterixCollector(Collector):
    """Converts the counts of listeners into metrics at each scrape.

    Parameters
    ----------
    counts : callable
        Returns the document of `AsterixCounts`.
    """

    def __init__(self, counts: Callable[[], dict[str, Any]]) -> None:
        self._counts = counts

    def collect(self) -> Iterator[Metric]:
        """Yield the current metrics; labels are names of listeners, codes and categories."""
        document = self._counts()
        listeners = document["listeners"]
        for name, meaning, label, parts in _FAMILIES:
            family = CounterMetricFamily(
                f"multiradar_asterix_{name}", meaning, labels=["listener", label]
            )
            for listener, numbers in listeners.items():
                for part, counter in parts.items():
                    family.add_metric([listener, part], numbers[counter])
            yield family
        rejected = CounterMetricFamily(
            "multiradar_asterix_refused", "Blocks and records rejected", labels=["listener", "code"]
        )
        faults = CounterMetricFamily(
            "multiradar_asterix_receive_faults", "Reception errors by listener", labels=["listener"]
        )
        for listener, numbers in listeners.items():
            faults.add_metric([listener], numbers["receive_faults"])
            for code, count in numbers["refused_by_code"].items():
                rejected.add_metric([listener, code], count)
        yield from (rejected, faults)
        categories = CounterMetricFamily(
            "multiradar_asterix_category_records", "Records by category", labels=["category"]
        )
        for category, count in document["records_by_category"].items():
            categories.add_metric([category], count)
        yield categories
        yield from _clock_metrics(document["clocks"])
        for name, meaning in (
            ("waiting_datagrams", "Datagrams waiting to be decoded"),
            ("waiting_octets", "Octets waiting to be decoded"),
            ("decoding_octets", "Octets being decoded"),
        ):
            yield GaugeMetricFamily(f"multiradar_asterix_{name}", meaning, document[name])


def _clock_metrics(clocks: dict[str, dict[str, Any]]) -> Iterator[Metric]:
    for name, meaning, figure in (
        (
            "clock_offset_seconds",
            "Time stamp minus reception time of the fastest messages, s",
            "clock_offset_s",
        ),
        (
            "latency_seconds",
            "Median report latency (reception time minus time of report), s",
            "latency_median_s",
        ),
    ):
        family = GaugeMetricFamily(f"multiradar_asterix_{name}", meaning, labels=["sensor"])
        for sensor, one in clocks.items():
            if one[figure] is not None:
                family.add_metric([sensor], one[figure])
        yield family
    alarms = GaugeMetricFamily(
        "multiradar_asterix_sensor_alarm", "1 while an alarm is active", labels=["sensor", "alarm"]
    )
    for sensor, one in clocks.items():
        for alarm in TIME_ALARMS:
            alarms.add_metric([sensor, alarm], one["alarm"] == alarm)
    yield alarms
