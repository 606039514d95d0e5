"""Routes of sensors and their biases."""

from functools import partial
from typing import Annotated, Any, Literal, NamedTuple

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from multiradar.access.parameters import parameter_error, strict_query
from multiradar.access.requirement import DISPLAY
from multiradar.api.access import Access, Granted
from multiradar.api.answers import encoding
from multiradar.api.answers.documents import NOT_FOUND, BiasAnswer, SensorList, SensorState
from multiradar.api.answers.paging import HISTORY_ROWS_MAX, page_by_time, page_until
from multiradar.api.answers.tables import json_response
from multiradar.api.query import AsInteger, At, SensorId, Since, TimeCursor, Until
from multiradar.errors import RequestError
from multiradar.runtime.ports import View
from multiradar.runtime.queries.registry import BIASES

router = APIRouter(
    prefix="/v1/sensors", tags=["sensors"], dependencies=[DISPLAY, Depends(strict_query)]
)

History = Annotated[
    Literal["true", "false"],
    Query(description="`true`: return the estimates of every epoch, oldest first"),
]
HistoryLimit = Annotated[
    int,
    Query(ge=1, le=HISTORY_ROWS_MAX, description="Maximum number of rows of the history"),
    AsInteger,
]


@router.get("", response_model=SensorList)
async def list_sensors(access: Granted, *, at: At = None) -> Response:
    """List the sensors by identifier, with their current state or, with `at`, a past state."""
    if at is None:
        sensors = await access.workers.run(access.view.sensors)
    else:
        sensors = await access.queries.run("past", access.view.sensors, at)
    return json_response({"count": len(sensors), "sensors": sensors})


@router.get("/{sensor_id}", response_model=SensorState, responses=NOT_FOUND)
async def get_sensor(sensor_id: SensorId, access: Granted) -> Response:
    """Return one sensor with its current state."""
    return json_response(await access.workers.run(_sensor, access.view, sensor_id))


@router.get("/{sensor_id}/bias", response_model=BiasAnswer, responses=NOT_FOUND)
async def get_bias(
    sensor_id: SensorId,
    access: Granted,
    *,
    history: History = "false",
    since: Since = None,
    until: Until = None,
    limit: HistoryLimit = 1000,
    cursor: TimeCursor = None,
) -> Response:
    """Return the bias estimates of a sensor, each with its standard deviation."""
    if history == "true":
        return await access.queries.run(
            "history", _history, access, sensor_id, _Asked(since, until, cursor, limit)
        )
    given = {"since": since, "until": until, "cursor": cursor}
    unused = [name for name, value in given.items() if value is not None]
    if unused:
        raise parameter_error(dict.fromkeys(unused, "allowed only together with history=true"))
    return await access.workers.run(_latest, access, sensor_id)


def _latest(access: Access, sensor_id: str) -> Response:
    biases = _sensor(access.view, sensor_id)["biases"]
    head = {"count": len(biases), "next_cursor": None, "sensor_id": sensor_id}
    return json_response({**head, "biases": biases})


class _Asked(NamedTuple):
    # Parameters of a request for biases by time.
    since: float | None
    until: float | None
    cursor: str | None
    limit: int


def _history(access: Access, sensor_id: str, asked: _Asked) -> Response:
    _sensor(access.view, sensor_id)
    read = partial(access.view.rows, BIASES, sensor_id)
    rows = min(asked.limit, access.view.page_rows_max)
    if asked.until is None:
        page, following = page_by_time(read, asked.since, asked.cursor, rows)
    else:
        page, following = page_until(read, asked.since, asked.cursor, rows, asked.until), None
    head = {"count": page.height, "next_cursor": following, "sensor_id": sensor_id}
    body = encoding.envelope(head, "biases", encoding.rows(page))
    return Response(body, media_type=encoding.JSON)


def _sensor(view: View, sensor_id: str) -> dict[str, Any]:
    for sensor in view.sensors():
        if sensor.get("id") == sensor_id:
            return sensor
    raise RequestError(404, "SENSOR_NOT_FOUND", f"no sensor with the name {sensor_id}")
