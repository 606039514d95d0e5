"""Long tables of measurements, tested and translated by compiled loops."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION, KIND_RADAR
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking.roster import MISSING
from multiradar.wire.sensors import KIND_NUMBER
from multiradar_converters.normalised import _column_kernels as kernels
from multiradar_converters.normalised.checks import Names, Tested, tested_by_loops
from multiradar_schemas.measurements.gates import PHYSICAL_GATES
from multiradar_schemas.measurements.measurement import KINDS
from multiradar_schemas.reject import RejectCode

#: A range may exceed the instrumented range of its sensor by this factor.
RANGE_MAX_FACTOR = 1.05
_RADIAN = np.pi / 180.0
# Number of each kind in the core, and those that use a number.
_IN_CORE = np.array([KIND_NUMBER[kind] for kind in KINDS], np.int8)
_EVERY = np.ones(len(KINDS), np.bool_)
#: Numbers of a batch: the column, the kinds that use it, and its unit.
_FLOATS = {
    "time_s": ("time_s", _EVERY, 1.0),
    "range_m": ("range_m", _IN_CORE == KIND_RADAR, 1.0),
    "azimuth_rad": ("azimuth_deg", _IN_CORE != KIND_POSITION, _RADIAN),
    "latitude_rad": ("latitude_deg", _IN_CORE == KIND_POSITION, _RADIAN),
    "longitude_rad": ("longitude_deg", _IN_CORE == KIND_POSITION, _RADIAN),
    "height_m": ("height_m", _EVERY, 1.0),
}
_INTEGERS: dict[str, type[np.signedinteger[Any]]] = {
    "mode_3a": np.int32,
    "mode_s_address": np.int64,
    "track_number": np.int64,
    "callsign": np.int64,
}

#: The rejected rows: their index, codes and reasons, as of `rejections`.
Rejections = tuple[NDArray[np.int64], tuple[RejectCode, ...], tuple[str, ...]]


class Read(NamedTuple):
    """A table as read by the loops.

    Attributes
    ----------
    arrays : dict of str to (n,) ndarray
        Columns of `MeasurementBatch` of the accepted rows, those of few batches excepted; as
        measured.
    rejections : tuple
        The rejected rows: index, codes and reasons.
    """

    arrays: dict[str, NDArray[Any]]
    rejections: Rejections


def read_by_loops(
    frame: pl.DataFrame, table: SensorTable, rejections: Callable[[pl.DataFrame], Rejections]
) -> Read | None:
    """Test and translate measurements.

    Parameters
    ----------
    frame : DataFrame
        Columns of `MEASUREMENT_SCHEMA`, degrees; without directions.
    table : SensorTable
        The sensors, none of which moves.
    rejections : callable
        Decides on the rows that may not be accepted.

    Returns
    -------
    Read or None
        None for a short table, or one with a column or value for which there is no loop.
    """
    names = _names(table.ids, table.aliases)
    with tested_by_loops(frame, PHYSICAL_GATES) as tested:
        if tested is None or not names.are_short:
            return None
        arrays = _arrays(tested, names)
        range_end_m, disabled, fits = _bounds(table)
        kernels.mark_unfit(
            arrays["sensor"], tested.kinds, fits, arrays["range_m"], range_end_m, disabled,
            tested.odd,
        )  # fmt: skip
        odd = np.flatnonzero(tested.odd)
    if not len(odd):
        return Read(arrays, (odd, (), ()))
    index, codes, reasons = rejections(frame[odd])
    if len(index) < len(odd):
        # Not read, and accepted all the same.
        return None
    kept = ~tested.odd
    return Read({name: one[kept] for name, one in arrays.items()}, (odd, codes, reasons))


def _arrays(tested: Tested, names: Names) -> dict[str, NDArray[Any]]:
    rows, columns = len(tested.odd), tested.columns
    arrays: dict[str, NDArray[Any]] = {
        "sensor": names.find(columns["sensor_id"], tested.odd),
        "kind": _IN_CORE[tested.kinds],
    }
    for name, (column, used, unit) in _FLOATS.items():
        if column not in columns:
            arrays[name] = np.full(rows, np.nan)
            continue
        arrays[name] = np.empty(rows)
        kernels.read_floats(*columns[column], tested.kinds, used, unit, arrays[name])
    for name, kind in _INTEGERS.items():
        found = tested.read.get(name)
        arrays[name] = np.full(rows, MISSING, kind) if found is None else found
    return arrays


def _bounds(
    table: SensorTable,
) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]:
    # A radar without range, for example under jamming, still measures bearings.
    bearing = (table.kinds == KIND_RADAR)[:, None] & (_IN_CORE == KIND_BEARING)
    fits = (table.kinds[:, None] == _IN_CORE) | bearing
    return table.range_max_m * RANGE_MAX_FACTOR, table.disabled, fits


@lru_cache(maxsize=8)
def _names(ids: tuple[str, ...], aliases: tuple[tuple[str, int], ...]) -> Names:
    return Names({name: number for number, name in enumerate(ids)} | dict(aliases))
