"""Tracks are counted as `tracks.parquet` and `transitions.parquet` show them."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.memory.track_tally import TrackTally
from multiradar.tracking.lifecycle.transitions import (
    CONFIRMED,
    ENDED,
    NO_TRACK,
    STARTED,
    TrackTransitions,
)
from multiradar.tracking.outputs import EngineOutput, TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from support.fakes.engine_outputs import End, Update, output_of
from support.scenarios.live_scene import recording, sensors

TABLE = sensors()


def _stepped(output: EngineOutput, steps: list[tuple[int, int]]) -> EngineOutput:
    count = len(steps)
    return replace(
        output,
        transitions=TrackTransitions(
            time_s=np.zeros(count),
            track_id=np.array([track for track, _ in steps], np.int64),
            transition=np.array([step for _, step in steps], np.int8),
            reason=np.zeros(count, np.int8),
            into_track_id=np.full(count, NO_TRACK, np.int64),
            last_update_s=np.zeros(count),
        ),
    )


def test_a_track_that_is_confirmed_again_is_one_and_ends_once() -> None:
    tally = TrackTally()
    # The second identifier was taken by a plot that could not be located.
    first = output_of([Update(1, 0.0, 1), Update(2, 0.0, 3), Update(3, 0.0, 4)])
    steps = [(1, STARTED), (1, CONFIRMED), (3, STARTED), (4, STARTED), (4, CONFIRMED)]
    tally.update(_stepped(first, steps))
    tally.update(_stepped(output_of([Update(4, 1.0, 1)]), [(1, CONFIRMED)]))
    assert tally.counts() == {
        "tracks_initiated": 3, "tracks_confirmed": 2, "tracks_confirmed_live": 2, "tracks_ended": 0,
    }  # fmt: skip
    tally.update(_stepped(output_of([End(2.0, 1), End(2.0, 3)]), [(1, ENDED), (3, ENDED)]))
    assert tally.counts() == {
        "tracks_initiated": 3, "tracks_confirmed": 2, "tracks_confirmed_live": 1, "tracks_ended": 2,
    }  # fmt: skip
    assert (tally.initiated, tally.confirmed) == (3, 2)
    assert tally.transitions == {
        "started": 3, "confirmed": 3, "ended_unconfirmed": 0, "ended_silent": 2, "merged": 0,
    }  # fmt: skip


def test_a_track_that_is_confirmed_and_ends_in_one_call_is_counted() -> None:
    tally = TrackTally()
    ended = output_of([Update(1, 0.0, 1), End(9.0, 1)])
    tally.update(_stepped(ended, [(1, CONFIRMED), (1, ENDED)]))
    assert (tally.confirmed, tally.counts()["tracks_confirmed_live"]) == (1, 0)


@pytest.mark.parametrize("hidden", [(), ("track_number", "mode_3a", "mode_s_address")])
def test_the_counts_of_a_run_are_those_of_its_rows(hidden: tuple[str, ...]) -> None:
    # Twice the plots of every third aircraft jump far away: tracks that are never confirmed.
    frame = recording(3000)
    alone = frame.filter(pl.int_range(pl.len()) % 97 == 0).with_columns(
        range_m=pl.col("range_m") * 1.4, track_number=pl.col("track_number") + 1000
    )
    engine, tally = Engine(TABLE, TrackingSettings(hidden_fields=hidden)), TrackTally()
    batch, _ = wire.measurement_batch(pl.concat([frame, alone]).sort("time_s"), TABLE)
    pieces = (batch.select(slice(start, start + 700)) for start in range(0, len(batch), 700))
    outputs = [*map(engine.push, pieces), engine.flush()]
    engine.close()
    for output in outputs:
        tally.update(output)
    rows = wire.tracks_frame(TrackUpdates.concatenate([one.updates for one in outputs]), TABLE)
    confirmed = rows.filter(pl.col("state") != "tentative")["track_id"].n_unique()
    assert tally.initiated == rows["track_id"].n_unique()
    assert tally.confirmed == confirmed
    assert 0 < confirmed < tally.initiated
