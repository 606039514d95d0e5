"""Dependencies of the routes: the service, the threads, the streams and the limits."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection

from multiradar.access.authentication import Authentication
from multiradar.access.workers import Workers
from multiradar.api.batches import StreamHub
from multiradar.api.pages import Pages
from multiradar.api.workers import QueryWorkers
from multiradar.runtime.ports import ReadableService, View
from multiradar.settings.limits import HttpLimits


@dataclass(frozen=True, slots=True)
class Access:
    """The parts of the running application that routes use."""

    service: ReadableService
    workers: Workers
    queries: QueryWorkers
    hub: StreamHub
    limits: HttpLimits
    authentication: Authentication
    pages: Pages

    @property
    def view(self) -> View:
        """The read side of the service."""
        return self.service.view


# Not a plain function: each of these is a thread of its own in FastAPI, for each request.
async def _access(connection: HTTPConnection) -> Access:
    access: Access = connection.app.state.access
    return access


Granted = Annotated[Access, Depends(_access)]
