"""Routes for operators: health, readiness, counters, status and the quarantine."""

import json
from typing import Annotated

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from multiradar.access.parameters import strict_query
from multiradar.access.requirement import DISPLAY, PUBLIC
from multiradar.api.access import Granted
from multiradar.api.answers import encoding
from multiradar.api.answers.documents import Health, Readiness, RejectPage, Status
from multiradar.api.answers.tables import json_response
from multiradar.api.query import INTEGER_MOST, AsInteger, Limit
from multiradar.errors import RequestError
from multiradar.observability.metrics import EXPOSITION_MEDIA_TYPE, exposition
from multiradar_schemas.reject import RejectCode

router = APIRouter(tags=["operations"], dependencies=[Depends(strict_query)])


@router.get("/healthz", response_model=Health, dependencies=[PUBLIC])
async def health(access: Granted) -> Response:
    """Liveness: 200, or 503 if only a restart by the supervisor can help."""
    stalled = access.service.stalled
    if stalled:
        raise RequestError(503, "STALLED", stalled)
    return Response(b'{"status": "alive"}', media_type=encoding.JSON)


@router.get("/readyz", response_model=Readiness, dependencies=[PUBLIC])
async def readiness(access: Granted) -> Response:
    """Readiness: 503 with the `reasons` if the service is not processing data normally.

    The service is starting or has failed, its disk is full, it is too far behind, it rejects all
    measurements or no longer receives any, or it has lost its Zenoh router. `code` is the code of
    the first reason.
    """
    reasons = await access.workers.run(access.service.unready)
    if reasons:
        every = [{"code": one.code, "reason": one.text} for one in reasons]
        raise RequestError(
            503,
            reasons[0].code,
            "; ".join(reason.text for reason in reasons),
            {"retry-after": "1"},
            members=json.dumps({"reasons": every})[1:-1].encode(),
        )
    return Response(b'{"ready": true}', media_type=encoding.JSON)


@router.get(
    "/metrics",
    dependencies=[DISPLAY],
    response_class=Response,
    responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
)
async def metrics(access: Granted) -> Response:
    """Return all metrics in the Prometheus text format."""
    text = await access.workers.run(exposition)
    return Response(text, headers={"content-type": EXPOSITION_MEDIA_TYPE})


@router.get("/v1/status", response_model=Status, dependencies=[DISPLAY])
async def status(access: Granted) -> Response:
    """Return counts, sequence numbers, data time, output digest and version."""
    value = await access.workers.run(access.view.status)
    return json_response({**value, "pages": access.pages.connected()})


@router.get("/v1/rejects", response_model=RejectPage, dependencies=[DISPLAY])
async def list_rejects(
    access: Granted,
    after: Annotated[
        int,
        Query(ge=0, le=INTEGER_MOST, description="`next_after` of the previous page", examples=[0]),
        AsInteger,
    ] = 0,
    limit: Limit = 1000,
    code: Annotated[
        RejectCode | None,
        Query(description="Return only the retained rows with this code"),
    ] = None,
) -> Response:
    """Return rejected measurements, oldest first: source, location, code, reason and content."""
    limit = min(limit, access.view.page_rows_max)
    wanted = None if code is None else str(code)
    rows = await access.queries.run("history", access.service.quarantined, after, limit, wanted)
    rejects = [
        {
            "number": row.number,
            "journal_sequence": row.sequence,
            "source": row.source,
            "index": row.row.index,
            "code": row.row.code,
            "reason": row.row.reason,
            "raw": row.row.raw,
        }
        for row in rows
    ]
    following = rows[-1].number if len(rows) == limit else None
    return json_response({"count": len(rows), "next_after": following, "rejects": rejects})
