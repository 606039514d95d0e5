"""`measurements.parquet` of trajectories: the usual columns, geometric height, callsign, flags.

Reports are records of thirteen words (`records_of`), which `vid.spool` sorts by time on disk:

===== =========================================================================================
word  content (f: bits of a float64)
===== =========================================================================================
0     f time, s
1, 2  f latitude and longitude, degrees
3, 4  f barometric and geometric height, m; NaN for none
5     address (24 bits), code + 1 (13), on the ground (1), kind (1), airborne (1), from the lowest
      bit on
6     callsign, a byte per character; -1 for none
7-11  aircraft-derived data, two of `QUANTITIES` a word: int32 in steps of 0.0001, least for none
12    f standard deviation of the position on each axis, m; NaN for none
===== =========================================================================================
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.plain import KINDS
from multiradar_converters.aircraft_data.checking import Integers, checked
from multiradar_converters.aircraft_data.figures import DataFigures
from multiradar_converters.aircraft_data.quantities import (
    GROUND_SPEED,
    MAGNETIC_HEADING,
    QUANTITIES,
    REVOLUTION_DEG,
    TRACK_ANGLE,
    VERTICAL_RATE,
    Numbers,
    blank,
)
from multiradar_converters.asterix.decoding.naming import (
    address_names,
    code_names,
    ground_statuses,
    named,
)
from multiradar_converters.parquet_table import even_blocks, write_frames
from multiradar_converters.vid.records import Records, decimal, times
from multiradar_schemas.measurements.columns import POSITION_SIGMA
from multiradar_schemas.measurements.directions import PLAIN_GROUND_SCHEMA

RECORD_WORDS = 13
_DATA_AT, _SIGMA_AT = 7, 12
_STEP, _NONE = 1e-4, np.iinfo(np.int32).min

#: Columns of this table; `track` and other commands read the first ones. Those of aircraft-derived
#: data are omitted where no report has them.
SCHEMA = pl.Schema(
    {
        **PLAIN_GROUND_SCHEMA,
        POSITION_SIGMA: pl.Float64(),
        **dict.fromkeys(QUANTITIES, pl.Float64()),
        "geometric_height_m": pl.Float64(),
        "flags": pl.String(),
    }
)

#: Columns that are omitted where no report has them.
OPTIONAL = (POSITION_SIGMA, *QUANTITIES)

#: Maximum reports of one time that are compared; bounds the memory.
SAME_TIME_MAX = 1 << 18

_CODE_AT, _CODE_BITS, _GROUND_AT, _KIND_AT, _AIRBORNE_AT = 24, 13, 37, 38, 39
_ADDRESS_MASK = (1 << _CODE_AT) - 1
_FLAGS = (None, "on_ground", "height_geometric", "on_ground,height_geometric")


@dataclass
class Written:
    """Figures of the table.

    Attributes
    ----------
    rows, repeated : int
        Rows, and omitted duplicate reports.
    kinds : dict of str to int
        Rows by kind.
    heights : dict of str to int
        Rows by kind of height.
    on_ground : int
        Rows of aircraft on the ground.
    addresses : set of int
        The aircraft.
    first_s, last_s : float
        Times, s; NaN without rows.
    middle : float64[3]
        Sum of the unit vectors of the positions, for each kind.
    data : dict of DataFigures
        Figures of the aircraft-derived data of each kind.
    """

    rows: int = 0
    repeated: int = 0
    kinds: dict[str, int] = field(default_factory=lambda: dict.fromkeys(KINDS, 0))
    heights: dict[str, int] = field(
        default_factory=lambda: dict.fromkeys(("barometric", "geometric", "none"), 0)
    )
    on_ground: int = 0
    addresses: set[int] = field(default_factory=set)
    first_s: float = float("nan")
    last_s: float = float("nan")
    middle: dict[str, NDArray[np.float64]] = field(
        default_factory=lambda: {kind: np.zeros(3) for kind in KINDS}
    )
    data: dict[str, DataFigures] = field(
        default_factory=lambda: {kind: DataFigures() for kind in KINDS}
    )


def records_of(
    numbers: NDArray[np.float64],
    words: NDArray[np.int64],
    sigma_m: NDArray[np.float64] | None = None,
) -> Records:
    """Pack reports into records.

    Parameters
    ----------
    numbers, words : float64[16, n], int64[5, n]
        Values by role.
    sigma_m : float64[n], optional
        Standard deviation of each position, m; NaN for none.

    Returns
    -------
    int64[n, 13]
        The records.
    """
    out = np.empty((numbers.shape[1], RECORD_WORDS), dtype=np.int64)
    bits = out.view(np.float64)
    for word, role in enumerate(
        (roles.TIME, roles.LATITUDE, roles.LONGITUDE, roles.HEIGHT, roles.GEOMETRIC)
    ):
        bits[:, word] = numbers[role]
    address, code, callsign, ground, kind = words
    out[:, 5] = (
        address
        | (np.maximum(code, -1) + 1) << _CODE_AT
        | (ground == 1).astype(np.int64) << _GROUND_AT
        | (kind == 1).astype(np.int64) << _KIND_AT
        | (ground == 0).astype(np.int64) << _AIRBORNE_AT
    )
    out[:, 6] = np.maximum(callsign, -1)
    data = numbers[list(roles.OF_AIRCRAFT)].T / _STEP
    # Far beyond any bounds: dropped as implausible later.
    data = np.clip(np.rint(data), _NONE + 1, -_NONE - 1)
    steps = np.where(np.isnan(data), _NONE, data).astype(np.int32)
    out[:, _DATA_AT:_SIGMA_AT] = np.ascontiguousarray(steps).view(np.int64)
    bits[:, _SIGMA_AT] = np.nan if sigma_m is None else sigma_m
    return out


def quantities_of(
    numbers: NDArray[np.float64], sigma_m: NDArray[np.float64] | None = None
) -> set[str]:
    """Return the columns of `OPTIONAL` that any report has."""
    found = {
        name
        for name, role in zip(QUANTITIES, roles.OF_AIRCRAFT, strict=True)
        if not np.isnan(numbers[role]).all()
    }
    with_sigma = sigma_m is not None and not np.isnan(sigma_m).all()
    return found | ({POSITION_SIGMA} if with_sigma else set())


def _aircraft_data(
    records: Records, height_m: NDArray[np.float64], kind: NDArray[np.int64]
) -> tuple[Numbers, Integers]:
    steps = np.ascontiguousarray(records[:, _DATA_AT:_SIGMA_AT]).view(np.int32)
    data = np.where(steps == _NONE, np.nan, np.rint(steps * 1.0) / round(1.0 / _STEP))
    return _checked(data, height_m, kind)


def reported_data(
    numbers: NDArray[np.float64], height_m: NDArray[np.float64], kind: NDArray[np.int64]
) -> tuple[Numbers, Integers]:
    """Return the aircraft-derived data of reports.

    Parameters
    ----------
    numbers : float64[16, n]
        Values by role.
    height_m, kind : float64[n], int64[n]
        Heights, m, and kinds by number.

    Returns
    -------
    float64[n, 10], int64[n]
        Plausible data, and the reasons for which others were dropped, bits.
    """
    return _checked(numbers[list(roles.OF_AIRCRAFT)].T.copy(), height_m, kind)


def _checked(
    data: Numbers, height_m: NDArray[np.float64], kind: NDArray[np.int64]
) -> tuple[Numbers, Integers]:
    # Multilateration computes these of positions.
    blank(data, kind == KINDS.index("mlat"), (GROUND_SPEED, TRACK_ANGLE, VERTICAL_RATE))
    for quantity in (TRACK_ANGLE, MAGNETIC_HEADING):
        data[:, quantity] %= REVOLUTION_DEG
    return checked(data, height_m)


def write(
    path: Path, blocks: Iterator[Records], unix_start_s: float, quantities: Collection[str] = ()
) -> Written:
    """Write the table.

    Parameters
    ----------
    path : Path
        The file.
    blocks : iterator of int64[n, 13]
        Reports by time.
    unix_start_s : float
        Added to the times, s.
    quantities : collection of str
        Columns of `OPTIONAL` that any report has.

    Returns
    -------
    Written
        Its figures.
    """
    written = Written()
    schema = pl.Schema(
        {name: kind for name, kind in SCHEMA.items() if name not in OPTIONAL or name in quantities}
    )
    frames = (
        _frame(block, unix_start_s, written).select(schema.names())
        for block in even_blocks(_once(blocks, written))
    )
    written.rows = write_frames(path, frames, schema)
    return written


def frame(records: Records) -> pl.DataFrame:
    """Return reports with Unix times as rows of the table.

    Parameters
    ----------
    records : int64[n, 13]
        The reports.

    Returns
    -------
    DataFrame
        Columns of `SCHEMA`; `sensor_id` is that of recordings.
    """
    return _frame(records, 0.0, Written())


def _once(blocks: Iterator[Records], written: Written) -> Iterator[Records]:
    """Remove duplicate reports of the same time, in any order."""
    held = np.empty((0, RECORD_WORDS), dtype=np.int64)
    for block in blocks:
        both = np.concatenate([held, block])
        # Reports of the last time may continue in the next block.
        cut = int(np.searchsorted(times(both), times(both)[-1], side="left"))
        if len(both) - cut > SAME_TIME_MAX:
            cut = len(both)
        yield _first_of_each(both[:cut], written)
        held = both[cut:]
    yield _first_of_each(held, written)


def _first_of_each(records: Records, written: Written) -> Records:
    if not len(records):
        return records
    aircraft = records[:, 5] & _ADDRESS_MASK
    order = np.lexsort((records[:, 2], records[:, 1], aircraft, times(records)))
    ordered = records[order]
    again = np.zeros(len(order), dtype=np.bool_)
    same = (ordered[1:, :3] == ordered[:-1, :3]).all(axis=1)
    again[order[1:]] = same & (aircraft[order[1:]] == aircraft[order[:-1]])
    written.repeated += int(again.sum())
    return records[~again]


def _frame(records: Records, unix_start_s: float, written: Written) -> pl.DataFrame:
    identity = records[:, 5]
    address = identity & _ADDRESS_MASK
    code = ((identity >> _CODE_AT) & ((1 << _CODE_BITS) - 1)) - 1
    ground = (identity >> _GROUND_AT) & 1
    kind = (identity >> _KIND_AT) & 1
    airborne = (identity >> _AIRBORNE_AT) & 1
    time_s = times(records) + unix_start_s
    barometric, geometric = decimal(records, 3), decimal(records, 4)
    by_satellite = np.isnan(barometric) & ~np.isnan(geometric)
    height = np.where(by_satellite, geometric, barometric)
    _count(written, records, time_s)
    none, geometric_only = int(np.isnan(height).sum()), int(by_satellite.sum())
    written.heights["none"] += none
    written.heights["geometric"] += geometric_only
    written.heights["barometric"] += len(records) - none - geometric_only
    written.on_ground += int(ground.sum())
    data, dropped = _aircraft_data(records, height, kind)
    for number, name in enumerate(KINDS):
        own = kind == number
        written.data[name].add(data[own], dropped[own], address[own], time_s[own], height[own])
    numbers = {
        **{name: data[:, k] for k, name in enumerate(QUANTITIES)},
        "time_s": time_s,
        "latitude_deg": decimal(records, 1),
        "longitude_deg": decimal(records, 2),
        "height_m": height,
        "geometric_height_m": geometric,
        POSITION_SIGMA: decimal(records, _SIGMA_AT),
    }
    kinds = named(kind, KINDS.__getitem__)
    columns = {
        name: pl.Series(np.ascontiguousarray(values), nan_to_null=True)
        for name, values in numbers.items()
    } | {
        "sensor_id": kinds,
        "kind": kinds,
        "mode_3a": code_names(code),
        "mode_s_address": address_names(address),
        "callsign": named(records[:, 6], _callsign),
        "on_ground": ground_statuses(np.where(ground | airborne, ground, -1)),
        "flags": named(ground | by_satellite << 1, _FLAGS.__getitem__),
    }
    empty = pl.Series([None] * len(records), dtype=pl.Int64)
    return pl.DataFrame({name: columns.get(name, empty) for name in SCHEMA}, schema=SCHEMA)


def _count(written: Written, records: Records, time_s: NDArray[np.float64]) -> None:
    if not len(records):
        return
    if not written.addresses:
        written.first_s = float(time_s[0])
    written.last_s = float(time_s[-1])
    written.addresses.update(np.unique(records[:, 5] & _ADDRESS_MASK).tolist())
    kind = (records[:, 5] >> _KIND_AT) & 1
    latitude, longitude = np.radians(decimal(records, 1)), np.radians(decimal(records, 2))
    towards = np.stack(
        [
            np.cos(latitude) * np.cos(longitude),
            np.cos(latitude) * np.sin(longitude),
            np.sin(latitude),
        ]
    )
    for number, name in enumerate(KINDS):
        written.kinds[name] += int((kind == number).sum())
        written.middle[name] += towards[:, kind == number].sum(axis=1)


def _callsign(packed: int) -> str | None:
    return None if packed < 0 else packed.to_bytes(8, "big").lstrip(b"\0").decode("ascii").upper()
