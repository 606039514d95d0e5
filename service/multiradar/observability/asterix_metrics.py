"""Counters of ASTERIX listeners, read from what they count when somebody asks."""

from collections.abc import Callable, Iterator
from typing import Any

from prometheus_client import CollectorRegistry
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

#: Counters by name and label: the parts that they count, with the counters of a listener.
_FAMILIES: tuple[tuple[str, str, str, dict[str, str]], ...] = (
    ("datagrams", "Datagrams received, dropped, and lost by the system", "result", {
        "received": "datagrams",
        "dropped": "datagrams_dropped",
        "lost_by_system": "datagrams_lost_by_system",
    }),
    ("octets", "Octets by what became of them", "result", {
        "received": "octets",
        "dropped": "octets_dropped",
        "decoded": "octets_decoded",
        "skipped": "octets_skipped",
        "quarantined": "octets_quarantined",
    }),
    ("records", "Target reports by what became of them", "result", {
        "measurement": "records_measurement",
        "duplicate": "records_duplicate",
        "left_out": "records_left_out",
        "refused": "records_refused",
    }),
    ("rows", "Measurements by what the journal said of them", "result", {
        "accepted": "rows_accepted",
        "rejected": "rows_rejected",
        "lost": "rows_lost",
    }),
)  # fmt: skip


class AsterixCollector(Collector):
    """Turns the counts of listeners into metrics at each scrape.

    Parameters
    ----------
    counts : callable
        Returns the document of `AsterixCounts`.
    """

    def __init__(self, counts: Callable[[], dict[str, Any]]) -> None:
        self._counts = counts

    def collect(self) -> Iterator[Metric]:
        """Yield the metrics of now; labels are names of listeners, codes and categories."""
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
        refused = CounterMetricFamily(
            "multiradar_asterix_refused", "Blocks and records refused", labels=["listener", "code"]
        )
        faults = CounterMetricFamily(
            "multiradar_asterix_receive_faults", "Faults of a port", labels=["listener"]
        )
        for listener, numbers in listeners.items():
            faults.add_metric([listener], numbers["receive_faults"])
            for code, count in numbers["refused_by_code"].items():
                refused.add_metric([listener, code], count)
        yield from (refused, faults)
        categories = CounterMetricFamily(
            "multiradar_asterix_category_records", "Records by category", labels=["category"]
        )
        for category, count in document["records_by_category"].items():
            categories.add_metric([category], count)
        yield categories
        for name, meaning in (
            ("waiting_datagrams", "Datagrams that wait to be decoded"),
            ("waiting_octets", "Octets that wait to be decoded"),
        ):
            yield GaugeMetricFamily(f"multiradar_asterix_{name}", meaning, document[name])


def watch_asterix(
    registry: CollectorRegistry, counts: Callable[[], dict[str, Any]]
) -> Callable[[], None]:
    """Show listeners in a registry; return what ends that.

    Parameters
    ----------
    registry : CollectorRegistry
        Where to.
    counts : callable
        Returns the document of `AsterixCounts`.

    Returns
    -------
    callable
        Takes them out of the registry again.
    """
    collector = AsterixCollector(counts)
    registry.register(collector)
    return lambda: registry.unregister(collector)
