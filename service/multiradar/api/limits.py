"""The bounds of the HTTP side, each with its name and default."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class HttpLimits:
    """Every bound that a client can run into.

    Attributes
    ----------
    body_bytes_max : int
        Longest request body; one byte more is answered 413.
    bodies_bytes_max : int
        Bytes of request bodies held at one time over all requests; beyond it 503.
    header_bytes_max : int
        Longest request line with headers.
    header_deadline_s : float
        Time for a connection to deliver its first request's headers.
    body_deadline_s : float
        Time for a request to deliver its whole body; beyond it 408.
    send_deadline_s : float
        Time one piece of an answer may wait for a client that does not read; after twice that
        time without progress the connection is aborted.
    acknowledge_deadline_s : float
        Longest wait for the journal before a sender hears 503.
    requests_max : int
        Requests worked on at one time; beyond it 503.
    connections_max : int
        Open connections; a new one then replaces the one that has been idle longest.
    streams_max : int
        Open WebSocket and SSE streams together; beyond it 503.
    threads : int
        Threads that encode and decode beside the event loop.
    stream_batch_interval_s : float
        Longest time an event waits for others to be sent with it.
    stream_batch_events_max : int
        Most events in one message of a stream.
    stream_heartbeat_s : float
        Longest silence on a stream.
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
