"""Tests of the columns of long tables by compiled loops: which rows a gate may reject.

A gate is an expression, and nearly all rows pass all of them. Gates also have rules, by which the
loops find the rows that may not pass; the expressions decide on those only, and give the reasons.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar_converters.normalised import _column_kernels as kernels
from multiradar_converters.normalised.exported import (
    INLINE_OCTETS_MAX,
    VIEWED,
    Column,
    exported,
)
from multiradar_schemas.measurements.gates import (
    Form,
    Gate,
    Given,
    Inside,
    Needed,
    OneOf,
    Rule,
    Together,
    applicable,
    rejections,
)
from multiradar_schemas.measurements.measurement import (
    CALLSIGN_PATTERN,
    KINDS,
    MODE_3A_PATTERN,
    MODE_S_ADDRESS_PATTERN,
    SENSOR_ID_PATTERN,
)
from multiradar_schemas.reject import RejectCode

#: Rows from which the loops take less time than expressions.
ROWS_MIN = 257

_KIND = "kind"


@dataclass(slots=True)
class Tested:
    """Columns of a table, and what the loops found; valid while they are exported.

    Attributes
    ----------
    columns : dict of str to Column
        The columns with a value.
    odd : (n,) bool
        Rows that a gate may reject; no gate rejects the others.
    kinds : (n,) int32
        Index of the kind in `KINDS`; −1 for none.
    read : dict of str to ndarray
        Mode 3/A codes, Mode S addresses, callsigns (packed) and integers as numbers, −1 where there
        is none; of rows that are odd, too, where they have no such number.
    unusual : dict of str to int
        Number of rows whose text is not in the form in which it is stored.
    """

    columns: dict[str, Column]
    odd: NDArray[np.bool_]
    kinds: NDArray[np.int32]
    read: dict[str, NDArray[Any]] = field(default_factory=dict)
    unusual: dict[str, int] = field(default_factory=dict)


class Names:
    """Numbers of names, found by the loops.

    Parameters
    ----------
    numbers : mapping of str to int
        The names.
    """

    def __init__(self, numbers: Mapping[str, int]) -> None:
        #: Whether a view contains the whole of each name.
        self.are_short = all(0 < len(name.encode()) <= INLINE_OCTETS_MAX for name in numbers)
        size = 1 << (2 * len(numbers) + 1).bit_length()
        self._names = np.zeros((size, 2), np.int64)
        self._number = np.full(size, kernels.MISSING, np.int32)
        if numbers and self.are_short:
            frame = pl.DataFrame({"name": list(numbers)})
            entered = np.array(list(numbers.values()), np.int32)
            with exported(frame, ["name"]) as columns:
                views = columns["name"].values
                kernels.enter_names(views, entered, self._names, self._number)

    def find(self, column: Column, odd: NDArray[np.bool_]) -> NDArray[np.int32]:
        """Return the number of each text, −1 for none, and mark texts without a number as odd."""
        found = np.empty(len(odd), np.int32)
        kernels.find_names(*column, self._names, self._number, found, odd)
        return found


@lru_cache(maxsize=8)
def numbered(names: tuple[str, ...]) -> Names:
    """Return names with their places as numbers."""
    return Names({name: number for number, name in enumerate(names)})


def rejected_rows(
    frame: pl.DataFrame, gates: tuple[Gate, ...], tested: Tested | None
) -> tuple[NDArray[np.int64], tuple[RejectCode, ...], tuple[str, ...]]:
    """Return the rejected rows as `rejections` does, which is asked about the odd ones only.

    Parameters
    ----------
    frame : DataFrame
        The table.
    gates : tuple of Gate
        The gates.
    tested : Tested or None
        What the loops found; None if they did not test the table.
    """
    if tested is None:
        return rejections(frame, gates)
    odd = np.flatnonzero(tested.odd)
    if not len(odd):
        return odd, (), ()
    index, codes, reasons = rejections(frame[odd], gates)
    return odd[index], codes, reasons


@contextmanager
def tested_by_loops(frame: pl.DataFrame, gates: tuple[Gate, ...]) -> Iterator[Tested | None]:
    """Test the columns of a table of measurements.

    Parameters
    ----------
    frame : DataFrame
        Columns of `MEASUREMENT_SCHEMA` and of the gates.
    gates : tuple of Gate
        The gates.

    Returns
    -------
    Tested or None
        Within the context. None for a short table, and for columns that have no loop.
    """
    if len(frame) < ROWS_MIN:
        yield None
        return
    nulls = dict(zip(frame.columns, frame.null_count().row(0), strict=True))
    empty = frozenset(name for name, count in nulls.items() if count == len(frame))
    tests = _tests(gates, empty)
    if tests is None:
        yield None
        return
    names = [name for name, kind in frame.schema.items() if type(kind) in VIEWED]
    with exported(frame, [name for name in names if name not in empty]) as columns:
        tested = Tested(
            columns, np.zeros(len(frame), np.bool_), np.full(len(frame), kernels.MISSING, np.int32)
        )
        for name, rule in tests:
            _test(frame, tested, name, rule)
        yield tested


# Each rule once, that of the kind first; None if one has no loop.
@lru_cache(maxsize=64)
def _tests(gates: tuple[Gate, ...], empty: frozenset[str]) -> tuple[tuple[str, Rule], ...] | None:
    found: dict[tuple[str, Rule], None] = {}
    for gate in applicable(gates, empty):
        rule = gate.rule
        if isinstance(rule, Together) and empty.issuperset(rule.fields):
            continue
        if gate.field in empty:
            if not isinstance(rule, Needed):
                return None
        elif not isinstance(rule, Given | Inside | OneOf | Needed) and not (
            isinstance(rule, Form) and rule.pattern in _FORMS
        ):
            return None
        assert rule is not None
        found[gate.field, rule] = None
    kinds = [one for one in found if one[0] == _KIND]
    return (*kinds, *[one for one in found if one[0] != _KIND])


@lru_cache(maxsize=16)
def _needed(kinds: tuple[str, ...]) -> NDArray[np.bool_]:
    return np.array([kind in kinds for kind in KINDS])


def _test(frame: pl.DataFrame, tested: Tested, name: str, rule: Rule) -> None:
    column, odd = tested.columns.get(name), tested.odd
    if isinstance(rule, Needed):
        _test_needed(tested, column, rule)
        return
    assert column is not None, "an empty column has no other test"
    if isinstance(rule, Given):
        kernels.mark_absent(column.valid, column.begin, odd)
    elif isinstance(rule, Form):
        _FORMS[rule.pattern](frame, tested, name, column)
    elif isinstance(rule, Inside):
        _test_number(tested, name, column, rule)
    elif isinstance(rule, OneOf):
        found = numbered(rule.known).find(column, odd)
        if name == _KIND:
            tested.kinds = found


def _test_needed(tested: Tested, column: Column | None, rule: Needed) -> None:
    needed = _needed(rule.kinds)
    if column is None:
        tested.odd |= needed[tested.kinds]
    else:
        kernels.mark_needed(column.valid, column.begin, tested.kinds, needed, tested.odd)


def _test_number(tested: Tested, name: str, column: Column, rule: Inside) -> None:
    if column.values.dtype == np.float64:
        kernels.mark_outside(*column, *rule, tested.odd)
    else:
        numbers = tested.read[name] = np.empty(len(tested.odd), np.int64)
        kernels.read_integers(*column, numbers, tested.odd)


def _test_name(frame: pl.DataFrame, tested: Tested, name: str, column: Column) -> None:
    # Few distinct names: long ones are not worth a loop.
    is_long = kernels.text_octets(*column) < 0
    if is_long and frame[name].drop_nulls().unique().str.contains(SENSOR_ID_PATTERN).all():
        return
    kernels.mark_names(*column, tested.odd)


def _test_code(_frame: pl.DataFrame, tested: Tested, name: str, column: Column) -> None:
    codes = tested.read[name] = np.empty(len(tested.odd), np.int32)
    kernels.read_codes(*column, codes, tested.odd)


def _test_address(_frame: pl.DataFrame, tested: Tested, name: str, column: Column) -> None:
    addresses = tested.read[name] = np.empty(len(tested.odd), np.int64)
    tested.unusual[name] = kernels.read_addresses(*column, addresses, tested.odd)


def _test_callsign(_frame: pl.DataFrame, tested: Tested, name: str, column: Column) -> None:
    callsigns = tested.read[name] = np.empty(len(tested.odd), np.int64)
    tested.unusual[name] = kernels.read_callsigns(*column, callsigns, tested.odd)


_FORMS = {
    SENSOR_ID_PATTERN: _test_name,
    MODE_3A_PATTERN: _test_code,
    MODE_S_ADDRESS_PATTERN: _test_address,
    CALLSIGN_PATTERN: _test_callsign,
}


def text_octets(frame: pl.DataFrame, names: Sequence[str]) -> int:
    """Return the octets of all texts of some columns of a table with rows."""
    with exported(frame, names) as columns:
        return sum(abs(kernels.text_octets(*column)) for column in columns.values())
