"""Measurements in JSON: radar plots, ADS-B and multilateration reports, bearings."""

import re
from datetime import UTC, datetime
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    TypeAdapter,
    model_validator,
)
from pydantic_core import PydanticCustomError

from multiradar_schemas.base import Record, described
from multiradar_schemas.bounds import POSITION_SIGMA_M
from multiradar_schemas.measurements.aircraft_data import AircraftData

TIME_MAX_S = 1e11
RANGE_MAX_M = 1e6
AZIMUTH_END_DEG = 360.0
ELEVATION_MAX_DEG = 90.0
LATITUDE_MAX_DEG = 90.0
LONGITUDE_MAX_DEG = 180.0
HEIGHT_MIN_M = -1000.0
HEIGHT_MAX_M = 40_000.0
INTEGER_MAX = 2**63 - 1

SENSOR_ID_PATTERN = r"^[A-Za-z0-9._-]{1,64}$"
#: A sensor, by its id.
SensorName = Annotated[str, StringConstraints(pattern=SENSOR_ID_PATTERN)]
MODE_3A_PATTERN = r"^[0-7]{4}$"
MODE_S_ADDRESS_PATTERN = r"^[0-9a-fA-F]{6}$"
# One to eight letters, digits and blanks between them.
CALLSIGN_PATTERN = r"^ *[0-9A-Za-z]([0-9A-Za-z ]{0,6}[0-9A-Za-z])? *$"

#: Position of a moving sensor: all fields or none.
SOURCE_FIELDS = ("source_latitude_deg", "source_longitude_deg", "source_height_m")
SOURCE = ", ".join(SOURCE_FIELDS)

#: Kinds of measurement, on the wire.
KINDS = ("radar", "adsb", "mlat", "bearing")

#: How a radar detected an aircraft: primary, secondary (Mode A and C), both, Mode S, Mode S with
#: primary.
DETECTIONS = ("psr", "ssr", "psr_ssr", "mode_s", "psr_mode_s")

_ISO_8601 = re.compile(
    r"[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}(\.[0-9]{1,9})?(Z|[+-][0-9]{2}:[0-9]{2})"
)


def _iso_8601(value: Any) -> Any:
    if not isinstance(value, str) or _ISO_8601.fullmatch(value) is None:
        raise PydanticCustomError(
            "iso_8601", "Input should be a time such as 2026-01-31T12:00:00.5Z"
        )
    try:
        return datetime.fromisoformat(value).astimezone(UTC)
    except (ValueError, OverflowError) as error:
        raise PydanticCustomError("iso_8601", "Input should be a valid time") from error


SensorId = Annotated[
    str,
    StringConstraints(pattern=SENSOR_ID_PATTERN),
    described(
        "The sensor that made the measurement",
        unit="letters, digits, `.`, `_`, `-`",
        source="sensor",
    ),
]
Seconds = Annotated[
    float,
    Field(gt=-TIME_MAX_S, lt=TIME_MAX_S),
    described(
        "Time of the measurement: UTC since the Unix epoch, or the time of day continued past "
        "midnight if the recording has no date",
        unit="s",
        source="sensor",
        absent="JSON with `time_ns` or `time`",
    ),
]
Nanoseconds = Annotated[
    int,
    Field(ge=-INTEGER_MAX, le=INTEGER_MAX),
    described("The same time as an integer", unit="ns", source="sensor", absent="see `time_s`"),
]
Instant = Annotated[
    datetime,
    BeforeValidator(_iso_8601),
    described(
        "The same time with a time zone; resolution 1 µs",
        unit="ISO 8601",
        source="sensor",
        absent="see `time_s`",
        pattern=f"^{_ISO_8601.pattern}$",
    ),
]
Range = Annotated[
    float,
    Field(gt=0.0, le=RANGE_MAX_M),
    described(
        "Raw slant range from the sensor", unit="m", source="sensor", absent="kind is not radar"
    ),
]
Azimuth = Annotated[
    float,
    Field(ge=0.0, lt=AZIMUTH_END_DEG),
    described(
        "Raw azimuth at the sensor, clockwise from true north",
        unit="degree",
        source="sensor",
        absent="kind is adsb or mlat",
    ),
]
Elevation = Annotated[
    float,
    Field(ge=-ELEVATION_MAX_DEG, le=ELEVATION_MAX_DEG),
    described(
        "Elevation above the horizontal plane through the sensor, corrected for refraction; used "
        "only for kind bearing and if the sensor has `elevation_sigma_deg`",
        unit="degree",
        source="sensor",
        absent="not measured",
    ),
]
Latitude = Annotated[
    float,
    Field(ge=-LATITUDE_MAX_DEG, le=LATITUDE_MAX_DEG),
    described(
        "WGS 84 latitude as reported", unit="degree", source="sensor", absent="radar, bearing"
    ),
]
Longitude = Annotated[
    float,
    Field(ge=-LONGITUDE_MAX_DEG, le=LONGITUDE_MAX_DEG),
    described(
        "WGS 84 longitude as reported", unit="degree", source="sensor", absent="radar, bearing"
    ),
]
Height = Annotated[
    float,
    Field(ge=HEIGHT_MIN_M, le=HEIGHT_MAX_M),
    described(
        "Height as measured (Mode C or reported)",
        unit="m",
        source="aircraft",
        absent="not received",
    ),
]
_MOVED = "the sensor is fixed (all three fields or none)"
SourceLatitude = Annotated[
    float,
    Field(ge=-LATITUDE_MAX_DEG, le=LATITUDE_MAX_DEG),
    described(
        "WGS 84 latitude of a sensor that is `moving`, at the time of the measurement",
        unit="degree",
        source="sensor",
        absent=_MOVED,
    ),
]
SourceLongitude = Annotated[
    float,
    Field(ge=-LONGITUDE_MAX_DEG, le=LONGITUDE_MAX_DEG),
    described("WGS 84 longitude of the same sensor", unit="degree", source="sensor", absent=_MOVED),
]
SourceHeight = Annotated[
    float,
    Field(ge=HEIGHT_MIN_M, le=HEIGHT_MAX_M),
    described(
        "Height of the same sensor above the ellipsoid", unit="m", source="sensor", absent=_MOVED
    ),
]
Mode3A = Annotated[
    str,
    StringConstraints(pattern=MODE_3A_PATTERN),
    described("Mode 3/A code", unit="4 octal digits", source="aircraft", absent="not received"),
]
ModeSAddress = Annotated[
    str,
    StringConstraints(pattern=MODE_S_ADDRESS_PATTERN, to_lower=True),
    described(
        "ICAO 24-bit address", unit="6 hexadecimal digits", source="aircraft", absent="not received"
    ),
]
TrackNumber = Annotated[
    int,
    Field(ge=0, le=INTEGER_MAX),
    described(
        "Number of the aircraft in the recording (`global`)",
        unit="1",
        source="recording",
        absent="live data, or no track references the plot",
    ),
]

Callsign = Annotated[
    str,
    StringConstraints(pattern=CALLSIGN_PATTERN),
    AfterValidator(lambda text: text.strip(" ").upper()),
    described(
        "Callsign or registration reported by the aircraft; surrounding blanks are removed and "
        "letters converted to upper case",
        unit="1 to 8 of A-Z, 0-9 and embedded spaces",
        source="aircraft",
        absent="not received",
    ),
]


OnGround = Annotated[
    bool,
    described(
        "Whether the aircraft reports that it is on the ground (Mode S flight status, ground bit, "
        "surface position), or a surface movement radar detects it",
        unit="true or false",
        source="aircraft",
        absent="not reported, or undetermined (flight status alert or SPI)",
    ),
]


PositionSigma = Annotated[
    float,
    Field(ge=POSITION_SIGMA_M.least, le=POSITION_SIGMA_M.most),
    described(
        "Position accuracy of this report, 1 sigma on each axis; used instead of the "
        "`position_sigma_m` of the sensor",
        unit="m",
        source="sensor, aircraft",
        absent="not reported; radar, bearing",
    ),
]
Detection = Annotated[
    Literal["psr", "ssr", "psr_ssr", "mode_s", "psr_mode_s"],
    described(
        "How a radar detected the aircraft: psr, ssr, psr_ssr, mode_s or psr_mode_s",
        unit="name",
        source="sensor",
        absent="not reported, or not a radar",
    ),
]


_KIND = described("radar, adsb, mlat or bearing", unit="name", source="sensor")


# What the validators below require.
def _rules_between_fields(schema: dict[str, Any]) -> None:
    types = {"time_s": "number", "time_ns": "integer", "time": "string"}
    schema["oneOf"] = [
        {"required": [name], "properties": {name: {"type": kind}}} for name, kind in types.items()
    ]
    whole = {
        "required": list(SOURCE_FIELDS),
        "properties": {name: {"type": "number"} for name in SOURCE_FIELDS},
    }
    none = {"properties": {name: {"type": "null"} for name in SOURCE_FIELDS}}
    schema["anyOf"] = [whole, none]


class _Common(Record):
    """Common fields of all kinds: exactly one time, the sensor, identity, height."""

    model_config = ConfigDict(json_schema_extra=_rules_between_fields)

    time_s: Seconds | None = None
    time_ns: Nanoseconds | None = None
    time: Instant | None = None
    sensor_id: SensorId
    height_m: Height | None = None
    mode_3a: Mode3A | None = None
    mode_s_address: ModeSAddress | None = None
    track_number: TrackNumber | None = None
    callsign: Callsign | None = None
    elevation_deg: Elevation | None = None
    source_latitude_deg: SourceLatitude | None = None
    source_longitude_deg: SourceLongitude | None = None
    source_height_m: SourceHeight | None = None
    on_ground: OnGround | None = None
    position_sigma_m: PositionSigma | None = None
    detection: Detection | None = None

    @model_validator(mode="after")
    def _whole_source(self) -> Self:
        missing = [name for name in SOURCE_FIELDS if getattr(self, name) is None]
        if 0 < len(missing) < len(SOURCE_FIELDS):
            raise PydanticCustomError(
                "whole_source",
                "Input should be all of {fields} or none",
                {"fields": SOURCE, "missing": missing[0]},
            )
        return self

    @model_validator(mode="after")
    def _one_time(self) -> Self:
        given = (self.time_s is not None) + (self.time_ns is not None) + (self.time is not None)
        if given != 1:
            kind = "one_time" if given == 0 else "many_times"
            raise PydanticCustomError(kind, "Input should be exactly one of time_s, time_ns, time")
        return self

    def seconds(self) -> float:
        """Return the time in seconds, from whichever field is given."""
        if self.time_s is not None:
            return self.time_s
        if self.time_ns is not None:
            return self.time_ns / 1e9
        return 0.0 if self.time is None else self.time.timestamp()


class _Reporting(AircraftData, _Common):
    pass


class RadarMeasurement(_Reporting):
    """A radar plot: raw slant range and azimuth."""

    kind: Annotated[Literal["radar"], _KIND]
    range_m: Range
    azimuth_deg: Azimuth
    latitude_deg: Latitude | None = None
    longitude_deg: Longitude | None = None


class _PositionMeasurement(_Reporting):
    latitude_deg: Latitude
    longitude_deg: Longitude
    range_m: Range | None = None
    azimuth_deg: Azimuth | None = None


class AdsbMeasurement(_PositionMeasurement):
    """A position reported by the aircraft."""

    kind: Annotated[Literal["adsb"], _KIND]


class MlatMeasurement(_PositionMeasurement):
    """A position from multilateration."""

    kind: Annotated[Literal["mlat"], _KIND]


class BearingMeasurement(_Reporting):
    """An azimuth without range, from a direction finder or a jammed radar."""

    kind: Annotated[Literal["bearing"], _KIND]
    azimuth_deg: Azimuth
    range_m: Range | None = None
    latitude_deg: Latitude | None = None
    longitude_deg: Longitude | None = None


#: Required fields by kind; other fields are validated but not used.
KIND_NEEDS: dict[str, tuple[str, ...]] = {
    "radar": ("range_m", "azimuth_deg"),
    "adsb": ("latitude_deg", "longitude_deg"),
    "mlat": ("latitude_deg", "longitude_deg"),
    "bearing": ("azimuth_deg",),
}

Measurement = Annotated[
    RadarMeasurement | AdsbMeasurement | MlatMeasurement | BearingMeasurement,
    Field(discriminator="kind"),
]

MEASUREMENT: TypeAdapter[Measurement] = TypeAdapter(Measurement)
MEASUREMENTS: TypeAdapter[list[Measurement]] = TypeAdapter(list[Measurement])
