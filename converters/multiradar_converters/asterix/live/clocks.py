"""What radars said of their clocks and antennas so far, where records come one after another.

The times of a recording are found with all of it at hand; those of a network with what came
before. Until a radar has told a time of day, its clock is taken to be that of the reception. All of
this is a function of the records alone, not of how many came at once.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace

import numpy as np

from multiradar_converters.asterix.decoding.clocks import Marks
from multiradar_converters.asterix.decoding.gathering import Rows
from multiradar_converters.asterix.decoding.services import NORTH, Services, turn_s
from multiradar_converters.asterix.decoding.targets import Targets
from multiradar_converters.asterix.decoding.timing import marks_of
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers

_DAY_S = 86_400.0
#: Service messages of an antenna that its turn is found from: eight turns of 32 sectors.
MESSAGES_KEPT = 256
# Sectors between two searches for the turn where there are no north marks.
_SECTORS_BETWEEN = 8

# Message, time, sector and stated turn.
_Message = tuple[int, float, float, float]


@dataclass
class _Antenna:
    """Messages of one antenna, and its turn."""

    turn_s: float = np.nan
    stated_s: float = np.nan
    messages: deque[_Message] = field(default_factory=lambda: deque(maxlen=MESSAGES_KEPT))
    sectors: int = 0

    def hear(self, message: _Message) -> float:
        """Take a message; return the turn as it is known then, s."""
        kind, time_s, sector, stated = message
        if np.isnan(time_s):
            return self.turn_s
        if self.messages:
            time_s += _DAY_S * round((self.messages[-1][1] - time_s) / _DAY_S)
        # Two networks bring a message twice: no turn takes as little as lies between the two.
        self.messages.append((kind, time_s, sector, stated))
        self.sectors += 1
        if kind == NORTH or self.sectors >= _SECTORS_BETWEEN:
            self.sectors = 0
            kinds, times, sectors, turns = (
                np.array(part) for part in zip(*self.messages, strict=True)
            )
            found = turn_s(kinds, times, sectors, turns)
            self.turn_s = self.stated_s if np.isnan(found) else found
        return self.turn_s


class LiveClocks:
    """Times of day that known radars gave so far; owned by one thread.

    Parameters
    ----------
    known : int64[n]
        The sources whose words count: bounds the memory.
    turns : mapping
        Times of a turn that are stated, s, by source.
    """

    def __init__(self, known: Integers, turns: Mapping[int, float]) -> None:
        self._known = known
        self._antennas = {
            source: _Antenna(turns.get(source, np.nan), turns.get(source, np.nan))
            for source in known.tolist()
        }
        # The last mark of each source, and its last of a sector; rows of `Marks`.
        self._last: dict[int, tuple[float, ...]] = {}
        self._last_sector: dict[int, tuple[float, ...]] = {}

    def marks(self, rows: Rows, targets: Targets, service_rows: Rows, services: Services) -> Marks:
        """Return the times of day that count for reports, and remember those that came with them.

        Parameters
        ----------
        rows, targets
            Target reports, in their order; all of known sources.
        service_rows, services
            Service messages, in their order.

        Returns
        -------
        Marks
            Marks from before (order below 0) and those among these records.
        """
        marks = marks_of(rows, targets, service_rows, services)
        place = np.searchsorted(service_rows.order, marks.order)
        of_service = ~np.isnan(marks.sector_deg)
        turn = np.full(len(marks.order), np.nan)
        turn[of_service] = self._hear(service_rows, services)[place[of_service]]
        marks = _taken(replace(marks, turn_s=turn), np.isin(marks.source, self._known))
        before = self._before(rows)
        self._remember(marks)
        together = {
            one.name: np.concatenate([getattr(before, one.name), getattr(marks, one.name)])
            for one in fields(Marks)
        }
        return Marks(**together)

    def _hear(self, rows: Rows, services: Services) -> Numbers:
        turns = np.full(len(rows.order), np.nan)
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
                turns[k] = antenna.hear((message[0], message[1], message[2], message[3]))
        return turns

    def _before(self, rows: Rows) -> Marks:
        """Return what is remembered of the sources of reports, or when they first came."""
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

    def _remember(self, marks: Marks) -> None:
        table = np.stack([marks.time_s, marks.received_s, marks.sector_deg, marks.turn_s], axis=1)
        backwards = marks.source[::-1]
        for kept, own in (
            (self._last, np.ones(len(backwards), np.bool_)),
            (self._last_sector, ~np.isnan(marks.sector_deg)[::-1]),
        ):
            places = np.flatnonzero(own)
            sources, first = np.unique(backwards[places], return_index=True)
            for source, place in zip(sources.tolist(), places[first].tolist(), strict=True):
                kept[source] = tuple(table[len(table) - 1 - place].tolist())


def _taken(marks: Marks, own: Flags) -> Marks:
    return Marks(**{one.name: getattr(marks, one.name)[own] for one in fields(Marks)})
