"""The HTTP application: routes and limit layer."""

from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from importlib.metadata import version

from fastapi import APIRouter, FastAPI

from multiradar.access.authentication import Authentication
from multiradar.access.requirement import require_declared
from multiradar.access.workers import Workers
from multiradar.api import documentation, openapi, problems
from multiradar.api.access import Access
from multiradar.api.batches import StreamHub
from multiradar.api.guard import LimitLayer
from multiradar.api.pages import Pages
from multiradar.api.routes import aircraft, operations, page, queries, sensors, streams, tracks
from multiradar.api.workers import QueryWorkers
from multiradar.clock import SystemClock
from multiradar.runtime.ports import ReadableService
from multiradar.settings.limits import HttpLimits

_DESCRIPTION = """\
Multi-radar tracking and bias estimation service.

Units are part of the names: `_m` metre, `_s` second, `_deg` degree, `_mps` metre per second. Times
are data times in UTC seconds. Azimuth and heading are clockwise from true north. A bias is the
measured minus the true value. Errors are problem documents (RFC 9457) with a stable `code`.
"""


def create_api(
    service: ReadableService,
    limits: HttpLimits | None = None,
    *,
    routers: Sequence[APIRouter] = (),
    allowed_hosts: Sequence[str] = (),
    authentication: Authentication | None = None,
) -> FastAPI:
    """Return the ASGI application.

    Parameters
    ----------
    service : ReadableService
        The running service.
    limits : HttpLimits, optional
        Limits for clients.
    routers : sequence of APIRouter
        Further routes, such as those that receive measurements.
    allowed_hosts : sequence of str
        Names accepted in the Host header; empty accepts any.
    authentication : Authentication, optional
        Finds the caller of a request; by default all callers may do all.

    Raises
    ------
    ConfigurationError
        If a route does not declare who may use it.
    """
    authentication = authentication or Authentication()
    limits = limits or HttpLimits()
    workers, expensive = Workers(limits.threads), QueryWorkers(limits)
    hub = StreamHub(service.view, workers, limits)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        workers.close()
        expensive.close()

    application = FastAPI(
        title="multiradar",
        version=version("multiradar"),
        description=_DESCRIPTION,
        lifespan=lifespan,
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
    )
    problems.install(application)
    openapi.install(application)
    application.add_middleware(
        LimitLayer, limits=limits, allowed_hosts=allowed_hosts, authentication=authentication
    )
    application.state.access = Access(
        service, workers, expensive, hub, limits, authentication, Pages(SystemClock().monotonic_s)
    )  # fmt: skip
    application.state.authentication = authentication
    application.state.documents = documentation.Documents(application)
    every = (
        *routers,
        tracks.router, queries.router, sensors.router, streams.router, operations.router,
        aircraft.router, page.router, page.page_router, documentation.router,
    )  # fmt: skip
    require_declared(every)
    application.state.routes = [route for router in every for route in router.routes]
    # As they are, not by `include_router`: it analyses all functions again at the first request.
    application.router.routes.extend(application.state.routes)
    return application


def create_apis(
    services: Sequence[ReadableService],
    limits: HttpLimits,
    *,
    routers: Sequence[APIRouter] = (),
    allowed_hosts: Sequence[str] = (),
) -> FastAPI:
    """Return the ASGI application of a service, with another one below the path ``/second``.

    Two recorded runs are read on one page: the second service has them in the other order.

    Parameters
    ----------
    services : sequence of ReadableService
        One or two.
    limits, routers, allowed_hosts
        See `create_api`; of each.
    """
    first, *second = (
        create_api(one, limits, routers=routers, allowed_hosts=allowed_hosts) for one in services
    )
    for one in second:
        first.mount("/second", one)
    return first
