"""`/docs`: the OpenAPI document as one page without scripts or external resources."""

import asyncio
import html
import re
from collections.abc import Iterator, Mapping
from typing import Any

from fastapi import APIRouter, FastAPI, Request
from starlette.responses import HTMLResponse, JSONResponse, Response

from multiradar.access.requirement import PUBLIC

_STYLE = """
:root { color-scheme: light dark; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
section { border-top: 1px solid #8884; padding: .8rem 0; }
h2 { font: 600 15px/1.5 ui-monospace, monospace; margin: 0; }
h2 b { display: inline-block; min-width: 3.2rem; color: #1769aa; }
p { margin: .3rem 0; }
table { border-collapse: collapse; width: 100%; font-size: 14px; }
td { vertical-align: top; padding: .15rem .8rem .15rem 0; }
td:first-child, code { font-family: ui-monospace, monospace; white-space: nowrap; }
small { opacity: .7; }
"""

_CODE = re.compile(r"(`+)(.+?)\1")
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'"


class Documents:
    """The documents of an application: made at the first request for one, in a thread.

    Parameters
    ----------
    application : FastAPI
        The application.
    """

    def __init__(self, application: FastAPI) -> None:
        self._application = application
        self._making: asyncio.Task[tuple[bytes, bytes]] | None = None

    async def encoded(self) -> tuple[bytes, bytes]:
        """Return the OpenAPI document, and the page, encoded."""
        if self._making is None:
            self._making = asyncio.create_task(asyncio.to_thread(self._make))
        # Others wait for it, too.
        return await asyncio.shield(self._making)

    def _make(self) -> tuple[bytes, bytes]:
        document = self._application.openapi()
        return bytes(JSONResponse(document).body), "".join(_page(document)).encode()


# They describe the interface, which is public; they have no data.
router = APIRouter(include_in_schema=False, dependencies=[PUBLIC])


@router.get("/openapi.json")
async def openapi_document(request: Request) -> Response:
    """Return the OpenAPI document of the application."""
    document, _ = await _documents(request).encoded()
    return Response(document, media_type="application/json")


@router.get("/docs")
async def documentation(request: Request) -> HTMLResponse:
    """Return the OpenAPI document of the application as a page."""
    _, page = await _documents(request).encoded()
    return HTMLResponse(page, headers={"content-security-policy": _POLICY})


def _documents(request: Request) -> Documents:
    found: Documents = request.app.state.documents
    return found


def _page(document: Mapping[str, Any]) -> Iterator[str]:
    title = html.escape(f"{document['info']['title']} {document['info']['version']}")
    yield f"<!doctype html><html lang=en><meta charset=utf-8><title>{title}</title>"
    yield f"<style>{_STYLE}</style><h1>{title}</h1>"
    yield _paragraphs(document["info"].get("description", ""))
    yield "<p>Machine-readable: <a href=/openapi.json>openapi.json</a>. "
    yield "WebSocket: <code>/v1/stream?after=&amp;kinds=</code>, with the parameters of "
    yield "<code>/v1/events</code>. HEAD is supported wherever GET is.</p>"
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            yield from _operation(method, path, operation)


def _operation(method: str, path: str, operation: Mapping[str, Any]) -> Iterator[str]:
    yield f"<section><h2><b>{method.upper()}</b> {html.escape(path)}</h2>"
    yield _paragraphs(operation.get("description", operation.get("summary", "")))
    parameters = operation.get("parameters", [])
    if parameters:
        yield "<table>"
        for parameter in parameters:
            yield _parameter(parameter)
        yield "</table>"
    answers = ", ".join(sorted(operation.get("responses", {})))
    yield f"<p><small>Status {html.escape(answers)}</small></p></section>"


def _parameter(parameter: Mapping[str, Any]) -> str:
    name = html.escape(parameter["name"])
    place = html.escape(parameter["in"])
    text = inline(parameter.get("description", ""))
    return f"<tr><td>{name}<td><small>{place}</small><td>{text}</tr>"


def _paragraphs(text: str) -> str:
    return "".join(f"<p>{inline(part)}</p>" for part in text.strip().split("\n\n"))


def inline(text: str) -> str:
    """Return a description as HTML; the only Markdown in descriptions is code."""
    return _CODE.sub(r"<code>\2</code>", html.escape(text))
