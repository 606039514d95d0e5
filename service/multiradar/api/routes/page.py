"""The air picture: the page at `/`, its files, and the frames that it reads."""

import hashlib
import re
from dataclasses import astuple
from functools import cache
from importlib.resources import files
from typing import Annotated, NamedTuple

from fastapi import APIRouter, Depends, Query, Request
from starlette.responses import Response

from multiradar.api.access import Granted
from multiradar.api.query import Integer, strict_query
from multiradar.api.selection import bounding_box
from multiradar.errors import RequestError
from multiradar.runtime.picture.air_picture import Asked
from multiradar.runtime.picture.selection import WHOLE_MAX, Area

#: Media types of the files of the page; no other file is served.
FILES = {
    "index.html": "text/html; charset=utf-8",
    "page.js": "text/javascript; charset=utf-8",
    "page.css": "text/css; charset=utf-8",
    "land.json": "application/json",
    "NOTICES.txt": "text/plain; charset=utf-8",
}
FRAME = "application/vnd.multiradar.picture"
_POLICY = "default-src 'self'; img-src 'self' data: blob:; frame-ancestors 'none'; base-uri 'none'"
_HEADERS = {
    "content-security-policy": _POLICY,
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    # Revalidated at each load: a new version of the service has a new page.
    "cache-control": "no-cache",
}

page_router = APIRouter(include_in_schema=False)
router = APIRouter(prefix="/v1", tags=["picture"], dependencies=[Depends(strict_query)])


class _File(NamedTuple):
    content: bytes
    tag: str


@cache
def _file(name: str) -> _File:
    content = files("multiradar.api.page").joinpath(name).read_bytes()
    return _File(content, f'"{hashlib.sha256(content).hexdigest()[:32]}"')


@page_router.get("/")
async def front(request: Request) -> Response:
    """Return the page."""
    return _answer(request, "index.html")


@page_router.get("/page/{name}")
async def page_file(request: Request, name: str) -> Response:
    """Return a file of the page."""
    if name not in FILES:
        raise RequestError(404, "NOT_FOUND", f"the page has no file {name[:64]!a}")
    return _answer(request, name)


def _answer(request: Request, name: str) -> Response:
    file = _file(name)
    headers = {**_HEADERS, "etag": file.tag, "content-type": FILES[name]}
    if file.tag in re.split(r"\s*,\s*", request.headers.get("if-none-match", "")):
        return Response(None, 304, headers)
    return Response(file.content, headers=headers)


@router.get(
    "/picture",
    response_class=Response,
    responses={200: {"content": {FRAME: {"schema": {"type": "string", "format": "binary"}}}}},
)
async def picture(
    access: Granted,
    after: Annotated[
        Integer | None,
        Query(ge=0, description="`next` of the last frame: only plots since then", examples=[0]),
    ] = None,
    bbox: Annotated[
        str | None,
        Query(
            description="Area shown, min_lon,min_lat,max_lon,max_lat in degrees; it selects where "
            f"there are more than {WHOLE_MAX} tracks"
        ),
    ] = None,
    track: Annotated[
        Integer | None, Query(ge=1, description="A track that the frame has in any case")
    ] = None,
) -> Response:
    """Return the air picture: live tracks, and plots with and without biases, in binary columns."""
    area = None if bbox is None else Area(*astuple(bounding_box(bbox)))
    frame = await access.workers.run(access.view.picture, Asked(after, area, track))
    return Response(frame, media_type=FRAME, headers={"cache-control": "no-store"})
