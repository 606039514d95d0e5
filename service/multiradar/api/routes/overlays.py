"""Overlays of the page: the user's own GeoJSON, by number."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path
from pydantic import BaseModel, Field
from starlette.responses import Response

from multiradar.access.parameters import strict_query
from multiradar.access.requirement import DISPLAY
from multiradar.api.answers.documents import NOT_FOUND
from multiradar.api.answers.encoding import GEOJSON
from multiradar.api.answers.tables import json_response
from multiradar.api.query import AsInteger
from multiradar.errors import RequestError
from multiradar.storage.overlays import FILES_MAX, Overlays


class OverlayState(BaseModel):
    """One overlay."""

    number: int = Field(description="Number of the overlay, for `/v1/overlays/{number}`")
    name: str = Field(description="Name of the file, without the extension")
    features: int
    problem: str = Field(description="Reason why the overlay cannot be shown; empty if it is shown")


class OverlayList(BaseModel):
    """All overlays."""

    count: int
    overlays: list[OverlayState]


def overlay_routes(overlays: Overlays) -> APIRouter:
    """Return the routes of overlays.

    Parameters
    ----------
    overlays : tuple of Overlay
        The overlays; they are named by number only, so that no request names a file.
    """
    router = APIRouter(
        prefix="/v1/overlays", tags=["picture"], dependencies=[DISPLAY, Depends(strict_query)]
    )
    listed = [
        {"number": number, "name": one.name, "features": one.features, "problem": one.problem}
        for number, one in enumerate(overlays)
    ]

    @router.get("", response_model=OverlayList)
    async def list_overlays() -> Response:
        """List the user's GeoJSON overlays, including those that the page cannot show."""
        return json_response({"count": len(listed), "overlays": listed})

    @router.get(
        "/{number}",
        response_class=Response,
        responses={200: {"content": {GEOJSON: {"schema": {"type": "object"}}}}, **NOT_FOUND},
    )
    async def get_overlay(
        number: Annotated[
            int, Path(ge=0, lt=FILES_MAX, description="Number of the overlay"), AsInteger
        ],
    ) -> Response:
        """Return one overlay as a FeatureCollection (RFC 7946)."""
        if number >= len(overlays) or overlays[number].problem:
            raise RequestError(404, "OVERLAY_NOT_FOUND", f"no overlay with number {number}")
        return Response(overlays[number].content, media_type=GEOJSON)

    return router
