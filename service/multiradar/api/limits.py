"""Limits of the HTTP interface with their defaults."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class HttpLimits:
    """Limits for clients.

    Attributes
    ----------
    body_bytes_max : int
        Maximum size of a request body; larger ones are answered 413.
    bodies_bytes_max : int
        Maximum total size of request bodies in memory; beyond it 503.
    header_bytes_max : int
        Maximum size of the request line with headers.
    header_deadline_s : float
        Maximum time until the headers of the first request of a connection are received.
    body_deadline_s : float
        Maximum time until the whole body is received; beyond it 408.
    send_deadline_s : float
        Maximum time that a piece of an answer waits for a client that does not read; after twice
        that time without progress the connection is aborted.
    acknowledge_deadline_s : float
        Maximum wait for the journal; beyond it 503.
    requests_max : int
        Maximum concurrent requests; beyond it 503.
    connections_max : int
        Maximum open connections; beyond it a new one replaces the one that has been idle longest.
    streams_max : int
        Maximum open WebSocket and SSE streams together; beyond it 503.
    threads : int
        Threads for encoding and decoding.
    stream_batch_interval_s : float
        Interval over which events are collected into a batch.
    stream_batch_events_max : int
        Maximum events in a message of a stream.
    stream_heartbeat_s : float
        Heartbeat interval of a stream.
    """

    body_bytes_max: int = 16 * 1024 * 1024
    bodies_bytes_max: int = 64 * 1024 * 1024
    header_bytes_max: int = 16 * 1024
    header_deadline_s: float = 10.0
    body_deadline_s: float = 30.0
    send_deadline_s: float = 10.0
    acknowledge_deadline_s: float = 30.0
    requests_max: int = 64
    connections_max: int = 512
    streams_max: int = 100
    threads: int = 4
    stream_batch_interval_s: float = 0.1
    stream_batch_events_max: int = 500
    stream_heartbeat_s: float = 5.0
