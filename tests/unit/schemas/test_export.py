"""The exported schemas: up to date, valid, and of the same opinion as the models."""

import json
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from pydantic import ValidationError

from multiradar_schemas import export
from multiradar_schemas.export import FOLDER, documents
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.measurements.measurement import MEASUREMENT
from multiradar_schemas.products.bias import BIAS_SCHEMA, BiasEstimate
from multiradar_schemas.products.track import TRACK_SCHEMA, TrackUpdate
from support.inputs.messages import SENSORS_TOML, adsb, radar, without


@pytest.mark.slow
def test_the_command_writes_all_files_also_over_those_of_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "exported"
    monkeypatch.setattr(export, "FOLDER", folder)
    for _ in range(2):
        export.main([])
        files = {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir()}
        assert files == documents()


def test_the_files_are_those_of_the_models() -> None:
    files = {path.name: path.read_text(encoding="utf-8") for path in FOLDER.iterdir()}
    assert files == documents(), "run python -m multiradar_schemas.export"


# The documents are slow to make, and the files are theirs.
@pytest.mark.parametrize("name", sorted(path.name for path in FOLDER.glob("*.json")))
def test_each_file_is_a_json_schema(name: str) -> None:
    jsonschema.Draft202012Validator.check_schema(json.loads((FOLDER / name).read_text("utf-8")))


def accepts(name: str, document: object) -> bool:
    schema = json.loads((FOLDER / f"{name}.json").read_text("utf-8"))
    return jsonschema.Draft202012Validator(schema).is_valid(document)


@pytest.mark.parametrize(
    ("row", "good"),
    [
        (radar(), True),
        (adsb(), True),
        (adsb(kind="mlat", range_m=None), True),
        (without(radar(kind="bearing", sensor_id="finder"), "range_m"), True),
        (without(radar(time_ns=5), "time_s"), True),
        (without(radar(time="2026-01-01T00:00:00Z"), "time_s"), True),
        (radar(time_ns=5), False),
        (without(radar(), "time_s"), False),
        (without(radar(time="yesterday"), "time_s"), False),
        (without(radar(), "range_m"), False),
        (radar(range_m="9"), False),
        (radar(range_m=True), False),
        (radar(azimuth_deg=360), False),
        (radar(mode_3a="7018"), False),
        (radar(kind="sonar"), False),
        (radar(hight_m=1), False),
    ],
)
def test_schema_and_model_agree_on_measurements(row: dict[str, Any], good: bool) -> None:
    assert accepts("measurement", row) is good
    assert accepts("measurements", [row]) is good
    if good:
        MEASUREMENT.validate_json(json.dumps(row))
    else:
        with pytest.raises(ValidationError):
            MEASUREMENT.validate_json(json.dumps(row))


def test_the_schema_of_sensors_accepts_names_by_numbers_and_asks_for_sites() -> None:
    table = tomllib.loads(SENSORS_TOML)
    assert accepts("sensors", table)
    del table["sensor"][0]["height_m"]
    assert not accepts("sensors", table)


def test_tables_have_the_fields_of_their_models_in_order() -> None:
    assert list(TRACK_SCHEMA) == list(TrackUpdate.model_fields)
    assert list(BIAS_SCHEMA) == list(BiasEstimate.model_fields)
    known = json.loads(documents()["measurement.json"])["$defs"]["RadarMeasurement"]["properties"]
    assert set(MEASUREMENT_SCHEMA) == set(known) - {"time", "time_ns"}
