"""Routes for operators: health, readiness, counters, status and the quarantine."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from multiradar.api.access import Granted
from multiradar.api.answers import encoding
from multiradar.api.answers.documents import Health, Readiness, RejectPage, Status
from multiradar.api.answers.tables import json_response
from multiradar.api.query import Integer, Limit, strict_query
from multiradar.errors import RequestError
from multiradar.observability.metrics import EXPOSITION_MEDIA_TYPE, exposition
from multiradar_schemas.measurements.reject import RejectCode

# The state in which the service accepts measurements.
_READY_STATE = "running"

router = APIRouter(tags=["operations"], dependencies=[Depends(strict_query)])


@router.get("/healthz", response_model=Health)
async def health() -> Response:
    """Liveness: answers as long as the process runs."""
    return Response(b'{"status": "alive"}', media_type=encoding.JSON)


@router.get("/readyz", response_model=Readiness)
async def readiness(access: Granted) -> Response:
    """Readiness: 200 once the journal is recovered and writable, 503 otherwise.

    Also 503 after measurements in real time have ceased, until they come again.
    """
    state, step, silence = await access.workers.run(
        lambda: (str(access.service.state), access.service.start_step, access.service.silence)
    )
    if state != _READY_STATE:
        detail = f"the service is starting: {step}" if step else f"the service is {state}"
        raise RequestError(503, "NOT_READY", detail, {"retry-after": "1"})
    if silence:
        raise RequestError(503, "NO_DATA", silence, {"retry-after": "1"})
    return Response(b'{"ready": true}', media_type=encoding.JSON)


@router.get(
    "/metrics",
    response_class=Response,
    responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
)
async def metrics(access: Granted) -> Response:
    """Return all metrics in the Prometheus text format."""
    text = await access.workers.run(exposition)
    return Response(text, headers={"content-type": EXPOSITION_MEDIA_TYPE})


@router.get("/v1/status", response_model=Status)
async def status(access: Granted) -> Response:
    """Return counts, sequence numbers, data time, output digest and version."""
    value = await access.workers.run(access.view.status)
    return json_response(value)


@router.get("/v1/rejects", response_model=RejectPage)
async def list_rejects(
    access: Granted,
    after: Annotated[
        Integer, Query(ge=0, description="`next_after` of the previous page", examples=[0])
    ] = 0,
    limit: Limit = 1000,
    code: Annotated[
        RejectCode | None, Query(description="Only this reason: its last retained rows")
    ] = None,
) -> Response:
    """Return rejected measurements, oldest first: source, position in it, code and reason."""
    limit = min(limit, access.view.page_rows_max)
    wanted = None if code is None else str(code)
    rows = await access.workers.run(access.service.quarantined, after, limit, wanted)
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
