"""The OpenAPI document: every error answer of every route is a problem document."""

from typing import Any

from fastapi import FastAPI

from multiradar.api.problems import MEDIA_TYPE, Problem

_REFERENCES = "#/components/schemas/{model}"
# Schemas of the framework for invalid parameters, which are not used.
_FOREIGN_SCHEMAS = ("HTTPValidationError", "ValidationError")

_CERTIFICATE = "certificate"
_REJECTIONS = {
    "401": "The service requires valid credentials",
    "403": "The client's role does not allow this request, or the request comes from a page of a "
    "different origin",
}

#: Error answers of all routes.
_ERROR_ANSWERS = {
    "400": "The length of the body is ambiguous",
    "421": "The Host header is not one of the allowed hosts",
    "422": "A parameter is unknown, repeated or out of bounds",
    "429": "Too many requests, streams or expensive queries from this client",
    "431": "The path and headers are too long",
    "500": "Internal error; search the log for the request identifier",
    "503": "Too many requests, a query exceeded its deadline, or the service is not ready",
}
#: Further ones of routes that read a body.
_BODY_ANSWERS = {
    "403": "The request comes from a page of a different origin",
    "408": "The body did not arrive in time",
    "413": "The body is too large",
}


def install(application: FastAPI) -> None:
    """Describe parameters and error answers in the OpenAPI document of the application."""

    def document() -> dict[str, Any]:
        if application.openapi_schema is None:
            required = application.state.authentication.required
            _describe(FastAPI.openapi(application), required)
        return application.openapi_schema or {}

    # As FastAPI documents for changing the document.
    application.openapi = document  # type: ignore[method-assign]  # a method there


def _secure(operation: dict[str, Any], required: bool) -> None:
    secured = operation.get("security")
    if secured:
        # A client certificate in place of the key or token, for the same role.
        secured.append({_CERTIFICATE: next(iter(secured[0].values()))})
        if not required:
            # Or none of them.
            secured.append({})
        for status, text in _REJECTIONS.items():
            operation["responses"][status] = {"description": text}


def _describe(document: dict[str, Any], required: bool) -> None:
    schema = Problem.model_json_schema(ref_template=_REFERENCES)
    schemas = document["components"]["schemas"]
    for name in _FOREIGN_SCHEMAS:
        schemas.pop(name, None)
    schemas.update(schema.pop("$defs"))
    schemas["Problem"] = schema
    document["components"]["securitySchemes"][_CERTIFICATE] = {
        "type": "mutualTLS",
        "description": "Client certificate, if its certificate authority is configured in the "
        "service.",
    }
    content = {MEDIA_TYPE: {"schema": {"$ref": _REFERENCES.format(model="Problem")}}}
    for operations in document["paths"].values():
        for method, operation in operations.items():
            for parameter in operation.get("parameters", ()):
                _describe_parameter(parameter)
            schemas.update(_shared_schemas(operation))
            _secure(operation, required)
            common = _ERROR_ANSWERS | (_BODY_ANSWERS if method in ("post", "put") else {})
            _add_errors(operation["responses"], common, content)


def _add_errors(answers: dict[str, Any], common: dict[str, str], content: dict[str, Any]) -> None:
    for status, text in common.items():
        answers.setdefault(status, {"description": text})
    for status, answer in answers.items():
        if not status.startswith("2"):
            answer["content"] = content
    if answers["422"]["description"] == "Validation Error":
        answers["422"]["description"] = common["422"]


# The schemas that a body refers to, which it carries as JSON Schema does.
def _shared_schemas(operation: dict[str, Any]) -> dict[str, Any]:
    shared: dict[str, Any] = {}
    for form in operation.get("requestBody", {}).get("content", {}).values():
        shared |= form["schema"].get("$defs", {})
        form["schema"] = {key: value for key, value in form["schema"].items() if key != "$defs"}
    return shared


def _describe_parameter(parameter: dict[str, Any]) -> None:
    schema = parameter["schema"]
    # An absent parameter is not null.
    kinds = [one for one in schema.get("anyOf", ()) if one != {"type": "null"}]
    if len(kinds) == 1:
        others = {name: value for name, value in schema.items() if name != "anyOf"}
        schema = parameter["schema"] = {**kinds[0], **others}
    if schema.get("type") == "array":
        # Lists are separated by commas.
        parameter |= {"style": "form", "explode": False}
