"""Options that several commands share."""

import datetime as dt
import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from multiradar.runtime.queries.parameters import (
    ENCOUNTER_DISTANCE,
    ENCOUNTER_DISTANCE_M,
    ENCOUNTER_HEIGHT,
    ENCOUNTER_HORIZON,
    WINDOW,
)
from multiradar.toolbox.settings import TRAJECTORY_AIRCRAFT_DEFAULT
from multiradar.tracking.settings import HIDEABLE, TrackingSettings
from multiradar_schemas.documents.names import unknown

if TYPE_CHECKING:
    from multiradar_converters.asterix.decoding.local_plane import ReferencePoint

#: Defaults of the tracker, as help shows them.
TRACKING_DEFAULTS = TrackingSettings()

#: As `KINDS` of the schemas, which is not imported here: help must be fast.
KIND_CHOICES = ("radar", "adsb", "mlat", "bearing")


class FilterChoice(StrEnum):
    """Names of the filters."""

    TWO_STAGE = "two-stage"
    IMM = "imm"
    JOINT = "joint"
    BLOM = "blom"
    BLOM_MACRO = "blom-macro"
    CI = "ci"


class EngineChoice(StrEnum):
    """What updates the tracks."""

    THREADS = "threads"
    RAY = "ray"


class MotionChoice(StrEnum):
    """Process noise of the motion of aircraft."""

    WHITE_ACCELERATION = "white-acceleration"
    VELOCITY_FRAME = "velocity-frame"


def parse_kinds(text: str) -> str:
    """Check a list of kinds of measurement, separated by commas."""
    for kind in text.split(","):
        if kind.strip() not in KIND_CHOICES:
            raise typer.BadParameter(unknown("kind", kind.strip(), KIND_CHOICES))
    return text


def parse_hidden(text: str) -> str:
    """Check a list of fields to hide, separated by commas."""
    for name in text.split(","):
        if name.strip() not in HIDEABLE:
            raise typer.BadParameter(unknown("field", name.strip(), HIDEABLE))
    return text


def hidden_fields(text: str) -> tuple[str, ...]:
    """Return the unique fields of a checked list, in the order of `HIDEABLE`."""
    named = {name.strip() for name in text.split(",")}
    return tuple(name for name in HIDEABLE if name in named)


def parse_date(text: str) -> str:
    """Check a date."""
    try:
        return dt.date.fromisoformat(text).isoformat()
    except ValueError as error:
        msg = f"expected a date such as 2018-08-01, was {text!r}"
        raise typer.BadParameter(msg) from error


def parse_time(text: str) -> str:
    """Return a time, Unix seconds or ISO 8601 with a zone, as Unix seconds."""
    msg = f"expected a time such as 2026-01-31T12:00:00Z, or Unix seconds, was {text!r}"
    try:
        time_s = float(text)
    except ValueError:
        try:
            moment = dt.datetime.fromisoformat(text)
        except ValueError:
            raise typer.BadParameter(msg) from None
        time_s = math.nan if moment.tzinfo is None else moment.timestamp()
    if not math.isfinite(time_s):
        raise typer.BadParameter(msg)
    return repr(time_s)


def chosen_kinds(text: str | None) -> frozenset[str] | None:
    """Return the kinds of a checked list; None means all."""
    return None if text is None else frozenset(kind.strip() for kind in text.split(","))


MeasurementsArgument = Annotated[
    Path,
    typer.Argument(
        metavar="MEASUREMENTS",
        help="A measurements.parquet, an output directory of `convert`, or a dump directory.",
        show_default=False,
    ),
]
SensorsOption = Annotated[
    Path,
    typer.Option("--sensors", metavar="FILE", help="Sensor configuration: sensors.toml."),
]
KindsOption = Annotated[
    str | None,
    typer.Option(
        "--kinds",
        metavar="KIND,KIND",
        help=f"Use only these kinds of measurement: {', '.join(KIND_CHOICES)}.",
        parser=parse_kinds,
        show_default="all",
    ),
]
HideOption = Annotated[
    str | None,
    typer.Option(
        "--hide",
        metavar="FIELD,FIELD",
        help="Withhold these fields from the tracker but keep them in the output: "
        f"{', '.join(HIDEABLE)}.",
        parser=parse_hidden,
        show_default="none",
    ),
]
ReferenceOption = Annotated[
    list[str] | None,
    typer.Option(
        "--reference",
        metavar="SAC-SIC=LATITUDE,LONGITUDE",
        help="Reference point of a sensor's local coordinates (010/042, 020/042), WGS 84, degrees; "
        "repeatable.",
        show_default="the sensor's site, else 019/600",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the results as one JSON object.")]
DateOption = Annotated[
    str | None,
    typer.Option(
        "--date",
        metavar="YYYY-MM-DD",
        help="Date of the first line of a dump; if omitted, times remain times of day.",
        parser=parse_date,
        show_default=False,
    ),
]
ProfileOption = Annotated[
    Path | None,
    typer.Option(
        "--profile",
        metavar="FILE.toml",
        help="Layout of a dump: file and column names, units, separator, time format.",
        show_default="the layout of docs/howto/converter.md",
    ),
]
AllowMissingOption = Annotated[
    bool,
    typer.Option(
        "--allow-missing",
        help="Accept dumps without tracks.txt or plots_ads.txt.",
    ),
]
PlanesOption = Annotated[
    float | None,
    typer.Option(
        "--manoeuvre-planes",
        metavar="SECONDS",
        min=WINDOW.least,
        max=WINDOW.most,
        help="Write manoeuvre_planes.parquet: manoeuvre plane over the last SECONDS, per epoch. "
        "Costs 0.8 ms of CPU time per plot.",
        show_default="none",
    ),
]
ObservabilityOption = Annotated[
    float | None,
    typer.Option(
        "--observability",
        metavar="SECONDS",
        min=WINDOW.least,
        max=WINDOW.most,
        help="Write observability.parquet: position observability over the last SECONDS, per "
        "epoch. Costs 0.2 ms of CPU time per plot.",
        show_default="none",
    ),
]
EncountersOption = Annotated[
    float | None,
    typer.Option(
        "--encounters",
        metavar="SECONDS",
        min=ENCOUNTER_HORIZON.least,
        max=ENCOUNTER_HORIZON.most,
        help="Write encounters.parquet: pairs of tracks predicted to come close to each other "
        "within SECONDS, per epoch. Costs 0.05 ms of CPU time per plot with 30 "
        "aircraft; the cost grows with the number of aircraft.",
        show_default="none",
    ),
]
EncounterDistanceOption = Annotated[
    float | None,
    typer.Option(
        "--encounter-distance-m",
        min=ENCOUNTER_DISTANCE.least,
        max=ENCOUNTER_DISTANCE.most,
        help="Horizontal threshold for --encounters, m.",
        show_default=f"{ENCOUNTER_DISTANCE_M:g}",
    ),
]
EncounterHeightOption = Annotated[
    float | None,
    typer.Option(
        "--encounter-height-m",
        min=ENCOUNTER_HEIGHT.least,
        max=ENCOUNTER_HEIGHT.most,
        help="Vertical threshold for --encounters, m: skip pairs separated by more.",
        show_default="any height",
    ),
]
TrajectoriesOption = Annotated[
    bool,
    typer.Option(
        "--trajectories",
        help="Write trajectories.parquet: reconstructed trajectories over the last 90 s, per "
        "epoch. Costs 2.5 ms of CPU time per plot.",
    ),
]
TrajectoryAircraftOption = Annotated[
    int | None,
    typer.Option(
        "--trajectory-aircraft-max",
        metavar="N",
        min=1,
        max=10_000,
        help="Maximum concurrent trajectory reconstructions; further tracks are queued.",
        show_default=f"as in the settings, else {TRAJECTORY_AIRCRAFT_DEFAULT}",
    ),
]
ForecastsOption = Annotated[
    float | None,
    typer.Option(
        "--forecasts",
        metavar="SECONDS",
        # The bounds are those of `runtime.forecast_table`.
        min=8.0,
        max=600.0,
        help="Write forecasts.parquet: predicted positions 10 to 300 s ahead with 95 % "
        "containment regions, every SECONDS. Costs 0.03 ms of CPU time per plot if SECONDS is 60.",
        show_default="none",
    ),
]
OverlaysOption = Annotated[
    Path | None,
    typer.Option(
        "--overlays",
        metavar="DIR",
        help="Directory of GeoJSON files (sectors, airways) to show on the page.",
        show_default=False,
    ),
]
EngineOption = Annotated[
    EngineChoice | None,
    typer.Option(
        help="Engine that updates the tracks: threads, or Ray actors, which require the extra "
        "`cluster` and --cluster-listen; the output does not depend on the engine.",
        show_default="threads",
    ),
]
ClusterListenOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="ADDRESS",
        help="Address of this host on which Ray may listen, at least one per interface; "
        "repeatable. Any host that can reach this address can execute code on this host.",
        show_default=False,
    ),
]
ConfigOption = Annotated[
    Path | None,
    typer.Option(
        "--config",
        metavar="FILE",
        help="Settings in TOML; command-line options and environment variables (MULTIRADAR_…) "
        "take precedence.",
        show_default=False,
    ),
]
FilterOption = Annotated[
    FilterChoice | None,
    typer.Option(
        "--filter",
        help="Filter that estimates motion and biases. With joint, the cost per plot grows with "
        "the number of aircraft.",
        show_default=TRACKING_DEFAULTS.filter_name,
    ),
]


def read_references(texts: list[str] | None) -> "dict[int, ReferencePoint]":
    """Parse the reference points of `ReferenceOption`, by source.

    Raises
    ------
    BadParameter
        A text has another form, or no such position exists.
    """
    # Imported here: help must be fast.
    from multiradar_converters.asterix.decoding.local_plane import parse_references
    from multiradar_converters.errors import ProfileError

    try:
        return parse_references(texts or [])
    except ProfileError as error:
        raise typer.BadParameter(str(error), param_hint="--reference") from error
