"""The plane of a track over HTTP: bounds of the window, and a reason where there is none."""

from typing import get_args

import httpx
import pytest

from multiradar.cli import options
from multiradar.errors import PlaneError
from multiradar.runtime.queries.parameters import WINDOW, WINDOW_DEFAULT_S
from support.fakes.fake_service import FakeService


async def test_the_plane_of_a_live_track(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/tracks/3/manoeuvre-plane")
    assert answer.status_code == 200
    assert answer.json() == {"track_id": 3, "window_s": WINDOW_DEFAULT_S, "is_planar": True}
    asked = await client.get("/v1/tracks/3/manoeuvre-plane?window_s=12.5")
    assert asked.json()["window_s"] == 12.5


async def test_an_unknown_track_is_404(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/tracks/99/manoeuvre-plane")
    assert answer.status_code == 404
    assert answer.json()["code"] == "TRACK_NOT_FOUND"


@pytest.mark.parametrize("code", ["TOO_FEW_POINTS", "POINTS_ON_A_LINE"])
async def test_plots_without_a_plane_are_409_with_the_reason(
    client: httpx.AsyncClient, service: FakeService, code: str
) -> None:
    service.view.failures["manoeuvre-plane"] = PlaneError(code, "expected points, was none")
    answer = await client.get("/v1/tracks/3/manoeuvre-plane")
    assert answer.status_code == 409
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["code"] == code
    assert answer.json()["detail"] == "expected points, was none"


async def test_whether_a_track_is_observable(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/tracks/3/observability?window_s=30")
    assert answer.json() == {"track_id": 3, "window_s": 30.0, "is_observable": False}
    missing = await client.get("/v1/tracks/99/observability")
    assert missing.status_code == 404
    assert missing.json()["code"] == "TRACK_NOT_FOUND"


@pytest.mark.parametrize("window", ["0", "-5", "4.9", "600.1", "nan", "ten"])
async def test_a_window_out_of_bounds_is_422(client: httpx.AsyncClient, window: str) -> None:
    answer = await client.get(f"/v1/tracks/3/manoeuvre-plane?window_s={window}")
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["parameter"] == "window_s"


def test_the_command_has_the_bounds_of_the_service() -> None:
    for given in (options.PlanesOption, options.ObservabilityOption):
        option = get_args(given)[1]
        assert (option.min, option.max) == (WINDOW.least, WINDOW.most)
