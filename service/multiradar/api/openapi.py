"""The OpenAPI document: every error answer of every route is a problem document."""

from typing import Any

from fastapi import FastAPI

from multiradar.api.problems import MEDIA_TYPE, Problem

_REFERENCES = "#/components/schemas/{model}"
# Schemas of the framework for invalid parameters, which are not used.
_FOREIGN_SCHEMAS = ("HTTPValidationError", "ValidationError")

#: Error answers of all routes.
_ERROR_ANSWERS = {
    "422": "A parameter is unknown, repeated or out of bounds",
    "500": "Internal error; the log has the identifier of the request",
    "503": "Too many requests, or the service is not ready",
}


def install(application: FastAPI) -> None:
    """Describe the error answers in the OpenAPI document of the application."""

    def document() -> dict[str, Any]:
        if application.openapi_schema is None:
            _describe_errors(FastAPI.openapi(application))
        return application.openapi_schema or {}

    # As FastAPI documents for changing the document.
    application.openapi = document  # type: ignore[method-assign]  # a method there


def _describe_errors(document: dict[str, Any]) -> None:
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
            for status, text in _ERROR_ANSWERS.items():
                answers.setdefault(status, {"description": text})
            for status, answer in answers.items():
                if not status.startswith("2"):
                    answer["content"] = content
            if answers["422"]["description"] == "Validation Error":
                answers["422"]["description"] = _ERROR_ANSWERS["422"]
