"""Sensors and what is known of their biases: the model of `sensors.toml`."""

import re
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, StringConstraints, model_validator

from multiradar_schemas.base import Record, described
from multiradar_schemas.documents import parse_toml, read_toml, validated
from multiradar_schemas.measurement import LATITUDE_MAX_DEG, LONGITUDE_MAX_DEG, SENSOR_ID_PATTERN

SensorKind = Literal["radar", "adsb", "mlat", "direction-finder"]

#: Names of the bias parameters, in the order of the bias vector.
BIAS_PARAMETERS = ("range_offset_m", "azimuth_offset_deg", "range_gain", "time_offset_s")

#: Standard deviation of each parameter beforehand, in the parameter's own unit.
PRIOR_SIGMA_DEFAULT = {
    "range_offset_m": 500.0,
    "azimuth_offset_deg": 0.5,
    "range_gain": 0.002,
    "time_offset_s": 0.5,
}

#: Parameters that each kind of sensor can have, and those estimated unless told otherwise.
PARAMETERS_BY_KIND: dict[str, tuple[str, ...]] = {
    "radar": BIAS_PARAMETERS,
    "direction-finder": ("azimuth_offset_deg", "time_offset_s"),
    "adsb": (),
    "mlat": (),
}
ESTIMATED_BY_KIND: dict[str, tuple[str, ...]] = {
    "radar": ("range_offset_m", "azimuth_offset_deg"),
    "direction-finder": ("azimuth_offset_deg",),
    "adsb": (),
    "mlat": (),
}

_FILE = "sensors.toml"


def _of_file(description: str, unit: str, absent: str = "never") -> Any:
    return described(description, unit=unit, source=_FILE, absent=absent)


class BiasParameter(Record):
    """What is known of one bias before anything is measured; a bias is measured minus true."""

    estimate: Annotated[
        bool | None, _of_file("Estimate it", "true or false", "the default of the kind holds")
    ] = None
    prior: Annotated[
        float, Field(ge=-1e6, le=1e6), _of_file("Mean beforehand", "of the parameter")
    ] = 0.0
    prior_sigma: Annotated[
        float | None,
        Field(ge=1e-9, le=1e6),
        _of_file("Standard deviation beforehand", "of the parameter", "the default holds"),
    ] = None
    drift: Annotated[
        float,
        Field(ge=0.0, le=1e4),
        _of_file("Random walk: standard deviation after one second", "of the parameter / √s"),
    ] = 0.0


class SensorBias(Record):
    """The named bias parameters of a sensor."""

    range_offset_m: Annotated[BiasParameter, _of_file("Offset of range", "m")] = BiasParameter()
    azimuth_offset_deg: Annotated[BiasParameter, _of_file("Offset of azimuth", "degree")] = (
        BiasParameter()
    )
    range_gain: Annotated[BiasParameter, _of_file("Relative error of range", "1")] = BiasParameter()
    time_offset_s: Annotated[BiasParameter, _of_file("Offset of the time stamps", "s")] = (
        BiasParameter()
    )


class EstimatedBias(Record):
    """A bias parameter that is estimated, its defaults filled in."""

    parameter: str
    prior: float
    prior_sigma: float
    drift: float


def _sensor_schema(schema: dict[str, Any]) -> None:
    """Say in the JSON Schema what the validators of `Sensor` say."""
    schema["required"] = ["kind"]
    named_by = (["id"], ["source", "sensor"], ["sac", "sic"])
    schema["anyOf"] = [{"required": names} for names in named_by]
    schema["if"] = {"properties": {"kind": {"enum": ["radar", "direction-finder"]}}}
    schema["then"] = {"required": ["latitude_deg", "longitude_deg", "height_m"]}


class Sensor(Record):
    """One sensor of `sensors.toml`; its id may follow from its numbers."""

    model_config = ConfigDict(json_schema_extra=_sensor_schema)

    id: Annotated[
        str,
        StringConstraints(pattern=SENSOR_ID_PATTERN),
        _of_file("Name of the sensor", "letters, digits, `.`, `_`, `-`"),
    ]
    kind: Annotated[SensorKind, _of_file("What it measures", "name")]
    latitude_deg: Annotated[
        float | None,
        Field(ge=-LATITUDE_MAX_DEG, le=LATITUDE_MAX_DEG),
        _of_file("WGS 84 latitude of the site", "degree", "adsb, mlat"),
    ] = None
    longitude_deg: Annotated[
        float | None,
        Field(ge=-LONGITUDE_MAX_DEG, le=LONGITUDE_MAX_DEG),
        _of_file("WGS 84 longitude of the site", "degree", "adsb, mlat"),
    ] = None
    height_m: Annotated[
        float | None,
        Field(ge=-1000.0, le=10_000.0),
        _of_file("Height of the antenna above the ellipsoid", "m", "adsb, mlat"),
    ] = None
    range_sigma_m: Annotated[
        float, Field(gt=0.0, le=1e5), _of_file("Random error of range, 1 sigma", "m")
    ] = 50.0
    azimuth_sigma_deg: Annotated[
        float, Field(gt=0.0, le=90.0), _of_file("Random error of azimuth, 1 sigma", "degree")
    ] = 0.08
    position_sigma_m: Annotated[
        float,
        Field(gt=0.0, le=1e5),
        _of_file("Random error of a reported position, 1 sigma each axis", "m"),
    ] = 30.0
    rotation_period_s: Annotated[
        float | None,
        Field(gt=0.0, le=3600.0),
        _of_file("Time of one turn of the antenna", "s", "unknown, or it does not turn"),
    ] = None
    range_max_m: Annotated[
        float | None, Field(gt=0.0), _of_file("Instrumented range", "m", "unknown")
    ] = None
    source: Annotated[
        int | None, Field(ge=0), _of_file("Number of the source in dumps", "1", "not from a dump")
    ] = None
    sensor: Annotated[
        int | None, Field(ge=0), _of_file("Number of the sensor in dumps", "1", "not from a dump")
    ] = None
    sac: Annotated[
        int | None, Field(ge=0, le=255), _of_file("ASTERIX area code", "1", "not ASTERIX")
    ] = None
    sic: Annotated[
        int | None, Field(ge=0, le=255), _of_file("ASTERIX identification code", "1", "not ASTERIX")
    ] = None
    bias: Annotated[SensorBias, _of_file("Its bias parameters", "table")] = SensorBias()

    def names_by_numbers(self) -> tuple[str, ...]:
        """Return the names that dumps and ASTERIX make of the sensor's numbers."""
        pairs = ((self.source, self.sensor), (self.sac, self.sic))
        return tuple(f"{a}-{b}" for a, b in pairs if a is not None and b is not None)

    @model_validator(mode="after")
    def _id_and_numbers_agree(self) -> Self:
        names = self.names_by_numbers()
        if names and self.id not in names and re.fullmatch(r"\d+-\d+", self.id):
            msg = f"expected the id that the numbers make, {' or '.join(names)}, was {self.id}"
            raise ValueError(msg)
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

    @model_validator(mode="after")
    def _site_is_known(self) -> Self:
        if self.kind in ("radar", "direction-finder"):
            for name in ("latitude_deg", "longitude_deg", "height_m"):
                if getattr(self, name) is None:
                    msg = f"expected {name} for the {self.kind} {self.id}"
                    raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _biases_fit_the_kind(self) -> Self:
        for name in BIAS_PARAMETERS:
            if getattr(self.bias, name).estimate and name not in PARAMETERS_BY_KIND[self.kind]:
                msg = f"expected no estimate of {name} for the {self.kind} {self.id}"
                raise ValueError(msg)
        return self

    def estimated_biases(self) -> tuple[EstimatedBias, ...]:
        """Return the bias parameters to estimate, in the order of the bias vector."""
        chosen = []
        for name in BIAS_PARAMETERS:
            known: BiasParameter = getattr(self.bias, name)
            default = name in ESTIMATED_BY_KIND[self.kind]
            if default if known.estimate is None else known.estimate:
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


class SensorsFile(Record):
    """All sensors of an installation."""

    sensor: Annotated[
        tuple[Sensor, ...], Field(min_length=1), _of_file("The sensors, one table each", "tables")
    ]

    @model_validator(mode="after")
    def _names_are_unique(self) -> Self:
        seen: set[str] = set()
        for one in self.sensor:
            names = {one.id, *one.names_by_numbers()}
            for name in sorted(names & seen):
                msg = f"expected each id and each pair of numbers once, was twice {name}"
                raise ValueError(msg)
            seen |= names
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
        When the file cannot be read, is no TOML, or holds a value that does not belong; the
        sentence names the place and says what was expected and what was there.
    """
    return _sensors(read_toml(path), str(path))


def parse_sensors(text: str, *, source: str = _FILE) -> SensorsFile:
    """Read the text of a `sensors.toml`; see `load_sensors`."""
    return _sensors(parse_toml(text, source=source), source)


def _sensors(table: dict[str, Any], source: str) -> SensorsFile:
    if isinstance(table.get("sensor"), list):
        table = {**table, "sensor": tuple(table["sensor"])}
    return validated(SensorsFile, table, source=source)
