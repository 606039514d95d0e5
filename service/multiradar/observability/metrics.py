"""Prometheus metrics of the process in a separate registry, exposed by `/metrics`.

Labels have few values: routes by template, codes from the documented lists. They never contain a
path, an identity or other data chosen by a client.
"""

from collections.abc import Callable

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    Histogram,
    ProcessCollector,
    generate_latest,
)
from prometheus_client.registry import Collector

REGISTRY = CollectorRegistry()
ProcessCollector(registry=REGISTRY)

#: Media type of `exposition`.
EXPOSITION_MEDIA_TYPE = "text/plain; version=0.0.4; charset=utf-8"

HTTP_REQUESTS = Counter(
    "multiradar_http_requests",
    "Responses, by method, route template and status",
    ["method", "route", "status"],
    registry=REGISTRY,
)
HTTP_REQUEST_SECONDS = Histogram(
    "multiradar_http_request_seconds",
    "Time from the request headers to the end of the response, s",
    ["route"],
    buckets=(0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0),
    registry=REGISTRY,
)
HTTP_REJECTIONS = Counter(
    "multiradar_http_refusals",
    "Requests rejected with a problem document, by code",
    ["code"],
    registry=REGISTRY,
)
HTTP_CONNECTIONS = Gauge(
    "multiradar_http_connections", "Open connections, including WebSockets", registry=REGISTRY
)
HTTP_CONNECTIONS_DROPPED = Counter(
    "multiradar_http_connections_dropped",
    "Connections closed by the service, by cause",
    ["cause"],
    registry=REGISTRY,
)
STREAM_CLIENTS = Gauge(
    "multiradar_stream_clients", "Open event streams", ["transport"], registry=REGISTRY
)
STREAM_EVENTS = Counter(
    "multiradar_stream_events",
    "Events sent to stream clients, counted once per client",
    ["transport"],
    registry=REGISTRY,
)
STREAM_GAPS = Counter(
    "multiradar_stream_gaps",
    "Gap notices sent to slow stream clients",
    ["transport"],
    registry=REGISTRY,
)


def watch(registry: CollectorRegistry, collector: Collector) -> Callable[[], None]:
    """Register a collector; return the function that unregisters it."""
    registry.register(collector)
    return lambda: registry.unregister(collector)


def exposition() -> bytes:
    """Return all counters in the Prometheus text format."""
    return generate_latest(REGISTRY)
