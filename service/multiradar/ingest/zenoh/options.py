"""What can be set of the Zenoh side of the service."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from multiradar.errors import ConfigurationError

Mode = Literal["peer", "client", "router"]
_LEASE_FACING_SUBSCRIBERS_S = 10.0
_LEASE_BEHIND_A_ROUTER_S = 2.0
_MODES = ("peer", "client", "router")


@dataclass(frozen=True, slots=True)
class ZenohOptions:
    """Settings of the Zenoh session and of what is published; the defaults reach this host only.

    Attributes
    ----------
    mode : str
        peer (embedded, the default), client (of a router) or router.
    listen, connect : tuple of str
        Endpoints such as `tcp/127.0.0.1:7447`.
    multicast : bool
        Whether others are looked for, and told of, by multicast.
    config_file : Path, optional
        Zenoh configuration (JSON5) for mTLS and access control; it then decides mode and endpoints.
    client_wait_s : float
        How long a client waits for its router at the start, s.
    lease_s : float
        A peer that hears nothing of this session for so long takes it for lost, s. None: 10 s where
        others connect to it, 2 s where nobody does. A subscriber that sleeps in its callback hears
        nothing meanwhile; with 2 s it closes the connection when it wakes, and whatever
        was on its way is lost with it. A router does not sleep.
    message_bytes_max : int
        Largest message that is taken in.
    message_rows_max : int
        Most measurements in one message.
    cache_samples_max : int
        Updates kept of one track for subscribers that come late or fall behind.
    cache_samples_total : int
        Sets the share of each track when there are many: its cache holds this number divided by the
        number of tracks, but never less than `CACHE_SAMPLES_MIN`.
    catch_up_samples_max : int
        Track updates kept for queries with `after`.
    status_period_s : float
        Time between two publications of the status, s.
    retention_s : float
        How long an ended track can still be caught up with, s.
    """

    mode: Mode = "peer"
    listen: tuple[str, ...] = ("tcp/127.0.0.1:7447",)
    connect: tuple[str, ...] = ()
    multicast: bool = False
    config_file: Path | None = None
    client_wait_s: float = 5.0
    lease_s: float | None = None
    message_bytes_max: int = 16 * 1024 * 1024
    message_rows_max: int = 100_000
    cache_samples_max: int = 1024
    cache_samples_total: int = 150_000
    catch_up_samples_max: int = 200_000
    status_period_s: float = 1.0
    retention_s: float = 600.0

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
            raise ConfigurationError("zenoh mode client: expected an endpoint to connect to")
        for name in _POSITIVE:
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise ConfigurationError(f"zenoh {name}: expected more than 0, was {value}")


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
)
