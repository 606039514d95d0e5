"""What the sensors need to have before an engine can use them."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from multiradar.errors import ConfigurationError, OutsidePlaneError
from multiradar.estimation.filters.bank import FilterDefinition, find_filter_for
from multiradar.estimation.measurement.sensors import PARAMETER_TIME_OFFSET, SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.admission.sensors_in_force import SensorPlan, SensorsInForce
from multiradar.tracking.settings import TrackingSettings


def plane_for(sensors: SensorTable) -> SystemPlane:
    """Return the system plane of sensors.

    Raises
    ------
    ConfigurationError
        If none of them has a position.
    """
    if np.isnan(sensors.latitude_rad).all():
        raise ConfigurationError(
            "no sensor has a position; set latitude_deg and longitude_deg of at least one in the "
            "sensors file (for ADS-B alone, the centre of the area)"
        )
    return SystemPlane.for_sensors(sensors.latitude_rad, sensors.longitude_rad)


def require_usable(
    sensors: SensorTable, tracking: TrackingSettings, plane: SystemPlane
) -> FilterDefinition:
    """Return the filter of the settings, if it can use sensors.

    Raises
    ------
    ConfigurationError
        If it cannot estimate their biases, their clocks do not fit the reorder horizon, or one of
        them is beyond the system plane.
    UnknownFilterError
        If the filter of the settings does not exist.
    """
    require_clocks_within(sensors, tracking.reorder_horizon_s)
    for name, *position in zip(
        sensors.ids, sensors.latitude_rad, sensors.longitude_rad, strict=True
    ):
        if np.isfinite(position).all():
            try:
                plane.to_plane(*position)
            except OutsidePlaneError as error:
                raise ConfigurationError(f"sensor {name}: {error}") from error
    return find_filter_for(
        tracking.filter_name, sensors.parameter_kind, delays=bool(sensors.delayed.any())
    )


def usability(
    first: SensorTable, tracking: TrackingSettings
) -> Callable[[SensorTable], FilterDefinition]:
    """Return `require_usable` for later sensors, in the plane of the first ones."""
    return lambda sensors: require_usable(sensors, tracking, plane_for(first))


def plan_usable(
    present: SensorsInForce,
    require: Callable[[SensorTable], object],
    sensor_id: str,
    values: Mapping[str, Any],
    *,
    reset: bool,
) -> SensorPlan:
    """Return what a change of a sensor would do, if the filter can use the sensors after it.

    Parameters
    ----------
    present : SensorsInForce
        The sensors before it.
    require : callable
        Raises an error if the filter cannot use sensors; see `usability`.
    sensor_id, values, reset
        See `SensorsInForce.plan`.

    Raises
    ------
    ConfigurationError
        As `SensorsInForce.plan` and `require_usable`.
    """
    plan = present.plan(sensor_id, values, reset_biases=reset)
    if plan.change:
        changed, _ = present.changed(plan.change)
        require(changed.table)
    return plan


def require_clocks_within(sensors: SensorTable, horizon_s: float) -> None:
    """Check the clocks of sensors against the reorder horizon, s.

    Raises
    ------
    ConfigurationError
        If it is shorter than the time between two of them, or than a tolerance.
    """
    # Time stamps are corrected before measurements are reordered.
    apart_s = float(np.ptp(sensors.known_bias[:, PARAMETER_TIME_OFFSET]))
    if apart_s > horizon_s:
        raise ConfigurationError(
            f"reorder_horizon_s: expected at least {apart_s:g} s, the spread of the known sensor "
            f"time offsets, was {horizon_s:g}"
        )
    for sensor, tolerance_s in zip(sensors.ids, sensors.clock_tolerance_s.tolist(), strict=True):
        if tolerance_s > horizon_s:
            raise ConfigurationError(
                f"sensor {sensor}: clock_tolerance_s: expected at most the reorder horizon, "
                f"{horizon_s:g} s, was {tolerance_s:g}; a larger tolerance would make the "
                f"measurements of other sensors late"
            )
