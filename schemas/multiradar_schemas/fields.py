"""Writes the page of all fields: `python -m multiradar_schemas.fields docs/reference/fields.md`."""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from multiradar_schemas.alignment import (
    AlignedBias,
    AlignedDistances,
    AlignedInput,
    AlignedInterval,
    AlignedPair,
    AlignedRadar,
    AlignedResiduals,
    AlignedUnobservable,
    Alignment,
)
from multiradar_schemas.inspection import (
    InspectedBias,
    InspectedCategory,
    InspectedClock,
    InspectedData,
    InspectedFile,
    InspectedGap,
    InspectedQuantity,
    InspectedRejects,
    InspectedSensor,
    InspectedSite,
    Inspection,
)
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.measurements.measurement import KIND_NEEDS, RadarMeasurement
from multiradar_schemas.products.aircraft_delay import AIRCRAFT_DELAY_SCHEMA, AircraftDelay
from multiradar_schemas.products.bias import (
    BIAS_CORRELATION_SCHEMA,
    BIAS_SCHEMA,
    BiasCorrelation,
    BiasEstimate,
    BiasValue,
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
from multiradar_schemas.products.forecast import (
    FORECAST_SCHEMA,
    Forecast,
    ForecastMember,
    ForecastPoint,
    ForecastRow,
)
from multiradar_schemas.products.handover import Handover, HandoverTrack
from multiradar_schemas.products.health import HEALTH_SCHEMA, RadarHealth
from multiradar_schemas.products.manoeuvre_plane import (
    MANOEUVRE_PLANE_SCHEMA,
    PLANE_REASON_MEANINGS,
    PlaneFigures,
    PlanePosition,
)
from multiradar_schemas.products.observability import OBSERVABILITY_SCHEMA, Observability
from multiradar_schemas.products.regions import NeighbouringRegion, Regions
from multiradar_schemas.products.residuals import RadarResiduals, ResidualBin, Residuals
from multiradar_schemas.products.track import TRACK_SCHEMA, Track, TrackUpdate
from multiradar_schemas.products.track_plots import TrackPlot, TrackPlots
from multiradar_schemas.products.trajectories import (
    TRAJECTORY_REASON_MEANINGS,
    Trajectories,
    Trajectory,
    TrajectoryEstimate,
    TrajectoryPoint,
    TrajectorySegment,
)
from multiradar_schemas.products.transition import REASON_MEANINGS, TRANSITION_SCHEMA, Transition
from multiradar_schemas.reject import CODE_MEANINGS, Reject
from multiradar_schemas.report import Counts, InputFile, OutputFile, Report
from multiradar_schemas.sensors.bias import RangeOffset, SensorBias
from multiradar_schemas.sensors.sensor import ESTIMATED_BY_KIND, PRIOR_SIGMA_DEFAULT, Sensor

_INTRODUCTION = """# Fields

This page lists every field that the service reads or writes, with its unit and source, and when it
is absent (null in a table, null or missing in JSON).
`python -m multiradar_schemas.fields docs/reference/fields.md` generates the page from the models; a
test fails if they differ.

Names include the unit. Angles are in degrees on the wire and on disk; azimuth and heading are
clockwise from true north. A bias is *measured minus true*. Times are in seconds: UTC since the Unix
epoch, or the time of day continued past midnight if the recording has no date.
"""

_MEASUREMENTS = """A measurement is a row of `measurements.parquet` or of an Arrow body, or a JSON
object. In JSON, the time is exactly one of `time_s`, `time_ns` and `time`; Arrow bodies may have
one of these columns; files have `time_s`. Bearings come from direction finders, and from radars
whose plots have no range, for example because of jamming. `kind` (radar, adsb, mlat or bearing)
determines the required fields:"""

_HEALTH = """
## Health: `health.parquet`, a row for each radar and epoch

The last row of a radar is also the member `health` in the response to `GET /v1/sensors/{id}`.
"""

_PLANES = """
## Manoeuvre planes: `manoeuvre_planes.parquet`, `GET /v1/tracks/{id}/manoeuvre-plane`

The file has a row for each track and epoch in which the track was updated. If the plots do not
determine a plane, all columns except `track_id`, `time_s` and `window_s` are null, and the column
`reason` contains the reason; over HTTP, the response is a problem document with status 409 and the
reason as its `code`.
"""

_TRAJECTORIES = """
## Trajectories: `GET /v1/tracks/{id}/trajectories`, Zenoh, `trajectories.parquet`

If there are no trajectories, the response is a problem document with status 409 and the reason as
its `code`.
"""
_TRAJECTORY_TABLE = """
The file has a row for each epoch and each track whose bundle was updated in that epoch, with the
state of the bundle after the last update. The row contains the fields above and the fields of
`estimate`, under the same names; `weights`, the list of the weights of the trajectories; the
segments of all trajectories, concatenated in lists `segment_…`, with the index of the trajectory,
from 0, in `segment_trajectory`; and paths at multiples of 5 s, in lists `best_…` and `weighted_…`,
with the times in `point_time_s`. If there are no trajectories, all columns except `track_id` and
`time_s` are null, and the column `reason` contains the reason.
"""


def page() -> str:
    """Return the text of the page."""
    return "\n".join(_lines()) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the page; the default arguments are those of the process."""
    parser = argparse.ArgumentParser(
        prog="python -m multiradar_schemas.fields", description="Write the page of all fields."
    )
    parser.add_argument("file", metavar="FILE", type=Path, help="Output file: fields.md.")
    file: Path = parser.parse_args(arguments).file
    try:
        file.write_text(page(), encoding="utf-8")
    except OSError as error:
        parser.exit(1, f"{file}: cannot be written ({error.strerror})\n")


def _lines() -> Iterator[str]:
    yield _INTRODUCTION
    yield "## Measurements: `measurements.parquet`, `POST /v1/measurements`, Zenoh\n"
    yield _MEASUREMENTS + "\n"
    for kind, needed in KIND_NEEDS.items():
        yield f"- `{kind}`: {' and '.join(f'`{name}`' for name in needed)}"
    yield "\nThe other fields of this list are validated, but not used for that kind.\n"
    extra = ("time_ns", "time")
    yield from _table(RadarMeasurement, (*MEASUREMENT_SCHEMA, *extra), dict(MEASUREMENT_SCHEMA))
    yield "\n## Sensors: `sensors.toml`\n"
    yield "One table `[[sensor]]` per sensor.\n"
    yield from _table(Sensor)
    yield "\nTables `[sensor.bias.<parameter>]`; a parameter is one of:\n"
    yield from _table(SensorBias)
    yield "\nBy default, these parameters are estimated:\n"
    for kind, names in ESTIMATED_BY_KIND.items():
        yield f"- {kind}: {', '.join(f'`{name}`' for name in names) or 'nothing'}"
    defaults = [f"`{name}` {sigma:g}" for name, sigma in PRIOR_SIGMA_DEFAULT.items()]
    yield f"\nDefault prior standard deviations: {', '.join(defaults)}.\n"
    yield "Each table contains:\n"
    yield from _table(RangeOffset)
    yield from _track_lines()
    yield from _bias_lines()
    yield _HEALTH
    yield from _table(RadarHealth, tuple(HEALTH_SCHEMA), dict(HEALTH_SCHEMA))
    yield from _forecast_lines()
    yield from _encounter_lines()
    yield from _plane_lines()
    yield from _plot_lines()
    yield from _trajectory_lines()
    yield "\n## Rejects: `rejects.ndjson`\n"
    yield "Exactly one of `line` and `offset` is present.\n"
    yield from _table(Reject)
    yield "\n| code | meaning |\n|---|---|"
    yield from (f"| `{code}` | {meaning} |" for code, meaning in CODE_MEANINGS.items())
    yield "\n## Reports: `report.json`\n"
    yield from _table(Report)
    for title, model in (("counts", Counts), ("inputs", InputFile), ("outputs", OutputFile)):
        yield f"\n`{title}`:\n"
        yield from _table(model)
    yield from _inspection_lines()
    yield from _alignment_lines()


def _bias_lines() -> Iterator[str]:
    yield "\n## Biases: `biases.parquet`, a row for each sensor, parameter and epoch\n"
    yield from _table(BiasEstimate, tuple(BIAS_SCHEMA), dict(BIAS_SCHEMA))
    yield "\n## Bias correlations: `bias_correlations.parquet`, a row for each pair\n"
    schema = BIAS_CORRELATION_SCHEMA
    yield from _table(BiasCorrelation, tuple(schema), dict(schema))
    yield "\n## Biases by day: `biases_by_day.parquet` of `multiradar reprocess`\n"
    yield from _table(BiasOfDay, tuple(BIAS_OF_DAY_SCHEMA), dict(BIAS_OF_DAY_SCHEMA))
    yield "\n## Bias steps between days: `drift.parquet` of `multiradar reprocess`\n"
    yield from _table(BiasStep, tuple(BIAS_STEP_SCHEMA), dict(BIAS_STEP_SCHEMA))
    yield "\n## Biases over a period: `biases_merged.parquet` of `multiradar reprocess`\n"
    yield from _table(BiasOfPeriod, tuple(BIAS_OF_PERIOD_SCHEMA), dict(BIAS_OF_PERIOD_SCHEMA))
    yield "\n## Transponder delays: `aircraft_delays.parquet`\n"
    yield "A row for each confirmed track, if any radar has `transponder_delay_sigma_m`.\n"
    yield from _table(AircraftDelay, tuple(AIRCRAFT_DELAY_SCHEMA), dict(AIRCRAFT_DELAY_SCHEMA))


def _alignment_lines() -> Iterator[str]:
    yield "\n## Registrations: `multiradar align --json`\n"
    yield from _table(Alignment)
    for title, model in (
        ("inputs", AlignedInput),
        ("residuals", AlignedResiduals),
        ("residuals.before", AlignedDistances),
        ("biases", AlignedBias),
        ("radars", AlignedRadar),
        ("pairs", AlignedPair),
        ("unobservable", AlignedUnobservable),
        ("trend", AlignedInterval),
    ):
        yield f"\n`{title}`:\n"
        yield from _table(model)


def _inspection_lines() -> Iterator[str]:
    yield "\n## Inspections: `multiradar inspect --json`\n"
    yield from _table(Inspection)
    for title, model in (
        ("files", InspectedFile),
        ("rejects", InspectedRejects),
        ("categories", InspectedCategory),
        ("reported_biases", InspectedBias),
        ("sensors", InspectedSensor),
        ("sensors[].longest_gaps", InspectedGap),
        ("sensors[].aircraft_data", InspectedData),
        ("sensors[].aircraft_data.values.*", InspectedQuantity),
        ("sensors[].clock", InspectedClock),
        ("sensors[].site", InspectedSite),
    ):
        yield f"\n`{title}`:\n"
        yield from _table(model)


def _forecast_lines() -> Iterator[str]:
    yield "\n## Forecasts: `GET /v1/tracks/{id}/forecast`, Zenoh\n"
    yield from _table(Forecast)
    yield "\nEach point:\n"
    yield from _table(ForecastPoint)
    yield "\nA member of a forecast of method `bundle`:\n"
    yield from _table(ForecastMember)
    yield "\nA row of `forecasts.parquet` (`multiradar track --forecasts`) has these fields and:\n"
    added = [name for name in FORECAST_SCHEMA if name not in ForecastPoint.model_fields]
    yield from _table(ForecastRow, tuple(added), dict(FORECAST_SCHEMA))


def _track_lines() -> Iterator[str]:
    yield "\n## Tracks: `tracks.parquet`, a row for each update\n"
    yield from _table(TrackUpdate, tuple(TRACK_SCHEMA), dict(TRACK_SCHEMA))
    yield "\nThe service adds these fields in `GET /v1/tracks` and its stream:\n"
    added = [name for name in Track.model_fields if name not in TrackUpdate.model_fields]
    yield from _table(Track, tuple(added))
    yield "\n## Transitions: `transitions.parquet`, `GET /v1/tracks/{id}/transitions`\n"
    yield "A row for each state transition of a track, in the order of detection.\n"
    yield from _table(Transition, tuple(TRANSITION_SCHEMA), dict(TRANSITION_SCHEMA))
    yield "\n| reason | meaning |\n|---|---|"
    yield from (f"| `{name}` | {meaning} |" for name, meaning in REASON_MEANINGS.items())


def _encounter_lines() -> Iterator[str]:
    yield "\n## Encounters: `GET /v1/encounters`, `encounters.parquet`, Zenoh\n"
    yield from _table(Encounters)
    yield "\nEach encounter (the file has a row for each encounter at the end of each epoch):\n"
    yield from _table(Encounter, tuple(ENCOUNTER_SCHEMA), dict(ENCOUNTER_SCHEMA))


def _plane_lines() -> Iterator[str]:
    yield _PLANES
    names = tuple(name for name in MANOEUVRE_PLANE_SCHEMA if name in PlaneFigures.model_fields)
    yield from _table(PlaneFigures, names, dict(MANOEUVRE_PLANE_SCHEMA))
    yield "\nThe HTTP response also contains `positions`, the plots projected onto the plane:\n"
    yield from _table(PlanePosition)
    yield "\n| reason | meaning |\n|---|---|"
    yield from (f"| `{name}` | {meaning} |" for name, meaning in PLANE_REASON_MEANINGS.items())
    yield "\n## Observability: `observability.parquet`, `GET /v1/tracks/{id}/observability`\n"
    yield "The file has a row for each track and epoch in which the track was updated.\n"
    yield from _table(Observability, tuple(OBSERVABILITY_SCHEMA), dict(OBSERVABILITY_SCHEMA))


def _plot_lines() -> Iterator[str]:
    yield "\n## Plots of a track: `GET /v1/tracks/{id}/plots`, Zenoh\n"
    yield from _table(TrackPlots)
    yield "\nEach of `plots`:\n"
    yield from _table(TrackPlot)
    yield "\n## Neighbouring regions: `GET /v1/regions`, Zenoh\n"
    yield from _table(Regions)
    yield "\nEach of `neighbours`:\n"
    yield from _table(NeighbouringRegion)
    yield "\nHandover messages between services, `multiradar/v1/handovers/{region}`:\n"
    yield from _table(Handover)
    yield "\nEach of its `tracks`:\n"
    yield from _table(HandoverTrack)
    yield "\nEach of its `biases`:\n"
    yield from _table(BiasValue)
    yield "\n## Radar residuals: `GET /v1/residuals`, Zenoh\n"
    yield from _table(Residuals)
    yield "\nEach of `sensors`:\n"
    yield from _table(RadarResiduals)
    yield "\nEach interval:\n"
    yield from _table(ResidualBin)


def _trajectory_lines() -> Iterator[str]:
    yield _TRAJECTORIES
    yield from _table(Trajectories)
    for title, model in (
        ("`estimate`", TrajectoryEstimate),
        ("Each of `trajectories`", Trajectory),
        ("Each segment", TrajectorySegment),
        ("Each point of `best` and `weighted`", TrajectoryPoint),
    ):
        yield f"\n{title}:\n"
        yield from _table(model)
    yield "\n| reason | meaning |\n|---|---|"
    yield from (f"| `{name}` | {meaning} |" for name, meaning in TRAJECTORY_REASON_MEANINGS.items())
    yield _TRAJECTORY_TABLE


def _table(
    model: type[BaseModel],
    names: tuple[str, ...] | None = None,
    columns: dict[str, Any] | None = None,
) -> Iterator[str]:
    properties = model.model_json_schema()["properties"]
    types = " type in tables |" if columns else ""
    yield f"| field | meaning | unit |{types} source | absent |"
    yield f"|---|---|---|{'---|' if columns else ''}---|---|"
    for name in names or tuple(properties):
        shown = _description(properties[name])
        default = properties[name].get("default")
        if isinstance(default, int | float):
            text = str(default).lower() if isinstance(default, bool) else f"{default:g}"
            shown["description"] += f" (default {text})"
        kind = f" {columns.get(name, 'JSON only')} |" if columns else ""
        yield (
            f"| `{name}` | {shown['description']} | {shown['unit']} |{kind} {shown['source']} |"
            f" {shown['absent']} |"
        )


def _description(schema: dict[str, Any]) -> dict[str, str]:
    """Return the description of a field; for an optional field it is one level deeper."""
    for candidate in (schema, *schema.get("anyOf", ())):
        if "unit" in candidate:
            return {key: str(candidate[key]) for key in ("description", "unit", "source", "absent")}
    msg = f"expected a described field, was {schema}"
    raise KeyError(msg)


if __name__ == "__main__":
    main()
