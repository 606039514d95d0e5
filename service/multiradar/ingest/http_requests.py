"""What all requests that submit something share: source, key, body, the wait for the journal."""

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from fastapi import Request

from multiradar.access.clients import Caller
from multiradar.access.workers import Workers
from multiradar.errors import RequestError
from multiradar.runtime.live.receipt import (
    IDEMPOTENCY_KEY_FORM,
    IDEMPOTENCY_KEY_LENGTH_MAX,
    Receipt,
    is_idempotency_key,
)

_SOURCE = "http"
#: Reason of a timeout of what is answered once it is processed.
ENGINE_LATE = (
    "the accepted measurements have not all been processed yet; "
    "repeat the request with the same Idempotency-Key"
)

#: The header of `idempotency_key` in OpenAPI.
KEY_PARAMETER: dict[str, Any] = {
    "name": "Idempotency-Key",
    "in": "header",
    "required": False,
    "description": f"Identifier assigned to the message by the sender: {IDEMPOTENCY_KEY_FORM}. A "
    "message that is resent with the same key is not ingested again; the response then contains "
    "`duplicate: true`",
    "schema": {
        "type": "string",
        "maxLength": IDEMPOTENCY_KEY_LENGTH_MAX,
        "pattern": "^[!-~]([ -~]*[!-~])?$",
    },
}


def source_of(caller: Caller) -> str:
    """Return the source of what a caller sends."""
    return f"{_SOURCE}:{caller.name}" if caller.name else _SOURCE


def idempotency_key(request: Request) -> str | None:
    """Return the Idempotency-Key of a request, 400 if it is not valid."""
    keys = request.headers.getlist("idempotency-key")
    if not keys:
        return None
    if len(keys) > 1 or not is_idempotency_key(keys[0]):
        raise RequestError(
            400,
            "IDEMPOTENCY_KEY_INVALID",
            f"expected one Idempotency-Key, {IDEMPOTENCY_KEY_FORM}",
        )
    return keys[0]


async def body_of(request: Request) -> bytes:
    """Return the body of a request; the limit layer bounds it."""
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
    return bytes(body)


async def acknowledged(
    submit: Callable[[], Future[Receipt]], late: str, workers: Workers, deadline_s: float
) -> Receipt:
    """Submit something in a thread, and return its receipt.

    Raises
    ------
    RequestError
        503 after the deadline, s; what is late then, in words.
    """
    pending = asyncio.wrap_future(await workers.run(submit))
    # Not `wait_for`: an entry waiting for the journal must not be cancelled, it may be written.
    await asyncio.wait({pending}, timeout=deadline_s)
    if not pending.done():
        pending.add_done_callback(_retrieved)
        raise RequestError(503, "NOT_ACKNOWLEDGED", late, {"retry-after": "5"})
    return pending.result()


def _retrieved(future: "asyncio.Future[Receipt]") -> None:
    # Nothing awaits the future; reading its error keeps asyncio from reporting it as unread.
    if not future.cancelled():
        future.exception()
