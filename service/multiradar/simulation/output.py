"""Output tables of a simulation: measurements, truth and true biases."""

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_NAMES,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_UNITS,
)
from multiradar.simulation.observation.measurements import NO_AIRCRAFT
from multiradar.simulation.observation.observe import Observation
from multiradar.simulation.scenario.model import SITED, Aircraft, ReceivedField, Scenario, Sensor
from multiradar_converters.aircraft_data.checking import checked
from multiradar_converters.aircraft_data.quantities import named_columns, without
from multiradar_converters.aircraft_data.registers import register_values
from multiradar_converters.asterix.aircraft_reports import Screened, screened
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.measurements.directions import without_empty_columns

#: `truth.parquet`: row i is the truth of row i of `measurements.parquet`.
TRUTH_SCHEMA = pl.Schema(
    {
        "time_s": pl.Float64(),
        "track_number": pl.Int64(),
        "latitude_deg": pl.Float64(),
        "longitude_deg": pl.Float64(),
        "height_m": pl.Float64(),
        "speed_mps": pl.Float64(),
        "heading_deg": pl.Float64(),
        "sensor_id": pl.String(),
        "outlier": pl.Boolean(),
    }
)

#: `truth_biases.parquet`: one row for each time, sensor and parameter.
TRUE_BIAS_SCHEMA = pl.Schema(
    {
        "time_s": pl.Float64(),
        "sensor_id": pl.String(),
        "parameter": pl.String(),
        "value": pl.Float64(),
    }
)

#: `truth_delays.parquet`: one row for each aircraft.
TRUE_DELAY_SCHEMA = pl.Schema(
    {
        "track_number": pl.Int64(),
        "mode_s_address": pl.String(),
        "delay_m": pl.Float64(),
    }
)

_TURN_DEG = 360.0


def measurements_frame(scenario: Scenario, observation: Observation) -> pl.DataFrame:
    """Return `measurements.parquet`: `MEASUREMENT_SCHEMA`, degrees, sorted by time stamp.

    Without direction columns where no sensor of the scenario reports any.
    """
    rows = observation.measurements
    # A plot without range is a bearing, whatever its sensor.
    kinds = ["radar" if one.kind in SITED else one.kind for one in scenario.sensors]
    lost = rows.bearings
    frame = pl.DataFrame(
        {
            "time_s": scenario.start_time_s + rows.time_s,
            "sensor_id": _named(scenario, rows.sensor),
            "kind": pl.Series(kinds, dtype=pl.String)
            .gather(pl.Series(rows.sensor))
            .zip_with(pl.Series(~lost), pl.repeat("bearing", len(lost), eager=True)),
            "range_m": rows.range_m,
            "azimuth_deg": _degrees(rows.azimuth_rad),
            "latitude_deg": np.degrees(rows.latitude_rad),
            "longitude_deg": np.degrees(rows.longitude_rad),
            "height_m": rows.height_m,
            "mode_3a": _identity(scenario, observation, "mode_3a"),
            "mode_s_address": _identity(scenario, observation, "mode_s_address"),
            "track_number": _identity(scenario, observation, "track_number"),
            "callsign": pl.repeat(None, len(lost), dtype=pl.String, eager=True),
            "elevation_deg": np.degrees(rows.elevation_rad),
            "source_latitude_deg": np.degrees(rows.source_latitude_rad),
            "source_longitude_deg": np.degrees(rows.source_longitude_rad),
            "source_height_m": rows.source_height_m,
        }
    )
    data = reported_data(scenario, observation)
    frame = frame.with_columns(
        pl.Series(name, values) for name, values in named_columns(data.values)
    )
    absent = [
        pl.lit(None, kind).alias(name)
        for name, kind in MEASUREMENT_SCHEMA.items()
        if name not in frame.columns
    ]
    return without_empty_columns(_without_nan(frame.with_columns(absent), MEASUREMENT_SCHEMA))


def reported_data(scenario: Scenario, observation: Observation) -> Screened:
    """Return the aircraft-derived data of the measurements, and figures by index of the sensor.

    Values are decoded from the registers, and checked as in a conversion.
    """
    rows = observation.measurements
    if not rows.registers.shape[1]:
        return Screened(without(len(rows)), {})
    raw, found = register_values(rows.registers)
    values, dropped = checked(raw, rows.height_m, found)
    # Of one aircraft, whatever its address: -1 for clutter.
    aircraft = np.where(rows.aircraft == NO_AIRCRAFT, -1, rows.aircraft + 1)
    kept = {
        "time_s": rows.time_s,
        "range_m": rows.range_m,
        "azimuth_deg": np.degrees(rows.azimuth_rad),
        "latitude_deg": np.degrees(rows.latitude_rad),
        "longitude_deg": np.degrees(rows.longitude_rad),
        "height_m": rows.height_m,
    }
    seen = screened(values, dropped, rows.sensor.astype(np.int64), aircraft, kept)
    unchecked = np.array([
        one.aircraft_data is not None and not one.aircraft_data.checks for one in scenario.sensors
    ])[rows.sensor]  # fmt: skip
    return Screened(np.where(unchecked[:, None], raw, seen.values), seen.documents)


def truth_frame(scenario: Scenario, observation: Observation) -> pl.DataFrame:
    """Return `truth.parquet`: `TRUTH_SCHEMA`, degrees, a row for each measurement."""
    rows = observation.measurements
    numbers = pl.Series(
        [one.track_number if one.exists else None for one in observation.aircraft], dtype=pl.Int64
    )
    frame = pl.DataFrame(
        {
            "time_s": scenario.start_time_s + rows.time_s,
            "track_number": numbers.gather(_aircraft(rows.aircraft)),
            "latitude_deg": np.degrees(rows.true_latitude_rad),
            "longitude_deg": np.degrees(rows.true_longitude_rad),
            "height_m": rows.true_height_m,
            "speed_mps": rows.true_speed_mps,
            "heading_deg": _degrees(rows.true_heading_rad),
            "sensor_id": _named(scenario, rows.sensor),
            "outlier": rows.outlier,
        }
    )
    return _without_nan(frame, TRUTH_SCHEMA)


def true_delays_frame(observation: Observation) -> pl.DataFrame:
    """Return `truth_delays.parquet`: `TRUE_DELAY_SCHEMA`, without rows if all delays are 0."""
    real = [one for one in observation.aircraft if one.exists and one.transponder]
    if all(one.transponder_delay_m == 0.0 for one in real):
        real = []
    addresses = [one.mode_s_address for one in real]
    return pl.DataFrame(
        {
            "track_number": [one.track_number for one in real],
            "mode_s_address": [None if one is None else f"{one:06x}" for one in addresses],
            "delay_m": [one.transponder_delay_m for one in real],
        },
        schema=TRUE_DELAY_SCHEMA,
    )


def true_biases_frame(scenario: Scenario, observation: Observation) -> pl.DataFrame:
    """Return `truth_biases.parquet`: `TRUE_BIAS_SCHEMA`, by time, then sensor, then parameter."""
    columns = [
        (sensor, kind)
        for sensor, one in sorted(enumerate(scenario.sensors), key=lambda item: item[1].identifier)
        for kind in true_parameters(one)
    ]
    sensor = np.array([sensor for sensor, _ in columns], np.int64)
    kind = np.array([kind for _, kind in columns], np.int64)
    unit = np.array(PARAMETER_UNITS)[kind]
    grid = observation.biases.time_s
    values = observation.biases.values[:, sensor, kind] / unit
    return pl.DataFrame(
        {
            "time_s": scenario.start_time_s + np.repeat(grid, len(columns)),
            "sensor_id": _named(scenario, np.tile(sensor, len(grid))),
            "parameter": pl.Series(PARAMETER_NAMES, dtype=pl.String).gather(
                pl.Series(np.tile(kind, len(grid)))
            ),
            "value": values.ravel(),
        },
        schema=TRUE_BIAS_SCHEMA,
    )


def true_parameters(sensor: Sensor) -> tuple[int, ...]:
    """Return the bias parameters of a sensor with published truth: the offsets of plots, always."""
    if sensor.kind not in SITED:
        return tuple(sorted(sensor.specified_biases))
    if sensor.kind != "radar":
        return tuple(sorted({PARAMETER_AZIMUTH_OFFSET} | sensor.specified_biases))
    return tuple(
        sorted({PARAMETER_RANGE_OFFSET, PARAMETER_AZIMUTH_OFFSET} | sensor.specified_biases)
    )


def _identity(scenario: Scenario, observation: Observation, name: ReceivedField) -> pl.Series:
    kind = MEASUREMENT_SCHEMA[name]
    rows = observation.measurements
    aircraft = _aircraft(rows.aircraft)
    reported = pl.Series(
        [_written(_answer(one, name), name) for one in observation.aircraft], dtype=kind
    ).gather(aircraft)
    if name == "mode_3a":
        change_s = pl.Series([one.code_change_s for one in observation.aircraft], dtype=pl.Float64)
        later = pl.Series(
            [_written(one.later_mode_3a, name) for one in observation.aircraft], dtype=kind
        )
        changed = pl.Series(rows.time_s) >= change_s.gather(aircraft)
        reported = later.gather(aircraft).zip_with(changed.fill_null(value=False), reported)
        reported = _garbled(reported, rows.garble)
    received = np.array([name in one.received for one in scenario.sensors])[rows.sensor]
    frame = reported.to_frame("reported")
    return frame.select(pl.when(pl.Series(received)).then("reported")).to_series()


def _answer(aircraft: Aircraft, name: ReceivedField) -> int | None:
    answer: int | None = getattr(aircraft, name)
    return answer if aircraft.transponder else None


def _garbled(codes: pl.Series, garble: NDArray[np.int32]) -> pl.Series:
    wrong = np.flatnonzero(garble)
    if len(wrong) == 0:
        return codes
    received = codes.gather(pl.Series(wrong)).to_list()
    flipped = [
        None if code is None else f"{int(code, 8) ^ mask:04o}"
        for code, mask in zip(received, garble[wrong].tolist(), strict=True)
    ]
    return codes.scatter(pl.Series(wrong), pl.Series(flipped, dtype=codes.dtype))


def _written(value: int | None, name: ReceivedField) -> int | str | None:
    if value is None:
        return None
    return {"mode_3a": f"{value:04o}", "mode_s_address": f"{value:06x}"}.get(name, value)


# Index of the aircraft of each row; null without one.
def _aircraft(aircraft: NDArray[np.int32]) -> pl.Series:
    index = pl.Series(aircraft)
    return index.set(index == NO_AIRCRAFT, None)


def _named(scenario: Scenario, sensor: NDArray[np.integer]) -> pl.Series:
    names = pl.Series([one.identifier for one in scenario.sensors], dtype=pl.String)
    return names.gather(pl.Series(sensor))


def _degrees(angle_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    degrees = np.degrees(angle_rad)
    # The largest angle below 2π may round to 360 degrees.
    return np.where(degrees >= _TURN_DEG, 0.0, degrees)


def _without_nan(frame: pl.DataFrame, schema: pl.Schema) -> pl.DataFrame:
    return frame.select(
        (pl.col(name).fill_nan(None) if kind == pl.Float64() else pl.col(name)).cast(kind)
        for name, kind in schema.items()
    )
