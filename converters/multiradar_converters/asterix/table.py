"""`measurements.parquet` of an ASTERIX recording: the usual columns and flags."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import polars as pl

from multiradar_converters.aircraft_data.quantities import named_columns
from multiradar_converters.asterix.decoding.naming import (
    address_names,
    callsign_names,
    code_names,
    ground_statuses,
    named,
)
from multiradar_converters.asterix.decoding.targets import flag_text
from multiradar_converters.asterix.decoding.timing import KINDS
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers
from multiradar_schemas.measurements.columns import DETECTION, POSITION_SIGMA
from multiradar_schemas.measurements.directions import REPORT_SCHEMA, has_column
from multiradar_schemas.measurements.measurement import DETECTIONS

#: Columns of this table; `track` and other commands read the first ones.
_LAST = "flags"
SCHEMA = pl.Schema({**REPORT_SCHEMA, _LAST: pl.String()})
_OMITTED_EMPTY = (POSITION_SIGMA, DETECTION)

#: Columns of `Targets` that are numbers and whole numbers of the table.
NUMBERS = (
    "range_m", "azimuth_deg", "latitude_deg", "longitude_deg", "height_m", POSITION_SIGMA,
)  # fmt: skip
WHOLE = ("code", "address", "callsign", "on_ground", DETECTION, "flags")

#: Records with equal octets within this time are duplicates, s.
SAME_S = 1.0
#: Positions within this are equal, degree: rounding to 1 m, above 60° of latitude too.
SAME_POSITION_DEG = 3e-5

_HEIGHTS_M = (-1000.0, 40_000.0)


def frame(
    columns: dict[str, Numbers],
    sensor_ids: list[str] | pl.Series,
    whole: dict[str, Integers],
    aircraft_data: Numbers,
) -> pl.DataFrame:
    """Return the table of a file.

    Parameters
    ----------
    columns : dict of float64[n]
        The numbers by name; NaN if absent.
    sensor_ids : list of str or Series
        Sensor of each row.
    whole : dict of int64[n]
        kind (see `timing.KINDS`), and the columns `WHOLE` as in `Targets`.
    aircraft_data : float64[n, 10] or float64[n, 0]
        Aircraft-derived data.

    Returns
    -------
    DataFrame
        Columns of `SCHEMA`, and before the flags those of aircraft-derived data that have a value.
    """
    height = columns["height_m"]
    within = (height >= _HEIGHTS_M[0]) & (height <= _HEIGHTS_M[1])
    numbers = columns | {"height_m": np.where(within, height, np.nan)}
    texts = {
        "sensor_id": pl.Series(sensor_ids, dtype=pl.String),
        "kind": named(whole["kind"], KINDS.__getitem__),
        "mode_3a": code_names(whole["code"]),
        "mode_s_address": address_names(whole["address"]),
        "callsign": callsign_names(whole["callsign"]),
        "on_ground": ground_statuses(whole["on_ground"]),
        DETECTION: named(whole[DETECTION], lambda one: None if one < 0 else DETECTIONS[one]),
        "flags": named(whole["flags"], flag_text),
    }
    derived = dict(named_columns(aircraft_data))
    numbers |= derived
    made = {name: pl.Series(values, nan_to_null=True) for name, values in numbers.items()} | texts
    empty = pl.Series([None] * len(sensor_ids), dtype=pl.Int64)
    plain = {name: kind for name, kind in SCHEMA.items() if name != _LAST}
    schema = {**plain, **dict.fromkeys(derived, pl.Float64()), _LAST: SCHEMA[_LAST]}
    return pl.DataFrame({name: made.get(name, empty) for name in schema}, schema=schema)


def repeated(same: Integers, source: Integers, time_s: Numbers) -> Flags:
    """Find duplicate records: equal octets, same source, times close together.

    Parameters
    ----------
    same : int64[n]
        Equal for records with equal octets.
    source : int64[n]
        Source.
    time_s : float64[n]
        Times, s.

    Returns
    -------
    bool[n]
        Whether each is a duplicate; of equal records the first in time, then in order, is kept.
    """
    order = np.lexsort((time_s, source, same))
    again = np.zeros(len(order), dtype=np.bool_)
    if len(order):
        follows = (np.diff(same[order]) == 0) & (np.diff(source[order]) == 0)
        again[order[1:]] = follows & (np.diff(time_s[order]) <= SAME_S)
    return again


def repeated_positions(reports: Mapping[str, Numbers | Integers]) -> Flags:
    """Find positions that a source reports in two categories, such as 010 and 020.

    Parameters
    ----------
    reports : mapping of array[n]
        Columns of `frame`, with kind, source and category.

    Returns
    -------
    bool[n]
        Whether each repeats one of another category with the same source, kind, time, identity
        and, within `SAME_POSITION_DEG`, position. That of the later category is kept, which has
        the accuracy.
    """
    rows = np.flatnonzero(reports["kind"] != KINDS.index("radar"))
    keys = [reports[name][rows] for name in ("source", "kind", "time_s", "code", "address")]
    places = np.stack([reports[name][rows] for name in ("latitude_deg", "longitude_deg")])
    category = reports["category"][rows]
    order = np.lexsort((-category, *reversed(keys)))
    again = np.zeros(len(reports["kind"]), dtype=np.bool_)
    if len(order):
        same = np.all([key[order][1:] == key[order][:-1] for key in keys], axis=0)
        near = (np.abs(np.diff(places[:, order], axis=1)) <= SAME_POSITION_DEG).all(axis=0)
        again[rows[order[1:]]] = same & near & (np.diff(category[order]) != 0)
    return again


def write(path: Path, frames: list[pl.DataFrame]) -> int:
    """Write the table by time; return its rows. Optional columns without a value are omitted."""
    whole = pl.concat(frames or [pl.DataFrame(schema=SCHEMA)]).sort("time_s", maintain_order=True)
    whole = whole.drop([name for name in _OMITTED_EMPTY if not has_column(whole, name)])
    whole.write_parquet(path, compression="snappy", statistics=True, row_group_size=1 << 16)
    return whole.height
