"""Query parameters of all routes: unknown and repeated ones are rejected, never ignored."""

import re
from collections import Counter
from collections.abc import Mapping

from fastapi import Request
from pydantic import BeforeValidator

from multiradar.errors import RequestError
from multiradar_schemas.documents.names import did_you_mean

#: ASCII only: float() of Python also accepts "1_0" and digits of other scripts.
NUMBER = re.compile(r"[+-]?(?:[0-9]{1,20}(?:\.[0-9]{0,20})?|\.[0-9]{1,20})(?:[eE][+-]?[0-9]{1,3})?")
# Unknown parameters named in an answer.
_SHOWN_MAX = 8


def number(text: object) -> float:
    """Return a number written in plain ASCII decimal notation.

    Raises
    ------
    ValueError
        When it has another form.
    """
    if not isinstance(text, str) or NUMBER.fullmatch(text) is None:
        msg = "expected a decimal number"
        raise ValueError(msg)
    return float(text)


#: The bounds of a parameter stand before it: after a function, they are missing in OpenAPI.
AsNumber = BeforeValidator(number)


def parameter_error(parameters: Mapping[str, str], code: str = "INVALID_PARAMETER") -> RequestError:
    """Return the error of a request with invalid parameters, each with its reason."""
    detail = "; ".join(f"{name}: {reason}" for name, reason in parameters.items())
    return RequestError(422, code, detail, parameters=parameters)


async def strict_query(request: Request) -> None:
    """Reject unknown and repeated query parameters.

    Raises
    ------
    RequestError
        422 with the names of the parameters.
    """
    known = {field.alias for field in request.scope["route"].dependant.query_params}
    given = Counter(name for name, _ in request.query_params.multi_items())
    wrong = [name for name in given if name not in known]
    if wrong:
        names = ", ".join(sorted(known)) or "none"
        # A suggestion takes a search, and a request has room for thousands of names.
        shown = {
            ascii(name)[1:-1][:64]: f"unknown parameter{did_you_mean(name, known)}; known: {names}"
            for name in wrong[:_SHOWN_MAX]
        }
        raise parameter_error(shown, code="UNKNOWN_PARAMETER")
    repeated = {name: "expected once" for name, count in given.items() if count > 1}
    if repeated:
        raise parameter_error(repeated)
