"""The OpenAPI document: complete, and changed only on purpose."""

import asyncio
import json
import threading
from html.parser import HTMLParser
from typing import Any

import httpx
import jsonschema
import pytest
from fastapi import FastAPI

from multiradar.api import documentation
from multiradar_schemas.export import documents

_PATHS = {
    "/data/aircraft.json": ["get"],
    "/data/receiver.json": ["get"],
    "/healthz": ["get"],
    "/metrics": ["get"],
    "/readyz": ["get"],
    "/v1/drain": ["post"],
    "/v1/encounters": ["get"],
    "/v1/events": ["get"],
    "/v1/flush": ["post"],
    "/v1/clock": ["post"],
    "/v1/measurements": ["post"],
    "/v1/picture": ["get"],
    "/v1/rejects": ["get"],
    "/v1/residuals": ["get"],
    "/v1/regions": ["get"],
    "/v1/sensors": ["get"],
    "/v1/sensors/{sensor_id}": ["get", "put"],
    "/v1/sensors/{sensor_id}/bias": ["get"],
    "/v1/sensors/{sensor_id}/configuration": ["get"],
    "/v1/status": ["get"],
    "/v1/tracks": ["get"],
    "/v1/tracks/{track_id}": ["get"],
    "/v1/tracks/{track_id}/forecast": ["get"],
    "/v1/tracks/{track_id}/manoeuvre-plane": ["get"],
    "/v1/tracks/{track_id}/observability": ["get"],
    "/v1/tracks/{track_id}/plots": ["get"],
    "/v1/tracks/{track_id}/trajectories": ["get"],
    "/v1/tracks/{track_id}/history": ["get"],
    "/v1/tracks/{track_id}/transitions": ["get"],
}


@pytest.fixture
def document(application: FastAPI) -> dict[str, Any]:
    return application.openapi()


def _operations(document: dict[str, Any]) -> list[dict[str, Any]]:
    return [operation for path in document["paths"].values() for operation in path.values()]


def test_the_paths_are_those_that_clients_rely_on(document: dict[str, Any]) -> None:
    assert {path: sorted(one) for path, one in document["paths"].items()} == _PATHS


def test_every_operation_and_parameter_is_described(document: dict[str, Any]) -> None:
    for operation in _operations(document):
        assert operation["description"]
        for parameter in operation.get("parameters", []):
            assert parameter.get("description"), parameter


def test_every_rejection_is_a_problem_document(document: dict[str, Any]) -> None:
    for operation in _operations(document):
        for status, answer in operation["responses"].items():
            if status != "200":
                assert list(answer["content"]) == ["application/problem+json"], (status, answer)
                schema = answer["content"]["application/problem+json"]["schema"]
                assert schema["$ref"].endswith("/Problem")


def test_every_operation_with_a_body_names_its_rejections(document: dict[str, Any]) -> None:
    for operation in _operations(document):
        if "requestBody" in operation:
            assert {"403", "408", "413"} <= operation["responses"].keys()


def test_the_fields_of_a_track_carry_their_units(document: dict[str, Any]) -> None:
    properties = document["components"]["schemas"]["Track"]["properties"]
    assert properties["speed_mps"]["unit"] == "m/s"
    assert all("unit" in field for field in properties.values())


def test_the_forms_of_a_list_of_tracks_are_named(document: dict[str, Any]) -> None:
    content = document["paths"]["/v1/tracks"]["get"]["responses"]["200"]["content"]
    assert sorted(content) == [
        "application/geo+json",
        "application/json",
        "application/vnd.apache.arrow.stream",
    ]


class _Links(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.tags: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.addresses += [value or "" for name, value in attrs if name in {"href", "src"}]


async def test_the_page_names_every_path_and_fetches_nothing_from_elsewhere(
    client: httpx.AsyncClient,
) -> None:
    answer = await client.get("/docs")
    assert answer.headers["content-type"].startswith("text/html")
    for path in _PATHS:
        assert path in answer.text
    links = _Links()
    links.feed(answer.text)
    assert all(address.startswith("/") for address in links.addresses)
    assert not links.tags & {"script", "link", "img", "iframe"}


async def test_the_page_shows_no_markdown(client: httpx.AsyncClient) -> None:
    answer = await client.get("/docs")
    assert "`" not in answer.text
    assert "<code>next_cursor</code>" in answer.text
    # The sections of docstrings are for readers of the code.
    assert "----" not in answer.text
    assert "Parameters" not in answer.text


async def test_the_documents_are_made_once_and_not_on_the_thread_of_the_requests(
    application: FastAPI, client: httpx.AsyncClient
) -> None:
    """Anybody could keep that thread busy: 0.9 s for the first one, 11 ms for each further one."""
    made: list[int] = []
    make = application.openapi

    def made_here() -> dict[str, Any]:
        made.append(threading.get_ident())
        return make()

    application.openapi = made_here  # type: ignore[method-assign]
    paths = ("/openapi.json", "/docs") * 2
    answers = await asyncio.gather(*(client.get(path) for path in paths))
    assert [one.status_code for one in answers] == [200] * 4
    assert answers[0].headers["content-type"] == "application/json"
    assert answers[0].json() == make()
    assert len(made) == 1
    assert made[0] != threading.get_ident()


@pytest.mark.parametrize(
    ("text", "page"),
    [
        ("one `a_b` and `c`", "one <code>a_b</code> and <code>c</code>"),
        ("``x`y``", "<code>x`y</code>"),
        ("a < b & `<i>`", "a &lt; b &amp; <code>&lt;i&gt;</code>"),
        ("one ` alone", "one ` alone"),
    ],
)
def test_code_in_a_description_is_code_on_the_page(text: str, page: str) -> None:
    assert documentation.inline(text) == page


def test_the_forms_of_a_message_are_those_that_are_taken(document: dict[str, Any]) -> None:
    body = document["paths"]["/v1/measurements"]["post"]["requestBody"]
    content = body["content"]
    assert body["required"]
    assert sorted(content) == [
        "application/json",
        "application/vnd.apache.arrow.stream",
        "application/x-ndjson",
    ]
    columns = content["application/vnd.apache.arrow.stream"]["schema"]
    assert columns == {"type": "string", "format": "binary"}
    rows = content["application/json"]["example"]
    lines = content["application/x-ndjson"]["example"].splitlines()
    assert [json.loads(line) for line in lines] == rows
    schema = {**content["application/json"]["schema"], "components": document["components"]}
    jsonschema.validate(rows, schema)
    jsonschema.validate(rows[0], schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate([{**rows[0], "range_m": -5.0}], schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate([{**rows[0], "time": "2026-01-01T00:00:00Z"}], schema)
    jsonschema.validate(rows, json.loads(documents()["measurements.json"]))


def test_a_list_of_names_is_separated_by_commas(document: dict[str, Any]) -> None:
    parameters = document["paths"]["/v1/tracks"]["get"]["parameters"]
    (fields,) = [one for one in parameters if one["name"] == "fields"]
    assert (fields["style"], fields["explode"]) == ("form", False)
    assert "latitude_deg" in fields["schema"]["items"]["enum"]
