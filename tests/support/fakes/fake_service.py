"""A fake service without journal and engine, for tests of the HTTP side."""

import math
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import polars as pl

from multiradar.errors import LiveStreamError, QuarantineError
from multiradar.runtime.admission.sensors_in_force import SensorPlan, SensorsInForce
from multiradar.runtime.live.readiness import Reason
from multiradar.runtime.live.receipt import Receipt, RejectedRow
from multiradar.runtime.picture.air_picture import Asked
from multiradar.runtime.picture.frames import encoded
from multiradar.runtime.picture.past import PastAsked
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.queries.encounters import no_encounters
from multiradar.runtime.queries.forecasts import forecast_steps
from multiradar.runtime.queries.neighbouring_regions import NO_REGIONS
from multiradar.runtime.queries.parameters import BUNDLE, checked
from multiradar.runtime.queries.registry import (
    BIASES,
    ENCOUNTERS,
    FORECAST,
    MANOEUVRE_PLANE,
    OBSERVABILITY,
    REGIONS,
    RESIDUALS,
    UPDATES,
    History,
    Query,
)
from multiradar.runtime.stream.events import Event, EventRing, Subscription
from multiradar.storage.entries import Quarantined
from multiradar.tracking.forecast.regions import gaussian_factor
from multiradar_schemas.products.bias import BIAS_SCHEMA
from multiradar_schemas.products.track import TRACK_SCHEMA
from multiradar_schemas.products.transition import TRANSITION_SCHEMA
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios import live_scene

LIVE_SCHEMA = pl.Schema({**TRACK_SCHEMA, "age_s": pl.Float64()})


# Each fake service has them, and no test changes them.
@cache
def live_tracks(count: int) -> pl.DataFrame:
    """Tracks 1 to `count`, one degree of longitude apart from each other, time 1000 s and on."""
    number = pl.int_range(1, count + 1, eager=True)
    frame = pl.select(
        time_s=1000.0 + number,
        track_id=number,
        track_number=pl.when(number % 2 == 0).then(number + 100),
        mode_s_address=pl.when(number % 3 != 0).then(
            pl.lit("4840") + (number % 100).cast(pl.String).str.zfill(2)
        ),
        mode_3a=pl.when(number % 4 == 0).then(pl.lit("7000")),
        latitude_deg=50.0 + (number % 10) / 10.0,
        longitude_deg=(number - 180.0) % 360.0 - 180.0,
        height_m=pl.when(number % 5 != 0).then(9000.0 + number),
        speed_mps=200.0 + number % 50,
        heading_deg=(number * 7.25) % 360.0,
        position_sigma_m=35.5 + number / 1e3,
        state=pl.lit("confirmed"),
        sequence=number,
        sensor_id=pl.lit("41-10"),
        velocity_sigma_mps=pl.lit(1.5),
        turn_right_probability=pl.when(number % 2 == 0).then(0.25),
        turn_left_probability=pl.when(number % 2 == 0).then(0.125),
        speed_change_probability=pl.when(number % 2 == 0).then(0.5),
        vertical_rate_mps=pl.when(number % 5 != 0).then(-2.5),
        height_sigma_m=pl.when(number % 5 != 0).then(3.0),
        adsb_implausible=number % 3 == 0,
        on_ground=pl.lit(None, pl.Boolean),
        callsign=pl.when(number % 6 == 0).then(pl.format("TST{}", number)),
        measured_mode_s_address=pl.when(number % 3 != 0).then(
            pl.lit("4840") + (number % 100).cast(pl.String).str.zfill(2)
        ),
        age_s=count - number,
    )
    return frame.cast(LIVE_SCHEMA).select(LIVE_SCHEMA.names())


def updates_of(track_id: int, count: int, same_time: int = 1) -> pl.DataFrame:
    """Updates of one track, `same_time` of them at each second from 0 on."""
    frame = live_tracks(count)
    return frame.drop("age_s").with_columns(
        time_s=(pl.int_range(count) // same_time).cast(pl.Float64),
        track_id=pl.lit(track_id, pl.Int64),
    )


@dataclass
class FakeView:
    """The readable state, set by the test."""

    live: pl.DataFrame = field(default_factory=lambda: live_tracks(10))
    updates: dict[int, pl.DataFrame] = field(default_factory=dict)
    steps: dict[int, pl.DataFrame] = field(default_factory=dict)
    biases: pl.DataFrame = field(default_factory=lambda: pl.DataFrame(schema=BIAS_SCHEMA))
    ring: EventRing = field(default_factory=lambda: EventRing(1000))
    page_rows_max: int = 10_000
    forecast_steps_max: int = 1000
    failure: Exception | None = None
    asked_at_s: float | None = None
    asked: EncounterQuery | None = None
    #: What queries raise, by name; of forecasts, those by bundle alone.
    failures: dict[str, Exception] = field(default_factory=dict)
    #: Threads that have asked for all tracks.
    readers: list[int] = field(default_factory=list)
    gate: threading.Event | None = None

    def tracks(self, at_s: float | None = None) -> pl.DataFrame:
        self.asked_at_s = at_s
        self.readers.append(threading.get_ident())
        if self.failure is not None:
            raise self.failure
        if self.gate is not None:
            self.gate.wait(WAIT_TIMEOUT_S)
        return self.live

    def aircraft_json(self) -> bytes:
        return b'{"now":1010.0,"messages":0,"aircraft":[]}'

    def receiver_json(self) -> dict[str, Any]:
        return {"version": "multiradar", "refresh": 1000, "history": 0}

    def track(self, track_id: int) -> dict[str, Any] | None:
        rows = self.live.filter(pl.col("track_id") == track_id)
        return rows.row(0, named=True) if len(rows) else None

    def rows(
        self,
        history: History,
        subject: int | str,
        since_s: float | None,
        limit: int,
        until_s: float | None = None,
    ) -> pl.DataFrame:
        if history is BIASES:
            rows = self.biases.filter(pl.col("sensor_id") == subject)
        elif history is UPDATES:
            rows = self.updates.get(int(subject), self.live.drop("age_s").clear())
        else:
            rows = self.steps.get(int(subject), pl.DataFrame(schema=TRANSITION_SCHEMA))
        if until_s is not None:
            begin_s = -math.inf if since_s is None else since_s
            return rows.filter(pl.col("time_s").is_between(begin_s, until_s)).tail(limit)
        if since_s is None:
            return rows.tail(limit)
        return rows.filter(pl.col("time_s") >= since_s).head(limit)

    def ask(
        self, query: Query, track_id: int | None = None, at_s: float | None = None, /, **given: Any
    ) -> dict[str, Any] | None:
        values = checked(query.parameters, given)
        if query is ENCOUNTERS:
            self.asked = EncounterQuery(**values)
            return no_encounters(self.asked)
        if query is RESIDUALS:
            return {"time_s": None, **values, "sensors": []}
        if query is REGIONS:
            return NO_REGIONS
        failure = self.failures.get(query.name)
        if failure is not None and values.get("by", BUNDLE) == BUNDLE:
            raise failure
        track = self.track(track_id or 0)
        if query is FORECAST:
            return self._forecast(track, **values)
        if track is None:
            return None
        more = {MANOEUVRE_PLANE: {"is_planar": True}, OBSERVABILITY: {"is_observable": False}}
        return {"track_id": track_id, **values, **more.get(query, {})}

    def _forecast(
        self, track: dict[str, Any] | None, horizon_s: float, step_s: float, probability: float,
        by: str,
    ) -> dict[str, Any] | None:  # fmt: skip
        steps_s = forecast_steps(horizon_s, step_s, self.forecast_steps_max)
        if track is None:
            return None
        points = [
            {
                "time_s": track["time_s"] + step_s,
                "latitude_deg": track["latitude_deg"],
                "longitude_deg": track["longitude_deg"],
                "height_m": track["height_m"],
                "covariance_east_m2": 400.0,
                "covariance_east_north_m2": 0.0,
                "covariance_north_m2": 400.0,
                "position_sigma_m": 28.28,
                "region_major_m": 20.0 * gaussian_factor(probability) ** 0.5,
                "region_minor_m": 20.0 * gaussian_factor(probability) ** 0.5,
                "region_azimuth_deg": 0.0,
                "region_factor": gaussian_factor(probability),
                "calibrated": True,
                "motion": "straight",
                "state": track["state"],
                "age_s": track["age_s"] + step_s,
            }
            for step_s in steps_s.tolist()
        ]
        known = {"track_id": track["track_id"], "probability": probability, "by": by}
        return {**known, "points": points}

    def sensors(self, at_s: float | None = None) -> list[dict[str, Any]]:
        biases = self.biases.filter(pl.col("sensor_id") == "41-10").tail(2).to_dicts()
        known = {"id": "41-10", "kind": "radar", "updates": 7, "range_max_m": float("inf")}
        return [{**known, "biases": biases}]

    def picture(self, asked: Asked) -> bytes:
        return encoded({"next": asked.after or 0}, {"tracks": {}, "plots": {}})

    def ready_picture(self, asked: Asked) -> None:
        return None

    def past_picture(self, asked: PastAsked) -> bytes:
        return encoded(asked._asdict(), {"tracks": {}, "plots": {}})

    def status(self) -> dict[str, Any]:
        return {"version": "0.1.0", "data_time_s": None, "event_sequence": self.ring.head}

    @property
    def sent_before(self) -> int:
        return self.ring.sent_before

    def subscribe(self, after: int | None, depth: int) -> Subscription:
        return self.ring.subscribe(after, depth)

    def add_events(self, count: int, kind: str = "track", padding: int = 0) -> None:
        """Append events to the ring."""
        first = self.ring.head + 1

        def encode() -> Sequence[Event]:
            filler = b"x" * padding
            return [
                Event(number, kind, "7", b'{"number":%d,"padding":"%s"}' % (number, filler))
                for number in range(first, first + count)
            ]

        self.ring.append(count, lambda begin, end: encode()[begin:end])


@dataclass
class Submission:
    """The arguments of one call of `submit`."""

    frame: pl.DataFrame
    source: str
    idempotency_key: str | None
    rejected: tuple[RejectedRow, ...]


@dataclass
class FakeService:
    """Collects measurements and acknowledges them at once, or as set by the test."""

    view: FakeView = field(default_factory=FakeView)
    submissions: list[Submission] = field(default_factory=list)
    flushes: list[str] = field(default_factory=list)
    clocks: list[float] = field(default_factory=list)
    sensors: SensorsInForce = field(
        default_factory=lambda: SensorsInForce.of(live_scene.sensors(), live_scene.sensors_file())
    )
    sensor_changes: list[tuple[str, str | None]] = field(default_factory=list)
    #: Sensors in real time: a stream ends only by force.
    live: tuple[str, ...] = ()
    failure: Exception | None = None
    reasons: tuple[Reason, ...] = ()
    stalled: str = ""
    start_step: str = ""
    quarantined_sources: tuple[str, ...] = ()
    unreadable: list[tuple[str, int]] = field(default_factory=list)
    quarantine: list[Quarantined] = field(default_factory=list)
    answer: Callable[[Submission, "Future[Receipt]"], None] | None = None
    _receipts: dict[str, Receipt] = field(default_factory=dict)

    def unready(self) -> tuple[Reason, ...]:
        return self.reasons

    def quarantined(self, after: int, limit: int, code: str | None = None) -> list[Quarantined]:
        rows = [row for row in self.quarantine if code in (None, row.row.code)]
        return [row for row in rows if row.number > after][:limit]

    def require_source(self, source: str) -> None:
        if source in self.quarantined_sources:
            raise QuarantineError(source, 0.5)

    def note_unreadable(self, source: str, octets: int) -> None:
        self.unreadable.append((source, octets))

    def submit(
        self,
        frame: pl.DataFrame,
        *,
        source: str,
        idempotency_key: str | None = None,
        rejected: Sequence[RejectedRow] = (),
    ) -> "Future[Receipt]":
        if self.failure is not None:
            raise self.failure
        submission = Submission(frame, source, idempotency_key, tuple(rejected))
        future: Future[Receipt] = Future()
        if self.answer is not None:
            self.answer(submission, future)
            return future
        known = None if idempotency_key is None else self._receipts.get(idempotency_key)
        if known is not None:
            future.set_result(Receipt(known.accepted, known.rejected, True, known.journal_sequence))
            return future
        self.submissions.append(submission)
        receipt = Receipt(frame.height, tuple(rejected), False, len(self.submissions))
        if idempotency_key is not None:
            self._receipts[idempotency_key] = receipt
        future.set_result(receipt)
        return future

    def flush(
        self, *, source: str, idempotency_key: str | None = None, force: bool = False
    ) -> "Future[Receipt]":
        if self.failure is not None:
            raise self.failure
        if self.live and not force:
            raise LiveStreamError(self.live)
        self.flushes.append(source)
        future: Future[Receipt] = Future()
        future.set_result(Receipt(0, (), False, len(self.submissions) + len(self.flushes)))
        return future

    def set_clock(
        self, time_s: float, *, source: str, idempotency_key: str | None = None
    ) -> "Future[Receipt]":
        self.clocks.append(time_s)
        future: Future[Receipt] = Future()
        future.set_result(Receipt(0, (), False, 1))
        return future

    def describe_sensor(self, sensor_id: str) -> dict[str, Any] | None:
        return self.sensors.description(sensor_id)

    def plan_sensor(
        self, sensor_id: str, values: Mapping[str, Any], *, reset_biases: bool = False
    ) -> SensorPlan:
        return self.sensors.plan(sensor_id, values, reset_biases=reset_biases)

    def change_sensor(
        self, change: bytes, *, source: str, idempotency_key: str | None = None
    ) -> "Future[Receipt]":
        future: Future[Receipt] = Future()
        keys = [key for _, key in self.sensor_changes]
        if idempotency_key is not None and idempotency_key in keys:
            future.set_result(Receipt(0, (), True, keys.index(idempotency_key) + 1))
            return future
        self.sensors, _ = self.sensors.changed(change)
        self.sensor_changes.append((source, idempotency_key))
        future.set_result(Receipt(0, (), False, len(self.sensor_changes)))
        return future

    def has_message(self, idempotency_key: str) -> bool:
        return idempotency_key in [key for _, key in self.sensor_changes]
