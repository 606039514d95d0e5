"""The air picture: the page at `/`, its files, and the frames that it reads."""

import hashlib
from dataclasses import astuple
from functools import cache
from importlib.resources import files
from typing import Annotated, NamedTuple

from fastapi import APIRouter, Depends, Query, Request
from starlette.responses import Response

from multiradar.access.parameters import parameter_error, strict_query
from multiradar.access.requirement import DISPLAY, PUBLIC
from multiradar.access.shares import CLIENT
from multiradar.api.access import Access, Granted
from multiradar.api.answers.documents import NOT_FOUND
from multiradar.api.pages import PAGE_HEADER
from multiradar.api.query import INTEGER_MOST, AsInteger, AsTime, At, time_query
from multiradar.api.selection import BOX_FORM, bounding_box
from multiradar.errors import RequestError
from multiradar.runtime.picture.air_picture import Asked
from multiradar.runtime.picture.past import PastAsked
from multiradar.runtime.picture.selection import WHOLE_MAX, Area

#: Media types of the files of the page; no other file is served.
FILES = {
    "index.html": "text/html; charset=utf-8",
    "page.js": "text/javascript; charset=utf-8",
    "page.css": "text/css; charset=utf-8",
    "land.json": "application/json",
    "NOTICES.txt": "text/plain; charset=utf-8",
}
#: Greatest number of a layer.
LAYERS_MAX = 15
FRAME = "application/vnd.multiradar.picture"
_POLICY = "default-src 'self'; img-src 'self' data: blob:; frame-ancestors 'none'; base-uri 'none'"
_HEADERS = {
    "content-security-policy": _POLICY,
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    # Revalidated at each load: a new version of the service has a new page.
    "cache-control": "no-cache",
}

# The files are those of the project; who may read the data is asked for a key.
page_router = APIRouter(include_in_schema=False, dependencies=[PUBLIC])
router = APIRouter(prefix="/v1", tags=["picture"], dependencies=[DISPLAY, Depends(strict_query)])


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
        raise RequestError(404, "NOT_FOUND", f"the page does not include a file {name[:64]!a}")
    return _answer(request, name)


def _answer(request: Request, name: str) -> Response:
    file = _file(name)
    headers = {**_HEADERS, "etag": file.tag, "content-type": FILES[name]}
    tags = request.headers.get("if-none-match", "").split(",")
    if file.tag in {one.strip() for one in tags}:
        return Response(None, 304, headers)
    return Response(file.content, headers=headers)


@router.get(
    "/picture",
    response_class=Response,
    responses={
        200: {"content": {FRAME: {"schema": {"type": "string", "format": "binary"}}}},
        **NOT_FOUND,
    },
)
async def picture(
    request: Request,
    access: Granted,
    *,
    after: Annotated[
        int | None,
        Query(
            ge=0,
            le=INTEGER_MOST,
            description="`next` of the previous frame: only later plots are returned",
            examples=[0],
        ),
        AsInteger,
    ] = None,
    bbox: Annotated[
        str | None,
        Query(
            description=(
                "Displayed area, min_lon,min_lat,max_lon,max_lat in degrees; applied only if there "
                f"are more than {WHOLE_MAX} tracks"
            ),
            json_schema_extra=BOX_FORM,
        ),
    ] = None,
    track: Annotated[
        int | None,
        Query(
            ge=1,
            le=INTEGER_MOST,
            description="Number of a track that is always included in the frame",
        ),
        AsInteger,
    ] = None,
    at: At = None,
    since: Annotated[
        float | None,
        time_query("With `at`: return positions and plots only from this data time on"),
        AsTime,
    ] = None,
    layer: Annotated[
        int,
        Query(ge=0, le=LAYERS_MAX, description="With `at`: number of the recorded run"),
        AsInteger,
    ] = 0,
) -> Response:
    """Return the air picture: tracks, and plots with and without biases, in binary columns.

    The current picture or, with `at`, the picture at a past time that the service still retains.
    """
    access.pages.note(CLIENT.get(), request.headers.get(PAGE_HEADER))
    area = None if bbox is None else Area(*astuple(bounding_box(bbox)))
    if at is None:
        _reject({"since": since, "layer": layer or None}, "allowed only together with at")
        _require_started(access)
        wanted = Asked(after, area, track)
        # Most pages ask for a frame that another page has asked for: no thread is needed.
        frame = access.view.ready_picture(wanted)
        if frame is None:
            frame = await access.queries.run("picture", access.view.picture, wanted)
    else:
        _reject({"after": after}, "not allowed together with at; use since instead")
        asked = PastAsked(at, since, layer, area, track)
        frame = await access.queries.run("past", access.view.past_picture, asked)
    return Response(frame, media_type=FRAME, headers={"cache-control": "no-store"})


def _reject(given: dict[str, float | None], reason: str) -> None:
    unused = [name for name, value in given.items() if value is not None]
    if unused:
        raise parameter_error(dict.fromkeys(unused, reason))


# While the journal is replayed, the picture would be the past in fast motion.
def _require_started(access: Access) -> None:
    step = access.service.start_step
    if step:
        msg = f"the service is starting: {step}"
        raise RequestError(503, "NOT_READY", msg, {"retry-after": "1"})
