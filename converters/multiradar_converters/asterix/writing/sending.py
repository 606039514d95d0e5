"""Recordings as datagrams for replay, with original or current times."""

import dataclasses
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.decoding.clocks import nearest_day
from multiradar_converters.asterix.decoding.editions import Editions
from multiradar_converters.asterix.decoding.gathering import Gathered, Rows, gather
from multiradar_converters.asterix.decoding.timing import services_in_order, time_targets
from multiradar_converters.asterix.framing.containers import Blocks, read_datagrams
from multiradar_converters.asterix.framing.datagrams import Datagrams
from multiradar_converters.asterix.layout import _kernels
from multiradar_converters.asterix.layout.columns import Integers, Numbers
from multiradar_converters.asterix.layout.program import Walked

Octets = NDArray[np.uint8]

_DAY_S = 86_400.0
_TRUNCATED_S = 512.0
_TICKS_PER_S = 128
# Quantile: a clock that is far ahead must not shift all others into the past.
_NOT_AHEAD = 0.99
_TIME_BITS = 24
_TRUNCATED_ITEM = "141"


@dataclass(frozen=True)
class _Times:
    """Positions and values of the times in a recording, in order."""

    begins: Integers
    time_s: Numbers
    whole: Integers
    truncated: Integers
    truncated_record: Integers


def _no_times() -> _Times:
    none = np.empty(0, np.int64)
    return _Times(none, none.astype(np.float64), none, none, none)


@dataclass(frozen=True)
class Sending:
    """Datagrams to send.

    Attributes
    ----------
    datagrams : Datagrams
        In sending order.
    due_s : float64[n]
        Due time of each, s since the first; non-decreasing.
    begin_s : float
        Time of day at which the first is due, so late that at most 1 % of the records have a time
        in the future when they are sent, s; NaN without times.
    left_out : int
        Octets of the recording that are neither framing nor sent, because they are not blocks.
    """

    datagrams: Datagrams
    due_s: Numbers
    begin_s: float
    left_out: int
    _times: _Times = dataclasses.field(default_factory=_no_times)

    def moved(self, shift_s: int) -> "Sending":
        """Return a copy with the times of day in the records shifted by whole seconds."""
        if not shift_s:
            return self
        data = _moved(self.datagrams, self._times, shift_s)
        return replace(self, datagrams=replace(self.datagrams, data=data))


def read_sending(path: Path) -> Sending:
    """Read a recording.

    Parameters
    ----------
    path : Path
        The file; see `containers`.

    Returns
    -------
    Sending
        Its datagrams, or its single blocks. Due times are those of the recorder, else those of the
        records.

    Raises
    ------
    LayoutError
        The file cannot be read.
    """
    blocks, datagrams = read_datagrams(path)
    times = _times(blocks)
    sent = int((datagrams.ends - datagrams.begins).sum())
    content = blocks.size - blocks.framing
    due_s = _due(datagrams, times)
    begin_s = _begin(datagrams, due_s, times)
    return Sending(datagrams, due_s, begin_s, max(content - sent, 0), times)


def _times(blocks: Blocks) -> _Times:
    """Find all times of day, complete and modulo 512 s."""
    whole: list[Integers] = []
    truncated: list[Integers] = []
    records: list[Integers] = []

    def watch(walked: Walked, _rows: Rows) -> None:
        program = walked.program
        for (node, _name), field in program.fields.items():
            number = program.places[node]
            starts = walked.starts[:, number]
            if field.unit != "s" or program.nodes[number, _kernels.KIND] != _kernels.FIXED:
                continue
            if field.bits == _TIME_BITS:
                whole.append(starts[starts >= 0].astype(np.int64))
            elif node == _TRUNCATED_ITEM:
                truncated.append(starts[starts >= 0].astype(np.int64))
                records.append(walked.records[starts >= 0, 1])

    gathered = gather(blocks, Editions(), watch=watch)
    begins, time_s = _record_times(gathered)
    return _Times(begins, time_s, _together(whole), _together(truncated), _together(records))


def _record_times(gathered: Gathered) -> tuple[Integers, Numbers]:
    """Return the begins of records with a time, and their times of day, in file order."""
    rows, services = services_in_order(gathered)
    timed, _turned = time_targets(gathered)
    order, begins, time_s = [rows.order], [rows.begin], [services.time_s]
    if timed is not None:
        order.append(timed.rows.order)
        begins.append(timed.rows.begin)
        time_s.append(timed.targets.time_s)
    place = np.argsort(np.concatenate(order), kind="stable")
    times = np.concatenate(time_s)[place]
    known = times < _DAY_S
    return np.concatenate(begins)[place][known], times[known]


def _together(parts: list[Integers]) -> Integers:
    return np.concatenate([np.empty(0, np.int64), *parts])


def _due(datagrams: Datagrams, times: _Times) -> Numbers:
    """Return the due time of each datagram, s since the first."""
    at_s = datagrams.received_s.copy()
    if np.isnan(at_s).any():
        at_s[:] = np.nan
        # Backwards, so that the first of several times in a datagram is used.
        at_s[_datagram(datagrams, times)[::-1]] = times.time_s[::-1]
    known = np.flatnonzero(~np.isnan(at_s))
    if not len(known):
        return np.zeros(len(at_s))
    steps = np.diff(at_s[known], prepend=at_s[known[0]])
    # At midnight the time of day restarts.
    steps = np.where(steps < -_DAY_S / 2, steps + _DAY_S, steps)
    reached = np.maximum.accumulate(np.cumsum(steps))
    before = np.searchsorted(known, np.arange(len(at_s)), side="right") - 1
    return reached[np.maximum(before, 0)]


def _begin(datagrams: Datagrams, due_s: Numbers, times: _Times) -> float:
    if not len(times.time_s):
        return float("nan")
    begins = times.time_s - due_s[_datagram(datagrams, times)]
    latest = np.quantile(nearest_day(begins, begins[0]), _NOT_AHEAD, method="higher")
    return float(latest) % _DAY_S


def _datagram(datagrams: Datagrams, times: _Times) -> Integers:
    """Return the datagram of each time."""
    by_place = np.argsort(datagrams.begins, kind="stable")
    return by_place[np.searchsorted(datagrams.begins[by_place], times.begins, side="right") - 1]


def _moved(datagrams: Datagrams, times: _Times, shift_s: int) -> Octets:
    """Return the octets with all times of day shifted."""
    data = datagrams.data.copy()
    day = int(_DAY_S) * _TICKS_PER_S
    old = _number(data, times.whole, 3)
    # Invalid times of day are unchanged.
    _put(data, times.whole, 3, np.where(old < day, (old + shift_s * _TICKS_PER_S) % day, old))
    by_place = np.argsort(times.begins, kind="stable")
    begins = times.begins[by_place]
    place = np.minimum(np.searchsorted(begins, times.truncated_record), max(len(begins) - 1, 0))
    ticks = _number(data, times.truncated, 2)
    if len(begins):
        found = begins[place] == times.truncated_record
        restored = np.rint(times.time_s[by_place][place] * _TICKS_PER_S).astype(np.int64)
        ticks = np.where(found, restored, ticks)
    moved = (ticks + shift_s * _TICKS_PER_S) % day % int(_TRUNCATED_S * _TICKS_PER_S)
    _put(data, times.truncated, 2, moved)
    return data


def _number(data: Octets, at: Integers, octets: int) -> Integers:
    weights = 1 << (8 * np.arange(octets - 1, -1, -1))
    number: Integers = data[at[:, None] + np.arange(octets)].astype(np.int64) @ weights
    return number


def _put(data: Octets, at: Integers, octets: int, values: Integers) -> None:
    for k in range(octets):
        data[at + k] = values >> (8 * (octets - 1 - k)) & 0xFF
