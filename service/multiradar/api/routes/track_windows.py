"""Routes of what the last measurements of a track say: its plane, and whether it is seen."""

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from multiradar.api.access import Granted
from multiradar.api.answers.documents import NOT_FOUND
from multiradar.api.answers.tables import json_response
from multiradar.api.query import Integer, Number, TrackId, strict_query
from multiradar.api.routes.tracks import track_not_found
from multiradar.errors import PlaneError, RequestError, TrajectoryError
from multiradar.runtime.queries.track_windows import WINDOW_DEFAULT_S, WINDOW_MAX_S, WINDOW_MIN_S
from multiradar.runtime.trajectories.document import (
    PATH_STEP_DEFAULT_S,
    PATH_STEP_MAX_S,
    POINTS_DEFAULT,
    POINTS_MAX,
)
from multiradar_schemas.products.manoeuvre_plane import ManoeuvrePlane
from multiradar_schemas.products.observability import Observability
from multiradar_schemas.products.trajectories import Trajectories

router = APIRouter(prefix="/v1/tracks", tags=["tracks"], dependencies=[Depends(strict_query)])

Window = Annotated[
    Number,
    Query(
        ge=WINDOW_MIN_S,
        le=WINDOW_MAX_S,
        description="Window: measurements of the last so many seconds are used, s",
        examples=[60],
    ),
]
_ANSWERS: dict[int | str, dict[str, Any]] = NOT_FOUND | {
    409: {"description": "The plots of the window determine no plane; see `code`"}
}

Points = Annotated[
    Integer,
    Query(
        ge=0, le=POINTS_MAX, description="Maximum points of each path, the last ones", examples=[30]
    ),
]
PointStep = Annotated[
    Integer,
    Query(
        ge=1,
        le=PATH_STEP_MAX_S,
        description="Time between the points of a path, whole seconds",
        examples=[5],
    ),
]
_TRAJECTORY_ANSWERS: dict[int | str, dict[str, Any]] = NOT_FOUND | {
    409: {"description": "There are no trajectories of the track; see `code`"}
}


@router.get("/{track_id}/manoeuvre-plane", response_model=ManoeuvrePlane, responses=_ANSWERS)
async def get_manoeuvre_plane(
    track_id: TrackId, access: Granted, window_s: Window = WINDOW_DEFAULT_S
) -> Response:
    """Fit a plane to the last plots of a live track and test whether they lie in it."""
    try:
        plane = await access.workers.run(access.view.manoeuvre_plane, track_id, window_s)
    except PlaneError as error:
        raise RequestError(409, error.code, str(error)) from error
    if plane is None:
        raise track_not_found(track_id)
    return json_response(plane)


@router.get("/{track_id}/observability", response_model=Observability, responses=NOT_FOUND)
async def get_observability(
    track_id: TrackId, access: Granted, window_s: Window = WINDOW_DEFAULT_S
) -> Response:
    """Return whether ranges or intersecting bearings make the position of a track observable."""
    found = await access.workers.run(access.view.observability, track_id, window_s)
    if found is None:
        raise track_not_found(track_id)
    return json_response(found)


@router.get("/{track_id}/trajectories", response_model=Trajectories, responses=_TRAJECTORY_ANSWERS)
async def get_trajectories(
    track_id: TrackId,
    access: Granted,
    points: Points = POINTS_DEFAULT,
    step_s: PointStep = PATH_STEP_DEFAULT_S,
) -> Response:
    """Return the reconstructed trajectories of a live track over its last 90 s, with weights."""
    try:
        told = await access.workers.run(access.view.trajectories, track_id, points, step_s)
    except TrajectoryError as error:
        raise RequestError(409, error.code, str(error)) from error
    if told is None:
        raise track_not_found(track_id)
    return json_response(told)
