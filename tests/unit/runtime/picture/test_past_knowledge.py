"""What the service answers of a past time is what it answered then."""

from dataclasses import replace
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.clock import FixedClock
from multiradar.errors import TrajectoryError
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.memory.state_board import StateBoard
from multiradar.runtime.picture.air_picture import AirPicture, Asked
from multiradar.runtime.picture.past import PastAsked
from multiradar.runtime.picture.past_knowledge import PastKnowledge
from multiradar.runtime.picture.past_sensors import past_sensors
from multiradar.runtime.queries.registry import (
    ENCOUNTERS,
    FORECAST,
    OBSERVABILITY,
    PLOTS,
    QUERIES,
    RESIDUALS,
    TRAJECTORIES,
    Query,
)
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from support.inputs.picture_frames import Tables, decoded
from support.scenarios.live_scene import START_S, recording, sensors

TABLE = sensors()
#: Until then measurements come before the first questions.
THEN_S = START_S + 120.0


class _Air:
    """Knowledge of an engine up to a time, and later."""

    def __init__(self) -> None:
        settings = TrackingSettings()
        self.engine = Engine(TABLE, settings, sampling=Sampling.ALL)
        self.known = Knowledge(TABLE, settings, RuntimeLimits())
        self.known.attach(lambda: (self.engine.tracks(), self.engine.plane))
        self.picture = AirPicture(self.known, FixedClock())
        self.frame = recording(4000).sort("time_s")

    def push(self, after_s: float, until_s: float) -> None:
        times = pl.col("time_s")
        rows = self.frame.filter((times > after_s) & (times <= until_s))
        output = self.engine.push(measurement_batch(rows, TABLE)[0])
        # The last measurements wait to be put in order.
        self.then_s = float(output.updates.time_s.max())
        self.known.absorb(output, self.then_s)

    def ask(
        self, query: Query, track: int | None = None, at_s: float | None = None, **given: Any
    ) -> Any:
        past = PastKnowledge(self.known, self.picture.retained, at_s or 0.0)
        return query.ask(self.known if at_s is None else past, track, given)


def test_answers_of_the_past_are_those_of_then() -> None:
    air = _Air()
    air.push(0.0, THEN_S)
    track = int(air.known.tracks().filter(pl.col("state") == "confirmed")["track_id"][0])
    asked: list[tuple[Query, int | None, dict[str, Any]]] = [
        (PLOTS, track, {}),
        (RESIDUALS, None, {}),
        (OBSERVABILITY, track, {}),
        (FORECAST, track, {"horizon_s": 60.0}),
        (ENCOUNTERS, None, {"distance_m": 30_000.0}),
    ]
    before = [air.ask(query, of, **given) for query, of, given in asked]
    shown, _ = decoded_tracks(air.picture.frame(Asked()))
    state = air.known.sensor_records()
    then_s = air.then_s
    air.push(THEN_S, START_S + 300.0)
    after = [air.ask(query, of, then_s, **given) for query, of, given in asked]
    assert after[:3] == before[:3]
    first, second = (one["points"][-1] for one in (before[3], after[3]))
    assert second["time_s"] == pytest.approx(first["time_s"], abs=0.01)
    assert second["latitude_deg"] == pytest.approx(first["latitude_deg"], abs=0.005)
    assert len(before[4]["encounters"]) > 3
    pairs = [{(one["first_track_id"], one["second_track_id"]) for one in answer["encounters"]}
             for answer in (before[4], after[4])]  # fmt: skip
    assert len(pairs[0] & pairs[1]) > 0.8 * len(pairs[0] | pairs[1])
    past, plots = decoded_tracks(air.picture.past(PastAsked(then_s)))
    assert len(plots["time_s"]) > 0
    for name in ("track_id", "sigma_major_m", "sigma_minor_m", "latitude_deg", "state"):
        np.testing.assert_allclose(past[name], shown[name], rtol=1e-4, equal_nan=False)
    for then, now in zip(past_sensors(air.picture.retained, then_s), state, strict=True):
        for name in ("id", "health", "biases", "last_update_s"):
            assert then[name] == now[name]


def decoded_tracks(frame: bytes) -> tuple[dict[str, Any], dict[str, Any]]:
    tables: Tables = decoded(frame)[1]
    return tables["tracks"], tables["plots"]


def test_before_the_first_row_nothing_is_known() -> None:
    air = _Air()
    air.push(0.0, THEN_S)
    early_s = START_S - 100.0
    for query in QUERIES:
        if query.of_track:
            assert air.ask(query, 1, early_s) is None
    assert air.ask(ENCOUNTERS, None, early_s)["encounters"] == []
    assert air.ask(RESIDUALS, None, early_s)["sensors"] == []
    assert all(one["age_s"] is None for one in past_sensors(air.picture.retained, early_s))
    with pytest.raises(TrajectoryError, match="not retained"):
        air.ask(TRAJECTORIES, 1, THEN_S)


def test_a_track_without_a_stored_state_has_no_forecast_and_the_answer_says_so() -> None:
    air = _Air()
    air.push(0.0, THEN_S)
    first_s = float(air.known.past.oldest_s or 0.0)
    track = int(air.picture.retained.latest(first_s + 1.0)["track_id"][0])
    with pytest.raises(TrajectoryError, match=f"no state of track {track} .* every 8 s") as error:
        air.ask(FORECAST, track, first_s + 1.0)
    assert error.value.code == "NO_STATE"
    # Once a state is stored, it has one; a track that was never there is unknown.
    assert air.ask(FORECAST, track, air.then_s)["points"]
    assert air.ask(FORECAST, 10**6, first_s + 1.0) is None


def test_states_are_those_of_the_last_samples_within_their_memory() -> None:
    air = _Air()
    batch = measurement_batch(air.frame, TABLE)[0]
    samples = air.engine.push(batch).samples
    assert len(samples) > 10
    board = StateBoard(10**9)
    # A track that is missing in the last sample is that of the sample before.
    last = replace(samples[-1], states=samples[-1].states.at(np.arange(3)))
    board.append([*samples[:-1], last])
    found = board.at(-np.inf, last.time_s)
    assert found is not None
    assert found.track_id.tolist() == sorted(set(samples[-2].states.track_id.tolist()))
    newer = np.isin(found.track_id, last.states.track_id)
    assert (found.time_s[newer] > found.time_s[~newer].max()).any()
    np.testing.assert_allclose(found.mean[newer], last.states.mean, rtol=1e-6)
    assert found.mean.dtype == np.float64
    assert board.at(-np.inf, samples[0].time_s - 1.0) is None
    # Some fit; the oldest are gone.
    small = StateBoard(20_000)
    small.append(samples)
    assert small.at(-np.inf, samples[0].time_s) is None
    assert small.at(-np.inf, np.inf) is not None
