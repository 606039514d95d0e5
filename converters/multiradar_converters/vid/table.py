"""`measurements.parquet`: all plots and ADS-B rows, by time, in frames of fixed size."""

import functools
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar_converters.parquet_table import even_blocks, write_frames
from multiradar_converters.vid.naming import NamedPlots
from multiradar_converters.vid.records import (
    Records,
    code_of,
    decimal,
    sensor_of,
    times,
)
from multiradar_schemas.measurements.directions import PLAIN_SCHEMA

#: Sensor of ADS-B rows.
ADSB_ID = "adsb"

# Words of a row of the table: six numbers, sensor, code, address, aircraft.
_WORDS = 10
_SENSOR, _CODE, _ADDRESS, _AIRCRAFT = 6, 7, 8, 9
_ADSB_SENSOR = -1
_CODES = 4096


def table_rows(named: Iterator[NamedPlots], reports: Iterator[Records]) -> Iterator[Records]:
    """Merge associated plots and ADS-B reports by time; plots precede reports of the same time.

    Parameters
    ----------
    named : iterator of NamedPlots
        Plots, by time.
    reports : iterator of records
        Reports, by time.
    """
    waiting = np.empty((0, _WORDS), dtype=np.int64)
    for block in named:
        rows = _plot_rows(block)
        last = float(times(rows)[-1])
        parts = [rows]
        while True:
            # Further plots of the same time may follow, and they come first.
            cut = int(np.searchsorted(times(waiting), last, side="left"))
            parts.append(waiting[:cut])
            waiting = waiting[cut:]
            if len(waiting):
                break
            report = next(reports, None)
            if report is None:
                break
            waiting = _report_rows(report)
        merged = np.concatenate(parts)
        yield merged[np.argsort(times(merged), kind="stable")]
    if len(waiting):
        yield waiting
    for report in reports:
        yield _report_rows(report)


def write_table(
    path: Path, rows: Iterator[Records], sensor_ids: list[str], unix_start_s: float
) -> int:
    """Write the table.

    Parameters
    ----------
    path : Path
        The file.
    rows : iterator of int64[n, 10]
        Rows by time.
    sensor_ids : list of str
        Identifiers of the sensors, by number.
    unix_start_s : float
        Added to the times, s.

    Returns
    -------
    int
        Number of rows.
    """
    frames = (_frame(block, sensor_ids, unix_start_s) for block in even_blocks(rows))
    return write_frames(path, frames, PLAIN_SCHEMA)


def _plot_rows(named: NamedPlots) -> Records:
    plots = named.plots
    out = np.empty((len(plots), _WORDS), dtype=np.int64)
    out[:, :6] = plots[:, :6]
    out[:, _SENSOR] = sensor_of(plots[:, 6])
    out[:, _CODE] = code_of(plots[:, 6])
    out[:, _ADDRESS] = -1
    out[:, _AIRCRAFT] = named.aircraft
    return out


def _report_rows(reports: Records) -> Records:
    out = np.empty((len(reports), _WORDS), dtype=np.int64)
    out.view(np.float64)[:, 1:3] = np.nan
    out[:, 0] = reports[:, 0]
    out[:, 3:6] = reports[:, 1:4]
    out[:, _SENSOR] = _ADSB_SENSOR
    out[:, _CODE] = -1
    out[:, _ADDRESS] = reports[:, 4]
    out[:, _AIRCRAFT] = reports[:, 5]
    return out


def _frame(rows: Records, sensor_ids: list[str], unix_start_s: float) -> pl.DataFrame:
    sensor = rows[:, _SENSOR]
    adsb = sensor == _ADSB_SENSOR
    sensor_names = pl.Series([*sensor_ids, ADSB_ID], dtype=pl.String)
    numbers = {
        name: _number(decimal(rows, word))
        for word, name in (
            (1, "range_m"),
            (2, "azimuth_deg"),
            (3, "latitude_deg"),
            (4, "longitude_deg"),
            (5, "height_m"),
        )
    }
    # The last name of each list is for number -1.
    texts = {
        "sensor_id": _picked(sensor_names, np.where(adsb, len(sensor_ids), sensor)),
        "kind": _picked(pl.Series(["radar", "adsb"]), adsb),
        "mode_3a": _picked(_code_names(), np.where(rows[:, _CODE] < 0, _CODES, rows[:, _CODE])),
        "mode_s_address": _addresses(rows[:, _ADDRESS], adsb),
    }
    aircraft = pl.Series(np.ascontiguousarray(rows[:, _AIRCRAFT]))
    columns = {
        "time_s": pl.Series(times(rows) + unix_start_s),
        **numbers,
        **texts,
        "track_number": aircraft.set(aircraft < 0, None),
        "callsign": pl.repeat(None, len(rows), dtype=pl.String, eager=True),
    }
    return pl.DataFrame({name: columns[name] for name in PLAIN_SCHEMA})


def _number(column: NDArray[np.float64]) -> pl.Series:
    return pl.Series(np.ascontiguousarray(column), nan_to_null=True)


def _picked(names: pl.Series, places: NDArray[np.generic]) -> pl.Series:
    return names.gather(pl.Series(places.astype(np.uint32)))


@functools.cache
def _code_names() -> pl.Series:
    """Return all codes as text, followed by a null."""
    return pl.Series([*(f"{code:04o}" for code in range(_CODES)), None], dtype=pl.String)


def _addresses(addresses: NDArray[np.int64], adsb: NDArray[np.bool_]) -> pl.Series:
    distinct, places = np.unique(addresses[adsb], return_inverse=True)
    names = [*(f"{address:06x}" for address in distinct.tolist()), None]
    place = np.full(len(addresses), len(distinct))
    place[adsb] = places
    return _picked(pl.Series(names, dtype=pl.String), place)
