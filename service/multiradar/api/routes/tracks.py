"""Routes of tracks: the list, one track, its history and its transitions."""

from functools import partial
from typing import Annotated, NamedTuple

import polars as pl
from fastapi import APIRouter, Depends, Query, Request
from starlette.responses import Response

from multiradar.access.parameters import strict_query
from multiradar.access.requirement import DISPLAY
from multiradar.api.access import Granted
from multiradar.api.answers.documents import (
    NOT_FOUND,
    HistoryPage,
    TrackPage,
    TransitionPage,
    table_answers,
)
from multiradar.api.answers.paging import (
    HISTORY_ROWS_MAX,
    page_by_time,
    page_until,
    read_track_cursor,
    track_cursor,
)
from multiradar.api.answers.tables import (
    TableFormat,
    TrackFormat,
    chosen_form,
    json_response,
    table_response,
)
from multiradar.api.query import (
    AsInteger,
    At,
    Limit,
    Since,
    TimeCursor,
    TrackCursor,
    TrackId,
    Until,
    list_form,
)
from multiradar.api.routes.queries import track_not_found
from multiradar.api.selection import (
    BOX_FORM,
    IDENTITY_FORM,
    TRACK_COLUMNS,
    bounding_box,
    columns,
    identity,
    inside,
)
from multiradar.runtime.ports import View
from multiradar.runtime.queries.registry import TRANSITIONS, UPDATES, History
from multiradar_schemas.products.track import Track

router = APIRouter(
    prefix="/v1/tracks", tags=["tracks"], dependencies=[DISPLAY, Depends(strict_query)]
)

BoundingBoxText = Annotated[
    str | None,
    Query(
        max_length=200,
        description="Bounding box in degrees, `min_lon,min_lat,max_lon,max_lat`; if min_lon > "
        "max_lon, the box crosses the antimeridian",
        examples=["36.5,54.9,38.9,56.4"],
        json_schema_extra=BOX_FORM,
    ),
]
IdentityText = Annotated[
    str | None,
    Query(
        alias="identity",
        max_length=40,
        json_schema_extra=IDENTITY_FORM,
        description="Mode S address, Mode 3/A code or track number; the prefixes `mode_s:`, "
        "`mode_3a:`, `number:` and `callsign:` restrict the search to one field",
        examples=["4840d6", "7000", "number:12"],
    ),
]
FieldsText = Annotated[
    str | None,
    Query(
        json_schema_extra=list_form(TRACK_COLUMNS),
        description="Fields to return, separated by commas; `track_id` is always included",
        examples=["track_id,latitude_deg,longitude_deg"],
    ),
]
HistoryLimit = Annotated[
    int, Query(ge=1, le=HISTORY_ROWS_MAX, description="Maximum number of rows per page"), AsInteger
]


@router.get("", response_model=TrackPage, responses=NOT_FOUND | table_answers(geojson=True))
async def list_tracks(
    request: Request,
    access: Granted,
    *,
    bbox: BoundingBoxText = None,
    since: Since = None,
    identity_: IdentityText = None,
    fields: FieldsText = None,
    at: At = None,
    limit: Limit = 1000,
    cursor: TrackCursor = None,
    format_: TrackFormat = None,
) -> Response:
    """List the live tracks, or with `at` past tracks, page by page in ascending order of number."""
    form = chosen_form(request, format_, ("json", "geojson", "arrow"))
    condition = _condition(bbox, since, identity_, cursor)
    names = None if fields is None else columns(fields)

    def answer() -> Response:
        tracks = access.view.tracks(at)
        page = tracks.filter(condition).sort("track_id").head(limit + 1) if len(tracks) else tracks
        more = page.height > limit
        page = page.head(limit)
        following = track_cursor(page["track_id"][-1]) if more else None
        return table_response(request, _chosen(page, names, form), "tracks", form, following)

    if at is None:
        return await access.workers.run(answer)
    return await access.queries.run("past", answer)


@router.get("/{track_id}", response_model=Track, responses=NOT_FOUND)
async def get_track(track_id: TrackId, access: Granted) -> Response:
    """Return one live track."""
    track = await access.workers.run(access.view.track, track_id)
    if track is None:
        raise track_not_found(track_id)
    return json_response(track)


@router.get(
    "/{track_id}/history", response_model=HistoryPage, responses=NOT_FOUND | table_answers()
)
async def get_history(
    request: Request,
    track_id: TrackId,
    access: Granted,
    *,
    since: Since = None,
    until: Until = None,
    limit: HistoryLimit = 1000,
    cursor: TimeCursor = None,
    format_: TableFormat = None,
) -> Response:
    """Return the retained updates of a track, oldest first, even after the track was dropped."""
    form = chosen_form(request, format_, ("json", "arrow"))
    asked = _Asked(track_id, since, until, cursor, limit, form)
    return await access.queries.run(
        "history", _table_of_track, request, access.view, UPDATES, asked
    )


@router.get(
    "/{track_id}/transitions", response_model=TransitionPage, responses=NOT_FOUND | table_answers()
)
async def get_transitions(
    request: Request,
    track_id: TrackId,
    access: Granted,
    *,
    since: Since = None,
    until: Until = None,
    limit: HistoryLimit = 1000,
    cursor: TimeCursor = None,
    format_: TableFormat = None,
) -> Response:
    """Return the state transitions of a track, with reasons, even after the track was dropped."""
    form = chosen_form(request, format_, ("json", "arrow"))
    asked = _Asked(track_id, since, until, cursor, limit, form)
    return await access.queries.run(
        "history", _table_of_track, request, access.view, TRANSITIONS, asked
    )


def _condition(
    bbox: str | None, since: float | None, wanted: str | None, cursor: str | None
) -> pl.Expr:
    condition = pl.lit(True)
    if bbox is not None:
        condition &= inside(bounding_box(bbox))
    if since is not None:
        condition &= pl.col("time_s") >= since
    if wanted is not None:
        condition &= identity(wanted)
    if cursor is not None:
        condition &= pl.col("track_id") > read_track_cursor(cursor)
    return condition


def _chosen(page: pl.DataFrame, names: list[str] | None, form: str) -> pl.DataFrame:
    if names is None:
        return page
    # A feature always has a position.
    always = {"latitude_deg", "longitude_deg"} if form == "geojson" else set()
    return page.select(name for name in page.columns if name in always or name in names)


class _Asked(NamedTuple):
    # Parameters of a request for a table of a track by time.
    track_id: int
    since: float | None
    until: float | None
    cursor: str | None
    limit: int
    form: str


def _table_of_track(request: Request, view: View, history: History, asked: _Asked) -> Response:
    rows = min(asked.limit, view.page_rows_max)
    read = partial(view.rows, history, asked.track_id)
    if asked.until is None:
        page, following = page_by_time(read, asked.since, asked.cursor, rows)
    else:
        page, following = page_until(read, asked.since, asked.cursor, rows, asked.until), None
    _check_known(view, asked.track_id, page)
    return table_response(request, page, history.name, asked.form, following)


def _check_known(view: View, track_id: int, page: pl.DataFrame) -> None:
    # A page may be empty because of `since` or `until`, or because the track is unknown.
    if not page.is_empty() or view.track(track_id) is not None:
        return
    if all(view.rows(one, track_id, None, 1).is_empty() for one in (UPDATES, TRANSITIONS)):
        raise track_not_found(track_id, "retained track")
