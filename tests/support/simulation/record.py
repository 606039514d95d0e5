"""What a run has shown, and the invariants that it must have kept."""

import functools
import itertools
import json
import math
import re
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl

from multiradar import wire
from multiradar.errors import ConfigurationError, JournalError, MultiradarError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission.admission_by_time import data_clock_of
from multiradar.runtime.admission.sensors_in_force import SensorsInForce
from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.alarms.supervision import NO_DATA, SNAPSHOTS_FAILING
from multiradar.runtime.live.payload import decode_rows
from multiradar.runtime.live.receipt import SENDER_SEPARATOR
from multiradar.runtime.stream.events import GAP, Event
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import EngineOutput
from multiradar_schemas.measurements.columns import complete
from multiradar_schemas.reject import RejectCode
from support.simulation.engines import POISON_HEIGHT_M
from support.simulation.front import Exchange
from support.simulation.process import (
    JOURNAL,
    LIMITS,
    TRACKING,
    Process,
    read_marks,
    read_raw,
    sensor_table,
)
from support.simulation.traffic import START_S, Message

if TYPE_CHECKING:
    from support.simulation.datagrams import DatagramRecord
    from support.simulation.world import World

#: A row delivered within this time of its measurement is never late: half of the reorder horizon.
TIMELY_S = TRACKING.reorder_horizon_s / 2.0
#: Time from the reception of a measurement to the journal, s.
RECEPTION_S = 1.0
#: Answers after which a client sends again.
_AGAIN = {408, 429, 503, 507}
_CODES = {str(code) for code in RejectCode}
_OF_MACHINE_TIME = re.compile(
    rb'"(data_delay_s|silence_s|received_age_s|age_s|reception_age_s)":[^,}]*'
)


class Detected(Exception):  # noqa: N818  # what is to be expected
    """Damage of the journal was reported after the service had written on: the run ends."""


class Violation(AssertionError):  # noqa: N818  # the name of what it is
    """An invariant that did not hold."""

    def __init__(self, invariant: str, how: str) -> None:
        super().__init__(f"{invariant}: {how}")
        self.invariant = invariant


def require(held: object, invariant: str, how: str) -> None:
    """Raise `Violation` unless something holds."""
    if not held:
        raise Violation(invariant, how)


class Record:
    """Messages, receipts, digests and events of a run."""

    def __init__(self, datagrams: "DatagramRecord") -> None:
        self.datagrams = datagrams
        self.messages: list[Message] = []
        #: Receipts by sender and key, as the service gave them.
        self.receipts: dict[tuple[str, str], list[dict[str, Any]]] = {}
        #: Those from before a migration to other sensors, which may reject more.
        self._before: dict[tuple[str, str], dict[str, Any]] = {}
        #: Digests of the output by entry, of all processes.
        self.digests: dict[int, str] = {}
        self.events: dict[int, bytes] = {}
        self.kills = self.takeovers = self.migrations = 0
        #: Damage of the journal that was reported, and that was not, by kind.
        self.detected: Counter[str] = Counter()
        self.wrote_since_damage = False
        #: Number of the last event of the last process.
        self.event_head = 0

    # ---------------------------------------------------------------- during the run

    def answered(self, message: Message, exchange: Exchange) -> bool:
        """Check an answer; return whether it is final."""
        status = exchange.status
        document = json.loads(exchange.body)
        if status == 200 or (status == 422 and "accepted" in document):
            self._receipt(message, document)
            return True
        code = document.get("code")
        require(isinstance(code, str) and code, "I9", f"{status} without a code: {document}")
        require(status != 500, "I9", f"an unexpected error: {document}")
        if status in _AGAIN:
            require(
                status != 429 or b"retry-after" in exchange.headers, "I7", "429 without Retry-After"
            )
            return False
        expected = message.expected in ("error", "any")
        require(expected, "I9", f"{message.sender} {message.key}: {status} {document}")
        return True

    def _receipt(self, message: Message, document: dict[str, Any]) -> None:
        require(message.expected != "error", "I9", f"{message.key}: accepted, expected an error")
        own = self.receipts.setdefault((message.sender, message.key), [])
        if message.path.endswith("/measurements") and message.rows:
            total = document["accepted"] + len(document["rejected"])
            require(
                total == len(message.rows), "I1",
                f"{message.key}: {len(message.rows)} rows, receipt of {total}",
            )  # fmt: skip
        for row in document["rejected"]:
            require(row["code"] in _CODES, "I9", f"unknown code {row['code']}")
        effect = {name: document[name] for name in ("accepted", "rejected", "journal_sequence")}
        for earlier in own:
            same = all(earlier[name] == effect[name] for name in effect)
            require(same, "I4", f"{message.key}: {effect}, before {earlier}")
        before = self._before.get((message.sender, message.key))
        known = bool(own) or before is not None
        require(known <= document["duplicate"], "I4", f"{message.key}: taken twice")
        if before is not None:
            self._not_more(message.key, before, effect)
        own.append(effect)
        message.receipts.append(document)

    def sample(self, process: Process) -> None:
        """Note the output so far, and check bounds."""
        self.datagrams.check(process)
        service = process.service
        queued, backlog = service._intake._batches, service._backlog
        require(queued <= LIMITS.intake_batches_max, "I7", f"{queued} messages in the intake")
        most = max(LIMITS.backlog_rows_max, LIMITS.intake_rows_max)
        require(backlog.rows <= most, "I7", f"backlog {backlog.rows} rows")
        errors = service._accounting.internal_errors
        require(errors == 0, "I8", f"{errors} internal errors")
        processor = service._processor
        if processor is not None and processor.failure is None:
            self._same_digest(processor.processed, processor._digest.hexdigest())

    def _same_digest(self, sequence: int, digest: str) -> None:
        known = self.digests.setdefault(sequence, digest)
        require(known == digest, "I3", f"after entry {sequence} the output differs")

    def read(self, events: list[Event], after: int) -> bool:
        """Check what a reader of the stream received after an event; return whether a gap."""
        expected = after + 1
        for event in events:
            if event.kind == GAP:
                gap = json.loads(event.payload)["gap"]
                require(gap["from"] == expected, "I6", f"gap from {gap['from']}, not {expected}")
                expected = gap["to"] + 1
                continue
            require(event.sequence == expected, "I6", f"event {event.sequence}, not {expected}")
            expected += 1
            require(b"NaN" not in event.payload, "I6", "NaN in an event")
            payload = _OF_MACHINE_TIME.sub(b"", event.payload)
            if event.kind in ("track", "bias", "ended", "sensor"):
                known = self.events.setdefault(event.sequence, payload)
                require(known == payload, "I3", f"event {event.sequence} differs after a restart")
        return any(event.kind == GAP for event in events)

    def start_failed(self, error: MultiradarError, *, damaged: str, faulty: bool) -> None:
        """Check why a process did not start."""
        # Another fault may come before the damage is found.
        if damaged and (isinstance(error, JournalError) or not faulty):
            require(JOURNAL in str(error), "I8", f"the error does not name the file: {error}")
            self.detected[damaged] += 1
            return
        require(faulty, "I8", f"it does not start, without a fault: {error}")

    def receive(self, exchange: Exchange, status: int | None) -> None:
        """Check the answer to a request that is asked once."""
        found = exchange.status
        if found is not None and found >= 400:
            code = json.loads(exchange.body).get("code")
            require(bool(code) and found != 500, "I9", f"{found}: {exchange.body[:200]!r}")
        busy = found in _AGAIN
        require(status in (None, found) or busy, "I9", f"{found}, expected {status}")

    def started(self, process: Process) -> None:
        """Check the state after a start."""
        self.wrote_since_damage = True
        self.sample(process)

    def took_over(self, standby: Process) -> None:
        """Check the state after a takeover."""
        self.takeovers += 1
        self.started(standby)

    def level(self, primary: Process, standby: Process) -> None:
        """Check that a standby has processed all that the primary has."""
        processor = primary.service._processor
        assert processor is not None, "it runs"
        status = standby.service.view.status()
        found = [status[name] for name in ("role", "lag_entries", "processed_sequence")]
        require(found == ["standby", 0, processor.processed], "I6", f"the standby: {found}")
        self.sample(standby)

    def died(self, process: Process) -> None:
        """Note what a process that died had acknowledged."""
        self.kills += 1
        self.datagrams.ended(process, in_order=process.drained)
        for key, receipt in process.acknowledged:
            if key is None:
                continue
            sender, _, own = key.rpartition(SENDER_SEPARATOR)
            rejected = [
                {"index": row.index, "code": row.code, "reason": row.reason}
                for row in receipt.rejected
            ]
            self.receipts.setdefault((sender, own), []).append(
                {
                    "accepted": receipt.accepted, "rejected": rejected,
                    "journal_sequence": receipt.journal_sequence,
                }
            )  # fmt: skip

    def stopped(self, process: Process) -> None:
        """Check a process that was stopped at the end."""
        self.datagrams.ended(process, in_order=True)

    def migrated(self, *, changes: bool) -> None:
        """Note that the journal was migrated: to the same sensors, with which nothing changes."""
        self.migrations += 1
        if not changes:
            return
        self.datagrams.migrated()
        for name, (first, *_) in self.receipts.items():
            self._before.setdefault(name, first)
        self.receipts.clear()
        self.digests.clear()
        self.events.clear()
        for message in self.messages:
            message.receipts.clear()

    def migration_failed(self, error: MultiradarError, *, changes: bool) -> None:
        """Check why a journal was not migrated."""
        # It may be empty, and changes of sensors may not apply to others.
        empty = not (self.receipts or self._before)
        if changes:
            empty |= isinstance(error, ConfigurationError)
        require(empty, "I8", f"the journal is not migrated: {error}")

    def _not_more(self, key: str, before: dict[str, Any], effect: dict[str, Any]) -> None:
        place = "journal_sequence"
        same = before[place] == effect[place] and before["accepted"] >= effect["accepted"]
        require(same, "I2", f"{key}: {effect} after a migration, before {before}")
        rejected = [{row["index"] for row in one["rejected"]} for one in (before, effect)]
        require(rejected[0] <= rejected[1], "I2", f"{key}: no longer rejected: {rejected}")

    # ---------------------------------------------------------------- at the end

    def check_status(self, process: Process, silent_s: float | None) -> None:
        """Check counts, tracks and alarms of the last process.

        It has received nothing for at least so long, s; None if clocks were wrong.
        """
        status = process.service.view.status()
        parts = [status[name] for name in ("accepted", "rejected", "duplicate")]
        require(status["read"] == sum(parts), "I1", f"read {status['read']}, was {parts}")
        late = status["engine"]["LATE"]
        require(late == 0, "I1", f"{late} accepted measurements are not processed: late")
        self.event_head = status["event_sequence"]
        require(status["state"] == "running", "I8", f"{status['state']}: {status['failure']}")
        waiting = [status[name] for name in ("intake_rows", "backlog_rows")]
        require(not any(waiting), "I7", f"work is left: {waiting}")
        alarms, bound_s = set(status["alarms"]), status["silence_limit_s"]
        # The last snapshot may have met an error of the disk, and the next one is not due.
        failing = {SNAPSHOTS_FAILING} if process.disk.faulted else set()
        require(alarms <= {NO_DATA} | failing, "I8", f"alarms {alarms} after all faults")
        missed = NO_DATA not in alarms and (silent_s or 0.0) > bound_s + RECEPTION_S
        require(not missed, "I8", f"no alarm after {silent_s} s without data, limit {bound_s} s")
        tracks = process.service.view.tracks()
        for name, kind in tracks.schema.items():
            if kind.is_float():
                values = [one for one in tracks[name].to_list() if one is not None]
                require(all(map(math.isfinite, values)), "I6", f"{name} of a track is not finite")
        require((tracks["age_s"].drop_nulls() >= 0.0).all(), "I6", "negative age of a track")

    def check_journal(self, world: "World", folder: Path) -> None:
        """Compare the journal with all receipts, and the output with that of one engine."""
        entries = read_raw(folder / JOURNAL)
        require(
            [entry[0] for entry in entries] == list(range(1, len(entries) + 1)), "I1", "numbers"
        )
        keys: dict[tuple[str, str], tuple[Any, ...]] = {}
        for entry in entries:
            if entry[3] is not None:
                sender, _, key = entry[3].rpartition(SENDER_SEPARATOR)
                require((sender, key) not in keys, "I4", f"{key}: twice in the journal")
                keys[sender, key] = entry
        for name, receipts in self.receipts.items():
            require(name in keys, "I2", f"{name}: acknowledged, but not in the journal")
            for receipt in receipts:
                self._same_effect(name, receipt, keys[name])
        for name, before in self._before.items():
            require(name in keys, "I2", f"{name}: acknowledged, but lost in a migration")
            was, (sequence, *_, accepted, _, _) = before, keys[name]
            same = was["journal_sequence"] == sequence and was["accepted"] >= accepted
            require(same, "I2", f"{name}: receipt {was}, journal {keys[name][:6]}")
        for message in self.messages:
            found = keys.get((message.sender, message.key))
            if message.receipts and found is not None and message.rows:
                self._same_rows(message, found)
        self.datagrams.check_journal(entries)
        self._isolated(world)
        self._same_output(world, folder, entries)

    def _same_effect(
        self, name: tuple[str, str], receipt: dict[str, Any], entry: tuple[Any, ...]
    ) -> None:
        was = (receipt["journal_sequence"], receipt["accepted"])
        require(was == (entry[0], entry[5]), "I2", f"{name}: receipt {was}, journal {entry[:6]}")

    def _same_rows(self, message: Message, entry: tuple[Any, ...]) -> None:
        rejected = {row["index"] for row in message.receipts[0]["rejected"]}
        sent = [row for place, row in enumerate(message.rows) if place not in rejected]
        times = [] if not entry[4] else _rows(entry[4])["time_s"].to_list()
        require(
            [row["time_s"] for row in sent] == times, "I2", f"{message.key}: other rows on disk"
        )

    def _isolated(self, world: "World") -> None:
        """No row of a sensor without a fault, delivered in time, is rejected."""
        if world.all_suspect:
            return
        for message in self.messages:
            # A fault may have changed the sensor of its rows.
            sensors = {message.key.partition("/")[0]} | {row["sensor_id"] for row in message.rows}
            if message.expected != "ack" or sensors & world.suspects or not message.receipts:
                continue
            for row in message.receipts[0]["rejected"]:
                age_s = message.acknowledged_s - (message.rows[row["index"]]["time_s"] - START_S)
                require(
                    age_s > TIMELY_S, "I5",
                    f"{message.key}: rejected {row['code']} at an age of {age_s:.1f} s: "
                    f"{row['reason']}",
                )  # fmt: skip

    def _same_output(self, world: "World", folder: Path, entries: list[tuple[Any, ...]]) -> None:
        sensors = SensorsInForce.of(sensor_table(world.sensors), world.sensors)
        engine = Engine(sensors.table, TRACKING, 1, sampling=Sampling.DRAWN)
        marks = {"flush": engine.flush, "clock": engine.restart}
        digest = OutputDigest()
        skipped = self._skipped(folder, entries)
        batches = _batches(entries, sensors)
        before_s, events = -math.inf, _Events()
        for sequence, kind, _, _, payload, *_, admission in entries:
            clock_s = data_clock_of(admission)
            if sequence not in skipped:
                set_back, before_s = clock_s < before_s, clock_s
                output = None
                if kind == "flush" or (kind == "clock" and set_back):
                    output = marks[kind]()
                elif kind == "sensor":
                    sensors, change = sensors.changed(payload)
                    output = engine.change_sensors(sensors.table, change)
                elif sequence in batches:
                    output = engine.push(batches[sequence], clock_s)
                if output is not None:
                    digest.add(output)
                    events.add(output, ends=set_back and kind == "clock")
                    completed = engine.complete()
                    digest.add(completed)
                    events.add(completed, ends=False)
                    events.count += kind == "sensor"
            if sequence in self.digests:
                require(
                    self.digests[sequence] == digest.hexdigest(), "I3",
                    f"after entry {sequence} the output differs from that of one engine",
                )  # fmt: skip
        require(
            self.event_head == events.count, "I6",
            f"{self.event_head} events, the output has {events.count}",
        )  # fmt: skip
        engine.close()

    def _skipped(self, folder: Path, entries: list[tuple[Any, ...]]) -> set[int]:
        """Return the entries with a poisoned measurement, which alone are marked."""
        marked = set(read_marks(folder / JOURNAL))
        poisoned = {
            entry[0]
            for entry in entries
            if entry[1] == "batch"
            and entry[4]
            and (_rows(entry[4])["height_m"] == POISON_HEIGHT_M).any()
        }
        require(marked == poisoned, "I8", f"skipped {marked}, unprocessable {poisoned}")
        return poisoned


@functools.lru_cache(maxsize=1024)
def _rows(payload: bytes) -> pl.DataFrame:
    return decode_rows(payload)


def _batches(
    entries: list[tuple[Any, ...]], sensors: SensorsInForce
) -> dict[int, MeasurementBatch]:
    """Return the measurements of the entries; those between two changes are translated together."""
    found: dict[int, MeasurementBatch] = {}
    for is_change, part in itertools.groupby(entries, lambda entry: entry[1] == "sensor"):
        if not is_change:
            found |= _translated([entry for entry in part if entry[4]], sensors.table)
            continue
        for entry in part:
            sensors, _ = sensors.changed(entry[4])
    return found


def _translated(filled: list[tuple[Any, ...]], table: SensorTable) -> dict[int, MeasurementBatch]:
    if not filled:
        return {}
    frames = [complete(_rows(entry[4])) for entry in filled]
    whole, rejected = wire.measurement_batch(pl.concat(frames), table)
    require(not len(rejected), "I1", "the journal has rows that are not valid")
    ends = itertools.accumulate(map(len, frames), initial=0)
    return {
        entry[0]: whole.select(slice(first, last))
        for entry, (first, last) in zip(filled, itertools.pairwise(ends), strict=True)
    }


class _Events:
    """How many events output has: one for each update, bias and end, and each period of status.

    Those of changes of sensors are added by the caller.
    """

    def __init__(self) -> None:
        self.count = 0
        self._reached_s = -math.inf
        self._period = math.nan

    def add(self, output: EngineOutput, *, ends: bool) -> None:
        """Count the events of output; time starts over after it if it ends."""
        self.count += len(output.updates) + len(output.biases) + len(output.ended)
        for time_s in output.updates.time_s.tolist():
            self._reached_s = max(self._reached_s, time_s)
            period = self._reached_s // LIMITS.status_period_s
            self.count += period > self._period
            self._period = period
        if ends:
            self._reached_s, self._period = -math.inf, math.nan
