"""Decodes the messages of a feed; one decoder for recordings and for live data.

The beginning of a message determines its format: `{` JSON, a name such as `MSG` BaseStation, a
number mlat-server. Every message is one of

========== ================================================================================
accepted   a position
rejected   malformed, out of bounds, or not a position of the aircraft or of multilateration
duplicate  the position of an aircraft once more: feeds repeat the last one every second
other      without a position; callsigns, codes and speeds are used
========== ================================================================================

A position of one aircraft at the same place within `REPEATED_S` is a duplicate: times of reception
are rounded to tenths of a second twice, as `now` and as `seen_pos`.
"""

from dataclasses import dataclass, field

import numpy as np

from multiradar_converters.adsb.reading import plain, roles
from multiradar_converters.adsb.reading.batches import Batch, RejectedRecord
from multiradar_converters.adsb.reading.layout import Layout
from multiradar_converters.feeds import basestation, layouts, multilateration, readsb
from multiradar_converters.feeds.ages import RegisterAges
from multiradar_converters.feeds.aircraft import Aircraft
from multiradar_converters.vid.text.lines import RejectedError
from multiradar_schemas.reject import RejectCode

#: Same positions within this time are duplicates, s; aircraft send one every half second.
REPEATED_S = 0.25
#: Octets of a reject that are retained.
KEPT_BYTES_MAX = 4096

# Times of BaseStation messages may be local ones; zones are whole quarters of an hour.
_ZONE_S, _ZONE_MAX_S = 900.0, 14 * 3600.0
#: Maximum difference of the clocks of receiver and service for a zone to be certain, s.
CLOCK_MAX_S = 60.0


@dataclass
class _Last:
    """The last position of an aircraft."""

    latitude: float = np.nan
    longitude: float = np.nan
    time_s: float = np.nan


@dataclass
class _Collected:
    """What was decoded since the last batch."""

    rows: list[plain.Row] = field(default_factory=list)
    places: list[int] = field(default_factory=list)
    raws: list[bytes] = field(default_factory=list)
    received_s: list[float] = field(default_factory=list)
    sigma_m: list[float] = field(default_factory=list)
    rejected: list[RejectedRecord] = field(default_factory=list)
    duplicate: int = 0
    other: int = 0
    old: int = 0


class FeedDecoder:
    """Decodes messages in order.

    Parameters
    ----------
    utc_offset_s : float
        Local time of BaseStation messages minus UTC, s; if they have a time of reception, it
        determines the zone instead.
    at_reception : bool
        Whether positions count at their reception, because the clock of the receiver is wrong.
    """

    def __init__(self, *, utc_offset_s: float = 0.0, at_reception: bool = False) -> None:
        self._utc_offset_s = utc_offset_s
        self._at_reception = at_reception
        self._base_station = basestation.BaseStation()
        self._last = Aircraft(_Last)
        self._ages = RegisterAges()
        self._collected = _Collected()

    def __len__(self) -> int:
        collected = self._collected
        return len(collected.rows) + len(collected.rejected)

    def line(self, raw: bytes, place: int, received_s: float | None = None) -> None:
        """Decode a line.

        Parameters
        ----------
        raw : bytes
            The line without its end.
        place : int
            Its number.
        received_s : float, optional
            Unix time of its reception, s.
        """
        message = raw.strip()
        if not message:
            return
        try:
            if message.startswith(readsb.BEGIN):
                self._json(message, place, received_s)
            elif basestation.BEGIN.match(message):
                cells = self._base_station.cells(message)
                self._message(cells, layouts.BASESTATION, place, raw, received_s)
            elif message[:1].isdigit():
                cells = multilateration.cells(message)
                self._message(cells, layouts.MULTILATERATION, place, raw, received_s)
            else:
                shown = message[:40].decode("utf-8", "backslashreplace")
                reason = f"expected JSON, BaseStation or mlat-server CSV, found {shown!r}"
                raise RejectedError(RejectCode.MALFORMED_LINE, reason)
        except RejectedError as error:
            self.reject(place, error.code, error.reason, raw)

    def document(self, raw: bytes, place: int, received_s: float | None = None) -> None:
        """Decode snapshots.

        Parameters
        ----------
        raw : bytes
            One or several.
        place : int
            Where the text begins: the place of an aircraft is this plus its octet in the text.
        received_s : float, optional
            Unix time of their reception, s.
        """
        self._document(raw, place, received_s, by_octet=True)

    def _document(
        self, raw: bytes, place: int, received_s: float | None, *, by_octet: bool
    ) -> None:
        cut = raw.lstrip()[:1] == readsb.BEGIN and raw.rstrip()[-1:] != b"}"
        # Every octet is one character, so that places are octets.
        for snapshot in readsb.snapshots(raw.decode("latin-1")):
            for element in snapshot.elements:
                octets = element.raw.encode("latin-1")
                where = place + element.place if by_octet else place
                try:
                    self._aircraft(element.values, snapshot.now, where, octets, received_s)
                except RejectedError as error:
                    self.reject(where, error.code, error.reason, octets)
            if snapshot.fault is not None:
                fault = snapshot.fault
                code = RejectCode.TRUNCATED if cut else RejectCode.MALFORMED_JSON
                where = place + fault.place if by_octet else place
                end = fault.place + min(fault.octets, KEPT_BYTES_MAX)
                self.reject(where, code, fault.reason, raw[fault.place : end])

    def reject(self, place: int, code: RejectCode, reason: str, raw: bytes) -> None:
        """Reject a message."""
        kept = RejectedRecord(place, code, reason, raw[:KEPT_BYTES_MAX])
        self._collected.rejected.append(kept)

    def drain(self) -> Batch:
        """Return what was decoded since the last call."""
        collected, self._collected = self._collected, _Collected()
        count = len(collected.rows)
        numbers, words = np.empty((roles.NUMBERS, count)), np.empty((roles.WORDS, count), np.int64)
        for k, row in enumerate(collected.rows):
            numbers[:, k], words[:, k] = row.numbers, row.words
        return Batch(
            numbers,
            words,
            np.array(collected.places, dtype=np.int64),
            collected.raws.__getitem__,
            collected.rejected,
            found=count + len(collected.rejected) + collected.duplicate,
            duplicate=collected.duplicate,
            other=collected.other,
            old=collected.old,
            received_s=np.array(collected.received_s),
            sigma_m=np.array(collected.sigma_m, dtype=np.float64),
        )

    # ---------------------------------------------------------------- inside

    def _json(self, message: bytes, place: int, received_s: float | None) -> None:
        values = readsb.parsed(message.decode("latin-1"))
        if readsb.is_snapshot(values):
            self._document(message, place, received_s, by_octet=False)
        else:
            self._aircraft(values, readsb.now_of(values), place, message, received_s)

    def _aircraft(
        self, values: object, now: str, place: int, raw: bytes, received_s: float | None
    ) -> None:
        if received_s is not None and (self._at_reception or not now):
            now = repr(received_s)
        cells = readsb.cells(values, now)
        old = cells is not None and self._ages.omit_old(cells, *readsb.message_of(cells, now))
        if self._add(cells, layouts.READSB, place, raw, received_s) and old:
            self._collected.old += 1

    def _message(
        self, cells: dict[int, str] | None, layout: Layout, place: int, raw: bytes,
        received_s: float | None,
    ) -> None:  # fmt: skip
        if cells is not None and self._at_reception and received_s is not None:
            cells[roles.TIME] = repr(received_s)
        elif cells is not None and layout is layouts.BASESTATION:
            cells[roles.TIME] = repr(self._in_utc(float(cells[roles.TIME]), received_s))
        self._add(cells, layout, place, raw, received_s)

    def _add(
        self, cells: dict[int, str] | None, layout: Layout, place: int, raw: bytes,
        received_s: float | None,
    ) -> bool:  # fmt: skip
        """Collect a report; return whether it was accepted."""
        if cells is None:
            self._collected.other += 1
            return False
        sigma_m = float(cells.pop(layouts.SIGMA, "nan"))
        row = plain.read_cells(cells, layout)
        fault = plain.fault_of(row, layout)
        if fault is not None:
            raise fault
        time_s, latitude, longitude = (
            row.numbers[role] for role in (roles.TIME, roles.LATITUDE, roles.LONGITUDE)
        )
        last = self._last.of(row.words[roles.ADDRESS - roles.FIRST_WORD], time_s)
        same = latitude == last.latitude and longitude == last.longitude
        if same and abs(time_s - last.time_s) <= REPEATED_S:
            self._collected.duplicate += 1
            return False
        last.latitude, last.longitude, last.time_s = latitude, longitude, time_s
        self._collected.rows.append(row)
        self._collected.places.append(place)
        self._collected.raws.append(raw)
        self._collected.received_s.append(np.nan if received_s is None else received_s)
        self._collected.sigma_m.append(sigma_m)
        return True

    def _in_utc(self, time_s: float, received_s: float | None) -> float:
        if received_s is None:
            return time_s - self._utc_offset_s
        ahead_s = time_s - received_s
        zone_s = round(ahead_s / _ZONE_S) * _ZONE_S
        if abs(ahead_s - zone_s) > CLOCK_MAX_S or abs(zone_s) > _ZONE_MAX_S:
            reason = (
                f"date and time: expected a time within {CLOCK_MAX_S:g} s of reception, in UTC or "
                f"a time zone, differed by {ahead_s:+.0f} s: set the receiver clock, or set "
                'times = "reception"'
            )
            raise RejectedError(RejectCode.OUT_OF_RANGE, reason)
        return time_s - zone_s
