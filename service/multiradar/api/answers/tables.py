"""Answers with a table, in the negotiated format."""

from collections.abc import Sequence
from typing import Annotated, Literal
from urllib.parse import urlencode

import polars as pl
from fastapi import Query, Request
from starlette.responses import Response

from multiradar.api.answers import encoding
from multiradar.errors import RequestError

_FORMAT = Query(alias="format", description="Response format; overrides Accept")

TableFormat = Annotated[Literal["json", "arrow"] | None, _FORMAT]
TrackFormat = Annotated[Literal["json", "geojson", "arrow"] | None, _FORMAT]


def chosen_form(request: Request, wanted: str | None, offered: Sequence[str]) -> str:
    """Return the format of the answer, from `format=` or the Accept header.

    Raises
    ------
    RequestError
        406 when no offered format is acceptable.
    """
    form = encoding.chosen_format(wanted, request.headers.get("accept", ""), offered)
    if form is None:
        known = ", ".join(encoding.FORMATS[name] for name in offered)
        raise RequestError(406, "NOT_ACCEPTABLE", f"expected an Accept header with one of {known}")
    return form


def table_response(
    request: Request, page: pl.DataFrame, name: str, form: str, following: str | None
) -> Response:
    """Return a page of a table; the cursor of the next page is in it and in the Link header."""
    headers = {"vary": "accept"}
    if following is not None:
        kept = [pair for pair in request.query_params.multi_items() if pair[0] != "cursor"]
        query = urlencode([*kept, ("cursor", following)])
        headers["link"] = f'<{request.url.path}?{query}>; rel="next"'
        headers["x-next-cursor"] = following
    head = {"count": page.height, "next_cursor": following}
    if form == "arrow":
        body = encoding.arrow_stream(page)
    elif form == "geojson":
        body = encoding.feature_collection(page, head)
    else:
        body = encoding.envelope(head, name, encoding.rows(page))
    return Response(body, media_type=encoding.FORMATS[form], headers=headers)


def json_response(value: object) -> Response:
    """Return a value as JSON."""
    return Response(encoding.document(value), media_type=encoding.JSON)
