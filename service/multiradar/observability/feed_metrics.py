"""Prometheus metrics of feeds, collected at each scrape."""

from collections.abc import Callable, Iterator
from typing import Any

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

#: Metrics: name, help, and the counter of a feed for each value of the label `result`.
_BY_RESULT: tuple[tuple[str, str, dict[str, str]], ...] = (
    ("reports", "Positions and undecodable messages, by disposition", {
        "read": "reports_read",
        "accepted": "reports_accepted",
        "rejected": "reports_rejected",
        "duplicate": "reports_duplicate",
    }),
    ("rows", "Measurements by ingest result", {
        "accepted": "rows_accepted",
        "rejected": "rows_rejected",
        "lost": "rows_lost",
    }),
)  # fmt: skip
_PLAIN = (
    ("octets", "Octets received", "octets"),
    ("connections", "Connections", "connections"),
    ("connection_faults", "Failed or closed connections", "connection_faults"),
    ("messages_without_position", "Messages without a position", "messages_without_position"),
)
_CLOCKS = (
    (
        "clock_offset_seconds",
        "Time stamp minus reception time of the fastest messages, s",
        "clock_offset_s",
    ),
    (
        "latency_seconds",
        "Median position latency (reception time minus time of position), s",
        "latency_median_s",
    ),
)


class FeedCollector(Collector):
    """Converts the counts of feeds into metrics at each scrape.

    Parameters
    ----------
    counts : callable
        Returns the document of `FeedCounts`.
    """

    def __init__(self, counts: Callable[[], dict[str, Any]]) -> None:
        self._counts = counts

    def collect(self) -> Iterator[Metric]:
        """Yield the current metrics; labels are names of feeds, codes and sensors."""
        feeds = self._counts()["sources"]
        for name, meaning, parts in _BY_RESULT:
            family = CounterMetricFamily(
                f"multiradar_feed_{name}", meaning, labels=["feed", "result"]
            )
            for feed, numbers in feeds.items():
                for result, counter in parts.items():
                    family.add_metric([feed, result], numbers[counter])
            yield family
        for name, meaning, counter in _PLAIN:
            family = CounterMetricFamily(f"multiradar_feed_{name}", meaning, labels=["feed"])
            for feed, numbers in feeds.items():
                family.add_metric([feed], numbers[counter])
            yield family
        yield from _state_metrics(feeds)
        yield from _clock_metrics(feeds)


def _state_metrics(feeds: dict[str, dict[str, Any]]) -> Iterator[Metric]:
    codes = CounterMetricFamily(
        "multiradar_feed_rejected", "Rejected messages", labels=["feed", "code"]
    )
    connected = GaugeMetricFamily("multiradar_feed_connected", "1 while connected", labels=["feed"])
    latest = GaugeMetricFamily(
        "multiradar_feed_last_received_seconds", "Unix time of the last message", labels=["feed"]
    )
    for feed, numbers in feeds.items():
        connected.add_metric([feed], numbers["state"] == "connected")
        if numbers["last_received_s"] is not None:
            latest.add_metric([feed], numbers["last_received_s"])
        for code, count in numbers["rejected_by_code"].items():
            codes.add_metric([feed, code], count)
    yield from (codes, connected, latest)


def _clock_metrics(feeds: dict[str, dict[str, Any]]) -> Iterator[Metric]:
    for name, meaning, figure in _CLOCKS:
        family = GaugeMetricFamily(f"multiradar_feed_{name}", meaning, labels=["feed", "sensor"])
        for feed, numbers in feeds.items():
            for sensor, one in numbers["clocks"].items():
                if one[figure] is not None:
                    family.add_metric([feed, sensor], one[figure])
        yield family
