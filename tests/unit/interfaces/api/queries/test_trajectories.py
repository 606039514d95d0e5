"""Trajectories of a track over HTTP: limits of queries, and the reason for their absence."""

import httpx
import pytest

from multiradar.errors import TrajectoryError
from multiradar.runtime.queries.parameters import PATH_POINTS_DEFAULT, PATH_STEP_DEFAULT_S
from multiradar_schemas.products.trajectories import TRAJECTORY_REASON_MEANINGS
from support.fakes.fake_service import FakeService

PATH = "/v1/tracks/3/trajectories"


async def test_the_trajectories_of_a_live_track(client: httpx.AsyncClient) -> None:
    answer = await client.get(PATH)
    assert answer.status_code == 200
    assert answer.json() == {
        "track_id": 3,
        "points": PATH_POINTS_DEFAULT,
        "step_s": PATH_STEP_DEFAULT_S,
    }
    asked = await client.get(f"{PATH}?points=0&step_s=60")
    assert asked.json() == {"track_id": 3, "points": 0, "step_s": 60}


async def test_an_unknown_track_is_404(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/tracks/99/trajectories")
    assert answer.status_code == 404
    assert answer.json()["code"] == "TRACK_NOT_FOUND"


@pytest.mark.parametrize("code", sorted(TRAJECTORY_REASON_MEANINGS))
async def test_a_track_without_trajectories_is_409_with_the_reason(
    client: httpx.AsyncClient, service: FakeService, code: str
) -> None:
    service.view.failures["trajectories"] = TrajectoryError(code, "expected plots, was none")
    answer = await client.get(PATH)
    assert answer.status_code == 409
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["code"] == code
    assert answer.json()["detail"] == "expected plots, was none"


@pytest.mark.parametrize(
    "query",
    ["points=-1", "points=601", "points=1e9", "points=nan", "points=", "points=2.5", "step_s=0",
     "step_s=-5", "step_s=61", "step_s=0.5", "step_s=ten", "step_s=1_0",
     "points=99999999999999999999999"],
)  # fmt: skip
async def test_what_is_out_of_bounds_is_422(client: httpx.AsyncClient, query: str) -> None:
    answer = await client.get(f"{PATH}?{query}")
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["parameter"] == query.split("=", maxsplit=1)[0]


@pytest.mark.parametrize("name", ["0", "-1", "x", "1.5", "%2e%2e", "9" * 30])
async def test_an_invalid_track_number_is_rejected(client: httpx.AsyncClient, name: str) -> None:
    answer = await client.get(f"/v1/tracks/{name}/trajectories")
    assert answer.status_code in (404, 422)


async def test_unknown_parameters_are_rejected(client: httpx.AsyncClient) -> None:
    answer = await client.get(f"{PATH}?window_s=30")
    assert answer.status_code == 422
