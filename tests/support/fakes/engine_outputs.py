"""Outputs of the engine, built row by row for tests of its consumers."""

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np

from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import (
    STATE_CONFIRMED,
    STATE_TENTATIVE,
    BiasRecords,
    EndedTracks,
    EngineOutput,
    StateSample,
    TrackPlots,
    TrackStates,
    TrackUpdates,
)

Columns = TypeVar("Columns", TrackUpdates, MeasurementBatch)


class Update(NamedTuple):
    """An update by a plot of sensor 0; its number is its sequence."""

    sequence: int
    time_s: float
    track_id: int
    confirmed: bool = True


class End(NamedTuple):
    """The end of a track."""

    time_s: float
    track_id: int


class Bias(NamedTuple):
    """A published estimate of the first parameter of sensor 0."""

    time_s: float
    estimate: float


class Sample(NamedTuple):
    """The end of an epoch with no states."""

    time_s: float
    epoch: int


NO_STATES = TrackStates(
    np.empty(0, np.int64), np.empty(0), np.empty((0, 4)), np.empty((0, 4, 4)), np.empty(0)
)
Event = Update | End | Bias | Sample


def output_of(events: Sequence[Event]) -> EngineOutput:
    """Return an output with these rows, each kind in its order."""
    updates = [one for one in events if isinstance(one, Update)]
    ends = [one for one in events if isinstance(one, End)]
    biases = [one for one in events if isinstance(one, Bias)]
    times = np.array([one.time_s for one in updates], np.float64)
    tracks = np.array([one.track_id for one in updates], np.int64)
    states = [STATE_CONFIRMED if one.confirmed else STATE_TENTATIVE for one in updates]
    empty, none = TrackUpdates.concatenate([]), MeasurementBatch.empty()
    return EngineOutput(
        updates=replace(
            _zeros(empty, len(updates)),
            sequence=np.array([one.sequence for one in updates], np.int64),
            time_s=times, track_id=tracks, state=np.array(states, np.int8),
        ),
        biases=BiasRecords(
            epoch=np.zeros(len(biases), np.int64),
            time_s=np.array([one.time_s for one in biases], np.float64),
            sensor=np.zeros(len(biases), np.int32),
            parameter=np.zeros(len(biases), np.int8),
            estimate=np.array([one.estimate for one in biases], np.float64),
            sigma=np.ones(len(biases)),
        ),
        ended=EndedTracks(
            track_id=np.array([one.track_id for one in ends], np.int64),
            time_s=np.array([one.time_s for one in ends], np.float64),
            reason=np.zeros(len(ends), np.int8),
            into_track_id=np.full(len(ends), -1, np.int64),
        ),
        plots=TrackPlots(tracks, replace(_zeros(none, len(updates)), time_s=times)),
        samples=tuple(
            StateSample(one.epoch, one.time_s, NO_STATES)
            for one in events
            if isinstance(one, Sample)
        ),
    )  # fmt: skip


def _zeros(empty: Columns, count: int) -> Columns:
    zeros: dict[str, Any] = {}
    for one in fields(empty):
        column = getattr(empty, one.name)
        zeros[one.name] = None if column is None else np.zeros(count, column.dtype)
    return type(empty)(**zeros)
