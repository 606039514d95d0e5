"""What the core says as tables: tracks, steps in their lives, biases, health of sensors."""

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, SensorTable
from multiradar.tracking.health.health_records import ALARM_NAMES, HealthRecords
from multiradar.tracking.lifecycle.transitions import NO_TRACK, REASON_NAMES, TRANSITION_NAMES
from multiradar.tracking.outputs import (
    STATE_NAMES,
    BiasRecords,
    TrackTransitions,
    TrackUpdates,
)
from multiradar.wire.identity_texts import addresses, codes, present
from multiradar.wire.sensors import parameter_unit
from multiradar_schemas.measurements.callsigns import callsign_texts
from multiradar_schemas.products.bias import BIAS_SCHEMA
from multiradar_schemas.products.health import HEALTH_SCHEMA
from multiradar_schemas.products.track import TRACK_SCHEMA
from multiradar_schemas.products.transition import TRANSITION_SCHEMA

TURN_DEG = 360.0
HOUR_S = 3600.0
_CHANCES = ("turn_right_probability", "turn_left_probability", "speed_change_probability")
_VERTICAL = ("vertical_rate_mps", "height_sigma_m")


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
        `TRACK_SCHEMA`, degrees; what is missing is null.
    """
    heading_deg = np.degrees(updates.heading_rad) % TURN_DEG
    heading_deg[heading_deg >= TURN_DEG] = 0.0  # A tiny negative angle rounds up to a whole turn.
    raw = pl.DataFrame(
        {
            "time_s": updates.time_s,
            "track_id": updates.track_id,
            "track_number": updates.track_number,
            "mode_s_address": updates.mode_s_address,
            "mode_3a": updates.mode_3a,
            "latitude_deg": np.degrees(updates.latitude_rad),
            "longitude_deg": np.degrees(updates.longitude_rad),
            "height_m": updates.height_m,
            "speed_mps": updates.speed_mps,
            "heading_deg": heading_deg,
            "position_sigma_m": updates.position_sigma_m,
            "state": _names(updates.state, STATE_NAMES),
            "sequence": updates.sequence,
            "sensor_id": _names(updates.sensor, table.ids),
            "velocity_sigma_mps": updates.velocity_sigma_mps,
            **{name: getattr(updates, name) for name in (*_CHANCES, *_VERTICAL)},
            "adsb_implausible": updates.adsb_implausible,
            "callsign": callsign_texts(updates.callsign),
        }
    )
    return raw.with_columns(
        present(updates.track_number).alias("track_number"),
        addresses(updates.mode_s_address).alias("mode_s_address"),
        codes(updates.mode_3a).alias("mode_3a"),
        pl.col("height_m", *_CHANCES, *_VERTICAL).fill_nan(None),
    ).select(pl.col(name).cast(kind) for name, kind in TRACK_SCHEMA.items())


def transitions_frame(transitions: TrackTransitions) -> pl.DataFrame:
    """Translate steps in the lives of tracks to rows of `transitions.parquet`.

    Parameters
    ----------
    transitions : TrackTransitions
        The steps.

    Returns
    -------
    DataFrame
        `TRANSITION_SCHEMA`; what is missing is null.
    """
    frame = pl.DataFrame(
        {
            "time_s": transitions.time_s,
            "track_id": transitions.track_id,
            "transition": _names(transitions.transition, TRANSITION_NAMES),
            "reason": _names(transitions.reason, REASON_NAMES),
            "into_track_id": transitions.into_track_id,
            "last_update_s": pl.Series(transitions.last_update_s, nan_to_null=True),
        },
        schema=TRANSITION_SCHEMA,
    )
    into = pl.col("into_track_id")
    return frame.with_columns(pl.when(into != NO_TRACK).then(into).alias("into_track_id"))


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
    return pl.DataFrame(
        {
            "time_s": records.time_s,
            "sensor_id": _names(records.sensor, table.ids),
            "parameter": _names(records.parameter, PARAMETER_NAMES),
            "estimate": records.estimate / unit,
            "sigma": records.sigma / unit,
            "epoch": records.epoch,
            "prior_ratio": records.sigma / _prior_sigma(table)[records.sensor, records.parameter],
        },
        schema=BIAS_SCHEMA,
    )


def health_frame(records: HealthRecords, table: SensorTable) -> pl.DataFrame:
    """Translate what is said of the health of radars to rows of `health.parquet`.

    Parameters
    ----------
    records : HealthRecords
        In m and rad, changes a second.
    table : SensorTable
        The sensors.

    Returns
    -------
    DataFrame
        `HEALTH_SCHEMA`; azimuth in degrees, changes an hour.
    """
    same = ("time_s", "epoch", "detection_probability", "looks", "range_sigma_ratio",
            "azimuth_sigma_ratio", "site_east_m", "site_north_m", "site_sigma_m", "silence_s",
            "tracks_in_cover", "tracks_heard", "last_jump_s")  # fmt: skip
    trends = {
        "range_trend_m_per_h": records.range_trend_mps,
        "range_trend_sigma_m_per_h": records.range_trend_sigma_mps,
        "azimuth_trend_deg_per_h": np.degrees(records.azimuth_trend_rad_per_s),
        "azimuth_trend_sigma_deg_per_h": np.degrees(records.azimuth_trend_sigma_rad_per_s),
    }
    columns = {
        **{name: getattr(records, name) for name in same},
        **{name: HOUR_S * values for name, values in trends.items()},
        "sensor_id": _names(records.sensor, table.ids),
        "bias_jumps": records.jumps,
        "alarms": [",".join(alarm_names(bits)) for bits in records.alarms.tolist()],
    }
    return pl.DataFrame(
        {name: columns[name] for name in HEALTH_SCHEMA}, schema=HEALTH_SCHEMA, nan_to_null=True
    )


def alarm_names(bits: int) -> list[str]:
    """Return the names of the alarms that are set in `HealthRecords.alarms`."""
    return [name for place, name in enumerate(ALARM_NAMES) if bits >> place & 1]


def _prior_sigma(table: SensorTable) -> NDArray[np.float64]:
    # By sensor and kind of parameter; NaN where a sensor does not have one.
    sigma = np.full((len(table), len(PARAMETER_NAMES)), np.nan)
    sigma[table.parameter_sensor, table.parameter_kind] = table.prior_sigma
    return sigma


def _names(numbers: NDArray[np.integer], names: tuple[str, ...]) -> pl.Series:
    return pl.Series(names, dtype=pl.String).gather(pl.Series(numbers))
