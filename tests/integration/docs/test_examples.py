"""Examples of responses have the members of the responses."""

import json
import re
from typing import Any

import pytest

from multiradar.api.factory import create_api
from multiradar.ingest.http import measurement_routes
from multiradar.ingest.http_sensors import sensor_change_routes
from support.fakes.fake_service import FakeService
from support.paths import ROOT

DOCS = ROOT / "docs"
_EXAMPLE = re.compile(r"<!-- example of: (\w+) -->\n```json\n(.*?)\n```", re.DOTALL)
#: Stands for members or items that an example leaves out.
_MORE = "…"


def _schemas() -> dict[str, Any]:
    service = FakeService()
    document = create_api(
        service, routers=[measurement_routes(service), sensor_change_routes(service)]
    ).openapi()
    schemas: dict[str, Any] = document["components"]["schemas"]
    return schemas


SCHEMAS = _schemas()


def _examples() -> list[tuple[str, str, str]]:
    return [
        (page.name, name, text)
        for page in sorted(DOCS.rglob("*.md"))
        for name, text in _EXAMPLE.findall(page.read_text(encoding="utf-8"))
    ]


def wrong(example: Any, schema: dict[str, Any], where: str) -> list[str]:
    """Return members of an example that its schema lacks, and vice versa."""
    schema = _resolved(schema)
    if isinstance(example, list):
        items = schema.get("items", {})
        return [one for item in example if item != _MORE for one in wrong(item, items, where)]
    if not isinstance(example, dict) or "properties" not in schema:
        return []
    known, required = schema["properties"], set(schema.get("required", []))
    missing = required - set(example) if _MORE not in example else set()
    found = [f"{where}: no member {name}" for name in sorted(set(example) - set(known) - {_MORE})]
    found += [f"{where}: lacks {name}" for name in sorted(missing)]
    for name in set(example) & set(known):
        found += wrong(example[name], known[name], f"{where}.{name}")
    return found


def _resolved(schema: dict[str, Any]) -> dict[str, Any]:
    for one in schema.get("anyOf", []):
        if one.get("type") != "null":
            return _resolved(one)
    if "$ref" in schema:
        return _resolved(SCHEMAS[schema["$ref"].rpartition("/")[2]])
    return schema


@pytest.mark.parametrize(("page", "name", "text"), _examples())
def test_an_example_has_the_members_of_the_answer(page: str, name: str, text: str) -> None:
    assert wrong(json.loads(text), SCHEMAS[name], f"{page}, {name}") == []


def test_the_answers_of_the_interface_have_examples() -> None:
    named = {name for _, name, _ in _examples()}
    assert {"Acknowledgement", "Encounters", "Observability", "Problem", "Trajectories"} <= named


def test_members_that_are_unknown_or_lacking_are_found() -> None:
    assert wrong({"status": "alive", "x": 1}, SCHEMAS["Health"], "h") == ["h: no member x"]
    assert wrong({}, SCHEMAS["Health"], "h") == ["h: lacks status"]
    assert wrong({_MORE: _MORE}, SCHEMAS["Health"], "h") == []
    segment = {"begin_s": 1.0, "turn": 2.0, _MORE: _MORE}
    example = {"trajectories": [{"weight": 1.0, "segments": [segment, _MORE]}], _MORE: _MORE}
    expected = ["t.trajectories.segments: no member turn"]
    assert wrong(example, SCHEMAS["Trajectories"], "t") == expected
