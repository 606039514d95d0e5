"""Writes the schemas for other languages: `python -m multiradar_schemas.export`.

JSON Schema (draft 2020-12) of each model, and the Arrow schemas as text, into the folder `json`
beside this module. A test fails when the files differ from the models.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import polars as pl
from pydantic import TypeAdapter

from multiradar_schemas.arrow import (
    BIAS_SCHEMA,
    ENCOUNTER_SCHEMA,
    FORECAST_SCHEMA,
    HEALTH_SCHEMA,
    MANOEUVRE_PLANE_SCHEMA,
    MEASUREMENT_REQUIRED,
    MEASUREMENT_SCHEMA,
    OBSERVABILITY_SCHEMA,
    TRACK_SCHEMA,
    TRAJECTORY_SCHEMA,
    TRANSITION_SCHEMA,
)
from multiradar_schemas.measurements.measurement import MEASUREMENT, MEASUREMENTS
from multiradar_schemas.measurements.reject import Reject
from multiradar_schemas.products.bias import BiasEstimate
from multiradar_schemas.products.encounter import Encounter, Encounters
from multiradar_schemas.products.forecast import Forecast
from multiradar_schemas.products.health import RadarHealth
from multiradar_schemas.products.manoeuvre_plane import ManoeuvrePlane
from multiradar_schemas.products.observability import Observability
from multiradar_schemas.products.track import Track, TrackUpdate
from multiradar_schemas.products.trajectories import Trajectories
from multiradar_schemas.products.transition import Transition
from multiradar_schemas.report import Report
from multiradar_schemas.sensors.sensor import SensorsFile

FOLDER = Path(__file__).parent / "json"

_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_MODELS: dict[str, TypeAdapter[Any]] = {
    "measurement": MEASUREMENT,
    "measurements": MEASUREMENTS,
    "sensors": TypeAdapter(SensorsFile),
    "track": TypeAdapter(Track),
    "track-update": TypeAdapter(TrackUpdate),
    "transition": TypeAdapter(Transition),
    "bias": TypeAdapter(BiasEstimate),
    "health": TypeAdapter(RadarHealth),
    "forecast": TypeAdapter(Forecast),
    "encounters": TypeAdapter(Encounters),
    "manoeuvre-plane": TypeAdapter(ManoeuvrePlane),
    "observability": TypeAdapter(Observability),
    "trajectories": TypeAdapter(Trajectories),
    "reject": TypeAdapter(Reject),
    "report": TypeAdapter(Report),
}
_TABLES = {
    "measurements": (MEASUREMENT_SCHEMA, MEASUREMENT_REQUIRED),
    "tracks": (
        TRACK_SCHEMA,
        tuple(n for n, f in TrackUpdate.model_fields.items() if "None" not in str(f.annotation)),
    ),
    "transitions": (TRANSITION_SCHEMA, ("time_s", "track_id", "transition", "reason")),
    "manoeuvre-planes": (MANOEUVRE_PLANE_SCHEMA, ("track_id", "time_s", "window_s")),
    "observability": (OBSERVABILITY_SCHEMA, tuple(OBSERVABILITY_SCHEMA.names())),
    "encounters": (
        ENCOUNTER_SCHEMA,
        tuple(n for n, f in Encounter.model_fields.items() if "None" not in str(f.annotation)),
    ),
    "trajectories": (TRAJECTORY_SCHEMA, ("track_id", "time_s")),
    "forecasts": (
        FORECAST_SCHEMA,
        tuple(name for name in FORECAST_SCHEMA if name != "height_m"),
    ),
    "biases": (BIAS_SCHEMA, tuple(BIAS_SCHEMA.names())),
    "health": (
        HEALTH_SCHEMA,
        tuple(n for n, f in RadarHealth.model_fields.items() if "None" not in str(f.annotation)),
    ),
}
_ARROW_NAMES: dict[pl.DataType, str] = {
    pl.Float64(): "float64",
    pl.Int64(): "int64",
    pl.String(): "utf8",
    pl.Boolean(): "bool",
    pl.List(pl.Float64()): "list<float64>",
    pl.List(pl.Int64()): "list<int64>",
    pl.List(pl.String()): "list<utf8>",
}


def documents() -> dict[str, str]:
    """Return the text of every file, by file name."""
    files = {f"{name}.json": _json_schema(name, model) for name, model in _MODELS.items()}
    for name, (schema, required) in _TABLES.items():
        files[f"{name}.arrow.txt"] = _arrow_schema(schema, required)
    return files


def _json_schema(name: str, model: TypeAdapter[Any]) -> str:
    schema = {"$schema": _DIALECT, "title": name, **model.json_schema()}
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def _arrow_schema(schema: pl.Schema, required: tuple[str, ...]) -> str:
    lines = [
        f"{name}: {_ARROW_NAMES[kind]}{' not null' if name in required else ''}"
        for name, kind in schema.items()
    ]
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Write all files; there are no arguments."""
    argparse.ArgumentParser(
        prog="python -m multiradar_schemas.export", description=f"Write all schemas into {FOLDER}."
    ).parse_args(arguments)
    FOLDER.mkdir(exist_ok=True)
    for name, text in documents().items():
        (FOLDER / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
