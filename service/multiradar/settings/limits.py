"""Limits of the service with their defaults: the sections `http` and `runtime` of the settings."""

from dataclasses import dataclass, fields

from multiradar.errors import ConfigurationError


@dataclass(frozen=True, slots=True)
class HttpLimits:
    """Limits for clients.

    Attributes
    ----------
    body_bytes_max : int
        Maximum size of a request body; larger ones are answered 413.
    bodies_bytes_max : int
        Maximum total size of request bodies in memory; beyond it the one that has been arriving
        longest is ended with 408, or a new one answered 503.
    client_bodies_bytes_max : int
        The same of one client; beyond it 429. A client is a name with credentials, or an address.
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
        Maximum concurrent requests, each from the arrival of its body on; beyond it 503.
    client_requests_max : int
        The same of one client; beyond it 429.
    connections_max : int
        Maximum open connections; beyond it a new one replaces the one that has been idle, or
        sending its request, longest.
    client_connections_max : int
        The same of one address, of which the connection is then replaced.
    streams_max : int
        Maximum open WebSocket and SSE streams together; beyond it 503.
    client_streams_max : int
        The same of one client; beyond it 429.
    threads : int
        Threads for encoding and decoding.
    query_threads : int
        Further threads, for expensive queries: encounters, trajectories, forecasts, analyses of
        tracks, pictures and histories.
    client_queries_max : int
        Maximum concurrent expensive queries of one client; beyond it 429.
    query_deadline_s : float
        Maximum time of an expensive query; beyond it 503.
    stream_batch_interval_s : float
        Interval over which events are collected into a batch, from the last batch on that was not
        full.
    stream_batch_events_max : int
        Maximum events in a message of a stream.
    stream_heartbeat_s : float
        Heartbeat interval of a stream.
    """

    body_bytes_max: int = 16 * 1024 * 1024
    bodies_bytes_max: int = 96 * 1024 * 1024
    client_bodies_bytes_max: int = 64 * 1024 * 1024
    header_bytes_max: int = 16 * 1024
    header_deadline_s: float = 10.0
    body_deadline_s: float = 30.0
    send_deadline_s: float = 10.0
    acknowledge_deadline_s: float = 30.0
    requests_max: int = 128
    client_requests_max: int = 64
    connections_max: int = 512
    client_connections_max: int = 256
    streams_max: int = 200
    client_streams_max: int = 100
    threads: int = 4
    query_threads: int = 2
    client_queries_max: int = 16
    query_deadline_s: float = 10.0
    stream_batch_interval_s: float = 0.1
    stream_batch_events_max: int = 500
    stream_heartbeat_s: float = 5.0


@dataclass(frozen=True, slots=True)
class RuntimeLimits:
    """Sizes of queues, rings and pages; none changes the result of an accepted measurement.

    Attributes
    ----------
    intake_batches_max, intake_rows_max : int
        Capacity of the queue to the journal, in messages and rows; further messages are rejected
        with a request to retry.
    source_batches_max, source_rows_max : int
        The same of one source: its messages do not keep out those of others.
    commit_batches_max, commit_rows_max : int
        Maximum messages, and rows of all but the last of them, per transaction of the journal.
    quarantine_rejects_min : int
        Rejected rows of the last minutes, nine of ten of all, from which a source is in quarantine.
    quarantine_rows_per_s : int
        Rows a second that a source in quarantine may send.
    backlog_rows_max : int
        Capacity of the queue from the journal to the engine, rows; when it is full the journal
        waits.
    push_rows_max : int
        Maximum measurements per call of the engine (a larger message is not split).
    events_max : int
        Events retained for subscribers that resume.
    history_rows_max, bias_history_rows_max : int
        Rows of track history and bias history retained in memory.
    transition_rows_max : int
        State transitions of tracks retained in memory.
    plot_rows_max : int
        Measurements of the updates retained in memory.
    state_bytes_max : int
        Memory of the filter states retained for forecasts and encounters of the past.
    rejects_kept_max : int
        Rejected measurements retained in memory, per code.
    page_rows_max : int
        Maximum rows of an answer of a history or of the quarantine.
    forecast_steps_max : int
        Maximum points of a forecast.
    status_period_s : float
        Interval of status events, s of data time.
    clock_ahead_max_s : float
        Maximum time of a live measurement ahead of the clock, s.
    retry_after_s : float
        Retry-After when the intake queue is full, s.
    lag_max_s : float
        Maximum time since reception of the oldest message in a stage of the pipeline, s; beyond it
        the service is not ready.
    stall_max_s : float
        Maximum duration of a call of the engine, s; beyond it the service is not alive.
    disk_free_bytes_min : int
        Free space on the disk of the journal below which the service is not ready.
    disk_filling_share, disk_nearly_full_share : float
        Used shares of that disk from which the alarms `disk_filling` and `disk_nearly_full` are
        raised; 1 or more: never.
    """

    intake_batches_max: int = 2048
    intake_rows_max: int = 524_288
    source_batches_max: int = 1024
    source_rows_max: int = 262_144
    commit_batches_max: int = 64
    commit_rows_max: int = 65_536
    quarantine_rejects_min: int = 100_000
    quarantine_rows_per_s: int = 1000
    backlog_rows_max: int = 262_144
    push_rows_max: int = 8192
    events_max: int = 200_000
    history_rows_max: int = 2_000_000
    bias_history_rows_max: int = 200_000
    transition_rows_max: int = 500_000
    plot_rows_max: int = 500_000
    state_bytes_max: int = 64 * 1024 * 1024
    rejects_kept_max: int = 1000
    page_rows_max: int = 10_000
    forecast_steps_max: int = 1000
    status_period_s: float = 10.0
    clock_ahead_max_s: float = 60.0
    retry_after_s: float = 1.0
    lag_max_s: float = 10.0
    stall_max_s: float = 60.0
    disk_free_bytes_min: int = 64 * 1024 * 1024
    disk_filling_share: float = 0.8
    disk_nearly_full_share: float = 0.9

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not value > 0:
                raise ConfigurationError(
                    f"{field.name}: expected a bound greater than 0, was {value}"
                )
