"""The composition root: builds the adapters and connects them."""

import os
from collections.abc import Callable, Sequence
from contextlib import ExitStack

import structlog
from starlette.types import ASGIApp

from multiradar.access.authentication import Authentication, with_default_file
from multiradar.access.exposure import require_credentials
from multiradar.api.connections.server import TlsFiles
from multiradar.api.factory import create_api, create_apis
from multiradar.api.http_server import LOOPBACK_NAMES, HttpServer
from multiradar.api.routes.overlays import overlay_routes
from multiradar.clock import SystemClock
from multiradar.cluster.ray_steps import steps_of
from multiradar.errors import ConfigurationError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.ingest.asterix_configured import asterix_gateway
from multiradar.ingest.asterix_output.sender import AsterixSender, Outlet
from multiradar.ingest.asterix_output.sinks import open_sink
from multiradar.ingest.feeds.configured import configured_feeds
from multiradar.ingest.http import IntakeBounds, measurement_routes
from multiradar.ingest.http_sensors import sensor_change_routes
from multiradar.ingest.zenoh.certificates import watch_certificates
from multiradar.ingest.zenoh.gateway import ZenohGateway
from multiradar.ingest.zenoh.handovers import region_exchange
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import require_guarded
from multiradar.observability.asterix_metrics import AsterixCollector
from multiradar.observability.feed_metrics import FeedCollector
from multiradar.observability.metrics import REGISTRY, watch
from multiradar.observability.pipeline_metrics import PipelineCollector, ReadinessCollector
from multiradar.observability.supervisor import Supervisor
from multiradar.observability.traces import open_traces
from multiradar.runtime.admission.admission_by_time import data_clock_of
from multiradar.runtime.asterix.channel import Channel
from multiradar.runtime.asterix.options import channel_options
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.engine.fingerprint import (
    configuration_fingerprint,
    configuration_text,
    differences,
)
from multiradar.runtime.kernel_purposes import serve_purposes
from multiradar.runtime.live import readiness
from multiradar.runtime.live.output_feed import OutputFeed
from multiradar.runtime.live.service import Service
from multiradar.runtime.live.snapshots import SnapshotRules
from multiradar.runtime.recorded.history import keep_history
from multiradar.runtime.recorded.history_writer import HistoryRules
from multiradar.runtime.recorded.run import RecordedRun
from multiradar.runtime.recorded.view import RecordedService
from multiradar.runtime.standby.following import Standby
from multiradar.runtime.trajectories.feed import TrajectoryFeed
from multiradar.runtime.trajectories.options import trajectory_options
from multiradar.runtime.warm_up import warm_up
from multiradar.settings.limits import HttpLimits
from multiradar.settings.service import Settings
from multiradar.storage.overlays import Overlays, read_overlays
from multiradar.storage.retention import Retained
from multiradar.storage.snapshots import SnapshotFolder
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar_compiled.ahead import compile_ahead
from multiradar_compiled.kernel_list import kernels_for
from multiradar_schemas.sensors.sensor import SensorsFile

_log = structlog.get_logger("multiradar.app")

#: Interval between log entries on compilation, s.
_LOG_PERIOD_S = 5.0
#: A drained service has closed its Zenoh endpoints after so long at most, s.
_LISTEN_WAIT_S = 30.0


class Application:
    """The whole service: journal, engine, HTTP, Zenoh.

    Parameters
    ----------
    settings : Settings
        All settings.
    sensors : SensorTable
        The sensors.
    on_failure : callable
        Called from another thread when a component has stopped for good: the process must end.
    described : SensorsFile, optional
        The sensors as described, so that they can change while the service runs.
    on_drain : callable
        Called from another thread when an operator drains the service: the process must stop.

    Raises
    ------
    ConfigurationError
        If it cannot listen on a configured address, or clients beyond loopback would need no
        credentials.
    """

    def __init__(
        self,
        settings: Settings,
        sensors: SensorTable,
        on_failure: Callable[[], None],
        described: SensorsFile | None = None,
        on_drain: Callable[[], None] = lambda: None,
    ) -> None:
        self._settings = settings
        self._sensors = sensors
        self._watched = ExitStack()
        authentication = Authentication(with_default_file(settings.access))
        require_credentials(settings, authentication.required)
        zenoh = zenoh_options(settings, authentication)
        if settings.zenoh.enabled:
            require_guarded(zenoh)
        service = self.service = build_service(settings, sensors, on_failure, described)
        self._supervisor = Supervisor(os.environ, lambda: self.service.stalled)
        self._asterix = asterix_gateway(settings, sensors, self.service)
        self._feeds = configured_feeds(settings.feeds, sensors, service, service.reception)
        if self._feeds is not None:
            self.service.publication.count_edge("feeds", self._feeds.counts.document)
        self._edges = [edge for edge in (self._asterix, self._feeds) if edge is not None]
        state = settings.journal.path, settings.retention.archive
        retained = Retained(*state, data_clock_of, SystemClock())
        self.service.publication.count_edge("retained", retained.document)
        if (folder := settings.history.folder) is not None:
            kept = settings.history.days, settings.history.octets, settings.runtime_limits()
            rules = HistoryRules(folder, *kept, settings.journal.path)
            keep_history(self.service, rules, settings.tracking_settings())
        self._end_traces: Callable[[], None] = lambda: None
        if settings.traces.endpoint is not None:
            self.service.publication.traces, self._end_traces = open_traces(
                settings.traces.endpoint, settings.traces.fraction, SystemClock()
            )
        self._http = http_server(self.service, settings, authentication, on_failure, on_drain)
        watch_certificates(self.service, settings, zenoh)
        self._gateway = zenoh_gateway(self.service, settings, zenoh)
        regions = region_exchange(self.service, settings, authentication.settings)
        self._zenoh = [one for one in (self._gateway, regions) if one is not None]
        self._sender = asterix_sender(self.service, settings, sensors)
        self._trajectories = trajectory_feed(self.service, settings, sensors)
        self._standby: Standby | None = None
        self._started = False

    @property
    def http_url(self) -> str:
        """Address of the HTTP server, with the actual port."""
        return self._http.url

    @property
    def zenoh_endpoints(self) -> tuple[str, ...]:
        """Endpoints of Zenoh; empty before the start, or without Zenoh."""
        return () if self._gateway is None else self._gateway.endpoints

    @property
    def asterix_endpoints(self) -> tuple[str, ...]:
        """Endpoints that receive ASTERIX; empty before the start, or without listeners."""
        return () if self._asterix is None else self._asterix.endpoints

    @property
    def feed_endpoints(self) -> tuple[str, ...]:
        """Addresses of the feeds; empty before the start, or without feeds."""
        return () if self._feeds is None else self._feeds.endpoints

    @property
    def following(self) -> bool:
        """Whether it is the standby of another service."""
        return self._standby is not None and not self._started

    def start(self) -> None:
        """Open the journal, serve HTTP, compile kernels, replay, then ingest measurements.

        During the replay `/readyz` reports it and measurements are answered 503; ASTERIX, which no
        sender would repeat, is buffered. A standby then follows the journal; nothing is received or
        published until it takes over.
        """
        # A wrong journal is reported at once, before kernels are compiled.
        journal = self.service.open()
        self._supervisor.start()
        self.service.start_step = "looking for kernels"
        self._watched.callback(watch(REGISTRY, ReadinessCollector(self.service, readiness.CODES)))
        self._http.start()
        self._compile()
        if isinstance(journal, SqliteJournal) and journal.following:
            self._standby = Standby(self.service, journal, SystemClock(), self._begin)
        else:
            self._open_edges()
        warm_up(self._sensors, self._settings.tracking_settings())
        if self._sender is not None:
            self._sender.start()
        if self._trajectories is not None:
            self._trajectories.start()
        (self._standby or self.service).start()
        if self._trajectories is not None:
            # A standby, too, processes as fast as the primary.
            self._trajectories.go_live()
        if self._standby is None:
            self._begin()
        else:
            _log.info("following", http=self.http_url)
        self._watch()
        self._supervisor.ready()

    def _open_edges(self) -> None:
        for edge in self._edges:
            edge.start()

    # All further data are new. Zenoh is last: its ports may be those of the service before.
    def _begin(self) -> None:
        if self._sender is not None:
            self._sender.begin()
        if self._standby is not None:
            self._open_edges()
        for edge in self._edges:
            edge.begin()
        for part in self._zenoh:
            part.start()
        self._started = True
        _log.info("started", http=self.http_url)

    def _watch(self) -> None:
        self._watched.callback(watch(REGISTRY, PipelineCollector(self.service.view.status)))
        if self._asterix is not None:
            self._watched.callback(watch(REGISTRY, AsterixCollector(self._asterix.counts.document)))
        if self._feeds is not None:
            self._watched.callback(watch(REGISTRY, FeedCollector(self._feeds.counts.document)))

    # In parallel processes, before this process would compile the same kernels one by one.
    def _compile(self) -> None:
        clock = SystemClock()
        started_s = logged_s = clock.monotonic_s()

        def on_progress(done: int, total: int) -> None:
            nonlocal logged_s
            now_s = clock.monotonic_s()
            self.service.start_step = f"compiling kernels (first use): {done} of {total}"
            if now_s - logged_s >= _LOG_PERIOD_S or done in (0, total):
                logged_s = now_s
                elapsed_s = round(now_s - started_s)
                _log.info("compiling_kernels", done=done, total=total, elapsed_s=elapsed_s)

        purposes = serve_purposes(
            self._settings.tracking_settings(),
            self._sensors,
            trajectories=bool(self._settings.trajectories.aircraft_max),
            asterix=self._asterix is not None,
            feeds=self._feeds is not None,
        )
        compile_ahead(kernels_for(purposes), on_progress)
        self.service.start_step = "loading kernels"

    def stop(self) -> None:
        """Stop ingest, finish pending work, close everything; valid in any state.

        The journal is closed as soon as all is processed, so that a standby takes over while this
        service publishes the rest, and answers reads and pending requests.
        """
        self._supervisor.stop()
        if self._standby is not None:
            self._standby.stop()
        for edge in self._edges:
            edge.stop()
        self.service.drain()
        # At once: its end of service must not follow the first report of a standby.
        if self._sender is not None:
            self._sender.stop()
        for part in self._zenoh:
            part.stop()
        self._http.stop()
        self._watched.close()
        if self._trajectories is not None:
            self._trajectories.stop()
        self.service.stop()
        self._end_traces()
        if self._started:
            _log.info("stopped")


def build_service(
    settings: Settings,
    sensors: SensorTable,
    on_failure: Callable[[], None] = lambda: None,
    described: SensorsFile | None = None,
) -> Service:
    """Return the live pipeline on a real journal and engine; not started.

    Raises
    ------
    ConfigurationError
        If a standby would have Ray actors.
    """
    if settings.journal.standby and settings.engine == "ray":
        raise ConfigurationError(
            "settings: engine: expected threads because journal.standby is set, was ray: the "
            "actors of both services would need twice the resources"
        )
    tracking, journal = settings.tracking_settings(), settings.journal.path
    shards = steps_of(settings, settings.workers)
    fingerprint = configuration_fingerprint(sensors, tracking)
    text = "" if described is None else configuration_text(described, tracking)
    service = Service(
        open_journal=lambda: SqliteJournal(
            journal, fingerprint, text, differences, standby=settings.journal.standby
        ),
        open_engine=lambda: Engine(
            sensors, tracking, settings.workers, open_steps=shards, sampling=Sampling.ALL
        ),
        sensors=sensors,
        tracking=tracking,
        limits=settings.runtime_limits(),
        on_failure=on_failure,
        snapshots=snapshot_rules(settings, fingerprint),
        described=described,
    )
    if shards is not None:
        service.publication.count_edge("cluster", shards.document)
    return service


def snapshot_rules(settings: Settings, fingerprint: str) -> SnapshotRules | None:
    """Return where snapshots are, and when they are taken; None where they are disabled."""
    wanted = settings.journal
    if not wanted.snapshot_interval_s:
        return None
    return SnapshotRules(
        SnapshotFolder(wanted.path), wanted.snapshot_interval_s, wanted.snapshot_rows, fingerprint
    )


def zenoh_gateway(
    service: Service, settings: Settings, options: ZenohOptions
) -> ZenohGateway | None:
    """Return the Zenoh interface, not started; None when disabled."""
    if not settings.zenoh.enabled:
        return None
    gateway = ZenohGateway(service, options)
    service.publication.count_edge("zenoh", gateway.document)
    service.unready_checks.append(gateway.lost)
    return gateway


def asterix_sender(
    service: Service, settings: Settings, sensors: SensorTable
) -> AsterixSender | None:
    """Return the sender of system tracks, not started; None without recipients.

    Raises
    ------
    ConfigurationError
        If one of the recipients cannot be reached.
    """
    if not settings.asterix.output:
        return None
    outlets = [
        Outlet(one.label, Channel(channel_options(one)), open_sink(one))
        for one in settings.asterix.output
    ]
    feed = OutputFeed()
    service.publication.feed(feed, "asterix.output")
    sender = AsterixSender(
        feed, service.view.live_ids, sensors, settings.tracking_settings(), outlets
    )
    service.publication.count_edge("asterix_output", sender.counts)
    return sender


def trajectory_feed(
    service: Service, settings: Settings, sensors: SensorTable
) -> TrajectoryFeed | None:
    """Return the feed of trajectory bundles, not started; None when disabled."""
    wanted = settings.trajectories
    if not wanted.aircraft_max:
        return None
    options = trajectory_options(**wanted.model_dump())
    feed = TrajectoryFeed(options, sensors, settings.tracking_settings())
    service.publication.keep(feed)
    return feed


def http_server(
    service: Service,
    settings: Settings,
    authentication: Authentication,
    on_failure: Callable[[], None],
    on_drain: Callable[[], None],
) -> HttpServer:
    """Return the HTTP server with all routes, not started.

    Raises
    ------
    ConfigurationError
        If it cannot listen, or the folder of overlays or a file of TLS cannot be read.
    """
    limits, wanted, access = settings.http_limits(), settings.server, settings.access
    intake = IntakeBounds(
        rows_max=settings.rows_per_message_max,
        acknowledge_deadline_s=limits.acknowledge_deadline_s,
    )
    routers = (
        measurement_routes(service, intake, on_drain),
        sensor_change_routes(service, limits.acknowledge_deadline_s),
        overlay_routes(overlays_of(settings)),
    )

    def build(allowed_hosts: Sequence[str]) -> ASGIApp:
        return create_api(
            service,
            limits,
            routers=routers,
            allowed_hosts=allowed_hosts,
            authentication=authentication,
        )

    tls = None
    if access.certificate is not None and access.private_key is not None:
        tls = TlsFiles(access.certificate, access.private_key, access.client_authority)
    return HttpServer(
        build, wanted.host, wanted.port, limits, on_failure, tls=tls, names=wanted.names
    )


def view_server(
    runs: Sequence[RecordedRun], overlays: Overlays, port: int, on_failure: Callable[[], None]
) -> HttpServer:
    """Return an HTTP server that shows recorded runs on loopback, not started.

    Raises
    ------
    ConfigurationError
        If it cannot listen.
    """
    limits = HttpLimits()
    routers = (overlay_routes(overlays),)

    def build(allowed_hosts: Sequence[str]) -> ASGIApp:
        services = [RecordedService(one) for one in (runs, runs[::-1])[: len(runs)]]
        return create_apis(services, limits, routers=routers, allowed_hosts=allowed_hosts)

    return HttpServer(build, LOOPBACK_NAMES[0], port, limits, on_failure)


def overlays_of(settings: Settings) -> Overlays:
    """Return the overlays of the page; those that cannot be used are logged.

    Raises
    ------
    ConfigurationError
        If their folder cannot be read.
    """
    folder = settings.page.overlays
    overlays = () if folder is None else read_overlays(folder)
    for one in overlays:
        if one.problem:
            _log.warning("overlay_not_used", file=one.name, reason=one.problem)
    return overlays


def zenoh_options(settings: Settings, authentication: Authentication) -> ZenohOptions:
    """Return the Zenoh options; clients and message bounds are those of HTTP."""
    http = settings.http_limits()
    return ZenohOptions(
        query_threads=http.query_threads,
        query_deadline_s=http.query_deadline_s,
        access=authentication.settings.model_copy(update={"clients": authentication.clients.all}),
        **settings.zenoh.model_dump(exclude={"enabled"}),
        listen_wait_s=_LISTEN_WAIT_S if settings.journal.standby else 0.0,
        message_bytes_max=http.body_bytes_max,
        message_rows_max=settings.rows_per_message_max,
    )
