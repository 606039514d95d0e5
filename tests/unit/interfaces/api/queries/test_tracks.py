"""The list of tracks, one track, its history and its forecast."""

import io
import json
from collections.abc import Sequence
from typing import Any

import httpx
import polars as pl
import pyarrow
import pytest

from multiradar.api.answers.paging import track_cursor
from multiradar.api.selection import TRACK_COLUMNS
from multiradar.errors import TrajectoryError
from multiradar.runtime.stream.region_marks import FIELDS
from multiradar_schemas.products.forecast import Forecast
from multiradar_schemas.products.track import Track
from multiradar_schemas.products.transition import TRANSITION_SCHEMA, Transition
from support.fakes.fake_service import FakeService, live_tracks, updates_of


async def _ids(client: httpx.AsyncClient, **parameters: str) -> list[int]:
    answer = await client.get("/v1/tracks", params=parameters)
    assert answer.status_code == 200, answer.text
    return [track["track_id"] for track in answer.json()["tracks"]]


async def test_each_track_of_the_list_is_one_of_the_schema(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/tracks")
    tracks = answer.json()["tracks"]
    assert len(tracks) == 10
    for track in tracks:
        Track.model_validate(track)


async def test_pages_by_cursor_give_every_track_once(client: httpx.AsyncClient) -> None:
    seen: list[int] = []
    url = "/v1/tracks?limit=3&bbox=-180,-90,180,90"
    while url:
        answer = await client.get(url)
        seen += [track["track_id"] for track in answer.json()["tracks"]]
        url = answer.links.get("next", {}).get("url", "")
        assert bool(url) == (answer.json()["next_cursor"] is not None)
    assert seen == list(range(1, 11))


async def test_a_page_that_just_holds_all_has_no_next(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/tracks?limit=10")
    assert answer.json()["next_cursor"] is None
    assert "link" not in answer.headers


async def test_a_box_holds_what_is_inside_edges_included(client: httpx.AsyncClient) -> None:
    assert await _ids(client, bbox="2,50.2,4,50.3") == [2, 3]


async def test_a_box_may_cross_the_antimeridian(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.live = live_tracks(2).with_columns(longitude_deg=pl.Series([179.5, -179.5]))
    assert await _ids(client, bbox="179,-90,-179,90") == [1, 2]
    assert await _ids(client, bbox="-179,-90,179,90") == []


@pytest.mark.parametrize(
    ("identity", "expected"),
    [
        ("484002", [2]),
        ("mode_s:484002", [2]),
        ("7000", [4, 8]),
        ("mode_3a:7000", [4, 8]),
        ("104", [4]),
        ("number:104", [4]),
        ("number:7000", []),
        ("callsign:TST6", [6]),
        ("callsign:tst6", [6]),
        ("callsign:TST", []),
    ],
)
async def test_an_identity_finds_address_code_number_or_callsign(
    client: httpx.AsyncClient, identity: str, expected: list[int]
) -> None:
    assert await _ids(client, identity=identity) == expected


async def test_an_address_is_found_in_capitals_too(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.live = live_tracks(1).with_columns(mode_s_address=pl.lit("abcdef"))
    assert await _ids(client, identity="ABCDEF") == [1]


@pytest.mark.parametrize("since", ["1008", "1970-01-01T00:16:48Z", "1970-01-01T02:16:48+02:00"])
async def test_since_is_seconds_or_iso_8601(client: httpx.AsyncClient, since: str) -> None:
    assert await _ids(client, since=since) == [8, 9, 10]


async def test_tracks_of_a_past_time_are_asked_for_and_chosen_alike(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    assert await _ids(client, at="1970-01-01T00:16:45Z", since="1008") == [8, 9, 10]
    assert service.view.asked_at_s == 1005.0
    assert (await client.get("/v1/tracks?at=yesterday")).status_code == 422


async def test_fields_choose_members_and_keep_the_number(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/tracks?fields=latitude_deg,state&limit=1")
    assert answer.json()["tracks"] == [{"track_id": 1, "latitude_deg": 50.1, "state": "confirmed"}]


async def test_what_is_not_finite_becomes_null(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.live = live_tracks(1).with_columns(height_m=pl.lit(float("nan")))
    assert (await client.get("/v1/tracks")).json()["tracks"][0]["height_m"] is None
    assert (await client.get("/v1/tracks/1")).json()["height_m"] is None
    arrow = await client.get("/v1/tracks?format=arrow")
    assert pl.read_ipc_stream(arrow.content)["height_m"].to_list() == [None]


async def test_an_empty_service_lists_no_tracks(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.live = live_tracks(0)
    for form, name in (("json", "tracks"), ("geojson", "features")):
        answer = await client.get(f"/v1/tracks?format={form}")
        assert answer.json()[name] == []
    # Before the first measurement there is a table without columns, too.
    service.view.live = pl.DataFrame()
    assert await _ids(client, bbox="0,0,1,1") == []


async def test_geojson_has_height_where_it_is_known(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/tracks", headers={"accept": "application/geo+json"})
    assert answer.headers["content-type"] == "application/geo+json"
    collection = answer.json()
    assert collection["type"] == "FeatureCollection"
    by_id = {feature["id"]: feature for feature in collection["features"]}
    assert by_id[1]["geometry"] == {"type": "Point", "coordinates": [1.0, 50.1, 9001.0]}
    assert by_id[5]["geometry"] == {"type": "Point", "coordinates": [5.0, 50.5]}
    assert by_id[5]["properties"]["height_m"] is None
    assert by_id[1]["properties"]["speed_mps"] == 201.0


async def test_arrow_is_read_by_another_library(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/tracks?format=arrow&limit=7")
    assert answer.headers["content-type"] == "application/vnd.apache.arrow.stream"
    table = pyarrow.ipc.open_stream(io.BytesIO(answer.content)).read_all()
    # Those of a region only where the service has one.
    assert table.column_names == [name for name in TRACK_COLUMNS if name not in FIELDS]
    assert table.column("track_id").to_pylist() == list(range(1, 8))
    assert answer.headers["x-next-cursor"]


@pytest.mark.parametrize(
    ("accept", "expected"),
    [
        ("*/*", "application/json"),
        ("application/*", "application/json"),
        ("application/geo+json, application/json;q=0.5", "application/geo+json"),
        ("application/json;q=0, */*", "application/geo+json"),
        ("application/vnd.apache.arrow.stream", "application/vnd.apache.arrow.stream"),
    ],
)
async def test_the_accept_header_chooses_the_format(
    client: httpx.AsyncClient, accept: str, expected: str
) -> None:
    answer = await client.get("/v1/tracks", headers={"accept": accept})
    assert answer.headers["content-type"] == expected


async def test_no_format_that_will_do_is_406(client: httpx.AsyncClient) -> None:
    for path in ("/v1/tracks", "/v1/tracks/1/history"):
        answer = await client.get(path, headers={"accept": "text/csv"})
        assert answer.status_code == 406
        assert answer.json()["code"] == "NOT_ACCEPTABLE"


async def test_one_track_is_one_of_the_schema(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/tracks/4")
    assert Track.model_validate(answer.json()).track_number == 104


@pytest.mark.parametrize(
    "path",
    [
        "/v1/tracks/99",
        "/v1/tracks/99/history",
        "/v1/tracks/99/forecast",
        "/v1/tracks/99/transitions",
    ],
)
async def test_an_unknown_track_is_404(client: httpx.AsyncClient, path: str) -> None:
    answer = await client.get(path)
    assert (answer.status_code, answer.json()["code"]) == (404, "TRACK_NOT_FOUND")


@pytest.mark.parametrize("same_time", [1, 3, 7])
@pytest.mark.parametrize("limit", [1, 2, 5])
async def test_a_history_by_pages_gives_every_update_once_in_order(
    client: httpx.AsyncClient, service: FakeService, same_time: int, limit: int
) -> None:
    service.view.updates[7] = updates_of(7, 12, same_time)
    seen: list[int] = []
    url = f"/v1/tracks/7/history?limit={limit}"
    while url:
        answer = await client.get(url)
        assert answer.json()["count"] <= limit
        seen += [update["sequence"] for update in answer.json()["updates"]]
        url = answer.links.get("next", {}).get("url", "")
    assert seen == list(range(1, 13))


async def test_pages_smaller_than_asked_for_lose_no_update(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.page_rows_max = 5
    service.view.updates[7] = updates_of(7, 12)
    seen: list[int] = []
    url = "/v1/tracks/7/history?limit=10"
    while url:
        answer = await client.get(url)
        assert answer.json()["count"] <= 5
        seen += [update["sequence"] for update in answer.json()["updates"]]
        url = answer.links.get("next", {}).get("url", "")
    assert seen == list(range(1, 13))


async def test_a_history_begins_at_since(client: httpx.AsyncClient, service: FakeService) -> None:
    service.view.updates[7] = updates_of(7, 12)
    answer = await client.get("/v1/tracks/7/history?since=9")
    assert [update["time_s"] for update in answer.json()["updates"]] == [9.0, 10.0, 11.0]


@pytest.mark.parametrize(
    ("asked", "expected"),
    [("until=9", range(10)), ("until=1970-01-01T00:00:09Z&limit=3", (7, 8, 9)),
     ("since=8&until=9.5", (8, 9)), ("until=1e6&limit=2", (10, 11)), ("until=-1", ())],
)  # fmt: skip
async def test_with_until_a_history_has_the_last_rows_up_to_it(
    client: httpx.AsyncClient, service: FakeService, asked: str, expected: Sequence[int]
) -> None:
    service.view.updates[7] = updates_of(7, 12)
    answer = await client.get(f"/v1/tracks/7/history?{asked}")
    assert [update["time_s"] for update in answer.json()["updates"]] == list(expected)
    assert answer.json()["next_cursor"] is None


async def test_the_history_of_an_ended_track_is_served_and_may_be_empty_later(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.updates[77] = updates_of(77, 3)
    assert (await client.get("/v1/tracks/77/history")).json()["count"] == 3
    assert (await client.get("/v1/tracks/77/history?since=1000")).json()["count"] == 0


async def test_a_forecast_has_its_points_with_covariance(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/tracks/3/forecast?horizon_s=20&step_s=10")
    forecast: dict[str, Any] = answer.json()
    assert forecast["track_id"] == 3
    assert [point["time_s"] for point in forecast["points"]] == [1003.0, 1013.0, 1023.0]
    assert forecast["points"][0]["covariance_east_m2"] == 400.0
    assert (forecast["probability"], forecast["by"]) == (0.95, "filter")
    Forecast.model_validate(forecast)


async def test_a_region_is_of_the_probability_asked_for(client: httpx.AsyncClient) -> None:
    radius_m = []
    for probability in ("0.5", "0.95", "0.999"):
        answer = await client.get(f"/v1/tracks/3/forecast?probability={probability}")
        assert answer.json()["probability"] == float(probability)
        radius_m.append(answer.json()["points"][0]["region_major_m"])
    # −2 ln(1 − p) of the variance 400 m².
    assert radius_m == pytest.approx([23.5, 49.0, 74.3], abs=0.1)


async def test_a_track_without_bundle_is_409_with_the_reason(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.failures["forecast"] = TrajectoryError("NO_ROOM", "track 3 waits for room")
    answer = await client.get("/v1/tracks/3/forecast?by=bundle")
    assert (answer.status_code, answer.json()["code"]) == (409, "NO_ROOM")
    assert (await client.get("/v1/tracks/3/forecast?by=filter")).status_code == 200


@pytest.mark.parametrize("query", ["probability=0", "probability=1", "probability=95", "by=magic"])
async def test_a_region_or_a_method_that_there_is_not_is_422(
    client: httpx.AsyncClient, query: str
) -> None:
    answer = await client.get(f"/v1/tracks/3/forecast?{query}")
    assert (answer.status_code, answer.json()["code"]) == (422, "INVALID_PARAMETER")
    assert answer.json()["errors"][0]["parameter"] == query.partition("=")[0]


@pytest.mark.parametrize(
    "query",
    [
        "horizon_s=0",
        "horizon_s=-1",
        "horizon_s=3600.1",
        "horizon_s=nan",
        "horizon_s=inf",
        "horizon_s=1e999",
        "step_s=0",
        "step_s=0.01",
        "horizon_s=3600&step_s=0.1",
        "horizon_s=1000&step_s=1",
    ],
)
async def test_a_forecast_beyond_its_limits_is_422(client: httpx.AsyncClient, query: str) -> None:
    answer = await client.get(f"/v1/tracks/3/forecast?{query}")
    assert (answer.status_code, answer.json()["code"]) == (422, "INVALID_PARAMETER")
    assert answer.json()["errors"][0]["parameter"] in {"horizon_s", "step_s"}


async def test_a_smaller_bound_of_points_is_a_422_that_names_it(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.forecast_steps_max = 10
    answer = await client.get("/v1/tracks/3/forecast?horizon_s=10&step_s=1")
    assert (answer.status_code, answer.json()["code"]) == (422, "INVALID_PARAMETER")
    (problem,) = answer.json()["errors"]
    assert "step_s" in json.dumps(problem)
    assert "at most 10 points, found 11" in json.dumps(problem)
    assert answer.json()["detail"].startswith("step_s: expected")


async def test_a_forecast_at_its_limit_is_served(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/tracks/3/forecast?horizon_s=999&step_s=1")
    assert len(answer.json()["points"]) == 1000


async def test_the_steps_in_the_life_of_a_track_are_served_by_pages_also_when_it_has_ended(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    names = ["started", "confirmed", "ended"]
    service.view.steps[77] = pl.DataFrame(
        {
            "time_s": [1.0, 9.0, 9.0],
            "track_id": [77] * 3,
            "transition": names,
            "reason": ["new-place", "likelihood", "merged"],
            "into_track_id": [None, None, 4],
            "last_update_s": [None, 5.0, 9.0],
        },
        schema=TRANSITION_SCHEMA,
    )
    seen: list[Transition] = []
    url = "/v1/tracks/77/transitions?limit=1"
    while url:
        answer = await client.get(url)
        seen += [Transition.model_validate(row) for row in answer.json()["transitions"]]
        url = answer.links.get("next", {}).get("url", "")
    assert [one.transition for one in seen] == names
    assert (seen[0].into_track_id, seen[2].into_track_id) == (None, 4)
    later = await client.get("/v1/tracks/77/transitions?since=2")
    assert later.json()["count"] == 2
    last = await client.get("/v1/tracks/77/transitions?until=1e6&limit=1")
    assert [one["transition"] for one in last.json()["transitions"]] == names[-1:]
    both = await client.get(f"/v1/tracks/77/transitions?until=9&cursor={track_cursor(1)}")
    assert both.status_code == 422
    assert "not allowed together with until" in both.text


async def test_a_page_without_a_limit_has_1000_tracks(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.live = live_tracks(1001)
    page = (await client.get("/v1/tracks")).json()
    assert len(page["tracks"]) == page["count"] == 1000
    rest = (await client.get("/v1/tracks", params={"cursor": page["next_cursor"]})).json()
    assert [track["track_id"] for track in rest["tracks"]] == [1001]
    service.view.live = live_tracks(1000)
    assert (await client.get("/v1/tracks")).json()["next_cursor"] is None
