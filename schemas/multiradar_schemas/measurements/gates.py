"""Columnar validation: a table of measurements in, rejected rows with reasons out."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar_schemas.bounds import POSITION_SIGMA_M
from multiradar_schemas.documents.names import shown, time_unit
from multiradar_schemas.measurements.aircraft_data import (
    MACH_MAX,
    ROLL_MAX_DEG,
    SELECTED_MAX_M,
    SELECTED_MIN_M,
    SPEED_MAX_M_S,
    TRACK_ANGLE_RATE_MAX_DEG_PER_S,
    TURN_DEG,
    VERTICAL_RATE_MAX_M_S,
)
from multiradar_schemas.measurements.measurement import (
    AZIMUTH_END_DEG,
    CALLSIGN_PATTERN,
    DETECTIONS,
    ELEVATION_MAX_DEG,
    HEIGHT_MAX_M,
    HEIGHT_MIN_M,
    KIND_NEEDS,
    KINDS,
    LATITUDE_MAX_DEG,
    LONGITUDE_MAX_DEG,
    MODE_3A_PATTERN,
    MODE_S_ADDRESS_PATTERN,
    RANGE_MAX_M,
    SENSOR_ID_PATTERN,
    SOURCE,
    SOURCE_FIELDS,
    TIME_MAX_S,
)
from multiradar_schemas.reject import RejectCode

#: Rows up to which gates are first tried on lists: an expression takes longer than its evaluation.
LISTED_ROWS_MAX = 256


class Lists(dict[str, list[Any]]):
    """Columns of a short table as lists, made when they are used.

    Parameters
    ----------
    frame : DataFrame
        The table.
    empty : frozenset of str
        Its columns without a value.
    """

    def __init__(self, frame: pl.DataFrame, empty: frozenset[str]) -> None:
        super().__init__()
        self._frame = frame
        self.empty = empty

    def __missing__(self, name: str) -> list[Any]:
        values = self[name] = self._frame.get_column(name).to_list()
        return values


class Inside(NamedTuple):
    """A number within bounds, inclusive; null is inside, NaN is not."""

    least: float
    most: float


class Given(NamedTuple):
    """A value that is not null."""


class OneOf(NamedTuple):
    """One of some texts; null is one."""

    known: tuple[str, ...]


class Form(NamedTuple):
    """A text of a form; null has any."""

    pattern: str


class Needed(NamedTuple):
    """A value that is not null, for some kinds."""

    kinds: tuple[str, ...]


class Together(NamedTuple):
    """Values of several columns, or none."""

    fields: tuple[str, ...]


#: What a gate lets pass, for those that test a column without its expression.
Rule = Inside | Given | OneOf | Form | Needed | Together

# Whether no row is rejected, for certain.
Clear = Callable[[Lists], bool]


def _unclear(_columns: Lists) -> bool:
    return False


@dataclass(frozen=True, slots=True, eq=False)
class Gate:
    """A reason to reject a row.

    Attributes
    ----------
    code : RejectCode
        The stable code.
    field : str
        The invalid column.
    expected : str
        Expected value, for the message.
    rejects : Expr
        Whether a row is rejected; null means no.
    shows : str, optional
        The column whose value the message quotes, if it is not the invalid one.
    clear : callable
        Whether no row of a short table is rejected, for certain; else `rejects` decides.
    rule : Rule, optional
        What `rejects` tests. A row that the rule lets pass is not rejected.
    """

    code: RejectCode
    field: str
    expected: str
    rejects: pl.Expr
    shows: str | None = None
    clear: Clear = _unclear
    rule: Rule | None = None


# Codes of gates that may reject a row without a value in their column.
_OF_ABSENCE = (RejectCode.MISSING_FIELD, RejectCode.UNKNOWN_SENSOR, RejectCode.UNKNOWN_KIND)


def rejections(
    frame: pl.DataFrame, gates: tuple[Gate, ...]
) -> tuple[NDArray[np.int64], tuple[RejectCode, ...], tuple[str, ...]]:
    """Return the rejected rows, each with the first gate that rejects it.

    Parameters
    ----------
    frame : DataFrame
        Columns of `MEASUREMENT_SCHEMA` and those of the gates.
    gates : tuple of Gate
        Reasons to reject a row, the most important first.

    Returns
    -------
    (k,) int64
        Indices of the rows, ascending.
    tuple of RejectCode
        The code of each.
    tuple of str
        The message of each.
    """
    if are_clear(frame, gates, {}):
        return np.empty(0, np.int64), (), ()
    empty = _empty(frame)
    gate_number = frame.select(_first_gate(gates, empty)).to_series()
    if gate_number.null_count() == len(gate_number):
        return np.empty(0, np.int64), (), ()
    index = gate_number.is_not_null().arg_true().to_numpy().astype(np.int64)
    first = gate_number.drop_nulls().to_list()
    used = {gates[number].shows or gates[number].field for number in set(first)}
    # A table has forty columns; a sentence quotes one.
    values = {name: frame[name].gather(index).to_list() for name in used}
    codes = tuple(gates[number].code for number in first)
    reasons = tuple(_sentence(gates[number], values, row) for row, number in enumerate(first))
    return index, codes, reasons


def are_clear(
    frame: pl.DataFrame, gates: tuple[Gate, ...], derived: Mapping[str, list[Any]]
) -> bool:
    """Return whether no row of a short table is rejected, for certain.

    Parameters
    ----------
    frame : DataFrame
        Columns of `MEASUREMENT_SCHEMA`.
    gates : tuple of Gate
        Reasons to reject a row.
    derived : mapping of str to list
        Other columns of the gates, each with a value in every row.
    """
    if len(frame) > LISTED_ROWS_MAX:
        return False
    empty = _empty(frame)
    lists = Lists(frame, empty)
    lists.update(derived)
    return all(gate.clear(lists) for gate in applicable(gates, empty))


# Most recordings leave most columns empty. Only an absent value is a reason to reject there.
def _empty(frame: pl.DataFrame) -> frozenset[str]:
    nulls = zip(frame.columns, frame.null_count().row(0), strict=True)
    return frozenset(name for name, count in nulls if count == frame.height)


@lru_cache(maxsize=64)
def applicable(gates: tuple[Gate, ...], empty: frozenset[str]) -> tuple[Gate, ...]:
    """Return the gates that can reject a row of a table with some empty columns."""
    return tuple(gate for gate in gates if _may_reject(gate, empty))


# Building it takes longer than its evaluation on a short message.
@lru_cache(maxsize=64)
def _first_gate(gates: tuple[Gate, ...], empty: frozenset[str]) -> pl.Expr:
    cascade = [
        pl.when(gate.rejects).then(pl.lit(number, pl.Int16))
        for number, gate in enumerate(gates)
        if _may_reject(gate, empty)
    ]
    return pl.coalesce(cascade).alias("gate")


def _may_reject(gate: Gate, empty: frozenset[str]) -> bool:
    return (gate.shows or gate.field) not in empty or gate.code in _OF_ABSENCE


def _sentence(gate: Gate, values: dict[str, list[Any]], row: int) -> str:
    value = values[gate.shows or gate.field][row]
    if value is None:
        return f"{gate.field}: missing; expected {gate.expected}"
    found = shown(value)
    if gate.field == "time_s" and gate.code is RejectCode.OUT_OF_RANGE:
        found += time_unit(value)
    return f"{gate.field}: expected {gate.expected}, was {found}"


def _number(field: str, expected: str, inside: Inside) -> tuple[Gate, Gate]:
    least, most = inside

    def clear(columns: Lists) -> bool:
        return all(value is None or least <= value <= most for value in columns[field])

    column = pl.col(field)
    # What is inside is finite.
    finite = Gate(
        RejectCode.NON_FINITE, field, "a finite number", ~column.is_finite(),
        clear=lambda _: True, rule=inside,
    )  # fmt: skip
    rejects = ~((column >= least) & (column <= most))
    return finite, Gate(RejectCode.OUT_OF_RANGE, field, expected, rejects, clear=clear, rule=inside)


def _above(bound: float) -> float:
    return float(np.nextafter(bound, np.inf))


def _below(bound: float) -> float:
    return float(np.nextafter(bound, -np.inf))


def _between(field: str, least: float, most: float, unit: str) -> tuple[Gate, Gate]:
    expected = f"a number from {least:g} to {most:g} {unit}"
    return _number(field, expected, Inside(least, most))


def _given(field: str) -> Gate:
    return Gate(
        RejectCode.MISSING_FIELD, field, "a value", pl.col(field).is_null(),
        clear=lambda columns: None not in columns[field], rule=Given(),
    )  # fmt: skip


def _one_of(code: RejectCode, field: str, known: tuple[str, ...]) -> Gate:
    return Gate(
        code, field, f"one of {', '.join(known)}", ~pl.col(field).is_in(known),
        clear=lambda columns: {*known, None}.issuperset(columns[field]), rule=OneOf(known),
    )  # fmt: skip


def _text(field: str, pattern: str) -> Gate:
    # Stricter than the expression: it does not match before a line feed at the end.
    matches = lru_cache(maxsize=4096)(re.compile(pattern, re.ASCII).fullmatch)
    return Gate(
        RejectCode.OUT_OF_RANGE, field, f"text of the form {pattern}",
        ~pl.col(field).str.contains(pattern),
        clear=lambda columns: all(value is None or matches(value) for value in columns[field]),
        rule=Form(pattern),
    )  # fmt: skip


def _needed(field: str, kinds: tuple[str, ...]) -> Gate:
    def clear(columns: Lists) -> bool:
        if field not in columns.empty and None not in columns[field]:
            return True
        return not any(
            value is None and kind in kinds
            for value, kind in zip(columns[field], columns["kind"], strict=True)
        )

    rejects = pl.col(field).is_null() & pl.col("kind").is_in(kinds)
    return Gate(
        RejectCode.MISSING_FIELD, field, "a value for this kind", rejects,
        clear=clear, rule=Needed(kinds),
    )  # fmt: skip


def _needs() -> tuple[Gate, ...]:
    fields = dict.fromkeys(field for needed in KIND_NEEDS.values() for field in needed)
    return tuple(
        _needed(field, tuple(kind for kind in KINDS if field in KIND_NEEDS[kind]))
        for field in fields
    )


# The message names the first absent field, as for JSON.
def _whole_source() -> tuple[Gate, ...]:
    given = pl.any_horizontal(pl.col(name).is_not_null() for name in SOURCE_FIELDS)
    expected = f"all of {SOURCE} or none"
    return tuple(
        Gate(
            RejectCode.MISSING_FIELD, name, expected, given & pl.col(name).is_null(),
            clear=lambda columns: columns.empty.issuperset(SOURCE_FIELDS),
            rule=Together(SOURCE_FIELDS),
        )
        for name in SOURCE_FIELDS
    )  # fmt: skip


def _direction(field: str) -> tuple[Gate, Gate]:
    expected = f"degrees from 0 to less than {TURN_DEG:g}"
    return _number(field, expected, Inside(0.0, _below(TURN_DEG)))


def _aircraft_data() -> tuple[Gate, ...]:
    rate, climb = TRACK_ANGLE_RATE_MAX_DEG_PER_S, VERTICAL_RATE_MAX_M_S
    return (
        *_direction("magnetic_heading_deg"),
        *_between("roll_deg", -ROLL_MAX_DEG, ROLL_MAX_DEG, "degrees"),
        *_direction("track_angle_deg"),
        *_between("track_angle_rate_deg_s", -rate, rate, "degrees/s"),
        *_between("ground_speed_m_s", 0.0, SPEED_MAX_M_S, "m/s"),
        *_between("true_airspeed_m_s", 0.0, SPEED_MAX_M_S, "m/s"),
        *_between("indicated_airspeed_m_s", 0.0, SPEED_MAX_M_S, "m/s"),
        *_between("mach", 0.0, MACH_MAX, "(1)"),
        *_between("vertical_rate_m_s", -climb, climb, "m/s"),
        *_between("selected_altitude_m", SELECTED_MIN_M, SELECTED_MAX_M, "m"),
    )


#: Gates of every table of measurements, independent of its sensors.
PHYSICAL_GATES: tuple[Gate, ...] = (
    _given("time_s"),
    _given("sensor_id"),
    _given("kind"),
    _one_of(RejectCode.UNKNOWN_KIND, "kind", KINDS),
    *_needs(),
    *_number(
        "time_s", f"seconds below {TIME_MAX_S:g}", Inside(_above(-TIME_MAX_S), _below(TIME_MAX_S))
    ),
    *_number(
        "range_m",
        f"metres greater than 0, at most {RANGE_MAX_M:g}",
        Inside(_above(0.0), RANGE_MAX_M),
    ),
    *_number(
        "azimuth_deg",
        f"degrees from 0 to less than {AZIMUTH_END_DEG:g}",
        Inside(0.0, _below(AZIMUTH_END_DEG)),
    ),
    *_between("latitude_deg", -LATITUDE_MAX_DEG, LATITUDE_MAX_DEG, "degrees"),
    *_between("longitude_deg", -LONGITUDE_MAX_DEG, LONGITUDE_MAX_DEG, "degrees"),
    *_between("height_m", HEIGHT_MIN_M, HEIGHT_MAX_M, "m"),
    Gate(
        RejectCode.OUT_OF_RANGE,
        "track_number",
        "a number of at least 0",
        pl.col("track_number") < 0,
        clear=lambda columns: all(value is None or value >= 0 for value in columns["track_number"]),
        rule=Inside(0.0, np.inf),
    ),
    _text("sensor_id", SENSOR_ID_PATTERN),
    _text("mode_3a", MODE_3A_PATTERN),
    _text("mode_s_address", MODE_S_ADDRESS_PATTERN),
    _text("callsign", CALLSIGN_PATTERN),
    *_between("elevation_deg", -ELEVATION_MAX_DEG, ELEVATION_MAX_DEG, "degrees"),
    *_between("source_latitude_deg", -LATITUDE_MAX_DEG, LATITUDE_MAX_DEG, "degrees"),
    *_between("source_longitude_deg", -LONGITUDE_MAX_DEG, LONGITUDE_MAX_DEG, "degrees"),
    *_between("source_height_m", HEIGHT_MIN_M, HEIGHT_MAX_M, "m"),
    *_whole_source(),
    *_between("position_sigma_m", *POSITION_SIGMA_M, "m"),
    _one_of(RejectCode.OUT_OF_RANGE, "detection", DETECTIONS),
    *_aircraft_data(),
)
