"""Routes for those who run the service: health, readiness, counters, status and the quarantine."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from multiradar.api import encoding
from multiradar.api.access import Granted
from multiradar.api.documents import PROBLEMS, Health, Readiness, RejectPage, Status
from multiradar.api.query import Integer, Limit, strict_query
from multiradar.errors import RequestError
from multiradar.observability.metrics import EXPOSITION_MEDIA_TYPE, exposition

router = APIRouter(tags=["operations"], dependencies=[Depends(strict_query)], responses=PROBLEMS)


@router.get("/healthz", response_model=Health)
async def health() -> Response:
    """Answer as long as the process is alive."""
    return Response(b'{"status": "alive"}', media_type=encoding.JSON)


@router.get("/readyz", response_model=Readiness)
async def readiness(access: Granted) -> Response:
    """Answer 200 once the journal is recovered and can be written, 503 otherwise."""
    if not await access.workers.run(access.service.ready):
        raise RequestError(
            503,
            "NOT_READY",
            "the service is recovering, or its journal cannot be written",
            {"retry-after": "1"},
        )
    return Response(b'{"ready": true}', media_type=encoding.JSON)


@router.get(
    "/metrics",
    response_class=Response,
    responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
)
async def metrics(access: Granted) -> Response:
    """Return all counters in the Prometheus text format."""
    text = await access.workers.run(exposition)
    return Response(text, headers={"content-type": EXPOSITION_MEDIA_TYPE})


@router.get("/v1/status", response_model=Status)
async def status(access: Granted) -> Response:
    """Return counts, sequence numbers, data time, output hashes and version."""
    value = await access.workers.run(access.view.status)
    return Response(encoding.document(value), media_type=encoding.JSON)


@router.get("/v1/rejects", response_model=RejectPage)
async def rejects(
    access: Granted,
    after: Annotated[
        Integer, Query(ge=0, description="`next_after` of the answer before", examples=[0])
    ] = 0,
    limit: Limit = 1000,
) -> Response:
    """Return measurements that were refused, oldest first: source, place, code and reason."""
    value = await access.workers.run(access.view.rejects, after, limit)
    following = value[-1]["number"] if len(value) == limit else None
    body = {"count": len(value), "next_after": following, "rejects": value}
    return Response(encoding.document(body), media_type=encoding.JSON)
