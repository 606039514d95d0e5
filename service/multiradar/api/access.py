"""Dependencies of the routes: the service, the threads, the streams and the limits."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection

from multiradar.access.authentication import Authentication
from multiradar.api.batches import StreamHub
from multiradar.api.workers import QueryWorkers, Workers
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

    @property
    def view(self) -> View:
        """The read side of the service."""
        return self.service.view


def _access(connection: HTTPConnection) -> Access:
    access: Access = connection.app.state.access
    return access


Granted = Annotated[Access, Depends(_access)]
