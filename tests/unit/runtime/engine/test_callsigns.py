"""Tracks have the last received callsign, which is not used for association."""

from dataclasses import fields, replace

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.payload import decode_rows, encode_rows
from multiradar.tracking.columns import rows_of, table_of
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.measurements.callsigns import callsign_texts, packed_callsigns
from support.inputs.messages import radar, sensors
from support.scenarios.scenes import Scene, make_scene, random_flights, three_radars

NAMELESS = ("track_number", "mode_s_address", "mode_3a")


@pytest.fixture(scope="module")
def scene() -> Scene:
    """A scenario in which every second plot has a callsign."""
    rng = np.random.default_rng(5)
    made = make_scene(rng, three_radars(), random_flights(rng, 4, 90.0))
    names = pl.Series([f"TST{number}" for number in made.batch.track_number.tolist()])
    callsigns = np.where(np.arange(len(made.batch)) % 2 == 0, packed_callsigns(names), -1)
    return replace(made, batch=replace(made.batch, callsign=callsigns))


def updates(scene: Scene, *hidden: str) -> TrackUpdates:
    engine = Engine(scene.sensors, TrackingSettings(hidden_fields=hidden))
    outputs = [engine.push(scene.batch), engine.flush()]
    engine.close()
    return TrackUpdates.concatenate([one.updates for one in outputs])


def test_a_track_has_the_last_received_callsign(scene: Scene) -> None:
    found = updates(scene)
    callsigns = callsign_texts(found.callsign).to_list()
    for track in np.unique(found.track_number).tolist():
        own = [callsigns[row] for row in np.flatnonzero(found.track_number == track).tolist()]
        first = own.index(f"TST{track}")
        assert first < 6
        assert own == [None] * first + [f"TST{track}"] * (len(own) - first)
    frame = wire.tracks_frame(found, scene.sensors)
    assert frame["callsign"].to_list() == callsigns


def test_callsigns_are_not_used_for_association(scene: Scene) -> None:
    silent = replace(scene, batch=scene.batch.without(("callsign",)))
    with_names, without = updates(scene, *NAMELESS), updates(silent, *NAMELESS)
    for field in fields(TrackUpdates):
        if field.name != "callsign":
            np.testing.assert_array_equal(
                getattr(with_names, field.name), getattr(without, field.name)
            )
    assert (with_names.callsign >= 0).any()
    assert not (without.callsign >= 0).any()


def test_a_hidden_callsign_is_published_as_measured(scene: Scene) -> None:
    found = updates(scene, "callsign")
    assert 0.4 < (found.callsign >= 0).mean() < 0.6


def test_the_history_keeps_callsigns(scene: Scene) -> None:
    found = updates(scene)
    np.testing.assert_array_equal(table_of(TrackUpdates, rows_of(found)).callsign, found.callsign)


def test_a_journal_without_callsigns_is_replayed() -> None:
    table = wire.sensor_table(sensors())
    now = pl.DataFrame([radar(callsign="KLM1"), radar()])
    stored = decode_rows(encode_rows(now))
    assert stored["callsign"].to_list() == ["KLM1", None]
    batch, rejected = wire.measurement_batch(stored.drop("callsign"), table)
    assert (len(batch), len(rejected)) == (2, 0)
    assert batch.callsign.tolist() == [-1, -1]
