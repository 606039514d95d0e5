"""Sensors and their bias priors: the model of `sensors.toml`."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    StringConstraints,
    ValidationError,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from multiradar_schemas import bounds as bounds
from multiradar_schemas.base import Record
from multiradar_schemas.documents.contents import SENSORS
from multiradar_schemas.documents.explain import ABSENT_ERROR, SENTENCE_ERROR
from multiradar_schemas.documents.files import Document, parse_toml, read_toml, validated
from multiradar_schemas.documents.tables import Table, wrong
from multiradar_schemas.measurements.measurement import SENSOR_ID_PATTERN, SensorName
from multiradar_schemas.sensors.bias import FILE, BiasParameter, SensorBias, of_file, within

SensorKind = Literal["radar", "adsb", "mlat", "direction-finder"]

#: Names of the bias parameters, in the order of the bias vector.
BIAS_PARAMETERS = tuple(SensorBias.model_fields)

#: Default prior standard deviation of each parameter, in the unit of the parameter.
PRIOR_SIGMA_DEFAULT = {
    "range_offset_m": 500.0,
    "azimuth_offset_deg": 0.5,
    "range_gain": 0.002,
    "time_offset_s": 0.5,
    "azimuth_sine_deg": 0.1,
    "azimuth_cosine_deg": 0.1,
    "frame_east_m": 50.0,
    "frame_north_m": 50.0,
    "frame_rotation_deg": 0.5,
}

#: Parameters that each kind of sensor can have, and those estimated by default.
PARAMETERS_BY_KIND: dict[str, tuple[str, ...]] = {
    "radar": tuple(name for name in BIAS_PARAMETERS if name != "frame_rotation_deg"),
    "direction-finder": (
        "azimuth_offset_deg", "time_offset_s", "azimuth_sine_deg", "azimuth_cosine_deg",
    ),
    "adsb": ("time_offset_s",),
    "mlat": ("time_offset_s", "frame_east_m", "frame_north_m", "frame_rotation_deg"),
}  # fmt: skip
ESTIMATED_BY_KIND: dict[str, tuple[str, ...]] = {
    "radar": ("range_offset_m", "azimuth_offset_deg"),
    "direction-finder": ("azimuth_offset_deg",),
    "adsb": (),
    "mlat": (),
}


class EstimatedBias(Record):
    """An estimated bias parameter with its defaults filled in."""

    parameter: str
    prior: float
    prior_sigma: float
    drift: float


def _sensor_schema(schema: dict[str, Any]) -> None:
    """Add the rules of the validators of `Sensor` to the JSON Schema."""
    schema["required"] = ["kind"]
    named_by = (["id"], ["source", "sensor"], ["sac", "sic"])
    schema["anyOf"] = [{"required": names} for names in named_by]
    schema["if"] = {"properties": {"kind": {"enum": ["radar", "direction-finder"]}}}
    schema["then"] = {"required": ["latitude_deg", "longitude_deg", "height_m"]}


class Sensor(Table):
    """A sensor of `sensors.toml`; its id can be derived from its numbers."""

    model_config = ConfigDict(json_schema_extra=_sensor_schema)

    id: Annotated[
        str,
        StringConstraints(pattern=SENSOR_ID_PATTERN),
        of_file("Name of the sensor", "letters, digits, `.`, `_`, `-`"),
    ]
    kind: Annotated[SensorKind, of_file("radar, adsb, mlat or direction-finder", "name")]
    latitude_deg: Annotated[
        float | None,
        within(bounds.LATITUDE_DEG),
        of_file("WGS 84 latitude of the site", "degree", "adsb, mlat"),
    ] = None
    longitude_deg: Annotated[
        float | None,
        within(bounds.LONGITUDE_DEG),
        of_file("WGS 84 longitude of the site", "degree", "adsb, mlat"),
    ] = None
    height_m: Annotated[
        float | None,
        within(bounds.HEIGHT_M),
        of_file("Height of the antenna above the ellipsoid", "m", "adsb, mlat"),
    ] = None
    range_sigma_m: Annotated[
        float, within(bounds.RANGE_SIGMA_M), of_file("Random range error, 1 sigma", "m")
    ] = 50.0
    azimuth_sigma_deg: Annotated[
        float,
        within(bounds.AZIMUTH_SIGMA_DEG),
        of_file("Random azimuth error, 1 sigma", "degree"),
    ] = 0.08
    position_sigma_m: Annotated[
        float,
        within(bounds.POSITION_SIGMA_M),
        of_file("Random error of a reported position, 1 sigma on each axis", "m"),
    ] = 30.0
    elevation_sigma_deg: Annotated[
        float | None,
        within(bounds.AZIMUTH_SIGMA_DEG),
        of_file("Random elevation error, 1 sigma", "degree", "not measured"),
    ] = None
    moving: Annotated[
        bool,
        of_file(
            "Whether a direction finder is moving: its bearings then contain its position, and "
            "the position given here is approximate",
            "true or false",
        ),
    ] = False
    rotation_period_s: Annotated[
        float | None,
        within(bounds.ROTATION_PERIOD_S),
        of_file("Rotation period of the antenna (scan period)", "s", "unknown, or not rotating"),
    ] = None
    range_max_m: Annotated[
        float | None,
        within(bounds.RANGE_MAX_M),
        of_file("Instrumented range", "m", "unknown"),
    ] = None
    earth_radius_factor: Annotated[
        float | None,
        within(bounds.EARTH_RADIUS_FACTOR),
        of_file(
            "Refraction of ranges: factor for the effective Earth radius, such as 1.2",
            "1",
            "ranges are not affected by refraction",
        ),
    ] = None
    transponder_delay_sigma_m: Annotated[
        float | None,
        within(bounds.TRANSPONDER_DELAY_SIGMA_M),
        of_file(
            "Prior sigma of the transponder delays as a one-way range error, equal for all "
            "radars with this field: their ranges include the delays, and one delay is estimated "
            "for each aircraft",
            "m",
            "not estimated, or a primary radar",
        ),
    ] = None
    plots_per_scan_max: Annotated[
        float | None,
        within(bounds.PLOTS_PER_SCAN_MAX),
        of_file(
            "Maximum number of plots per scan (per second if there is no scan period), and of "
            "tentative tracks initiated by the sensor; a larger number indicates a fault",
            "1",
            "derived from the coverage: 10 000 to 20 000",
        ),
    ] = None
    clock_tolerance_s: Annotated[
        float | None,
        within(bounds.CLOCK_TOLERANCE_S),
        of_file(
            "Clock tolerance, at most the reorder horizon: a measurement farther ahead of the "
            "data time is accepted only if the clocks of other sensors agree",
            "s",
            "half of the reorder horizon",
        ),
    ] = None
    enabled: Annotated[
        bool,
        of_file(
            "Whether the measurements of the sensor are used; measurements of a disabled sensor "
            "are rejected with SENSOR_DISABLED",
            "true or false",
        ),
    ] = True
    also: Annotated[
        tuple[SensorName, ...],
        BeforeValidator(lambda names: tuple(names) if isinstance(names, list) else names),
        of_file(
            "Additional names of the sensor in measurements, for example in a second network",
            "list of ids, such as `43-10`",
        ),
    ] = ()
    source: Annotated[
        int | None, Field(ge=0), of_file("Number of the source in dumps", "1", "not from a dump")
    ] = None
    sensor: Annotated[
        int | None, Field(ge=0), of_file("Number of the sensor in dumps", "1", "not from a dump")
    ] = None
    sac: Annotated[
        int | None,
        Field(ge=0, le=255),
        of_file("ASTERIX system area code (SAC)", "1", "not ASTERIX"),
    ] = None
    sic: Annotated[
        int | None,
        Field(ge=0, le=255),
        of_file("ASTERIX system identification code (SIC)", "1", "not ASTERIX"),
    ] = None
    bias: Annotated[SensorBias, of_file("Bias parameters of the sensor", "table")] = SensorBias()

    def names_by_numbers(self) -> tuple[str, ...]:
        """Return the names of the sensor derived from its numbers in dumps and in ASTERIX."""
        pairs = ((self.source, self.sensor), (self.sac, self.sic))
        return tuple(f"{a}-{b}" for a, b in pairs if a is not None and b is not None)

    def all_names(self) -> set[str]:
        """Return all names of the sensor in measurements."""
        return {self.id, *self.names_by_numbers(), *self.also}

    @model_validator(mode="after")
    def _id_and_numbers_agree(self) -> Self:
        names = self.names_by_numbers()
        if names and self.id not in names and re.fullmatch(r"\d+-\d+", self.id):
            raise wrong(
                f"expected the id derived from the numbers, {' or '.join(names)}, was {self.id}"
            )
        return self

    @model_validator(mode="before")
    @classmethod
    def _name_by_numbers(cls, data: Any) -> Any:
        if not isinstance(data, dict) or "id" in data:
            return data
        for first, second in (("source", "sensor"), ("sac", "sic")):
            if first in data and second in data:
                return {**data, "id": f"{data[first]}-{data[second]}"}
        return data

    @model_validator(mode="wrap")
    @classmethod
    def _site_is_known(cls, data: Any, check: ModelWrapValidatorHandler[Self]) -> Self:
        # Together with the errors of other fields, so that all are reported at once.
        absent = _absent_site(data)
        if absent:
            data = {name: value for name, value in data.items() if name not in absent}
        errors = [
            InitErrorDetails(
                type=PydanticCustomError(ABSENT_ERROR, "missing"), loc=(one,), input=None
            )
            for one in absent
        ]
        try:
            made = check(data)
        except ValidationError as error:
            errors += _line_errors(error)
        if errors:
            raise ValidationError.from_exception_data(cls.__name__, errors)
        return made

    @model_validator(mode="after")
    def _directions_fit_the_kind(self) -> Self:
        if self.moving and self.kind != "direction-finder":
            raise wrong(f"moving does not apply to the {self.kind} {self.id}; remove it")
        if self.elevation_sigma_deg is not None and self.kind in ("adsb", "mlat"):
            raise wrong(
                f"elevation_sigma_deg does not apply to the {self.kind} {self.id}; remove it"
            )
        clock = self.bias.time_offset_s
        if self.moving and (clock.estimate or clock.prior != 0.0):
            # The reported position refers to the true time, which a biased clock does not give.
            raise wrong(f"time_offset_s does not apply to {self.id}, which is moving; remove it")
        return self

    @model_validator(mode="after")
    def _refraction_fits_the_kind(self) -> Self:
        if self.earth_radius_factor is not None and self.kind != "radar":
            raise wrong(
                f"earth_radius_factor does not apply to the {self.kind} {self.id}; remove it"
            )
        return self

    @model_validator(mode="after")
    def _delay_fits_the_kind(self) -> Self:
        if self.transponder_delay_sigma_m is not None and self.kind != "radar":
            raise wrong(
                f"transponder_delay_sigma_m does not apply to the {self.kind} {self.id}; remove it"
            )
        return self

    @model_validator(mode="after")
    def _biases_fit_the_kind(self) -> Self:
        for name in BIAS_PARAMETERS:
            one: BiasParameter = getattr(self.bias, name)
            if name in PARAMETERS_BY_KIND[self.kind]:
                continue
            if one.estimate or one.prior != 0.0:
                # Radars have a site, which ADS-B does not need.
                sited = self.kind == "adsb" and self.latitude_deg is not None
                perhaps = ', or write kind = "radar"' if sited else ""
                raise wrong(
                    f"bias.{name} does not apply to the {self.kind} {self.id}; remove it{perhaps}"
                )
        if self.kind == "mlat" and self.latitude_deg is None:
            self._require_no_frame()
        return self

    def _require_no_frame(self) -> None:
        for name in ("frame_east_m", "frame_north_m", "frame_rotation_deg"):
            one: BiasParameter = getattr(self.bias, name)
            if one.estimate or one.prior != 0.0:
                raise wrong(
                    f"bias.{name} requires latitude_deg and longitude_deg, the reference point of "
                    f"{self.id}; add them"
                )

    def estimated_biases(self) -> tuple[EstimatedBias, ...]:
        """Return the bias parameters to estimate, in the order of the bias vector."""
        chosen = []
        for name in BIAS_PARAMETERS:
            known: BiasParameter = getattr(self.bias, name)
            if self._estimates(name):
                sigma = known.prior_sigma
                chosen.append(
                    EstimatedBias(
                        parameter=name,
                        prior=known.prior,
                        prior_sigma=PRIOR_SIGMA_DEFAULT[name] if sigma is None else sigma,
                        drift=known.drift,
                    )
                )
        return tuple(chosen)

    def known_biases(self) -> dict[str, float]:
        """Return the known biases that are not estimated and not 0."""
        values = {name: float(getattr(self.bias, name).prior) for name in BIAS_PARAMETERS}
        return {
            name: value
            for name, value in values.items()
            if value != 0.0 and not self._estimates(name)
        }

    def _estimates(self, name: str) -> bool:
        known: BiasParameter = getattr(self.bias, name)
        return name in ESTIMATED_BY_KIND[self.kind] if known.estimate is None else known.estimate


# Site fields that are absent; nan marks a value to fill in in a template, for any kind.
def _absent_site(data: Any) -> list[str]:
    if not isinstance(data, dict):
        return []
    required = data.get("kind") in ("radar", "direction-finder")
    site = {name: data.get(name) for name in ("latitude_deg", "longitude_deg", "height_m")}
    return [name for name, value in site.items() if _is_nan(value) or (required and value is None)]


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and math.isnan(value)


def _line_errors(error: ValidationError) -> list[InitErrorDetails]:
    return [
        InitErrorDetails(
            type=wrong(one["msg"]) if one["type"] == SENTENCE_ERROR else one["type"],
            loc=one["loc"],
            input=one["input"],
            ctx=one.get("ctx", {}),
        )
        for one in error.errors(include_url=False)
    ]


class SensorsFile(Table):
    """All sensors of an installation."""

    sensor: Annotated[
        tuple[Sensor, ...], Field(min_length=1), of_file("The sensors, one table each", "tables")
    ]

    @model_validator(mode="after")
    def _names_are_unique(self) -> Self:
        seen: set[str] = set()
        for one in self.sensor:
            names = one.all_names()
            for name in sorted(names & seen):
                raise wrong(f"two sensors are named {name}: remove one or rename it")
            seen |= names
        return self

    @model_validator(mode="after")
    def _delays_agree(self) -> Self:
        given = {
            one.transponder_delay_sigma_m: one.id
            for one in self.sensor
            if one.transponder_delay_sigma_m is not None
        }
        if len(given) > 1:
            named = ", ".join(f"{sigma:g} for {name}" for sigma, name in given.items())
            raise wrong(
                "expected the same transponder_delay_sigma_m for all radars that have one (the "
                f"delay is a property of the aircraft), was {named}"
            )
        return self


def load_sensors(path: Path) -> SensorsFile:
    """Read `sensors.toml`.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    SensorsFile
        Its sensors, in the order of the file.

    Raises
    ------
    DocumentError
        When the file cannot be read, is not TOML, or has an invalid value; the message names the
        location, the expected and the actual value.
    """
    return _sensors(read_toml(path))


def parse_sensors(text: str, *, source: str = FILE) -> SensorsFile:
    """Parse the text of a `sensors.toml`; see `load_sensors`."""
    return _sensors(parse_toml(text, source=source))


def with_sensor(sensors: SensorsFile, values: dict[str, Any]) -> SensorsFile:
    """Return sensors of which one is changed, at its place, or added at the end.

    Parameters
    ----------
    sensors : SensorsFile
        The sensors so far.
    values : dict
        The keys of one sensor, with its `id`.

    Raises
    ------
    DocumentError
        As `load_sensors`.
    """
    known = [one.id for one in sensors.sensor]
    every = [one.model_dump(exclude_unset=True) for one in sensors.sensor]
    place = known.index(values["id"]) if values["id"] in known else len(every)
    every[place : place + 1] = [values]
    return _sensors(Document(f"sensor {values['id']}", {"sensor": every}, {}))


def _sensors(document: Document) -> SensorsFile:
    listed = document.values.get("sensor")
    if isinstance(listed, list):
        document = replace(document, values=document.values | {"sensor": tuple(listed)})
    return validated(SensorsFile, document, SENSORS)
