"""The OpenAPI document: every refusal of every route is a problem document."""

from typing import Any

from fastapi import FastAPI

from multiradar.api.problems import MEDIA_TYPE, Problem

_REFERENCES = "#/components/schemas/{model}"
# What the framework would answer to a wrong parameter, if it were asked.
_FOREIGN_SCHEMAS = ("HTTPValidationError", "ValidationError")

#: Refusals that any route may answer.
_REFUSALS = {
    "422": "A parameter is unknown, repeated or out of bounds",
    "500": "Internal error; the log has the identifier of the request",
    "503": "Too many requests, or the service is not ready",
}


def install(application: FastAPI) -> None:
    """Have the application describe its refusals in its OpenAPI document."""

    def document() -> dict[str, Any]:
        if application.openapi_schema is None:
            _describe_refusals(FastAPI.openapi(application))
        return application.openapi_schema or {}

    # The way FastAPI documents for changing the document.
    application.openapi = document  # type: ignore[method-assign]  # a method there


def _describe_refusals(document: dict[str, Any]) -> None:
    schema = Problem.model_json_schema(ref_template=_REFERENCES)
    schemas = document["components"]["schemas"]
    for name in _FOREIGN_SCHEMAS:
        schemas.pop(name, None)
    schemas.update(schema.pop("$defs"))
    schemas["Problem"] = schema
    content = {MEDIA_TYPE: {"schema": {"$ref": _REFERENCES.format(model="Problem")}}}
    for operations in document["paths"].values():
        for operation in operations.values():
            answers: dict[str, Any] = operation["responses"]
            for status, text in _REFUSALS.items():
                answers.setdefault(status, {"description": text})
            for status, answer in answers.items():
                if not status.startswith("2"):
                    answer["content"] = content
            if answers["422"]["description"] == "Validation Error":
                answers["422"]["description"] = _REFUSALS["422"]
