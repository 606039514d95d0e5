"""Encounters over HTTP: valid and rejected queries."""

from typing import get_args

import httpx
import pytest

from multiradar.cli import options
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.queries.parameters import (
    ENCOUNTER_DISTANCE,
    ENCOUNTER_DISTANCE_M,
    ENCOUNTER_HEIGHT,
    ENCOUNTER_HORIZON,
    ENCOUNTER_HORIZON_S,
)
from multiradar_schemas.products.encounter import Encounters
from support.fakes.fake_service import FakeService


async def test_what_is_asked_for_reaches_the_service(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    answer = await client.get(
        "/v1/encounters?horizon_s=300&distance_m=5000&height_m=305&probability_min=0.1"
        "&order=probability&limit=7"
    )
    assert answer.status_code == 200
    assert service.view.asked == EncounterQuery(300.0, 5000.0, 305.0, 0.1, "probability", 7)
    found = Encounters.model_validate(answer.json())
    assert (found.horizon_s, found.distance_threshold_m, found.height_threshold_m) == (
        300,
        5e3,
        305,
    )
    assert found.time_s is None


async def test_the_defaults_apply_without_parameters(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    answer = await client.get("/v1/encounters")
    assert answer.status_code == 200
    assert service.view.asked == EncounterQuery()
    assert answer.json()["horizon_s"] == ENCOUNTER_HORIZON_S
    assert answer.json()["distance_threshold_m"] == ENCOUNTER_DISTANCE_M
    assert answer.json()["height_threshold_m"] is None


@pytest.mark.parametrize(
    "query",
    [
        "horizon_s=0", "horizon_s=1e-300", "horizon_s=-1", "horizon_s=600.1", "horizon_s=nan",
        "distance_m=0", "distance_m=100001", "height_m=0", "height_m=20001", "probability_min=1.1",
        "probability_min=-0.1", "order=distance", "limit=0", "limit=10001", "limit=1.5",
    ],
)  # fmt: skip
async def test_what_is_out_of_bounds_is_422(client: httpx.AsyncClient, query: str) -> None:
    answer = await client.get(f"/v1/encounters?{query}")
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["parameter"] == query.partition("=")[0]


async def test_an_unknown_parameter_is_422(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/encounters?distance=5000")
    assert answer.status_code == 422
    assert answer.json()["code"] == "UNKNOWN_PARAMETER"


def test_the_command_has_the_bounds_of_the_service() -> None:
    bounds = {
        options.EncountersOption: ENCOUNTER_HORIZON,
        options.EncounterDistanceOption: ENCOUNTER_DISTANCE,
        options.EncounterHeightOption: ENCOUNTER_HEIGHT,
    }
    for given, one in bounds.items():
        assert (get_args(given)[1].min, get_args(given)[1].max) == (one.least, one.most)
