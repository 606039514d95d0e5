"""Options of the Zenoh interface."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from multiradar.errors import ConfigurationError
from multiradar.settings.access import AccessSettings

Mode = Literal["peer", "client", "router"]
_LEASE_FACING_SUBSCRIBERS_S = 10.0
_LEASE_BEHIND_A_ROUTER_S = 2.0
_MODES = ("peer", "client", "router")


@dataclass(frozen=True, slots=True)
class ZenohOptions:
    """Options of the Zenoh session and of publication; the defaults reach this host only.

    Attributes
    ----------
    mode : str
        peer (embedded, default), client (of a router) or router.
    listen, connect : tuple of str
        Endpoints such as `tcp/127.0.0.1:7447`.
    multicast : bool
        Whether to discover peers by multicast.
    config_file : Path, optional
        Zenoh configuration (JSON5) for mTLS and access control; it overrides mode and endpoints.
    access : AccessSettings
        Clients, and the files of TLS; others than these clients are denied everything.
    client_wait_s : float
        How long a client waits for its router at the start, s.
    listen_wait_s : float
        How long a busy endpoint is tried again, s: one of a standby, which the service before may
        still close.
    lease_s : float
        Lease of the connection, s: a peer that receives nothing of this session for so long closes
        it. None: 10 s if others connect to it, else 2 s. A subscriber that blocks in its callback
        receives nothing meanwhile; with 2 s it then closes the connection and loses the samples in
        transit. A router does not block.
    message_bytes_max : int
        Maximum size of a message.
    message_rows_max : int
        Maximum number of measurements in a message.
    cache_samples_max : int
        Cached updates of a track for subscribers that join late or fall behind.
    cache_samples_total : int
        Total cache size: with many tracks the cache of each holds this number divided by the
        number of tracks, but at least `CACHE_SAMPLES_MIN`.
    catch_up_samples_max : int
        Track updates retained for queries with `after`.
    status_period_s : float
        Status publication interval, s.
    query_threads : int
        Threads of expensive queries, which have no others.
    query_deadline_s : float
        Maximum time from an expensive query to its answer.
    region : str or None
        Of the session between neighbouring regions, the name of this one.
    neighbours : tuple of str
        The names of the others.
    retention_s : float
        Retention of the updates of a dropped track, s.
    """

    mode: Mode = "peer"
    listen: tuple[str, ...] = ("tcp/127.0.0.1:7447",)
    connect: tuple[str, ...] = ()
    multicast: bool = False
    config_file: Path | None = None
    access: AccessSettings = field(default_factory=AccessSettings)
    client_wait_s: float = 5.0
    listen_wait_s: float = 0.0
    lease_s: float | None = None
    message_bytes_max: int = 16 * 1024 * 1024
    message_rows_max: int = 100_000
    cache_samples_max: int = 1024
    cache_samples_total: int = 150_000
    catch_up_samples_max: int = 200_000
    status_period_s: float = 1.0
    retention_s: float = 600.0
    query_threads: int = 2
    query_deadline_s: float = 10.0
    region: str | None = None
    neighbours: tuple[str, ...] = ()

    @property
    def lease_ms(self) -> int:
        """The lease, in whole milliseconds."""
        faced = _LEASE_FACING_SUBSCRIBERS_S if self.listen else _LEASE_BEHIND_A_ROUTER_S
        return round((faced if self.lease_s is None else self.lease_s) * 1000.0)

    def __post_init__(self) -> None:
        if self.mode not in _MODES:
            raise ConfigurationError(
                f"zenoh mode: expected one of {', '.join(_MODES)}, was {self.mode!r}"
            )
        if self.mode == "client" and not self.connect and self.config_file is None:
            raise ConfigurationError(
                "zenoh mode client: no endpoint to connect to; set zenoh.connect"
            )
        for name in _POSITIVE:
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise ConfigurationError(f"zenoh {name}: expected a number above 0, was {value}")


_POSITIVE = (
    "client_wait_s",
    "lease_s",
    "message_bytes_max",
    "message_rows_max",
    "cache_samples_max",
    "cache_samples_total",
    "catch_up_samples_max",
    "status_period_s",
    "retention_s",
    "query_threads",
    "query_deadline_s",
)
