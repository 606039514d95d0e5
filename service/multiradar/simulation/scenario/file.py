"""Scenarios from TOML files, built-in scenarios, and scenarios as TOML."""

from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from multiradar.errors import ConfigurationError, OutsidePlaneError
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, PARAMETER_UNITS
from multiradar.geodesy.system_plane import ANGLE_MAX_DEG, SystemPlane
from multiradar.simulation.scenario.bias_tables import BiasesTable, BiasTable
from multiradar.simulation.scenario.model import (
    Aircraft,
    Bias,
    ClutterBurst,
    CoupledNoise,
    Leg,
    ReportError,
    Scenario,
    SecondFeed,
    Sensor,
    Traffic,
)
from multiradar.simulation.scenario.tables import (
    AircraftTable,
    CoupledTable,
    LegTable,
    ReportErrorTable,
    ScenarioTable,
    SecondFeedTable,
    SensorTable,
    TrafficTable,
)
from multiradar.simulation.scenario.toml_text import toml_text
from multiradar_schemas.documents.contents import SCENARIO
from multiradar_schemas.documents.files import Document, parse_toml, read_toml, validated
from multiradar_schemas.documents.names import unknown
from multiradar_schemas.errors import DocumentError

_FOLDER = "scenes"
_SUFFIX = ".toml"


def builtin_names() -> tuple[str, ...]:
    """Return the names of the built-in scenarios, sorted."""
    folder = files("multiradar.simulation") / _FOLDER
    return tuple(
        sorted(one.name.removesuffix(_SUFFIX) for one in folder.iterdir() if _is_scenario(one.name))
    )


def builtin_scenario(name: str) -> Scenario:
    """Return a built-in scenario.

    Parameters
    ----------
    name : str
        One of `builtin_names`.

    Raises
    ------
    ConfigurationError
        Unknown name.
    """
    return scenario_of(builtin_table(name))


def load_scenario(path: Path) -> Scenario:
    """Return the scenario of a TOML file.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, is not valid TOML, or has an invalid value; the message gives
        the key, the expected value and the value found.
    """
    return scenario_of(load_table(path))


def builtin_table(name: str) -> ScenarioTable:
    """Return the table of a built-in scenario; see `builtin_scenario`."""
    if name not in builtin_names():
        raise ConfigurationError(unknown("scenario", name, builtin_names()))
    resource = files("multiradar.simulation") / _FOLDER / f"{name}{_SUFFIX}"
    return _checked(parse_toml(resource.read_text(encoding="utf-8"), source=name))


def load_table(path: Path) -> ScenarioTable:
    """Return the table of a TOML file; see `load_scenario`."""
    try:
        document = read_toml(path)
    except DocumentError as error:
        raise ConfigurationError(str(error)) from error
    return _checked(document)


def scenario_table(values: dict[str, Any], *, source: str) -> ScenarioTable:
    """Return values as a validated table; `source` is its name in errors."""
    return _checked(Document(source, values, {}))


def _checked(document: Document) -> ScenarioTable:
    try:
        return validated(ScenarioTable, document, SCENARIO)
    except DocumentError as error:
        raise ConfigurationError(str(error), error.source, error.reasons) from error


def changed(
    table: ScenarioTable, *, seed: int | None = None, duration_s: float | None = None
) -> ScenarioTable:
    """Return a table with another seed or duration, validated again.

    Raises
    ------
    ConfigurationError
        If the scenario is invalid with the change.
    """
    given = {"seed": seed, "duration_s": duration_s}
    chosen = {name: value for name, value in given.items() if value is not None}
    values = table.model_dump(exclude_unset=True) | chosen
    return scenario_table(values, source=table.title or "the scenario")


def table_text(table: ScenarioTable) -> str:
    """Return a table as the TOML text of a scenario: with its seed, without defaults."""
    values = table.model_dump(exclude_unset=True)
    return toml_text({"title": table.title, "seed": table.seed} | values)


def scenario_of(table: ScenarioTable) -> Scenario:
    """Return the scenario that a table describes, in SI units and radians.

    Raises
    ------
    ConfigurationError
        If a position is too far from the centre of the plane, or the plane has no centre.
    """
    plane = _plane(table)
    return Scenario(
        title=table.title,
        seed=table.seed,
        duration_s=table.duration_s,
        plane=table.plane.kind,
        centre_rad=(plane.latitude_rad, plane.longitude_rad),
        aircraft=_aircraft(table.aircraft, plane),
        traffic=tuple(_traffic(one) for one in table.traffic),
        sensors=tuple(_sensor(one, table.plane.kind == "wgs84", plane) for one in table.sensor),
        start_time_s=table.start_time_s,
        atmosphere=table.atmosphere.atmosphere(),
    )


def _is_scenario(name: str) -> bool:
    return name.endswith(_SUFFIX)


def _plane(table: ScenarioTable) -> SystemPlane:
    centre = table.plane
    if centre.latitude_deg is not None and centre.longitude_deg is not None:
        return SystemPlane(
            float(np.radians(centre.latitude_deg)), float(np.radians(centre.longitude_deg))
        )
    sited = [one for one in table.sensor if one.latitude_deg is not None]
    return SystemPlane.for_sensors(
        np.radians([one.latitude_deg or 0.0 for one in sited]),
        np.radians([one.longitude_deg or 0.0 for one in sited]),
    )


def _position(
    table: AircraftTable | SensorTable, plane: SystemPlane, what: str
) -> tuple[float, float]:
    if table.latitude_deg is None or table.longitude_deg is None:
        return table.east_m or 0.0, table.north_m or 0.0
    try:
        east, north = plane.to_plane(
            np.radians(table.latitude_deg), np.radians(table.longitude_deg)
        )
    except OutsidePlaneError as error:
        raise ConfigurationError(
            f"{what}: expected latitude_deg and longitude_deg within {ANGLE_MAX_DEG:g} degrees of "
            f"the plane's centre, was {table.latitude_deg:g}, {table.longitude_deg:g}"
        ) from error
    return float(east), float(north)


def _aircraft(tables: Sequence[AircraftTable], plane: SystemPlane) -> tuple[Aircraft, ...]:
    named = {one.track_number for one in tables if one.track_number is not None}
    free = (number for number in range(1, 2 * len(tables) + 2) if number not in named)
    found = []
    for index, table in enumerate(tables):
        east, north = _position(table, plane, f"aircraft[{index}]")
        code, address = table.mode_3a, table.mode_s_address
        number, later = table.track_number, table.later_mode_3a
        found.append(
            Aircraft(
                track_number=next(free) if number is None else number,
                east_m=east,
                north_m=north,
                height_m=table.height_m,
                speed_mps=table.speed_mps,
                heading_rad=_rad(table.heading_deg),
                start_s=table.start_s,
                end_s=float("inf") if table.end_s is None else table.end_s,
                legs=_legs(table.leg),
                coupled=_coupled(table.coupled),
                acceleration_density=table.acceleration_density,
                mode_3a=None if code is None else int(code, 8),
                mode_s_address=None if address is None else int(address, 16),
                later_mode_3a=None if later is None else int(later, 8),
                code_change_s=float("inf") if table.code_change_s is None else table.code_change_s,
                height_step_m=table.height_step_m,
                reports_height=table.reports_height,
                reports_position=table.reports_position,
                report_errors=tuple(_report_error(one) for one in table.report_error),
                exists=table.exists,
                transponder=table.transponder,
                transponder_delay_m=table.transponder_delay_m,
            )
        )  # fmt: skip
    return tuple(found)


def _legs(tables: Sequence[LegTable]) -> tuple[Leg, ...]:
    return tuple(
        Leg(one.duration_s, _rad(one.turn_rate_deg_per_s), one.acceleration_mps2, one.climb_mps)
        for one in tables
    )


def _report_error(table: ReportErrorTable) -> ReportError:
    end_s = float("inf") if table.end_s is None else table.end_s
    return ReportError(
        table.start_s, end_s, table.east_m, table.north_m, table.east_mps, table.north_mps
    )


def _traffic(table: TrafficTable) -> Traffic:
    forever = (float("inf"), float("inf"))
    return Traffic(
        count=table.count,
        east_m=_span(table.east_m),
        north_m=_span(table.north_m),
        height_m=_span(table.height_m),
        speed_mps=_span(table.speed_mps),
        heading_rad=_span(table.heading_deg, _rad(1.0)),
        start_s=_span(table.start_s),
        life_s=forever if table.life_s is None else _span(table.life_s),
        leg_s=None if table.leg_s is None else _span(table.leg_s),
        turn_rate_rad_per_s=_span(table.turn_rate_deg_per_s, _rad(1.0)),
        acceleration_mps2=_span(table.acceleration_mps2),
        climb_mps=_span(table.climb_mps),
        coupled=_coupled(table.coupled),
        acceleration_density=table.acceleration_density,
        height_step_m=table.height_step_m,
        heard_height_share=table.heard_height_share,
        equipped_share=table.equipped_share,
        transponder_delay_sigma_m=table.transponder_delay_sigma_m,
    )


def _sensor(table: SensorTable, on_earth: bool, plane: SystemPlane) -> Sensor:
    east, north = _position(table, plane, f"sensor {table.id}")
    steepest = table.elevation_max_deg
    return Sensor(
        identifier=table.id,
        kind=table.kind,
        east_m=east,
        north_m=north,
        height_m=table.height_m,
        range_sigma_m=table.range_sigma_m,
        azimuth_sigma_rad=_rad(table.azimuth_sigma_deg),
        position_sigma_m=table.position_sigma_m,
        rotation_period_s=table.rotation_period_s,
        interval_s=1.0 if table.interval_s is None else table.interval_s,
        range_min_m=table.range_min_m,
        earth_radius_factor=table.earth_radius_factor,
        range_max_m=float("inf") if table.range_max_m is None else table.range_max_m,
        elevation_max_rad=float("inf") if steepest is None else _rad(steepest),
        horizon=on_earth if table.horizon is None else table.horizon,
        detection_probability=table.detection_probability,
        outlier_probability=table.outlier_probability,
        height_probability=table.height_probability,
        garbled_height_probability=table.garbled_height_probability,
        garbled_probability=table.garbled_probability,
        clutter_per_turn=table.clutter_per_turn,
        clutter_bursts=tuple(
            ClutterBurst(one.start_s, one.end_s, one.plots_per_turn) for one in table.storm
        ),
        second_feed=_second_feed(table.second_feed),
        range_resolution_m=table.range_resolution_m,
        azimuth_resolution_rad=_rad(table.azimuth_resolution_deg),
        gaps_s=tuple(_span(one) for one in table.gaps_s),
        jammed_s=tuple(_span(one) for one in table.jammed_s),
        received=frozenset(table.reports),
        biases=_biases(table.bias),
        specified_biases=frozenset(
            kind for kind, name in enumerate(PARAMETER_NAMES) if getattr(table.bias, name)
        ),
        elevation_sigma_rad=_rad_or_none(table.elevation_sigma_deg),
        speed_mps=table.speed_mps,
        heading_rad=_rad(table.heading_deg),
        legs=_legs(table.leg),
        aircraft_data=None if table.aircraft_data is None else table.aircraft_data.reports(),
        secondary=table.secondary,
        transponder_delay_sigma_m=table.transponder_delay_sigma_m,
    )


def _second_feed(table: SecondFeedTable | None) -> SecondFeed | None:
    if table is None:
        return None
    return SecondFeed(
        table.share, table.time_step_s, table.range_step_m, _rad(table.azimuth_step_deg)
    )


def _biases(table: BiasesTable) -> tuple[Bias, ...]:
    found = []
    for kind, name in enumerate(PARAMETER_NAMES):
        one: BiasTable = getattr(table, name) or BiasTable()
        unit = PARAMETER_UNITS[kind]
        bias = Bias(
            one.value * unit, one.drift * unit, estimate=one.estimate, prior=one.prior * unit
        )
        if one.jump_s is not None:
            bias = replace(bias, jump=one.jump * unit, jump_s=one.jump_s)
        if one.prior_sigma is not None:
            bias = replace(bias, prior_sigma=one.prior_sigma * unit)
        if one.assumed_drift is not None:
            bias = replace(bias, assumed_drift=one.assumed_drift * unit)
        found.append(bias)
    return tuple(found)


def _coupled(table: CoupledTable | None) -> CoupledNoise | None:
    if table is None:
        return None
    return CoupledNoise(
        table.acceleration_sigma_mps2,
        _rad(table.course_rate_sigma_deg_per_s),
        _rad(table.climb_rate_sigma_deg_per_s),
        table.step_s,
    )


def _span(two: Sequence[float], unit: float = 1.0) -> tuple[float, float]:
    return two[0] * unit, two[1] * unit


def _rad_or_none(degrees: float | None) -> float | None:
    return None if degrees is None else _rad(degrees)


def _rad(degrees: float) -> float:
    return float(np.radians(degrees))
