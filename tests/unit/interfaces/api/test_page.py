"""The files of the page, its policy, and the frames, over HTTP."""

import json
import re
import time
from importlib.resources import files
from unittest.mock import ANY

import httpx
import pytest

from multiradar.api.answers.encoding import GEOJSON
from multiradar.api.factory import create_api
from multiradar.api.routes.overlays import overlay_routes
from multiradar.api.routes.page import FILES, FRAME
from multiradar.runtime.picture.frames import MAGIC
from multiradar.storage.overlays import Overlay
from support.fakes.fake_service import FakeService


@pytest.mark.parametrize("path", ["/", *(f"/page/{name}" for name in FILES)])
async def test_every_file_of_the_page_is_served_with_its_policy(
    client: httpx.AsyncClient, path: str
) -> None:
    answer = await client.get(path)
    assert answer.status_code == 200
    assert (
        answer.headers["content-type"]
        == FILES[path.removeprefix("/page/").strip("/") or "index.html"]
    )
    assert answer.headers["content-security-policy"].startswith("default-src 'self'")
    assert "unsafe" not in answer.headers["content-security-policy"]
    again = await client.get(path, headers={"if-none-match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    tags = f'"other" , {answer.headers["etag"]}\t,W/"x"'
    assert (await client.get(path, headers={"if-none-match": tags})).status_code == 304
    assert (await client.get(path, headers={"if-none-match": '"other"'})).status_code == 200


async def test_a_long_list_of_tags_does_not_delay_others(client: httpx.AsyncClient) -> None:
    start_s = time.process_time()
    answer = await client.get("/", headers={"if-none-match": f"a{' ' * 15_000}b"})
    assert time.process_time() - start_s < 0.1
    assert answer.status_code == 200


async def test_the_page_names_no_other_host(client: httpx.AsyncClient) -> None:
    page = (await client.get("/")).text
    assert re.findall(r'(?:src|href)="([^"]*)"', page) == [
        "data:,", "page/page.css", "page/page.js", "page/NOTICES.txt",
    ]  # fmt: skip
    assert "url(http" not in (await client.get("/page/page.css")).text


@pytest.mark.parametrize("name", ["__init__.py", "..%2Fpage.py", "page.js.map", "%00", "a" * 500])
async def test_no_other_file_is_served(client: httpx.AsyncClient, name: str) -> None:
    answer = await client.get(f"/page/{name}")
    assert (answer.status_code, answer.json()["code"]) == (404, "NOT_FOUND")


def test_every_file_of_the_page_is_built() -> None:
    page = files("multiradar.api.page")
    assert {one.name for one in page.iterdir() if "__" not in one.name} == set(FILES)


async def test_frames_are_binary_and_not_kept(client: httpx.AsyncClient) -> None:
    answer = await client.get("/v1/picture", params={"after": "3"})
    assert answer.headers["content-type"] == FRAME
    assert answer.headers["cache-control"] == "no-store"
    assert answer.content[:4] == MAGIC


async def test_a_past_time_is_asked_with_what_the_reader_has(client: httpx.AsyncClient) -> None:
    given = {"at": "1970-01-01T00:10:00Z", "since": "599.5", "layer": "1"}
    answer = await client.get("/v1/picture", params=given)
    header = answer.content[8 : 8 + int.from_bytes(answer.content[4:8], "little")]
    wanted = {"at_s": 600.0, "since_s": 599.5, "layer": 1, "area": None, "track": None}
    assert json.loads(header) == {**wanted, "tables": ANY}


@pytest.mark.parametrize(
    "given",
    [
        {"after": "-1"}, {"after": "x"}, {"after": "1.5"}, {"at": "yesterday"}, {"at": "nan"},
        {"at": "1", "after": "0"}, {"since": "5"}, {"layer": "1"}, {"at": "5", "layer": "-1"},
        {"at": "5", "layer": "99"}, {"at": "1e300"},
    ],
)  # fmt: skip
async def test_wrong_parameters_are_errors(
    client: httpx.AsyncClient, given: dict[str, str]
) -> None:
    answer = await client.get("/v1/picture", params=given)
    assert answer.status_code == 422
    assert any(name in answer.text for name in given)


async def test_while_the_journal_is_replayed_there_is_no_picture_but_a_reason(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.start_step = "replaying the journal"
    answer = await client.get("/v1/picture")
    assert answer.status_code == 503
    assert answer.json()["detail"] == "the service is starting: replaying the journal"


async def test_overlays_are_listed_and_served_by_number(service: FakeService) -> None:
    shapes = (
        Overlay("sectors", b'{"type":"FeatureCollection","features":[]}', 0, ""),
        Overlay("../../<b>", b"", 0, "not valid JSON"),
    )
    transport = httpx.ASGITransport(create_api(service, routers=[overlay_routes(shapes)]))
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
        listed = (await client.get("/v1/overlays")).json()["overlays"]
        assert [one["number"] for one in listed] == [0, 1]
        assert listed[1]["problem"] == "not valid JSON"
        answer = await client.get("/v1/overlays/0")
        assert (answer.headers["content-type"], answer.content) == (GEOJSON, shapes[0].content)
        assert answer.headers["x-content-type-options"] == "nosniff"
        for path, status in [
            ("1", 404),
            ("2", 404),
            ("-1", 422),
            ("sectors", 422),
            ("%2e%2e", 422),
        ]:
            assert (await client.get(f"/v1/overlays/{path}")).status_code == status
