"""Tables of a scenario in TOML: keys, units and bounds."""

from collections import Counter
from collections.abc import Sequence
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BeforeValidator, Field, StringConstraints, model_validator

from multiradar.simulation.scenario.bias_tables import BiasesTable
from multiradar.simulation.scenario.model import (
    RECEIVED_FIELDS,
    SITED,
    PlaneKind,
    ReceivedField,
    SensorKind,
)
from multiradar.simulation.scenario.reported_tables import AtmosphereTable, RegistersTable
from multiradar_schemas import bounds as bounds
from multiradar_schemas.documents.names import shown
from multiradar_schemas.documents.tables import Table, wrong
from multiradar_schemas.measurements.measurement import (
    LATITUDE_MAX_DEG,
    LONGITUDE_MAX_DEG,
    MODE_3A_PATTERN,
    MODE_S_ADDRESS_PATTERN,
    SensorName,
)
from multiradar_schemas.sensors.bias import within
from multiradar_schemas.sensors.sensor import PARAMETERS_BY_KIND

AIRCRAFT_MAX = 20_000
SENSORS_MAX = 1_000
DURATION_MAX_S = 7 * 86_400.0


def _paired(value: Any) -> Any:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return (value, value) if is_number else _tuple_of(value)


# TOML has lists, a frozen record has tuples.
def _tuple_of(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _ascending(value: tuple[float, float]) -> tuple[float, float]:
    if value[0] > value[1]:
        raise wrong(f"expected two numbers in ascending order, was {shown(list(value))}")
    return value


_LISTED = BeforeValidator(_tuple_of)
_PAIRED = BeforeValidator(_paired)
_ASCENDING = AfterValidator(_ascending)

_Latitude = Annotated[float, Field(ge=-LATITUDE_MAX_DEG, le=LATITUDE_MAX_DEG)]
_Longitude = Annotated[float, Field(ge=-LONGITUDE_MAX_DEG, le=LONGITUDE_MAX_DEG)]
_Coordinate = Annotated[float, Field(ge=-2e6, le=2e6)]
_Height = Annotated[float, Field(ge=-500.0, le=30_000.0)]
_HeightStep = Annotated[float, Field(ge=0.0, le=1000.0)]
_Speed = Annotated[float, Field(ge=0.0, le=2000.0)]
_Heading = Annotated[float, Field(ge=-360.0, le=360.0)]
_Moment = Annotated[float, Field(ge=0.0, le=DURATION_MAX_S)]
_Length = Annotated[float, Field(gt=0.0, le=DURATION_MAX_S)]
_TurnRate = Annotated[float, Field(ge=-30.0, le=30.0)]
_Acceleration = Annotated[float, Field(ge=-50.0, le=50.0)]
_Drift = Annotated[float, Field(ge=-1000.0, le=1000.0)]
_Density = Annotated[float, Field(ge=0.0, le=1e4)]
_Delay = Annotated[float, Field(ge=-2000.0, le=2000.0)]
_Share = Annotated[float, Field(ge=0.0, le=1.0)]
_Coordinates = Annotated[tuple[_Coordinate, _Coordinate], _PAIRED, _ASCENDING]
_Heights = Annotated[tuple[_Height, _Height], _PAIRED, _ASCENDING]
_Speeds = Annotated[tuple[_Speed, _Speed], _PAIRED, _ASCENDING]
_Headings = Annotated[tuple[_Heading, _Heading], _PAIRED, _ASCENDING]
_Moments = Annotated[tuple[_Moment, _Moment], _PAIRED, _ASCENDING]
_Lengths = Annotated[tuple[_Length, _Length], _PAIRED, _ASCENDING]
_TurnRates = Annotated[tuple[_TurnRate, _TurnRate], _PAIRED, _ASCENDING]
_Accelerations = Annotated[tuple[_Acceleration, _Acceleration], _PAIRED, _ASCENDING]
_Climb = Annotated[float, Field(ge=-200.0, le=200.0)]
_Climbs = Annotated[tuple[_Climb, _Climb], _PAIRED, _ASCENDING]
_RotationPeriod = Annotated[float, within(bounds.ROTATION_PERIOD_S)]
_Gap = Annotated[tuple[_Moment, _Moment], _LISTED, _ASCENDING]


class PlaneTable(Table):
    """The plane; its default centre is the middle of the radars."""

    kind: PlaneKind = "wgs84"
    latitude_deg: _Latitude | None = None
    longitude_deg: _Longitude | None = None

    @model_validator(mode="after")
    def _centre_is_whole(self) -> Self:
        if (self.latitude_deg is None) != (self.longitude_deg is None):
            raise wrong(
                "expected both latitude_deg and longitude_deg of the centre, found only one"
            )
        return self


class _Positioned(Table):
    east_m: _Coordinate | None = None
    north_m: _Coordinate | None = None
    latitude_deg: _Latitude | None = None
    longitude_deg: _Longitude | None = None


def check_position(table: _Positioned, what: str) -> None:
    """Raise an error unless the position is given in exactly one of the two forms."""
    plane = [table.east_m, table.north_m]
    geodetic = [table.latitude_deg, table.longitude_deg]
    given = [pair.count(None) for pair in (plane, geodetic)]
    if given not in ([0, 2], [2, 0]):
        raise wrong(
            f"expected the position of {what} as either east_m and north_m, or latitude_deg and "
            f"longitude_deg"
        )


class LegTable(Table):
    """A part of a flight."""

    duration_s: _Length
    turn_rate_deg_per_s: _TurnRate = 0.0
    acceleration_mps2: _Acceleration = 0.0
    climb_mps: _Climb = 0.0


class CoupledTable(Table):
    """Model (5) of Vasiliev and Mattis."""

    acceleration_sigma_mps2: Annotated[float, Field(ge=0.0, le=50.0)]
    course_rate_sigma_deg_per_s: Annotated[float, Field(ge=0.0, le=30.0)]
    climb_rate_sigma_deg_per_s: Annotated[float, Field(ge=0.0, le=30.0)] = 0.0
    step_s: Annotated[float, Field(ge=0.01, le=60.0)] = 1.0


class ReportErrorTable(Table):
    """Errors of the reported positions of an aircraft during a period."""

    start_s: _Moment = 0.0
    end_s: _Moment | None = None
    east_m: _Coordinate = 0.0
    north_m: _Coordinate = 0.0
    east_mps: _Drift = 0.0
    north_mps: _Drift = 0.0


class AircraftTable(_Positioned):
    """One aircraft."""

    track_number: Annotated[int, Field(ge=1, le=1_000_000)] | None = None
    height_m: _Height = 9000.0
    speed_mps: _Speed
    heading_deg: _Heading
    start_s: _Moment = 0.0
    end_s: _Moment | None = None
    leg: Annotated[tuple[LegTable, ...], _LISTED] = ()
    coupled: CoupledTable | None = None
    acceleration_density: _Density = 0.0
    mode_3a: Annotated[str, StringConstraints(pattern=MODE_3A_PATTERN)] | None = None
    mode_s_address: Annotated[str, StringConstraints(pattern=MODE_S_ADDRESS_PATTERN)] | None = None
    later_mode_3a: Annotated[str, StringConstraints(pattern=MODE_3A_PATTERN)] | None = None
    code_change_s: _Moment | None = None
    height_step_m: _HeightStep = 0.0
    reports_height: bool = True
    reports_position: bool = True
    report_error: Annotated[tuple[ReportErrorTable, ...], _LISTED] = ()
    exists: bool = True
    transponder: bool = True
    transponder_delay_m: _Delay = 0.0

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        check_position(self, "the aircraft")
        check_one_manoeuvre(bool(self.leg), self.coupled, self.acceleration_density)
        if self.end_s is not None and self.end_s <= self.start_s:
            raise wrong(f"expected end_s after start_s = {self.start_s:g}, was {self.end_s:g}")
        if (self.later_mode_3a is None) != (self.code_change_s is None):
            raise wrong("expected later_mode_3a and code_change_s together, found only one")
        if not self.exists and not (self.transponder and self.reports_position):
            raise wrong("a ghost (exists = false) must report its position")
        return self


def check_one_manoeuvre(legs: bool, coupled: CoupledTable | None, density: float) -> None:
    """Raise an error for an aircraft with more than one kind of manoeuvre."""
    if legs + (coupled is not None) + (density > 0.0) > 1:
        raise wrong("expected only one of legs, coupled and acceleration_density")


class TrafficTable(Table):
    """Aircraft drawn from the seed; a number stands for a span of zero width."""

    count: Annotated[int, Field(ge=1, le=AIRCRAFT_MAX)]
    east_m: _Coordinates
    north_m: _Coordinates
    height_m: _Heights = (9000.0, 9000.0)
    speed_mps: _Speeds = (150.0, 250.0)
    heading_deg: _Headings = (0.0, 360.0)
    start_s: _Moments = (0.0, 0.0)
    life_s: _Lengths | None = None
    leg_s: _Lengths | None = None
    turn_rate_deg_per_s: _TurnRates = (0.0, 0.0)
    acceleration_mps2: _Accelerations = (0.0, 0.0)
    climb_mps: _Climbs = (0.0, 0.0)
    coupled: CoupledTable | None = None
    acceleration_density: _Density = 0.0
    height_step_m: _HeightStep = 0.0
    heard_height_share: _Share = 1.0
    equipped_share: _Share = 1.0
    transponder_delay_sigma_m: Annotated[float, Field(ge=0.0, le=500.0)] = 0.0

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        check_one_manoeuvre(self.leg_s is not None, self.coupled, self.acceleration_density)
        if self.leg_s is not None and self.leg_s[0] < 1.0:
            raise wrong(f"expected leg_s of at least 1 s, was {self.leg_s[0]:g}")
        return self


class SecondFeedTable(Table):
    """A second network that carries the plots of a radar."""

    share: _Share = 1.0
    time_step_s: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    range_step_m: Annotated[float, Field(ge=0.0, le=1000.0)] = 0.0
    azimuth_step_deg: Annotated[float, Field(ge=0.0, le=5.0)] = 0.0


class ClutterBurstTable(Table):
    """A clutter burst."""

    start_s: _Moment
    end_s: _Moment
    plots_per_turn: Annotated[float, Field(gt=0.0, le=100_000.0)]

    @model_validator(mode="after")
    def _lasts(self) -> Self:
        if self.end_s <= self.start_s:
            raise wrong(f"expected end_s after start_s = {self.start_s:g}, was {self.end_s:g}")
        return self


# Keys of radars only.
_OF_RADARS = (
    "east_m", "north_m", "latitude_deg", "longitude_deg", "height_m", "range_sigma_m",
    "azimuth_sigma_deg", "rotation_period_s", "range_min_m", "range_max_m", "elevation_max_deg",
    "horizon", "garbled_probability", "clutter_per_turn", "storm", "second_feed",
    "range_resolution_m", "azimuth_resolution_deg", "jammed_s", "earth_radius_factor",
    "secondary", "transponder_delay_sigma_m",
)  # fmt: skip
# Keys that a direction finder, which measures no range, does not have.
_OF_RANGES = (
    "range_sigma_m", "position_sigma_m", "clutter_per_turn", "storm", "second_feed",
    "range_resolution_m", "azimuth_resolution_deg", "jammed_s", "earth_radius_factor",
    "secondary", "transponder_delay_sigma_m",
    "aircraft_data",
)  # fmt: skip
# Keys of the reference point of a local frame.
_OF_FRAMES = ("east_m", "north_m", "latitude_deg", "longitude_deg")
# Keys of direction finders only.
_OF_FINDERS = ("elevation_sigma_deg", "speed_mps", "heading_deg", "leg")


class SensorTable(_Positioned):
    """One sensor."""

    id: SensorName
    kind: SensorKind = "radar"
    height_m: Annotated[float, within(bounds.HEIGHT_M)] = 0.0
    range_sigma_m: Annotated[float, within(bounds.RANGE_SIGMA_M)] = 50.0
    azimuth_sigma_deg: Annotated[float, within(bounds.AZIMUTH_SIGMA_DEG)] = 0.08
    position_sigma_m: Annotated[float, within(bounds.POSITION_SIGMA_M)] = 30.0
    rotation_period_s: _RotationPeriod | None = None
    interval_s: _RotationPeriod | None = None
    range_min_m: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0
    earth_radius_factor: Annotated[float, within(bounds.EARTH_RADIUS_FACTOR)] | None = None
    range_max_m: Annotated[float, within(bounds.RANGE_MAX_M)] | None = None
    elevation_max_deg: Annotated[float, Field(gt=0.0, le=90.0)] | None = None
    horizon: bool | None = None
    detection_probability: _Share = 1.0
    outlier_probability: _Share = 0.0
    height_probability: _Share = 1.0
    garbled_height_probability: _Share = 0.0
    garbled_probability: _Share = 0.0
    clutter_per_turn: Annotated[float, Field(ge=0.0, le=10_000.0)] = 0.0
    storm: Annotated[tuple[ClutterBurstTable, ...], _LISTED] = ()
    second_feed: SecondFeedTable | None = None
    range_resolution_m: Annotated[float, Field(ge=0.0, le=10_000.0)] = 0.0
    azimuth_resolution_deg: Annotated[float, Field(ge=0.0, le=10.0)] = 0.0
    gaps_s: Annotated[tuple[_Gap, ...], _LISTED] = ()
    jammed_s: Annotated[tuple[_Gap, ...], _LISTED] = ()
    reports: Annotated[tuple[ReceivedField, ...], _LISTED] = RECEIVED_FIELDS
    elevation_sigma_deg: Annotated[float, within(bounds.AZIMUTH_SIGMA_DEG)] | None = None
    speed_mps: _Speed | None = None
    heading_deg: _Heading = 0.0
    leg: Annotated[tuple[LegTable, ...], _LISTED] = ()
    bias: BiasesTable = BiasesTable()
    aircraft_data: RegistersTable | None = None
    secondary: bool = True
    transponder_delay_sigma_m: Annotated[float, within(bounds.TRANSPONDER_DELAY_SIGMA_M)] | None = (
        None
    )

    @model_validator(mode="after")
    def _fits_its_kind(self) -> Self:
        if self.kind in SITED:
            check_position(self, f"the {self.kind} {self.id}")
            unused = ["position_sigma_m"] if self.kind == "radar" else list(_OF_RANGES)
        else:
            unused = [key for key in _OF_RADARS if key not in _OF_FRAMES or not self._has_frame()]
            if self._has_frame():
                check_position(self, f"the {self.kind} {self.id}")
        if self.kind != "direction-finder":
            unused += _OF_FINDERS
        for key in unused:
            if key in self.model_fields_set:
                raise wrong(f"{key} does not apply to the {self.kind} {self.id}; remove it")
        return self

    def _has_frame(self) -> bool:
        return any(name.startswith("frame_") for name in self.bias.names())

    @model_validator(mode="after")
    def _biases_fit_its_kind(self) -> Self:
        for name in self.bias.names():
            if name not in PARAMETERS_BY_KIND[self.kind]:
                raise wrong(f"bias.{name} does not apply to the {self.kind} {self.id}; remove it")
        return self

    @model_validator(mode="after")
    def _keys_fit_together(self) -> Self:
        if (self.range_resolution_m > 0.0) != (self.azimuth_resolution_deg > 0.0):
            raise wrong(
                "expected range_resolution_m and azimuth_resolution_deg together, found only one"
            )
        if self.range_resolution_m > 0.0 and self.second_feed is not None:
            raise wrong("expected either range_resolution_m or second_feed, found both")
        if self.rotation_period_s is not None and self.interval_s is not None:
            raise wrong("expected either rotation_period_s or interval_s, found both")
        if self.transponder_delay_sigma_m is not None and not self.secondary:
            raise wrong("transponder_delay_sigma_m does not apply to a primary radar; remove it")
        return self

    @model_validator(mode="after")
    def _finder_is_one(self) -> Self:
        if self.kind != "direction-finder":
            return self
        if self.speed_mps is None:
            for key in ("heading_deg", "leg"):
                if key in self.model_fields_set:
                    raise wrong(f"missing speed_mps, which {key} of {self.id} requires")
        elif self.bias.time_offset_s is not None:
            raise wrong(
                f"bias.time_offset_s does not apply to {self.id}, a moving sensor; remove it"
            )
        return self


def _check_once(what: str, names: Sequence[str | int]) -> None:
    for name, count in Counter(names).items():
        if count > 1:
            raise wrong(f"{what} {name} is given twice; each must be unique")


class ScenarioTable(Table):
    """A whole scenario."""

    title: Annotated[str, StringConstraints(max_length=500)] = ""
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    duration_s: _Length
    start_time_s: Annotated[float, Field(ge=0.0, le=1e10)] = 0.0
    plane: PlaneTable = PlaneTable()
    atmosphere: AtmosphereTable = AtmosphereTable()
    aircraft: Annotated[tuple[AircraftTable, ...], _LISTED, Field(max_length=AIRCRAFT_MAX)] = ()
    traffic: Annotated[tuple[TrafficTable, ...], _LISTED, Field(max_length=AIRCRAFT_MAX)] = ()
    sensor: Annotated[tuple[SensorTable, ...], _LISTED, Field(min_length=1, max_length=SENSORS_MAX)]

    @model_validator(mode="after")
    def _is_valid(self) -> Self:
        _check_once("id of a sensor", [one.id for one in self.sensor])
        numbers = [one.track_number for one in self.aircraft if one.track_number is not None]
        _check_once("track_number", numbers)
        count = len(self.aircraft) + sum(one.count for one in self.traffic)
        if not 1 <= count <= AIRCRAFT_MAX:
            raise wrong(f"expected 1 to {AIRCRAFT_MAX} aircraft, found {count}")
        return self

    @model_validator(mode="after")
    def _plane_is_enough(self) -> Self:
        everywhere: list[_Positioned] = [*self.aircraft, *self.sensor]
        geodetic = [one for one in everywhere if one.latitude_deg is not None]
        if self.plane.kind == "flat" and geodetic:
            raise wrong(
                "expected positions as east_m and north_m on a flat plane, found latitude_deg"
            )
        radars = [one for one in self.sensor if one.latitude_deg is not None]
        if self.plane.latitude_deg is None and not radars:
            raise wrong(
                "expected latitude_deg and longitude_deg of the plane's centre or of a radar, "
                "found neither"
            )
        return self
