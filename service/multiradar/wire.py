"""The only translation between the forms on the wire and the arrays of the core."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.bearing_columns import direction_rows, directions_of, with_movers
from multiradar.errors import InputError, MissingColumnError
from multiradar.estimation.measurement.known_biases import Measured, without_known_biases
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, SensorTable
from multiradar.identity_texts import addresses, codes, present
from multiradar.tracking.health_records import ALARM_NAMES, HealthRecords
from multiradar.tracking.measurements import (
    KIND_BEARING,
    KIND_POSITION,
    KIND_RADAR,
    MISSING_INTEGER,
    MeasurementBatch,
)
from multiradar.tracking.outputs import (
    STATE_NAMES,
    BiasRecords,
    TrackTransitions,
    TrackUpdates,
)
from multiradar.tracking.transitions import NO_TRACK, REASON_NAMES, TRANSITION_NAMES
from multiradar_schemas.arrow import (
    BIAS_SCHEMA,
    HEALTH_SCHEMA,
    MEASUREMENT_REQUIRED,
    MEASUREMENT_SCHEMA,
    TRACK_SCHEMA,
    TRANSITION_SCHEMA,
)
from multiradar_schemas.callsigns import callsign_texts, packed_callsigns
from multiradar_schemas.directions import has_directions, sensor_gates
from multiradar_schemas.gates import PHYSICAL_GATES, Gate, refusals
from multiradar_schemas.measurement import KINDS
from multiradar_schemas.reject import RejectCode
from multiradar_schemas.sensor import Sensor, SensorsFile

#: A range may exceed the instrumented range of its sensor by this factor.
RANGE_MAX_FACTOR = 1.05
TURN_DEG = 360.0
HOUR_S = 3600.0

_KIND_NUMBER = {
    "radar": KIND_RADAR,
    "adsb": KIND_POSITION,
    "mlat": KIND_POSITION,
    "bearing": KIND_BEARING,
    "direction-finder": KIND_BEARING,
}
_SENSOR = "__sensor"
_SENSOR_KIND = "__sensor_kind"
_RANGE_END = "__range_end_m"
_KIND = "__kind"
_CHANCES = ("turn_right_probability", "turn_left_probability", "speed_change_probability")
_VERTICAL = ("vertical_rate_mps", "height_sigma_m")


@dataclass(frozen=True, slots=True)
class Rejected:
    """The rows that were refused, by ascending index.

    Attributes
    ----------
    index : (n,) int64
        Index of the row in the frame that was given.
    code : tuple of RejectCode
        Why, as a stable code.
    reason : tuple of str
        Why, as a sentence.
    """

    index: NDArray[np.int64]
    code: tuple[RejectCode, ...]
    reason: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.code)


def sensor_table(sensors: SensorsFile) -> SensorTable:
    """Translate a sensors file.

    Parameters
    ----------
    sensors : SensorsFile
        The sensors in the order of the file, angles in degrees.

    Returns
    -------
    SensorTable
        The sensors sorted by identifier, angles in radians, the bias parameters to estimate, and
        the biases that are known.
    """
    ordered = sorted(sensors.sensor, key=lambda sensor: sensor.id)
    biases = [(row, bias) for row, one in enumerate(ordered) for bias in one.estimated_biases()]
    kinds = np.array([PARAMETER_NAMES.index(bias.parameter) for _, bias in biases], np.int8)
    unit = np.array([_parameter_unit(bias.parameter) for _, bias in biases], np.float64)
    return SensorTable(
        ids=tuple(one.id for one in ordered),
        kinds=np.array([_KIND_NUMBER[one.kind] for one in ordered], np.int8),
        latitude_rad=np.radians(_numbers([one.latitude_deg for one in ordered])),
        longitude_rad=np.radians(_numbers([one.longitude_deg for one in ordered])),
        height_m=_numbers([one.height_m for one in ordered]),
        range_sigma_m=_numbers([one.range_sigma_m for one in ordered]),
        azimuth_sigma_rad=np.radians(_numbers([one.azimuth_sigma_deg for one in ordered])),
        position_sigma_m=_numbers([one.position_sigma_m for one in ordered]),
        range_max_m=_numbers([one.range_max_m for one in ordered], np.inf),
        rotation_period_s=_numbers([one.rotation_period_s for one in ordered]),
        parameter_sensor=np.array([row for row, _ in biases], np.int32),
        parameter_kind=kinds,
        prior_mean=np.array([bias.prior for _, bias in biases], np.float64) * unit,
        prior_sigma=np.array([bias.prior_sigma for _, bias in biases], np.float64) * unit,
        drift=np.array([bias.drift for _, bias in biases], np.float64) * unit,
        aliases=tuple(
            (name, row)
            for row, one in enumerate(ordered)
            for name in dict.fromkeys((*one.names_by_numbers(), *one.also))
            if name != one.id
        ),
        known_bias=np.array(
            [
                [known.get(name, 0.0) * _parameter_unit(name) for name in PARAMETER_NAMES]
                for known in (one.known_biases() for one in ordered)
            ]
        ),
        self_reported=np.array([one.kind == "adsb" for one in ordered], np.bool_),
        asterix_codes=tuple(_asterix_code(one) for one in ordered),
        moving=np.array([one.moving for one in ordered], np.bool_),
        elevation_sigma_rad=np.radians(_numbers([one.elevation_sigma_deg for one in ordered])),
    )


def measurement_batch(frame: pl.DataFrame, table: SensorTable) -> tuple[MeasurementBatch, Rejected]:
    """Translate measurements, refusing the rows that cannot be true.

    Parameters
    ----------
    frame : DataFrame
        Columns of `MEASUREMENT_SCHEMA`, optional ones may be missing, further ones are ignored;
        degrees.
    table : SensorTable
        The sensors that may measure.

    Returns
    -------
    MeasurementBatch
        The rows taken, in their order, radians, known biases of their sensors taken off; numbers
        that the kind of a row does not use are missing.
    Rejected
        The rows refused; together with the rows taken they are all rows of the frame.

    Raises
    ------
    MissingColumnError
        When a column that every row needs is absent.
    InputError
        When a column has another type than `MEASUREMENT_SCHEMA` gives it.
    """
    frame = _known_columns(frame)
    frame = _with_sensors(frame, table)
    directed = table.moving.any() or has_directions(frame)
    frame = with_movers(frame, table, _SENSOR) if directed else frame
    index, code, reason = refusals(frame, _DIRECTED_GATES if directed else _GATES)
    if len(index):
        keep = np.ones(len(frame), np.bool_)
        keep[index] = False
        frame = frame.filter(pl.Series(keep))
    return _columns(frame, table), Rejected(index, code, reason)


def measurement_rows(batch: MeasurementBatch, table: SensorTable) -> list[dict[str, Any]]:
    """Translate measurements back, to show them.

    Parameters
    ----------
    batch : MeasurementBatch
        Measurements as the tracker takes them: known biases are off.
    table : SensorTable
        The sensors.

    Returns
    -------
    list of dict
        Columns of `MEASUREMENT_SCHEMA` in degrees, without what is missing.
    """
    floats = {
        "range_m": batch.range_m,
        "azimuth_deg": np.degrees(batch.azimuth_rad),
        "latitude_deg": np.degrees(batch.latitude_rad),
        "longitude_deg": np.degrees(batch.longitude_rad),
        "height_m": batch.height_m,
    }
    texts = {"mode_3a": "04o", "mode_s_address": "06x", "track_number": "d"}
    callsigns = callsign_texts(batch.callsign)
    rows: list[dict[str, Any]] = []
    for row in range(len(batch)):
        said: dict[str, Any] = {
            "time_s": float(batch.time_s[row]),
            "sensor_id": table.ids[batch.sensor[row]],
        }
        said |= {name: float(one[row]) for name, one in floats.items() if np.isfinite(one[row])}
        for name, form in texts.items():
            number = int(getattr(batch, name)[row])
            if number != MISSING_INTEGER:
                said[name] = number if form == "d" else format(number, form)
        if callsigns[row] is not None:
            said["callsign"] = callsigns[row]
        rows.append(said | direction_rows(batch, row))
    return rows


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
    unit = np.array([_parameter_unit(name) for name in PARAMETER_NAMES])[records.parameter]
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


def _known_columns(frame: pl.DataFrame) -> pl.DataFrame:
    missing = [name for name in MEASUREMENT_REQUIRED if name not in frame.columns]
    if missing:
        raise MissingColumnError("measurements", missing, frame.columns)
    for name, kind in MEASUREMENT_SCHEMA.items():
        found = frame.schema.get(name, kind)
        if found not in (kind, pl.Null()):
            msg = f"measurements: expected the column {name} to be {kind}, was {found}"
            raise InputError(msg)
    return frame.select(
        pl.col(name).cast(kind) if name in frame.columns else pl.lit(None, kind).alias(name)
        for name, kind in MEASUREMENT_SCHEMA.items()
    )


def _with_sensors(frame: pl.DataFrame, table: SensorTable) -> pl.DataFrame:
    aliases = [name for name, _ in table.aliases]
    number = np.array([*range(len(table)), *(row for _, row in table.aliases)], np.int32)
    names = pl.Series([*table.ids, *aliases], dtype=pl.String)
    end_m = pl.Series(table.range_max_m * RANGE_MAX_FACTOR)
    sensor = pl.col("sensor_id").replace_strict(
        names, pl.Series(number), default=None, return_dtype=pl.Int32
    )
    kinds = pl.Series(KINDS, dtype=pl.String)
    kind_numbers = pl.Series([_KIND_NUMBER[name] for name in KINDS], dtype=pl.Int8)
    frame = frame.with_columns(
        sensor.alias(_SENSOR),
        pl.col("kind")
        .replace_strict(kinds, kind_numbers, default=None, return_dtype=pl.Int8)
        .alias(_KIND),
    )
    index = frame[_SENSOR]
    return frame.with_columns(
        pl.Series(table.kinds).gather(index).alias(_SENSOR_KIND),
        end_m.gather(index).alias(_RANGE_END),
    )


_GATES = (
    *PHYSICAL_GATES,
    Gate(
        RejectCode.UNKNOWN_SENSOR,
        "sensor_id",
        "a sensor of the sensors file",
        pl.col(_SENSOR).is_null(),
    ),
    Gate(
        RejectCode.UNKNOWN_KIND,
        "kind",
        "a kind that its sensor measures",
        # A radar that has lost the range, such as by jamming, still has bearings.
        (pl.col(_KIND) != pl.col(_SENSOR_KIND))
        & ~((pl.col(_KIND) == KIND_BEARING) & (pl.col(_SENSOR_KIND) == KIND_RADAR)),
    ),
    Gate(
        RejectCode.OUT_OF_RANGE,
        "range_m",
        "a range within the instrumented range of its sensor",
        (pl.col(_KIND) == KIND_RADAR) & (pl.col("range_m") > pl.col(_RANGE_END)),
    ),
)


_DIRECTED_GATES = (*_GATES, *sensor_gates())


def _columns(frame: pl.DataFrame, table: SensorTable) -> MeasurementBatch:
    radar = pl.col(_KIND) == KIND_RADAR
    position = pl.col(_KIND) == KIND_POSITION
    columns = frame.select(
        "time_s",
        pl.col(_SENSOR).alias("sensor"),
        pl.col(_KIND).alias("kind"),
        pl.when(radar).then("range_m").fill_null(np.nan).alias("range_m"),
        pl.when(~position).then("azimuth_deg").fill_null(np.nan).alias("azimuth_deg"),
        pl.when(position).then("latitude_deg").fill_null(np.nan).alias("latitude_deg"),
        pl.when(position).then("longitude_deg").fill_null(np.nan).alias("longitude_deg"),
        pl.col("height_m").fill_null(np.nan),
        pl.col("mode_3a").str.to_integer(base=8, dtype=pl.Int32).fill_null(MISSING_INTEGER),
        pl.col("mode_s_address").str.to_integer(base=16, dtype=pl.Int64).fill_null(MISSING_INTEGER),
        pl.col("track_number").fill_null(MISSING_INTEGER),
    )
    # Owned by the batch, so that a kernel sees one type of array whatever the frame was made of.
    arrays = {column.name: column.to_numpy(writable=True) for column in columns}
    for array in arrays.values():
        if array.dtype.kind == "f":
            array += 0.0  # Minus zero is zero: rows are ordered and compared by content.
    arrays["azimuth_rad"] = np.radians(arrays.pop("azimuth_deg"))
    if table.known_bias.any():
        measured = Measured(arrays["time_s"], arrays["range_m"], arrays["azimuth_rad"])
        arrays |= without_known_biases(measured, table.known_bias[arrays["sensor"]])._asdict()
    return MeasurementBatch(
        latitude_rad=np.radians(arrays.pop("latitude_deg")),
        longitude_rad=np.radians(arrays.pop("longitude_deg")),
        callsign=packed_callsigns(frame["callsign"]),
        directions=directions_of(frame),
        **arrays,
    )


def _names(numbers: NDArray[np.integer], names: tuple[str, ...]) -> pl.Series:
    return pl.Series(names, dtype=pl.String).gather(pl.Series(numbers))


def _numbers(values: Sequence[float | None], missing: float = np.nan) -> NDArray[np.float64]:
    return np.array([missing if value is None else value for value in values], np.float64)


def _asterix_code(sensor: Sensor) -> int:
    """Return area code times 256 and identification code; of a dump's numbers where these fit."""
    pairs = [(sensor.sac, sensor.sic), (sensor.source, sensor.sensor)]
    if match := re.fullmatch(r"(\d{1,3})-(\d{1,3})", sensor.id):
        pairs.append((int(match[1]), int(match[2])))
    for area, own in pairs:
        if area is not None and own is not None and max(area, own) <= 255:
            return area << 8 | own
    return -1


def _parameter_unit(parameter: str) -> float:
    return float(np.radians(1.0)) if parameter == "azimuth_offset_deg" else 1.0
