"""A bounded sample of the reports of a sensor, by aircraft, so that whole tracks are in it."""

import numpy as np

from multiradar_converters.inspection.reports import Flags, Integers, Reports, joined

#: Maximum reports of a sensor that are retained.
SAMPLE_MAX = 20_000
_CODE_BITS = 1 << 25


class Sample:
    """Reports of aircraft that are selected by their identity, equally for all sensors."""

    def __init__(self) -> None:
        self._parts: list[Reports] = []
        self._level = 0
        self._stride = 1
        self._count = 0

    def add(self, reports: Reports) -> None:
        """Add reports."""
        own = np.flatnonzero(self._own(reports))[:: self._stride]
        self._parts.append(reports.select(own))
        self._count += len(self._parts[-1])
        while self._count > SAMPLE_MAX:
            whole = joined(self._parts)
            self._level += 1
            fewer = whole.select(self._own(whole))
            if len(fewer) < SAMPLE_MAX // 4:
                # Few aircraft with many reports each.
                self._level -= 1
                self._stride *= 2
                fewer = whole.select(np.arange(0, len(whole), 2))
            self._parts, self._count = [fewer], len(fewer)

    def reports(self) -> Reports:
        """Return the sample, in the order of the recording."""
        return joined(self._parts)

    def _own(self, reports: Reports) -> Flags:
        own: Flags = _hash(identities(reports)) & ((1 << self._level) - 1) == 0
        return own


def identities(reports: Reports) -> Integers:
    """Return the identity of each report: address, else code, else its time."""
    unnamed = np.nan_to_num(reports.time_s * 128.0).astype(np.int64) + 2 * _CODE_BITS
    coded = np.where(reports.code >= 0, reports.code + _CODE_BITS, unnamed)
    return np.where(reports.address >= 0, reports.address, coded)


def _hash(values: Integers) -> Integers:
    # Fibonacci hashing: its high bits depend on all bits.
    mixed = values.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    return (mixed >> np.uint64(40)).astype(np.int64)
