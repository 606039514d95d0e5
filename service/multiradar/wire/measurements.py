"""Measurements from the wire format to the batch of the core, and back."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.errors import InputError, MissingColumnError
from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION, KIND_RADAR
from multiradar.estimation.measurement.known_biases import (
    Measured,
    reports_without_frames,
    without_known_biases,
)
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.refraction import straight_range
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.roster import MISSING
from multiradar.wire.aircraft_columns import aircraft_data_of, aircraft_data_rows
from multiradar.wire.bearing_columns import direction_rows, directions_of, with_movers
from multiradar.wire.long_tables import RANGE_MAX_FACTOR, Rejections, read_by_loops
from multiradar.wire.sensors import KIND_NUMBER
from multiradar_schemas.measurements.callsigns import callsign_texts, packed_callsigns
from multiradar_schemas.measurements.columns import (
    DETECTION,
    MEASUREMENT_REQUIRED,
    MEASUREMENT_SCHEMA,
    ON_GROUND,
    POSITION_SIGMA,
    complete,
)
from multiradar_schemas.measurements.directions import (
    filled_columns,
    has_column,
    has_directions,
    sensor_gates,
)
from multiradar_schemas.measurements.gates import (
    LISTED_ROWS_MAX,
    PHYSICAL_GATES,
    Gate,
    Lists,
    are_clear,
    rejections,
)
from multiradar_schemas.measurements.measurement import DETECTIONS, KINDS
from multiradar_schemas.reject import INSTRUMENTED_RANGE, RejectCode

_SENSOR = "__sensor"
_SENSOR_KIND = "__sensor_kind"
_RANGE_END = "__range_end_m"
_DISABLED = "__disabled"
_KIND = "__kind"


@dataclass(frozen=True, slots=True)
class Rejected:
    """The rejected rows, by ascending index.

    Attributes
    ----------
    index : (n,) int64
        Index of the row in the given frame.
    code : tuple of RejectCode
        Reason as a stable code.
    reason : tuple of str
        Reason as a sentence.
    """

    index: NDArray[np.int64]
    code: tuple[RejectCode, ...]
    reason: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.code)


def measurement_batch(frame: pl.DataFrame, table: SensorTable) -> tuple[MeasurementBatch, Rejected]:
    """Translate measurements and reject implausible rows.

    Parameters
    ----------
    frame : DataFrame
        Columns of `MEASUREMENT_SCHEMA`, degrees; optional ones may be missing, others are ignored.
    table : SensorTable
        The sensors.

    Returns
    -------
    MeasurementBatch
        The accepted rows in their order, in radians, corrected for known biases; numbers that the
        kind of a row does not use are missing.
    Rejected
        The rejected rows; accepted and rejected rows together are all rows of the frame.

    Raises
    ------
    MissingColumnError
        When a required column is absent.
    InputError
        When a column has another type than in `MEASUREMENT_SCHEMA`.
    """
    require_columns(frame)
    frame = complete(frame)
    directed = bool(table.moving.any()) or has_directions(frame)
    read = None if directed else read_by_loops(frame, table, lambda rows: _rejections(rows, table))
    if read is not None:
        return _batch(_without(frame, read.rejections[0]), read.arrays, table), Rejected(
            *read.rejections
        )
    listed = None if directed else _read_listed(frame, table)
    if listed is not None:
        return _batch(frame, listed, table), Rejected(np.empty(0, np.int64), (), ())
    frame = _with_sensors(frame, table)
    frame = with_movers(frame, table, _SENSOR) if directed else frame
    index, code, reason = rejections(frame, _DIRECTED_GATES if directed else _GATES)
    frame = _without(frame, index)
    # Writable copies, so that kernels are compiled for one type of array.
    sensor, kind = (frame[name].to_numpy(writable=True) for name in (_SENSOR, _KIND))
    return _batch(frame, _arrays(frame, sensor, kind), table), Rejected(index, code, reason)


def measurement_rows(batch: MeasurementBatch, table: SensorTable) -> list[dict[str, Any]]:
    """Translate measurements back, for display.

    Parameters
    ----------
    batch : MeasurementBatch
        Measurements as processed by the tracker: corrected for known biases.
    table : SensorTable
        The sensors.

    Returns
    -------
    list of dict
        Columns of `MEASUREMENT_SCHEMA` in degrees, without missing values.
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
        fields: dict[str, Any] = {
            "time_s": float(batch.time_s[row]),
            "sensor_id": table.ids[batch.sensor[row]],
        }
        fields |= {name: float(one[row]) for name, one in floats.items() if np.isfinite(one[row])}
        for name, form in texts.items():
            number = int(getattr(batch, name)[row])
            if number != MISSING:
                fields[name] = number if form == "d" else format(number, form)
        if callsigns[row] is not None:
            fields["callsign"] = callsigns[row]
        if batch.on_ground is not None and batch.on_ground[row] != MISSING:
            fields[ON_GROUND] = bool(batch.on_ground[row])
        if batch.position_sigma_m is not None and not np.isnan(batch.position_sigma_m[row]):
            fields[POSITION_SIGMA] = float(batch.position_sigma_m[row])
        if batch.detection is not None and batch.detection[row] != MISSING:
            fields[DETECTION] = DETECTIONS[batch.detection[row]]
        rows.append(fields | direction_rows(batch, row) | aircraft_data_rows(batch, row))
    return rows


def require_columns(frame: pl.DataFrame) -> None:
    """Check the columns of measurements, as `measurement_batch` does.

    Raises
    ------
    MissingColumnError, InputError
        As `measurement_batch`.
    """
    found = dict(zip(frame.columns, frame.dtypes, strict=True))
    missing = [name for name in MEASUREMENT_REQUIRED if name not in found]
    if missing:
        raise MissingColumnError("measurements", missing, frame.columns)
    for name, kind in MEASUREMENT_SCHEMA.items():
        # Simple types are equal if their classes are, which compares faster.
        if name in found and type(found[name]) not in (type(kind), pl.Null):
            msg = f"measurements: expected the column {name} to be {kind}, was {found[name]}"
            raise InputError(msg)


def _rejections(frame: pl.DataFrame, table: SensorTable) -> Rejections:
    return rejections(_with_sensors(frame, table), _GATES)


def _without(frame: pl.DataFrame, index: NDArray[np.int64]) -> pl.DataFrame:
    if not len(index):
        return frame
    keep = np.ones(len(frame), np.bool_)
    keep[index] = False
    return frame.filter(pl.Series(keep))


def _read_listed(frame: pl.DataFrame, table: SensorTable) -> dict[str, NDArray[Any]] | None:
    """Translate a short table, None if a row may be rejected."""
    if len(frame) > LISTED_ROWS_MAX:
        return None
    sensors = _sensor_numbers(table)
    sensor = [sensors.get(name) for name in frame["sensor_id"].to_list()]
    kind = [_KIND_NUMBERS.get(name) for name in frame["kind"].to_list()]
    if None in sensor or None in kind:
        return None
    index = np.array(sensor, np.int32)
    derived = {
        _SENSOR: sensor,
        _KIND: kind,
        _SENSOR_KIND: table.kinds[index].tolist(),
        _RANGE_END: (table.range_max_m[index] * RANGE_MAX_FACTOR).tolist(),
        _DISABLED: table.disabled[index].tolist(),
    }
    if not are_clear(frame, _GATES, derived):
        return None
    return _arrays(frame, index, np.array(kind, np.int8))


def _sensor_numbers(table: SensorTable) -> dict[str, int]:
    return {name: number for number, name in enumerate(table.ids)} | dict(table.aliases)


def _with_sensors(frame: pl.DataFrame, table: SensorTable) -> pl.DataFrame:
    index = _numbers(frame["sensor_id"], _sensor_numbers(table), pl.Int32())
    end_m = table.range_max_m * RANGE_MAX_FACTOR
    return frame.hstack(
        [
            index.alias(_SENSOR),
            _numbers(frame["kind"], _KIND_NUMBERS, pl.Int8()).alias(_KIND),
            _gathered(table.kinds, index).alias(_SENSOR_KIND),
            _gathered(end_m, index).alias(_RANGE_END),
            _gathered(table.disabled, index).alias(_DISABLED),
        ]
    )


def _gathered(values: NDArray[Any], index: pl.Series) -> pl.Series:
    if index.null_count():
        return pl.Series(values).gather(index)
    return pl.Series(values[index.to_numpy()])


def _numbers(names: pl.Series, numbers: Mapping[str, int], kind: pl.DataType) -> pl.Series:
    """Return the numbers of names, null for others."""
    if len(names) <= LISTED_ROWS_MAX:
        return pl.Series([numbers.get(name) for name in names.to_list()], dtype=kind)
    return names.replace_strict(
        pl.Series(list(numbers), dtype=pl.String), pl.Series(numbers.values(), dtype=kind),
        default=None, return_dtype=kind,
    )  # fmt: skip


_KIND_NUMBERS = {name: KIND_NUMBER[name] for name in KINDS}
_DETECTION_NUMBERS = {name: number for number, name in enumerate(DETECTIONS)}


def _fitting(kind: int | None, of_sensor: int | None) -> bool:
    # A radar without range, for example under jamming, still measures bearings.
    return (
        kind is None
        or of_sensor is None
        or kind == of_sensor
        or (kind == KIND_BEARING and of_sensor == KIND_RADAR)
    )


def _within_range(columns: Lists) -> bool:
    rows = zip(columns[_KIND], columns["range_m"], columns[_RANGE_END], strict=True)
    return not any(
        kind == KIND_RADAR and range_m is not None and end_m is not None and not range_m <= end_m
        for kind, range_m, end_m in rows
    )


_GATES = (
    *PHYSICAL_GATES,
    Gate(
        RejectCode.UNKNOWN_SENSOR,
        "sensor_id",
        "a sensor in the sensors file",
        pl.col(_SENSOR).is_null(),
        clear=lambda columns: None not in columns[_SENSOR],
    ),
    Gate(
        RejectCode.SENSOR_DISABLED,
        "sensor_id",
        "a sensor that is enabled",
        pl.col(_DISABLED),
        clear=lambda columns: True not in columns[_DISABLED],
    ),
    Gate(
        RejectCode.UNKNOWN_KIND,
        "kind",
        "a kind that the sensor measures",
        (pl.col(_KIND) != pl.col(_SENSOR_KIND))
        & ~((pl.col(_KIND) == KIND_BEARING) & (pl.col(_SENSOR_KIND) == KIND_RADAR)),
        clear=lambda columns: all(map(_fitting, columns[_KIND], columns[_SENSOR_KIND])),
    ),
    Gate(
        RejectCode.OUT_OF_RANGE,
        "range_m",
        INSTRUMENTED_RANGE,
        (pl.col(_KIND) == KIND_RADAR) & (pl.col("range_m") > pl.col(_RANGE_END)),
        clear=_within_range,
    ),
)


def _ground_status(frame: pl.DataFrame) -> NDArray[np.int8] | None:
    if not has_column(frame, ON_GROUND):
        return None
    return frame[ON_GROUND].cast(pl.Int8).fill_null(MISSING).to_numpy(writable=True)


def _accuracy(frame: pl.DataFrame, kind: NDArray[np.int8]) -> NDArray[np.float64] | None:
    """Return the accuracy of reported positions, NaN for other kinds."""
    if not has_column(frame, POSITION_SIGMA):
        return None
    values = np.where(kind == KIND_POSITION, frame[POSITION_SIGMA].to_numpy(), np.nan)
    return values if not np.isnan(values).all() else None


def _detections(frame: pl.DataFrame) -> NDArray[np.int8] | None:
    if not has_column(frame, DETECTION):
        return None
    column = _numbers(frame[DETECTION], _DETECTION_NUMBERS, pl.Int8())
    if column.null_count():
        column = column.fill_null(MISSING)
    return column.to_numpy(writable=True)


_DIRECTED_GATES = (*_GATES, *sensor_gates())


def _floats(
    frame: pl.DataFrame, name: str, used: NDArray[np.bool_] | None = None
) -> NDArray[np.float64]:
    """Return numbers, NaN where there are none or they are not used."""
    values = frame[name].to_numpy()
    # Normalise -0.0 to 0.0: rows are compared by content.
    found: NDArray[np.float64] = (values if used is None else np.where(used, values, np.nan)) + 0.0
    return found


def _digits(texts: pl.Series, base: int, kind: type[np.signedinteger[Any]]) -> NDArray[Any]:
    """Return texts of digits as integers, `MISSING` where there are none."""
    if texts.null_count() == len(texts):
        return np.full(len(texts), MISSING, kind)
    if len(texts) <= LISTED_ROWS_MAX:
        listed = texts.to_list()
        return np.array([MISSING if one is None else int(one, base) for one in listed], kind)
    return _filled(texts.str.to_integer(base=base, dtype=pl.Int64)).astype(kind, copy=False)


def _filled(numbers: pl.Series) -> NDArray[np.int64]:
    """Return integers, `MISSING` where there are none."""
    if numbers.null_count() == len(numbers):
        return np.full(len(numbers), MISSING, np.int64)
    return numbers.fill_null(MISSING).to_numpy(writable=True)


def _arrays(
    frame: pl.DataFrame, sensor: NDArray[np.int32], kind: NDArray[np.int8]
) -> dict[str, NDArray[Any]]:
    position = kind == KIND_POSITION
    return {
        "time_s": _floats(frame, "time_s"),
        "sensor": sensor,
        "kind": kind,
        "range_m": _floats(frame, "range_m", kind == KIND_RADAR),
        "azimuth_rad": np.radians(_floats(frame, "azimuth_deg", ~position)),
        "latitude_rad": np.radians(_floats(frame, "latitude_deg", position)),
        "longitude_rad": np.radians(_floats(frame, "longitude_deg", position)),
        "height_m": _floats(frame, "height_m"),
        "mode_3a": _digits(frame["mode_3a"], 8, np.int32),
        "mode_s_address": _digits(frame["mode_s_address"], 16, np.int64),
        "track_number": _filled(frame["track_number"]),
        "callsign": packed_callsigns(frame["callsign"]),
    }


def _batch(frame: pl.DataFrame, arrays: dict[str, Any], table: SensorTable) -> MeasurementBatch:
    if table.known_bias.any():
        measured = Measured(arrays["time_s"], arrays["range_m"], arrays["azimuth_rad"])
        arrays |= without_known_biases(measured, table.known_bias[arrays["sensor"]])._asdict()
        reported = arrays["latitude_rad"], arrays["longitude_rad"]
        arrays["latitude_rad"], arrays["longitude_rad"] = reports_without_frames(
            *reported, arrays["sensor"], table, table.known_bias
        )
    if np.isfinite(table.earth_radius_factor).any():
        site_m, factor = (
            of_each[arrays["sensor"]] for of_each in (table.height_m, table.earth_radius_factor)
        )
        arrays["range_m"] = straight_range(
            arrays["range_m"], arrays["height_m"], np.nan_to_num(site_m), factor
        )
    if not filled_columns(frame):
        return MeasurementBatch(**arrays)
    return MeasurementBatch(
        directions=directions_of(frame),
        on_ground=_ground_status(frame),
        position_sigma_m=_accuracy(frame, arrays["kind"]),
        detection=_detections(frame),
        aircraft_data=aircraft_data_of(frame),
        **arrays,
    )
