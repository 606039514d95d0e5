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

from multiradar_schemas.alignment import Alignment
from multiradar_schemas.columns import required_columns
from multiradar_schemas.inspection import Inspection
from multiradar_schemas.measurements.columns import MEASUREMENT_REQUIRED, MEASUREMENT_SCHEMA
from multiradar_schemas.measurements.measurement import MEASUREMENT, MEASUREMENTS
from multiradar_schemas.products.aircraft_delay import AIRCRAFT_DELAY_SCHEMA, AircraftDelay
from multiradar_schemas.products.bias import (
    BIAS_CORRELATION_SCHEMA,
    BIAS_SCHEMA,
    BiasCorrelation,
    BiasEstimate,
)
from multiradar_schemas.products.bias_days import (
    BIAS_OF_DAY_SCHEMA,
    BIAS_OF_PERIOD_SCHEMA,
    BIAS_STEP_SCHEMA,
    BiasOfDay,
    BiasOfPeriod,
    BiasStep,
)
from multiradar_schemas.products.encounter import ENCOUNTER_SCHEMA, Encounter, Encounters
from multiradar_schemas.products.forecast import FORECAST_SCHEMA, Forecast, ForecastRow
from multiradar_schemas.products.handover import Handover
from multiradar_schemas.products.health import HEALTH_SCHEMA, RadarHealth
from multiradar_schemas.products.manoeuvre_plane import MANOEUVRE_PLANE_SCHEMA, ManoeuvrePlane
from multiradar_schemas.products.observability import OBSERVABILITY_SCHEMA, Observability
from multiradar_schemas.products.regions import Regions
from multiradar_schemas.products.residuals import Residuals
from multiradar_schemas.products.track import TRACK_SCHEMA, Track, TrackUpdate
from multiradar_schemas.products.track_plots import TrackPlots
from multiradar_schemas.products.trajectories import TRAJECTORY_SCHEMA, Trajectories
from multiradar_schemas.products.transition import TRANSITION_SCHEMA, Transition
from multiradar_schemas.reject import Reject
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
    "track-plots": TypeAdapter(TrackPlots),
    "residuals": TypeAdapter(Residuals),
    "regions": TypeAdapter(Regions),
    "handover": TypeAdapter(Handover),
    "reject": TypeAdapter(Reject),
    "report": TypeAdapter(Report),
    "alignment": TypeAdapter(Alignment),
    "inspection": TypeAdapter(Inspection),
}
#: Tables with one model per row, and two with a reason instead of values.
_TABLES: dict[str, tuple[pl.Schema, tuple[str, ...]]] = {
    "measurements": (MEASUREMENT_SCHEMA, MEASUREMENT_REQUIRED),
    **{
        name: (schema, required_columns(model, schema))
        for name, schema, model in (
            ("tracks", TRACK_SCHEMA, TrackUpdate),
            ("transitions", TRANSITION_SCHEMA, Transition),
            ("observability", OBSERVABILITY_SCHEMA, Observability),
            ("encounters", ENCOUNTER_SCHEMA, Encounter),
            ("forecasts", FORECAST_SCHEMA, ForecastRow),
            ("biases", BIAS_SCHEMA, BiasEstimate),
            ("bias_correlations", BIAS_CORRELATION_SCHEMA, BiasCorrelation),
            ("biases_by_day", BIAS_OF_DAY_SCHEMA, BiasOfDay),
            ("drift", BIAS_STEP_SCHEMA, BiasStep),
            ("biases_merged", BIAS_OF_PERIOD_SCHEMA, BiasOfPeriod),
            ("aircraft_delays", AIRCRAFT_DELAY_SCHEMA, AircraftDelay),
            ("health", HEALTH_SCHEMA, RadarHealth),
        )
    },
    "manoeuvre-planes": (MANOEUVRE_PLANE_SCHEMA, ("track_id", "time_s", "window_s")),
    "trajectories": (TRAJECTORY_SCHEMA, ("track_id", "time_s")),
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
