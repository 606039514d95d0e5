"""The user's GeoJSON: what is read, and what is named instead."""

import json
from pathlib import Path
from typing import Any

import pytest

from multiradar.errors import ConfigurationError
from multiradar.storage import overlays
from multiradar.storage.overlays import FILES_MAX, Overlay, read_overlays

SECTOR = {"type": "Polygon", "coordinates": [[[6, 46], [7, 46], [7, 47], [6, 46]]]}


def read(folder: Path, document: Any) -> Overlay:
    text = document if isinstance(document, str) else json.dumps(document)
    (folder / "one.geojson").write_text(text, encoding="utf-8")
    (only,) = read_overlays(folder)
    assert only.name == "one"
    return only


@pytest.mark.parametrize(
    "document",
    [
        SECTOR,
        {"type": "Feature", "properties": {"name": "N1"}, "geometry": SECTOR},
        {"type": "FeatureCollection", "features": [
            {"type": "Feature", "properties": None, "geometry": SECTOR}]},
        {"type": "GeometryCollection", "geometries": [SECTOR]},
    ],
)  # fmt: skip
def test_every_object_of_geojson_becomes_a_collection(tmp_path: Path, document: Any) -> None:
    found = read(tmp_path, document)
    assert (found.problem, found.features) == ("", 1)
    collection = json.loads(found.content)
    assert collection["type"] == "FeatureCollection"
    assert "46" in json.dumps(collection["features"][0]["geometry"])


def test_properties_are_plain_values(tmp_path: Path) -> None:
    given = {"name": "<b>N1</b>", "floor": 245, "more": {"a": 1}, "list": [1]}
    found = read(tmp_path, {"type": "Feature", "properties": given, "geometry": SECTOR})
    kept = json.loads(found.content)["features"][0]["properties"]
    assert kept == {"name": "<b>N1</b>", "floor": 245}


@pytest.mark.parametrize(
    ("document", "reason"),
    [
        ("{", "not valid JSON"),
        ("[1]", "expected a GeoJSON object, was a list of 1"),
        ({"type": "Topology"}, "the document: expected a Feature or a geometry"),
        ({"type": "Point", "coordinates": [512000.0, 4212000.0]}, "(WGS 84), was 512000"),
        ({"type": "Point", "coordinates": [6]}, "in degrees, was a list of 1"),
        ({"type": "LineString", "coordinates": [[6, 46]]}, "at least 2 positions, found 1"),
        ({"type": "Polygon", "coordinates": [[6, 46]]}, "Polygon"),
        ('{"type": "Point", "coordinates": [NaN, 46]}', "finite numbers, was NaN"),
        ('{"type": "Point", "coordinates": [1e999, 46]}', "[longitude, latitude]"),
        ({"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": SECTOR}, 7]},
         "feature 2: expected a Feature or a geometry, was 7"),
        ('{"type":"GeometryCollection","geometries":' + "[" * 100_000, "nested too deeply"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_named_with_its_reason(
    tmp_path: Path, document: Any, reason: str
) -> None:
    found = read(tmp_path, document)
    assert reason in found.problem
    assert found.content == b""


def test_the_others_are_read_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(overlays, "OCTETS_MAX", 500)
    (tmp_path / "a.json").write_text(json.dumps(SECTOR))
    (tmp_path / "b.geojson").write_text("x" * 501)
    (tmp_path / "c.geojson").write_bytes(b"\xff\xfe")
    (tmp_path / "notes.txt").write_text("sectors of 2018")
    (tmp_path / "old.geojson").mkdir()
    found = read_overlays(tmp_path)
    assert [one.name for one in found] == ["a", "b", "c"]
    problems = [one.problem for one in found]
    assert problems == ["", "expected at most 500 octets, found 501", "not UTF-8 text"]


def test_the_folder_is_bounded_and_must_exist(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="nosuch: cannot read the overlay folder"):
        read_overlays(tmp_path / "nosuch")
    for number in range(FILES_MAX + 1):
        (tmp_path / f"{number}.json").write_text("{}")
    with pytest.raises(ConfigurationError, match=f"at most {FILES_MAX} overlay files"):
        read_overlays(tmp_path)
