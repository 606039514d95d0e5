"""The route of encounters: which tracks are expected to come near each other."""

from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from multiradar.api.access import Granted
from multiradar.api.answers.tables import json_response
from multiradar.api.problems import parameter_error
from multiradar.api.query import Integer, Number, strict_query
from multiradar.errors import ForecastError
from multiradar.runtime.queries.encounter_query import (
    DISTANCE_DEFAULT_M,
    DISTANCE_MAX_M,
    DISTANCE_MIN_M,
    HEIGHT_MAX_M,
    HEIGHT_MIN_M,
    HORIZON_DEFAULT_S,
    HORIZON_MAX_S,
    HORIZON_MIN_S,
    LIMIT_DEFAULT,
    LIMIT_MAX,
    EncounterQuery,
)
from multiradar_schemas.products.encounter import Encounters

router = APIRouter(prefix="/v1", tags=["tracks"], dependencies=[Depends(strict_query)])

Horizon = Annotated[
    Number,
    Query(ge=HORIZON_MIN_S, le=HORIZON_MAX_S, description="Prediction horizon, s", examples=[120]),
]
Distance = Annotated[
    Number,
    Query(
        ge=DISTANCE_MIN_M,
        le=DISTANCE_MAX_M,
        description="Horizontal threshold, m: pairs whose predicted positions come closer",
        examples=[9260],
    ),
]
Height = Annotated[
    Number | None,
    Query(
        ge=HEIGHT_MIN_M,
        le=HEIGHT_MAX_M,
        description="Vertical threshold, m: skip pairs separated by more throughout; pairs of "
        "unknown height are kept",
        examples=[305],
    ),
]
Probability = Annotated[
    Number,
    Query(
        ge=0.0,
        le=1.0,
        description="Skip pairs with a lower probability of coming within both thresholds",
        examples=[0.1],
    ),
]
Order = Annotated[
    Literal["time", "probability"],
    Query(description="Sort by time of closest approach, or by probability"),
]
Limit = Annotated[
    Integer, Query(ge=1, le=LIMIT_MAX, description="Maximum number of encounters", examples=[100])
]


@router.get("/encounters", response_model=Encounters)
async def list_encounters(
    access: Granted,
    *,
    horizon_s: Horizon = HORIZON_DEFAULT_S,
    distance_m: Distance = DISTANCE_DEFAULT_M,
    height_m: Height = None,
    probability_min: Probability = 0.0,
    order: Order = "time",
    limit: Limit = LIMIT_DEFAULT,
) -> Response:
    """Predict which pairs of tracks come into proximity, when, and with which probability."""
    try:
        query = EncounterQuery(horizon_s, distance_m, height_m, probability_min, order, limit)
    except ForecastError as error:
        raise parameter_error({error.parameter: error.reason}) from error
    return json_response(await access.workers.run(access.view.encounters, query))
