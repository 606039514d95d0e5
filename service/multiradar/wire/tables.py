"""Output of the core as tables: tracks, transitions, biases, health of sensors."""

from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, SensorTable
from multiradar.tracking.health.health_records import ALARM_NAMES, HealthRecords
from multiradar.tracking.lifecycle.transitions import (
    REASON_NAMES,
    TRANSITION_NAMES,
    TrackTransitions,
)
from multiradar.tracking.outputs import (
    STATE_NAMES,
    BiasRecords,
    DelayRecords,
    TrackUpdates,
)
from multiradar.wire.identity_texts import addresses, codes, present
from multiradar.wire.sensors import parameter_unit
from multiradar_schemas.measurements.callsigns import callsign_texts
from multiradar_schemas.products.aircraft_delay import AIRCRAFT_DELAY_SCHEMA
from multiradar_schemas.products.bias import BIAS_SCHEMA
from multiradar_schemas.products.health import HEALTH_SCHEMA
from multiradar_schemas.products.track import TRACK_SCHEMA
from multiradar_schemas.products.transition import TRANSITION_SCHEMA

TURN_DEG = 360.0
HOUR_S = 3600.0


def tracks_frame(updates: TrackUpdates, table: SensorTable) -> pl.DataFrame:
    """Translate updates of tracks to rows of `tracks.parquet`.

    Parameters
    ----------
    updates : TrackUpdates
        Updates, radians.
    table : SensorTable
        The sensors that measured.

    Returns
    -------
    DataFrame
        `TRACK_SCHEMA`, degrees; missing values are null.
    """
    heading_deg = np.degrees(updates.heading_rad) % TURN_DEG
    heading_deg[heading_deg >= TURN_DEG] = 0.0  # A tiny negative angle rounds up to 360°.
    return _frame(
        TRACK_SCHEMA,
        updates,
        track_number=present(updates.track_number),
        mode_s_address=addresses(updates.mode_s_address),
        measured_mode_s_address=addresses(updates.measured_mode_s_address),
        mode_3a=codes(updates.mode_3a),
        callsign=callsign_texts(updates.callsign),
        latitude_deg=np.degrees(updates.latitude_rad),
        longitude_deg=np.degrees(updates.longitude_rad),
        heading_deg=heading_deg,
        state=_names(updates.state, STATE_NAMES),
        sensor_id=_names(updates.sensor, table.ids),
        on_ground=_statuses(updates.on_ground),
    )


def transitions_frame(transitions: TrackTransitions) -> pl.DataFrame:
    """Translate transitions of tracks to rows of `transitions.parquet`.

    Returns
    -------
    DataFrame
        `TRANSITION_SCHEMA`; missing values are null.
    """
    return _frame(
        TRANSITION_SCHEMA,
        transitions,
        transition=_names(transitions.transition, TRANSITION_NAMES),
        reason=_names(transitions.reason, REASON_NAMES),
        into_track_id=present(transitions.into_track_id),
    )


def biases_frame(records: BiasRecords, table: SensorTable) -> pl.DataFrame:
    """Translate bias estimates to rows of `biases.parquet`.

    Parameters
    ----------
    records : BiasRecords
        Estimates, azimuth in radians.
    table : SensorTable
        The sensors.

    Returns
    -------
    DataFrame
        `BIAS_SCHEMA`; azimuth in degrees.
    """
    unit = np.array([parameter_unit(name) for name in PARAMETER_NAMES])[records.parameter]
    return _frame(
        BIAS_SCHEMA,
        records,
        sensor_id=_names(records.sensor, table.ids),
        parameter=_names(records.parameter, PARAMETER_NAMES),
        estimate=records.estimate / unit,
        sigma=records.sigma / unit,
        prior_ratio=records.sigma / _prior_sigma(table)[records.sensor, records.parameter],
    )


def delays_frame(records: DelayRecords, table: SensorTable) -> pl.DataFrame:
    """Translate delays of transponders to rows of `aircraft_delays.parquet`.

    Returns
    -------
    DataFrame
        `AIRCRAFT_DELAY_SCHEMA`; missing values are null.
    """
    return _frame(
        AIRCRAFT_DELAY_SCHEMA,
        records,
        track_number=present(records.track_number),
        mode_s_address=addresses(records.mode_s_address),
        prior_ratio=records.sigma_m / table.delay_sigma_m,
    )


def health_frame(records: HealthRecords, table: SensorTable) -> pl.DataFrame:
    """Translate the health of radars to rows of `health.parquet`.

    Parameters
    ----------
    records : HealthRecords
        In m and rad, trends per second.
    table : SensorTable
        The sensors.

    Returns
    -------
    DataFrame
        `HEALTH_SCHEMA`; azimuth in degrees, trends per hour.
    """
    alarms = [",".join(alarm_names(bits)) for bits in records.alarms.tolist()]
    trend_deg_per_s = np.degrees(records.azimuth_trend_rad_per_s)
    trend_sigma_deg_per_s = np.degrees(records.azimuth_trend_sigma_rad_per_s)
    return _frame(
        HEALTH_SCHEMA,
        records,
        sensor_id=_names(records.sensor, table.ids),
        alarms=pl.Series(alarms, dtype=pl.String),
        range_trend_m_per_h=HOUR_S * records.range_trend_mps,
        range_trend_sigma_m_per_h=HOUR_S * records.range_trend_sigma_mps,
        azimuth_trend_deg_per_h=HOUR_S * trend_deg_per_s,
        azimuth_trend_sigma_deg_per_h=HOUR_S * trend_sigma_deg_per_s,
        bias_jumps=records.jumps,
    )


def alarm_names(bits: int) -> list[str]:
    """Return the names of the alarms that are set in `HealthRecords.alarms`."""
    return [name for bit, name in enumerate(ALARM_NAMES) if bits >> bit & 1]


def _prior_sigma(table: SensorTable) -> NDArray[np.float64]:
    # By sensor and kind of parameter; NaN where a sensor does not have one.
    sigma = np.full((len(table), len(PARAMETER_NAMES)), np.nan)
    sigma[table.parameter_sensor, table.parameter_kind] = table.prior_sigma
    return sigma


def _statuses(numbers: NDArray[np.int8]) -> pl.Series:
    return pl.Series(numbers == 1).set(pl.Series(numbers < 0), None)


def _names(numbers: NDArray[np.integer], names: tuple[str, ...]) -> pl.Series:
    return pl.Series(names, dtype=pl.String).gather(pl.Series(numbers))


def _frame(
    schema: pl.Schema, records: object, **translated: pl.Series | NDArray[Any]
) -> pl.DataFrame:
    # Other columns have the same name and unit in the core; NaN is null. Of arrays, polars would
    # make series in threads that it starts for each table with more than 1000 rows.
    columns = {
        name: translated[name] if name in translated else getattr(records, name) for name in schema
    }
    series = {
        name: one if isinstance(one, pl.Series) else pl.Series(name, one, nan_to_null=True)
        for name, one in columns.items()
    }
    return pl.DataFrame(series, schema=schema)
