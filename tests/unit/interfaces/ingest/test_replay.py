"""A replay paces, retries, and never loses or doubles a batch."""

from pathlib import Path

import polars as pl
import pytest

from multiradar.clock import FixedClock
from multiradar.errors import PeerError, StreamGoesOnError, UnavailableError
from multiradar.ingest.replay.memory import MemoryDestination
from multiradar.ingest.replay.replaying import (
    BACKOFF_MAX_S,
    FIRST_CONTACT_S,
    RETRY_AFTER_MAX_S,
    SILENCE_MAX_S,
    Answer,
    Replay,
    ReplayPlan,
    backoff_s,
    derived_run_name,
    replay_batches,
)
from multiradar.storage import recording as recording_module
from multiradar.storage.recording import Recording
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA


def _recording(folder: Path, times: list[float], kinds: list[str] | None = None) -> Recording:
    path = folder / "measurements.parquet"
    pl.DataFrame(
        {
            "time_s": times,
            "sensor_id": ["1-1"] * len(times),
            "kind": kinds or ["radar"] * len(times),
            "range_m": [float(n) for n in range(len(times))],
        }
    ).with_columns(
        pl.lit(None, dtype).alias(name)
        for name, dtype in MEASUREMENT_SCHEMA.items()
        if name not in ("time_s", "sensor_id", "kind", "range_m")
    ).select(list(MEASUREMENT_SCHEMA)).write_parquet(path)
    return Recording(path)


def _replay(recording: Recording, destination: MemoryDestination, plan: ReplayPlan) -> Replay:
    clock = FixedClock()
    return Replay(recording, destination, plan, clock, clock.advance)


@pytest.mark.parametrize("batch_rows", [1, 3, 10, 1000])
def test_every_row_arrives_once_and_in_order(tmp_path: Path, batch_rows: int) -> None:
    recording = _recording(tmp_path, [float(n) for n in range(10)])
    destination = MemoryDestination()
    counts = _replay(recording, destination, ReplayPlan(batch_rows=batch_rows)).run()
    arrived = pl.concat(destination.batches.values())
    assert arrived["range_m"].to_list() == [float(n) for n in range(10)]
    assert (counts.read, counts.accepted, counts.rejected, counts.duplicate) == (10, 10, 0, 0)
    assert len(destination.flushes) == 1


def test_a_lost_answer_is_asked_for_again_and_the_batch_taken_once(tmp_path: Path) -> None:
    recording = _recording(tmp_path, [float(n) for n in range(6)])
    destination = MemoryDestination(lost_answers=[UnavailableError("gone"), UnavailableError("x")])
    counts = _replay(recording, destination, ReplayPlan(batch_rows=2)).run()
    assert pl.concat(destination.batches.values())["range_m"].to_list() == [0, 1, 2, 3, 4, 5]
    assert counts.retries == 2
    assert (counts.read, counts.accepted, counts.duplicate) == (6, 4, 2)


def test_the_same_recording_sent_again_is_all_duplicates(tmp_path: Path) -> None:
    recording = _recording(tmp_path, [float(n) for n in range(6)])
    destination = MemoryDestination()
    plan = ReplayPlan(batch_rows=4)
    _replay(recording, destination, plan).run()
    counts = _replay(recording, destination, plan).run()
    assert (counts.read, counts.accepted, counts.duplicate) == (6, 0, 6)
    renamed = _replay(recording, destination, ReplayPlan(batch_rows=4, run_name="again")).run()
    assert renamed.accepted == 6


def _waiting(
    recording: Recording, destination: MemoryDestination, away_max_s: float
) -> tuple[Replay, list[float], list[str]]:
    clock = FixedClock()
    pauses: list[float] = []
    said: list[str] = []

    def pause(seconds: float) -> None:
        pauses.append(seconds)
        clock.advance(seconds)

    plan = ReplayPlan(batch_rows=1, away_max_s=away_max_s)
    return Replay(recording, destination, plan, clock, pause, on_wait=said.append), pauses, said


def test_a_service_that_never_answered_is_given_up_within_seconds(tmp_path: Path) -> None:
    destination = MemoryDestination(failures=[UnavailableError("no connection")] * 50)
    replay, pauses, said = _waiting(_recording(tmp_path, [0.0]), destination, 120.0)
    with pytest.raises(PeerError) as fault:
        replay.run()
    assert str(fault.value) == (
        "no connection; gave up after 5 s; start the service with `multiradar serve`, or specify "
        "its address with --to"
    )
    assert said == ["no connection; retrying for 5 s"]
    assert pauses == pytest.approx([0.1, 0.2, 0.4, 0.8, 1.6, 1.9])
    assert sum(pauses) == pytest.approx(FIRST_CONTACT_S)
    assert not destination.batches


def test_no_time_to_wait_is_one_attempt(tmp_path: Path) -> None:
    destination = MemoryDestination(failures=[UnavailableError("no connection")] * 2)
    replay, pauses, said = _waiting(_recording(tmp_path, [0.0]), destination, 0.0)
    with pytest.raises(PeerError, match="no connection; gave up after 0 s; start the service"):
        replay.run()
    assert (pauses, said, len(destination.failures)) == ([], [], 1)


def test_a_service_that_goes_away_is_waited_for_as_long_as_asked_for(tmp_path: Path) -> None:
    recording = _recording(tmp_path, [0.0, 1.0])
    destination = MemoryDestination(lost_answers=[UnavailableError("gone", answered=True)])
    replay, pauses, said = _waiting(recording, destination, 20.0)

    def fail(_counts: object) -> None:
        destination.failures += [UnavailableError("away")] * 100

    replay.on_batch = fail
    with pytest.raises(PeerError, match=r"^away; gave up after 20 s$"):
        replay.run()
    assert said == [
        "gone; retrying for 20 s",
        "the service responded after 0 s; the replay continues",
        "away; retrying for 20 s",
    ]
    assert sum(pauses[1:]) == pytest.approx(20.0)


def test_a_returning_service_is_reported_once_and_the_next_wait_restarts(
    tmp_path: Path,
) -> None:
    destination = MemoryDestination(failures=[UnavailableError("away")] * 3)
    replay, _, said = _waiting(_recording(tmp_path, [0.0]), destination, 20.0)
    assert replay.run().retries == 3
    assert said == [
        "away; retrying for 5 s",
        "the service responded after 1 s; the replay continues",
    ]


def test_a_service_that_is_starting_is_waited_for_as_long_as_it_says_so(tmp_path: Path) -> None:
    starts = ["compiling: 1 of 3"] * 100 + ["compiling: 2 of 3"] * 100
    busy = UnavailableError("503", 1.0, answered=True)
    destination = MemoryDestination(failures=[busy] * 202, starts=starts)
    replay, pauses, said = _waiting(_recording(tmp_path, [0.0]), destination, 3.0)
    assert replay.run().accepted == 1
    assert said == [
        "503: the service is starting: compiling: 1 of 3; waiting",
        "503: the service is starting: compiling: 2 of 3; waiting",
        "503; retrying for 3 s",
        "the service responded after 202 s; the replay continues",
    ]
    assert pauses == [1.0] * 202


def test_a_service_that_takes_nothing_is_given_up_though_it_answers(tmp_path: Path) -> None:
    full = UnavailableError("507", 1.0, answered=True)
    destination = MemoryDestination(failures=[full] * 50)
    replay, pauses, _ = _waiting(_recording(tmp_path, [0.0]), destination, 3.5)
    with pytest.raises(PeerError, match=r"^507; gave up after 3.5 s$"):
        replay.run()
    assert pauses == [1.0, 1.0, 1.0, 0.5]


def test_a_permanent_rejection_is_not_retried(tmp_path: Path) -> None:
    destination = MemoryDestination(failures=[PeerError("wrong form")])
    with pytest.raises(PeerError, match="wrong form"):
        _replay(_recording(tmp_path, [0.0]), destination, ReplayPlan()).run()
    assert not destination.batches


def test_the_end_of_the_stream_is_retried_too_and_can_be_left_out(tmp_path: Path) -> None:
    recording = _recording(tmp_path, [])
    destination = MemoryDestination(failures=[UnavailableError("busy", 0.0)])
    _replay(recording, destination, ReplayPlan()).run()
    assert len(destination.flushes) == 1
    silent = MemoryDestination()
    _replay(recording, silent, ReplayPlan(flush=False)).run()
    assert not silent.flushes


def test_what_the_service_asks_for_is_honoured_within_a_bound() -> None:
    assert backoff_s(0, 3.0) == 3.0
    assert backoff_s(0, 1e9) == RETRY_AFTER_MAX_S
    assert backoff_s(10_000, None) == BACKOFF_MAX_S


@pytest.mark.parametrize(("speed", "duration_s"), [(1.0, 20.0), (10.0, 2.0)])
def test_data_time_passes_at_the_speed_asked_for(
    tmp_path: Path, speed: float, duration_s: float
) -> None:
    recording = _recording(tmp_path, [100.0 + n for n in range(21)])
    clock = FixedClock()
    sent: list[tuple[float, float]] = []
    replay = Replay(
        recording,
        MemoryDestination(),
        ReplayPlan(speed=speed),
        clock,
        clock.advance,
        lambda counts: sent.append((clock.now_s(), counts.data_time_s or 0.0)),
    )
    replay.run()
    # The data time of a batch is its median: half a batch of slack at either end.
    assert clock.now_s() == pytest.approx(duration_s, abs=2.0 / speed)
    for now_s, data_time_s in sent:
        assert now_s == pytest.approx((data_time_s - sent[0][1]) / speed, abs=1e-9)


def test_one_measurement_from_the_future_does_not_stop_the_replay(tmp_path: Path) -> None:
    recording = _recording(tmp_path, [0.0, 1.0, 1e10, 2.0, 3.0])
    clock = FixedClock()
    Replay(recording, MemoryDestination(), ReplayPlan(speed=1.0), clock, clock.advance).run()
    assert clock.now_s() <= SILENCE_MAX_S + 3.0


def test_batches_go_on_over_the_blocks_of_the_reader(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = _recording(tmp_path, [0.1 * n for n in range(100)])
    monkeypatch.setattr(recording_module, "BLOCK_ROWS", 10)
    batches = list(replay_batches(recording, None, 5, 1e9))
    assert [(batch.first_row, batch.last_row) for batch in batches] == [
        (n, n + 4) for n in range(0, 100, 5)
    ]


def test_a_batch_spans_no_more_data_time_than_asked_for(tmp_path: Path) -> None:
    recording = _recording(tmp_path, [0.3 * n for n in range(50)])
    for batch in replay_batches(recording, None, 1000, 1.0):
        times = batch.frame["time_s"].to_numpy()
        assert times.max() - times.min() <= 1.0


def test_the_run_name_follows_the_bytes_and_the_kinds(tmp_path: Path) -> None:
    recording = _recording(tmp_path, [0.0, 1.0], ["radar", "adsb"])
    assert derived_run_name(recording, None) != derived_run_name(recording, {"radar"})
    assert derived_run_name(recording, {"radar"}) == derived_run_name(recording, ["radar"])


def test_an_answer_that_does_not_add_up_stops_the_replay(tmp_path: Path) -> None:
    class Forgetful(MemoryDestination):
        def send(self, frame: pl.DataFrame, key: str) -> Answer:
            return Answer(accepted=len(frame) - 1, rejected=0, duplicate=False)

    with pytest.raises(PeerError, match="expected a response for 2 measurements"):
        _replay(_recording(tmp_path, [0.0, 1.0]), Forgetful(), ReplayPlan()).run()


def test_sensors_that_the_service_does_not_know_are_counted_by_name(tmp_path: Path) -> None:
    recording = _recording(tmp_path, [float(n) for n in range(10)])
    destination = MemoryDestination(sensors=("2-2",))
    counts = _replay(recording, destination, ReplayPlan(batch_rows=3)).run()
    assert (counts.accepted, counts.rejected) == (0, 10)
    assert counts.unknown_sensors == {"1-1": 10}
    known = MemoryDestination(sensors=("1-1",))
    assert _replay(recording, known, ReplayPlan()).run().unknown_sensors == {}


def test_a_stream_that_goes_on_is_no_failure(tmp_path: Path) -> None:
    destination = MemoryDestination(failures=[StreamGoesOnError("41-10 deliver real-time data")])
    replay = _replay(_recording(tmp_path, []), destination, ReplayPlan())
    said: list[str] = []
    replay.on_wait = said.append
    replay.run()
    assert said == ["41-10 deliver real-time data"]
