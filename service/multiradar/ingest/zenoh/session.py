"""The Zenoh session as inlet and outlet.

Reasons for its design (measured with 1.10, see docs/reference/zenoh-design.md):

- Data for subscribers are sent with congestion control DROP: BLOCK lets one slow subscriber delay
  all others and is not lossless either. Dropped samples are recovered from caches.
- Updates have a lower priority than the answers of the caches, so that new updates do not delay a
  subscriber that catches up. The first update of a stream has the priority of the answers: an
  advanced subscriber takes the first sample of a source as its beginning, so this sample must not
  be lost behind other updates and must not overtake the end of the history.
- An advanced publisher has one priority. It therefore provides only the cache and the heartbeat,
  is confined to this session, and the session puts the samples in its name.
- Publisher detection is off: with it, an advanced subscriber that joins while samples arrive loses
  the history of the sources that it detects. Instead there is one token for all histories: a
  subscriber that reconnects requests everything and withholds new samples until it is answered.
"""

import json
import re
import socket
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import zenoh
import zenoh.ext

from multiradar.access.exposure import is_local, locator
from multiradar.access.security_log import SECURITY_LOG
from multiradar.errors import ConfigurationError
from multiradar.ingest.zenoh.access_control import access_control, handover_control
from multiradar.ingest.zenoh.bus import JSON, BusCounts, Message, Request
from multiradar.ingest.zenoh.keys import INSTANCES, TRACK_HISTORY
from multiradar.ingest.zenoh.links import missing_links
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.settings.access import AccessSettings

#: Batches queued for a slow peer, by priority; 16 is the maximum of Zenoh.
_QUEUE_BATCHES = 16
_PRIORITIES = (
    "control",
    "real_time",
    "interactive_high",
    "interactive_low",
    "data_high",
    "data",
    "data_low",
    "background",
)
_FIRST = zenoh.Priority.DATA
_UPDATES = zenoh.Priority.DATA_LOW
_SEQUENCE_END = 2**32
_DROP = zenoh.CongestionControl.DROP


# Protocols whose endpoints have certificates.
_CERTIFIED = ("tls/", "quic/")
_DENIED = (
    "clients are configured, and this endpoint has no certificate with the name of one; all its "
    "messages are denied, unless zenoh.config_file contains access control"
)
# An endpoint in a text, of a configuration file for example, and its options.
_OPTIONS = re.compile(r"(?<![^\s\[(,\"'])([\w\[][\w\[\]/.:@%*+-]*)[?#][^\s\"']*")
# A busy endpoint is tried again so often.
_LISTEN_RETRY = {"period_init_ms": 20, "period_max_ms": 100, "period_increase_factor": 2}


def zenoh_config(options: ZenohOptions) -> zenoh.Config:
    """Return the configuration of the session.

    Parameters
    ----------
    options : ZenohOptions
        Only the needs of the streams are added to a configuration file.

    Raises
    ------
    ConfigurationError
        If the file or an endpoint is not valid.
    """
    wanted: dict[str, Any] = {
        "timestamping/enabled": True,
        **{f"transport/link/tx/queue/size/{name}": _QUEUE_BATCHES for name in _PRIORITIES},
        "listen/timeout_ms": round(options.listen_wait_s * 1000.0),
        "listen/retry": _LISTEN_RETRY,
    }
    if options.config_file is None:
        wanted |= {
            "mode": options.mode,
            "listen/endpoints": list(options.listen),
            "listen/exit_on_failure": True,
            "connect/endpoints": list(options.connect),
            # A peer discovers others in the background. A client needs its router: it waits for it
            # at the start, and reconnects later.
            "connect/timeout_ms": round(options.client_wait_s * 1000.0)
            if options.mode == "client"
            else -1,
            "connect/exit_on_failure": options.mode == "client",
            "scouting/multicast/enabled": options.multicast,
            "scouting/gossip/enabled": False,
            "transport/link/tx/lease": options.lease_ms,
            "transport/link/rx/max_message_size": options.message_bytes_max,
            **_tls(options.access),
        }
    try:
        config = (
            zenoh.Config()
            if options.config_file is None
            else zenoh.Config.from_file(str(options.config_file))
        )
        for key, value in wanted.items():
            config.insert_json5(key, json.dumps(value))
    except zenoh.ZError as error:
        source = "settings" if options.config_file is None else str(options.config_file)
        reason = first_line(error, (*options.listen, *options.connect))
        raise ConfigurationError(f"{source}: {reason}") from error
    return config


def _tls(access: AccessSettings) -> dict[str, Any]:
    if access.certificate is None:
        return {}
    own = {
        "certificate": str(access.certificate),
        "private_key": str(access.private_key),
    }
    link: dict[str, Any] = {
        f"{side}_{name}": path for side in ("listen", "connect") for name, path in own.items()
    }
    if access.client_authority is not None:
        link |= {
            "enable_mtls": True,
            "root_ca_certificate": str(access.client_authority),
            "close_link_on_expiration": True,
        }
    return {f"transport/link/tls/{name}": value for name, value in link.items()}


# Of a session that serves: the same rules would deny answers to a session that asks. A file without
# access control of its own gets it, too.
def _guard(config: zenoh.Config, options: ZenohOptions) -> None:
    if not _is_controlled(config):
        access, region = options.access, options.region
        rules = (
            access_control(access, is_local=_is_of_this_machine(config))
            if region is None
            else handover_control(region, options.neighbours, certified=_is_certified(config))
        )
        config.insert_json5("access_control", json.dumps(rules))
        if region is None and access.has_credentials:
            for one in _endpoints(config, "connect"):
                if not one.startswith(_CERTIFIED):
                    SECURITY_LOG.warning("peer_denied", endpoint=locator(one), reason=_DENIED)


def _is_controlled(config: zenoh.Config) -> bool:
    return bool(json.loads(config.get_json("access_control"))["enabled"])


# Sessions that are discovered may be of other hosts.
def _is_of_this_machine(config: zenoh.Config) -> bool:
    discovers = (config.get_json(f"scouting/{one}/enabled") for one in ("multicast", "gossip"))
    endpoints = (*_endpoints(config, "listen"), *_endpoints(config, "connect"))
    return set(discovers) == {"false"} and all(map(is_local, endpoints))


def all_may_operate(options: ZenohOptions) -> bool:
    """Return whether all sessions may operate: of this machine only, and no rule decides.

    Parameters
    ----------
    options : ZenohOptions
        Configuration of the session.
    """
    config = zenoh_config(options)
    is_open = not (options.access.has_credentials or _is_controlled(config))
    return is_open and _is_of_this_machine(config)


def _is_certified(config: zenoh.Config) -> bool:
    return bool(json.loads(config.get_json("transport/link/tls/enable_mtls")))


def require_guarded(options: ZenohOptions, setting: str = "zenoh.listen") -> None:
    """Check that clients from elsewhere need certificates.

    Parameters
    ----------
    options : ZenohOptions
        Configuration of the session.
    setting : str
        Name of the setting with its endpoints.

    Raises
    ------
    ConfigurationError
        If one could connect without, unless the settings allow it; it is then logged.
    """
    config = zenoh_config(options)
    listed = json.loads(config.get_json("listen/endpoints"))
    if isinstance(listed, dict):
        listed = listed.get(json.loads(config.get_json("mode")), [])
    certified = _is_certified(config)
    for endpoint in listed:
        if is_local(endpoint) or (certified and endpoint.startswith(_CERTIFIED)):
            continue
        reason = (
            f"{setting}: expected a loopback address, or tls/… with client certificates "
            f"(access.client_authority), was {locator(endpoint)}"
        )
        if not options.access.insecure:
            raise ConfigurationError(
                f"{reason}; or start with --insecure if any host on that network may send "
                f"measurements"
            )
        SECURITY_LOG.warning("insecure", reason=reason)


def _with_ports(options: ZenohOptions) -> ZenohOptions:
    """Return options with free ports for those that are 0: a session does not report its own."""
    return replace(options, listen=tuple(with_port(one) for one in options.listen))


def with_port(endpoint: str) -> str:
    """Return an endpoint with a free port if its port is 0."""
    found = re.fullmatch(r"(tcp|tls)/(.+):0([?#].*)?", endpoint)
    if found is None:
        return endpoint
    protocol, host, rest = found.groups()
    version = socket.AF_INET6 if host.startswith("[") else socket.AF_INET
    try:
        with socket.socket(version) as probe:
            probe.bind((host.strip("[]"), 0))
            return f"{protocol}/{host}:{probe.getsockname()[1]}{rest or ''}"
    except OSError:
        # The session says what is wrong with it.
        return endpoint


class ZenohBus:
    """A Zenoh session as inlet and outlet.

    Parameters
    ----------
    options : ZenohOptions
        Configuration of the session.

    Raises
    ------
    ConfigurationError
        If the session cannot be opened as configured.
    """

    def __init__(self, options: ZenohOptions) -> None:
        config = zenoh_config(_with_ports(options))
        _guard(config, options)
        listen, connect = _endpoints(config, "listen"), _endpoints(config, "connect")
        try:
            self._session = zenoh.open(config)
        except zenoh.ZError as error:
            reason = first_line(error, (*listen, *connect))
            raise ConfigurationError(f"cannot open the Zenoh session: {reason}") from error
        self.counts = BusCounts()
        self.endpoints = tuple(map(locator, listen))
        self._connected_to = tuple(map(locator, connect))
        self._is_client = json.loads(config.get_json("mode")) == "client"
        self.instance = str(self._session.zid())
        self._declared: list[Any] = []

    @property
    def links(self) -> int:
        """Number of links to other sessions."""
        return len(self._session.info.links())

    @property
    def unreachable(self) -> tuple[str, ...]:
        """Configured endpoints without a link, each as protocol and address."""
        linked = [str(link.dst) for link in self._session.info.links()]
        return missing_links(self._connected_to, linked, one=self._is_client)

    def announce(self) -> None:
        """Declare the liveliness tokens of this instance and of its histories."""
        for key in (f"{INSTANCES}/{self.instance}", TRACK_HISTORY):
            self._declared.append(self._session.liveliness().declare_token(key))

    def subscribe(self, key: str, handler: Callable[[Message], None]) -> None:
        """Call a handler with each sample on a key expression."""

        def on_sample(sample: zenoh.Sample) -> None:
            try:
                handler(
                    Message(
                        key=str(sample.key_expr),
                        payload=sample.payload.to_bytes(),
                        media_type=str(sample.encoding),
                        attachment=_bytes(sample.attachment),
                    )
                )
            except Exception as error:  # Zenoh would print it and continue.
                self.counts.report(error)

        self._declared.append(self._session.declare_subscriber(key, on_sample))

    def answer(self, key: str, handler: Callable[[Request], None]) -> None:
        """Call a handler with each query on a key expression."""

        def on_query(query: zenoh.Query) -> None:
            try:
                handler(_request(query))
            except Exception as error:
                # Otherwise the querier would get an empty answer.
                self.counts.report(error)
                _reject_and_drop(query)

        self._declared.append(self._session.declare_queryable(key, on_query))

    def watch(self, handler: Callable[[], None]) -> None:
        """Call a handler whenever another session connects to this one."""

        def on_event(event: zenoh.TransportEvent) -> None:
            if event.kind == zenoh.SampleKind.PUT:
                handler()

        self._declared.append(
            self._session.info.declare_transport_events_listener(on_event, history=False)
        )

    def put(self, key: str, payload: bytes, attachment: bytes) -> None:
        """Publish a JSON sample; never waits for a subscriber."""
        self._session.put(
            key,
            payload,
            encoding=JSON,
            congestion_control=_DROP,
            priority=_UPDATES,
            attachment=attachment,
        )

    def stream(self, key: str, depth: int, heartbeat_s: float) -> "ZenohStream":
        """Return a stream of updates that caches the last `depth`."""
        return ZenohStream(self._session, key, depth, heartbeat_s)

    def close(self) -> None:
        """Close the session; its liveliness token disappears."""
        for declared in self._declared:
            declared.undeclare()
        self._session.close()  # type: ignore[no-untyped-call]  # so in its stubs


class ZenohStream:
    """The updates of one key: the cache of an advanced publisher, and puts in its name."""

    def __init__(self, session: zenoh.Session, key: str, depth: int, heartbeat_s: float) -> None:
        self._session = session
        self._key = key
        self._cache = zenoh.ext.declare_advanced_publisher(
            session,
            self._key,
            encoding=JSON,
            congestion_control=_DROP,
            priority=_UPDATES,
            allowed_destination=zenoh.Locality.SESSION_LOCAL,
            cache=zenoh.ext.CacheConfig(depth),
            sample_miss_detection=zenoh.ext.MissDetectionConfig(
                heartbeat=heartbeat_s, sporadic_heartbeat=None
            ),
            publisher_detection=False,
        )
        self._count = 0
        self._source = self._cache.id

    def send(self, payload: bytes, attachment: bytes) -> None:
        """Publish and cache an update; never waits for a subscriber."""
        number = self._count
        # Cached first, so that a subscriber that misses it can query it.
        self.cache(payload, attachment)
        self._session.put(
            self._key,
            payload,
            encoding=JSON,
            congestion_control=_DROP,
            priority=_UPDATES if number else _FIRST,
            attachment=attachment,
            allowed_destination=zenoh.Locality.REMOTE,
            source_info=zenoh.SourceInfo(self._source, number % _SEQUENCE_END),
        )

    def cache(self, payload: bytes, attachment: bytes) -> None:
        """Cache an update without publishing it."""
        self._cache.put(payload, attachment=attachment)
        self._count += 1

    def close(self) -> None:
        """Discard the cache."""
        self._cache.undeclare()  # type: ignore[no-untyped-call]  # so in its stubs


def _endpoints(config: zenoh.Config, side: str) -> tuple[str, ...]:
    found = json.loads(config.get_json(f"{side}/endpoints"))
    if isinstance(found, dict):  # A list for each mode.
        found = found.get(json.loads(config.get_json("mode")) or "peer", [])
    return tuple(str(endpoint) for endpoint in found)


def _request(query: zenoh.Query) -> Request:
    payload = query.payload
    pairs = _pairs(str(query.parameters))
    times = Counter(name for name, _ in pairs)
    return Request(
        key=str(query.key_expr),
        parameters=dict(pairs),
        payload=None if payload is None else payload.to_bytes(),
        media_type="" if query.encoding is None else str(query.encoding),
        attachment=_bytes(query.attachment),
        reply=lambda key, content, attachment: query.reply(
            key, content, encoding=JSON, attachment=attachment
        ),
        reply_error=lambda content: query.reply_err(content, encoding=JSON),
        finish=query.drop,
        repeated=tuple(name for name, count in times.items() if count > 1),
    )


def _pairs(parameters: str) -> list[tuple[str, str]]:
    pairs = [part.partition("=") for part in parameters.split(";") if part]
    return [(name, value) for name, _, value in pairs]


def _bytes(content: zenoh.ZBytes | None) -> bytes:
    return b"" if content is None else content.to_bytes()


def _reject_and_drop(query: zenoh.Query) -> None:
    try:
        query.reply_err(b'{"code":"INTERNAL","reason":"the query failed"}', encoding=JSON)
    finally:
        query.drop()  # type: ignore[no-untyped-call]  # so in its stubs


def first_line(error: Exception, endpoints: Iterable[str] = ()) -> str:
    """Return the message of a Zenoh error without the location in its source.

    Of the configured endpoints, and of others that it quotes, only protocol and address are quoted.
    """
    text = str(error)
    for one in endpoints:
        text = text.replace(one, locator(one))
    text = _OPTIONS.sub(r"\1", text)
    return text.partition("\n")[0].partition(" at /")[0].rstrip(" !")[:300]
