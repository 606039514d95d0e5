"""Live feeds: text as it is received becomes measurements, in batches."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import polars as pl

from multiradar_converters.adsb import table
from multiradar_converters.adsb.consistency import ConsistencyCheck
from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.batches import Batch, RejectedRecord
from multiradar_converters.adsb.reading.plain import KINDS
from multiradar_converters.adsb.reading.splitting import Lines
from multiradar_converters.asterix.decoding.sensor_clocks import clock_alarm, sensor_clock
from multiradar_converters.feeds.decoder import FeedDecoder
from multiradar_converters.feeds.recorded import SNAPSHOT_BYTES_MAX
from multiradar_schemas.measurements.directions import PLAIN_GROUND_SCHEMA
from multiradar_schemas.reject import RejectCode

#: Maximum aircraft of the consistency check; beyond it the check starts again.
AIRCRAFT_MAX = 1 << 16
#: Positions of a sensor whose delay is retained.
DELAYS_MAX = 512


@dataclass(frozen=True)
class FeedBatch:
    """Result of decoding.

    Attributes
    ----------
    frame : DataFrame
        Measurements, columns of `PLAIN_GROUND_SCHEMA` and `table.OPTIONAL`, in the order of
        reception.
    rejected : list of RejectedRecord
        Rejected reports and messages; their place is a line, or an octet of a snapshot.
    read, duplicate, without_position : int
        Reports and unreadable messages, repeated positions, and messages without a position;
        read = len(frame) + len(rejected) + duplicate.
    """

    frame: pl.DataFrame
    rejected: list[RejectedRecord]
    read: int
    duplicate: int
    without_position: int


class LiveFeed:
    """Decodes the text of a feed in the order of reception; owned by one thread.

    Parameters
    ----------
    name : str
        Its name, for messages.
    sensors : mapping of str to str
        Identifier of the sensor of each kind, `adsb` and `mlat`.
    at_reception : bool
        Whether positions count at their reception.
    """

    def __init__(self, name: str, sensors: Mapping[str, str], *, at_reception: bool) -> None:
        self._name = name
        self._sensors = dict(sensors)
        self._decoder = FeedDecoder(at_reception=at_reception)
        self._lines = Lines()
        self._before = 0
        self._check = ConsistencyCheck(name)
        self._delays = {kind: deque[float](maxlen=DELAYS_MAX) for kind in KINDS}

    def __len__(self) -> int:
        return len(self._decoder)

    def push(self, text: bytes, received_s: float) -> None:
        """Decode the lines that end in a piece of text."""
        for piece in self._lines.push(text):
            for fault in piece.faults:
                place = self._before + fault.place
                self._decoder.reject(place, fault.code, fault.reason, fault.raw)
            for k, place in enumerate(piece.places.tolist()):
                self._decoder.line(piece.raw(k), self._before + place, received_s)

    def document(self, text: bytes, received_s: float) -> None:
        """Decode a snapshot of all aircraft."""
        if len(text) > SNAPSHOT_BYTES_MAX:
            reason = f"expected at most {SNAPSHOT_BYTES_MAX} octets, found more"
            self._decoder.reject(0, RejectCode.TOO_LARGE, reason, text)
        else:
            self._decoder.document(text, 0, received_s)

    def end(self) -> None:
        """End the text: the connection was lost; an incomplete line is rejected."""
        left = self._lines.carry
        self._before += self._lines.lines
        self._lines = Lines()
        if left.strip():
            self._before += 1
            reason = "the connection was closed in the middle of a line"
            self._decoder.reject(self._before, RejectCode.TRUNCATED, reason, left)

    def drain(self) -> FeedBatch:
        """Return what was decoded since the last call."""
        batch = self._decoder.drain()
        if self._check.aircraft > AIRCRAFT_MAX:
            self._check = ConsistencyCheck(self._name)
        valid = self._check.push(batch)
        self._note_delays(batch)
        numbers, words = batch.numbers[:, valid], batch.words[:, valid]
        records = table.records_of(numbers, words, batch.sigma_of(valid))
        named = pl.col("kind").replace_strict(self._sensors, return_dtype=pl.String)
        frame = table.frame(records).with_columns(sensor_id=named)
        return FeedBatch(
            frame.select(*PLAIN_GROUND_SCHEMA, *table.OPTIONAL),
            batch.rejected,
            batch.found,
            batch.duplicate,
            batch.other,
        )

    def clocks(self) -> dict[str, dict[str, object]]:
        """Return clock offset, latency and alarm of each sensor from its last positions.

        Multilateration is late by its computation; it has no alarm.
        """
        found = {}
        for kind, delays in self._delays.items():
            if delays:
                clock = sensor_clock(np.array(delays), np.empty(0))
                alarm = clock_alarm(clock) if kind == "adsb" else None
                code, reason = alarm or (None, None)
                found[self._sensors[kind]] = clock.document() | {"alarm": code, "reason": reason}
        return found

    def _note_delays(self, batch: Batch) -> None:
        if batch.received_s is None:
            return
        delay_s = batch.received_s - batch.numbers[roles.TIME]
        kind = np.maximum(batch.words[roles.KIND - roles.FIRST_WORD], 0)
        for number, name in enumerate(KINDS):
            self._delays[name].extend(delay_s[kind == number][-DELAYS_MAX:].tolist())


def warm_up() -> None:
    """Compile the kernels before the first message."""
    feed = LiveFeed("", dict(zip(KINDS, KINDS, strict=True)), at_reception=False)
    feed.push(b'{"now": 1e9, "hex": "4ca8d1", "lat": 1.0, "lon": 1.0}\n', 1e9)
    feed.drain()
