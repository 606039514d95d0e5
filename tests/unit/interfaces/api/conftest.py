"""An application over a fake service, and a client that speaks to it without a socket."""

from collections.abc import AsyncIterator

import httpx
import pytest
from fastapi import FastAPI

from multiradar.api.factory import create_api
from multiradar.ingest.http import IntakeBounds, measurement_routes
from multiradar.ingest.http_sensors import sensor_change_routes
from support.fakes.fake_service import FakeService
from support.processes.waiting import WAIT_TIMEOUT_S


@pytest.fixture
def service() -> FakeService:
    return FakeService()


@pytest.fixture
def application(service: FakeService) -> FastAPI:
    routes = measurement_routes(service, IntakeBounds(acknowledge_deadline_s=WAIT_TIMEOUT_S))
    return create_api(service, routers=[routes, sensor_change_routes(service)])


@pytest.fixture
async def client(application: FastAPI) -> AsyncIterator[httpx.AsyncClient]:
    transport = httpx.ASGITransport(application)
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
        yield client
