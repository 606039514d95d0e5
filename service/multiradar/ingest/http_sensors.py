"""Sensors that are added, changed, disabled and enabled over HTTP while the service runs."""

import json
from concurrent.futures import Future
from functools import partial
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Path, Query, Request
from pydantic import BaseModel, Field
from starlette.responses import Response

from multiradar.access.clients import Caller
from multiradar.access.parameters import strict_query
from multiradar.access.requirement import DISPLAY, OPERATE, log_operated
from multiradar.access.security_log import SECURITY_LOG
from multiradar.access.workers import Workers
from multiradar.errors import ConfigurationError, RequestError
from multiradar.ingest.http_requests import (
    ENGINE_LATE,
    KEY_PARAMETER,
    acknowledged,
    body_of,
    idempotency_key,
    source_of,
)
from multiradar.runtime.admission.sensors_in_force import SensorPlan, sensor_change
from multiradar.runtime.live.receipt import Receipt, key_of_sender, once_executed
from multiradar.runtime.ports import OperatedSink
from multiradar_schemas.measurements.measurement import SENSOR_ID_PATTERN
from multiradar_schemas.sensors.sensor import Sensor

#: Octets of a description.
BODY_BYTES_MAX = 1 << 16
#: Keys of a description; a complete one has 68. Each that is unknown takes a search for the answer.
KEYS_MAX = 256

SensorId = Annotated[
    str,
    Path(
        pattern=SENSOR_ID_PATTERN, description="Name of the sensor", examples=["41-10"]
    ),
]  # fmt: skip
# Of a duplicate nothing is known but its entry.
_NO_PLAN = SensorPlan(b"", False, [], [], False)
Choice = Literal["true", "false"]
_DRY_RUN_TEXT = "`true`: dry run; return the changes without applying them"
_RESET_TEXT = (
    "`true`: restart the biases of the sensor from their priors, for example after work on its "
    "antenna; this always happens if the site changes"
)


class ChangedField(BaseModel):
    """A field of a sensor that changes."""

    field: str = Field(
        description="Name of the field, as in the sensors file", examples=["range_sigma_m"]
    )
    before: Any = Field(description="Previous value; null for a new sensor", examples=[50.0])
    after: Any = Field(description="New value", examples=[80.0])


class SensorChanged(BaseModel):
    """The effect of a change of a sensor; sent when the change is in effect."""

    sensor_id: str = Field(examples=["41-10"])
    applied: bool = Field(
        description="Whether the change was applied; false for a dry run, or if nothing differs "
        "and there is no Idempotency-Key"
    )
    duplicate: bool = Field(
        description="A change with this Idempotency-Key was applied earlier, and "
        "`journal_sequence` is its entry; this request changed nothing, and later changes remain "
        "in effect"
    )
    added: bool = Field(description="Whether the sensor is new")
    changes: list[ChangedField] = Field(description="Changed fields; empty if there are none")
    biases_reset: list[str] = Field(
        description="Bias parameters of the sensor that restart from their priors", examples=[[]]
    )
    health_reset: bool = Field(
        description="Whether the health estimates of the sensor (noise, site error, probability of "
        "detection) restart"
    )
    journal_sequence: int | None = Field(
        description="Journal entry that contains the change; null if there is none"
    )


def sensor_change_routes(sink: OperatedSink, acknowledge_deadline_s: float = 30.0) -> APIRouter:
    """Return the routes that change sensors.

    Parameters
    ----------
    sink : OperatedSink
        The running service.
    acknowledge_deadline_s : float
        Maximum wait for the engine before the answer is 503.
    """
    router = APIRouter(prefix="/v1/sensors", tags=["sensors"])
    workers = Workers(1, name="multiradar-sensors")

    @router.get(
        "/{sensor_id}/configuration",
        dependencies=[DISPLAY, Depends(strict_query)],
        response_model=Sensor,
        responses={404: {"description": "No such sensor"}},
    )
    async def get_configuration(sensor_id: SensorId) -> Response:
        """Return the configuration of a sensor: the sensors file with all later changes."""
        described = sink.describe_sensor(sensor_id)
        if described is None:
            raise RequestError(404, "SENSOR_NOT_FOUND", f"no sensor with the name {sensor_id}")
        return Response(json.dumps(described), media_type="application/json")

    @router.put(
        "/{sensor_id}",
        dependencies=[OPERATE, Depends(strict_query)],
        response_model=SensorChanged,
        responses=_ANSWERS,
        openapi_extra=_REQUEST_BODY,
        description=_TEXT,
    )
    async def put_sensor(
        request: Request,
        sensor_id: SensorId,
        dry_run: Annotated[Choice, Query(description=_DRY_RUN_TEXT)] = "false",
        reset_biases: Annotated[Choice, Query(description=_RESET_TEXT)] = "false",
    ) -> Response:
        caller: Caller = request.state.caller
        key = key_of_sender(caller.name, idempotency_key(request))
        values = _description(request, await body_of(request))
        reset = reset_biases == "true"
        # In the same thread, so that a change and its retry come one after the other.
        kept = key if dry_run == "false" else None
        try:
            plan = _NO_PLAN
            # A retry is compared with its first message, not with the sensors of now.
            if kept is None or not await workers.run(sink.has_message, kept):
                plan = sink.plan_sensor(sensor_id, values, reset_biases=reset)
            receipt = None
            # With a key also if nothing differs: otherwise a late retry would undo a later change.
            if dry_run == "false" and (plan.change or key is not None):
                change = sensor_change(sensor_id, values, reset_biases=reset)

                def submit() -> "Future[Receipt]":
                    future = sink.change_sensor(
                        change, source=source_of(caller), idempotency_key=key
                    )
                    # Also if it is confirmed only after the answer.
                    return once_executed(future, partial(_log_change, request, sensor_id, plan))

                receipt = await acknowledged(submit, ENGINE_LATE, workers, acknowledge_deadline_s)
        except ConfigurationError as error:
            raise RequestError(422, "SENSOR_INVALID", str(error)) from error
        duplicate = receipt is not None and receipt.duplicate
        answer = {
            "sensor_id": sensor_id,
            "applied": receipt is not None,
            "duplicate": duplicate,
            **(_NO_PLAN if duplicate else plan)._asdict(),
            "journal_sequence": None if receipt is None else receipt.journal_sequence,
        }
        del answer["change"]
        return Response(json.dumps(answer), media_type="application/json")

    return router


def _log_change(request: Request, sensor_id: str, plan: SensorPlan) -> None:
    log_operated(request)
    SECURITY_LOG.info(
        "sensor_changed", client=request.state.caller.name, sensor_id=sensor_id,
        fields=[one["field"] for one in plan.changes], biases_reset=plan.biases_reset,
    )  # fmt: skip


def _description(request: Request, body: bytes) -> dict[str, Any]:
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if media_type != "application/json":
        raise RequestError(
            415, "CONTENT_TYPE_UNSUPPORTED", "expected a Content-Type of application/json"
        )
    if len(body) > BODY_BYTES_MAX:
        raise RequestError(
            413, "BODY_TOO_LARGE", f"expected at most {BODY_BYTES_MAX} octets, found {len(body)}"
        )
    count = 0

    def few_and_each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        nonlocal count
        count += len(pairs)
        if count > KEYS_MAX:
            msg = f"expected at most {KEYS_MAX} keys"
            raise ValueError(msg)
        return _each_once(pairs)

    try:
        values = json.loads(body, object_pairs_hook=few_and_each_once, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise RequestError(400, "MALFORMED_BODY", f"expected a JSON object: {error}") from error
    if not isinstance(values, dict):
        raise RequestError(
            400, "MALFORMED_BODY", f"expected a JSON object, was {type(values).__name__}"
        )
    return values


def _each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        msg = f"duplicate key {twice!a:.80}"
        raise ValueError(msg)
    return found


def _no_number(text: str) -> float:
    msg = f"{text} is not a JSON number"
    raise ValueError(msg)


_TEXT = """\
Add or change a sensor. The body is the complete configuration of the sensor, with the keys of a
`[[sensor]]` table in the sensors file; omitted keys have their default values. To change a sensor,
read `/v1/sensors/{sensor_id}/configuration`, edit the response and send it back. The change is
recorded in the journal and applies to all later measurements; the response is sent when the change
is in effect. Tracks, track numbers and the biases of other sensors are kept.
"""

_EXAMPLE = {
    "id": "41-10",
    "kind": "radar",
    "latitude_deg": 50.0,
    "longitude_deg": 14.0,
    "height_m": 400.0,
    "range_sigma_m": 80.0,
    "enabled": True,
}

_REQUEST_BODY: dict[str, Any] = {
    "parameters": [KEY_PARAMETER],
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": {"type": "object"}, "example": _EXAMPLE}},
    },
}

_ANSWERS: dict[int | str, dict[str, Any]] = {
    400: {"description": "The body is not a JSON object, or the Idempotency-Key is not valid"},
    413: {"description": "The body is too large"},
    415: {"description": "Unsupported media type"},
    422: {
        "description": "Invalid sensor configuration or parameter, a change that requires a new "
        "journal, or an Idempotency-Key already used for another message"
    },
    429: {"description": "Back-pressure: the journal cannot keep up; see `Retry-After`"},
    503: {"description": "The journal failed, or the service is not ready"},
    507: {"description": "Disk full; nothing was changed"},
}
