"""Clocks and antennas of radars from live records.

Times of a recording are resolved with all of it available, live times only with earlier records.
Until a radar has reported a time of day, its clock is assumed to be that of the reception. The
result is a function of the records alone, independent of the batches.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace

import numpy as np

from multiradar_converters.asterix.decoding.clocks import Marks
from multiradar_converters.asterix.decoding.gathering import Rows
from multiradar_converters.asterix.decoding.services import NORTH, Services, antenna_period_s
from multiradar_converters.asterix.decoding.targets import Targets
from multiradar_converters.asterix.decoding.timing import marks_of
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers

_DAY_S = 86_400.0
#: Service messages from which a scan period is estimated: eight revolutions of 32 sectors.
MESSAGES_KEPT = 256
# Sectors between estimates of the scan period without north marks.
_SECTORS_BETWEEN = 8

# Message, time, sector and reported scan period.
_Message = tuple[int, float, float, float]


@dataclass
class _Antenna:
    """Messages and scan period of an antenna."""

    period_s: float = np.nan
    stated_s: float = np.nan
    messages: deque[_Message] = field(default_factory=lambda: deque(maxlen=MESSAGES_KEPT))
    sectors: int = 0

    def push(self, message: _Message) -> float:
        """Add a message; return the current scan period, s."""
        kind, time_s, sector, stated = message
        if np.isnan(time_s):
            return self.period_s
        if self.messages:
            time_s += _DAY_S * round((self.messages[-1][1] - time_s) / _DAY_S)
        # Two networks deliver a message twice; the interval between them is too short for a scan.
        self.messages.append((kind, time_s, sector, stated))
        self.sectors += 1
        if kind == NORTH or self.sectors >= _SECTORS_BETWEEN:
            self.sectors = 0
            kinds, times, sectors, stated_s = (
                np.array(part) for part in zip(*self.messages, strict=True)
            )
            found = antenna_period_s(kinds, times, sectors, stated_s)
            self.period_s = self.stated_s if np.isnan(found) else found
        return self.period_s


class LiveClocks:
    """Times of day reported by known radars; owned by one thread.

    Parameters
    ----------
    known : int64[n]
        The sources to use; bounds the memory.
    scan_periods : mapping
        Configured scan periods, s, by source.
    """

    def __init__(self, known: Integers, scan_periods: Mapping[int, float]) -> None:
        self._known = known
        self._antennas = {
            source: _Antenna(scan_periods.get(source, np.nan), scan_periods.get(source, np.nan))
            for source in known.tolist()
        }
        # The last mark of each source, and its last sector mark; rows of `Marks`.
        self._last: dict[int, tuple[float, ...]] = {}
        self._last_sector: dict[int, tuple[float, ...]] = {}

    def extend(self, known: Integers, scan_periods: Mapping[int, float]) -> None:
        """Use further sources, too; those so far keep what is known about them."""
        more = LiveClocks(known, scan_periods)._antennas
        self._known, self._antennas = known, more | self._antennas

    def marks(self, rows: Rows, targets: Targets, service_rows: Rows, services: Services) -> Marks:
        """Return the times of day for reports, and retain those of this batch.

        Parameters
        ----------
        rows, targets
            Target reports in order; all of known sources.
        service_rows, services
            Service messages in order.

        Returns
        -------
        Marks
            Earlier marks (order below 0) and those among these records.
        """
        marks = marks_of(rows, targets, service_rows, services)
        place = np.searchsorted(service_rows.order, marks.order)
        of_service = ~np.isnan(marks.sector_deg)
        period_s = np.full(len(marks.order), np.nan)
        period_s[of_service] = self._update(service_rows, services)[place[of_service]]
        marks = _selected(replace(marks, period_s=period_s), np.isin(marks.source, self._known))
        before = self._before(rows)
        self._retain(marks)
        together = {
            one.name: np.concatenate([getattr(before, one.name), getattr(marks, one.name)])
            for one in fields(Marks)
        }
        return Marks(**together)

    def _update(self, rows: Rows, services: Services) -> Numbers:
        scan_periods = np.full(len(rows.order), np.nan)
        for k, (source, *message) in enumerate(
            zip(
                rows.source.tolist(),
                services.message.tolist(),
                services.time_s.tolist(),
                services.sector_deg.tolist(),
                services.period_s.tolist(),
                strict=True,
            )
        ):
            antenna = self._antennas.get(source)
            if antenna is not None:
                scan_periods[k] = antenna.push((message[0], message[1], message[2], message[3]))
        return scan_periods

    def _before(self, rows: Rows) -> Marks:
        """Return the retained marks of the sources of reports, or their first reception."""
        found = []
        sources, first = np.unique(rows.source, return_index=True)
        for source, place in zip(sources.tolist(), first.tolist(), strict=True):
            sector, last = self._last_sector.get(source), self._last.get(source)
            if sector is not None:
                found.append((-2.0, source, *sector))
            if last is None:
                received = float(rows.received_s[place]) % _DAY_S
                last = (received, received, np.nan, np.nan)
            found.append((-1.0, source, *last))
        table = np.array(sorted(found, key=lambda one: one[0]), np.float64).reshape(-1, 6)
        order, source = (table[:, k].astype(np.int64) for k in (0, 1))
        return Marks(order, source, *table[:, 2:].T)

    def _retain(self, marks: Marks) -> None:
        table = np.stack([marks.time_s, marks.received_s, marks.sector_deg, marks.period_s], axis=1)
        backwards = marks.source[::-1]
        for kept, own in (
            (self._last, np.ones(len(backwards), np.bool_)),
            (self._last_sector, ~np.isnan(marks.sector_deg)[::-1]),
        ):
            places = np.flatnonzero(own)
            sources, first = np.unique(backwards[places], return_index=True)
            for source, place in zip(sources.tolist(), places[first].tolist(), strict=True):
                kept[source] = tuple(table[len(table) - 1 - place].tolist())


def _selected(marks: Marks, own: Flags) -> Marks:
    return Marks(**{one.name: getattr(marks, one.name)[own] for one in fields(Marks)})
