"""The routes of the registered queries, made from their declarations."""

import inspect
import math
from collections.abc import Awaitable, Callable, Iterator
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends
from fastapi import Query as QueryInformation
from starlette.responses import Response

from multiradar.access.parameters import AsNumber, parameter_error, strict_query
from multiradar.access.requirement import DISPLAY
from multiradar.api.access import Access, Granted
from multiradar.api.answers.documents import NOT_FOUND
from multiradar.api.answers.tables import json_response
from multiradar.api.query import AsInteger, At, TrackId
from multiradar.errors import ForecastError, RequestError
from multiradar.runtime.queries.parameters import Parameter
from multiradar.runtime.queries.registry import NO_ANSWER, QUERIES, Query

router = APIRouter(prefix="/v1", tags=["tracks"], dependencies=[DISPLAY, Depends(strict_query)])


def track_not_found(track_id: int, wanted: str = "live track") -> RequestError:
    """Return the error of a request for an unknown track, or for one that was terminated."""
    return RequestError(404, "TRACK_NOT_FOUND", f"no {wanted} with number {track_id}")


def _annotation(parameter: Parameter) -> Any:
    examples = None if parameter.example is None else [parameter.example]
    info: dict[str, Any] = {"description": parameter.description, "examples": examples}
    if parameter.kind is str:
        return Annotated[Literal[parameter.choices], QueryInformation(**info)]
    info["le"] = parameter.most if math.isfinite(parameter.most) else None
    if parameter.above is not None:
        info["gt"] = parameter.above
    else:
        info["ge"] = parameter.least
    kind: Any = parameter.kind if parameter.default is not None else parameter.kind | None
    reader = AsInteger if parameter.kind is int else AsNumber
    return Annotated[kind, QueryInformation(**info), reader]


def _arguments(query: Query) -> Iterator[inspect.Parameter]:
    keyword = inspect.Parameter.KEYWORD_ONLY
    yield inspect.Parameter("access", keyword, annotation=Granted)
    if query.of_track:
        yield inspect.Parameter("track_id", keyword, annotation=TrackId)
    for one in query.parameters:
        yield inspect.Parameter(one.name, keyword, default=one.default, annotation=_annotation(one))
    if query.of_past:
        yield inspect.Parameter("at", keyword, default=None, annotation=At)


def _endpoint(query: Query) -> Callable[..., Awaitable[Response]]:
    async def answer(
        access: Access, track_id: int | None = None, at: float | None = None, **given: Any
    ) -> Response:
        try:
            document = await access.queries.run(
                query.name, lambda: access.view.ask(query, track_id, at, **given)
            )
        except ForecastError as error:
            raise parameter_error({error.parameter: error.reason}) from error
        except NO_ANSWER as error:
            raise RequestError(409, error.code, str(error)) from error
        if document is None:
            raise track_not_found(track_id or 0)
        return json_response(document)

    # FastAPI reads the name, the signature and the docstring of a function.
    verb = "get" if query.of_track else "list"
    answer.__name__ = f"{verb}_{query.name.replace('-', '_')}"
    answer.__doc__ = query.summary
    answer.__dict__["__signature__"] = inspect.Signature(list(_arguments(query)))
    return answer


for _query in QUERIES:
    _answers: dict[int | str, dict[str, Any]] = NOT_FOUND if _query.of_track else {}
    if _query.no_answer:
        _answers = _answers | {409: {"description": _query.no_answer}}
    router.add_api_route(
        f"/tracks/{{track_id}}/{_query.name}" if _query.of_track else f"/{_query.name}",
        _endpoint(_query),
        response_model=_query.model,
        responses=_answers,
    )
