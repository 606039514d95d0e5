"""What routes depend on takes no thread of its own: a request would wait for each."""

import inspect
from collections.abc import Iterator

from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute

from multiradar.api.routes import operations, page, queries, sensors, streams, tracks


def calls(dependant: Dependant) -> Iterator[object]:
    for one in dependant.dependencies:
        yield one.call
        yield from calls(one)


def test_no_dependency_is_a_plain_function() -> None:
    routers = [
        operations.router, page.page_router, page.router, queries.router, sensors.router,
        streams.router, tracks.router,
    ]  # fmt: skip
    routes = [one for router in routers for one in router.routes if isinstance(one, APIRoute)]
    found = {call for route in routes for call in calls(route.dependant)}
    assert len(found) >= 3
    plain = [
        call
        for call in found
        if not inspect.iscoroutinefunction(call)
        and not inspect.iscoroutinefunction(getattr(call, "__call__", None))  # noqa: B004
    ]
    assert plain == []
