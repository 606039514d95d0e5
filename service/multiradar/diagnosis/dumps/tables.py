"""Positions and heights of the three tables of a dump against each other.

Plots, ADS-B reports and track rows give positions of the same aircraft. A table that differs from
the others in its unit of heights, or in the order of latitude and longitude, is at fault.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import polars as pl

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import Floats
from multiradar.geodesy.geodesic import EARTH_RADIUS_M
from multiradar_schemas.measurements.units import FOOT_M

#: Rows of one aircraft are compared within this time, s.
NEAR_S = 20.0
#: ... and agree within this distance, m: the aircraft flies 5 km in `NEAR_S`.
AGREE_M = 15_000.0
#: Fractions that agree with another order of the columns, and as they are.
WITH_IT_MIN, AS_IT_IS_MAX = 0.8, 0.2
#: Heights of lower aircraft show no unit, m; deviation of a ratio from that of a unit.
HIGH_MIN_M, WITHIN = 100.0, 0.05
#: Larger heights over smaller ones, and which of the two is in another unit than metres.
_RATIOS = (
    (1.0 / FOOT_M, "feet", True),
    (30.48, "flight levels", False),
    (100.0, "hundreds of metres", False),
    (1000.0, "kilometres", False),
)
_EXCHANGED, _TWICE = "swapped", "metres converted once more from feet"
#: Columns of a table of a dump.
COLUMNS = ("time_s", "track_number", "latitude_deg", "longitude_deg", "height_m")


@dataclass(frozen=True, slots=True)
class _Pairs:
    first: Floats
    second: Floats


@dataclass(frozen=True, slots=True)
class _Difference:
    """What is wrong, whether with the first table, and else with the other one, if it may be."""

    what: str
    of_first: bool
    otherwise: str = ""


def check_tables(tables: Mapping[str, pl.DataFrame]) -> list[Diagnosis]:
    """Diagnose a table of a dump that contradicts the others.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        Rows by file name, columns `COLUMNS`; m, degrees.
    """
    pairs = {
        (first, second): _pairs(tables[first], tables[second])
        for first, second in combinations(tables, 2)
    }
    pairs = {names: one for names, one in pairs.items() if len(one.first) >= TESTED_MIN}
    return _of_pairs(pairs, _exchanged, _of_columns) + _of_pairs(pairs, _unit, _of_heights)


# Each difference blames a table; not one that agrees with a third, where the other does not.
def _of_pairs(
    pairs: Mapping[tuple[str, str], _Pairs],
    difference: Callable[[_Pairs], _Difference | None],
    diagnosis: Callable[[str, str, str], Diagnosis],
) -> list[Diagnosis]:
    found = {names: difference(one) for names, one in pairs.items()}
    agreeing = {name for names, one in found.items() if one is None for name in names}
    blamed: dict[str, Diagnosis] = {}
    for (first, second), one in found.items():
        if one is None:
            continue
        name, other = (first, second) if one.of_first else (second, first)
        what = one.what
        if name in agreeing and other not in agreeing and one.otherwise:
            name, other, what = other, name, one.otherwise
        if other not in agreeing and one.otherwise == what:
            what = f"{what} (or those in {other} are)"
        blamed.setdefault(name, diagnosis(name, other, what))
    return list(blamed.values())


def _pairs(first: pl.DataFrame, second: pl.DataFrame) -> _Pairs:
    columns = [pl.col(name) for name in COLUMNS]
    known = pl.col("track_number").is_not_null() & pl.col("latitude_deg").is_not_null()
    one, other = (frame.filter(known).select(columns).sort("time_s") for frame in (first, second))
    near = one.join_asof(
        other.with_columns(pl.col("time_s").alias("time_there_s")),
        on="time_s",
        by="track_number",
        strategy="nearest",
        tolerance=NEAR_S,
        suffix="_there",
        check_sortedness=False,
    ).filter(pl.col("time_there_s").is_not_null())
    names = COLUMNS[2:]
    return _Pairs(
        _numbers(near.select(names)),
        _numbers(near.select(f"{name}_there" for name in names)),
    )


def _numbers(frame: pl.DataFrame) -> Floats:
    return frame.cast(pl.Float64).fill_null(np.nan).to_numpy()


# Latitudes and longitudes of one of the two are swapped.
def _exchanged(pairs: _Pairs) -> _Difference | None:
    if _agreeing(pairs.first, pairs.second) > AS_IT_IS_MAX:
        return None
    if _agreeing(pairs.first[:, [1, 0, 2]], pairs.second) < WITH_IT_MIN:
        return None
    return _Difference(_EXCHANGED, of_first=True, otherwise=_EXCHANGED)


def _agreeing(first: Floats, second: Floats) -> float:
    north = np.radians(first[:, 0] - second[:, 0])
    east = np.radians(first[:, 1] - second[:, 1]) * np.cos(np.radians(second[:, 0]))
    return float(np.mean(EARTH_RADIUS_M * np.hypot(north, east) <= AGREE_M))


def _unit(pairs: _Pairs) -> _Difference | None:
    first, second = pairs.first[:, 2], pairs.second[:, 2]
    known = np.isfinite(first) & np.isfinite(second) & (np.maximum(first, second) >= HIGH_MIN_M)
    known &= np.minimum(first, second) > 0.0
    if np.count_nonzero(known) < TESTED_MIN:
        return None
    ratio = float(np.median(first[known] / second[known]))
    for expected, unit, is_larger in _RATIOS:
        for found, larger in ((ratio, True), (1.0 / ratio, False)):
            if abs(found / expected - 1.0) <= WITHIN:
                return _Difference(unit, larger == is_larger, _TWICE if unit == "feet" else "")
    return None


def _of_columns(name: str, other: str, what: str) -> Diagnosis:
    return Diagnosis(
        "",
        "columns_exchanged",
        f"{name}: its latitudes and longitudes are probably {what}: after swapping, its positions "
        f"match the positions of the same aircraft in {other}; swap the columns",
    )


def _of_heights(name: str, other: str, unit: str) -> Diagnosis:
    return Diagnosis(
        "",
        "height_unit",
        f"{name}: its heights are probably in {unit}: after conversion, they match the heights of "
        f"the same aircraft in {other}; convert them to metres",
    )
