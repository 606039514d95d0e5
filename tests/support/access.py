"""Clients of every role, and an application that asks for their keys."""

from pathlib import Path

from fastapi import FastAPI

from multiradar.access.authentication import Authentication
from multiradar.access.clients import key_digest
from multiradar.api.factory import create_api
from multiradar.api.routes.overlays import overlay_routes
from multiradar.clock import Clock
from multiradar.ingest.http import measurement_routes
from multiradar.ingest.http_sensors import sensor_change_routes
from multiradar.settings.access import AccessSettings, ClientSettings, IssuerSettings, Role
from multiradar.storage.overlays import Overlays
from support.fakes.fake_service import FakeService

#: A key of each client; `radar` is bound to the sensor 41-10.
KEYS = {name: f"mr_{name}-{'k' * 30}" for name in ("feed", "display", "operate", "radar", "rival")}
_ROLES = {"radar": Role.FEED, "rival": Role.FEED}


def bearer(key: str) -> dict[str, str]:
    """Return the header of a request with a key or token."""
    return {"authorization": f"Bearer {key}"}


def clients() -> tuple[ClientSettings, ...]:
    """Return a client for each of `KEYS`."""
    return tuple(
        ClientSettings(
            name=name,
            role=_ROLES.get(name) or Role(name),
            key_sha256=key_digest(key),
            **({"sensors": ("41-10",)} if name == "radar" else {}),
        )
        for name, key in KEYS.items()
    )


def authentication(
    keys_file: Path | None = None,
    issuer: IssuerSettings | None = None,
    clock: Clock | None = None,
) -> Authentication:
    """Return what finds the callers with `KEYS`, or those of a file or an issuer."""
    listed = clients() if keys_file is None and issuer is None else ()
    settings = AccessSettings(clients=listed, keys_file=keys_file, issuer=issuer)
    return Authentication(settings, clock)


def guarded_api(
    service: FakeService, found: Authentication | None = None, overlays: Overlays = ()
) -> FastAPI:
    """Return the whole application, which asks for credentials."""
    routers = (measurement_routes(service), sensor_change_routes(service), overlay_routes(overlays))
    return create_api(service, routers=routers, authentication=found or authentication())
