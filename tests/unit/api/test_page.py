"""The files of the page, its policy, and the frames, over HTTP."""

import re
from importlib.resources import files

import httpx
import pytest

from multiradar.api.routes.page import FILES, FRAME
from multiradar.runtime.picture.frames import MAGIC


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


@pytest.mark.parametrize("after", ["-1", "x", "1.5"])
async def test_a_wrong_number_is_an_error(client: httpx.AsyncClient, after: str) -> None:
    assert (await client.get("/v1/picture", params={"after": after})).status_code == 422
