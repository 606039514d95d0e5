"""The role that a route requires: each route declares one, or that it is public."""

from collections.abc import Iterable, Iterator
from typing import Annotated

from fastapi import Depends
from fastapi.dependencies.models import Dependant
from fastapi.params import Security
from fastapi.routing import APIRouter
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer, SecurityScopes
from starlette.requests import HTTPConnection

from multiradar.access.authentication import (
    CERTIFICATE,
    CREDENTIALS_INVALID,
    Authentication,
)
from multiradar.access.clients import Caller
from multiradar.access.exposure import is_loopback
from multiradar.access.security_log import SECURITY_LOG
from multiradar.access.shares import client_at
from multiradar.errors import ConfigurationError, RequestError
from multiradar.settings.access import Role


class _Bearer(HTTPBearer):
    async def __call__(self, request: HTTPConnection) -> HTTPAuthorizationCredentials | None:
        # The base needs headers only, which WebSockets have, too.
        return await super().__call__(request)


_bearer = _Bearer(
    scheme_name="bearer",
    description="API key, or a JSON Web Token from the configured issuer. Not needed if the "
    "service is configured without credentials. The scope is the required role; `operate` includes "
    "the other roles.",
    auto_error=False,
)


async def authorised(
    connection: HTTPConnection,
    required: SecurityScopes,
    bearer: Annotated[HTTPAuthorizationCredentials | None, Depends(_bearer)],
) -> Caller:
    """Return the caller of a request, who has the role that the route requires.

    Raises
    ------
    RequestError
        401 without valid credentials, 403 without the role.
    """
    authentication: Authentication = connection.app.state.authentication
    (role,) = required.scopes
    # Of one origin, entries are limited; a host may have all addresses of its network.
    events, origin = authentication.events, client_at(_address(connection))
    where = _where(connection)
    try:
        caller = authentication.caller(
            None if bearer is None else bearer.credentials,
            connection.scope.get("state", {}).get(CERTIFICATE),
        )
    except RequestError as error:
        events.warn("rejected", origin, code=error.code, reason=str(error), **where)
        if error.code == CREDENTIALS_INVALID:
            authentication.attempts.note_wrong(origin)
        raise
    if not caller.may(Role(role)):
        code = "ROLE_NOT_ALLOWED"
        events.warn("rejected", origin, code=code, client=caller.name, **where)
        raise RequestError(
            403, code, f"this request requires the role {role}, which {caller.name} does not have"
        )
    if role == Role.OPERATE and not authentication.required and not _is_local(connection):
        # Without credentials anybody of that network may ask; this changes what all others get.
        code = "ROLE_NOT_ALLOWED"
        events.warn("rejected", origin, code=code, **where)
        msg = (
            f"without credentials, only clients on this machine have the role {role}; create a "
            f"key with this role"
        )
        raise RequestError(403, code, msg)
    connection.state.caller = caller
    return caller


def log_operated(connection: HTTPConnection) -> None:
    """Log that a request was executed that requires the role operate; its caller is authorised."""
    caller: Caller = connection.state.caller
    SECURITY_LOG.info("operated", client=caller.name, **_where(connection))


# Where a request comes from and what it asks for, for the log.
def _where(connection: HTTPConnection) -> dict[str, str]:
    return {
        "address": _address(connection),
        "method": connection.scope.get("method", "WEBSOCKET"),
        "path": connection.scope["path"][:200],
    }


def _address(connection: HTTPConnection) -> str:
    return connection.client.host if connection.client else "unknown"


def _is_local(connection: HTTPConnection) -> bool:
    return connection.client is None or is_loopback(connection.client.host)


async def _public() -> None:
    """Mark a route that needs no credentials."""


#: Dependencies of routes, one of which each declares.
PUBLIC = Depends(_public)
FEED = Security(authorised, scopes=[Role.FEED])
DISPLAY = Security(authorised, scopes=[Role.DISPLAY])
OPERATE = Security(authorised, scopes=[Role.OPERATE])


def require_declared(routers: Iterable[APIRouter]) -> None:
    """Check that each route declares exactly one role, or that it is public.

    Raises
    ------
    ConfigurationError
        With the first route that does not; it would be open to everybody.
    """
    for router in routers:
        for route in router.routes:
            dependant = getattr(route, "dependant", None)
            declared = [] if dependant is None else list(_declared(dependant))
            if len(declared) != 1:
                path = getattr(route, "path", route)
                raise ConfigurationError(
                    f"route {path}: expected exactly one of FEED, DISPLAY, OPERATE and PUBLIC "
                    f"among its dependencies, found {len(declared)}"
                )


def _declared(dependant: Dependant) -> Iterator[object]:
    for one in dependant.dependencies:
        if one.call in (authorised, _public):
            yield one.call
